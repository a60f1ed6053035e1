//! No bytes make a reader panic, run for long or take more memory than the file accounts for.

use proptest::prelude::*;
use tvse::fem::{Results, read};

use super::fixture;
use super::memory::peak_of;

/// One file of each format and coding.
const FILES: [&str; 17] = [
    "model.h5",
    "model_little_32.op2",
    "model_big_32.op2",
    "model_little_64.op2",
    "model_big_64.op2",
    "undamped.op2",
    "model.pch",
    "undamped.pch",
    "model.bdf",
    "model_55.unv",
    "model_2414.unv",
    "model_0.frd",
    "model_3.frd",
    "calculix_binary.frd",
    "modes.csv",
    "nodes.csv",
    "systems.csv",
];

/// Most memory for a file: text grows by the fields of its lines; deflated tables by 1032 as zlib
/// documents, each once compressed, once as table and once as shapes. The HDF5 crate reserves for
/// the entries of a node at once, of which a 16-bit count tells up to 65535 (5.5 MB).
fn bound(bytes: &[u8]) -> usize {
    let hdf5 = bytes.starts_with(b"\x89HDF");
    if hdf5 { (16 << 20) + 3 * 1032 * bytes.len() } else { (1 << 20) + 64 * bytes.len() }
}

/// Reads and, if that succeeds, uses what was read.
fn survives(bytes: &[u8]) -> Option<Results> {
    let mut found = None;
    let peak = peak_of(|| found = read(bytes, "damaged").ok());
    assert!(peak <= bound(bytes), "{peak} bytes for a file of {}", bytes.len());
    if let Some(results) = &found {
        let _ = results.complete("damaged");
    }
    found
}

#[test]
fn files_cut_short_anywhere_are_refused_or_hold_less() {
    for name in FILES {
        let bytes = fixture(name);
        let whole = survives(&bytes).unwrap();
        // The large container in larger steps: it is the table of another crate.
        let step = if name == "model.h5" { 37 } else { 1 };
        for end in (0..bytes.len()).step_by(step) {
            let Some(found) = survives(&bytes[..end]) else { continue };
            let values = |results: &Results| {
                let shapes = results.modes.iter().map(|mode| mode.shape.len()).sum::<usize>();
                results.nodes.len() + shapes + results.systems.len()
            };
            assert!(values(&found) <= values(&whole), "{name} cut at {end}");
            // These end with a mark, so that a file cut short is never taken for a whole one.
            let marked = name.ends_with("op2") || name.ends_with("frd");
            assert!(!marked || end + 6 > bytes.len(), "{name} cut at {end}");
            // The superblock knows the length of the file.
            assert!(!name.ends_with("h5") || found.modes == whole.modes, "{name} cut at {end}");
        }
    }
}

#[test]
fn counts_beyond_the_file_are_refused_before_memory_is_taken() {
    // Number of nodes in the head of a block.
    let text = String::from_utf8(fixture("model_1.frd")).unwrap();
    let huge = text.replacen("           6 ", "999999999999 ", 1);
    assert_ne!(huge, text);
    assert!(survives(huge.as_bytes()).is_none());
    // Length of a Fortran block and number of words in a key.
    let bytes = fixture("model_little_32.op2");
    for at in 0..400 {
        let mut huge = bytes.clone();
        huge[at..at + 4].copy_from_slice(&0x7fff_fff0_i32.to_le_bytes());
        survives(&huge);
    }
    // Every group count of a universal file.
    let text = String::from_utf8(fixture("model_2414.unv")).unwrap();
    let huge = text.replacen("         3\ngimbal", " 999999999\ngimbal", 1);
    assert_ne!(huge, text);
    assert!(survives(huge.as_bytes()).is_none());
}

/// A file of the list, some of its bytes changed, a piece left out or repeated, its end cut.
fn mutated() -> impl Strategy<Value = Vec<u8>> {
    let place = || any::<prop::sample::Index>();
    let changes = prop::collection::vec((place(), any::<u8>()), 0..8);
    let piece = (place(), place(), any::<bool>());
    (prop::sample::select(&FILES[..]), changes, prop::option::of(piece), prop::option::of(place()))
        .prop_map(|(name, changes, piece, end)| {
            let mut bytes = fixture(name);
            for (at, value) in changes {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            if let Some((from, to, repeat)) = piece {
                let (a, b) = (from.index(bytes.len()), to.index(bytes.len()));
                let (from, to) = (a.min(b), a.max(b));
                if repeat {
                    let piece = bytes[from..to].to_vec();
                    bytes.splice(to..to, piece);
                } else {
                    bytes.drain(from..to);
                }
            }
            if let Some(end) = end
                && !bytes.is_empty()
            {
                bytes.truncate(end.index(bytes.len()));
            }
            bytes
        })
}

/// The start by which each format is recognised, then anything.
fn random() -> impl Strategy<Value = Vec<u8>> {
    let starts: [&[u8]; 9] = [
        b"",
        b"\x89HDF\r\n\x1a\n",
        b"\x04\0\0\0\x03\0\0\0\x04\0\0\0",
        b"\0\0\0\x08\0\0\0\0\0\0\0\x02\0\0\0\x08",
        b"    1C\n    2C",
        b"    -1\n  2411\n",
        b"$TITLE   =\n$EIGENVECTOR\n$EIGENVALUE =  1.0E+00  MODE =     1\n",
        b"node,x,y,z\n",
        b"BEGIN BULK\nGRID    ",
    ];
    (prop::sample::select(starts.to_vec()), prop::collection::vec(any::<u8>(), 0..600))
        .prop_map(|(start, rest)| [start, &rest].concat())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_files_are_read_or_refused(bytes in mutated()) {
        survives(&bytes);
    }

    #[test]
    fn random_bytes_are_read_or_refused(bytes in random()) {
        survives(&bytes);
    }
}
