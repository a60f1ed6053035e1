//! A shard: the rows of consecutive cases of one population in every table that follows the cases,
//! in one file that says what it holds and proves it.
//!
//! Where shards lie and which are missing is the business of `store`; how tables are made of them
//! that of `assemble`.

use super::column::Column;
use super::files::{self, Aside};
use super::maker::Maker;
use super::run::decoded;
use super::schema::{self, TableName};
use super::table::{self, Content, Table};
use crate::campaign::row::{self, CaseRow, CurveRow, LoopRows, MarginRow, ModeRow, PeakRow};
use crate::campaign::{Outline, Record};
use crate::problem::Problems;
use arrow::record_batch::RecordBatch;
use bytes::Bytes;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::errors::ParquetError;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// What a shard's first line begins with, before its digest and its header.
const MAGIC: &str = "tvse shard ";
/// Longest first line, bytes.
const LONGEST_HEADER: usize = 64 << 10;
/// Largest shard that is read, bytes: far above what one row group of every table takes.
const LARGEST: u64 = 2 << 30;
/// Rows of one table after which a shard ends, so that its memory is bounded.
const MOST_ROWS: u64 = 64 << 10;
/// Cells of the `cases` table after which a shard ends.
const MOST_CELLS: u64 = 1 << 19;
/// Cases after which a shard ends: soon enough that a long campaign takes no more memory than a
/// short one.
const MOST_CASES: u64 = 8192;

/// What a shard holds, in its first line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the tables' columns.
    pub schema_version: u32,
    /// Identity of the run, see [`Outline::identity`].
    pub run: String,
    /// What made it.
    pub maker: Maker,
    /// Name of the population.
    pub population: String,
    /// Case indices.
    pub cases: Range<u64>,
    /// Cases with a failed evaluation.
    pub failed: u64,
    /// Cases with an unstable named mode.
    pub unstable: u64,
    /// What each table holds, in the order of the bytes that follow.
    pub tables: Vec<(String, Content)>,
}

/// A shard on the disk: its file and what its first line says.
#[derive(Debug, Clone)]
pub struct Shard {
    /// The file.
    pub path: PathBuf,
    /// Index of the population.
    pub population: usize,
    /// What it holds.
    pub header: Header,
}

/// A shard being filled.
pub struct Filling {
    population: usize,
    cases: Range<u64>,
    failed: u64,
    unstable: u64,
    most_cases: u64,
    rows: Table<CaseRow, Vec<u8>>,
    modes: Table<ModeRow, Vec<u8>>,
    loops: Option<LoopTables>,
}

/// A finished table of a shard: its bytes and what they hold.
type Part = (TableName, (Vec<u8>, Content));

/// The tables of loops of a shard being filled.
struct LoopTables {
    margins: Table<MarginRow, Vec<u8>>,
    peaks: Table<PeakRow, Vec<u8>>,
    curves: Option<Table<CurveRow, Vec<u8>>>,
}

impl LoopTables {
    fn push(&mut self, rows: &LoopRows) {
        rows.margins.iter().for_each(|row| self.margins.push(row));
        rows.peaks.iter().for_each(|row| self.peaks.push(row));
        if let Some(curves) = &mut self.curves {
            rows.curves.iter().for_each(|row| curves.push(row));
        }
    }

    fn gathered(&self) -> u64 {
        let curves = self.curves.as_ref().map_or(0, Table::gathered);
        self.margins.gathered().max(self.peaks.gathered()).max(curves)
    }

    fn close(self) -> Result<Vec<Part>, ParquetError> {
        let mut parts = vec![
            (TableName::Margins, self.margins.close()?),
            (TableName::LoopModes, self.peaks.close()?),
        ];
        if let Some(curves) = self.curves {
            parts.push((TableName::LoopCurves, curves.close()?));
        }
        Ok(parts)
    }
}

impl Filling {
    /// An empty shard that begins with a case of a population.
    ///
    /// # Errors
    /// What the Parquet writer says.
    pub fn new(outline: &Outline, population: usize, first: u64) -> Result<Self, ParquetError> {
        fn open<R>(columns: Vec<Column<R>>) -> Result<Table<R, Vec<u8>>, ParquetError> {
            Table::new(columns, &[], Vec::new(), None)
        }
        let rows = schema::cases(outline);
        let tables = TableName::of_cases(outline);
        let most_cases = (MOST_CELLS / rows.len() as u64).clamp(1, MOST_CASES);
        Ok(Self {
            population,
            cases: first..first,
            failed: 0,
            unstable: 0,
            most_cases,
            rows: open(rows)?,
            modes: open(schema::modes(outline))?,
            loops: match tables.contains(&TableName::Margins) {
                false => None,
                true => Some(LoopTables {
                    margins: open(schema::margins(outline))?,
                    peaks: open(schema::loop_modes(outline))?,
                    curves: match tables.contains(&TableName::LoopCurves) {
                        false => None,
                        true => Some(open(schema::loop_curves(outline))?),
                    },
                }),
            },
        })
    }

    /// Whether the record is that of the next case.
    pub fn goes_on_with(&self, record: &Record) -> bool {
        record.population == self.population && record.case == self.cases.end
    }

    /// Takes the record of the next case; says whether the shard is full.
    pub fn push(&mut self, outline: &Outline, record: Record) -> bool {
        self.failed += u64::from(record.failure().is_some());
        self.unstable += u64::from(record.unstable());
        self.cases.end = record.case + 1;
        let mut gathered = 0;
        if let Some(loops) = &mut self.loops {
            loops.push(&row::loop_rows(&record));
            gathered = loops.gathered();
        }
        let (case, modes) = row::rows(&outline.definition, record);
        self.rows.push(&case);
        modes.iter().for_each(|mode| self.modes.push(mode));
        let rows = self.rows.gathered().max(self.modes.gathered()).max(gathered);
        rows >= MOST_ROWS || self.rows.gathered() >= self.most_cases
    }

    /// Writes the shard into the folder `shards` of a run: aside, synced and renamed.
    ///
    /// # Errors
    /// An input problem if it cannot be written.
    pub fn write(self, run: &Path, outline: &Outline, identity: &str) -> Result<Shard, Problems> {
        let population = &outline.definition.populations[self.population].name;
        let path = run.join(file(population, &self.cases));
        let failed = |error: ParquetError| table::problem(&path, &error);
        let mut parts = vec![
            (TableName::Cases, self.rows.close().map_err(failed)?),
            (TableName::Modes, self.modes.close().map_err(failed)?),
        ];
        if let Some(loops) = self.loops {
            parts.extend(loops.close().map_err(failed)?);
        }
        let of = |(name, (_, content)): &Part| (name.name().to_owned(), content.clone());
        let header = Header {
            schema_version: schema::VERSION,
            run: identity.to_owned(),
            maker: Maker::here(),
            population: population.clone(),
            cases: self.cases,
            failed: self.failed,
            unstable: self.unstable,
            tables: parts.iter().map(of).collect(),
        };
        let text = serde_json::to_string(&header).expect("a header has text keys only");
        let first = format!("{MAGIC}{} {text}\n", files::digest_of(text.as_bytes()));
        let mut aside = Aside::within(run, &path)?;
        files::ensure_folder(&run.join(FOLDER))?;
        let mut bytes = vec![first.as_bytes()];
        bytes.extend(parts.iter().map(|(_, (bytes, _))| bytes.as_slice()));
        for bytes in bytes {
            aside.write_all(bytes).map_err(|error| files::write_problem(&path, &error))?;
        }
        aside.finish()?;
        Ok(Shard { path, population: self.population, header })
    }
}

/// Folder of the shards inside a run's folder.
pub const FOLDER: &str = "shards";

/// File of a shard inside a run's folder.
fn file(population: &str, cases: &Range<u64>) -> String {
    format!("{FOLDER}/{population}.{:010}-{:010}.shard", cases.start, cases.end)
}

/// Whether a name in the folder of shards is one of theirs.
pub fn is_name(name: &str) -> bool {
    name.ends_with(".shard")
}

impl Header {
    /// Reads the first line of a shard, without its line feed.
    ///
    /// # Errors
    /// In words, what was found instead.
    pub fn parse(line: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(line).ok().and_then(|line| line.strip_prefix(MAGIC));
        let header = text
            .and_then(|text| text.split_once(' '))
            .filter(|(digest, header)| *digest == files::digest_of(header.as_bytes()));
        let Some((_, header)) = header else { return Err("another first line".to_owned()) };
        serde_json::from_str(header).map_err(|error| error.to_string())
    }
}

impl Shard {
    /// Reads the first line of a shard and holds it against its run, name and size. What the
    /// tables hold is checked when they are read.
    ///
    /// # Errors
    /// Damage: what is wrong with it. Input: a shard of another run.
    pub fn open(path: &Path, outline: &Outline, identity: &str) -> Result<Self, Problems> {
        let damage =
            |found: String, allowed: &str| Problems::damage(files::name(path), "", found, allowed);
        let line = files::first_line(path, LONGEST_HEADER)
            .map_err(|error| damage(error.to_string(), "the first line of a shard"))?;
        let length = line.len() as u64 + 1;
        let header =
            Header::parse(&line).map_err(|found| damage(found, "the first line of a shard"))?;
        if header.schema_version != schema::VERSION {
            let found = format!("schema version {}", header.schema_version);
            return Err(damage(found, &format!("schema version {}", schema::VERSION)));
        }
        if header.run != identity {
            let found = "a shard of another run";
            return Err(Problems::damage(files::name(path), "", found, "shards of this run"));
        }
        let name = file(&header.population, &header.cases);
        if Path::new(&name).file_name() != path.file_name() {
            return Err(damage(format!("the shard {name}"), "the shard that its name says"));
        }
        let populations = &outline.definition.populations;
        let population = populations.iter().position(|p| p.name == header.population);
        let Some(population) = population.filter(|index| {
            header.cases.start < header.cases.end && header.cases.end <= populations[*index].cases
        }) else {
            let Range { start, end } = header.cases;
            let found = format!("cases {start} to {end} of {}", header.population);
            return Err(damage(found, "cases of the run"));
        };
        let names: Vec<&str> = header.tables.iter().map(|(name, _)| name.as_str()).collect();
        if names
            != TableName::of_cases(outline).into_iter().map(TableName::name).collect::<Vec<_>>()
        {
            return Err(damage(format!("the tables {}", names.join(", ")), "those of a shard"));
        }
        let sizes = header.tables.iter().map(|(_, content)| content.bytes);
        let allowed = sizes.fold(length, u64::saturating_add);
        let found = files::size(path).map_err(|e| damage(e.to_string(), "a readable shard"))?;
        if found != allowed || allowed > LARGEST {
            let allowed = format!("{allowed} bytes, at most {LARGEST}");
            return Err(damage(format!("{found} bytes"), &allowed));
        }
        Ok(Self { path: path.to_owned(), population, header })
    }

    /// Holds every table against its digest.
    ///
    /// # Errors
    /// Damage, with the name of the shard.
    pub fn verify(&self) -> Result<(), Problems> {
        let names = self.header.tables.iter().map(|(name, _)| name);
        names.into_iter().try_for_each(|table| self.bytes(table).map(|_| ()))
    }

    /// What a table holds and its bytes, held against their digest.
    fn bytes(&self, table: &str) -> Result<(&Content, Vec<u8>), Problems> {
        let damage = |found: String, allowed: &str| {
            Problems::damage(files::name(&self.path), table, found, allowed)
        };
        let (mut skip, mut tail, mut content) = (0, 0, None);
        for (name, part) in &self.header.tables {
            if name == table {
                (skip, content) = (tail, Some(part));
            }
            tail += part.bytes;
        }
        let content = content.expect("the header was checked");
        let bytes = files::read_tail(&self.path, tail, skip, content.bytes)
            .map_err(|error| damage(error.to_string(), "a readable shard"))?;
        let found = files::digest_of(&bytes);
        if found != content.blake3 {
            let allowed = format!("BLAKE3 {}", content.blake3);
            return Err(damage(format!("BLAKE3 {found}"), &allowed));
        }
        Ok((content, bytes))
    }

    /// Hands the rows of a table to `take`, once they are found to be those that the header says.
    ///
    /// # Errors
    /// Damage, with the name of the shard; what `take` returns.
    pub fn rows(
        &self,
        table: TableName,
        outline: &Outline,
        mut take: impl FnMut(&RecordBatch) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        let damage = |found: String, allowed: &str| {
            Problems::damage(files::name(&self.path), table.name(), found, allowed)
        };
        let (content, bytes) = self.bytes(table.name())?;
        let unread = |found: String| damage(found, "a Parquet table");
        let builder = decoded(|| ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes)))
            .map_err(unread)?;
        let fields = builder.schema().fields();
        let allowed = table.fields(outline);
        let same = fields.iter().zip(&allowed).all(|(a, b)| **a == *b);
        if !same || fields.len() != allowed.len() {
            return Err(damage("other columns".to_owned(), "the columns of the data dictionary"));
        }
        let groups = builder.metadata().row_groups().iter();
        let size = groups.fold(0_i64, |sum, group| sum.saturating_add(group.total_byte_size()));
        if size > LARGEST as i64 {
            return Err(damage(format!("{size} bytes unpacked"), &format!("at most {LARGEST}")));
        }
        let rows = builder.metadata().file_metadata().num_rows();
        if u64::try_from(rows) != Ok(content.rows) {
            return Err(damage(format!("{rows} rows"), &format!("{} rows", content.rows)));
        }
        let mut reader = decoded(|| builder.build()).map_err(unread)?;
        while let Some(batch) = decoded(|| reader.next().transpose()).map_err(unread)? {
            take(&batch)?;
        }
        Ok(())
    }
}
