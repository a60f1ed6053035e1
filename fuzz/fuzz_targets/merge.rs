//! Two parts of any content are put together or refused.

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((first, rest)) = bytes.split_first() else { return };
    let at = usize::from(*first) * rest.len() / 255;
    let (one, other) = rest.split_at(at);
    let (Ok(mut one), Ok(other)) = (tvse::fem::read(one, "one"), tvse::fem::read(other, "other"))
    else {
        return;
    };
    if one.merge(other, "other").is_ok() {
        let _ = one.complete("both");
    }
});
