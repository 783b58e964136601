#![no_main]
//! cargo fuzz run trace: the importers of traces on any bytes.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| sollwert_fuzz::trace(bytes));
