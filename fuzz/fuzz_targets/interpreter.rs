#![no_main]
//! cargo fuzz run interpreter: a program of any bytes, executed up to a budget.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| sollwert_fuzz::interpreter(bytes));
