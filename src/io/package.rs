//! The modal package on disk: `package.toml` and flat Parquet tables in `tables/`.
//!
//! The validated content is `vehicle::Modal`; this module reads, checks and writes it.
//!
//! What is unreadable, missing, swapped or contradicts another table is damage; what is
//! readable but not allowed (a header, a column, a value, a normalisation) is wrong input.

use super::flat::{Column, Holds, Layout, Table};
use super::{files, folder};
use crate::problem::{Kind, Problems};
use crate::structure::Thresholds;
use crate::vehicle::{Grid, MassProperties, Modal, Mode, ModeSet, Parent};
use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The file that makes a folder a modal package.
pub const HEADER: &str = "package.toml";
/// The only frame that is understood.
pub const FRAME: &str = "x along the centreline, positive aft; y, z lateral; right-handed";
/// Departure of a generalised mass from 1 that single precision in a source can explain.
const NORMALISATION: f64 = 1e-5;
/// Agreement of the grids' masses with the body's, above which they must weigh the modes too.
const WHOLE_MASS: f64 = 0.02;
/// Departure of `Σ m φ² + J ψ²` from 1 that lumping explains.
const LUMPING: f64 = 0.15;
/// Largest table file that is read, bytes.
const MAX_FILE: u64 = 1 << 30;
/// Problems of one table that are reported one by one.
const REPORTED: usize = 20;

const TIME: Column = Column("flight_time_s", Holds::Number("s"), "Flight time");
const LABEL: Column = Column("label", Holds::Text, "Persistent label of the mode");
const GRID: Column = Column("grid", Holds::Text, "Name of the grid");

/// Columns of the five tables.
pub const GRIDS: Layout = Layout {
    name: "grids",
    columns: &[
        TIME,
        GRID,
        Column("x_m", Holds::Number("m"), "Position along x"),
        Column("y_m", Holds::Number("m"), "Position along y"),
        Column("z_m", Holds::Number("m"), "Position along z"),
        Column("mass_x_kg", Holds::Number("kg"), "Lumped mass in motion along x"),
        Column("mass_y_kg", Holds::Number("kg"), "Lumped mass in motion along y"),
        Column("mass_z_kg", Holds::Number("kg"), "Lumped mass in motion along z"),
        Column("inertia_x_kg_m2", Holds::Number("kg m2"), "Lumped inertia about x"),
        Column("inertia_y_kg_m2", Holds::Number("kg m2"), "Lumped inertia about y"),
        Column("inertia_z_kg_m2", Holds::Number("kg m2"), "Lumped inertia about z"),
    ],
};
/// See [`GRIDS`].
pub const MODES: Layout = Layout {
    name: "modes",
    columns: &[
        TIME,
        LABEL,
        Column("frequency_hz", Holds::Number("Hz"), "Natural frequency"),
        Column("generalised_mass_kg", Holds::Number("kg"), "Generalised mass, 1 by normalisation"),
    ],
};
/// See [`GRIDS`].
pub const SHAPES: Layout = Layout {
    name: "shapes",
    columns: &[
        TIME,
        LABEL,
        GRID,
        Column("phi_x_per_sqrt_kg", Holds::Number("kg^-1/2"), "Translation along x"),
        Column("phi_y_per_sqrt_kg", Holds::Number("kg^-1/2"), "Translation along y"),
        Column("phi_z_per_sqrt_kg", Holds::Number("kg^-1/2"), "Translation along z"),
        Column("psi_x_rad_per_m_sqrt_kg", Holds::Number("rad/m kg^-1/2"), "Rotation about x"),
        Column("psi_y_rad_per_m_sqrt_kg", Holds::Number("rad/m kg^-1/2"), "Rotation about y"),
        Column("psi_z_rad_per_m_sqrt_kg", Holds::Number("rad/m kg^-1/2"), "Rotation about z"),
    ],
};
/// See [`GRIDS`].
pub const MASS: Layout = Layout {
    name: "mass",
    columns: &[
        TIME,
        Column("mass_kg", Holds::Number("kg"), "Mass of the body"),
        Column("cg_x_m", Holds::Number("m"), "Centre of gravity along x"),
        Column("cg_y_m", Holds::Number("m"), "Centre of gravity along y"),
        Column("cg_z_m", Holds::Number("m"), "Centre of gravity along z"),
        Column("ixx_kg_m2", Holds::Number("kg m2"), "Inertia tensor about the cg, element xx"),
        Column("iyy_kg_m2", Holds::Number("kg m2"), "Inertia tensor about the cg, element yy"),
        Column("izz_kg_m2", Holds::Number("kg m2"), "Inertia tensor about the cg, element zz"),
        Column("ixy_kg_m2", Holds::Number("kg m2"), "Element xy of the tensor, -sum m x y"),
        Column("ixz_kg_m2", Holds::Number("kg m2"), "Element xz of the tensor, -sum m x z"),
        Column("iyz_kg_m2", Holds::Number("kg m2"), "Element yz of the tensor, -sum m y z"),
    ],
};
/// See [`GRIDS`].
pub const PARENTS: Layout = Layout {
    name: "parents",
    columns: &[
        Column("flight_time_s", Holds::Number("s"), "Flight time at which the label was born"),
        LABEL,
        Column("parent", Holds::Text, "A label of the flight time before"),
        Column("overlap", Holds::Number("1"), "Squared mass-weighted overlap of the shapes"),
    ],
};
const LAYOUTS: [&Layout; 5] = [&GRIDS, &MODES, &SHAPES, &MASS, &PARENTS];

/// `package.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the package format: 1.
    pub format: u32,
    /// Where the modes come from.
    pub source: String,
    /// Units: `SI`.
    pub units: String,
    /// Frame: `x along the centreline, positive aft; y, z lateral; right-handed`.
    pub frame: String,
    /// Normalisation of the modes: `mass`, unit generalised mass in kilograms.
    pub normalisation: String,
    /// Engines (`group.name`) whose mass the modes contain; empty for a reduced body.
    pub contains_engines: Vec<String>,
    /// Tanks whose slosh masses the modes contain; must be empty.
    pub contains_tanks: Vec<String>,
    /// Overlaps by which labels were given, where they were given by overlap.
    pub labels: Option<LabelHeader>,
    /// BLAKE3 digest of each table file, hexadecimal. May be left out as a whole.
    #[serde(default)]
    pub blake3: BTreeMap<String, String>,
}

/// Overlaps by which labels were given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelHeader {
    /// A label was kept where the overlap exceeded this.
    pub keep_overlap: f64,
    /// A parent is listed where the overlap exceeded this.
    pub parent_overlap: f64,
}

/// Writes `modal` as the package `dir`: aside, synced, renamed as a whole. An existing package is
/// replaced only if `force` says so.
///
/// # Errors
/// One problem if `dir` exists or cannot be written.
pub fn write(
    dir: &Path,
    modal: &Modal,
    thresholds: &Thresholds,
    force: bool,
) -> Result<(), Problems> {
    let mut blake3 = BTreeMap::new();
    let mut contents = Vec::new();
    for (layout, table) in LAYOUTS.into_iter().zip(tables(modal)) {
        let bytes = table.to_bytes(layout).map_err(|e| {
            Problems::damage(files::name(dir), layout.name, e.to_string(), "a table to write")
        })?;
        blake3.insert(layout.name.to_owned(), blake3::hash(&bytes).to_hex().to_string());
        contents.push((table_path(layout), bytes));
    }
    let header = Header {
        format: 1,
        source: modal.source.clone(),
        units: "SI".to_owned(),
        frame: FRAME.to_owned(),
        normalisation: "mass".to_owned(),
        contains_engines: modal.contains_engines.clone(),
        contains_tanks: Vec::new(),
        labels: Some(LabelHeader {
            keep_overlap: thresholds.keep,
            parent_overlap: thresholds.parent,
        }),
        blake3,
    };
    let text = toml::to_string(&header).expect("a flat header is always TOML");
    contents.push((HEADER.into(), text.into_bytes()));
    folder::write(dir, &contents, force.then_some(HEADER))
}

fn table_path(layout: &Layout) -> PathBuf {
    Path::new("tables").join(format!("{}.parquet", layout.name))
}

/// The tables of `modal` in the order of [`LAYOUTS`].
fn tables(modal: &Modal) -> [Table; 5] {
    let mut tables = LAYOUTS.map(Table::new);
    let [grids, modes, shapes, mass, parents] = &mut tables;
    for set in &modal.sets {
        let time = set.flight_time_s;
        let (cg, i) = (set.body.cg_m, set.body.inertia_kg_m2);
        mass.push(
            &[],
            &[time, set.body.mass_kg, cg.x, cg.y, cg.z, i.m11, i.m22, i.m33, i.m12, i.m13, i.m23],
        );
        for grid in &set.grids {
            let mut row = vec![time];
            for vector in [&grid.position_m, &grid.mass_kg, &grid.inertia_kg_m2] {
                row.extend(vector.iter());
            }
            grids.push(&[&grid.name], &row);
        }
        for mode in &set.modes {
            modes.push(&[&mode.label], &[time, mode.frequency_hz, 1.0]);
            for ((grid, phi), psi) in set.grids.iter().zip(&mode.shape).zip(&mode.slope) {
                let row = [time, phi.x, phi.y, phi.z, psi.x, psi.y, psi.z];
                shapes.push(&[&mode.label, &grid.name], &row);
            }
        }
    }
    for parent in &modal.parents {
        parents.push(&[&parent.label, &parent.parent], &[parent.flight_time_s, parent.overlap]);
    }
    tables
}

/// Reads and checks the package in `dir`.
///
/// # Errors
/// Every problem that can be told: all of the header, then all of the tables' bytes and columns,
/// then all of their values and of how they fit together (the first twenty of a kind).
pub fn read(dir: &Path) -> Result<Modal, Problems> {
    let path = dir.join(HEADER);
    let file = files::name(&path);
    let header = header(&files::read_text(&path)?, &file)?;
    let mut problems = Problems::default();
    let mut read = Vec::new();
    for layout in LAYOUTS {
        let path = dir.join(table_path(layout));
        let digest = header.blake3.get(layout.name);
        let table = bytes(&path, digest)
            .and_then(|bytes| Table::from_bytes(layout, bytes, &files::name(&path)));
        match table {
            Ok(table) => read.push(table),
            Err(found) => problems.extend(found),
        }
    }
    let Ok([grids, modes, shapes, mass, parents]) = <[Table; 5]>::try_from(read) else {
        return Err(problems);
    };
    let mut check = Check { dir, problems, counts: BTreeMap::new() };
    let sets = check.sets(&mass);
    let Some(mut sets) = sets else { return Err(check.problems) };
    check.grids(&mut sets, &grids);
    check.modes(&mut sets, &modes);
    check.shapes(&mut sets, &shapes);
    let modal = Modal {
        source: header.source,
        contains_engines: header.contains_engines,
        parents: check.parents(&sets, &parents),
        sets,
    };
    if check.problems.0.is_empty() {
        check.normalisation(&modal.sets);
    }
    check.problems.into_result(modal)
}

/// Reads and checks the text of `package.toml`.
///
/// # Errors
/// Every problem of the header; if it is no TOML of the right types, the first of those.
pub fn header(text: &str, file: &str) -> Result<Header, Problems> {
    let header: Header = toml::from_str(text).map_err(|e| {
        let line = e.span().map_or(String::new(), |s| {
            format!("line {}", 1 + text[..s.start].matches('\n').count())
        });
        Problems::input(file, line, e.message().trim(), "the header of a modal package")
    })?;
    let mut problems = Problems::default();
    let mut only = |key: &str, found: &str, allowed: &str| {
        if found != allowed {
            problems.push(Kind::Input, file, key, format!("`{found}`"), format!("`{allowed}`"));
        }
    };
    only("format", &header.format.to_string(), "1");
    only("units", &header.units, "SI");
    only("frame", &header.frame, FRAME);
    only("normalisation", &header.normalisation, "mass");
    let mut engines = BTreeSet::new();
    for engine in &header.contains_engines {
        if engine.is_empty() || !engines.insert(engine) {
            let found = format!("`{engine}`");
            problems.push(Kind::Input, file, "contains_engines", found, "each engine once");
        }
    }
    if !header.contains_tanks.is_empty() {
        let found = format!("{:?}", header.contains_tanks);
        problems.push(Kind::Input, file, "contains_tanks", found, "no tank");
    }
    for key in header.blake3.keys() {
        if LAYOUTS.iter().all(|layout| layout.name != key) {
            problems.push(
                Kind::Input,
                file,
                "blake3",
                format!("`{key}`"),
                "grids, modes, shapes, mass, parents",
            );
        }
    }
    problems.into_result(header)
}

/// The bytes of a table file, of bounded size, checked against a digest if there is one.
fn bytes(path: &Path, digest: Option<&String>) -> Result<Vec<u8>, Problems> {
    let file = files::name(path);
    let damage = |found: String, allowed: &str| Problems::damage(&file, "", found, allowed);
    #[expect(clippy::disallowed_methods, reason = "the package is read from the disk here")]
    let opened = std::fs::File::open(path).map_err(|e| damage(e.to_string(), "a table file"))?;
    let mut bytes = Vec::new();
    let length = (opened.take(MAX_FILE + 1).read_to_end(&mut bytes))
        .map_err(|e| damage(e.to_string(), "a table file"))?;
    if length as u64 > MAX_FILE {
        return Err(damage("more than 1 GiB".to_owned(), "a table of at most 1 GiB"));
    }
    let found = blake3::hash(&bytes).to_hex().to_string();
    match digest {
        Some(digest) if *digest != found => Err(damage(
            format!("other bytes (BLAKE3 {found})"),
            &format!("the table that {HEADER} names (BLAKE3 {digest})"),
        )),
        _ => Ok(bytes),
    }
}

/// A check of the tables in progress.
struct Check<'a> {
    dir: &'a Path,
    problems: Problems,
    counts: BTreeMap<(&'static str, &'static str), usize>,
}

impl Check<'_> {
    /// Notes a problem of a table, unless many of its kind are noted already.
    fn note(
        &mut self,
        kind: Kind,
        layout: &Layout,
        key: &'static str,
        found: String,
        allowed: &str,
    ) {
        let file = files::name(&self.dir.join(table_path(layout)));
        let count = self.counts.entry((layout.name, key)).or_default();
        *count += 1;
        match (*count).cmp(&(REPORTED + 1)) {
            std::cmp::Ordering::Less => self.problems.push(kind, file, key, found, allowed),
            std::cmp::Ordering::Equal => {
                self.problems.push(kind, file, key, "more of the same", allowed);
            }
            std::cmp::Ordering::Greater => {}
        }
    }

    /// Empty mode sets at the flight times of the mass table.
    fn sets(&mut self, table: &Table) -> Option<Vec<ModeSet>> {
        let times = table.numbers(0);
        if times.is_empty() || !times.windows(2).all(|w| w[0] < w[1]) {
            let found = format!("{times:?}");
            let allowed = "one row for each flight time, increasing";
            self.note(Kind::Input, &MASS, "flight_time_s", found, allowed);
            return None;
        }
        let sets = (0..table.rows()).map(|row| {
            let n = |column: usize| table.numbers(column)[row];
            let inertia = Matrix3::new(n(5), n(8), n(9), n(8), n(6), n(10), n(9), n(10), n(7));
            if !(n(1) > 0.0) {
                self.note(Kind::Input, &MASS, "mass_kg", n(1).to_string(), "above 0");
            }
            if inertia.cholesky().is_none() {
                let found = format!("{:?} at {} s", inertia.as_slice(), times[row]);
                self.note(Kind::Input, &MASS, "ixx_kg_m2", found, "a positive definite tensor");
            }
            ModeSet {
                flight_time_s: times[row],
                body: MassProperties {
                    mass_kg: n(1),
                    cg_m: Vector3::new(n(2), n(3), n(4)),
                    inertia_kg_m2: inertia,
                },
                grids: Vec::new(),
                modes: Vec::new(),
            }
        });
        Some(sets.collect())
    }

    /// Place of the flight time of a row, in tables that are sorted by it.
    fn place(&mut self, sets: &[ModeSet], layout: &'static Layout, time: f64) -> Option<usize> {
        let place = sets.binary_search_by(|set| set.flight_time_s.total_cmp(&time)).ok();
        if place.is_none() {
            let found = format!("{time}");
            let allowed = "a flight time of the mass table";
            self.note(Kind::Damage, layout, "flight_time_s", found, allowed);
        }
        place
    }

    fn sorted(&mut self, layout: &'static Layout, table: &Table) {
        if let Some(at) = table.numbers(0).windows(2).position(|w| !(w[0] <= w[1])) {
            let found = format!("an earlier time in row {}", at + 1);
            self.note(Kind::Input, layout, "flight_time_s", found, "rows sorted by flight time");
        }
    }

    fn grids(&mut self, sets: &mut [ModeSet], table: &Table) {
        self.sorted(&GRIDS, table);
        let mut seen = BTreeSet::new();
        for (row, name) in table.texts(1).enumerate() {
            let Some(at) = self.place(sets, &GRIDS, table.numbers(0)[row]) else { continue };
            let time = sets[at].flight_time_s;
            if name.is_empty() || !seen.insert((at, name.to_owned())) {
                let found = format!("`{name}` again at {time} s");
                self.note(Kind::Damage, &GRIDS, "grid", found, "each grid once a time");
                continue;
            }
            let vector = |first: usize| Vector3::from_fn(|i, _| table.numbers(first + i)[row]);
            let (mass_kg, inertia_kg_m2) = (vector(5), vector(8));
            if !(mass_kg.min() >= 0.0 && inertia_kg_m2.min() >= 0.0) {
                let found = format!("a negative mass or inertia at `{name}`, {time} s");
                self.note(Kind::Input, &GRIDS, "mass_x_kg", found, "0 or above");
            }
            let grid =
                Grid { name: name.to_owned(), position_m: vector(2), mass_kg, inertia_kg_m2 };
            sets[at].grids.push(grid);
        }
    }

    fn modes(&mut self, sets: &mut [ModeSet], table: &Table) {
        self.sorted(&MODES, table);
        let mut seen = BTreeSet::new();
        for (row, label) in table.texts(1).enumerate() {
            let n = |column: usize| table.numbers(column)[row];
            let Some(at) = self.place(sets, &MODES, n(0)) else { continue };
            let set = &mut sets[at];
            let what = format!("mode `{label}` at {} s", set.flight_time_s);
            if label.is_empty() || !seen.insert((at, label.to_owned())) {
                let found = format!("{what} again");
                self.note(Kind::Damage, &MODES, "label", found, "each label once a time");
                continue;
            }
            if !((n(3) - 1.0).abs() <= NORMALISATION) {
                let found = format!("{} for {what}", n(3));
                let allowed = "1: modes normalised to unit generalised mass";
                self.note(Kind::Input, &MODES, "generalised_mass_kg", found, allowed);
            }
            let before = set.modes.last().map_or(0.0, |mode| mode.frequency_hz);
            if !(n(2) > 0.0 && n(2) >= before) {
                let found = format!("{} for {what}", n(2));
                let allowed = "above 0, ascending: elastic modes only";
                self.note(Kind::Input, &MODES, "frequency_hz", found, allowed);
            }
            let zeros = vec![Vector3::zeros(); set.grids.len()];
            set.modes.push(Mode {
                label: label.to_owned(),
                frequency_hz: n(2),
                shape: zeros.clone(),
                slope: zeros,
            });
        }
        for set in &*sets {
            if set.modes.is_empty() || set.grids.is_empty() {
                let found = format!("nothing at {} s", set.flight_time_s);
                let allowed = "modes and grids at each flight time of the mass table";
                self.note(Kind::Damage, &MODES, "flight_time_s", found, allowed);
            }
        }
    }

    fn shapes(&mut self, sets: &mut [ModeSet], table: &Table) {
        self.sorted(&SHAPES, table);
        // Places by name, as owned keys, since the sets change below.
        let places = |names: Vec<&str>| -> BTreeMap<String, usize> {
            names.into_iter().enumerate().map(|(i, name)| (name.to_owned(), i)).collect()
        };
        let places: Vec<_> = (sets.iter())
            .map(|set| {
                let modes = places(set.modes.iter().map(|m| m.label.as_str()).collect());
                let grids = places(set.grids.iter().map(|g| g.name.as_str()).collect());
                let filled = vec![false; modes.len() * grids.len()];
                (modes, grids, filled)
            })
            .collect();
        let mut places = places;
        for (row, (label, grid)) in table.texts(1).zip(table.texts(2)).enumerate() {
            let n = |column: usize| table.numbers(column)[row];
            let Some(at) = self.place(sets, &SHAPES, n(0)) else { continue };
            let (modes, grids, filled) = &mut places[at];
            let what = || format!("mode `{label}` at grid `{grid}`, {} s", n(0));
            let (Some(&mode), Some(&place)) = (modes.get(label), grids.get(grid)) else {
                let allowed = "a mode of the modes table and a grid of the grids table";
                self.note(Kind::Damage, &SHAPES, "grid", what(), allowed);
                continue;
            };
            if std::mem::replace(&mut filled[mode * grids.len() + place], true) {
                let found = format!("{} again", what());
                self.note(Kind::Damage, &SHAPES, "grid", found, "one row a mode and grid");
                continue;
            }
            let mode = &mut sets[at].modes[mode];
            mode.shape[place] = Vector3::new(n(3), n(4), n(5));
            mode.slope[place] = Vector3::new(n(6), n(7), n(8));
        }
        for (set, (_, grids, filled)) in sets.iter().zip(&places) {
            for at in filled.iter().enumerate().filter(|(_, filled)| !**filled).map(|(at, _)| at) {
                let (mode, grid) = (&set.modes[at / grids.len()], &set.grids[at % grids.len()]);
                let found = format!(
                    "no row for mode `{}` at grid `{}`, {} s",
                    mode.label, grid.name, set.flight_time_s
                );
                self.note(Kind::Damage, &SHAPES, "label", found, "a row for each mode and grid");
            }
        }
    }

    fn parents(&mut self, sets: &[ModeSet], table: &Table) -> Vec<Parent> {
        let mut parents = Vec::new();
        let mut seen = BTreeSet::new();
        for (row, (label, parent)) in table.texts(1).zip(table.texts(2)).enumerate() {
            let (time, overlap) = (table.numbers(0)[row], table.numbers(3)[row]);
            let Some(at) = self.place(sets, &PARENTS, time) else { continue };
            let what = format!("`{label}` at {time} s with the parent `{parent}`");
            let born_here = sets[at].mode(label).is_some()
                && sets[..at].iter().all(|set| set.mode(label).is_none());
            if !born_here {
                let allowed = "a label that first appears at this flight time";
                self.note(Kind::Damage, &PARENTS, "label", what.clone(), allowed);
            }
            if at == 0 || sets[at - 1].mode(parent).is_none() {
                let allowed = "a label of the flight time before";
                self.note(Kind::Damage, &PARENTS, "parent", what.clone(), allowed);
            }
            if !seen.insert((label.to_owned(), parent.to_owned())) {
                let found = format!("{what} again");
                self.note(Kind::Damage, &PARENTS, "parent", found, "each parent once");
            }
            // Round-off may leave the overlap of a shape with itself a little above 1.
            if !(0.0..=1.0 + 1e-9).contains(&overlap) {
                let found = format!("{overlap} for {what}");
                self.note(Kind::Input, &PARENTS, "overlap", found, "0 to 1");
            }
            parents.push(Parent {
                flight_time_s: time,
                label: label.to_owned(),
                parent: parent.to_owned(),
                overlap,
            });
        }
        parents
    }

    /// Where the grids carry the whole mass, they must give each mode its unit generalised mass.
    fn normalisation(&mut self, sets: &[ModeSet]) {
        for set in sets {
            let lumped: Vector3<f64> = set.grids.iter().map(|grid| grid.mass_kg).sum();
            if !((lumped.max() / set.body.mass_kg - 1.0).abs() <= WHOLE_MASS) {
                continue;
            }
            for mode in &set.modes {
                let sum: f64 = (set.grids.iter().zip(mode.shape.iter().zip(&mode.slope)))
                    .map(|(grid, (phi, psi))| {
                        grid.mass_kg.dot(&phi.component_mul(phi))
                            + grid.inertia_kg_m2.dot(&psi.component_mul(psi))
                    })
                    .sum();
                if !((sum - 1.0).abs() <= LUMPING) {
                    let found = format!(
                        "{sum:.4} kg on the masses of the grids for mode `{}` at {} s",
                        mode.label, set.flight_time_s
                    );
                    let allowed = "1 within 15 %: shapes normalised to unit generalised mass";
                    self.note(Kind::Input, &SHAPES, "phi_x_per_sqrt_kg", found, allowed);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{Selection, Stick, solve};
    use proptest::prelude::*;

    /// Two flight times, two modes, three grids; normalised on the masses of the grids.
    fn modal() -> Modal {
        let grid = |(i, name): (usize, &&str)| Grid {
            name: (*name).to_owned(),
            position_m: Vector3::new(i as f64, 0.5, -0.25),
            mass_kg: Vector3::repeat(2.0),
            inertia_kg_m2: Vector3::repeat(1.0),
        };
        let mode = |label: &str, hz: f64, at: usize| Mode {
            label: label.to_owned(),
            frequency_hz: hz,
            shape: (0..3).map(|i| Vector3::y() * if i == at { 0.6 } else { 0.0 }).collect(),
            slope: (0..3)
                .map(|i| Vector3::x() * if i == at { 0.28_f64.sqrt() } else { 0.0 })
                .collect(),
        };
        let set = |time: f64, labels: [&str; 2]| ModeSet {
            flight_time_s: time,
            body: MassProperties {
                mass_kg: 6.0,
                cg_m: Vector3::new(1.0, 0.5, -0.25),
                inertia_kg_m2: Matrix3::new(3.0, 0.1, 0.0, 0.1, 7.0, 0.2, 0.0, 0.2, 7.0),
            },
            grids: ["nose", "mitte ü", "tail"].iter().enumerate().map(grid).collect(),
            modes: vec![mode(labels[0], 1.0 / 3.0, 0), mode(labels[1], 2.5, 2)],
        };
        Modal {
            source: "a trial with \"quotes\"".to_owned(),
            contains_engines: vec!["booster.left".to_owned()],
            sets: vec![set(95.0, ["m001", "m002"]), set(100.5, ["m001", "m003"])],
            parents: vec![Parent {
                flight_time_s: 100.5,
                label: "m003".to_owned(),
                parent: "m002".to_owned(),
                overlap: 0.7,
            }],
        }
    }

    /// Writes a package whose header and tables a test has changed, without digests.
    fn written(
        place: &Path,
        modal: &Modal,
        change: impl FnOnce(&mut Header, &mut [Table; 5]),
    ) -> PathBuf {
        let dir = place.join("modes");
        write(&dir, modal, &Thresholds::default(), true).unwrap();
        let text = files::read_text(&dir.join(HEADER)).unwrap();
        let mut header: Header = toml::from_str(&text).unwrap();
        header.blake3.clear();
        let mut tables = tables(modal);
        change(&mut header, &mut tables);
        files::write(&dir.join(HEADER), toml::to_string(&header).unwrap().as_bytes()).unwrap();
        for (layout, table) in LAYOUTS.into_iter().zip(&tables) {
            let bytes = table.to_bytes(layout).unwrap();
            files::write(&dir.join(table_path(layout)), &bytes).unwrap();
        }
        dir
    }

    fn refused(change: impl FnOnce(&mut Header, &mut [Table; 5])) -> Problems {
        refused_of(&modal(), change)
    }

    fn refused_of(modal: &Modal, change: impl FnOnce(&mut Header, &mut [Table; 5])) -> Problems {
        let place = tempfile::tempdir().unwrap();
        read(&written(place.path(), modal, change)).unwrap_err()
    }

    fn tells(problems: &Problems, kind: Kind, parts: &[&str]) {
        let told = problems.to_string();
        for part in parts {
            assert!(told.contains(part), "{part} is missing in\n{told}");
        }
        assert_eq!(problems.kind(), kind, "{told}");
    }

    #[test]
    fn a_package_comes_back_bit_for_bit_and_its_bytes_repeat() {
        let place = tempfile::tempdir().unwrap();
        let (one, two) = (place.path().join("one"), place.path().join("two"));
        for dir in [&one, &two] {
            write(dir, &modal(), &Thresholds::default(), false).unwrap();
        }
        assert_eq!(read(&one).unwrap(), modal());
        let mut files = LAYOUTS.map(table_path).to_vec();
        files.push(HEADER.into());
        for file in files {
            let digest = |dir: &Path| blake3::hash(&bytes(&dir.join(&file), None).unwrap());
            assert_eq!(digest(&one), digest(&two), "{}", file.display());
        }
        let problems = write(&one, &modal(), &Thresholds::default(), false).unwrap_err();
        tells(&problems, Kind::Input, &["one: found something that exists", "--force"]);
        write(&one, &modal(), &Thresholds::default(), true).unwrap();
    }

    #[test]
    fn a_truncated_a_swapped_and_a_missing_table_are_damage() {
        let place = tempfile::tempdir().unwrap();
        let dir = place.path().join("modes");
        write(&dir, &modal(), &Thresholds::default(), false).unwrap();
        let path = |layout| dir.join(table_path(layout));
        let shapes = bytes(&path(&SHAPES), None).unwrap();
        files::write(&path(&SHAPES), &shapes[..shapes.len() / 2]).unwrap();
        tells(&read(&dir).unwrap_err(), Kind::Damage, &["shapes.parquet", "other bytes"]);
        let grids = bytes(&path(&GRIDS), None).unwrap();
        files::write(&path(&SHAPES), &grids).unwrap();
        tells(&read(&dir).unwrap_err(), Kind::Damage, &["shapes.parquet", "other bytes"]);
        folder::write(&dir, &[(HEADER.into(), Vec::new())], Some(HEADER)).unwrap();
        tells(&read(&dir).unwrap_err(), Kind::Input, &[HEADER, "missing field"]);
        let place = tempfile::tempdir().unwrap();
        let header = toml::to_string(&Header {
            format: 1,
            source: String::new(),
            units: "SI".to_owned(),
            frame: FRAME.to_owned(),
            normalisation: "mass".to_owned(),
            contains_engines: Vec::new(),
            contains_tanks: Vec::new(),
            labels: None,
            blake3: BTreeMap::new(),
        });
        files::write(&place.path().join(HEADER), header.unwrap().as_bytes()).unwrap();
        let problems = read(place.path()).unwrap_err();
        assert_eq!(problems.0.len(), 5);
        tells(&problems, Kind::Damage, &["grids.parquet", "mass.parquet", "parents.parquet"]);
    }

    #[test]
    fn a_truncated_table_is_damage_without_a_digest_too() {
        let place = tempfile::tempdir().unwrap();
        let dir = written(place.path(), &modal(), |_, _| {});
        let path = dir.join(table_path(&MODES));
        let whole = bytes(&path, None).unwrap();
        files::write(&path, &whole[..whole.len() - 9]).unwrap();
        tells(&read(&dir).unwrap_err(), Kind::Damage, &["modes.parquet", "a whole Parquet file"]);
    }

    #[test]
    fn all_problems_of_a_header_are_told_at_once() {
        let problems = refused(|header, _| {
            header.format = 3;
            header.units = "inch".to_owned();
            header.frame = "z up".to_owned();
            header.normalisation = "maximum".to_owned();
            header.contains_engines = vec!["a.b".to_owned(), "a.b".to_owned()];
            header.contains_tanks = vec!["lox".to_owned()];
            header.blake3.insert("shape".to_owned(), String::new());
        });
        assert_eq!(problems.0.len(), 7);
        let parts =
            ["format: found `3`", "`SI`", "`z up`", "`maximum`", "contains_tanks", "`shape`"];
        tells(&problems, Kind::Input, &parts);
    }

    #[test]
    fn an_unknown_key_of_the_header_is_told_with_its_line() {
        let text = "format = 1\nsource = \"\"\nunit = \"SI\"\n";
        let told = header(text, "package.toml").unwrap_err().to_string();
        assert!(told.contains("line 3") && told.contains("`unit`"), "{told}");
    }

    #[test]
    fn a_missing_column_and_a_value_that_is_not_finite_are_told() {
        let place = tempfile::tempdir().unwrap();
        let dir = written(place.path(), &modal(), |_, tables| {
            tables[2].push(&["m001", "nose"], &[95.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0]);
        });
        const FEWER: Layout =
            Layout { name: "mass", columns: &[TIME, Column("mass_kg", Holds::Text, "")] };
        let mut few = Table::new(&FEWER);
        few.push(&["heavy"], &[95.0]);
        let bytes = few.to_bytes(&FEWER).unwrap();
        files::write(&dir.join(table_path(&MASS)), &bytes).unwrap();
        let parts = [
            "mass_kg: found Utf8; allowed: double-precision",
            "ixy_kg_m2: found no such column",
            "phi_x_per_sqrt_kg: found inf in row 12",
        ];
        tells(&read(&dir).unwrap_err(), Kind::Input, &parts);
    }

    #[test]
    fn missing_extra_and_repeated_rows_of_shapes_are_told_by_mode_and_grid() {
        let problems = refused(|_, tables| {
            let mut shapes = Table::new(&SHAPES);
            for set in &modal().sets {
                for mode in &set.modes {
                    for grid in ["nose", "nose", "bow"] {
                        let row = [set.flight_time_s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                        shapes.push(&[&mode.label, grid], &row);
                    }
                }
            }
            tables[2] = shapes;
        });
        let parts = [
            "mode `m001` at grid `nose`, 95 s again",
            "mode `m003` at grid `bow`, 100.5 s",
            "no row for mode `m002` at grid `tail`, 95 s",
        ];
        tells(&problems, Kind::Damage, &parts);
    }

    #[test]
    fn a_wrong_normalisation_is_told_by_the_generalised_mass_and_by_the_masses_of_the_grids() {
        let problems = refused(|_, tables| {
            tables[1] = Table::new(&MODES);
            for set in &modal().sets {
                for (mode, mass) in set.modes.iter().zip([1.0, 250.0]) {
                    let row = [set.flight_time_s, mode.frequency_hz, mass];
                    tables[1].push(&[&mode.label], &row);
                }
            }
        });
        tells(&problems, Kind::Input, &["generalised_mass_kg: found 250 for mode `m002` at 95 s"]);
        let mut scaled = modal();
        for vector in &mut scaled.sets[1].modes[1].shape {
            *vector *= 2.0;
        }
        let problems = refused_of(&scaled, |_, _| {});
        tells(&problems, Kind::Input, &["3.1600 kg", "mode `m003` at 100.5 s"]);
        // Where the grids do not carry the whole mass, they cannot tell.
        for set in &mut scaled.sets {
            set.body.mass_kg = 7.0;
        }
        let place = tempfile::tempdir().unwrap();
        read(&written(place.path(), &scaled, |_, _| {})).unwrap();
    }

    #[test]
    fn repeated_labels_and_grids_unsorted_and_unknown_times_are_told() {
        let problems = refused(|_, tables| {
            tables[0].push(&["nose"], &[95.0; 10]);
            tables[1].push(&["m001"], &[100.5, 9.0, 1.0]);
            tables[1].push(&["m009"], &[96.0, 9.0, 1.0]);
        });
        let parts = [
            "grid: found `nose` again at 95 s",
            "grids.parquet: flight_time_s: found an earlier time in row 6",
            "mode `m001` at 100.5 s again",
            "modes.parquet: flight_time_s: found 96",
        ];
        tells(&problems, Kind::Damage, &parts);
        let mut turned = modal();
        turned.sets.reverse();
        let problems = refused_of(&turned, |_, _| {});
        tells(&problems, Kind::Input, &["mass.parquet: flight_time_s: found [100.5, 95.0]"]);
    }

    #[test]
    fn frequencies_masses_and_inertias_that_cannot_be_are_told() {
        let mut wrong = modal();
        wrong.sets[0].modes[0].frequency_hz = -1.0;
        wrong.sets[1].modes[1].frequency_hz = 0.1;
        wrong.sets[0].body.mass_kg = 0.0;
        wrong.sets[1].body.inertia_kg_m2.m11 = -3.0;
        wrong.sets[1].grids[1].mass_kg.z = -1.0;
        let parts = [
            "frequency_hz: found -1 for mode `m001`",
            "frequency_hz: found 0.1 for mode `m003`",
            "mass_kg: found 0;",
            "ixx_kg_m2",
            "a negative mass or inertia at `mitte ü`",
        ];
        tells(&refused_of(&wrong, |_, _| {}), Kind::Input, &parts);
    }

    #[test]
    fn parents_that_do_not_exist_are_told() {
        let problems = refused(|_, tables| {
            tables[4].push(&["m003", "m009"], &[100.5, 0.2]);
            tables[4].push(&["m001", "m002"], &[100.5, 0.2]);
            tables[4].push(&["m002", "m001"], &[95.0, 1.5]);
        });
        let parts = [
            "parent: found `m003` at 100.5 s with the parent `m009`",
            "label: found `m001` at 100.5 s",
            "parent: found `m002` at 95 s",
            "overlap: found 1.5",
        ];
        tells(&problems, Kind::Damage, &parts);
    }

    #[test]
    fn many_problems_of_a_kind_are_cut_short() {
        let problems = refused(|_, tables| {
            for _ in 0..1000 {
                tables[2].push(&["m001", "stern"], &[100.5; 7]);
            }
        });
        assert_eq!(problems.0.len(), REPORTED + 1);
        assert!(problems.to_string().ends_with("a grid of the grids table"));
    }

    #[test]
    fn the_package_of_the_reference_vehicle_is_made_by_its_stick_model() {
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("vehicles/sls-like");
        let stored = read(&place.join("modes")).unwrap();
        let text = files::read_text(&place.join("stick.toml")).unwrap();
        let stick = Stick::parse(&text, "stick.toml").unwrap();
        let thresholds = Thresholds::default();
        let (made, rigid) =
            solve(&stick, &stick.flight_times_s, Selection::UpTo(20.0), &thresholds).unwrap();
        assert!(rigid.iter().all(|r| r.count == 6));
        assert_eq!(stored.source, made.source);
        assert_eq!(stored.labels(), made.labels());
        assert_eq!(stored.parents.len(), made.parents.len());
        let freedoms = 6.0 * stick.nodes.len() as f64;
        for (a, b) in stored.sets.iter().zip(&made.sets) {
            assert_eq!(a.flight_time_s, b.flight_time_s);
            assert!((a.body.mass_kg / b.body.mass_kg - 1.0).abs() <= 1e-12);
            let mu: Vec<f64> = b.modes.iter().map(|m| m.frequency_hz.powi(-2)).collect();
            for (j, (p, q)) in a.modes.iter().zip(&b.modes).enumerate() {
                assert_eq!(p.label, q.label);
                assert!((p.frequency_hz / q.frequency_hz - 1.0).abs() <= 1e-9);
                // A vector turns by the round-off of the flexibility, n ε μ₁, over the distance to
                // the next eigenvalue; the last one's other neighbour is not in the package.
                let apart = [j.checked_sub(1), Some(j + 1)].into_iter().flatten();
                let gap = (apart.filter_map(|i| mu.get(i)).map(|other| (other - mu[j]).abs()))
                    .fold(1e-3 * mu[j], f64::min);
                let bound = freedoms * f64::EPSILON * mu[0] / gap;
                let mut off = 0.0;
                for (i, grid) in b.grids.iter().enumerate() {
                    let (u, v) = (p.shape[i] - q.shape[i], p.slope[i] - q.slope[i]);
                    off += grid.mass_kg.dot(&u.component_mul(&u));
                    off += grid.inertia_kg_m2.dot(&v.component_mul(&v));
                }
                assert!(off.sqrt() <= bound, "{} {:e} {bound:e}", p.label, off.sqrt());
            }
            assert_eq!(a.modes.len(), b.modes.len());
        }
    }

    #[test]
    fn the_antisymmetric_booster_bending_mode_of_the_reference_vehicle_keeps_one_label() {
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("vehicles/sls-like/modes");
        let modal = read(&place).unwrap();
        let mut before = 0.0;
        for set in &modal.sets {
            let [left, right] =
                ["left", "right"].map(|side| set.grid(&format!("booster.{side}.gimbal")).unwrap());
            let z = |mode: &Mode| [mode.shape[left].z, mode.shape[right].z];
            let antisymmetric = set.modes.iter().filter(|mode| z(mode)[0] * z(mode)[1] < 0.0);
            let strongest = antisymmetric
                .filter(|mode| mode.frequency_hz < 7.0)
                .max_by(|a, b| z(a)[0].abs().total_cmp(&z(b)[0].abs()))
                .unwrap();
            assert_eq!(strongest.label, "m006", "at {} s", set.flight_time_s);
            // Symmetry is exact but for round-off in the solver.
            assert!((z(strongest)[0] + z(strongest)[1]).abs() <= 1e-9 * z(strongest)[0].abs());
            // It rises as propellant burns.
            assert!(strongest.frequency_hz > before);
            before = strongest.frequency_hz;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn altered_tables_are_read_or_refused(
            which in 0..5_usize, at in 0..1_000_000_usize, to in any::<u8>(), cut in any::<bool>(),
        ) {
            let place = tempfile::tempdir().unwrap();
            let dir = written(place.path(), &modal(), |_, _| {});
            let path = dir.join(table_path(LAYOUTS[which]));
            let mut content = bytes(&path, None).unwrap();
            let at = at % content.len();
            if cut {
                content.truncate(at);
            } else {
                content[at] = to;
            }
            files::write(&path, &content).unwrap();
            prop_assert!(!cut || read(&dir).is_err());
            let _ = read(&dir);
        }

        #[test]
        fn any_header_is_read_or_refused(text in "[a-z_=.\"0-9\\[\\]\n -]{0,200}") {
            let _ = header(&text, "package.toml");
        }
    }
}
