//! The modal package on disk: `package.toml` and flat Parquet tables in `tables/`.
//!
//! The validated content is `vehicle::Modal`; this module reads, checks and writes it.
//!
//! What is unreadable, missing, swapped or contradicts another table is damage; what is
//! readable but not allowed (a header, a column, a value, a normalisation) is wrong input.

mod check;
#[cfg(test)]
mod tests;

use super::flat::{Column, Holds, Layout, Table};
use super::{files, folder};
use crate::import::{Made, Moved};
use crate::problem::{Kind, Problems};
use crate::structure::Thresholds;
use crate::vehicle::Modal;
use check::Check;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The file that makes a folder a modal package.
pub const HEADER: &str = "package.toml";
/// The only frame that is understood.
pub const FRAME: &str = "x along the centreline, positive aft; y, z lateral; right-handed";
/// Largest table file that is read, bytes.
const MAX_FILE: u64 = 1 << 30;

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
/// Quality of sections, a table beside the others that imported packages have; no campaign reads it.
pub const SECTIONS: Layout = Layout {
    name: "sections",
    columns: &[
        TIME,
        LABEL,
        Column("grid", Holds::Text, "Name of the grid whose rotation comes from a section"),
        Column("nodes", Holds::Number("1"), "Nodes of the section"),
        Column("residual", Holds::Number("1"), "Misfit to a rigid motion over the motion"),
        Column(
            "scatter_rad_per_m_sqrt_kg",
            Holds::Number("rad/m kg^-1/2"),
            "Deviation of the rotation if the misfit is scatter between nodes",
        ),
        Column(
            "rounding_rad_per_m_sqrt_kg",
            Holds::Number("rad/m kg^-1/2"),
            "Deviation of the rotation by the rounding of stored translations",
        ),
    ],
};
/// Layouts of the tables.
pub fn layouts() -> [&'static Layout; 5] {
    LAYOUTS
}

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
    /// Tanks whose slosh masses the modes contain, locked; empty for a reduced body.
    pub contains_tanks: Vec<String>,
    /// Overlaps by which labels were given, where they were given by overlap.
    pub labels: Option<LabelHeader>,
    /// BLAKE3 digest of each table file, hexadecimal. May be left out as a whole.
    #[serde(default)]
    pub blake3: BTreeMap<String, String>,
    /// Where the modes were imported from, and how good they are.
    pub import: Option<ImportHeader>,
}

/// Where imported modes come from, and how good they are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImportHeader {
    /// Programs that wrote the results.
    pub programs: Vec<String>,
    /// Units that were declared.
    pub units: String,
    /// What was doubtful.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// BLAKE3 digest of the table `sections`, if there is one.
    pub sections_blake3: Option<String>,
    /// BLAKE3 digest of each file that was read, by its name in the description.
    #[serde(default)]
    pub inputs: BTreeMap<String, String>,
    /// Grids by their role.
    #[serde(default)]
    pub roles: BTreeMap<String, Vec<String>>,
    /// Rigid-body modes of each flight time.
    #[serde(default)]
    pub rigid_body_mode: Vec<RigidHeader>,
}

/// A rigid-body mode of the files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigidHeader {
    /// Flight time, s.
    pub flight_time_s: f64,
    /// Number in the file.
    pub number: i64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Share of the shape that no rigid motion explains, 0 to 1.
    pub residual: f64,
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
    write_with(dir, modal, thresholds, force, None)
}

/// Writes imported modal data as the package `dir`, with their quality; `units` as declared,
/// `inputs` the digest of each file by its name.
///
/// # Errors
/// As for [`write()`].
pub fn write_imported(
    dir: &Path,
    made: &Made,
    units: &str,
    inputs: BTreeMap<String, String>,
    force: bool,
) -> Result<(), Problems> {
    let mut programs: Vec<String> = Vec::new();
    for time in &made.times {
        if !programs.contains(&time.program) {
            programs.push(time.program.clone());
        }
    }
    let rigid = made.times.iter().flat_map(|time| {
        time.rigid.modes.iter().map(|mode| RigidHeader {
            flight_time_s: time.flight_time_s,
            number: mode.number,
            frequency_hz: mode.frequency_hz,
            residual: mode.residual,
        })
    });
    let mut roles: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (grid, role) in &made.roles {
        roles.entry((*role).to_owned()).or_default().push(grid.clone());
    }
    let import = ImportHeader {
        programs,
        units: units.to_owned(),
        warnings: made.warnings.clone(),
        sections_blake3: None,
        inputs,
        roles,
        rigid_body_mode: rigid.collect(),
    };
    let mut sections = Table::new(&SECTIONS);
    for row in &made.sections {
        let numbers =
            [row.flight_time_s, row.nodes as f64, row.residual, row.scatter, row.rounding];
        sections.push(&[&row.label, &row.grid], &numbers);
    }
    write_with(dir, &made.modal, &made.thresholds, force, Some((import, sections)))
}

fn write_with(
    dir: &Path,
    modal: &Modal,
    thresholds: &Thresholds,
    force: bool,
    import: Option<(ImportHeader, Table)>,
) -> Result<(), Problems> {
    let mut blake3 = BTreeMap::new();
    let mut contents = Vec::new();
    let mut add = |layout: &Layout, table: &Table| -> Result<String, Problems> {
        let bytes = table.to_bytes(layout).map_err(|e| {
            Problems::damage(files::name(dir), layout.name, e.to_string(), "a table to write")
        })?;
        let digest = blake3::hash(&bytes).to_hex().to_string();
        contents.push((table_path(layout), bytes));
        Ok(digest)
    };
    for (layout, table) in LAYOUTS.into_iter().zip(tables(modal)) {
        blake3.insert(layout.name.to_owned(), add(layout, &table)?);
    }
    let import = match import {
        None => None,
        Some((header, sections)) if sections.rows() == 0 => Some(header),
        Some((mut header, sections)) => {
            header.sections_blake3 = Some(add(&SECTIONS, &sections)?);
            Some(header)
        }
    };
    let header = Header {
        format: 1,
        source: modal.source.clone(),
        units: "SI".to_owned(),
        frame: FRAME.to_owned(),
        normalisation: "mass".to_owned(),
        contains_engines: modal.contains_engines.clone(),
        contains_tanks: modal.contains_tanks.clone(),
        labels: Some(LabelHeader {
            keep_overlap: thresholds.keep,
            parent_overlap: thresholds.parent,
        }),
        blake3,
        import,
    };
    let text = toml::to_string(&header).expect("a flat header is always TOML");
    contents.push((HEADER.into(), text.into_bytes()));
    // A package that was imported has one table more.
    folder::write(dir, &contents, force.then_some(HEADER), &[table_path(&SECTIONS)])
}

/// Where the modes of the package in `dir` were imported from, with the quality of its sections;
/// `None` if they were not imported.
///
/// # Errors
/// Problems of the header, and of the table `sections` where the header names one.
pub fn read_import(dir: &Path) -> Result<Option<(ImportHeader, Vec<Moved>)>, Problems> {
    let path = dir.join(HEADER);
    let header = header(&files::read_text(&path)?, &files::name(&path))?;
    let Some(import) = header.import else { return Ok(None) };
    let mut rows = Vec::new();
    if let Some(digest) = &import.sections_blake3 {
        let path = dir.join(table_path(&SECTIONS));
        let table = Table::from_bytes(&SECTIONS, bytes(&path, Some(digest))?, &files::name(&path))?;
        for (i, (label, grid)) in table.texts(1).zip(table.texts(2)).enumerate() {
            let n = |column: usize| table.numbers(column)[i];
            rows.push(Moved {
                flight_time_s: n(0),
                grid: grid.to_owned(),
                label: label.to_owned(),
                // Counts of nodes are whole and small.
                nodes: n(3) as usize,
                residual: n(4),
                scatter: n(5),
                rounding: n(6),
            });
        }
    }
    Ok(Some((import, rows)))
}

fn table_path(layout: &Layout) -> PathBuf {
    Path::new("tables").join(format!("{}.parquet", layout.name))
}

/// The JSON Schema of [`HEADER`].
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Header)
}

/// The files of the package in `dir`.
pub fn files(dir: &Path) -> Vec<PathBuf> {
    let tables = LAYOUTS.iter().map(|layout| dir.join(table_path(layout)));
    std::iter::once(dir.join(HEADER)).chain(tables).collect()
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
        contains_tanks: header.contains_tanks,
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
    for (key, names, allowed) in [
        ("contains_engines", &header.contains_engines, "each engine once"),
        ("contains_tanks", &header.contains_tanks, "each tank once"),
    ] {
        let mut known = BTreeSet::new();
        for name in names {
            if name.is_empty() || !known.insert(name) {
                problems.push(Kind::Input, file, key, format!("`{name}`"), allowed);
            }
        }
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
