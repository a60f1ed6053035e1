//! Any bytes are read or refused by `parsers::tables`; they never bring the program down.
#![no_main]

#[path = "../../tests/tvse/parsers.rs"]
mod parsers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| parsers::tables(bytes));
