//! Any bytes are read or refused: no panic, no endless loop, no memory that the file does not
//! account for (libFuzzer stops at 2 GB by itself).

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(results) = tvse::fem::read(bytes, "fuzz") {
        let _ = results.complete("fuzz");
    }
});
