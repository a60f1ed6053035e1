//! Plain tables of nodes, modes, coordinate systems or masses, from CSV text or from columns that
//! another reader (Parquet) brings.
//!
//! One table a file, told by its columns; brackets are optional:
//! - nodes: `node, x, y, z [, position_system, displacement_system, label]`
//! - modes: `mode, frequency_hz, node, tx, ty, tz [, rx, ry, rz, generalised_mass]`, one row for
//!   each mode and node
//! - systems: `system, kind, reference, ax, ay, az, bx, by, bz, cx, cy, cz`
//! - masses: `node, mass [, ixx, iyy, izz]`, the whole mass of the model lumped at its nodes

use std::collections::BTreeMap;

use super::lines::{digits, lines};
use crate::fem::results::{
    Node, NodeMass, NodeShape, Point, Precision, RawMode, Results, System, SystemKind,
};
use crate::problem::Problems;

/// One column of a table, all of the same length.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Numbers; ids are whole numbers below 2⁵³.
    Numbers(Vec<f64>),
    /// Texts, empty where there is none.
    Texts(Vec<String>),
}

/// Columns by name.
pub type Columns = BTreeMap<String, Column>;

/// Required and optional columns of each table, recognised by the required ones.
const TABLES: [(&[&str], &[&str]); 4] = [
    (&["mode", "frequency_hz", "node", "tx", "ty", "tz"], &["rx", "ry", "rz", "generalised_mass"]),
    (&["node", "x", "y", "z"], &["position_system", "displacement_system", "label"]),
    (&["system", "kind", "reference", "ax", "ay", "az", "bx", "by", "bz", "cx", "cy", "cz"], &[]),
    (&["node", "mass"], &["ixx", "iyy", "izz"]),
];

/// Columns that hold text.
const TEXTS: [&str; 2] = ["kind", "label"];

/// Largest whole number up to which `f64` holds all.
const WHOLE: f64 = 9_007_199_254_740_992.0;

/// Problems told before the reader gives up.
const MOST_PROBLEMS: usize = 20;

fn header(line: &str) -> Vec<String> {
    let line = line.trim_start_matches('\u{feff}');
    line.split(',').map(|name| name.trim().trim_matches('"').to_owned()).collect()
}

fn table_of(names: &[String]) -> Option<usize> {
    TABLES.iter().position(|(required, _)| required.iter().all(|r| names.iter().any(|n| n == r)))
}

/// The first line that is neither empty nor a comment.
fn start(bytes: &[u8]) -> Option<(usize, Vec<String>)> {
    let filled = |line: &str| !line.trim().is_empty() && !line.starts_with('#');
    let (number, line) = lines(bytes).take(100).find(|(_, line)| filled(line))?;
    Some((number, header(&line)))
}

pub(super) fn recognised(bytes: &[u8]) -> bool {
    start(bytes).is_some_and(|(_, names)| table_of(&names).is_some())
}

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let (first, names) = start(bytes).unwrap_or_default();
    let mut problems = Problems::default();
    let mut most_digits = 0;
    let mut columns: Vec<Column> = names
        .iter()
        .map(|name| {
            let text = TEXTS.contains(&name.as_str());
            if text { Column::Texts(Vec::new()) } else { Column::Numbers(Vec::new()) }
        })
        .collect();
    for (number, line) in lines(bytes).skip(first) {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        if problems.0.len() >= MOST_PROBLEMS {
            break;
        }
        let fields: Vec<&str> = line.split(',').map(|f| f.trim().trim_matches('"')).collect();
        if fields.len() != columns.len() {
            let found = format!("{} fields", fields.len());
            let allowed = format!("the {} columns of the header", columns.len());
            problems.extend(Problems::input(name, format!("line {number}"), found, allowed));
            continue;
        }
        for ((field, column), heading) in fields.into_iter().zip(&mut columns).zip(&names) {
            match column {
                Column::Texts(texts) => texts.push(field.to_owned()),
                Column::Numbers(values) => {
                    let value = super::lines::real(field);
                    if value.is_none() {
                        let key = format!("line {number}: {heading}");
                        let found = format!("{field:?}");
                        problems.extend(Problems::input(name, key, found, "a number"));
                    }
                    if ["tx", "ty", "tz"].contains(&heading.as_str()) {
                        most_digits = most_digits.max(digits(field));
                    }
                    values.push(value.unwrap_or_default());
                }
            }
        }
    }
    problems.into_result(())?;
    if let Some(twice) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
        let found = format!("column {:?} twice", names[twice]);
        return Err(Problems::input(name, "", found, "each column once"));
    }
    let columns = names.into_iter().zip(columns).collect();
    tabulated(&columns, Precision::Text { digits: most_digits }, name)
}

/// Results from the columns of one table, see the module for their names.
///
/// # Errors
/// No table has these columns; unknown columns, unequal lengths, ids that are no whole numbers,
/// rows of one mode that differ in frequency or generalised mass, and what [`Results::finish`]
/// finds.
pub fn from_columns(
    columns: &Columns,
    precision: Precision,
    name: &str,
) -> Result<Results, Problems> {
    tabulated(columns, precision, name)?.finish(name)
}

fn tabulated(columns: &Columns, precision: Precision, name: &str) -> Result<Results, Problems> {
    let names: Vec<String> = columns.keys().cloned().collect();
    let Some(table) = table_of(&names) else {
        let all = TABLES.iter().map(|(required, _)| required.join(", "));
        let allowed = all.collect::<Vec<_>>().join("; or ");
        return Err(Problems::input(name, "", format!("columns {}", names.join(", ")), allowed));
    };
    let (required, optional) = TABLES[table];
    let mut problems = Problems::default();
    let length = |column: &Column| match column {
        Column::Numbers(values) => values.len(),
        Column::Texts(texts) => texts.len(),
    };
    let rows = columns.get(required[0]).map_or(0, length);
    for (key, column) in columns {
        let text = matches!(column, Column::Texts(_));
        if !required.contains(&key.as_str()) && !optional.contains(&key.as_str()) {
            let allowed = [required, optional].concat().join(", ");
            problems.extend(Problems::input(name, key, "an unknown column", allowed));
        } else if text != TEXTS.contains(&key.as_str()) {
            let found = if text { "text" } else { "numbers" };
            let allowed = if text { "numbers" } else { "text" };
            problems.extend(Problems::input(name, key, found, allowed));
        } else if length(column) != rows {
            let found = format!("{} rows", length(column));
            problems.extend(Problems::damage(name, key, found, format!("{rows} rows")));
        }
    }
    if table == 0
        && ["rx", "ry", "rz"].iter().filter(|r| columns.contains_key(**r)).count() % 3 != 0
    {
        problems.extend(Problems::input(name, "rx, ry, rz", "some of them", "all or none"));
    }
    problems.into_result(())?;
    let mut results = Results::empty("tables", precision);
    let table_rows = Rows { columns, name };
    match table {
        0 => modes(&table_rows, rows, &mut results)?,
        1 => nodes(&table_rows, rows, &mut results)?,
        2 => systems(&table_rows, rows, &mut results)?,
        _ => masses(&table_rows, rows, &mut results)?,
    }
    Ok(results)
}

/// Access to the fields of checked columns.
struct Rows<'a> {
    columns: &'a Columns,
    name: &'a str,
}

impl Rows<'_> {
    fn number(&self, column: &str, row: usize) -> Option<f64> {
        match self.columns.get(column) {
            Some(Column::Numbers(values)) => values.get(row).copied(),
            _ => None,
        }
    }

    fn text(&self, column: &str, row: usize) -> &str {
        match self.columns.get(column) {
            Some(Column::Texts(texts)) => texts.get(row).map_or("", String::as_str),
            _ => "",
        }
    }

    /// Zero where the column is missing.
    fn three(&self, columns: [&str; 3], row: usize) -> [f64; 3] {
        columns.map(|column| self.number(column, row).unwrap_or_default())
    }

    fn wrong(&self, column: &str, row: usize, found: String, allowed: &str) -> Problems {
        Problems::input(self.name, format!("row {}: {column}", row + 1), found, allowed)
    }

    #[expect(clippy::cast_possible_truncation, reason = "whole and below 2^53, as checked")]
    fn id(&self, column: &str, row: usize, least: f64) -> Result<i64, Problems> {
        let value = self.number(column, row).unwrap_or_default();
        if value.fract() == 0.0 && value >= least && value <= WHOLE {
            Ok(value as i64)
        } else {
            Err(self.wrong(column, row, value.to_string(), "a whole positive number"))
        }
    }
}

fn nodes(rows: &Rows, count: usize, results: &mut Results) -> Result<(), Problems> {
    for row in 0..count {
        let id = rows.id("node", row, 1.0)?;
        results.nodes.push(Node {
            id,
            position: rows.three(["x", "y", "z"], row),
            position_system: rows.id("position_system", row, 0.0)?,
            displacement_system: rows.id("displacement_system", row, 0.0)?,
        });
        let label = rows.text("label", row);
        if !label.is_empty() {
            results.sets.entry(label.to_owned()).or_default().push(id);
        }
    }
    Ok(())
}

fn modes(rows: &Rows, count: usize, results: &mut Results) -> Result<(), Problems> {
    let mut modes: BTreeMap<i64, RawMode> = BTreeMap::new();
    let rotations = rows.columns.contains_key("rx");
    for row in 0..count {
        let number = rows.id("mode", row, 1.0)?;
        let frequency_hz = rows.number("frequency_hz", row).unwrap_or(f64::NAN);
        let generalised_mass = rows.number("generalised_mass", row);
        let mode = modes.entry(number).or_insert_with(|| RawMode {
            number,
            frequency_hz,
            generalised_mass,
            shape: Vec::new(),
        });
        if mode.frequency_hz != frequency_hz || mode.generalised_mass != generalised_mass {
            let found = format!("{frequency_hz} Hz, generalised mass {generalised_mass:?}");
            let allowed = "the same on all rows of a mode";
            return Err(rows.wrong("mode", row, found, allowed));
        }
        mode.shape.push(NodeShape {
            node: rows.id("node", row, 1.0)?,
            translation: rows.three(["tx", "ty", "tz"], row),
            rotation: rotations.then(|| rows.three(["rx", "ry", "rz"], row)),
        });
    }
    results.modes = modes.into_values().collect();
    Ok(())
}

fn systems(rows: &Rows, count: usize, results: &mut Results) -> Result<(), Problems> {
    for row in 0..count {
        let id = rows.id("system", row, 1.0)?;
        let reference = rows.id("reference", row, 0.0)?;
        let kind = match rows.text("kind", row) {
            "rectangular" => SystemKind::Rectangular,
            "cylindrical" => SystemKind::Cylindrical,
            "spherical" => SystemKind::Spherical,
            other => {
                let found = format!("{other:?}");
                let allowed = "rectangular, cylindrical or spherical";
                return Err(rows.wrong("kind", row, found, allowed));
            }
        };
        let point = |columns| Point::Given { reference, position: rows.three(columns, row) };
        let (a, b, c) =
            (point(["ax", "ay", "az"]), point(["bx", "by", "bz"]), point(["cx", "cy", "cz"]));
        if results.systems.insert(id, System { id, kind, a, b, c }).is_some() {
            return Err(rows.wrong("system", row, format!("{id} twice"), "each system once"));
        }
    }
    Ok(())
}

fn masses(rows: &Rows, count: usize, results: &mut Results) -> Result<(), Problems> {
    let mut masses: BTreeMap<i64, NodeMass> = BTreeMap::new();
    for row in 0..count {
        let id = rows.id("node", row, 1.0)?;
        let mass = rows.number("mass", row).unwrap_or(f64::NAN);
        let inertia = rows.three(["ixx", "iyy", "izz"], row);
        let fine = |value: &f64| *value >= 0.0 && value.is_finite();
        if !(fine(&mass) && inertia.iter().all(fine)) {
            let found = format!("mass {mass}, inertia {inertia:?}");
            return Err(rows.wrong("mass", row, found, "numbers of at least zero"));
        }
        if masses.insert(id, NodeMass { mass, inertia }).is_some() {
            return Err(rows.wrong("node", row, format!("{id} twice"), "each node once"));
        }
    }
    results.mass = Some(masses.into_iter().collect());
    Ok(())
}
