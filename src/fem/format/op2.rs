//! Nastran OP2: eigenvectors (`OUGV1` and its kin), eigenvalue summary (`LAMA`) and geometry
//! (`GEOM1`).
//!
//! The records are read by `op2_records`; other tables are passed over.
//!
//! Tables as in the MSC Nastran DMAP Programmer's Guide, "Data Blocks".

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::op2_records::{Records, Words};
use super::{complex, frequency_hz, refuse_superelement};
use crate::fem::results::{
    Node, NodeShape, Point, Precision, RawMode, Results, System, SystemKind,
};
use crate::problem::Problems;

/// Tables of eigenvectors along the displacement systems of the nodes.
const SHAPES: [&str; 4] = ["OUGV1", "OUG1", "OUGV2", "OPHIG"];
/// Tables of eigenvectors along the basic axes.
const BASIC_SHAPES: [&str; 3] = ["BOUGV1", "BOUG1", "BOPHIG"];

/// Words of an identification record up to its three titles of 32 words.
const TITLES: usize = 50;
/// Approach codes of real and of complex eigenvalues.
const REAL_EIGENVALUES: i64 = 2;
const COMPLEX_EIGENVALUES: i64 = 9;
/// Ids above this are numbers of another kind read at the wrong place.
const LARGEST_ID: i64 = 100_000_000;

pub(super) fn recognised(bytes: &[u8]) -> bool {
    Words::recognise(bytes).is_some()
}

/// One eigenvector and where it comes from.
struct Shape {
    subcase: i64,
    eigenvalue: f64,
    mode: RawMode,
}

/// One line of the eigenvalue summary.
struct Eigenvalue {
    mode: i64,
    eigenvalue: f64,
    frequency_hz: f64,
    mass: f64,
}

#[derive(Default)]
struct Found {
    shapes: Vec<Shape>,
    basic_shapes: Vec<Shape>,
    summary: Vec<Eigenvalue>,
    augmented: bool,
    scalar: usize,
    fluid: usize,
    undamped_complex: bool,
}

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let (mut records, label) = Records::open(bytes, name)?;
    let single = records.words.size == 4;
    let precision = if single { Precision::Single } else { Precision::Double };
    // Without a label the program fills in letters X.
    let version = if label.starts_with('X') { "" } else { label.as_str() };
    let program = format!("Nastran OP2 {version}");
    let mut results = Results::empty(program.trim_end(), precision);
    let mut found = Found::default();
    while let Some(table) = records.next_table()? {
        let geometry = ["GEOM1", "GEOM1S", "GEOM1N"].contains(&table.as_str());
        let shapes = SHAPES.contains(&table.as_str());
        let basic = BASIC_SHAPES.contains(&table.as_str());
        let summary = ["LAMA", "LAMAS"].contains(&table.as_str());
        let mut ident: Option<Cow<[u8]>> = None;
        let mut header = true;
        while let Some(record) = records.next_record()? {
            if header || record.is_empty() {
                header = false;
            } else if geometry {
                geometry_record(&records, &record, &mut results, &mut found)?;
            } else if shapes || basic || summary {
                match ident.take() {
                    None => ident = Some(record),
                    Some(ident) if summary => summary_record(&records, &ident, &record, &mut found),
                    Some(ident) => shape_record(&records, &ident, &record, basic, &mut found)?,
                }
            }
        }
    }
    finish(name, found, &mut results)?;
    Ok(results)
}

fn finish(name: &str, found: Found, results: &mut Results) -> Result<(), Problems> {
    let Found { shapes, basic_shapes, summary, augmented, scalar, fluid, undamped_complex } = found;
    results.basic_shapes = shapes.is_empty() && !basic_shapes.is_empty();
    let shapes = if results.basic_shapes { basic_shapes } else { shapes };
    let subcases: BTreeSet<i64> = shapes.iter().map(|shape| shape.subcase).collect();
    if subcases.len() > 1 {
        let found = format!("eigenvectors of subcases {subcases:?}");
        return Err(Problems::input(name, "", found, "one subcase with eigenvectors"));
    }
    for Shape { eigenvalue, mut mode, .. } in shapes {
        let of_mode = summary.iter().filter(|line| line.mode == mode.number);
        let off = |line: &&Eigenvalue| (line.eigenvalue - eigenvalue).abs();
        if let Some(line) = of_mode.min_by(|a, b| off(a).total_cmp(&off(b))) {
            mode.frequency_hz = line.frequency_hz;
            mode.generalised_mass = Some(line.mass);
        }
        results.modes.push(mode);
    }
    if scalar > 0 {
        results.warnings.push(format!("{scalar} values at scalar points are left out"));
    }
    if fluid > 0 {
        results.warnings.push(format!("{fluid} fluid grids are left out"));
    }
    if augmented {
        results.warnings.push(super::augmented());
    }
    if undamped_complex {
        let what = "the modes come from a complex solution; all its imaginary parts are zero";
        results.warnings.push(what.into());
    }
    Ok(())
}

/// Pairs of identification and data: one line of seven words for each mode.
fn summary_record(records: &Records, ident: &[u8], data: &[u8], found: &mut Found) {
    let words = records.words;
    found.augmented |= words.integer(ident, 10) == super::AUGMENTED;
    for line in data.chunks_exact(7 * words.size) {
        let eigenvalue = words.real(line, 2);
        found.summary.push(Eigenvalue {
            mode: words.integer(line, 0),
            eigenvalue,
            frequency_hz: words.real(line, 4).copysign(eigenvalue),
            mass: words.real(line, 5),
        });
    }
}

/// Pairs of identification and data: one eigenvector.
fn shape_record(
    records: &Records,
    ident: &[u8],
    data: &[u8],
    basic: bool,
    found: &mut Found,
) -> Result<(), Problems> {
    let words = records.words;
    if ident.len() < TITLES * words.size {
        let length = ident.len() / words.size;
        return Err(records.damage(format!("an identification of {length} words"), "50 or more"));
    }
    let approach = words.integer(ident, 0) / 10;
    let (sort, content) = (words.integer(ident, 1) / 1000, words.integer(ident, 1) % 1000);
    // 1 displacements and 7 eigenvectors; velocities and loads of other solutions pass.
    if ![1, 7].contains(&content) || ![REAL_EIGENVALUES, COMPLEX_EIGENVALUES].contains(&approach) {
        return Ok(());
    }
    if sort & 2 != 0 {
        let found = "eigenvectors sorted by point (SORT2)";
        return Err(Problems::input(records.name, &records.table, found, "SORT1 output"));
    }
    let titles = words.text(ident, TITLES, ident.len() / words.size);
    refuse_superelement(&titles, records.name, &records.table)?;
    let number = words.integer(ident, 4);
    let (first, second) = (words.real(ident, 5), words.real(ident, 6));
    let format = words.integer(ident, 8);
    let width = words.integer(ident, 9);
    let is_complex = approach == COMPLEX_EIGENVALUES || format != 1;
    let key = format!("table {}: mode {number}", records.table);
    let in_parts = [1, 2].contains(&format);
    if is_complex && (approach != COMPLEX_EIGENVALUES || !in_parts || first != 0.0) {
        return Err(complex(records.name, &key));
    }
    let components = if is_complex { 12 } else { 6 };
    if width != components + 2 || !data.len().is_multiple_of((components as usize + 2) * words.size)
    {
        let entry = format!("{} bytes in entries of {width} words", data.len());
        return Err(records.damage(entry, &format!("entries of {} words", components + 2)));
    }
    let mut shape = Vec::new();
    for entry in data.chunks_exact((components as usize + 2) * words.size) {
        // Kind 1 is a grid, the others are scalar, extra and fluid points.
        if words.integer(entry, 1) != 1 {
            found.scalar += 1;
            continue;
        }
        if (8..components as usize + 2).any(|k| words.real(entry, k) != 0.0) {
            return Err(complex(records.name, &key));
        }
        shape.push(NodeShape {
            node: words.integer(entry, 0) / 10,
            translation: [2, 3, 4].map(|k| words.real(entry, k)),
            rotation: Some([5, 6, 7].map(|k| words.real(entry, k))),
        });
    }
    found.undamped_complex |= is_complex;
    let (eigenvalue, frequency_hz) = if is_complex {
        (second * second, second.abs() / std::f64::consts::TAU)
    } else {
        (first, frequency_hz(first))
    };
    let mode = RawMode { number, frequency_hz, generalised_mass: None, shape };
    let shape = Shape { subcase: words.integer(ident, 3), eigenvalue, mode };
    if basic { &mut found.basic_shapes } else { &mut found.shapes }.push(shape);
    Ok(())
}

/// One card type of `GEOM1`: three words of key, then its entries.
fn geometry_record(
    records: &Records,
    record: &[u8],
    results: &mut Results,
    found: &mut Found,
) -> Result<(), Problems> {
    let words = records.words;
    let Some(entries) = record.get(3 * words.size..) else { return Ok(()) };
    let system = |kind, by_nodes| systems(records, entries, kind, by_nodes);
    let systems = match (words.integer(record, 0), words.integer(record, 1)) {
        (4501, 45) => {
            let (nodes, fluid) = grids(records, entries)?;
            results.nodes.extend(nodes);
            found.fluid += fluid;
            return Ok(());
        }
        (1701, 17) => system(SystemKind::Cylindrical, true)?,
        (1801, 18) => system(SystemKind::Rectangular, true)?,
        (1901, 19) => system(SystemKind::Spherical, true)?,
        (2001, 20) => system(SystemKind::Cylindrical, false)?,
        (2101, 21) => system(SystemKind::Rectangular, false)?,
        (2201, 22) => system(SystemKind::Spherical, false)?,
        _ => return Ok(()),
    };
    let mut known: BTreeMap<i64, System> = std::mem::take(&mut results.systems);
    for system in systems {
        if known.insert(system.id, system).is_some_and(|before| before != system) {
            let found = format!("two coordinate systems {}", system.id);
            return Err(records.damage(found, "one definition"));
        }
    }
    results.systems = known;
    Ok(())
}

/// Entries of `length` words if they divide the record and all of them pass.
fn entries(
    words: Words,
    bytes: &[u8],
    length: usize,
    passes: impl Fn(&[u8]) -> bool,
) -> Option<Vec<&[u8]>> {
    let entries = bytes.chunks_exact(length * words.size);
    let whole = entries.remainder().is_empty() && !bytes.is_empty();
    (whole && entries.clone().all(passes)).then(|| entries.collect())
}

/// Structural grids, and the number of fluid ones: id, CP, three coordinates of a word or in some
/// versions of two, CD, constraints, superelement.
fn grids(records: &Records, bytes: &[u8]) -> Result<(Vec<Node>, usize), Problems> {
    let words = records.words;
    let is_id = |id: i64, least| (least..=LARGEST_ID).contains(&id);
    let passes = |double: bool| {
        let after = if double { 8 } else { 5 };
        move |entry: &[u8]| {
            is_id(words.integer(entry, 0), 1)
                && is_id(words.integer(entry, 1), 0)
                && is_id(words.integer(entry, after), -1)
                && is_id(words.integer(entry, after + 2), 0)
        }
    };
    let single = entries(words, bytes, 8, passes(false)).map(|found| (found, false));
    let found = single.or_else(|| {
        let double = (words.size == 4).then(|| entries(words, bytes, 11, passes(true))).flatten();
        double.map(|found| (found, true))
    });
    let Some((grids, double)) = found else {
        return Err(records.damage("grids in a layout that is not known", "entries of 8 words"));
    };
    let mut nodes = Vec::with_capacity(grids.len());
    let mut fluid = 0;
    for entry in grids {
        let node = Node {
            id: words.integer(entry, 0),
            position_system: words.integer(entry, 1),
            position: [0, 1, 2].map(|k| {
                if double { words.double(entry, 2 + 2 * k) } else { words.real(entry, 2 + k) }
            }),
            displacement_system: words.integer(entry, if double { 8 } else { 5 }),
        };
        if node.displacement_system < 0 {
            fluid += 1;
        } else {
            nodes.push(node);
        }
    }
    Ok((nodes, fluid))
}

/// Coordinate systems: id, kind, 1 or 2 for the card, then three nodes or the reference system and
/// nine coordinates of a word or in some versions of two.
fn systems(
    records: &Records,
    bytes: &[u8],
    kind: SystemKind,
    by_nodes: bool,
) -> Result<Vec<System>, Problems> {
    let words = records.words;
    let passes = |entry: &[u8]| {
        (1..=LARGEST_ID).contains(&words.integer(entry, 0))
            && (0..=3).contains(&words.integer(entry, 1))
            && (0..=2).contains(&words.integer(entry, 2))
            && (0..=LARGEST_ID).contains(&words.integer(entry, 3))
    };
    let layouts: &[(usize, bool)] =
        if by_nodes { &[(6, false)] } else { &[(13, false), (22, true)] };
    let found = layouts.iter().find_map(|(length, double)| {
        let fits = !double || words.size == 4;
        fits.then(|| entries(words, bytes, *length, passes)).flatten().map(|all| (all, *double))
    });
    let Some((found, double)) = found else {
        let found = "coordinate systems in a layout that is not known";
        return Err(records.damage(found, "entries of 6 or 13 words"));
    };
    let system = |entry: &&[u8]| {
        let point = |corner: usize| {
            if by_nodes {
                return Point::Node(words.integer(entry, 3 + corner));
            }
            let position = [0, 1, 2].map(|k| {
                let k = 3 * corner + k;
                if double { words.double(entry, 4 + 2 * k) } else { words.real(entry, 4 + k) }
            });
            Point::Given { reference: words.integer(entry, 3), position }
        };
        System { id: words.integer(entry, 0), kind, a: point(0), b: point(1), c: point(2) }
    };
    Ok(found.iter().map(system).collect())
}
