#![no_main]
//! cargo fuzz run compare: two traces in one input, compared and drawn.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| sollwert_fuzz::compare(bytes));
