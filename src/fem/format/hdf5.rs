//! Nastran HDF5 (`MDLPRM,HDF5`): eigenvectors, eigenvalue summary, grids and coordinate systems.
//!
//! The container itself is read by the crate `hdf5-reader`; here are the tables inside it.
//!
//! Tables as in the MSC Nastran "HDF5 Result and Input" schema.

use std::collections::{BTreeMap, BTreeSet};

use hdf5_reader::{Datatype, Hdf5File, OpenOptions};

use super::{complex, frequency_hz, superelement};
use crate::fem::results::{
    Node, NodeShape, Point, Precision, RawMode, Results, System, SystemKind,
};
use crate::problem::Problems;

const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Deflate cannot shrink data by more than 1032 (<https://zlib.net/zlib_tech.html>), so a table
/// larger than that times the file is damaged.
const MOST_EXPANSION: usize = 1032;

/// Tables at least as large as this are always read: chunks that were never written cost nothing.
const LEAST_LIMIT: usize = 1 << 20;

const SYSTEMS: [(&str, SystemKind, bool); 6] = [
    ("CORD1R", SystemKind::Rectangular, true),
    ("CORD1C", SystemKind::Cylindrical, true),
    ("CORD1S", SystemKind::Spherical, true),
    ("CORD2R", SystemKind::Rectangular, false),
    ("CORD2C", SystemKind::Cylindrical, false),
    ("CORD2S", SystemKind::Spherical, false),
];

pub(super) fn recognised(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// A number of a row: where it stands and how it is stored.
#[derive(Clone, Copy)]
struct Field {
    offset: usize,
    size: usize,
    float: bool,
    count: usize,
}

/// A table of rows with named fields, its numbers in the byte order of this machine.
struct Table<'a> {
    path: &'a str,
    name: &'a str,
    bytes: Vec<u8>,
    row: usize,
    fields: BTreeMap<String, Field>,
}

impl Table<'_> {
    fn rows(&self) -> std::slice::ChunksExact<'_, u8> {
        self.bytes.chunks_exact(self.row)
    }

    fn field(&self, name: &str, float: bool, count: usize) -> Result<Field, Problems> {
        let field = self.fields.get(name).copied();
        field.filter(|field| field.float == float && field.count >= count).ok_or_else(|| {
            let fields = self.fields.keys().cloned().collect::<Vec<_>>().join(", ");
            let what = if float { "numbers" } else { "integers" };
            let allowed = format!("a field {name} of {what}");
            Problems::damage(self.name, self.path, format!("fields {fields}"), allowed)
        })
    }

    fn integer(&self, name: &str) -> Result<Field, Problems> {
        self.field(name, false, 1)
    }

    fn float(&self, name: &str) -> Result<Field, Problems> {
        self.field(name, true, 1)
    }

    fn three(&self, names: [&str; 3]) -> Result<[Field; 3], Problems> {
        Ok([self.float(names[0])?, self.float(names[1])?, self.float(names[2])?])
    }
}

impl Field {
    fn int(self, row: &[u8]) -> i64 {
        let bytes = &row[self.offset..self.offset + self.size];
        match *bytes {
            [a, b, c, d] => i32::from_ne_bytes([a, b, c, d]).into(),
            [a, b, c, d, e, f, g, h] => i64::from_ne_bytes([a, b, c, d, e, f, g, h]),
            _ => 0,
        }
    }

    fn at(self, row: &[u8], k: usize) -> f64 {
        let from = self.offset + k * self.size;
        match row[from..from + self.size] {
            [a, b, c, d] => f32::from_ne_bytes([a, b, c, d]).into(),
            [a, b, c, d, e, f, g, h] => f64::from_ne_bytes([a, b, c, d, e, f, g, h]),
            _ => 0.0,
        }
    }

    fn real(self, row: &[u8]) -> f64 {
        self.at(row, 0)
    }
}

/// Numbers of 4 or 8 bytes, single or in an array; anything else is left out of the fields.
fn field(offset: usize, datatype: &Datatype) -> Option<Field> {
    match datatype {
        Datatype::FixedPoint { size: size @ (4 | 8), .. } => {
            Some(Field { offset, size: (*size).into(), float: false, count: 1 })
        }
        Datatype::FloatingPoint { size: size @ (4 | 8), .. } => {
            Some(Field { offset, size: (*size).into(), float: true, count: 1 })
        }
        Datatype::Array { base, dims } => {
            let count = dims.iter().try_fold(1_usize, |product, dim| {
                product.checked_mul(usize::try_from(*dim).ok()?)
            })?;
            Some(Field { count, ..field(offset, base)? })
        }
        _ => None,
    }
}

struct File<'a> {
    file: Hdf5File,
    name: &'a str,
}

impl<'a> File<'a> {
    fn damage(&self, path: &str, error: &hdf5_reader::error::Error) -> Problems {
        Problems::damage(self.name, path, error.to_string(), "an HDF5 file in good order")
    }

    /// The table at a path; none if there is nothing at the path.
    fn table(&self, path: &'a str) -> Result<Option<Table<'a>>, Problems> {
        let (folder, last) = path.rsplit_once('/').unwrap_or(("", path));
        let Some(group) = self.group(folder)? else { return Ok(None) };
        let (_, datasets) = group.member_names().map_err(|e| self.damage(path, &e))?;
        if !datasets.iter().any(|dataset| dataset == last) {
            return Ok(None);
        }
        let dataset = group.dataset(last).map_err(|e| self.damage(path, &e))?;
        let Datatype::Compound { size, fields } = dataset.dtype() else {
            let found = "a table without named fields";
            return Err(Problems::damage(self.name, path, found, "a compound table"));
        };
        let row = *size as usize;
        let fields: BTreeMap<String, Field> = fields
            .iter()
            .filter_map(|f| Some((f.name.clone(), field(f.byte_offset as usize, &f.datatype)?)))
            .filter(|(_, f)| {
                let length = f.size.checked_mul(f.count);
                length.and_then(|l| l.checked_add(f.offset)).is_some_and(|end| end <= row)
            })
            .collect();
        let bytes = dataset.read_native_bytes().map_err(|e| self.damage(path, &e))?;
        if row == 0 || bytes.len() % row != 0 {
            let found = format!("{} bytes in rows of {row}", bytes.len());
            return Err(Problems::damage(self.name, path, found, "whole rows"));
        }
        Ok(Some(Table { path, name: self.name, bytes, row, fields }))
    }

    fn group(&self, path: &str) -> Result<Option<hdf5_reader::group::Group>, Problems> {
        let mut group = self.file.root_group().map_err(|e| self.damage(path, &e))?;
        for part in path.split('/').filter(|part| !part.is_empty()) {
            let (groups, _) = group.member_names().map_err(|e| self.damage(path, &e))?;
            if !groups.iter().any(|group| group == part) {
                return Ok(None);
            }
            group = group.group(part).map_err(|e| self.damage(path, &e))?;
        }
        Ok(Some(group))
    }
}

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let limit = bytes.len().saturating_mul(MOST_EXPANSION).max(LEAST_LIMIT);
    let options = OpenOptions::default()
        .with_max_read_bytes(limit)
        .with_max_chunk_bytes(limit)
        .with_max_object_header_bytes(bytes.len());
    let file = Hdf5File::from_bytes_with_options(bytes, options)
        .map_err(|e| Problems::damage(name, "", e.to_string(), "an HDF5 file in good order"))?;
    let file = File { file, name };
    if file.group("/NASTRAN")?.is_none() {
        let root = file.file.root_group().and_then(|root| root.member_names());
        let (groups, _) = root.map_err(|e| file.damage("/", &e))?;
        let found = format!("an HDF5 file with the groups {}", groups.join(", "));
        return Err(Problems::input(name, "/", found, "the group NASTRAN, as MDLPRM,HDF5 writes"));
    }
    let mut results = Results::empty("Nastran HDF5", Precision::Double);
    let ids = grids(&file, &mut results)?;
    systems(&file, &mut results)?;
    if file.table("/NASTRAN/RESULT/NODAL/EIGENVECTOR_CPLX")?.is_some() {
        return Err(complex(name, "/NASTRAN/RESULT/NODAL/EIGENVECTOR_CPLX"));
    }
    modes(&file, &ids, &mut results)?;
    Ok(results)
}

/// Reads the grids; gives the ids of all of them, of structure.
fn grids(file: &File, results: &mut Results) -> Result<BTreeSet<i64>, Problems> {
    let Some(table) = file.table("/NASTRAN/INPUT/NODE/GRID")? else { return Ok(BTreeSet::new()) };
    let (id, cp, cd) = (table.integer("ID")?, table.integer("CP")?, table.integer("CD")?);
    let x = table.field("X", true, 3)?;
    let mut fluid = 0;
    for row in table.rows() {
        let displacement_system = cd.int(row);
        if displacement_system < 0 {
            fluid += 1;
            continue;
        }
        results.nodes.push(Node {
            id: id.int(row),
            position: [x.at(row, 0), x.at(row, 1), x.at(row, 2)],
            position_system: cp.int(row),
            displacement_system,
        });
    }
    if fluid > 0 {
        results.warnings.push(format!("{fluid} fluid grids are left out"));
    }
    Ok(results.nodes.iter().map(|node| node.id).collect())
}

fn systems(file: &File, results: &mut Results) -> Result<(), Problems> {
    let paths = [
        "/NASTRAN/INPUT/COORDINATE_SYSTEM/CORD1R",
        "/NASTRAN/INPUT/COORDINATE_SYSTEM/CORD1C",
        "/NASTRAN/INPUT/COORDINATE_SYSTEM/CORD1S",
        "/NASTRAN/INPUT/COORDINATE_SYSTEM/CORD2R",
        "/NASTRAN/INPUT/COORDINATE_SYSTEM/CORD2C",
        "/NASTRAN/INPUT/COORDINATE_SYSTEM/CORD2S",
    ];
    for ((_, kind, by_nodes), path) in SYSTEMS.into_iter().zip(paths) {
        let Some(table) = file.table(path)? else { continue };
        let cid = table.integer("CID")?;
        let mut points: Vec<(i64, [Point; 3])> = Vec::new();
        if by_nodes {
            let nodes = [table.integer("G1")?, table.integer("G2")?, table.integer("G3")?];
            let all =
                table.rows().map(|row| (cid.int(row), nodes.map(|g| Point::Node(g.int(row)))));
            points.extend(all);
        } else {
            let rid = table.integer("RID")?;
            let corners = [
                table.three(["A1", "A2", "A3"])?,
                table.three(["B1", "B2", "B3"])?,
                table.three(["C1", "C2", "C3"])?,
            ];
            points.extend(table.rows().map(|row| {
                let reference = rid.int(row);
                let point = |corner: [Field; 3]| Point::Given {
                    reference,
                    position: corner.map(|x| x.real(row)),
                };
                (cid.int(row), corners.map(point))
            }));
        }
        for (id, [a, b, c]) in points {
            let system = System { id, kind, a, b, c };
            if results.systems.insert(id, system).is_some_and(|known| known != system) {
                let found = format!("two coordinate systems {id}");
                return Err(Problems::damage(file.name, path, found, "one definition"));
            }
        }
    }
    Ok(())
}

/// What the domain table says about one mode.
struct Domain {
    subcase: i64,
    mode: i64,
    eigenvalue: f64,
}

fn modes(file: &File, ids: &BTreeSet<i64>, results: &mut Results) -> Result<(), Problems> {
    let Some(table) = file.table("/NASTRAN/RESULT/NODAL/EIGENVECTOR")? else { return Ok(()) };
    let used = table.integer("DOMAIN_ID")?;
    let domains = domains(file, &table, used)?;
    let subcases: BTreeSet<i64> = domains.values().map(|domain| domain.subcase).collect();
    if subcases.len() > 1 {
        let found = format!("eigenvectors of subcases {subcases:?}");
        return Err(Problems::input(file.name, table.path, found, "one subcase"));
    }
    let (summary, augmented) = summary(file)?;
    let id = table.integer("ID")?;
    let translations = table.three(["X", "Y", "Z"])?;
    let rotations = table.three(["RX", "RY", "RZ"])?;
    let mut modes: BTreeMap<i64, RawMode> = BTreeMap::new();
    let mut scalar = 0;
    for row in table.rows() {
        let domain = used.int(row);
        let Some(Domain { mode, eigenvalue, .. }) = domains.get(&domain) else {
            let found = format!("domain {domain}, which is not in the table of domains");
            return Err(Problems::damage(file.name, table.path, found, "a known domain"));
        };
        let mode = modes.entry(domain).or_insert_with(|| {
            let of_mode = summary.iter().filter(|line| line.mode == *mode);
            let near = |line: &&Eigenvalue| (line.eigenvalue - eigenvalue).abs();
            let line = of_mode.min_by(|a, b| near(a).total_cmp(&near(b)));
            RawMode {
                number: *mode,
                frequency_hz: line.map_or(frequency_hz(*eigenvalue), |line| line.frequency_hz),
                generalised_mass: line.map(|line| line.mass),
                shape: Vec::new(),
            }
        });
        // The table has no column for the kind of point: those that are no grids are scalar.
        let node = id.int(row);
        if !ids.is_empty() && !ids.contains(&node) {
            scalar += 1;
            continue;
        }
        mode.shape.push(NodeShape {
            node,
            translation: translations.map(|x| x.real(row)),
            rotation: Some(rotations.map(|x| x.real(row))),
        });
    }
    if translations[0].size == 4 {
        results.precision = Precision::Single;
    }
    results.modes = modes.into_values().collect();
    if scalar > 0 {
        results.warnings.push(format!("{scalar} values at points that are no grids are left out"));
    }
    if augmented {
        results.warnings.push(super::augmented());
    }
    Ok(())
}

/// The domains that the eigenvectors use.
fn domains(
    file: &File,
    eigenvectors: &Table,
    used: Field,
) -> Result<BTreeMap<i64, Domain>, Problems> {
    let path = "/NASTRAN/RESULT/DOMAINS";
    let Some(table) = file.table(path)? else {
        return Err(Problems::damage(file.name, path, "nothing", "the table of domains"));
    };
    let used: BTreeSet<i64> = eigenvectors.rows().map(|row| used.int(row)).collect();
    let id = table.integer("ID")?;
    let (subcase, mode) = (table.integer("SUBCASE")?, table.integer("MODE")?);
    let (real, imaginary) = (table.float("TIME_FREQ_EIGR")?, table.float("EIGI")?);
    let element = table.integer("SE")?;
    let mut domains = BTreeMap::new();
    for row in table.rows().filter(|row| used.contains(&id.int(row))) {
        if element.int(row) != 0 {
            return Err(superelement(file.name, path, element.int(row)));
        }
        if imaginary.real(row) != 0.0 {
            return Err(complex(file.name, path));
        }
        let domain =
            Domain { subcase: subcase.int(row), mode: mode.int(row), eigenvalue: real.real(row) };
        domains.insert(id.int(row), domain);
    }
    Ok(domains)
}

/// One line of the eigenvalue summary.
struct Eigenvalue {
    mode: i64,
    eigenvalue: f64,
    frequency_hz: f64,
    mass: f64,
}

/// The eigenvalue summary, and whether it counts residual vectors among the modes.
fn summary(file: &File) -> Result<(Vec<Eigenvalue>, bool), Problems> {
    let Some(table) = file.table("/NASTRAN/RESULT/SUMMARY/EIGENVALUE")? else {
        return Ok((Vec::new(), false));
    };
    let mode = table.integer("MODE")?;
    let (eigen, freq) = (table.float("EIGEN")?, table.float("FREQ")?);
    let mass = table.float("MASS")?;
    let flag = table.fields.get("RESFLG").copied().filter(|field| !field.float);
    let augmented = |row| flag.is_some_and(|flag| flag.int(row) == super::AUGMENTED);
    let lines = table.rows().map(|row| Eigenvalue {
        mode: mode.int(row),
        eigenvalue: eigen.real(row),
        frequency_hz: freq.real(row).copysign(eigen.real(row)),
        mass: mass.real(row),
    });
    Ok((lines.collect(), table.rows().any(augmented)))
}
