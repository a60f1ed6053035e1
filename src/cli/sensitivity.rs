//! `tvse sensitivity`: which draws matter for a metric of a finished run.

use super::{Error, PASS, selection};
use crate::campaign::Sample;
use crate::campaign::sensitivity::{Input, rank};
use crate::io::Run;
use crate::report::statistics::{ranking_text, rankings};
use std::path::PathBuf;

/// Ranks the draws of a finished run by what they do to a metric, with 95 % intervals, and gives the data
/// of a tornado chart.
///
/// Independent draws: standardised regression coefficients, partial rank correlations and first-order
/// indices from given data; of a Latin hypercube or Sobol points the same, with intervals over replicates.
/// Saltelli's plan: first-order and total indices. One-at-a-time plan: the values at the low and the high
/// place of each key. All numbers go to analysis/sensitivity.csv in the run's folder.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse sensitivity runs/reference --metric damping_ratio_min_jet_damping_tvse
  tvse sensitivity runs/saltelli --output ranking.csv")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Population
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Column of the table `cases`; may be given again (default: every smallest damping ratio)
    #[arg(long, value_name = "COLUMN")]
    metric: Vec<String>,
    /// Draws shown for each metric
    #[arg(long, value_name = "N", default_value_t = 20)]
    top: usize,
    /// Resamples of the bootstrap
    #[arg(long, value_name = "N", default_value_t = 400,
        value_parser = clap::value_parser!(u32).range(200..=100_000))]
    resamples: u32,
    /// File for a copy of the table with all numbers, as CSV; it must not exist
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// No such run, population or metric; cases from which no index follows; damaged tables; an output that
/// cannot be written.
pub fn run(args: &Args, out: &mut dyn std::io::Write) -> Result<u8, Error> {
    let run = Run::open(&args.run)?;
    let definition = &run.outline().definition;
    let population = selection::population(&run, &args.population)?;
    let names = selection::columns(&run, &args.metric)?;
    let draws = &run.outline().draws;
    let columns: Vec<String> = draws.iter().map(|draw| draw.column.clone()).collect();
    let inputs: Vec<Input> = selection::values(&run, population, &columns)?
        .into_iter()
        .zip(draws)
        .map(|(values, draw)| Input { key: draw.key.clone(), values })
        .collect();
    let of = &definition.populations[population];
    let resamples = args.resamples as usize;
    let mut found = Vec::new();
    for (name, results) in names.iter().zip(selection::values(&run, population, &names)?) {
        let ranking =
            rank(Sample::of(of), &of.scheme, &inputs, &results, resamples, definition.seed)
                .map_err(|error| Error::Usage(format!("{name}: no index: {error}")))?;
        writeln!(out, "{name}\n{}", ranking_text(&ranking, args.top))?;
        found.push((name.as_str(), ranking));
    }
    let rows = rankings(found.iter().map(|(name, ranking)| (*name, ranking)));
    selection::keep(&args.run, "sensitivity.csv", args.output.as_deref(), &rows, out)?;
    Ok(PASS)
}
