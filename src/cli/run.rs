//! `tvse run`: the campaign.

use super::campaign::{self, Campaign, Options};
use super::interrupt::Interrupt;
use super::{Error, FAIL};
use crate::campaign::audit;
use crate::campaign::definition::{MOST_CASES, Solver};
use crate::campaign::evaluator::Evaluator;
use crate::campaign::{Outline, Pool, StoredPoles, corner, outline::DrawColumn};
use crate::io::inputs::Inputs;
use crate::io::{self, Results};
use crate::problem::Problems;
use crate::report;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A campaign: draws, solves and stores every case of a run, and prints its story.
///
/// Results go to a new folder, by default beside the run file and with its name. They are written
/// in shards as cases are evaluated: a run that was stopped, killed or ran out of disk goes on with
/// `--resume`. With `--shard` several processes or machines share the cases, and `tvse merge` makes
/// the tables; they have the same bytes in any case.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse run runs/reference.toml
  tvse run runs/reference.toml --cases 200 --output /tmp/quick --jobs 4
  tvse run runs/reference.toml --resume
  tvse run runs/reference.toml --extend 1000
  tvse run runs/reference.toml --audit 20
  tvse run runs/reference.toml --shard 3/8")]
pub struct Args {
    /// The run definition
    run: PathBuf,
    /// Folder of the results; it must not exist unless the run goes on
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
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
    #[command(flatten)]
    outputs: super::gate::Outputs,
    /// Poles stored in the `modes` table
    #[arg(long, value_enum, default_value_t = Poles::Named)]
    poles: Poles,
    /// How poles are found: from the nominal ones with a certificate (dense where there is none), or every
    /// case by a dense solve
    #[arg(long, value_enum, default_value_t = SolverName::Structured)]
    solver: SolverName,
    /// Solve N cases, chosen by the seed, both ways before the run, and fail it where they disagree beyond
    /// their bounds
    #[arg(long, value_name = "N", default_value_t = 0)]
    audit: u64,
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    outside: super::outside::Args,
}

/// Which poles the `modes` table holds.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Poles {
    /// Those of the modes of interest
    Named,
    /// Every pole of every evaluation
    All,
}

/// How poles are found.
#[derive(Clone, Copy, clap::ValueEnum)]
enum SolverName {
    /// From the nominal poles, certified
    Structured,
    /// Every case by itself
    Dense,
}

/// Runs the command.
///
/// # Errors
/// All problems of the run and what it names; an output folder that exists or cannot be written; a
/// signal that asks to stop. Then what is evaluated is kept.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let mut loaded = io::scenario::load(&args.run, args.outside.reach())?;
    let folder = args.output.clone().unwrap_or_else(|| args.run.with_extension(""));
    let (opening, access) = args.options.opening(&folder, args.cases.is_some())?;
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
    definition.solver = match args.solver {
        SolverName::Structured => Solver::Structured,
        SolverName::Dense => Solver::Dense,
    };
    let (pool, jobs) = args.options.pool()?;
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
    // A plan that does not fit is refused before anything is made.
    loaded.sampler(&outline.definition)?;
    campaign::check_gates(args.gates.as_deref(), &outline)?;
    let results = Results::open(&folder, outline, Some(&inputs), opening, access)?;
    let definition = results.store().outline().definition.clone();
    let sampler = loaded.sampler(&definition)?;
    if args.audit > 0 {
        let cases = audit::choose(&results.store().spans(), args.audit, definition.seed);
        let audit = audit::audit(vehicle, &sampler, &definition, &cases)
            .map_err(|error| unprepared(&args.run, &error))?;
        write!(out, "{}", report::audit::text(&audit))?;
        if !audit.disagreements.is_empty() {
            return Ok(FAIL);
        }
    }
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, poles == StoredPoles::All)
        .map_err(|error| unprepared(&args.run, &error))?;
    let gates = args.gates.as_deref().map(|gates| (gates, &args.outputs));
    let campaign = Campaign { access, title: &vehicle.name, gates };
    let case = |population, case| evaluator.evaluate(population, case);
    campaign::carry_out(&campaign, &args.options, (&pool, jobs), &interrupt, results, case, out)
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
            corner::Error::Stopped => campaign::stopped(interrupt, "before the first case", false),
            error => unprepared(run_file, &error),
        })?;
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
