//! `tvse model`: the state space of one case.

use super::{Error, PASS};
use crate::campaign::{Definition, Evaluator, FailureKind};
use crate::dispersion::Sampler;
use crate::io::model::{self, Format};
use crate::io::{self, Run, inputs};
use crate::modal::realisation::Realisation;
use crate::spelling::allowed_instead;
use std::io::Write;
use std::path::{Path, PathBuf};

/// State space of one case of a run, with named inputs, outputs and states.
///
/// Writes the tables `state_space` (A, B, C, D) and `names`. Inputs are the commands of the axes and of
/// the gimbals, rad, and load torques on the gimbals, N·m; outputs are the sensors of the autopilot, the
/// gimbal rotations and their rates, and in a closed loop the feedback of each axis. RUN is the folder of
/// a finished run, whose stored inputs are taken, or a run definition.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse model runs/reference --case 17 --variant jet_damping --time 105 -o model
  tvse model runs/reference.toml --population nominal --variant jet_damping --time 105 \\
             --format csv -o model")]
pub struct Args {
    /// Folder of a run, or a run definition
    run: PathBuf,
    /// Case index inside its population
    #[arg(long, value_name = "N", default_value_t = 0)]
    case: u64,
    /// Population of the case
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Variant of the run
    #[arg(long, value_name = "NAME")]
    variant: String,
    /// Flight time, s
    #[arg(long, value_name = "TIME")]
    time: f64,
    /// Folder of the tables
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Format of the tables
    #[arg(long, value_enum, default_value_t = FormatArg::Parquet)]
    format: FormatArg,
    /// Replace older tables in that folder
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    outside: super::outside::Args,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FormatArg {
    /// Parquet
    Parquet,
    /// Comma-separated values
    Csv,
}

/// Runs the command.
///
/// # Errors
/// No such run, case, population, variant or time; inputs that are wrong; output that cannot be
/// written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let (loaded, definition) = if args.run.is_file() {
        let loaded = io::scenario::load(&args.run, args.outside.reach())?;
        if let Some(corner) = loaded.corners.iter().find(|c| args.population.starts_with(&c.name)) {
            return Err(Error::Usage(format!(
                "--population: found \"{}\"; allowed: one without evaluated signs, or the folder of a finished run",
                corner.name
            )));
        }
        let definition = loaded.definition.clone();
        (loaded, definition)
    } else {
        let stored = Run::open(&args.run)?;
        let outline = stored.outline();
        (inputs::read(&args.run, &outline.inputs)?, outline.definition.clone())
    };
    let populations = || definition.populations.iter().map(|p| p.name.as_str());
    let population = choose("--population", &args.population, populations().collect())?;
    let cases = definition.populations[population].cases;
    if args.case >= cases {
        let found = args.case;
        return Err(Error::Usage(format!("--case: found {found}; allowed: below {cases}")));
    }
    let names = definition.variants.iter().map(|v| v.name.as_str()).collect();
    let variant = choose("--variant", &args.variant, names)?;
    if !definition.flight_times_s.contains(&args.time) {
        let (found, known) = (args.time, &definition.flight_times_s);
        return Err(Error::Usage(format!("--time: found {found}; allowed: one of {known:?}")));
    }
    // One draw is the same whatever is evaluated.
    let definition = Definition {
        flight_times_s: vec![args.time],
        variants: vec![definition.variants[variant].clone()],
        modes: Vec::new(),
        sensitivity: None,
        ..definition
    };
    let sampler = Sampler::new(&loaded.dispersion, definition.seed);
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false)
        .map_err(|error| super::run::unprepared(Path::new(&loaded.run.0), &error))?;
    let mut found = Err("not evaluated".to_owned());
    evaluator.visit(population, args.case, |view| {
        found = match &view.evaluation.outcome {
            // A model that could be made is written, even if its poles could not be found.
            Err(failure) if matches!(failure.kind, FailureKind::Draw | FailureKind::Build) => {
                Err(failure.to_string())
            }
            _ => Realisation::of(view.plant, view.drawn, view.model).map_err(|e| e.to_string()),
        };
    });
    let realisation = found.map_err(Error::Usage)?;
    let format = match args.format {
        FormatArg::Parquet => Format::Parquet,
        FormatArg::Csv => Format::Csv,
    };
    let files = model::write(&args.output, &realisation, format, args.force)?;
    let system = &realisation.system;
    writeln!(
        out,
        "{}\n{} states, {} inputs, {} outputs",
        vehicle.name,
        system.order(),
        system.inputs(),
        system.outputs()
    )?;
    for file in files {
        writeln!(out, "{}", file.display())?;
    }
    Ok(PASS)
}

/// Index of a name.
fn choose(option: &str, name: &str, known: Vec<&str>) -> Result<usize, Error> {
    known.iter().position(|k| *k == name).ok_or_else(|| {
        let allowed = allowed_instead(name, known.iter().copied());
        Error::Usage(format!("{option}: found \"{name}\"; allowed: {allowed}"))
    })
}
