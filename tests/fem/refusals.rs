//! What cannot be used is refused, and the message says why.

use std::fmt::Write as _;

use tvse::fem::read;
use tvse::problem::Kind;

use super::{fixture, results};

fn refusal(bytes: &[u8], name: &str) -> (Kind, String) {
    let problems = read(bytes, name).expect_err(name);
    (problems.kind(), problems.to_string())
}

/// A fixture is refused with a message that holds the given words.
fn refused(name: &str, words: &str) {
    let (kind, told) = refusal(&fixture(name), name);
    assert_eq!(kind, Kind::Input, "{told}");
    assert!(told.contains(words), "{told}");
}

/// A text fixture with a part of it replaced.
fn changed(name: &str, from: &str, to: &str) -> Vec<u8> {
    let text = String::from_utf8(fixture(name)).unwrap();
    assert!(text.contains(from), "{name} holds no {from}");
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn complex_eigenvectors_are_refused_in_every_format() {
    for name in ["complex.op2", "complex.pch", "complex.h5"] {
        refused(name, "complex eigenvectors");
    }
    let universal = changed(
        "model_55.unv",
        "         1         2         3         8         2",
        "         1         2         3         8         5",
    );
    assert!(refusal(&universal, "u.unv").1.contains("complex eigenvectors"));
    let new = changed(
        "model_2414.unv",
        "         1         2         3         8         4",
        "         1         7         3         8         6",
    );
    assert!(refusal(&new, "u.unv").1.contains("complex eigenvectors"));
    let text = String::from_utf8(fixture("model_1.frd")).unwrap();
    let (before, after) = text.rsplit_once(" -4  DISP ").unwrap();
    let imaginary = format!("{before} -4  DISPI{after}");
    assert!(refusal(imaginary.as_bytes(), "u.frd").1.contains("complex eigenvectors"));
    // A decaying root.
    let decay = changed("undamped.pch", "(  0.0000000E+00", "( -1.0000000E-01");
    assert!(refusal(&decay, "u.pch").1.contains("complex eigenvectors"));
}

#[test]
fn results_of_superelements_are_refused() {
    for name in ["superelement.op2", "superelement.pch", "superelement.h5"] {
        refused(name, "results of superelement 12");
    }
    // The residual structure is superelement 0.
    let residual = changed("model.pch", "$SUBTITLE=  ", "$SUBTITLE=SUPERELEMENT 0");
    assert_eq!(read(&residual, "r.pch").unwrap().modes.len(), 3);
}

#[test]
fn eigenvectors_by_point_and_of_two_subcases_are_refused() {
    refused("sort2.op2", "SORT2");
    refused("two_subcases.op2", "subcases {1, 2}");
    let text = String::from_utf8(fixture("model.pch")).unwrap();
    let second = text.replace("$SUBCASE ID =           1", "$SUBCASE ID =           2");
    let (_, told) = refusal(format!("{text}{second}").as_bytes(), "two.pch");
    assert!(told.contains("subcases 1, 2"), "{told}");
    // The same subcase twice has the same mode numbers twice.
    let (_, told) = refusal(format!("{text}{text}").as_bytes(), "twice.pch");
    assert!(told.contains("two eigenvectors"), "{told}");
    let by_point = changed("model.pch", "$SUBCASE ID =           1", "$POINT ID =             1");
    assert!(refusal(&by_point, "p.pch").1.contains("SORT2"));
}

#[test]
fn residual_vectors_among_the_modes_are_told() {
    let augmented = results("residual.h5");
    assert!(augmented.warnings.iter().any(|w| w.contains("after augmentation")));
    let massless = changed("modes.csv", "3,40.0,2.0", "3,40.0,0.0");
    let massless = String::from_utf8(massless).unwrap().replace("3,40.0,2.0", "3,40.0,0.0");
    let found = read(massless.as_bytes(), "modes.csv").unwrap();
    assert!(found.warnings[0].starts_with("modes 3 look like residual"), "{:?}", found.warnings);
}

#[test]
fn formats_that_are_not_read_say_what_was_tried() {
    for (bytes, words) in [
        (&b""[..], "an empty file"),
        (b"PK\x03\x04....", "a compressed file"),
        (b"\x1f\x8b....", "a compressed file"),
        (b"1  M S C   N A S T R A N  \nR E A L   E I G E N V E C T O R", "F06"),
        (b"PAR1....", "Parquet"),
        (b"hello, world\n1,2\n", "not recognised"),
    ] {
        let (kind, told) = refusal(bytes, "file");
        assert_eq!(kind, Kind::Input);
        assert!(told.contains(words), "{told}");
        assert!(told.contains("CalculiX frd; CSV tables"), "{told}");
    }
}

#[test]
fn grids_without_results_and_missing_coordinate_systems_are_told() {
    let deck = results("model.bdf");
    let told = deck.complete("model.bdf").unwrap_err().to_string();
    assert!(told.contains("grids without results"), "{told}");
    let mut punch = results("model.pch");
    let without = changed("model.bdf", "cord1r,30,1,2,3\n", "");
    punch.merge(read(&without, "w.bdf").unwrap(), "w.bdf").unwrap();
    let told = punch.complete("w.bdf").unwrap_err().to_string();
    assert!(told.contains("coordinate system 30: found no definition, but node 3 names"), "{told}");
    let mut nested = results("model.h5");
    nested.systems.remove(&10);
    let told = nested.complete("model.h5").unwrap_err().to_string();
    assert!(told.contains("coordinate system 10"), "{told}");
    let mut foreign = results("model.pch");
    let other = b"node,x,y,z\n500,0,0,0\n";
    foreign.merge(read(other, "other.csv").unwrap(), "other.csv").unwrap();
    let told = foreign.complete("other.csv").unwrap_err().to_string();
    assert!(told.contains("at none of the grids"), "{told}");
}

#[test]
fn a_deck_names_included_files_and_tells_all_its_problems() {
    let deck = b"SOL 103\nCEND\nBEGIN BULK\nINCLUDE 'geom.inc'\nGRID,1,,0.,0.,0.\nENDDATA\n";
    let found = read(deck, "deck.bdf").unwrap();
    assert!(found.warnings[0].contains("includes geom.inc"), "{:?}", found.warnings);
    let only = b"SOL 103\nCEND\nBEGIN BULK\nINCLUDE 'geom.inc'\nENDDATA\n";
    let told = refusal(only, "deck.bdf").1;
    assert!(told.contains("geom.inc"), "{told}");
    let bad = b"BEGIN BULK\nGRID,x,,0.,0.,0.\nGRID,2,,zero,0.,0.\nCORD2R,5,,0.,0.,0.,0.,0.,1.\n";
    let told = refusal(bad, "deck.bdf").1;
    for words in ["line 2: GRID field 2", "line 3: GRID field 4", "line 4", "continuation"] {
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn defaults_of_grids_and_sections_of_superelements_are_respected() {
    let deck = b"BEGIN BULK\nGRDSET,,10,,,,20\nGRID,1,,0.,0.,0.\nGRID,2,0,0.,0.,0.,0\n\
        GRID\t3\t\t1.\t2.\t3.\nBEGIN SUPER=7\nGRID,4,,0.,0.,0.\nENDDATA\nGRID,5,,0.,0.,0.\n";
    let found = read(deck, "deck.bdf").unwrap();
    let systems: Vec<_> = found
        .nodes
        .iter()
        .map(|node| (node.id, node.position_system, node.displacement_system))
        .collect();
    assert_eq!(systems, [(1, 10, 20), (2, 0, 0), (3, 10, 20)]);
    assert_eq!(found.nodes[2].position, [1.0, 2.0, 3.0]);
    assert!(found.warnings[0].contains("superelements"));
}

#[test]
fn tables_tell_rows_and_columns_that_are_wrong() {
    for (text, words) in [
        ("node,x,y,z\n1,0,0\n", "line 2: found 3 fields"),
        ("node,x,y,z\n1,0,zero,0\n", "line 2: y: found \"zero\""),
        ("node,x,y,z\n1.5,0,0,0\n", "row 1: node: found 1.5"),
        ("node,x,y,z,colour\n1,0,0,0,5\n", "colour: found an unknown column"),
        ("node,x,x,y,z\n1,0,0,0,0\n", "\"x\" twice"),
        ("node,x,y,z\n1,0,0,0\n1,0,0,1\n", "node 1: found"),
        ("node,mass\n1,-2\n", "at least zero"),
        ("mode,frequency_hz,node,tx,ty,tz,rx\n1,2,3,0,0,1,0\n", "all or none"),
        ("mode,frequency_hz,node,tx,ty,tz\n1,2,3,0,0,1\n1,3,4,0,0,1\n", "the same on all rows"),
    ] {
        let told = refusal(text.as_bytes(), "t.csv").1;
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn an_hdf5_file_of_another_program_is_told_by_its_groups() {
    let mut bytes = fixture("model.h5");
    let at = bytes.windows(8).position(|part| part == b"NASTRAN\0").unwrap();
    bytes[at..at + 7].copy_from_slice(b"NOTHING");
    let told = refusal(&bytes, "x.h5").1;
    assert!(told.contains("the groups NOTHING"), "{told}");
}

#[test]
fn more_than_twenty_wrong_lines_are_not_all_told() {
    let mut deck = String::from("BEGIN BULK\n");
    for k in 0..1000 {
        writeln!(deck, "GRID,x{k},,0.,0.,0.").unwrap();
    }
    let problems = read(deck.as_bytes(), "deck.bdf").unwrap_err();
    assert!((20..=30).contains(&problems.0.len()), "{}", problems.0.len());
}
