//! `tvse response`: the full curves of the loops of one case of a finished run.

use super::{Error, PASS};
use crate::campaign::{Evaluator, StoredPoles};
use crate::io::response::Response;
use crate::io::{Run, inputs};
use crate::spelling::allowed_instead;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Frequency response of the flight control loops of one case of a run that asks for margins.
///
/// Each loop is broken at its axis command with the others closed. The curves are evaluated again
/// from the inputs stored with the run, with exact delays, on the grid that was refined at resonances and
/// crossings. They hold variant, flight time, axis, frequency, real and imaginary part, magnitude and unwrapped
/// phase.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse response runs/closed-loop --case 17 --time 105 -o loops.parquet")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Case index inside its population
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    case: u64,
    /// Population of the case
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Variant (default: all whose loops the run assesses)
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Flight time, s (default: all of the run)
    #[arg(long, value_name = "S")]
    time: Option<f64>,
    /// File to write, .csv or .parquet (default: CSV to the standard output)
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// No such run, case, variant or time; a run without margins; damaged inputs; loops that cannot be followed; output
/// that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let stored = Run::open(&args.run)?;
    let outline = stored.outline();
    let definition = &outline.definition;
    let usage = |option: &str, found: String, allowed: String| {
        Error::Usage(format!("{option}: found {found}; allowed: {allowed}"))
    };
    if let Some(path) = &args.output
        && !["csv", "parquet"].iter().any(|known| path.extension().is_some_and(|e| e == *known))
    {
        let found = path.display().to_string();
        return Err(usage("--output", found, "a name that ends in .csv or .parquet".to_owned()));
    }
    let Some(plan) = &definition.margins else {
        let allowed = "a run whose definition has a table `margins`".to_owned();
        return Err(usage("RUN", "a run without margins".to_owned(), allowed));
    };
    let names = || definition.populations.iter().map(|p| p.name.as_str());
    let Some(population) = names().position(|name| name == args.population) else {
        let allowed = allowed_instead(&args.population, names());
        return Err(usage("--population", format!("\"{}\"", args.population), allowed));
    };
    let cases = definition.populations[population].cases;
    if args.case >= cases {
        return Err(usage("--case", args.case.to_string(), format!("below {cases}")));
    }
    let name = |variant: usize| definition.variants[variant].name.as_str();
    let variants: Vec<usize> = match &args.variant {
        None => plan.variants.clone(),
        Some(wanted) => {
            let Some(&found) = plan.variants.iter().find(|v| name(**v) == wanted) else {
                let allowed = allowed_instead(wanted, plan.variants.iter().map(|v| name(*v)));
                return Err(usage("--variant", format!("\"{wanted}\""), allowed));
            };
            vec![found]
        }
    };
    let times = &definition.flight_times_s;
    let chosen: Vec<usize> =
        (0..times.len()).filter(|&time| args.time.is_none_or(|t| t == times[time])).collect();
    if let (Some(time), true) = (args.time, chosen.is_empty()) {
        return Err(usage("--time", time.to_string(), format!("one of {times:?} s")));
    }

    let loaded = inputs::read(&args.run, &outline.inputs)?;
    let sampler = loaded.sampler(definition)?;
    let all = outline.poles == StoredPoles::All;
    let evaluator = Evaluator::new(&loaded.vehicle.vehicle, &sampler, definition, all)
        .map_err(|error| super::run::unprepared(Path::new(&loaded.run.0), &error))?;
    let mut response = Response::default();
    for &time in &chosen {
        for &variant in &variants {
            let found = evaluator
                .assess(population, args.case, time, variant)
                .map_err(|failure| Error::Incomplete(failure.to_string()))?;
            if let Some(found) = found {
                response.add(name(variant), times[time], &found.curve);
            }
        }
    }
    match &args.output {
        Some(path) => {
            response.write(path)?;
            writeln!(out, "{}: {} rows", path.display(), response.rows())?;
        }
        None => out.write_all(response.to_csv().as_bytes())?,
    }
    Ok(PASS)
}
