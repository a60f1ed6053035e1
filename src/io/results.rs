//! The results of a run being written: every output is opened first, the manifest comes last.
//!
//! What the columns are is said in `schema`; what the records are in `campaign`.

#![expect(clippy::disallowed_methods, reason = "the manifest states when a run was made")]

use super::column::Column;
use super::files::{self, Aside};
use super::inputs;
use super::manifest::{self, Execution, Manifest};
use super::run::Run;
use super::schema::{self, TableName};
use super::summarise;
use super::table::{self, Content, Table};
use crate::campaign::metric::LONGEST_NAME;
use crate::campaign::row::{self, CaseRow, ModeRow};
use crate::campaign::summary::{SummaryRow, WorstRow};
use crate::campaign::{Outline, Record};
use crate::problem::{Kind, Problems};
use parquet::errors::ParquetError;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The results of a run that is under way.
///
/// Dropped before [`Results::finish`] has succeeded it leaves nothing behind, copies of inputs
/// included.
pub struct Results {
    // Dropped first, so that the folder is rid of the files written aside when it goes.
    tables: Tables,
    folder: Folder,
}

/// The tables and the manifest being written.
struct Tables {
    outline: Outline,
    cases: Table<CaseRow>,
    modes: Table<ModeRow>,
    summary: Table<SummaryRow>,
    worst: Table<WorstRow>,
    columns: Table<schema::Described>,
    manifest: Aside,
    last: Option<(usize, u64)>,
    started: SystemTime,
}

/// A finished run with the summary that was stored.
#[derive(Debug)]
pub struct Finished {
    /// The run, for reading.
    pub run: Run,
    /// Rows of the `summary` table.
    pub summary: Vec<SummaryRow>,
    /// Rows of the `worst` table.
    pub worst: Vec<WorstRow>,
}

impl Results {
    /// Makes the run's folder and opens every output in it.
    ///
    /// # Errors
    /// Input problems: the folder exists, it cannot be written, the disk is full, a draw has a
    /// column name that readers do not accept or that another has too.
    pub fn create(folder: &Path, outline: Outline) -> Result<Self, Problems> {
        check_names(&outline)?;
        let started = SystemTime::now();
        let text = serde_json::to_string(&outline).expect("an outline has text keys only");
        files::create_folder(folder)?;
        let folder = Folder { path: folder.to_owned(), keep: false };
        let path = &folder.path;
        files::create_folder(&path.join(TABLES))?;
        let tables = Tables {
            cases: open(path, TableName::Cases, schema::cases(&outline), &text)?,
            modes: open(path, TableName::Modes, schema::modes(&outline), &text)?,
            summary: open(path, TableName::Summary, schema::summary(&outline), &text)?,
            worst: open(path, TableName::Worst, schema::worst(&outline), &text)?,
            columns: open(path, TableName::Columns, schema::columns(), &text)?,
            manifest: Aside::beside(&path.join(manifest::FILE))?,
            last: None,
            started,
            outline,
        };
        Ok(Self { tables, folder })
    }

    /// Takes the record of the next case; cases come in the order of population and case.
    ///
    /// # Errors
    /// An input problem if the disk is full or gone.
    pub fn push(&mut self, record: Record) -> Result<(), Problems> {
        self.tables.push(record, &self.folder.path)
    }

    /// Finishes the tables of cases and modes, sums them up, and writes the manifest; `worst` is
    /// the number of worst cases kept for each population, variant and named mode.
    ///
    /// # Errors
    /// An input problem if the disk is full or gone; then nothing is left behind.
    ///
    /// # Panics
    /// If cases of the outline are missing.
    pub fn finish(self, jobs: usize, worst: usize) -> Result<Finished, Problems> {
        let Self { tables, mut folder } = self;
        let finished = tables.finish(&folder.path, jobs, worst)?;
        folder.keep = true;
        Ok(finished)
    }
}

impl Tables {
    fn push(&mut self, record: Record, folder: &Path) -> Result<(), Problems> {
        let problem = |name: TableName, error: &ParquetError| {
            table::problem(&folder.join(name.file()), error)
        };
        let (population, case) = (record.population, record.case);
        assert!(self.last < Some((population, case)), "cases come in order");
        if let Some((before, last)) = self.last {
            let another = |table: TableName| {
                let cases = table.group_cases(&self.outline);
                before != population || last / cases != case / cases
            };
            if another(TableName::Cases) {
                self.cases.end_group().map_err(|e| problem(TableName::Cases, &e))?;
            }
            if another(TableName::Modes) {
                self.modes.end_group().map_err(|e| problem(TableName::Modes, &e))?;
            }
        }
        self.last = Some((population, case));
        let (case, modes) = row::rows(&self.outline.definition, record);
        self.cases.push(&case);
        modes.iter().for_each(|mode| self.modes.push(mode));
        Ok(())
    }

    fn finish(self, path: &Path, jobs: usize, worst: usize) -> Result<Finished, Problems> {
        let Self { outline, cases, modes, started, mut manifest, .. } = self;
        let mut contents = BTreeMap::new();
        contents.insert(TableName::Cases, close(path, TableName::Cases, cases)?);
        contents.insert(TableName::Modes, close(path, TableName::Modes, modes)?);
        assert_eq!(contents[&TableName::Cases].rows, outline.cases(), "every case was pushed");
        let mut run = Run::of(path, outline, contents);
        let rows = summarise::summary(&run, summarise::MEMORY)?;
        let worst_rows = summarise::worst(&run, worst)?;
        let described = schema::dictionary(run.outline());
        let summary = fill(path, TableName::Summary, self.summary, &rows)?;
        let worst = fill(path, TableName::Worst, self.worst, &worst_rows)?;
        let columns = fill(path, TableName::Columns, self.columns, &described)?;
        for (name, content) in [
            (TableName::Summary, summary),
            (TableName::Worst, worst),
            (TableName::Columns, columns),
        ] {
            run.insert(name, content);
        }
        let text = Manifest {
            schema_version: schema::VERSION,
            run: run.outline().clone(),
            tables: run.contents().map(|(name, c)| (name.name().to_owned(), c.clone())).collect(),
            execution: Execution::since(started, jobs),
        }
        .to_text();
        let target = manifest.target().to_owned();
        manifest
            .write_all(text.as_bytes())
            .map_err(|error| files::write_problem(&target, &error))?;
        manifest.finish()?;
        Ok(Finished { run, summary: rows, worst: worst_rows })
    }
}

/// Folder of the tables inside a run's folder.
const TABLES: &str = "tables";

/// The run's folder; unless it is to be kept it goes with what a run writes into it, and stays
/// only if somebody else has put something there.
struct Folder {
    path: PathBuf,
    keep: bool,
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.keep {
            return;
        }
        files::remove_folder(&self.path.join(TABLES));
        files::remove_folder(&self.path.join(inputs::FOLDER));
        files::remove_if_empty(&self.path);
    }
}

fn open<R>(
    folder: &Path,
    name: TableName,
    columns: Vec<Column<R>>,
    outline: &str,
) -> Result<Table<R>, Problems> {
    let target = folder.join(name.file());
    // Written aside one level up: a folder of tables holds nothing else, whatever happens.
    let aside = Aside::within(folder, &target)?;
    Table::new(columns, &metadata(name, outline), aside).map_err(|e| table::problem(&target, &e))
}

/// File-level metadata of a table.
pub(super) fn metadata(name: TableName, outline: &str) -> [(&'static str, String); 3] {
    [
        ("tvse.schema_version", schema::VERSION.to_string()),
        ("tvse.table", name.name().to_owned()),
        ("tvse.run", outline.to_owned()),
    ]
}

fn close<R>(folder: &Path, name: TableName, table: Table<R>) -> Result<Content, Problems> {
    let (aside, content) =
        table.close().map_err(|error| table::problem(&folder.join(name.file()), &error))?;
    aside.finish()?;
    Ok(content)
}

fn fill<R>(
    folder: &Path,
    name: TableName,
    mut table: Table<R>,
    rows: &[R],
) -> Result<Content, Problems> {
    rows.iter().for_each(|row| table.push(row));
    close(folder, name, table)
}

/// Every column name is plain, short and given once.
fn check_names(outline: &Outline) -> Result<(), Problems> {
    let mut problems = Problems::default();
    let mut seen = BTreeSet::new();
    for described in schema::dictionary(outline) {
        let name = described.column;
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if name.is_empty() || name.len() > LONGEST_NAME || !name.chars().all(plain) {
            let allowed = format!("[a-z0-9_], at most {LONGEST_NAME} characters");
            problems.push(Kind::Input, described.table.file(), "column", name.clone(), allowed);
        }
        if !seen.insert((described.table, name.clone())) {
            let allowed = "a name no other column has";
            problems.push(Kind::Input, described.table.file(), "column", name, allowed);
        }
    }
    problems.into_result(())
}

#[cfg(test)]
mod tests {
    use super::super::synthetic;
    use super::*;
    use crate::campaign::pool::{Pool, spans};
    use crate::campaign::{StoredPoles, synthetic as cases};
    use arrow::array::{Array, AsArray};
    use arrow::datatypes::{DataType, Float64Type};
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder as Reader;
    use std::fs::{self, File};
    use std::sync::atomic::AtomicBool;

    const CASES: [u64; 3] = [1, 1100, 40];

    fn tables(folder: &Path) -> Vec<(&'static str, Vec<u8>)> {
        let read = |table: TableName| (table.name(), fs::read(folder.join(table.file())).unwrap());
        TableName::ALL.map(read).into()
    }

    #[test]
    fn the_bytes_are_the_same_for_any_number_of_threads() {
        let folder = tempfile::tempdir().unwrap();
        for poles in [StoredPoles::Named, StoredPoles::All] {
            let written = [1, 2, 7].map(|jobs| {
                let run = folder.path().join(format!("{poles:?}-{jobs}"));
                synthetic::run(&run, cases::outline(&CASES, poles), jobs).unwrap();
                tables(&run)
            });
            assert!(written[0].iter().all(|(_, bytes)| !bytes.is_empty()));
            assert!(written.iter().all(|tables| *tables == written[0]));
        }
    }

    #[test]
    fn a_finished_run_holds_its_tables_and_manifest_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        synthetic::run(&run, cases::outline(&[1, 30], StoredPoles::Named), 2).unwrap();
        let names = |folder: &Path| {
            let entries = fs::read_dir(folder).unwrap();
            let mut names: Vec<_> =
                entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
            names.sort();
            names
        };
        assert_eq!(names(&run), ["manifest.json", "tables"]);
        assert_eq!(
            names(&run.join("tables")),
            ["cases", "columns", "modes", "summary", "worst"].map(|t| format!("{t}.parquet"))
        );
    }

    #[test]
    fn row_groups_end_at_fixed_case_indices_and_with_their_population() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let outline = cases::outline(&CASES, StoredPoles::All);
        // 2 variants × 2 flight times × 128 poles reckoned with: 256 cases.
        assert_eq!(TableName::Modes.group_cases(&outline), 256);
        synthetic::run(&run, outline, 2).unwrap();
        let first_cases = |table: TableName| -> Vec<(String, i64)> {
            let file = || File::open(run.join(table.file())).unwrap();
            let groups = Reader::try_new(file()).unwrap().metadata().num_row_groups();
            let first = |group: usize| {
                let builder = Reader::try_new(file()).unwrap().with_row_groups(vec![group]);
                let batch = builder.build().unwrap().next().unwrap().unwrap();
                let names = batch.column(0).as_any_dictionary();
                let name = names.values().as_string::<i32>().value(names.normalized_keys()[0]);
                let cases = batch.column(1).as_primitive::<arrow::datatypes::Int64Type>();
                (name.to_owned(), cases.value(0))
            };
            (0..groups).map(first).collect()
        };
        let expected = |starts: &[i64]| {
            let mut expected = vec![("nominal".to_owned(), 0)];
            expected.extend(starts.iter().map(|case| ("dispersed".to_owned(), *case)));
            expected.push(("corner_dispersed".to_owned(), 0));
            expected
        };
        assert_eq!(first_cases(TableName::Cases), expected(&[0, 1024]));
        assert_eq!(first_cases(TableName::Modes), expected(&[0, 256, 512, 768, 1024]));
    }

    #[test]
    fn no_table_holds_a_number_that_is_not_finite() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        synthetic::run(&run, cases::outline(&CASES, StoredPoles::All), 2).unwrap();
        let mut nulls = 0;
        for table in TableName::ALL {
            let reader = Reader::try_new(File::open(run.join(table.file())).unwrap()).unwrap();
            for batch in reader.build().unwrap() {
                for column in batch.unwrap().columns() {
                    if *column.data_type() == DataType::Float64 {
                        let numbers = column.as_primitive::<Float64Type>();
                        assert!(numbers.iter().flatten().all(f64::is_finite), "{}", table.name());
                        nulls += numbers.null_count();
                    }
                }
            }
        }
        // Failures, stable poles and scores of values beyond their law.
        assert!(nulls > 0);
    }

    #[test]
    fn every_column_is_in_the_data_dictionary_with_its_unit() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let outline = cases::outline(&[1], StoredPoles::Named);
        let described = schema::dictionary(&outline);
        synthetic::run(&run, outline, 1).unwrap();
        for table in TableName::ALL {
            let reader = Reader::try_new(File::open(run.join(table.file())).unwrap()).unwrap();
            let of_table: Vec<_> = described.iter().filter(|d| d.table == table).collect();
            assert_eq!(reader.schema().fields().len(), of_table.len());
            for (field, described) in reader.schema().fields().iter().zip(of_table) {
                assert_eq!(*field.name(), described.column);
                assert_eq!(field.metadata().get("unit"), Some(&described.unit));
                assert_eq!(field.metadata().get("description"), Some(&described.description));
            }
            let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
            for key in ["tvse.schema_version", "tvse.table", "tvse.run"] {
                assert!(pairs.iter().any(|pair| pair.key == key), "{key}");
            }
        }
    }

    #[test]
    fn an_existing_folder_is_refused_and_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        synthetic::run(&run, cases::outline(&[1, 9], StoredPoles::Named), 1).unwrap();
        let before = tables(&run);
        let again = synthetic::run(&run, cases::outline(&[1, 9], StoredPoles::Named), 1);
        assert_eq!(again.unwrap_err().kind(), Kind::Input);
        assert_eq!(tables(&run), before);
    }

    #[test]
    fn an_abandoned_run_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let outline = cases::outline(&[1, 3000], StoredPoles::Named);
        let definition = outline.definition.clone();
        let mut results = Results::create(&run, outline).unwrap();
        for case in 0..1500 {
            results.push(cases::record(&definition, 1, case)).unwrap();
        }
        files::create_folder(&run.join(inputs::FOLDER).join("runs")).unwrap();
        files::write(&run.join(inputs::FOLDER).join("runs/a.toml"), b"cases = 3000").unwrap();
        drop(results);
        assert!(!run.exists());
    }

    #[test]
    fn a_run_that_cannot_be_finished_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let outline = cases::outline(&[1], StoredPoles::Named);
        let definition = outline.definition.clone();
        let mut results = Results::create(&run, outline).unwrap();
        results.push(cases::record(&definition, 0, 0)).unwrap();
        // A folder stands where the table of worst cases is to go, after others are finished.
        fs::create_dir_all(run.join(TableName::Worst.file()).join("taken")).unwrap();
        let problems = results.finish(1, 3).unwrap_err();
        assert!(problems.to_string().contains("worst.parquet"), "{problems}");
        assert!(!run.exists());
    }

    #[test]
    fn a_folder_that_vanishes_ends_the_run_with_a_problem() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let outline = cases::outline(&[1], StoredPoles::Named);
        let definition = outline.definition.clone();
        let mut results = Results::create(&run, outline).unwrap();
        results.push(cases::record(&definition, 0, 0)).unwrap();
        fs::remove_dir_all(&run).unwrap();
        let problems = results.finish(1, 3).unwrap_err();
        assert_eq!(problems.kind(), Kind::Input);
        assert!(problems.to_string().contains("cases.parquet"), "{problems}");
    }

    #[test]
    fn a_draw_whose_column_no_reader_accepts_is_a_problem_before_the_first_case() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let mut outline = cases::outline(&[1], StoredPoles::Named);
        outline.draws[0].column = "draw_Thrust".to_owned();
        outline.draws.push(outline.draws[1].clone());
        let problems = Results::create(&run, outline).err().unwrap();
        // The draw itself and its score, and both columns given twice.
        assert_eq!(problems.0.len(), 4, "{problems}");
        assert!(!run.exists());
    }

    /// An output with room for so many bytes.
    struct Small(usize);

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0 = self
                .0
                .checked_sub(bytes.len())
                .ok_or(std::io::Error::from(std::io::ErrorKind::StorageFull))?;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_disk_that_fills_up_ends_the_run_with_a_problem_of_its_file() {
        let outline = cases::outline(&[1, 300], StoredPoles::Named);
        let definition = outline.definition.clone();
        let written = |room: usize| -> Result<Content, parquet::errors::ParquetError> {
            let metadata = metadata(TableName::Cases, "{}");
            let mut table = Table::new(schema::cases(&outline), &metadata, Small(room))?;
            let result = Pool::new(2).unwrap().run(
                &definition,
                &spans(&definition.populations),
                |population, case| cases::record(&definition, population, case),
                |record| {
                    table.push(&row::rows(&definition, record).0);
                    table.end_group()
                },
                |_| (),
                &AtomicBool::new(false),
            );
            result.and_then(|_| table.close()).map(|(_, content)| content)
        };
        let whole = written(usize::MAX).unwrap().bytes as usize;
        assert!(written(whole).is_ok());
        for room in [0, 3, 100, whole / 7, whole / 2, whole - 1] {
            let error = written(room).unwrap_err();
            let problems = table::problem(Path::new("runs/a/tables/cases.parquet"), &error);
            assert_eq!(problems.kind(), Kind::Input);
            let text = problems.to_string();
            assert!(text.contains("cases.parquet") && text.contains("no storage space"), "{text}");
        }
    }
}
