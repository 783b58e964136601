#![no_main]
//! cargo fuzz run text: lexer, parser, fast path and printer on any bytes.

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| sollwert_fuzz::text(bytes));
