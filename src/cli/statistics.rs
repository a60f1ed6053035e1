//! `tvse statistics`: moments, quantiles and the running estimate of metrics of a finished run.

use super::{Error, PASS, selection};
use crate::campaign::{Sample, statistics};
use crate::io::Run;
use crate::report::statistics::lines;
use std::path::PathBuf;

/// Statistics of metrics of a finished run with 95 % intervals, and how they came to stand.
///
/// Independent draws give bootstrap intervals (bias-corrected and accelerated) and, for quantiles, exact
/// order statistics; replicates of a Latin hypercube or Sobol plan and outer draws give Student's t over
/// their results; other cases give none. Each case counts with its worst over the flight times.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse statistics runs/reference
  tvse statistics runs/reference --metric damping_ratio_min_jet_damping_tvse --output statistics.csv")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Population
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Column of the table `cases`; may be given again (default: every smallest damping ratio)
    #[arg(long, value_name = "COLUMN")]
    metric: Vec<String>,
    /// The running share counts cases below this value, and those that failed
    #[arg(long, value_name = "VALUE", default_value_t = 0.0, allow_negative_numbers = true)]
    below: f64,
    /// Resamples of the bootstrap
    #[arg(long, value_name = "N", default_value_t = 2000,
        value_parser = clap::value_parser!(u32).range(200..=100_000))]
    resamples: u32,
    /// File for the numbers as CSV; it must not exist
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// No such run, population or metric; damaged tables; an output that cannot be written.
pub fn run(args: &Args, out: &mut dyn std::io::Write) -> Result<u8, Error> {
    let run = Run::open(&args.run)?;
    let definition = &run.outline().definition;
    let population = selection::population(&run, &args.population)?;
    let names = selection::columns(&run, &args.metric)?;
    let columns = selection::values(&run, population, &names)?;
    let sample = Sample::of(&definition.populations[population]);
    let mut all = Vec::new();
    let mut growing = Vec::new();
    for (name, values) in names.iter().zip(&columns) {
        let source = (definition.seed, name.as_str());
        let found = statistics::estimates(sample, values, args.resamples as usize, source);
        all.push((name, found.map_err(|e| Error::Incomplete(format!("{name}: {e}")))?));
        let failed = values.iter().filter(|value| value.is_nan()).count();
        if failed > 0 {
            writeln!(out, "{name}: {failed} failed cases have no value")?;
        }
        match statistics::running(sample, values, args.below) {
            Ok(lines) => growing.push((name, lines)),
            Err(drawing) => writeln!(
                out,
                "{name}: no running estimate: the first cases of {} are no sample",
                drawing.describe()
            )?,
        }
    }
    let claims = all.iter().flat_map(|(_, l)| l).filter(|line| line.interval.is_some()).count();
    let of =
        |(name, lines): &'_ (&String, Vec<statistics::Line>)| (name.to_string(), lines.clone());
    let parts: [Vec<(String, Vec<statistics::Line>)>; 2] =
        [all.iter().map(of).collect(), growing.iter().map(of).collect()];
    let [text, running] = [&parts[0], &parts[1]]
        .map(|part| lines(part.iter().map(|(name, lines)| (name.as_str(), &lines[..]))).text());
    writeln!(out, "{text}{claims} intervals of 95 % at once")?;
    let cases = definition.populations[population].cases as usize;
    if let Some(without) = sample.without_intervals(cases) {
        writeln!(out, "{without}")?;
    }
    if !growing.is_empty() {
        writeln!(
            out,
            "\nrunning estimate; share: cases below {} or failed\n{running}",
            args.below
        )?;
    }
    let both = parts.iter().flatten().map(|(name, lines)| (name.as_str(), &lines[..]));
    selection::write(args.output.as_deref(), &lines(both))?;
    Ok(PASS)
}
