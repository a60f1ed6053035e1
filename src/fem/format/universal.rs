//! Universal file: nodes (15, 781, 2411), coordinate systems (18, 2420), groups (2435, 2452, 2467,
//! 2477), units (164) and normal modes (55, 2414).
//!
//! Not measured data: functions (58) and traces are skipped.
//!
//! Formats as the Structural Dynamics Research Laboratory, University of Cincinnati, lists them.

use std::borrow::Cow;

use super::complex;
use super::lines::{digits, integers, lines, real, reals};
use crate::fem::results::{
    Node, NodeShape, Point, Precision, RawMode, Results, System, SystemKind,
};
use crate::problem::Problems;

/// Result type of displacements in datasets 55 and 2414.
const DISPLACEMENT: i64 = 8;
/// Analysis type of normal modes.
const NORMAL_MODES: i64 = 2;
/// Entity type of nodes in groups.
const NODE: i64 = 7;

pub(super) fn recognised(bytes: &[u8]) -> bool {
    let mut filled = lines(bytes).map(|(_, line)| line).filter(|line| !line.trim().is_empty());
    let first = filled.next();
    let dataset = filled.next();
    first.is_some_and(|line| line.trim() == "-1")
        && dataset.is_some_and(|line| {
            let number = line.split_ascii_whitespace().next().unwrap_or("");
            number.trim_end_matches('b').parse::<u32>().is_ok()
        })
}

/// One dataset, read line by line.
struct Dataset<'a> {
    name: &'a str,
    number: &'a str,
    rest: &'a [u8],
    /// The last line that was read, and its number in the file.
    last: Cow<'a, str>,
    line: usize,
}

impl<'a> Dataset<'a> {
    fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }

    fn next(&mut self) -> Option<Cow<'a, str>> {
        if self.is_at_end() {
            self.last = Cow::Borrowed("the end of the dataset");
            return None;
        }
        self.last = lines(self.rest).next()?.1;
        let end = self.rest.iter().position(|byte| *byte == b'\n');
        self.rest = end.map_or(&[][..], |end| &self.rest[end + 1..]);
        self.line += 1;
        Some(self.last.clone())
    }

    fn skip(&mut self, count: usize) {
        for _ in 0..count {
            self.next();
        }
    }

    fn wrong(&self, allowed: &str) -> Problems {
        let key = format!("dataset {}: line {}", self.number, self.line);
        Problems::damage(self.name, key, format!("{:?}", self.last.trim_end()), allowed)
    }

    fn integers(&mut self, least: usize, allowed: &str) -> Result<Vec<i64>, Problems> {
        let values = self.next().and_then(|line| integers(&line)).unwrap_or_default();
        if values.len() < least { Err(self.wrong(allowed)) } else { Ok(values) }
    }

    /// `count` numbers on as many lines as they take; `seen` learns their digits.
    fn reals(&mut self, count: usize, seen: &mut u8) -> Result<Vec<f64>, Problems> {
        let mut values = Vec::new();
        while values.len() < count {
            let allowed = "the numbers that belong here";
            let line = self.next().ok_or_else(|| self.wrong(allowed))?;
            let found = reals(&line).filter(|found| !found.is_empty());
            values.extend(found.ok_or_else(|| self.wrong(allowed))?);
            for token in line.split_ascii_whitespace() {
                *seen = (*seen).max(digits(token));
            }
        }
        values.truncate(count);
        Ok(values)
    }
}

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let mut results = Results::empty("universal file", Precision::Text { digits: 0 });
    let mut shape_digits = 0;
    let mut solutions: Vec<i64> = Vec::new();
    // Where the lines after the number of an open dataset start, and that number.
    let mut open: Option<(usize, usize, &str)> = None;
    let mut marked = false;
    let mut at = 0;
    for (line, text) in bytes.split(|byte| *byte == b'\n').enumerate() {
        let start = at;
        at += text.len() + 1;
        let text = text.trim_ascii();
        if marked {
            let number = std::str::from_utf8(text).unwrap_or("");
            open = Some((line + 1, at.min(bytes.len()), number));
            marked = false;
        } else if text != b"-1" {
        } else if let Some((line, from, number)) = open.take() {
            let last = Cow::Borrowed("");
            let mut dataset = Dataset { name, number, rest: &bytes[from..start], last, line };
            let seen = &mut shape_digits;
            match number {
                "15" => nodes_on_one_line(&mut dataset, &mut results)?,
                "781" | "2411" => nodes_on_two_lines(&mut dataset, &mut results)?,
                "18" => systems_by_points(&mut dataset, &mut results)?,
                "2420" => systems_by_matrix(&mut dataset, &mut results)?,
                "2435" | "2452" | "2467" | "2477" => groups(&mut dataset, &mut results)?,
                "164" => results.units = units(&mut dataset),
                "55" => mode_55(&mut dataset, &mut results, seen)?,
                "2414" => mode_2414(&mut dataset, &mut results, seen, &mut solutions)?,
                _ => {}
            }
        } else {
            marked = true;
        }
    }
    if let Some((line, _, number)) = open {
        let key = format!("dataset {number} of line {line}");
        return Err(Problems::damage(name, key, "the end of the file", "a closing -1"));
    }
    results.precision = Precision::Text { digits: shape_digits };
    ground(&mut results);
    Ok(results)
}

/// Programs name system 1 for the global one without defining it.
fn ground(results: &mut Results) {
    if results.systems.is_empty() {
        for node in &mut results.nodes {
            for system in [&mut node.position_system, &mut node.displacement_system] {
                if *system == 1 {
                    *system = 0;
                }
            }
        }
    }
    if !results.modes.is_empty() && results.nodes.iter().any(|n| n.displacement_system != 0) {
        let what = "nodes have displacement systems of their own: the shapes are taken along them";
        results.warnings.push(what.into());
    }
}

fn nodes_on_one_line(dataset: &mut Dataset, results: &mut Results) -> Result<(), Problems> {
    while let Some(line) = dataset.next() {
        let allowed = "node, two systems, colour and three coordinates";
        let tokens: Vec<&str> = line.split_ascii_whitespace().collect();
        let [id, position_system, displacement_system, _, x, y, z] = tokens[..] else {
            return Err(dataset.wrong(allowed));
        };
        let read = || {
            Some(Node {
                id: id.parse().ok()?,
                position_system: position_system.parse().ok()?,
                displacement_system: displacement_system.parse().ok()?,
                position: [real(x)?, real(y)?, real(z)?],
            })
        };
        results.nodes.push(read().ok_or_else(|| dataset.wrong(allowed))?);
    }
    Ok(())
}

fn nodes_on_two_lines(dataset: &mut Dataset, results: &mut Results) -> Result<(), Problems> {
    while !dataset.is_at_end() {
        let head = dataset.integers(3, "node and its systems")?;
        let position = dataset.reals(3, &mut 0)?;
        results.nodes.push(Node {
            id: head[0],
            // The second number is the system for export; the coordinates are those of the part.
            position_system: 0,
            displacement_system: head[2],
            position: [position[0], position[1], position[2]],
        });
    }
    Ok(())
}

fn kind(number: i64) -> Option<SystemKind> {
    match number {
        0 => Some(SystemKind::Rectangular),
        1 => Some(SystemKind::Cylindrical),
        2 => Some(SystemKind::Spherical),
        _ => None,
    }
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Vector of the same direction with length one.
fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    a.map(|x| x / length)
}

fn systems_by_points(dataset: &mut Dataset, results: &mut Results) -> Result<(), Problems> {
    while !dataset.is_at_end() {
        let head = dataset.integers(3, "system, type and reference system")?;
        let kind = kind(head[1]).ok_or_else(|| dataset.wrong("type 0, 1 or 2"))?;
        dataset.next();
        let p = dataset.reals(9, &mut 0)?;
        let curved = |system: &System| system.kind != SystemKind::Rectangular;
        if head[2] != 0 && results.systems.get(&head[2]).is_none_or(curved) {
            return Err(dataset.wrong("a rectangular reference system that is defined before"));
        }
        let origin = [p[0], p[1], p[2]];
        let x = [p[3] - p[0], p[4] - p[1], p[5] - p[2]];
        let in_plane = [p[6] - p[0], p[7] - p[1], p[8] - p[2]];
        let z = cross(x, cross(in_plane, x));
        place(results, head[0], kind, head[2], origin, unit(x), unit(z));
    }
    Ok(())
}

fn systems_by_matrix(dataset: &mut Dataset, results: &mut Results) -> Result<(), Problems> {
    dataset.next();
    dataset.next();
    while !dataset.is_at_end() {
        let head = dataset.integers(2, "system and type")?;
        let kind = kind(head[1]).ok_or_else(|| dataset.wrong("type 0, 1 or 2"))?;
        dataset.next();
        // Each row holds one axis of the system, the fourth its origin.
        let p = dataset.reals(12, &mut 0)?;
        let (x, z, origin) = ([p[0], p[1], p[2]], [p[6], p[7], p[8]], [p[9], p[10], p[11]]);
        place(results, head[0], kind, 0, origin, x, z);
    }
    Ok(())
}

fn place(
    results: &mut Results,
    id: i64,
    kind: SystemKind,
    reference: i64,
    origin: [f64; 3],
    x: [f64; 3],
    z: [f64; 3],
) {
    let [a, b, c] = [origin, add(origin, z), add(origin, x)]
        .map(|position| Point::Given { reference, position });
    results.systems.insert(id, System { id, kind, a, b, c });
}

fn groups(dataset: &mut Dataset, results: &mut Results) -> Result<(), Problems> {
    while !dataset.is_at_end() {
        let head = dataset.integers(8, "group and the number of its entities")?;
        let name = dataset.next().ok_or_else(|| dataset.wrong("the name of the group"))?;
        let mut rest = head[7];
        let mut nodes = Vec::new();
        while rest > 0 {
            let entities = dataset.integers(4, "type, tag, node leaf and component")?;
            for entity in entities.chunks_exact(4) {
                rest -= 1;
                if entity[0] == NODE {
                    nodes.push(entity[1]);
                }
            }
        }
        if !nodes.is_empty() {
            results.sets.entry(name.trim().to_owned()).or_default().extend(nodes);
        }
    }
    Ok(())
}

/// Units code, description and the factors to SI, as text for the user.
fn units(dataset: &mut Dataset) -> Option<String> {
    let head = dataset.next()?;
    let head = head.trim();
    let factors = dataset.next().unwrap_or_default();
    let factors = factors.split_ascii_whitespace().take(3).collect::<Vec<_>>().join(", ");
    Some(format!("{head}; SI divided into them (length, force, temperature): {factors}"))
}

/// The shapes that follow the head of a dataset.
fn shapes(dataset: &mut Dataset, count: i64, seen: &mut u8) -> Result<Vec<NodeShape>, Problems> {
    let mut shape = Vec::new();
    let allowed = "three translations, or three translations and three rotations";
    let count = match count {
        3 => 3,
        6 => 6,
        _ => return Err(dataset.wrong(allowed)),
    };
    while !dataset.is_at_end() {
        let node = dataset.integers(1, "a node")?[0];
        let v = dataset.reals(count, seen)?;
        shape.push(NodeShape {
            node,
            translation: [v[0], v[1], v[2]],
            rotation: (count == 6).then(|| [v[3], v[4], v[5]]),
        });
    }
    Ok(shape)
}

fn mode_55(dataset: &mut Dataset, results: &mut Results, seen: &mut u8) -> Result<(), Problems> {
    dataset.skip(5);
    let head = dataset.integers(6, "six numbers that define the data")?;
    let [_, analysis, _, result, data, values] = head[..6] else {
        return Err(dataset.wrong("six numbers"));
    };
    if is_complex_modes(analysis, result, data == 5) {
        return Err(complex(dataset.name, "dataset 55"));
    }
    if analysis != NORMAL_MODES || result != DISPLACEMENT {
        return Ok(());
    }
    let specific = dataset.integers(4, "counts, load case and mode number")?;
    let reals = usize::try_from(specific[1]).ok().filter(|count| (1..=12).contains(count));
    let reals = reals.ok_or_else(|| dataset.wrong("1 to 12 real values"))?;
    let parameters = dataset.reals(reals, &mut 0)?;
    push(results, specific[3], parameters[0], parameters.get(1).copied(), {
        shapes(dataset, values, seen)?
    });
    Ok(())
}

fn mode_2414(
    dataset: &mut Dataset,
    results: &mut Results,
    seen: &mut u8,
    solutions: &mut Vec<i64>,
) -> Result<(), Problems> {
    dataset.skip(2);
    let location = dataset.integers(1, "the location of the data")?[0];
    dataset.skip(5);
    let head = dataset.integers(6, "six numbers that define the data")?;
    let [_, analysis, _, result, data, values] = head[..6] else {
        return Err(dataset.wrong("six numbers"));
    };
    if is_complex_modes(analysis, result, data == 5 || data == 6) {
        return Err(complex(dataset.name, "dataset 2414"));
    }
    if location != 1 || analysis != NORMAL_MODES || result != DISPLACEMENT {
        return Ok(());
    }
    let specific = dataset.integers(6, "design set, iteration, solution set, …, mode number")?;
    dataset.next();
    if !solutions.contains(&specific[2]) {
        solutions.push(specific[2]);
    }
    if let [first, second, ..] = solutions[..] {
        let found = format!("modes of solution sets {first} and {second}");
        return Err(Problems::input(dataset.name, "dataset 2414", found, "one solution set"));
    }
    // Time, frequency, eigenvalue, modal mass and two dampings; then six more of complex modes.
    let parameters = dataset.reals(12, &mut 0)?;
    push(results, specific[5], parameters[1], Some(parameters[3]), {
        shapes(dataset, values, seen)?
    });
    Ok(())
}

fn is_complex_modes(analysis: i64, result: i64, is_complex: bool) -> bool {
    let of_modes = [NORMAL_MODES, 3, 7].contains(&analysis) && result == DISPLACEMENT;
    of_modes && (is_complex || analysis != NORMAL_MODES)
}

fn push(
    results: &mut Results,
    number: i64,
    frequency_hz: f64,
    mass: Option<f64>,
    shape: Vec<NodeShape>,
) {
    // Programs write zero where they do not give the modal mass.
    let generalised_mass = mass.filter(|mass| *mass != 0.0);
    results.modes.push(RawMode { number, frequency_hz, generalised_mass, shape });
}
