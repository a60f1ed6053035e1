//! `tvse submit`: hands a campaign to a scheduler that is there already.
//!
//! It writes scripts and calls the scheduler's own commands; what the jobs do are commands that a
//! user can call as well.

#![expect(clippy::disallowed_methods, reason = "the timing probe reads the clock")]

use super::{Error, PASS, campaign};
use crate::campaign::Evaluator;
use crate::dispersion::Sampler;
use crate::io::{self, files, store};
use crate::problem::Problems;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// Longest time spent on the timing probe once a case is evaluated.
const PROBE: Duration = Duration::from_secs(3);
/// Most cases of the probe.
const MOST_PROBED: u64 = 32;
/// Most tasks of an array that Slurm takes unless it is told otherwise (`MaxArraySize` 1001).
const MOST_TASKS: u64 = 1000;
/// Most threads of a task that are chosen without being asked for: nodes of that size are free soon.
const MOST_THREADS: u64 = 8;

/// Scheduler.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Engine {
    /// Slurm: job array, dependent jobs
    Slurm,
}

/// Submits a campaign as a job array, and dependent jobs that merge it, sum it up and gate it.
///
/// Number of shards and threads follow from a timing probe of a few cases. Scripts, logs and job
/// numbers go to a folder beside the results (OUTPUT.jobs). The machines must see the same files.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse submit runs/reference.toml --engine slurm --dry-run
  tvse submit runs/reference.toml --engine slurm --gates runs/reference.gates.toml \\
              --sbatch=--partition=long
  tvse submit runs/reference.toml --engine slurm --status
  tvse submit runs/reference.toml --engine slurm --missing      # what was lost, again")]
pub struct Args {
    /// The run definition
    run: PathBuf,
    /// The scheduler
    #[arg(long, value_enum)]
    engine: Engine,
    /// Folder of the results (default: beside the run file and with its name)
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Gates for the last job
    #[arg(long, value_name = "FILE")]
    gates: Option<PathBuf>,
    /// Cases of every drawn population, instead of the run definition's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    cases: Option<u64>,
    /// Number of shards, instead of the probe's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MOST_TASKS))]
    shards: Option<u64>,
    /// Threads of a task, instead of the probe's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1024))]
    threads: Option<u64>,
    /// Time that a task should take, minutes
    #[arg(long, value_name = "N", default_value_t = 10,
        value_parser = clap::value_parser!(u64).range(1..=10_000))]
    minutes: u64,
    /// A further option for every job, may be repeated: --sbatch=--account=me
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Prints scripts and commands; nothing is written or submitted
    #[arg(long)]
    dry_run: bool,
    /// Submits the tasks whose cases are missing, and the dependent jobs, again
    #[arg(long, conflicts_with = "status")]
    missing: bool,
    /// Shows the state of the jobs and of the run
    #[arg(long)]
    status: bool,
    #[command(flatten)]
    outside: super::outside::Args,
}

/// What is remembered of a submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Submitted {
    /// Shards of the campaign.
    shards: u64,
    /// Threads of a task.
    threads: u64,
    /// Limit of a task, minutes.
    limit_min: u64,
    /// Job numbers: name and number, the latest last.
    jobs: Vec<(String, String)>,
}

/// Runs the command.
///
/// # Errors
/// All problems of the run, a scheduler that is not there or refuses, a folder that cannot be
/// written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let Engine::Slurm = args.engine;
    let output = args.output.clone().unwrap_or_else(|| args.run.with_extension(""));
    let output = files::absolute(&output)?;
    let mut folder = output.clone().into_os_string();
    folder.push(".jobs");
    let folder = PathBuf::from(folder);
    let remembered = folder.join("submitted.json");
    if args.status {
        let submitted = read(&remembered)?;
        return status(&submitted, &output, out);
    }
    let (mut submitted, tasks) = if args.missing {
        let submitted = read(&remembered)?;
        let left = left(&output, submitted.shards)?;
        (submitted, left)
    } else {
        let submitted = plan(args, out)?;
        let tasks = (1..=submitted.shards).collect();
        (submitted, tasks)
    };
    let scripts = Scripts { args, output: &output, folder: &folder, submitted: &submitted };
    let scripts = scripts.all(&tasks)?;
    if args.dry_run {
        for Script { name, text, after } in &scripts {
            let after = after.map_or(String::new(), |after| format!("    # after {after}"));
            writeln!(out, "\n==> {} {after}\n{text}", folder.join(name).display())?;
        }
        return Ok(PASS);
    }
    if !args.missing {
        files::refuse_existing(&output)?;
    }
    files::ensure_folder(&folder)?;
    let mut numbers: Vec<(&str, String)> = Vec::new();
    for Script { name, text, after } in &scripts {
        let path = folder.join(name);
        files::write(&path, text.as_bytes())?;
        let mut command = Command::new("sbatch");
        command.arg("--parsable").args(&args.sbatch);
        let before = after.and_then(|after| numbers.iter().find(|(name, _)| *name == after));
        if let Some((_, number)) = before {
            command.arg(format!("--dependency=afterok:{number}"));
            command.arg("--kill-on-invalid-dep=yes");
        }
        let said = said(command.arg(&path))?;
        // With several clusters: number;cluster.
        let number = said.trim().split(';').next().unwrap_or_default().to_owned();
        writeln!(out, "{name}: job {number}")?;
        submitted.jobs.push(((*name).to_owned(), number.clone()));
        numbers.push((name, number));
        let text = serde_json::to_string_pretty(&submitted).expect("text keys only");
        files::write(&remembered, text.as_bytes())?;
    }
    let run = args.run.display();
    writeln!(out, "see: tvse submit {run} --engine slurm --output {} --status", output.display())?;
    Ok(PASS)
}

/// Shards and threads from a timing probe.
fn plan(args: &Args, out: &mut dyn Write) -> Result<Submitted, Error> {
    let mut loaded = io::scenario::load(&args.run, args.outside.reach())?;
    if let Some(cases) = args.cases {
        loaded.definition.set_cases(cases);
    }
    let definition = &loaded.definition;
    let cases: u64 = definition.populations.iter().map(|p| p.cases).sum();
    let sampler = Sampler::new(&loaded.dispersion, definition.seed);
    let evaluator = Evaluator::new(&loaded.vehicle.vehicle, &sampler, definition, false)
        .map_err(|error| super::run::unprepared(&args.run, &error))?;
    let drawn = definition.populations.iter().position(|p| p.drawn).unwrap_or_default();
    let most = MOST_PROBED.min(definition.populations[drawn].cases).max(1);
    let begun = Instant::now();
    let mut probed = 0;
    while probed < most && (probed == 0 || begun.elapsed() < PROBE) {
        evaluator.evaluate(drawn, probed);
        probed += 1;
    }
    let case_s = begun.elapsed().as_secs_f64() / probed as f64;
    let (shards, threads) = choose(cases, case_s, args.minutes as f64 * 60.0);
    let (shards, threads) = (args.shards.unwrap_or(shards), args.threads.unwrap_or(threads));
    let task_s = case_s * cases as f64 / (shards * threads) as f64;
    // Other machines may be slower, and share their memory.
    let limit_min = (3.0 * task_s / 60.0).ceil() as u64 + 10;
    writeln!(
        out,
        "{cases} cases of {case_s:.3} s ({probed} probed): {shards} shards on {threads} threads, \
         about {} each",
        super::progress::duration(task_s)
    )?;
    Ok(Submitted { shards, threads, limit_min, jobs: Vec::new() })
}

/// Number of shards and threads of a task for so many cases of `case_s` seconds each, so that a
/// task takes about `task_s`: first more threads, then more tasks.
fn choose(cases: u64, case_s: f64, task_s: f64) -> (u64, u64) {
    let tasks = case_s * cases as f64 / task_s;
    let threads = (tasks.ceil() as u64).clamp(1, MOST_THREADS);
    let shards = (tasks / threads as f64).ceil() as u64;
    (shards.clamp(1, cases.clamp(1, MOST_TASKS)), threads)
}

fn read(path: &Path) -> Result<Submitted, Error> {
    let text = files::read_text(path)?;
    let damaged = |e: serde_json::Error| {
        Problems::damage(files::name(path), "", e.to_string(), "what was submitted")
    };
    Ok(serde_json::from_str(&text).map_err(damaged)?)
}

/// Numbers of the shards that have cases left.
fn left(output: &Path, shards: u64) -> Result<Vec<u64>, Error> {
    // Before the first task has begun there is no folder, and everything is missing.
    if !output.exists() {
        return Ok((1..=shards).collect());
    }
    Ok(store::status(output, true)?.parts_left(shards))
}

/// A job's script.
struct Script {
    name: &'static str,
    text: String,
    /// The script whose job has to end well before.
    after: Option<&'static str>,
}

struct Scripts<'a> {
    args: &'a Args,
    output: &'a Path,
    folder: &'a Path,
    submitted: &'a Submitted,
}

impl Scripts<'_> {
    /// The scripts of all jobs; the array has these tasks, and is left out if there are none.
    fn all(&self, tasks: &[u64]) -> Result<Vec<Script>, Error> {
        let program = std::env::current_exe()
            .map_err(|source| Error::File { path: "the running program".to_owned(), source })?;
        let program = quoted(&program);
        let run = quoted(&files::absolute(&self.args.run)?);
        let output = quoted(self.output);
        let Submitted { shards, threads, limit_min, .. } = self.submitted;
        let mut scripts = Vec::new();
        if !tasks.is_empty() {
            let cases = self.args.cases.map_or(String::new(), |cases| format!(" --cases {cases}"));
            let outside = match self.args.outside.reach() {
                io::scenario::Reach::Study => "",
                io::scenario::Reach::Anywhere => " --allow-outside",
            };
            let options = [
                format!("--array={}", ranges(tasks)),
                format!("--cpus-per-task={threads}"),
                format!("--time={limit_min}"),
                // Before its time is up a task is told to write down what it has.
                "--signal=B:TERM@60".to_owned(),
            ];
            let command = format!(
                "{program} run {run} --output {output} --jobs {threads}{cases}{outside} \
                 --shard-from-env --shards {shards} --progress json"
            );
            scripts.push(self.script("array.sh", &options, &command, None));
        }
        let array = (!tasks.is_empty()).then_some("array.sh");
        let merge = format!("{program} merge {output}");
        scripts.push(self.script("merge.sh", &[], &merge, array));
        let summary = format!("{program} summary {output}");
        scripts.push(self.script("summary.sh", &[], &summary, Some("merge.sh")));
        if let Some(gates) = &self.args.gates {
            let gates = quoted(&files::absolute(gates)?);
            let gate = format!("{program} gate {output} --gates {gates}");
            scripts.push(self.script("gate.sh", &[], &gate, Some("merge.sh")));
        }
        Ok(scripts)
    }

    fn script(
        &self,
        name: &'static str,
        options: &[String],
        command: &str,
        after: Option<&'static str>,
    ) -> Script {
        let stem = name.trim_end_matches(".sh");
        let log = if stem == "array" { "shard-%a.log".to_owned() } else { format!("{stem}.log") };
        let mut text = format!("#!/bin/bash\n#SBATCH --job-name=tvse-{stem}\n");
        text += &format!("#SBATCH --output={}\n", quoted(&self.folder.join(log)));
        for option in options {
            text += &format!("#SBATCH {option}\n");
        }
        text += &format!("exec {command}\n");
        Script { name, text, after }
    }
}

/// Numbers as an array specification: `1-3,7`.
fn ranges(numbers: &[u64]) -> String {
    let mut found: Vec<(u64, u64)> = Vec::new();
    for &number in numbers {
        match found.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => found.push((number, number)),
        }
    }
    let text = |(first, last): &(u64, u64)| {
        if first == last { first.to_string() } else { format!("{first}-{last}") }
    };
    found.iter().map(text).collect::<Vec<_>>().join(",")
}

/// A path that a shell takes as one word, whatever is in it.
fn quoted(path: &Path) -> String {
    campaign::quoted(&path.display().to_string())
}

/// What a command of the scheduler says.
fn said(command: &mut Command) -> Result<String, Error> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|source| Error::File { path: name.clone(), source })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(Error::Usage(format!("{name}: {said}")));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn status(submitted: &Submitted, output: &Path, out: &mut dyn Write) -> Result<u8, Error> {
    for (name, number) in &submitted.jobs {
        let mut command = Command::new("squeue");
        // A number that Slurm has forgotten is an error of squeue, and an end for us.
        let found = said(command.args(["-h", "-r", "-o", "%T", "-j", number])).unwrap_or_default();
        let mut states: Vec<&str> = found.split_whitespace().collect();
        states.sort_unstable();
        let counts: Vec<String> = states
            .chunk_by(|a, b| a == b)
            .map(|same| format!("{} {}", same.len(), same[0].to_lowercase()))
            .collect();
        let state = if counts.is_empty() { "ended".to_owned() } else { counts.join(", ") };
        writeln!(out, "{name}: job {number}: {state}")?;
    }
    let left = left(output, submitted.shards)?;
    let text = if left.is_empty() { "none".to_owned() } else { ranges(&left) };
    writeln!(out, "shards with cases left, of {}: {text}", submitted.shards)?;
    Ok(PASS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_campaign_is_cut_into_tasks_of_the_asked_length() {
        // Seconds of work: one thread, then more threads, then more tasks.
        assert_eq!(choose(100, 0.1, 600.0), (1, 1));
        assert_eq!(choose(36_000, 0.05, 600.0), (1, 3));
        assert_eq!(choose(1_000_000, 0.048, 600.0), (10, 8));
        // Never more tasks than cases, nor than Slurm takes.
        assert_eq!(choose(3, 1e6, 600.0), (3, 8));
        assert_eq!(choose(1_000_000_000, 1.0, 600.0), (1000, 8));
    }

    #[test]
    fn numbers_of_tasks_are_written_in_ranges() {
        assert_eq!(ranges(&[1, 2, 3, 7, 9, 10]), "1-3,7,9-10");
        assert_eq!(ranges(&[4]), "4");
    }

    #[test]
    fn a_path_is_one_word_of_a_shell() {
        assert_eq!(quoted(Path::new("/a/b-1.toml")), "/a/b-1.toml");
        assert_eq!(quoted(Path::new("/a b/$(x)'s")), "'/a b/$(x)'\\''s'");
    }
}
