//! `tvse nominal`: the poles of the nominal vehicle.

use super::{Error, PASS};
use crate::campaign::{Definition, Evaluator, Population};
use crate::dispersion::{Sampler, Scheme};
use crate::{io, report};
use std::io::Write;
use std::path::PathBuf;

/// Poles of the nominal vehicle at every flight time and in every variant of a run.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse nominal runs/reference.toml
  tvse nominal runs/reference.toml --all")]
pub struct Args {
    /// The run definition
    run: PathBuf,
    /// Every pole, not only those of the modes of interest
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    outside: super::outside::Args,
}

/// Runs the command.
///
/// # Errors
/// All problems of the run and what it names.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let loaded = io::scenario::load(&args.run, args.outside.reach())?;
    let nominal = Population {
        name: "nominal".into(),
        cases: 1,
        fixed: Vec::new(),
        drawn: false,
        scheme: Scheme::MonteCarlo,
    };
    let definition = Definition { populations: vec![nominal], ..loaded.definition };
    let sampler = Sampler::new(&loaded.dispersion, definition.seed);
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, args.all)
        .map_err(|error| super::run::unprepared(&args.run, &error))?;
    let record = evaluator.evaluate(0, 0);
    writeln!(out, "{}\n{}", vehicle.name, report::nominal::table(&definition, &record))?;
    Ok(PASS)
}
