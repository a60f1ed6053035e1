//! `tvse run`: the campaign.

use super::interrupt::Interrupt;
use super::{Error, PASS, gate, progress};
use crate::campaign::definition::MOST_CASES;
use crate::campaign::evaluator::Evaluator;
use crate::campaign::{Outline, Pool, Progress, StoredPoles, corner, outline::DrawColumn, pool};
use crate::io::inputs::Inputs;
use crate::io::{self, Results};
use crate::problem::Problems;
use crate::report::story;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Most threads: more would not help, and a mistyped number not stop the machine.
const MOST_JOBS: i64 = 1024;
/// Worst cases stored for each population, variant and mode.
const WORST: usize = 10;

/// A campaign: draws, solves and stores every case of a run, and prints its story.
///
/// Results go to a new folder, by default beside the run file and with its name.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse run runs/reference.toml
  tvse run runs/reference.toml --cases 200 --output /tmp/quick --jobs 4")]
pub struct Args {
    /// The run definition
    run: PathBuf,
    /// Folder of the results; it must not exist
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Threads (default: all processors); results do not depend on it
    #[arg(long, short, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u16).range(1..=MOST_JOBS))]
    jobs: Option<u16>,
    /// Cases of every drawn population, instead of the run definition's
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(1..=MOST_CASES))]
    cases: Option<u64>,
    /// Seed, instead of the run definition's
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Gates to hold the results against; the exit code is theirs (see `tvse gate`)
    #[arg(long, value_name = "FILE")]
    gates: Option<PathBuf>,
    /// Poles stored in the `modes` table
    #[arg(long, value_enum, default_value_t = Poles::Named)]
    poles: Poles,
}

/// Which poles the `modes` table holds.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Poles {
    /// Those of the modes of interest
    Named,
    /// Every pole of every evaluation
    All,
}

/// Runs the command.
///
/// # Errors
/// All problems of the run and what it names; an output folder that exists or cannot be written; a
/// signal that asks to stop. Then nothing is left behind.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let mut loaded = io::scenario::load(&args.run)?;
    let folder = args.output.clone().unwrap_or_else(|| args.run.with_extension(""));
    io::files::refuse_existing(&folder)?;
    let definition = &mut loaded.definition;
    if let Some(cases) = args.cases {
        if let Some(p) = definition.populations.iter().find(|p| p.scheme.has_own_cases()) {
            let message = format!("--cases: the plan ({}) has its own number", p.scheme.describe());
            return Err(Error::Usage(message));
        }
        definition.set_cases(cases);
    }
    if let Some(seed) = args.seed {
        definition.seed = seed;
    }
    let jobs = args.jobs.map_or_else(processors, usize::from);
    let pool = Pool::new(jobs).map_err(|e| Error::Usage(format!("--jobs {jobs}: {e}")))?;
    let inputs = Inputs::of(&loaded)?;
    let interrupt = Interrupt::listen().map_err(|e| Error::Usage(format!("signals: {e}")))?;
    fix_corners(&mut loaded, &pool, &args.run, &interrupt)?;

    let vehicle = &loaded.vehicle.vehicle;
    let poles = match args.poles {
        Poles::Named => StoredPoles::Named,
        Poles::All => StoredPoles::All,
    };
    let draws = loaded.dispersion.draws().iter().map(DrawColumn::of).collect();
    let outline = Outline::new(loaded.definition.clone(), poles, draws, inputs.digests());
    if let Some(gates) = &args.gates {
        gate::rules(gates, &outline)?;
    }
    let sampler = loaded.sampler(&loaded.definition)?;
    let mut results = Results::create(&folder, outline)?;
    inputs.write(&folder)?;
    let all = poles == StoredPoles::All;
    let evaluator = Evaluator::new(vehicle, &sampler, &loaded.definition, all)
        .map_err(|error| unprepared(&args.run, &error))?;
    let spans = pool::spans(&loaded.definition.populations);
    let bar = progress::bar(spans.iter().map(|span| span.cases.end).sum());
    let progress = pool.run(
        &loaded.definition,
        &spans,
        |population, case| evaluator.evaluate(population, case),
        |record| results.push(record),
        |done| progress::show(&bar, done),
        interrupt.stop(),
    )?;
    bar.finish_and_clear();
    if progress.done < progress.total {
        let Progress { done, total, .. } = progress;
        return Err(stopped(&interrupt, &format!("after {done} of {total} cases")));
    }
    let finished = results.finish(jobs, WORST)?;
    write!(
        out,
        "{}\n{}",
        vehicle.name,
        story::story(finished.run.outline(), &finished.summary, &finished.worst)
    )?;
    for (table, content) in finished.run.contents() {
        writeln!(out, "{}: {} rows", finished.run.path(table).display(), content.rows)?;
    }
    match &args.gates {
        Some(gates) => gate::judge(&finished.run, gates, &folder.join("gates.json"), out),
        None => Ok(PASS),
    }
}

/// Chooses the sides of corners whose signs are to be evaluated.
fn fix_corners(
    loaded: &mut io::scenario::Loaded,
    pool: &Pool,
    run_file: &Path,
    interrupt: &Interrupt,
) -> Result<(), Error> {
    for corner in &loaded.corners {
        let fixed = corner::adverse_sides(
            &loaded.vehicle.vehicle,
            &loaded.dispersion,
            &loaded.definition,
            &corner.draws,
            (corner.mode, corner.variant),
            pool,
            interrupt.stop(),
        )
        .map_err(|error| match error {
            corner::Error::Stopped => stopped(interrupt, "before the first case"),
            error => unprepared(run_file, &error),
        })?;
        let open: Vec<usize> = corner.populations(&loaded.definition.populations).collect();
        for population in open {
            loaded.definition.populations[population].fixed.clone_from(&fixed);
        }
    }
    Ok(())
}

/// The end of a run that a signal stopped.
fn stopped(interrupt: &Interrupt, after: &str) -> Error {
    let message = format!("stopped {after}; nothing is kept of the run");
    Error::Stopped { message, code: interrupt.code() }
}

/// The problem of a scenario that reads well but whose nominal vehicle cannot be evaluated.
pub fn unprepared(run_file: &Path, error: &dyn std::error::Error) -> Error {
    let allowed = "a vehicle that can be evaluated";
    Problems::input(run_file.display().to_string(), "", error.to_string(), allowed).into()
}

/// Number of processors that the program may use.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}
