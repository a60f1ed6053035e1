//! Imports on disk: the description, the result files that it names, and the package they make.
//!
//! What the description says is understood in `scenario::import`; formats are told apart in `fem`.

use super::{files, package};
use crate::fem::format::table::{Column, Columns, from_columns};
use crate::fem::{self, Precision, Results};
use crate::import::Made;
use crate::import::normalise::Entry;
use crate::problem::Problems;
use crate::scenario::import::{self, Read};
use crate::scenario::import_file::{FlightTimeFile, ImportFile};
use crate::scenario::table::{self, Findings};
use arrow::array::{Array, Float64Array, StringArray};
use arrow::compute::cast;
use arrow::datatypes::DataType;
use parquet::arrow::arrow_reader::{ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use std::collections::BTreeMap;
use std::io::Read as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Component, Path, PathBuf};

/// Largest result file that is read unless the user allows more, bytes.
pub const LARGEST_RESULT: u64 = 4 << 30;
/// Most rows of a Parquet table.
const MOST_ROWS: i64 = 200_000_000;

/// What a user allows beyond the careful default.
#[derive(Debug, Clone, Copy)]
pub struct Allowed {
    /// Files outside the folder of the description.
    pub outside: bool,
    /// Size of a result file, bytes.
    pub bytes: u64,
}

impl Default for Allowed {
    fn default() -> Self {
        Self { outside: false, bytes: LARGEST_RESULT }
    }
}

/// An import that was read and made.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// What was made.
    pub made: Made,
    /// Units that were declared.
    pub units: &'static str,
    /// BLAKE3 digest of each file that was read, by its name in the description.
    pub inputs: BTreeMap<String, String>,
}

/// Reads the description at `path` and the files it names, and makes the modal data.
///
/// # Errors
/// All problems of the description and of the files.
pub fn load(path: &Path, allowed: Allowed) -> Result<Loaded, Problems> {
    let name = files::name(path);
    let text = files::read_text(path)?;
    let (raw, findings) = table::read::<ImportFile>(&name, &text)?;
    let mut source = Source {
        folder: path.parent().unwrap_or(Path::new("")),
        allowed,
        inputs: BTreeMap::from([("import.toml".to_owned(), files::digest_of(text.as_bytes()))]),
    };
    let read = |i: usize, findings: &mut Findings| source.time(i, &raw.flight_time[i], findings);
    let made = import::resolve(&raw, read, findings)?;
    Ok(Loaded { made, units: raw.units.word(), inputs: source.inputs })
}

/// Writes the package of an import.
///
/// # Errors
/// One problem if `dir` exists and `force` does not say otherwise, or it cannot be written.
pub fn write(dir: &Path, loaded: &Loaded, force: bool) -> Result<(), Problems> {
    package::write_imported(dir, &loaded.made, loaded.units, loaded.inputs.clone(), force)
}

/// The files beside a description.
struct Source<'a> {
    folder: &'a Path,
    allowed: Allowed,
    inputs: BTreeMap<String, String>,
}

impl Source<'_> {
    fn time(&mut self, i: usize, time: &FlightTimeFile, findings: &mut Findings) -> Option<Read> {
        let mut whole: Option<Results> = None;
        let mut sound = true;
        for (j, file) in time.results.iter().enumerate() {
            let key = format!("flight_time[{i}].results[{j}]");
            let Some((bytes, name)) = self.bytes(file, &key, findings) else {
                sound = false;
                continue;
            };
            let part = if bytes.starts_with(b"PAR1") {
                parquet_table(bytes, &name)
            } else {
                fem::read(&bytes, &name)
            };
            let merged = part.and_then(|part| match &mut whole {
                None => {
                    whole = Some(part);
                    Ok(())
                }
                Some(known) => known.merge(part, &name),
            });
            if let Err(problems) = merged {
                findings.extend(problems);
                sound = false;
            }
        }
        let matrix = match &time.mass_matrix {
            None => None,
            Some(file) => {
                let key = format!("flight_time[{i}].mass_matrix");
                let read = self.bytes(file, &key, findings);
                let read = read.and_then(|(bytes, name)| {
                    entries(&bytes, &name).map_err(|problems| findings.extend(problems)).ok()
                });
                sound &= read.is_some();
                read
            }
        };
        let results = whole.filter(|_| sound)?;
        let name = time.results.join(", ");
        results.complete(&name).map_err(|problems| findings.extend(problems)).ok()?;
        Some(Read { results, matrix })
    }

    /// The bytes of a file that the description names at `key`, and its name for messages.
    fn bytes(
        &mut self,
        file: &str,
        key: &str,
        findings: &mut Findings,
    ) -> Option<(Vec<u8>, String)> {
        let path = match self.inside(file) {
            Ok(path) => path,
            Err(found) => {
                let allowed = "a file in the folder of the description, or --allow-outside";
                findings.push(key, found, allowed);
                return None;
            }
        };
        let name = files::name(&path);
        let read = (|| {
            let opened = files::open(&path)?;
            let mut bytes = Vec::new();
            let length = (opened.take(self.allowed.bytes + 1).read_to_end(&mut bytes))
                .map_err(|e| Problems::input(&name, "", e.to_string(), "a readable file"))?;
            if length as u64 > self.allowed.bytes {
                let found = format!("more than {} bytes", self.allowed.bytes);
                return Err(Problems::input(&name, "", found, "a smaller file, or --max-gib"));
            }
            Ok(bytes)
        })();
        match read {
            Ok(bytes) => {
                self.inputs.insert(file.to_owned(), files::digest_of(&bytes));
                Some((bytes, name))
            }
            Err(problems) => {
                let found = problems.0.into_iter().map(|p| p.found).collect::<Vec<_>>().join(", ");
                findings.push(key, format!("\"{file}\": {found}"), "a readable result file");
                None
            }
        }
    }

    /// The path of `file`, which does not leave the folder unless the user allows it: neither by
    /// its text nor by a link.
    fn inside(&self, file: &str) -> Result<PathBuf, String> {
        let path = self.folder.join(file);
        if self.allowed.outside {
            return Ok(path);
        }
        let plain = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        if file.is_empty() || !Path::new(file).components().all(plain) {
            return Err(format!("\"{file}\", which leads outside"));
        }
        let base = if self.folder.as_os_str().is_empty() { Path::new(".") } else { self.folder };
        if let (Ok(real), Ok(base)) = (path.canonicalize(), base.canonicalize())
            && !real.starts_with(&base)
        {
            return Err(format!("\"{file}\", a link that leads outside"));
        }
        Ok(path)
    }
}

/// Entries of a mass matrix: five numbers a line, separated by commas; a first line of names and
/// lines that begin with `#` are left out.
fn entries(bytes: &[u8], name: &str) -> Result<Vec<Entry>, Problems> {
    let text = String::from_utf8_lossy(bytes);
    let mut entries = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let comment = line.trim().is_empty() || line.starts_with('#');
        if comment || (number == 0 && fields.iter().all(|f| f.parse::<f64>().is_err())) {
            continue;
        }
        let entry = || -> Option<Entry> {
            let [row, i, column, j, value] = fields.as_slice() else { return None };
            let freedom = |text: &str| text.parse::<u8>().ok().filter(|f| (1..=6).contains(f));
            Some(Entry {
                row: (row.parse().ok()?, freedom(i)?),
                column: (column.parse().ok()?, freedom(j)?),
                value: value.parse().ok().filter(|v: &f64| v.is_finite())?,
            })
        };
        match entry() {
            Some(entry) => entries.push(entry),
            None => {
                let allowed = "node, freedom 1 to 6, node, freedom 1 to 6, value";
                let key = format!("line {}", number + 1);
                return Err(Problems::input(name, key, line.to_owned(), allowed));
            }
        }
    }
    Ok(entries)
}

/// Results from one of the plain tables as Parquet.
fn parquet_table(bytes: Vec<u8>, name: &str) -> Result<Results, Problems> {
    // The Parquet reader panics on some malformed files instead of returning an error.
    catch_unwind(AssertUnwindSafe(|| columns(bytes, name)))
        .unwrap_or_else(|_| Err(damage(name, "a malformed Parquet file")))
        .and_then(|(columns, precision)| from_columns(&columns, precision, name))
}

fn damage(name: &str, found: impl std::fmt::Display) -> Problems {
    Problems::damage(name, "", found.to_string(), "a whole Parquet file")
}

fn columns(bytes: Vec<u8>, name: &str) -> Result<(Columns, Precision), Problems> {
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let bytes = bytes::Bytes::from(bytes);
    let builder = ParquetRecordBatchReaderBuilder::try_new_with_options(bytes, options)
        .map_err(|e| damage(name, e))?;
    let metadata = builder.metadata().clone();
    super::flat::readable(&metadata, name)?;
    let rows = metadata.file_metadata().num_rows();
    let size = (metadata.row_groups().iter())
        .try_fold(0_i64, |sum, group| sum.checked_add(group.total_byte_size()));
    let most = i64::try_from(LARGEST_RESULT).unwrap_or(i64::MAX);
    if !(0..=MOST_ROWS).contains(&rows) || !size.is_some_and(|size| (0..=most).contains(&size)) {
        return Err(damage(name, format!("{rows} rows, {size:?} bytes when unpacked")));
    }
    let schema = builder.schema().clone();
    let mut columns = Columns::new();
    let mut precision = Precision::Double;
    for field in schema.fields() {
        let column = match field.data_type() {
            DataType::Utf8 => Column::Texts(Vec::new()),
            kind if kind.is_numeric() => Column::Numbers(Vec::new()),
            kind => {
                let allowed = "columns of numbers or texts";
                return Err(Problems::input(name, field.name(), kind.to_string(), allowed));
            }
        };
        if *field.data_type() == DataType::Float32 && ["tx", "ty", "tz"].contains(&&**field.name())
        {
            precision = Precision::Single;
        }
        columns.insert(field.name().clone(), column);
    }
    let mut read = 0_i64;
    for batch in builder.build().map_err(|e| damage(name, e))? {
        let batch = batch.map_err(|e| damage(name, e))?;
        read += batch.num_rows() as i64;
        if read > rows {
            return Err(damage(name, "more rows than the file says"));
        }
        for (key, column) in &mut columns {
            let array = batch.column_by_name(key).expect("the schema has the column");
            match column {
                Column::Numbers(values) => {
                    if array.null_count() > 0 {
                        return Err(Problems::input(name, key, "NULL", "a value in every row"));
                    }
                    let array = cast(array, &DataType::Float64).map_err(|e| damage(name, e))?;
                    let array = array.as_any().downcast_ref::<Float64Array>();
                    values.extend_from_slice(array.expect("cast to this type").values());
                }
                Column::Texts(texts) => {
                    let array = array.as_any().downcast_ref::<StringArray>();
                    let array = array.expect("the type was checked");
                    texts.extend(array.iter().map(|t| t.unwrap_or_default().to_owned()));
                }
            }
        }
    }
    Ok((columns, precision))
}
