//! A campaign carried out: the options of every command that evaluates cases into a run's folder,
//! and what they have in common.

use super::gate::{self, Judged};
use super::interrupt::Interrupt;
use super::progress::{Show, Shown};
use super::{Error, PASS, part};
use crate::campaign::pool::{self, Part, Pool, Span};
use crate::campaign::{Definition, Outline, Progress, Record};
use crate::io::store::Access;
use crate::io::{self, Opening, Results, Run, files, maker, summarise};
use crate::problem::Problems;
use crate::report::{self, story};
use std::cell::RefCell;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

/// Most threads: more would not help, and a mistyped number not stop the machine.
const MOST_JOBS: i64 = 1024;
/// Most parts of a campaign.
const MOST_SHARDS: u64 = 1_000_000;
/// Worst cases stored for each population, variant and mode.
pub const WORST: usize = 10;

/// How a campaign is carried out; results do not depend on any of it.
#[derive(clap::Args)]
pub struct Options {
    /// Threads (default: all processors); results do not depend on it
    #[arg(long, short, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u16).range(1..=MOST_JOBS))]
    pub jobs: Option<u16>,
    /// Goes on with a run that was stopped, or begins it; nothing finished is evaluated again
    #[arg(long)]
    pub resume: bool,
    /// Adds N cases to every drawn population of a run; those it has stay as they are
    #[arg(long, value_name = "N", conflicts_with_all = ["resume", "shard", "shard_from_env"],
        value_parser = clap::value_parser!(u64).range(1..))]
    pub extend: Option<u64>,
    /// Evaluates one of n parts of the cases into the same folder; `tvse merge` makes the tables.
    /// Repeated, it goes on where it was
    #[arg(long, value_name = "I/N", value_parser = part::parse)]
    pub shard: Option<Part>,
    /// Takes the number of the part from the job array of Slurm, PBS, Kubernetes, SGE or LSF
    #[arg(long, conflicts_with = "shard")]
    pub shard_from_env: bool,
    /// Number of parts, where the job array does not say it or tasks are submitted again alone
    #[arg(long, value_name = "N", requires = "shard_from_env",
        value_parser = clap::value_parser!(u64).range(1..=MOST_SHARDS))]
    pub shards: Option<u64>,
    /// Instruction set on which alone the cases may be evaluated, for instance x86-64-v3; this
    /// machine's is refused if it is another (the kernels choose by the processor, so that a
    /// lesser one cannot be had). Parts of one run never mix
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// Longest time until cases are on the disk for good, s (default: 5, or one hundredth of the
    /// time so far up to 600)
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub save_every: Option<Duration>,
    /// How progress is shown
    #[arg(long, value_enum, default_value_t = Show::Auto)]
    pub progress: Show,
}

/// Reads a time.
fn seconds(text: &str) -> Result<Duration, String> {
    let time = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| "allowed: a number of seconds, 0 or more".to_owned())
}

impl Options {
    /// What the folder is to be opened as. With `cases` their number was asked for.
    ///
    /// # Errors
    /// Usage: another instruction set, an environment that names no part, a new folder that exists.
    pub fn opening(&self, folder: &Path, cases: bool) -> Result<(Opening, Access), Error> {
        let here = maker::instruction_set();
        if let Some(isa) = self.isa.as_deref().filter(|isa| *isa != here) {
            return Err(Error::Usage(format!(
                "--isa: found {isa}; allowed: {here}, this machine's"
            )));
        }
        let part = match (self.shard, self.shard_from_env) {
            (Some(part), _) => Some(part),
            (None, true) => {
                #[expect(clippy::disallowed_methods, reason = "the scheduler says it there")]
                let get = |name: &str| std::env::var(name).ok();
                let part = part::from_environment(get, self.shards);
                Some(part.map_err(|e| Error::Usage(format!("--shard-from-env: {e}")))?)
            }
            (None, false) => None,
        };
        let opening = match (part, self.resume, self.extend) {
            (_, _, Some(more)) => Opening::Extend(more),
            (None, false, None) => {
                refuse_existing(folder)?;
                Opening::New
            }
            _ => Opening::Resume { cases },
        };
        Ok((opening, part.map_or(Access::Whole, Access::Part)))
    }

    /// The pool of threads.
    ///
    /// # Errors
    /// Usage: the system gives no such number.
    pub fn pool(&self) -> Result<(Pool, usize), Error> {
        let jobs = self.jobs.map_or_else(processors, usize::from);
        let pool = Pool::new(jobs).map_err(|e| Error::Usage(format!("--jobs {jobs}: {e}")))?;
        Ok((pool, jobs))
    }
}

/// Refuses a folder that exists, and says how to go on with a run.
fn refuse_existing(folder: &Path) -> Result<(), Problems> {
    files::refuse_existing(folder).map_err(|mut problems| {
        if folder.join(crate::io::store::STARTED).exists() {
            for problem in &mut problems.0 {
                "an unfinished run".clone_into(&mut problem.found);
                "a new name, or --resume to go on with it".clone_into(&mut problem.allowed);
            }
        }
        problems
    })
}

/// Number of processors that the program may use.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// Says on the standard error what was mended as a run's folder was opened.
pub fn say_mended(results: &Results) {
    for mended in &results.store().mended {
        super::say(mended);
    }
}

/// Evaluates `spans` into `results`; what is evaluated is on the disk when it returns.
///
/// # Errors
/// A signal, a disk that is full or gone: with the command that goes on.
pub fn evaluate(
    results: Results,
    definition: &Definition,
    spans: &[Span],
    pool: &Pool,
    mut shown: Shown,
    interrupt: &Interrupt,
    evaluate: impl Fn(usize, u64) -> Record + Sync,
) -> Result<Results, Error> {
    let before = cases_of(&results.store().spans()) - cases_of(&results.store().missing());
    shown.begin(cases_of(spans));
    let shown = RefCell::new(shown);
    let results = RefCell::new(results);
    let progress = pool.run(
        definition,
        spans,
        evaluate,
        |record| {
            let mut results = results.borrow_mut();
            results.push(record)?;
            if shown.borrow_mut().due() { results.checkpoint() } else { Ok(()) }
        },
        |done| {
            if let Some(told) = shown.borrow_mut().show(done) {
                results.borrow_mut().tell(told);
            }
        },
        interrupt.stop(),
    );
    shown.borrow().clear();
    let mut results = results.into_inner();
    let finished = progress.and_then(|progress| results.checkpoint().map(|()| progress));
    let kept = cases_of(&results.store().spans()) - cases_of(&results.store().missing());
    match finished {
        Ok(Progress { done, total, .. }) if done < total => {
            let all = cases_of(&results.store().spans());
            let after = format!("after {} of {all} cases", before + done);
            Err(stopped(interrupt, &after, kept > 0))
        }
        Ok(_) => Ok(results),
        Err(problems) => {
            if kept > 0 {
                super::say(format_args!("{kept} cases are kept; {}", go_on()));
            }
            Err(problems.into())
        }
    }
}

fn cases_of(spans: &[Span]) -> u64 {
    spans.iter().map(|span| span.cases.end - span.cases.start).sum()
}

/// The end of a run that a signal stopped.
pub fn stopped(interrupt: &Interrupt, after: &str, kept: bool) -> Error {
    let rest = if kept { go_on() } else { "nothing is kept of the run".to_owned() };
    Error::Stopped { message: format!("stopped {after}; {rest}"), code: interrupt.code() }
}

/// The command that goes on with what this one began.
fn go_on() -> String {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    if let Some(at) = words.iter().position(|word| word.starts_with("--extend")) {
        let with_value = usize::from(words[at] == "--extend");
        words.drain(at..(at + 1 + with_value).min(words.len()));
    }
    let begins = words.first().is_some_and(|word| word == "run");
    if begins && !words.iter().any(|word| word == "--resume" || word.starts_with("--shard")) {
        words.push("--resume".to_owned());
    }
    let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    format!("go on with: tvse {}", words.join(" "))
}

/// A word as a shell takes it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Ends a part: its cases are there, the tables are not made.
///
/// # Errors
/// Output that cannot be written.
pub fn end_part(results: &Results, part: Part, out: &mut dyn Write) -> Result<u8, Error> {
    let store = results.store();
    let Part { number, of } = part;
    let cases = cases_of(&store.spans());
    let left = cases_of(&pool::spans(&store.outline().definition.populations))
        - store.segments().iter().map(|s| s.span.cases.end - s.span.cases.start).sum::<u64>();
    writeln!(out, "shard {number}/{of}: {cases} cases evaluated, {left} of the run are left")?;
    if left == 0 {
        writeln!(out, "make the tables with: tvse merge {}", store.folder().display())?;
    }
    Ok(PASS)
}

/// Makes the tables, prints the story and holds the run against its gates.
///
/// # Errors
/// A disk that is full or gone, damaged shards, problems of the gate file.
pub fn finish(
    results: Results,
    jobs: usize,
    title: &str,
    gates: Option<Gates<'_>>,
    out: &mut dyn Write,
) -> Result<u8, Error> {
    let folder = results.store().folder().to_owned();
    if results.store().is_finished() {
        drop(results);
        let run = Run::open(&folder)?;
        let summary = summarise::summary(&run, summarise::MEMORY)?;
        let worst = summarise::worst(&run, 1)?;
        write!(out, "{title}\n{}", story::story(run.outline(), &summary, &worst))?;
        return end(&run, gates, &folder, out);
    }
    let cases = cases_of(&results.store().spans());
    let kept = |_: &_| super::say(format_args!("{cases} cases are kept; {}", go_on()));
    let finished = results.finish(jobs, WORST).inspect_err(kept)?;
    let outline = finished.run.outline();
    write!(out, "{title}\n{}", story::story(outline, &finished.summary, &finished.worst))?;
    end(&finished.run, gates, &folder, out)
}

/// What feedback adds, where the run compares variants with and without.
///
/// # Errors
/// Damage in the table.
pub fn feedback(run: &Run) -> Result<String, Error> {
    Ok(report::feedback::text(run.outline(), &io::feedback::added(run)?))
}

fn end(
    run: &Run,
    gates: Option<Gates<'_>>,
    folder: &Path,
    out: &mut dyn Write,
) -> Result<u8, Error> {
    write!(out, "{}", feedback(run)?)?;
    for (table, content) in run.contents() {
        writeln!(out, "{}: {} rows", run.path(table).display(), content.rows)?;
    }
    match gates {
        Some((gates, outputs)) => {
            gate::judge(run, &Judged { folder, gates, outputs, prefix: "" }, out)
        }
        None => Ok(PASS),
    }
}

/// Opens the run's folder for a campaign, says what was mended, evaluates what is missing and ends
/// the part or the run.
///
/// # Errors
/// As [`evaluate`] and [`finish`].
pub fn carry_out(
    campaign: &Campaign<'_>,
    options: &Options,
    (pool, jobs): (&Pool, usize),
    interrupt: &Interrupt,
    mut results: Results,
    case: impl Fn(usize, u64) -> Record + Sync,
    out: &mut dyn Write,
) -> Result<u8, Error> {
    say_mended(&results);
    if jobs > 1 {
        results.write_aside();
    }
    let missing = results.store().missing();
    let definition = results.store().outline().definition.clone();
    let shown = Shown::new(options.progress, options.save_every);
    let results = evaluate(results, &definition, &missing, pool, shown, interrupt, case)?;
    match campaign.access {
        Access::Part(part) => end_part(&results, part, out),
        Access::Whole => finish(results, jobs, campaign.title, campaign.gates, out),
    }
}

/// What a campaign is beside its cases.
pub struct Campaign<'a> {
    /// Whole or part.
    pub access: Access,
    /// First line of what is printed.
    pub title: &'a str,
    /// Gates.
    pub gates: Option<Gates<'a>>,
}

/// The file of the gates and where their outcomes go.
pub type Gates<'a> = (&'a Path, &'a gate::Outputs);

/// Checks the gates of a campaign before its first case.
///
/// # Errors
/// All problems of the gate file.
pub fn check_gates(gates: Option<&Path>, outline: &Outline) -> Result<(), Error> {
    gates.map_or(Ok(()), |gates| gate::rules(gates, outline).map(|_| ()))
}
