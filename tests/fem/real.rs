//! Files that real programs wrote, against pyNastran's reading of them, against printed output and
//! against each other.
//!
//! They lie in the folder that `TVSE_FEM_DATA` names, else in `../shared/data/fem` beside the
//! repository; without it these tests say so and pass. What pyNastran reads is stored in
//! `tests/data/fem/expected` by `tests/python/fem_expected.py`.

use std::path::PathBuf;

use tvse::fem::{NodeShape, Precision, RawMode, Results, read};

use super::{fixture, results};

/// Largest relative rounding of a number in single precision.
const SINGLE: f64 = 1.0 / (1_u32 << 24) as f64;

fn real(name: &str) -> Option<Vec<u8>> {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data/fem");
    let folder = std::env::var("TVSE_FEM_DATA").map_or(beside, PathBuf::from);
    let path = folder.join(name);
    match std::fs::read(&path) {
        Ok(bytes) => Some(bytes),
        Err(error) => {
            eprintln!("skipped: {}: {error} (set TVSE_FEM_DATA)", path.display());
            None
        }
    }
}

fn real_results(name: &str) -> Option<Results> {
    Some(read(&real(name)?, name).unwrap_or_else(|problems| panic!("{problems}")))
}

/// Nodes and the stored shapes are those that pyNastran reads, bit for bit.
fn as_pynastran_reads(found: &Results, name: &str) {
    let nodes = results(&format!("expected/{name}_nodes.csv"));
    assert_eq!(found.nodes, nodes.nodes);
    for expected in &results(&format!("expected/{name}_modes.csv")).modes {
        let mode = found.modes.iter().find(|mode| mode.number == expected.number).unwrap();
        assert_eq!(mode.shape, expected.shape, "mode {}", expected.number);
    }
}

/// Lines of `mode,frequency_hz,generalised_mass` as pyNastran reads them.
fn summary(name: &str) -> Vec<(i64, f64, f64)> {
    let text = String::from_utf8(fixture(&format!("expected/{name}_summary.csv"))).unwrap();
    let line = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        (fields[0].parse().unwrap(), fields[1].parse().unwrap(), fields[2].parse().unwrap())
    };
    text.lines().skip(1).map(line).collect()
}

fn agrees_with_summary(found: &Results, name: &str) {
    let lines: Vec<_> = found
        .modes
        .iter()
        .map(|mode| (mode.number, mode.frequency_hz, mode.generalised_mass.unwrap()))
        .collect();
    assert_eq!(lines, summary(name));
}

/// Eigenvectors of printed output, of grids only; `complex` has a line of imaginary parts below.
fn printed(text: &str, complex: bool) -> Vec<RawMode> {
    let mut modes: Vec<RawMode> = Vec::new();
    let mut reading = false;
    for line in text.lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        if let Some((_, number)) = line.split_once("E I G E N V E C T O R") {
            let number = number.trim().trim_start_matches(|c: char| !c.is_ascii_digit());
            let number = number.trim().parse().unwrap();
            if modes.last().is_none_or(|mode| mode.number != number) {
                let shape = Vec::new();
                modes.push(RawMode { number, frequency_hz: 0.0, generalised_mass: None, shape });
            }
            reading = true;
        } else if line.starts_with('1') {
            reading = false;
        } else if reading {
            let fields =
                if complex && fields.first() == Some(&"0") { &fields[1..] } else { &fields };
            if fields.len() == 8 && fields[1] == "G" {
                let u: Vec<f64> = fields[2..].iter().map(|x| x.parse().unwrap()).collect();
                modes.last_mut().unwrap().shape.push(NodeShape {
                    node: fields[0].parse().unwrap(),
                    translation: [u[0], u[1], u[2]],
                    rotation: Some([u[3], u[4], u[5]]),
                });
            }
        }
    }
    modes
}

/// The same numbers but for a relative rounding and, near zero, a part of the largest.
fn close(found: &[RawMode], expected: &[RawMode], relative: f64, of_largest: f64) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!((found.number, found.shape.len()), (expected.number, expected.shape.len()));
        let all = |shape: &NodeShape| {
            let rotation = shape.rotation.unwrap();
            shape.translation.into_iter().chain(rotation).collect::<Vec<_>>()
        };
        let largest = expected.shape.iter().flat_map(all).fold(0.0_f64, |a, b| a.max(b.abs()));
        for (a, b) in found.shape.iter().zip(&expected.shape) {
            assert_eq!(a.node, b.node);
            for (x, y) in all(a).into_iter().zip(all(b)) {
                let allowed = relative * y.abs() + of_largest * largest;
                assert!((x - y).abs() <= allowed, "mode {} node {}: {x} {y}", found.number, a.node);
            }
        }
    }
}

#[test]
fn the_free_free_model_has_278_modes_at_49_grids_as_pynastran_reads_them() {
    let Some(found) = real_results("pyyeti/full.op2") else { return };
    assert_eq!((found.modes.len(), found.nodes.len()), (278, 49));
    as_pynastran_reads(&found, "full");
    agrees_with_summary(&found, "full");
    assert_eq!(found.complete("full.op2"), Ok(()));
    // The eigenvalues are those before augmentation: no residual vectors among them.
    assert_eq!(found.warnings, [""; 0]);
    assert_eq!((found.program.as_str(), found.precision), ("Nastran OP2 NX9.1", Precision::Single));
    // Six rigid-body modes, then the circular frequencies that the data set is known by.
    let rate = |k: usize| found.modes[k].frequency_hz * std::f64::consts::TAU;
    assert!((0..6).all(|k| rate(k).abs() < 1e-3));
    for (k, known) in (6..).zip([10.674, 11.105, 11.672, 21.486]) {
        // Three decimals are printed.
        assert!((rate(k) - known).abs() <= 0.000_5 + 1e-6, "{}", rate(k));
    }
}

#[test]
fn the_deck_of_the_free_free_model_has_the_grids_of_its_results() {
    let Some(deck) = real_results("pyyeti/full.dat") else { return };
    let mut found = real_results("pyyeti/full.op2").unwrap();
    assert_eq!(deck.nodes.len(), 49);
    found.merge(deck, "full.dat").unwrap();
    assert_eq!(found.nodes.len(), 49);
}

/// The six numbers of every node one after another.
fn vector(mode: &RawMode) -> Vec<f64> {
    let numbers = |shape: &NodeShape| shape.translation.into_iter().chain(shape.rotation.unwrap());
    mode.shape.iter().flat_map(numbers).collect()
}

/// Largest distance of `y` from the plane that `a` and `b` span, as a part of its largest number.
fn off_the_plane(y: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let along = dot(a, b) / dot(a, a);
    let c: Vec<f64> = b.iter().zip(a).map(|(b, a)| b - along * a).collect();
    let (s, t) = (dot(y, a) / dot(a, a), dot(y, &c) / dot(&c, &c));
    let off = (0..y.len()).map(|k| (y[k] - s * a[k] - t * c[k]).abs()).fold(0.0, f64::max);
    off / y.iter().fold(0.0, |largest: f64, y| largest.max(y.abs()))
}

#[test]
fn the_beam_is_the_same_in_both_op2_files_and_in_print() {
    let Some(first) = real_results("pynastran/beam_modes_m1.op2") else { return };
    let second = real_results("pynastran/beam_modes_m2.op2").unwrap();
    as_pynastran_reads(&first, "beam_modes_m1");
    as_pynastran_reads(&second, "beam_modes_m2");
    agrees_with_summary(&first, "beam_modes_m1");
    agrees_with_summary(&second, "beam_modes_m2");
    assert_eq!(first.modes, second.modes);
    let text = String::from_utf8_lossy(&real("pynastran/beam_modes.f06").unwrap()).into_owned();
    let printed = printed(&text, false);
    assert_eq!(printed.len(), 10);
    // Seven printed digits, single precision, and rounding of the solver near zero.
    close(&first.modes[4..6], &printed[4..6], 0.5e-6 + SINGLE, 1e-12);
    // The other modes come in pairs of one frequency, of which the run printed other combinations.
    for pair in [0, 2, 6, 8] {
        let (a, b) = (vector(&first.modes[pair]), vector(&first.modes[pair + 1]));
        for printed in &printed[pair..pair + 2] {
            // Each of the three vectors is rounded, the pair enters with factors near one.
            let off = off_the_plane(&vector(printed), &a, &b);
            assert!(off <= 3.0 * (0.5e-6 + SINGLE), "mode {}: {off}", printed.number);
        }
    }
    let cycles: Vec<f64> = text
        .lines()
        .filter_map(|line| line.trim().strip_prefix("CYCLES ="))
        .map(first_number)
        .collect();
    assert_eq!(cycles.len(), 10);
    for (mode, printed) in first.modes.iter().zip(cycles) {
        assert!((mode.frequency_hz / printed - 1.0).abs() <= 0.5e-6 + SINGLE);
    }
}

fn first_number(text: &str) -> f64 {
    text.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn the_free_free_model_has_the_printed_eigenvalues() {
    let Some(text) = real("pyyeti/full.out") else { return };
    let found = real_results("pyyeti/full.op2").unwrap();
    let text = String::from_utf8_lossy(&text).into_owned();
    let mut compared = 0;
    let mut table = false;
    for line in text.lines() {
        table =
            (table || line.contains("R E A L   E I G E N V A L U E S")) && !line.starts_with('1');
        let fields: Vec<&str> = line.split_whitespace().collect();
        if !table || fields.len() != 7 || fields[0].parse::<usize>().is_err() {
            continue;
        }
        let mode = &found.modes[fields[0].parse::<usize>().unwrap() - 1];
        let (cycles, mass): (f64, f64) = (fields[4].parse().unwrap(), fields[5].parse().unwrap());
        // Seven printed digits; the cycles are printed without the sign of the eigenvalue.
        assert!((mode.frequency_hz.abs() / cycles - 1.0).abs() <= 0.5e-6 + SINGLE, "{line}");
        assert_eq!(mode.frequency_hz < 0.0, fields[2].starts_with('-'), "{line}");
        assert!((mode.generalised_mass.unwrap() / mass - 1.0).abs() <= 0.5e-6 + SINGLE);
        compared += 1;
    }
    assert_eq!(compared, 278);
}

#[test]
fn hdf5_of_the_element_test_is_read_as_h5py_reads_it_and_has_the_grids_of_the_op2() {
    let Some(hdf5) = real_results("pynastran/modes_elements.h5") else { return };
    let op2 = real_results("pynastran/modes_elements.op2").unwrap();
    as_pynastran_reads(&hdf5, "modes_elements_h5");
    as_pynastran_reads(&op2, "modes_elements_op2");
    // The later run has one grid more.
    let without_new: Vec<_> = hdf5.nodes.iter().copied().filter(|node| node.id != 70).collect();
    assert_eq!(without_new, op2.nodes);
    assert_eq!(hdf5.systems, op2.systems);
    // Three mechanisms at zero frequency, of which the two versions of the program found different
    // ones: only grids 28, 29, 30, 32 and 33 move in either.
    for results in [&hdf5, &op2] {
        assert_eq!(results.modes.iter().map(|mode| mode.number).collect::<Vec<_>>(), [1, 2, 3]);
        for mode in &results.modes {
            assert!(mode.frequency_hz.abs() < 1e-6);
            assert_eq!(mode.generalised_mass, Some(1.0));
            for shape in &mode.shape {
                let rotation = shape.rotation.unwrap();
                let still = shape.translation.iter().chain(&rotation).all(|x| x.abs() < 1e-9);
                assert_eq!(still, ![28, 29, 30, 32, 33].contains(&shape.node), "{shape:?}");
            }
        }
        assert_eq!(results.complete("modes_elements"), Ok(()));
    }
}

#[test]
fn punch_op2_print_and_deck_of_the_fluid_structure_model_are_the_same() {
    let Some(op2) = real_results("pynastran/fsi.op2") else { return };
    let mut punch = real_results("pynastran/fsi.pch").unwrap();
    as_pynastran_reads(&op2, "fsi");
    assert_eq!(punch.modes.len(), 10);
    close(&punch.modes, &op2.modes, 0.5e-6 + SINGLE, 0.0);
    for (a, b) in punch.modes.iter().zip(&op2.modes) {
        // Eight digits against single precision.
        let off = (a.frequency_hz - b.frequency_hz).abs();
        assert!(off <= (0.5e-7 + SINGLE) * b.frequency_hz, "{a:?} {b:?}");
    }
    let text = String::from_utf8_lossy(&real("pynastran/fsi.f06").unwrap()).into_owned();
    close(&punch.modes, &printed(&text, true), 1e-6, 0.0);
    let deck = real_results("pynastran/fsi.bdf").unwrap();
    assert_eq!(deck.nodes, op2.nodes);
    punch.merge(deck, "fsi.bdf").unwrap();
    assert_eq!(punch.complete("fsi.pch"), Ok(()));
}
