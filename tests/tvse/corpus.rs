//! The corpus of the fuzz targets: every stored input is read or refused, and so are damaged copies.

use crate::parsers;
use std::path::Path;

fn each(name: &str, parse: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(name);
    let mut read = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let whole = std::fs::read(entry.unwrap().path()).unwrap();
        parse(&whole);
        // Cut short, and with single bytes changed, at places spread over the input.
        let step = (whole.len() / 40).max(1);
        for at in (0..whole.len()).step_by(step) {
            parse(&whole[..at]);
            let mut changed = whole.clone();
            changed[at] = changed[at].wrapping_add(0x55);
            parse(&changed);
        }
        read += 1;
    }
    assert!(read >= 3, "{name}: {read}");
}

#[test]
fn texts_of_the_corpus_are_read_or_refused() {
    each("texts", parsers::texts);
}

#[test]
fn tables_of_the_corpus_are_read_or_refused() {
    each("tables", parsers::tables);
}

#[test]
fn shards_of_the_corpus_are_read_or_refused() {
    each("shards", parsers::shards);
}
