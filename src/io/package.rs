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
