//! The store of a run: its folder from the first case to the last, whoever works on it and however
//! often that is interrupted.
//!
//! It knows what has been evaluated, what is missing and who is at work; how tables are made of that
//! is the business of `assemble`.

use super::inputs::{self, Inputs};
use super::lock::{Lock, Owner, holder};
use super::maker::Maker;
use super::manifest::{self, Manifest};
use super::run::Run;
use super::schema::{self, TableName};
use super::shard::{self, Shard};
use super::{files, lock};
use crate::campaign::pool::{self, Part, Span};
use crate::campaign::{Outline, Population};
use crate::problem::{Kind, Problems};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// File that says what a run under way is to hold; a finished run has its manifest instead.
pub const STARTED: &str = "started.json";
/// Folder in which tables and manifest are made before they take their places.
pub const NEXT: &str = "next";
/// File of the lock.
pub const LOCK: &str = "lock";
/// Folder of the tables inside a run's folder.
pub const TABLES: &str = "tables";

/// What `started.json` holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Started {
    schema_version: u32,
    run: Outline,
    maker: Maker,
    /// Whether cases were added since it began.
    extended: bool,
}

/// Where the rows of some cases are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Cases of a population.
    pub span: Span,
    /// Number of the shard; none if they are in the tables.
    pub shard: Option<usize>,
}

/// How much of a run is to be worked on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// All of it, alone.
    Whole,
    /// A part of the cases, while others work on other parts.
    Part(Part),
}

/// A run's folder, locked.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    outline: Outline,
    extended: bool,
    identity: String,
    /// Finished tables, of all cases or of those before an extension.
    tables: Option<Run>,
    /// Shards by population and case; they go before the tables.
    shards: Vec<Shard>,
    access: Access,
    /// What was mended when the store was opened, in words.
    pub mended: Vec<String>,
    // Dropped last, so that nothing is done without them.
    locks: Vec<Lock>,
}

/// What a folder holds of a run.
enum Found {
    Nothing,
    Started(Box<Started>),
    Finished(Box<Manifest>),
}

impl Store {
    /// Begins a run in a new folder.
    ///
    /// # Errors
    /// Input problems: the folder exists, or cannot be written.
    pub fn begin(
        folder: &Path,
        outline: Outline,
        inputs: Option<&Inputs>,
        access: Access,
    ) -> Result<Self, Problems> {
        files::create_folder(folder)?;
        Self::start(folder, outline, inputs, access).inspect_err(|_| files::remove_if_empty(folder))
    }

    fn start(
        folder: &Path,
        outline: Outline,
        inputs: Option<&Inputs>,
        access: Access,
    ) -> Result<Self, Problems> {
        let locks = locked(folder, access)?;
        // Alone under the lock, a start that fails leaves nothing; others may need what a part wrote.
        let alone = access == Access::Whole;
        if alone {
            files::sweep(folder);
        }
        Self::write_start(folder, outline, inputs, access, locks).inspect_err(|_| {
            if alone {
                remove_unstarted(folder);
            }
        })
    }

    fn write_start(
        folder: &Path,
        outline: Outline,
        inputs: Option<&Inputs>,
        access: Access,
        locks: Vec<Lock>,
    ) -> Result<Self, Problems> {
        if let Some(inputs) = inputs {
            inputs.write(folder)?;
        }
        let maker = Maker::here();
        let started =
            Started { schema_version: schema::VERSION, run: outline, maker, extended: false };
        if !started.write_new(folder)? {
            // Another part of the same run was faster.
            let Found::Started(found) = look(folder)? else { unreachable!("it is there") };
            agree(&folder.join(STARTED), &started.run, &found.run)?;
            same_maker(&folder.join(STARTED), &found.maker)?;
        }
        Self::new(folder, started.run, None, access, locks)
    }

    fn new(
        folder: &Path,
        outline: Outline,
        tables: Option<Run>,
        access: Access,
        locks: Vec<Lock>,
    ) -> Result<Self, Problems> {
        let identity = outline.identity();
        let stale = locks.iter().filter_map(|lock| lock.stale.as_ref());
        let mended = stale.map(|by| format!("took over the stale lock of {}", by.name())).collect();
        let folder = folder.to_owned();
        let shards = Vec::new();
        let extended = false;
        Ok(Self { folder, outline, extended, identity, tables, shards, access, mended, locks })
    }

    /// Goes on with a run: what is damaged or half written is removed, with a word in
    /// [`Store::mended`]. `expected` is the outline of the scenario as it is now; the number of
    /// drawn cases is that of the run unless `cases` says that the scenario's was asked for.
    /// A folder that holds nothing yet is begun.
    ///
    /// # Errors
    /// Input: no folder of a run, another process at work, a scenario or program that differs, each
    /// difference by name.
    pub fn resume(
        folder: &Path,
        expected: Outline,
        cases: bool,
        inputs: Option<&Inputs>,
        access: Access,
    ) -> Result<Self, Problems> {
        if files::names(folder)?.iter().all(|name| is_leftover(name)) {
            files::ensure_folder(folder)?;
            return Self::start(folder, expected, inputs, access)?.with_shards(true);
        }
        let store = Self::open(folder, access)?;
        let path = store.folder.join(STARTED);
        agree(&path, &expected, &store.outline)?;
        let counts = |outline: &Outline| -> Vec<u64> {
            outline.definition.populations.iter().map(|p| p.cases).collect()
        };
        let (here, there) = (counts(&expected), counts(&store.outline));
        if cases && here != there && !store.extended {
            let found = format!("{} cases", expected.cases());
            let allowed = format!("{} as the run has, or --extend", store.outline.cases());
            return Err(Problems::input(files::name(&path), "cases", found, allowed));
        }
        store.with_shards(true)
    }

    /// Refuses a folder that holds no run.
    ///
    /// # Errors
    /// An input problem that says so.
    pub fn refuse_none(folder: &Path) -> Result<(), Problems> {
        match look(folder)? {
            Found::Nothing => Err(no_run(folder)),
            _ => Ok(()),
        }
    }

    /// Opens a run as it is, without its shards.
    fn open(folder: &Path, access: Access) -> Result<Self, Problems> {
        let locks = locked(folder, access)?;
        if access == Access::Whole {
            settle(folder)?;
            files::sweep(folder);
        }
        let (outline, maker, tables, extended) = match look(folder)? {
            Found::Nothing => return Err(no_run(folder)),
            Found::Finished(manifest) => {
                let maker = manifest.execution.maker.clone();
                (manifest.run, maker, Some(Run::open(folder)?), false)
            }
            Found::Started(started) => {
                let manifest = folder.join(manifest::FILE).is_file();
                let tables = if manifest { Some(Run::open(folder)?) } else { None };
                (started.run, started.maker, tables, started.extended)
            }
        };
        same_maker(&folder.join(STARTED), &maker)?;
        let mut store = Self::new(folder, outline, tables, access, locks)?;
        store.extended = extended;
        Ok(store)
    }

    /// Opens a run to merge its shards; those in further folders are taken over by name.
    ///
    /// # Errors
    /// Input: no such run, another process at work. Damage: every shard that is damaged, of another
    /// run, of another maker or not disjoint.
    pub fn gather(folder: &Path, from: &[PathBuf]) -> Result<Self, Problems> {
        // A run that was never begun in this folder is begun by its first part.
        if let Some(first) = from.first().filter(|_| matches!(look(folder), Ok(Found::Nothing))) {
            let Found::Started(started) = look(first)? else {
                let found = "no run under way";
                return Err(Problems::input(files::name(first), "", found, "parts of a run"));
            };
            files::ensure_folder(folder)?;
            inputs::copy(first, folder)?;
            started.write_new(folder)?;
        }
        let store = Self::open(folder, Access::Whole)?;
        let mut problems = Problems::default();
        for part in from {
            match look(part)? {
                Found::Started(started) => {
                    let path = part.join(STARTED);
                    for checked in [
                        agree(&path, &started.run, &store.outline),
                        same_maker(&path, &started.maker),
                    ] {
                        if let Err(found) = checked {
                            problems.extend(found);
                        }
                    }
                }
                _ => problems.push(
                    Kind::Input,
                    files::name(part),
                    "",
                    "no run under way",
                    "a folder with parts of the run",
                ),
            }
        }
        let mut store = problems.into_result(store)?;
        for part in from {
            store.read_shards(part, false)?;
        }
        store.with_shards(false)
    }

    fn with_shards(mut self, mend: bool) -> Result<Self, Problems> {
        let folder = self.folder.clone();
        self.read_shards(&folder, mend)?;
        self.shards.sort_by_key(|shard| (shard.population, shard.header.cases.start));
        let mut problems = Problems::default();
        for pair in self.shards.windows(2) {
            let [first, second] = pair else { continue };
            if first.population == second.population
                && second.header.cases.start < first.header.cases.end
            {
                let found = format!("cases that {} holds too", files::name(&first.path));
                let path = files::name(&second.path);
                problems.push(Kind::Damage, path, "", found, "disjoint shards");
            }
        }
        problems.into_result(self)
    }

    /// Reads the shards in a folder and checks them whole; with `mend` damaged ones are removed.
    fn read_shards(&mut self, folder: &Path, mend: bool) -> Result<(), Problems> {
        let place = folder.join(shard::FOLDER);
        let maker = Maker::here();
        let mut problems = Problems::default();
        for name in files::names(&place)?.into_iter().filter(|name| shard::is_name(name)) {
            let path = place.join(name);
            let read = Shard::open(&path, &self.outline, &self.identity).and_then(|shard| {
                // What others are at work on is theirs to check.
                if self.concerns(&shard) {
                    shard.verify()?;
                }
                Ok(shard)
            });
            match read {
                Ok(shard) => {
                    for (what, here, there) in maker.differences(&shard.header.maker) {
                        let name = files::name(&path);
                        problems.push(Kind::Input, name, what, there, format!("{here} as here"));
                    }
                    self.shards.push(shard);
                }
                Err(found) if mend && self.access == Access::Whole => {
                    // Put aside, not removed: it may be somebody's.
                    files::rename(&path, &path.with_extension("damaged"))?;
                    self.mended.push(format!("{found}; its cases are evaluated again"));
                }
                // Perhaps another part's: evaluated again if it is needed, and left to the merge.
                Err(found) if mend => self.mended.push(format!("{found}; left as it is")),
                Err(found) => problems.extend(found),
            }
        }
        problems.into_result(())
    }

    fn concerns(&self, shard: &Shard) -> bool {
        let cases = &shard.header.cases;
        self.spans().iter().any(|span| {
            span.population == shard.population
                && cases.start < span.cases.end
                && span.cases.start < cases.end
        })
    }

    /// Cases to work on, evaluated or not.
    pub fn spans(&self) -> Vec<Span> {
        let populations = &self.outline.definition.populations;
        match self.access {
            Access::Whole => pool::spans(populations),
            Access::Part(part) => part.spans(populations),
        }
    }

    /// Refuses a run whose last extension is not finished: another would add to it.
    ///
    /// # Errors
    /// An input problem with the number of cases that are missing.
    pub fn refuse_unfinished_extension(&self) -> Result<(), Problems> {
        let missing: u64 =
            self.missing().iter().map(|span| span.cases.end - span.cases.start).sum();
        if !self.extended || missing == 0 {
            return Ok(());
        }
        let found = format!("an extension that is not finished, {missing} cases are missing");
        let allowed = "--resume, which goes on with it; then a further --extend";
        Err(Problems::input(files::name(&self.folder), "--extend", found, allowed))
    }

    /// Adds `more` cases to every drawn population.
    ///
    /// # Errors
    /// An input problem if it cannot be written down, or if the plan of a population cannot have so
    /// many more cases, or any without changing the first ones.
    pub fn extend(&mut self, more: u64) -> Result<(), Problems> {
        let draws = self.outline.draws.len() as u64;
        for p in self.outline.definition.populations.iter().filter(|p| p.drawn) {
            p.scheme.check_extension(more, draws).map_err(|refusal| {
                let key = format!("{}.{}", p.name, refusal.key);
                Problems::input(files::name(&self.folder), key, refusal.found, refusal.allowed)
            })?;
        }
        self.outline.definition.add_cases(more);
        let started = Started {
            schema_version: schema::VERSION,
            run: self.outline.clone(),
            maker: Maker::here(),
            extended: true,
        };
        let text = serde_json::to_string_pretty(&started).expect("text keys only");
        files::write(&self.folder.join(STARTED), text.as_bytes())
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The outline of the run.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// Identity of the run.
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// The tables, of all cases or of those before an extension.
    pub fn tables(&self) -> Option<&Run> {
        self.tables.as_ref()
    }

    /// The shards.
    pub fn shards(&self) -> &[Shard] {
        &self.shards
    }

    /// Adds a shard that was written.
    pub fn add(&mut self, shard: Shard) {
        let key = |shard: &Shard| (shard.population, shard.header.cases.start);
        let at = self.shards.partition_point(|other| key(other) < key(&shard));
        self.shards.insert(at, shard);
    }

    /// Says in the lock how far the work has come.
    pub fn tell(&mut self, progress: lock::Told) {
        if let Some(lock) = self.locks.last_mut() {
            lock.tell(progress);
        }
    }

    /// Where the rows of every evaluated case are, in order.
    pub fn segments(&self) -> Vec<Segment> {
        let mut segments = Vec::new();
        for (population, p) in self.outline.definition.populations.iter().enumerate() {
            let stored = self.tables.as_ref().map_or(0, |run| {
                run.outline().definition.populations[population].cases.min(p.cases)
            });
            let segment = |cases: Range<u64>, shard| {
                let some = cases.start < cases.end;
                let segment = Segment { span: Span { population, cases }, shard };
                some.then_some(segment)
            };
            let mut next = 0;
            for (index, shard) in self.shards.iter().enumerate() {
                if shard.population == population {
                    let cases = shard.header.cases.clone();
                    segments.extend(segment(next..cases.start.min(stored), None));
                    next = cases.end;
                    segments.extend(segment(cases, Some(index)));
                }
            }
            segments.extend(segment(next..stored, None));
        }
        segments
    }

    /// Cases that are not evaluated yet, of those to work on.
    pub fn missing(&self) -> Vec<Span> {
        missing(&self.spans(), self.segments().into_iter().map(|segment| segment.span))
    }

    /// Whether there is nothing left to do: every case is in the tables.
    pub fn is_finished(&self) -> bool {
        self.shards.is_empty()
            && self.tables.as_ref().is_some_and(|run| *run.outline() == self.outline)
    }

    /// Gives the tables and the manifest in [`NEXT`] their places; the run is finished.
    ///
    /// # Errors
    /// An input problem if a file cannot be renamed; another call goes on from there.
    pub fn commit(&self) -> Result<(), Problems> {
        settle(&self.folder)
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        // A run of which nothing is evaluated leaves nothing behind.
        if self.access == Access::Whole {
            // What is made whole may be half in its place: the next process goes on with that.
            if !self.folder.join(NEXT).join(manifest::FILE).is_file() {
                files::remove_folder(&self.folder.join(NEXT));
            }
            files::remove_if_empty(&self.folder.join(shard::FOLDER));
            let none = files::names(&self.folder.join(shard::FOLDER)).is_ok_and(|n| n.is_empty());
            if self.tables.is_none() && self.shards.is_empty() && none {
                remove_unstarted(&self.folder);
            }
        }
        self.locks.clear();
        files::remove_if_empty(&self.folder);
    }
}

impl Started {
    fn write_new(&self, folder: &Path) -> Result<bool, Problems> {
        let text = serde_json::to_string_pretty(self).expect("text keys only");
        files::write_new(&folder.join(STARTED), text.as_bytes())
    }
}

/// `spans` without those that are `covered`, which come in order.
fn missing(spans: &[Span], covered: impl Iterator<Item = Span>) -> Vec<Span> {
    let covered: Vec<Span> = covered.collect();
    let mut missing = Vec::new();
    for span in spans {
        let mut next = span.cases.start;
        let mut leave = |next: u64, end: u64| {
            if next < end {
                missing.push(Span { population: span.population, cases: next..end });
            }
        };
        for other in covered.iter().filter(|other| other.population == span.population) {
            if other.cases.end > next && other.cases.start < span.cases.end {
                leave(next, other.cases.start);
                next = other.cases.end;
            }
        }
        leave(next, span.cases.end);
    }
    missing
}

fn locked(folder: &Path, access: Access) -> Result<Vec<Lock>, Problems> {
    let whole = folder.join(LOCK);
    Ok(match access {
        Access::Whole => vec![Lock::take(&whole)?],
        Access::Part(part) => {
            let own = folder.join(format!("{LOCK}-{}-of-{}", part.number, part.of));
            vec![Lock::share(&whole)?, Lock::take(&own)?]
        }
    })
}

/// Whether a name in a run's folder is one that a run leaves that was killed as it began.
fn is_leftover(name: &str) -> bool {
    name == LOCK
        || name.starts_with("lock-")
        || name.starts_with(files::ASIDE)
        || name == inputs::FOLDER
        || name == shard::FOLDER
}

/// Removes what a run writes before its first shard.
fn remove_unstarted(folder: &Path) {
    files::remove_folder(&folder.join(inputs::FOLDER));
    files::remove_if_empty(&folder.join(shard::FOLDER));
    let _ = files::remove(&folder.join(STARTED));
    files::remove_if_empty(folder);
}

/// Finishes what is made but not in its place: see [`Store::commit`].
fn settle(folder: &Path) -> Result<(), Problems> {
    let next = folder.join(NEXT);
    let made = next.join(manifest::FILE);
    if made.is_file() {
        files::remove(&folder.join(manifest::FILE))?;
        files::ensure_folder(&folder.join(TABLES))?;
        for table in TableName::ALL {
            let from = next.join(table.file());
            if from.is_file() {
                files::rename(&from, &folder.join(table.file()))?;
            }
        }
        files::rename(&made, &folder.join(manifest::FILE))?;
        files::remove(&folder.join(STARTED))?;
    }
    let finished = folder.join(manifest::FILE).is_file() && !folder.join(STARTED).is_file();
    if finished {
        for name in files::names(&folder.join(shard::FOLDER))? {
            if shard::is_name(&name) {
                files::remove(&folder.join(shard::FOLDER).join(name))?;
            }
        }
        files::remove_if_empty(&folder.join(shard::FOLDER));
        for name in files::names(folder)? {
            if name.starts_with("lock-") && holder(&folder.join(&name)).is_none() {
                files::remove(&folder.join(name))?;
            }
        }
    }
    files::remove_folder(&next);
    Ok(())
}

fn no_run(folder: &Path) -> Problems {
    let found = "neither a finished run nor one under way";
    Problems::input(files::name(folder), "", found, "the folder of a run")
}

/// What a folder holds of a run.
fn look(folder: &Path) -> Result<Found, Problems> {
    let path = folder.join(STARTED);
    if path.is_file() {
        let damaged = |found: String| {
            Problems::damage(files::name(&path), "", found, "what a run under way is to hold")
        };
        let text = files::read_text(&path).map_err(|problems| damaged(problems.to_string()))?;
        let started: Started =
            serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        if started.schema_version != schema::VERSION {
            return Err(damaged(format!("schema version {}", started.schema_version)));
        }
        return Ok(Found::Started(Box::new(started)));
    }
    if folder.join(manifest::FILE).is_file() {
        return Ok(Found::Finished(Box::new(Manifest::read(folder)?)));
    }
    Ok(Found::Nothing)
}

/// Every difference between two outlines but the number of drawn cases.
fn agree(path: &Path, here: &Outline, there: &Outline) -> Result<(), Problems> {
    let mut problems = Problems::default();
    for (name, here, there) in here.differences(there) {
        let allowed = format!("{there} as the run began with");
        problems.push(Kind::Input, files::name(path), name, here, allowed);
    }
    problems.into_result(())
}

fn same_maker(path: &Path, there: &Maker) -> Result<(), Problems> {
    let mut problems = Problems::default();
    for (name, here, there) in Maker::here().differences(there) {
        let allowed = format!("{there} as the run began with");
        problems.push(Kind::Input, files::name(path), name, here, allowed);
    }
    problems.into_result(())
}

/// How far a run has come, as it shows from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Whether its tables are complete.
    pub finished: bool,
    /// Populations, as asked for.
    pub populations: Vec<Population>,
    /// Cases evaluated and on the disk.
    pub done: u64,
    /// Of these, cases with a failed evaluation; not known of finished tables.
    pub failed: u64,
    /// Of these, cases with an unstable named mode; not known of finished tables.
    pub unstable: u64,
    /// Cases that are not on the disk yet.
    pub missing: Vec<Span>,
    /// Who is at work, and with which lock.
    pub owners: Vec<(String, Owner)>,
    /// What is wrong with shards and tables.
    pub damaged: Problems,
}

impl Status {
    /// Numbers of the parts out of `of` that have cases left.
    pub fn parts_left(&self, of: u64) -> Vec<u64> {
        let left = |number: &u64| {
            let spans = Part { number: *number, of }.spans(&self.populations);
            spans.iter().any(|span| {
                self.missing.iter().any(|other| {
                    other.population == span.population
                        && other.cases.start < span.cases.end
                        && span.cases.start < other.cases.end
                })
            })
        };
        (1..=of).filter(left).collect()
    }
}

/// Looks at a run without touching or locking it. Of shards and tables their first lines, names and
/// sizes are read; with `verify` every byte, held against its digest.
///
/// # Errors
/// Input: no folder of a run. Damage: what says what it is cannot be read.
pub fn status(folder: &Path, verify: bool) -> Result<Status, Problems> {
    let (finished, outline) = match look(folder)? {
        Found::Nothing => return Err(no_run(folder)),
        Found::Finished(manifest) => (true, manifest.run),
        Found::Started(started) => (false, started.run),
    };
    let mut owners = Vec::new();
    for name in files::names(folder)? {
        if name == LOCK || name.starts_with("lock-") {
            owners.extend(holder(&folder.join(&name)).map(|owner| (name, owner)));
        }
    }
    let mut damaged = Problems::default();
    // Tables of an extension's first part are as good as shards.
    let stored = Manifest::read(folder).ok().map(|manifest| manifest.run.definition.populations);
    if stored.is_some() {
        let looked = if verify { Run::open(folder).map(|_| ()) } else { Run::sizes(folder) };
        looked.unwrap_or_else(|found| damaged.extend(found));
    }
    let mut covered: Vec<Span> = stored.as_deref().map(pool::spans).unwrap_or_default();
    let mut done: u64 = covered.iter().map(|span| span.cases.end).sum();
    let (mut failed, mut unstable) = (0, 0);
    let identity = outline.identity();
    let place = folder.join(shard::FOLDER);
    for name in files::names(&place)?.into_iter().filter(|name| shard::is_name(name)) {
        let shard = Shard::open(&place.join(name), &outline, &identity);
        let shard =
            shard.and_then(|shard| if verify { shard.verify() } else { Ok(()) }.map(|()| shard));
        match shard {
            Ok(shard) => {
                let span = Span { population: shard.population, cases: shard.header.cases };
                let new = missing(std::slice::from_ref(&span), covered.iter().cloned());
                done += new.iter().map(|span| span.cases.end - span.cases.start).sum::<u64>();
                failed += shard.header.failed;
                unstable += shard.header.unstable;
                covered.push(span);
                covered.sort_by_key(|span| (span.population, span.cases.start));
            }
            Err(found) => damaged.extend(found),
        }
    }
    let populations = outline.definition.populations;
    let missing = missing(&pool::spans(&populations), covered.into_iter());
    Ok(Status { finished, populations, done, failed, unstable, missing, owners, damaged })
}

#[cfg(test)]
mod tests;
