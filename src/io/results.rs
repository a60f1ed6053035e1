//! The results of a run being written: shards while its cases are evaluated, then the tables, the
//! manifest last.
//!
//! What the columns are is said in `schema`; what the records are in `campaign`; what lies in the
//! run's folder in `store`.

#![expect(clippy::disallowed_methods, reason = "the manifest states when a run was made")]

use super::column::Column;
use super::files::{self, Aside};
use super::inputs::Inputs;
use super::lock::Told;
use super::manifest::{self, Execution, Manifest};
use super::run::Run;
use super::schema::{self, TableName};
use super::shard::{Filling, Shard};
use super::store::{Access, NEXT, Store, TABLES};
use super::table::{self, Content, Table};
use super::{assemble, envelope, summarise};
use crate::campaign::metric::LONGEST_NAME;
use crate::campaign::summary::{SummaryRow, WorstRow};
use crate::campaign::{Outline, Record};
use crate::problem::{Kind, Problems};
use std::collections::{BTreeMap, BTreeSet};
use std::panic::resume_unwind;
use std::path::Path;
use std::thread::JoinHandle;
use std::time::SystemTime;

/// The results of a run that is under way.
///
/// Dropped before [`Results::finish`] has succeeded it leaves the shards that are written, from
/// which the run goes on, and nothing if there are none.
pub struct Results {
    // Dropped first: what is being written is written under the store's lock.
    writing: InFlight,
    store: Store,
    filling: Option<Filling>,
    aside: bool,
    started: SystemTime,
}

/// A shard being written by another thread, which is waited for.
#[derive(Default)]
struct InFlight(Option<JoinHandle<Result<Shard, Problems>>>);

impl InFlight {
    fn wait(&mut self) -> Result<Option<Shard>, Problems> {
        let written = self.0.take().map(JoinHandle::join);
        written.map(|shard| shard.unwrap_or_else(|panic| resume_unwind(panic))).transpose()
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        // Whether it was written shows when the run is gone on with.
        let _ = self.0.take().map(JoinHandle::join);
    }
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

/// How the folder of a run is opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Opening {
    /// A new folder.
    New,
    /// A folder to go on with, or a new one; the number of drawn cases must be the outline's if it
    /// was asked for.
    Resume {
        /// Whether it was asked for.
        cases: bool,
    },
    /// A folder to go on with, with so many more cases in every drawn population.
    Extend(u64),
}

impl Results {
    /// Makes the run's folder, without copies of inputs.
    ///
    /// # Errors
    /// As [`Results::open`].
    pub fn create(folder: &Path, outline: Outline) -> Result<Self, Problems> {
        Self::open(folder, outline, None, Opening::New, Access::Whole)
    }

    /// Opens the folder of a run and locks it.
    ///
    /// # Errors
    /// Input problems: a new folder exists, it cannot be written, the disk is full, another process
    /// is at work, the run is of another scenario or program; a draw has a column name that readers
    /// do not accept or that another has too.
    pub fn open(
        folder: &Path,
        outline: Outline,
        inputs: Option<&Inputs>,
        opening: Opening,
        access: Access,
    ) -> Result<Self, Problems> {
        check_names(&outline)?;
        let started = SystemTime::now();
        let mut store = match opening {
            Opening::New => Store::begin(folder, outline, inputs, access)?,
            Opening::Resume { cases } => Store::resume(folder, outline, cases, inputs, access)?,
            Opening::Extend(_) => {
                Store::refuse_none(folder)?;
                let store = Store::resume(folder, outline, false, None, access)?;
                store.refuse_unfinished_extension()?;
                store
            }
        };
        if let Opening::Extend(more) = opening {
            store.extend(more)?;
        }
        Ok(Self { started, ..Self::of(store) })
    }

    /// Goes on with a store that was opened otherwise.
    pub fn of(store: Store) -> Self {
        let (writing, started) = (InFlight::default(), SystemTime::now());
        Self { writing, store, filling: None, aside: false, started }
    }

    /// From now on full shards are written by a thread of their own, one at a time, while further
    /// records are pushed; an error comes with a later call.
    pub fn write_aside(&mut self) {
        self.aside = true;
    }

    /// The store.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Takes the record of the next case; cases come in the order of population and case, gaps are
    /// allowed.
    ///
    /// # Errors
    /// An input problem if the disk is full or gone.
    pub fn push(&mut self, record: Record) -> Result<(), Problems> {
        if self.filling.as_ref().is_some_and(|filling| !filling.goes_on_with(&record)) {
            self.hand_over()?;
        }
        let outline = self.store.outline();
        let filling = match &mut self.filling {
            Some(filling) => filling,
            none => {
                let filling = Filling::new(outline, record.population, record.case)
                    .map_err(|error| table::problem(self.store.folder(), &error))?;
                none.insert(filling)
            }
        };
        if filling.push(outline, record) { self.hand_over() } else { Ok(()) }
    }

    /// Writes what was pushed so far to the disk, for good.
    ///
    /// # Errors
    /// An input problem if the disk is full or gone.
    pub fn checkpoint(&mut self) -> Result<(), Problems> {
        self.hand_over()?;
        self.wait()
    }

    /// Writes the shard that was filled, or has it written.
    fn hand_over(&mut self) -> Result<(), Problems> {
        self.wait()?;
        let Some(filling) = self.filling.take() else { return Ok(()) };
        let store = &self.store;
        if self.aside {
            let (folder, outline) = (store.folder().to_owned(), store.outline().clone());
            let identity = store.identity().to_owned();
            let write = move || filling.write(&folder, &outline, &identity);
            self.writing = InFlight(Some(std::thread::spawn(write)));
            return Ok(());
        }
        let shard = filling.write(store.folder(), store.outline(), store.identity())?;
        self.store.add(shard);
        Ok(())
    }

    /// Waits for the shard that is being written.
    fn wait(&mut self) -> Result<(), Problems> {
        if let Some(shard) = self.writing.wait()? {
            self.store.add(shard);
        }
        Ok(())
    }

    /// Says to other processes how far the work has come.
    pub fn tell(&mut self, progress: Told) {
        self.store.tell(progress);
    }

    /// Makes the tables of cases from the shards, sums them up, and writes the manifest; `worst` is
    /// the number of worst cases kept for each population, variant and named mode.
    ///
    /// # Errors
    /// Input: the disk is full or gone; the shards stay. Damage: a shard, by its name.
    ///
    /// # Panics
    /// If cases of the outline are missing.
    pub fn finish(mut self, jobs: usize, worst: usize) -> Result<Finished, Problems> {
        self.checkpoint()?;
        let store = &self.store;
        assert!(store.missing().is_empty(), "every case was pushed");
        let next = store.folder().join(NEXT);
        files::ensure_folder(&next.join(TABLES))?;
        let mut contents = BTreeMap::new();
        for tables in TableName::of_cases(store.outline()).chunks(jobs.max(1)) {
            let assembled = at_once(tables, |table| assemble::assemble(store, *table, &next));
            for (table, content) in tables.iter().zip(assembled) {
                contents.insert(*table, content?);
            }
        }
        let mut run = Run::of(&next, store.outline().clone(), contents);
        let (rows, worst_rows) = std::thread::scope(|scope| {
            let worst = || summarise::worst(&run, worst);
            let aside = (jobs > 1).then(|| scope.spawn(worst));
            let rows = summarise::summary(&run, summarise::MEMORY);
            (rows, aside.map_or_else(worst, joined))
        });
        let (rows, worst_rows) = (rows?, worst_rows?);
        let outline = run.outline();
        let described = schema::dictionary(outline);
        let write = Writing { folder: store.folder(), next: &next, outline };
        let made = [
            write.table(TableName::Summary, schema::summary(outline), &rows)?,
            write.table(TableName::Worst, schema::worst(outline), &worst_rows)?,
            write.table(TableName::Columns, schema::columns(), &described)?,
        ];
        for (name, content) in made {
            run.insert(name, content);
        }
        if TableName::of_run(run.outline()).contains(&TableName::Envelopes) {
            let rows = envelope::envelopes(&run, summarise::MEMORY)?;
            let columns = schema::envelopes(run.outline());
            let (name, content) =
                Writing { folder: store.folder(), next: &next, outline: run.outline() }.table(
                    TableName::Envelopes,
                    columns,
                    &rows,
                )?;
            run.insert(name, content);
        }
        let tables = run.contents().map(|(name, c)| (name.name().to_owned(), c.clone())).collect();
        let text = Manifest {
            schema_version: schema::VERSION,
            run: run.outline().clone(),
            tables,
            execution: Execution::since(self.started, jobs),
        }
        .to_text();
        files::write(&next.join(manifest::FILE), text.as_bytes())?;
        store.commit()?;
        Ok(Finished { run: run.moved(store.folder()), summary: rows, worst: worst_rows })
    }
}

/// What `work` makes of each item, each on its own thread; of one item, on this one.
fn at_once<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let work = &work;
    std::thread::scope(|scope| {
        let Some((first, others)) = items.split_first() else { return Vec::new() };
        let others: Vec<_> = others.iter().map(|item| scope.spawn(move || work(item))).collect();
        std::iter::once(work(first)).chain(others.into_iter().map(joined)).collect()
    })
}

/// What a thread made, or its panic.
fn joined<R>(thread: std::thread::ScopedJoinHandle<'_, R>) -> R {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// Where tables that are made of others are written.
struct Writing<'a> {
    folder: &'a Path,
    next: &'a Path,
    outline: &'a Outline,
}

impl Writing<'_> {
    fn table<R>(
        &self,
        name: TableName,
        columns: Vec<Column<R>>,
        rows: &[R],
    ) -> Result<(TableName, Content), Problems> {
        let target = self.next.join(name.file());
        let failed = |error| table::problem(&target, &error);
        let text = serde_json::to_string(self.outline).expect("an outline has text keys only");
        // Written aside elsewhere: a folder of tables holds nothing else, whatever happens.
        let aside = Aside::within(self.folder, &target)?;
        let mut table = Table::new(columns, &metadata(name, &text), aside, None).map_err(failed)?;
        rows.iter().for_each(|row| table.push(row));
        let (aside, content) = table.close().map_err(failed)?;
        aside.finish()?;
        Ok((name, content))
    }
}

/// File-level metadata of a table.
pub(super) fn metadata(name: TableName, outline: &str) -> [(&'static str, String); 3] {
    [
        ("tvse.schema_version", schema::VERSION.to_string()),
        ("tvse.table", name.name().to_owned()),
        ("tvse.run", outline.to_owned()),
    ]
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
    use super::super::{inputs, synthetic};
    use super::*;
    use crate::campaign::pool::{Pool, spans};
    use crate::campaign::row;
    use crate::campaign::{StoredPoles, synthetic as cases};
    use arrow::array::{Array, AsArray};
    use arrow::datatypes::{DataType, Float64Type};
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder as Reader;
    use parquet::errors::ParquetError;
    use std::fs::{self, File};
    use std::io::Write;
    use std::sync::atomic::AtomicBool;

    const CASES: [u64; 3] = [1, 1100, 40];

    fn tables(folder: &Path) -> Vec<(&'static str, Vec<u8>)> {
        let read = |table: TableName| (table.name(), fs::read(folder.join(table.file())).unwrap());
        let outline = cases::outline(&[1], StoredPoles::Named);
        TableName::of_run(&outline).into_iter().map(read).collect()
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
    fn shards_written_by_a_thread_of_their_own_give_the_same_bytes_and_their_errors() {
        let folder = tempfile::tempdir().unwrap();
        let outline = || cases::outline(&CASES, StoredPoles::All);
        let (plain, aside) = (folder.path().join("plain"), folder.path().join("aside"));
        synthetic::run(&plain, outline(), 1).unwrap();
        let mut results = Results::create(&aside, outline()).unwrap();
        results.write_aside();
        synthetic::evaluate(results, 2, u64::MAX).unwrap().finish(2, 3).unwrap();
        assert_eq!(tables(&aside), tables(&plain));

        let gone = folder.path().join("gone");
        let mut results = Results::create(&gone, outline()).unwrap();
        results.write_aside();
        let outline = outline();
        let record = |population, case| {
            cases::evaluate(&outline.definition, population, case, outline.poles)
        };
        results.push(record(0, 0)).unwrap();
        fs::remove_dir_all(&gone).unwrap();
        // The shard of the first population is full here, that it has no place shows when the next is.
        let pushed = results.push(record(1, 0));
        let problems = pushed.and_then(|()| results.checkpoint()).unwrap_err();
        assert!(problems.to_string().contains("gone"), "{problems}");
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
        let outline = cases::outline(&[1, 2100, 40], StoredPoles::All);
        // 2 variants × 2 flight times × 128 poles reckoned with, 26 columns: blocks of 32 cases.
        assert_eq!(TableName::Modes.group_cases(&outline), 2048);
        assert_eq!(TableName::Cases.group_cases(&outline), 262_144);
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
        assert_eq!(first_cases(TableName::Cases), expected(&[0]));
        assert_eq!(first_cases(TableName::Modes), expected(&[0, 2048]));
    }

    #[test]
    fn no_table_holds_a_number_that_is_not_finite() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        synthetic::run(&run, cases::outline(&CASES, StoredPoles::All), 2).unwrap();
        let mut nulls = 0;
        for table in TableName::of_run(&cases::outline(&[1], StoredPoles::Named)) {
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
        for table in TableName::of_run(&cases::outline(&[1], StoredPoles::Named)) {
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
    fn an_abandoned_run_leaves_its_shards_and_nothing_if_there_are_none() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let outline = cases::outline(&[1, 3000], StoredPoles::Named);
        let definition = outline.definition.clone();
        for (pushed, kept) in [(1500, false), (1500, true)] {
            let mut results = Results::create(&run, outline.clone()).unwrap();
            for case in 0..pushed {
                results.push(cases::record(&definition, 1, case)).unwrap();
            }
            files::create_folder(&run.join(inputs::FOLDER).join("runs")).unwrap();
            if kept {
                results.checkpoint().unwrap();
            }
            drop(results);
            assert_eq!(run.exists(), kept);
        }
        let results =
            Results::open(&run, outline, None, Opening::Resume { cases: true }, Access::Whole);
        let missing = results.unwrap().store().missing();
        let missing: Vec<_> = missing.into_iter().map(|s| (s.population, s.cases)).collect();
        assert_eq!(missing, [(0, 0..1), (1, 1500..3000)]);
    }

    #[test]
    fn a_run_that_cannot_be_finished_keeps_its_shards_and_can_be_finished_later() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let outline = cases::outline(&[1], StoredPoles::Named);
        let definition = outline.definition.clone();
        let mut results = Results::create(&run, outline.clone()).unwrap();
        results.push(cases::record(&definition, 0, 0)).unwrap();
        // A folder stands where the table of worst cases is to go, after others are finished.
        let taken = run.join(TableName::Worst.file()).join("taken");
        fs::create_dir_all(&taken).unwrap();
        let problems = results.finish(1, 3).unwrap_err();
        assert!(problems.to_string().contains("worst.parquet"), "{problems}");
        fs::remove_dir_all(run.join(TableName::Worst.file())).unwrap();
        let again = Opening::Resume { cases: true };
        let results = Results::open(&run, outline.clone(), None, again, Access::Whole).unwrap();
        assert!(results.store().missing().is_empty());
        results.finish(1, 3).unwrap();
        let plain = folder.path().join("plain");
        synthetic::run(&plain, outline, 1).unwrap();
        assert_eq!(tables(&run), tables(&plain));
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
        assert!(problems.to_string().contains("run/"), "{problems}");
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
        let written = |room: usize| -> Result<Content, ParquetError> {
            let metadata = metadata(TableName::Cases, "{}");
            let mut table = Table::new(schema::cases(&outline), &metadata, Small(room), None)?;
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
