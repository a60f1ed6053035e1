//! `tvse actuator`: response of a vehicle's nozzles on their actuators to external load torques.

use super::{Error, PASS};
use crate::scenario::pattern;
use crate::spelling;
use crate::{io, report};
use std::io::Write;
use std::path::PathBuf;

/// Static compliance, TVC resonance and equivalent second-order model of each actuator.
///
/// The TVC resonance is the frequency at which the nozzle lags an external load torque by 90°. The
/// inertia is that about the pivot, unablated and after full burn with the nominal ablation factor.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse actuator vehicles/sls-like
  tvse actuator vehicles/sls-like --engine 'booster.*'")]
pub struct Args {
    /// The vehicle: its folder or its file
    vehicle: PathBuf,
    /// Engines, by path, `*` for any part (default: all)
    #[arg(long, value_name = "PATH")]
    engine: Option<String>,
    #[command(flatten)]
    outside: super::outside::Args,
}

/// Runs the command.
///
/// # Errors
/// All problems of the vehicle; an engine that does not exist.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let vehicle = io::scenario::vehicle(&args.vehicle, args.outside.reach())?.resolved.vehicle;
    let chosen = args.engine.as_deref().unwrap_or("*.*");
    let paths: Vec<String> = vehicle.engines.iter().map(|e| e.path()).collect();
    if !paths.iter().any(|path| pattern::matches(chosen, path)) {
        let allowed = spelling::allowed_instead(chosen, paths.iter().map(String::as_str));
        return Err(Error::Usage(format!("--engine: found \"{chosen}\"; allowed: {allowed}")));
    }
    let engines = vehicle.engines.iter().filter(|e| pattern::matches(chosen, &e.path()));
    writeln!(out, "{}\n{}", vehicle.name, report::actuator::table(engines))?;
    Ok(PASS)
}
