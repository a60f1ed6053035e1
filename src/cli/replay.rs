//! `tvse replay`: rebuilds one case of a finished run and compares it with what is stored.

use super::{Error, FAIL, PASS};
use crate::campaign::row::{self, ModeRow};
use crate::campaign::{Evaluator, StoredPoles};
use crate::io::replay::Replay;
use crate::io::{Run, inputs};
use crate::report;
use crate::spelling::allowed_instead;
use std::io::Write;
use std::path::{Path, PathBuf};

/// One case of a finished run, rebuilt from the inputs stored with the run and its seed alone.
///
/// Writes the matrices M, D, K and A with their state names, the poles and the eigenvectors, and
/// compares draws and poles with the stored rows bit for bit. Exit code 1 if they differ.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse replay runs/reference --case 17
  tvse replay runs/reference --worst jet_damping_tvse_box")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Case index inside its population
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        required = false,
        required_unless_present = "worst",
        default_value_if("worst", clap::builder::ArgPredicate::IsPresent, "0")
    )]
    case: u64,
    /// Name of a case that `tvse worst` found, instead
    #[arg(long, value_name = "NAME", conflicts_with_all = ["case", "population"])]
    worst: Option<String>,
    /// Population of the case
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Folder of the replay (default: replay/POPULATION-N in the run's folder, where an older replay
    /// is replaced)
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace an older replay in that folder
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// No such run, case or population; damaged tables or inputs; output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let stored = Run::open(&args.run)?;
    let outline = stored.outline();
    let definition = &outline.definition;
    if let Some(name) = &args.worst {
        let loaded = inputs::read(&args.run, &outline.inputs)?;
        let target = (args.output.as_deref(), args.force);
        return super::worst::replay(&args.run, name, (&stored, &loaded), target, out);
    }
    let names = || definition.populations.iter().map(|p| p.name.as_str());
    let Some(population) = names().position(|name| name == args.population) else {
        let allowed = allowed_instead(&args.population, names());
        let found = &args.population;
        return Err(Error::Usage(format!("--population: found \"{found}\"; allowed: {allowed}")));
    };
    let cases = definition.populations[population].cases;
    if args.case >= cases {
        let found = args.case;
        return Err(Error::Usage(format!("--case: found {found}; allowed: below {cases}")));
    }

    let loaded = inputs::read(&args.run, &outline.inputs)?;

    let sampler = loaded.sampler(definition)?;
    let all = outline.poles == StoredPoles::All;
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, definition, all)
        .map_err(|error| super::run::unprepared(Path::new(&loaded.run.0), &error))?;
    let mut replay = Replay::default();
    let mut unsolved = Vec::new();
    let record = evaluator.visit(population, args.case, |view| {
        if let Err(failure) = replay.add(definition, view) {
            unsolved.push(failure.to_string());
        }
    });
    let name = format!("{}-{}", args.population, args.case);
    let target = args.output.clone().unwrap_or_else(|| args.run.join("replay").join(name));
    let files = replay.write(&target, args.force || args.output.is_none())?;

    writeln!(out, "{}\n{}", vehicle.name, report::nominal::table(definition, &record))?;
    for failure in unsolved {
        writeln!(out, "not solved: {failure}")?;
    }
    for file in files {
        writeln!(out, "{}", file.display())?;
    }
    let (case, modes) = row::rows(definition, record);
    let mut rows: Vec<ModeRow> = Vec::new();
    stored.modes(population, args.case..args.case + 1, |row| {
        rows.push(row);
        Ok(())
    })?;
    let draws = stored.draws(population, [args.case])?;
    let same_draws = draws.get(&args.case).is_some_and(|stored| {
        same(&stored.values, &case.values) && same(&stored.scores, &case.scores)
    });
    let differing = rows.iter().zip(&modes).filter(|(a, b)| a != b).count();
    if same_draws && rows.len() == modes.len() && differing == 0 {
        writeln!(
            out,
            "{} draws and {} rows are bit for bit as stored",
            case.values.len(),
            rows.len()
        )?;
        return Ok(PASS);
    }
    let draws = if same_draws { "as stored" } else { "different from the stored ones" };
    writeln!(
        out,
        "draws are {draws}; {differing} of {} rows differ from those stored ({} stored). Bits are \
         kept by one program on one instruction set: see manifest.json",
        modes.len(),
        rows.len()
    )?;
    Ok(FAIL)
}

/// Equal bit for bit.
fn same(a: &[Option<f64>], b: &[Option<f64>]) -> bool {
    let bits = |v: &[Option<f64>]| v.iter().map(|v| v.map(f64::to_bits)).collect::<Vec<_>>();
    bits(a) == bits(b)
}
