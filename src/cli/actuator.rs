//! `tvse actuator`: response of a vehicle's nozzles on their actuators to external load torques.

use super::{Error, PASS};
use crate::io::model::Format;
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
  tvse actuator vehicles/sls-like --engine 'booster.*'
  tvse actuator vehicles/sls-like --response response.csv --frequencies 0.1:50:500")]
pub struct Args {
    /// The vehicle: its folder or its file
    vehicle: PathBuf,
    /// Engines, by path, `*` for any part (default: all)
    #[arg(long, value_name = "PATH")]
    engine: Option<String>,
    /// Writes the frequency responses as a table, CSV or Parquet by the extension: load compliance Θ/τ
    /// and command response Θ/δ_c
    #[arg(long, value_name = "FILE")]
    response: Option<PathBuf>,
    /// Frequencies of the table, Hz: COUNT of them, evenly spaced on a logarithmic scale
    #[arg(long, value_name = "FROM:TO:COUNT", default_value = "0.1:100:301")]
    frequencies: String,
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
    let engines = || vehicle.engines.iter().filter(|e| pattern::matches(chosen, &e.path()));
    let frequencies = frequencies(&args.frequencies)?;
    if let Some(target) = &args.response {
        let extension = target.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let known = [Format::Csv, Format::Parquet];
        let Some(format) = known.into_iter().find(|f| f.extension() == extension) else {
            let found = target.display();
            return Err(Error::Usage(format!(
                "--response: found \"{found}\"; allowed: a file called .csv or .parquet"
            )));
        };
        io::actuator::write(target, format, engines(), &frequencies)?;
    }
    writeln!(out, "{}\n{}", vehicle.name, report::actuator::table(engines()))?;
    if let Some(target) = &args.response {
        writeln!(out, "{}", target.display())?;
    }
    Ok(PASS)
}

/// Frequencies of `FROM:TO:COUNT`.
fn frequencies(range: &str) -> Result<Vec<f64>, Error> {
    let usage = || {
        let allowed =
            "FROM:TO:COUNT with 0 < FROM < TO, COUNT from 2 to 1000000, for instance 0.1:100:301";
        Error::Usage(format!("--frequencies: found \"{range}\"; allowed: {allowed}"))
    };
    let parts: Vec<&str> = range.split(':').collect();
    let [from, to, count] = parts.as_slice() else { return Err(usage()) };
    let from: f64 = from.parse().map_err(|_| usage())?;
    let to: f64 = to.parse().map_err(|_| usage())?;
    let count: u32 = count.parse().map_err(|_| usage())?;
    if !(0.0 < from && from < to && to.is_finite() && (2..=1_000_000).contains(&count)) {
        return Err(usage());
    }
    let at = |i: u32| from * (to / from).powf(f64::from(i) / f64::from(count - 1));
    Ok((0..count).map(at).collect())
}
