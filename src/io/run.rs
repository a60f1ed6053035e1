//! A finished run being read: its outline, its tables row by row, and whether they are whole.
//!
//! What the rows sum up to is decided in `campaign::summary`; how they were written in `results`.

use super::files;
use super::manifest::Manifest;
use super::schema::{self, TableName};
use super::table::Content;
use crate::campaign::record::{Failure, FailureKind};
use crate::campaign::row::ModeRow;
use crate::campaign::{Outline, Population};
use crate::problem::{Kind, Problems};
use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Field, Float64Type, Int64Type};
use arrow::record_batch::RecordBatch;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader,
    ParquetRecordBatchReaderBuilder,
};
use std::collections::BTreeMap;
use std::fs::File;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Rows decoded at once.
const BATCH: usize = 8192;

/// A finished run.
#[derive(Debug, Clone)]
pub struct Run {
    folder: PathBuf,
    outline: Outline,
    contents: BTreeMap<TableName, Content>,
    /// Checked footers, by table: they are long where populations are many.
    footers: [OnceLock<ArrowReaderMetadata>; TableName::ALL.len()],
}

/// The draws of one stored case; none where a value stays nominal, has no score, or the case
/// panicked.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredDraws {
    /// Drawn value per draw key.
    pub values: Vec<Option<f64>>,
    /// Normal score per draw key.
    pub scores: Vec<Option<f64>>,
}

impl Run {
    /// Opens the run in `folder`: reads the manifest and checks that every table is there with the
    /// bytes, columns and rows stated.
    ///
    /// # Errors
    /// Input: no such folder. Damage: every table that is missing or not as stated, or a manifest
    /// that is missing, damaged or of another schema version.
    pub fn open(folder: &Path) -> Result<Self, Problems> {
        let manifest = Manifest::read(folder)?;
        let name = files::name(&folder.join(super::manifest::FILE));
        let mut problems = Problems::default();
        let mut contents = BTreeMap::new();
        for table in TableName::of_run(&manifest.run) {
            let Some(content) = manifest.tables.get(table.name()) else {
                let key = format!("tables.{}", table.name());
                problems.push(Kind::Damage, &name, key, "nothing", "rows, bytes and digest");
                continue;
            };
            let path = folder.join(table.file());
            let found = match files::size(&path) {
                Err(error) => error.to_string(),
                Ok(bytes) if bytes != content.bytes => format!("{bytes} bytes"),
                Ok(_) => format!("BLAKE3 {}", files::digest(&path)?),
            };
            let allowed = format!("BLAKE3 {}", content.blake3);
            if found != allowed {
                let allowed = format!("{} bytes of {allowed}", content.bytes);
                problems.push(Kind::Damage, files::name(&path), "", found, allowed);
            }
            contents.insert(table, content.clone());
        }
        let rows = contents.get(&TableName::Cases).map(|content| content.rows);
        let cases = manifest.run.definition.populations.iter().map(|p| u128::from(p.cases)).sum();
        if rows.is_some_and(|rows| u128::from(rows) != cases) {
            let (found, allowed) = (format!("{rows:?}"), format!("{cases}, one for each case"));
            problems.push(Kind::Damage, &name, "tables.cases.rows", found, allowed);
        }
        let run = problems.into_result(Self::of(folder, manifest.run, contents))?;
        let mut problems = Problems::default();
        for table in TableName::of_run(&run.outline) {
            if let Err(found) = run.checked(table) {
                problems.extend(found);
            }
        }
        problems.into_result(run)
    }

    /// Holds the tables of the run in `folder` against their sizes alone.
    ///
    /// # Errors
    /// Damage: every table that is missing or of another size; a manifest that cannot be read.
    pub(super) fn sizes(folder: &Path) -> Result<(), Problems> {
        let manifest = Manifest::read(folder)?;
        let mut problems = Problems::default();
        for table in TableName::of_run(&manifest.run) {
            let path = folder.join(table.file());
            let found = files::size(&path).map_err(|error| error.to_string());
            let allowed = manifest.tables.get(table.name()).map(|content| content.bytes);
            if found.as_ref().ok() != allowed.as_ref() {
                let found = found.map_or_else(|error| error, |bytes| format!("{bytes} bytes"));
                let allowed = allowed.map_or("no such table".to_owned(), |b| format!("{b} bytes"));
                problems.push(Kind::Damage, files::name(&path), "", found, allowed);
            }
        }
        problems.into_result(())
    }

    pub(super) fn of(
        folder: &Path,
        outline: Outline,
        contents: BTreeMap<TableName, Content>,
    ) -> Self {
        Self { folder: folder.to_owned(), outline, contents, footers: Default::default() }
    }

    pub(super) fn insert(&mut self, table: TableName, content: Content) {
        self.contents.insert(table, content);
    }

    /// The same run in another folder.
    pub(super) fn moved(self, folder: &Path) -> Self {
        Self { folder: folder.to_owned(), ..self }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The outline of the run.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// What each table holds.
    pub fn contents(&self) -> impl Iterator<Item = (TableName, &Content)> {
        self.contents.iter().map(|(name, content)| (*name, content))
    }

    /// File of a table.
    pub fn path(&self, table: TableName) -> PathBuf {
        self.folder.join(table.file())
    }

    /// Hands the rows of the `modes` table for the given cases of a population to `visit`.
    ///
    /// # Errors
    /// Damage in the table, or what `visit` returns.
    pub fn modes(
        &self,
        population: usize,
        cases: Range<u64>,
        mut visit: impl FnMut(ModeRow) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        let mut reader = self.reader(TableName::Modes, |_| true, population, &cases)?;
        while let Some(batch) = self.next(TableName::Modes, &mut reader)? {
            for row in self.mode_rows(&batch)? {
                if row.population != population {
                    let name = &self.outline.definition.populations[population].name;
                    return Err(self.damage(TableName::Modes, "another population", name));
                }
                if cases.contains(&row.case) {
                    visit(row)?;
                }
            }
        }
        Ok(())
    }

    /// Hands the case index and the first failure of every failed case of a population to `visit`.
    ///
    /// # Errors
    /// Damage in the table, or what `visit` returns.
    pub fn failures(
        &self,
        population: usize,
        mut visit: impl FnMut(u64, Failure) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        self.cases(population, &[], |case, _, failure| match failure {
            Some(failure) => visit(case, failure),
            None => Ok(()),
        })
    }

    /// Hands every case of a population to `visit`, in order: its index, its numbers in some
    /// columns of the `cases` table, NaN for NULL, and its first failure.
    ///
    /// # Errors
    /// Damage in the table, or what `visit` returns.
    ///
    /// # Panics
    /// If a column is not in the registry or holds no numbers.
    pub fn cases(
        &self,
        population: usize,
        names: &[&str],
        mut visit: impl FnMut(u64, &[f64], Option<Failure>) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        let cases = self.outline.definition.populations[population].cases;
        let always = ["case", "status", "failure_message"];
        let chosen = |name: &str| always.contains(&name) || names.contains(&name);
        let statuses: Vec<&str> = schema::statuses().collect();
        let mut next = 0;
        let mut values = vec![f64::NAN; names.len()];
        self.batches(TableName::Cases, chosen, population, &(0..cases), |batch| {
            self.check_cases(batch, next)?;
            let status = self.words(TableName::Cases, batch, "status", &statuses)?;
            let message = batch.column_by_name("failure_message").expect("a column");
            let message = message.as_string::<i32>();
            let column = |name: &&str| batch.column_by_name(name).expect("of the registry");
            let mut columns: Vec<_> = names.iter().map(|name| numbers(column(name))).collect();
            for (row, status) in status.into_iter().enumerate() {
                for (value, column) in values.iter_mut().zip(&mut columns) {
                    *value = column.next().flatten().unwrap_or(f64::NAN);
                }
                let failure = status.filter(|status| *status > 0).map(|status| {
                    let said = message.is_valid(row).then(|| message.value(row));
                    Failure::new(FailureKind::ALL[status - 1], said.unwrap_or_default())
                });
                visit(next, &values, failure)?;
                next += 1;
            }
            Ok(())
        })?;
        if next != cases {
            let allowed = format!("{cases} cases of a population");
            return Err(self.damage(TableName::Cases, next.to_string(), allowed));
        }
        Ok(())
    }

    /// The draws of some cases of a population.
    ///
    /// # Errors
    /// Damage in the table.
    pub fn draws(
        &self,
        population: usize,
        cases: impl IntoIterator<Item = u64>,
    ) -> Result<BTreeMap<u64, StoredDraws>, Problems> {
        let draws = &self.outline.draws;
        let scores: Vec<String> = draws.iter().map(|draw| draw.score_column()).collect();
        let is_draw = |name: &str| draws.iter().any(|draw| draw.column == name);
        let chosen =
            |name: &str| name == "case" || is_draw(name) || scores.iter().any(|s| s == name);
        let block = TableName::Cases.block_cases(&self.outline);
        let mut wanted: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
        for case in cases {
            wanted.entry(case / block).or_default().push(case);
        }
        let mut found = BTreeMap::new();
        for (index, cases) in wanted {
            let mut next = index * block;
            let range = next..next + block;
            let mut reader = self.reader(TableName::Cases, chosen, population, &range)?;
            while let Some(batch) = self.next(TableName::Cases, &mut reader)? {
                self.check_cases(&batch, next)?;
                let rows = next..next + batch.num_rows() as u64;
                for case in cases.iter().filter(|case| rows.contains(case)) {
                    let row = (case - next) as usize;
                    let value = |name: &str| {
                        let column = batch.column_by_name(name).expect("a column of the registry");
                        numbers(column).nth(row).flatten()
                    };
                    let stored = StoredDraws {
                        values: draws.iter().map(|draw| value(&draw.column)).collect(),
                        scores: scores.iter().map(|name| value(name)).collect(),
                    };
                    found.insert(*case, stored);
                }
                next = rows.end;
            }
            if let Some(lost) = cases.iter().find(|case| !found.contains_key(case)) {
                return Err(self.damage(TableName::Cases, "the end", format!("case {lost}")));
            }
        }
        Ok(found)
    }

    fn opened(&self, table: TableName) -> Result<File, Problems> {
        files::open(&self.path(table))
            .map_err(|error| self.damage(table, error.to_string(), "a readable table"))
    }

    /// The footer of a table, checked when first asked for.
    fn footer(&self, table: TableName) -> Result<ArrowReaderMetadata, Problems> {
        let known = &self.footers[table as usize];
        match known.get() {
            Some(footer) => Ok(footer.clone()),
            None => self.checked(table).map(|footer| known.get_or_init(|| footer).clone()),
        }
    }

    /// Reads the footer of a table and checks its run, columns, rows and row groups.
    fn checked(&self, table: TableName) -> Result<ArrowReaderMetadata, Problems> {
        let file = self.opened(table)?;
        let footer = decoded(|| ArrowReaderMetadata::load(&file, ArrowReaderOptions::new()))
            .map_err(|found| self.damage(table, found, "a Parquet table"))?;
        let allowed = table.fields(&self.outline);
        let same = |(found, allowed): (&Arc<Field>, &Field)| {
            found.name() == allowed.name() && found.data_type() == allowed.data_type()
        };
        let found = footer.schema().fields();
        if found.len() != allowed.len() || !found.iter().zip(&allowed).all(same) {
            return Err(self.damage(table, "other columns", "the columns of the data dictionary"));
        }
        // Tables and manifest tell the same run, so that neither can be altered alone.
        let pairs = footer.metadata().file_metadata().key_value_metadata();
        let says = |key: &str| pairs?.iter().find(|pair| pair.key == key)?.value.as_deref();
        let text = serde_json::to_string(&self.outline).expect("an outline has text keys only");
        for (key, allowed) in super::results::metadata(table, &text) {
            if says(key) != Some(&allowed) {
                let allowed = format!("that of {}", super::manifest::FILE);
                return Err(self.damage(table, format!("another `{key}`"), allowed));
            }
        }
        let rows = self.contents[&table].rows;
        let found = footer.metadata().file_metadata().num_rows();
        if u64::try_from(found) != Ok(rows) {
            return Err(self.damage(table, format!("{found} rows"), format!("{rows} rows")));
        }
        let groups = match table {
            _ if TableName::of_cases(&self.outline).contains(&table) => {
                self.groups(table, &self.outline.definition.populations)
            }
            _ => u64::from(rows > 0),
        };
        let found = footer.metadata().num_row_groups();
        if found as u64 != groups {
            let allowed = format!("{groups} row groups");
            return Err(self.damage(table, format!("{found} row groups"), allowed));
        }
        Ok(footer)
    }

    /// Number of row groups of some populations in a table that follows the cases.
    fn groups(&self, table: TableName, populations: &[Population]) -> u64 {
        let cases = table.group_cases(&self.outline);
        populations.iter().map(|p| p.cases.div_ceil(cases)).sum()
    }

    /// Reads chosen columns of the row groups that hold some cases of a population; of the `cases`
    /// table, just their rows.
    fn reader(
        &self,
        table: TableName,
        chosen: impl Fn(&str) -> bool,
        population: usize,
        cases: &Range<u64>,
    ) -> Result<ParquetRecordBatchReader, Problems> {
        let footer = self.footer(table)?;
        let builder =
            ParquetRecordBatchReaderBuilder::new_with_metadata(self.opened(table)?, footer);
        let populations = &self.outline.definition.populations;
        let (size, end) =
            (table.group_cases(&self.outline), cases.end.min(populations[population].cases));
        let first = self.groups(table, &populations[..population]);
        let wanted = if cases.start < end {
            first + cases.start / size..first + end.div_ceil(size)
        } else {
            0..0
        };
        let fields = builder.schema().fields().iter().enumerate();
        let leaves: Vec<usize> =
            fields.filter(|(_, field)| chosen(field.name())).map(|(index, _)| index).collect();
        let mask = ProjectionMask::leaves(builder.parquet_schema(), leaves);
        let builder = builder
            .with_projection(mask)
            .with_row_groups(wanted.map(|group| group as usize).collect())
            .with_batch_size(BATCH);
        let builder = match table {
            TableName::Cases => builder
                .with_offset((cases.start % size) as usize)
                .with_limit(end.saturating_sub(cases.start) as usize),
            _ => builder,
        };
        decoded(|| builder.build()).map_err(|found| self.damage(table, found, "a Parquet table"))
    }

    /// Hands chosen columns of the row groups that hold some cases of a population to `visit`.
    ///
    /// # Errors
    /// Damage in the table, or what `visit` returns.
    pub(super) fn batches(
        &self,
        table: TableName,
        chosen: impl Fn(&str) -> bool,
        population: usize,
        cases: &Range<u64>,
        mut visit: impl FnMut(&RecordBatch) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        let mut reader = self.reader(table, chosen, population, cases)?;
        while let Some(batch) = self.next(table, &mut reader)? {
            visit(&batch)?;
        }
        Ok(())
    }

    fn next(
        &self,
        table: TableName,
        reader: &mut ParquetRecordBatchReader,
    ) -> Result<Option<RecordBatch>, Problems> {
        decoded(|| reader.next().transpose())
            .map_err(|found| self.damage(table, found, "a Parquet table"))
    }

    /// The case indices of a batch of `cases` go on from `next`.
    fn check_cases(&self, batch: &RecordBatch, next: u64) -> Result<(), Problems> {
        let column = batch.column_by_name("case").expect("a column of the registry");
        let found = column.as_primitive::<Int64Type>();
        for (row, allowed) in (next..).take(batch.num_rows()).enumerate() {
            if found.is_null(row) || found.value(row) as u64 != allowed {
                let found = format!("case {}", found.value(row));
                return Err(self.damage(TableName::Cases, found, format!("case {allowed}")));
            }
        }
        Ok(())
    }

    pub(super) fn damage(
        &self,
        table: TableName,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Problems {
        Problems::damage(files::name(&self.path(table)), "", found, allowed)
    }
}

/// What the Parquet reader gives, or what it says of its bytes: on damaged ones it may panic.
pub(super) fn decoded<T, E: ToString>(read: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(read)) {
        Ok(result) => result.map_err(|error| error.to_string()),
        Err(_) => Err("bytes that make no sense".to_owned()),
    }
}

/// The numbers of a column, whole or not.
fn numbers(column: &dyn Array) -> Box<dyn Iterator<Item = Option<f64>> + '_> {
    match column.data_type() {
        DataType::Float64 => Box::new(column.as_primitive::<Float64Type>().iter()),
        DataType::Int64 => {
            Box::new(column.as_primitive::<Int64Type>().iter().map(|v| v.map(|v| v as f64)))
        }
        other => panic!("a column of type {other} holds no numbers"),
    }
}

#[cfg(test)]
mod tests;
