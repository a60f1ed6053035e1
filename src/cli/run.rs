//! `tvse run`: the campaign.

use super::{Error, PASS, gate, progress};
use crate::campaign::evaluator::Evaluator;
use crate::campaign::{Outline, Pool, StoredPoles, corner, outline::DrawColumn, pool};
use crate::dispersion::Sampler;
use crate::io::{self, Results, inputs};
use crate::problem::Problems;
use crate::report::story;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

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
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Cases of every drawn population, instead of the run definition's
    #[arg(long, value_name = "N")]
    cases: Option<u64>,
    /// Seed, instead of the run definition's
    #[arg(long, value_name = "N")]
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
/// All problems of the run and what it names; an output folder that exists or cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let mut loaded = io::scenario::load(&args.run)?;
    let folder = args.output.clone().unwrap_or_else(|| args.run.with_extension(""));
    if folder.exists() {
        let allowed = "the name of a new folder (see --output)";
        let folder = folder.display().to_string();
        return Err(Problems::input(folder, "", "something that exists", allowed).into());
    }
    if let Some(gates) = &args.gates {
        crate::gate::parse(&io::files::read_text(gates)?, &io::files::name(gates))?;
    }
    let definition = &mut loaded.definition;
    if let Some(cases) = args.cases {
        definition.set_cases(cases);
    }
    if let Some(seed) = args.seed {
        definition.seed = seed;
    }
    let jobs = args.jobs.map_or_else(processors, usize::from);
    let pool = Pool::new(jobs).map_err(|e| Error::Usage(format!("--jobs {jobs}: {e}")))?;
    let (paths, digests) = inputs::of(&loaded)?;
    fix_corners(&mut loaded, &pool, &args.run)?;

    let vehicle = &loaded.vehicle.vehicle;
    let poles = match args.poles {
        Poles::Named => StoredPoles::Named,
        Poles::All => StoredPoles::All,
    };
    let draws = loaded.dispersion.draws().iter().map(DrawColumn::of).collect();
    let outline = Outline::new(loaded.definition.clone(), poles, draws, digests);
    let mut results = Results::create(&folder, outline)?;
    inputs::copy(&paths, &folder)?;
    let sampler = Sampler::new(&loaded.dispersion, loaded.definition.seed);
    let all = poles == StoredPoles::All;
    let evaluator = Evaluator::new(vehicle, &sampler, &loaded.definition, all)
        .map_err(|error| unprepared(&args.run, &error))?;
    let spans = pool::spans(&loaded.definition.populations);
    let bar = progress::bar(spans.iter().map(|span| span.cases.end).sum());
    pool.run(
        &loaded.definition,
        &spans,
        |population, case| evaluator.evaluate(population, case),
        |record| results.push(record),
        |done| progress::show(&bar, done),
        &AtomicBool::new(false),
    )?;
    bar.finish_and_clear();
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
) -> Result<(), Error> {
    for corner in &loaded.corners {
        let fixed = corner::adverse_sides(
            &loaded.vehicle.vehicle,
            &loaded.dispersion,
            &loaded.definition,
            &corner.draws,
            (corner.mode, corner.variant),
            pool,
        )
        .map_err(|error| unprepared(run_file, &error))?;
        let open: Vec<usize> = corner.populations(&loaded.definition.populations).collect();
        for population in open {
            loaded.definition.populations[population].fixed.clone_from(&fixed);
        }
    }
    Ok(())
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
