//! `tvse influence`: ranks the draws of a finished run by the eigenvalue derivatives of its cases.

use super::{Error, PASS, run::unprepared, selection};
use crate::campaign::influence::{Influence, Influences};
use crate::campaign::worst::{Aim, Objective, Quantity};
use crate::campaign::{Branch, Evaluator, Intervals, Sample};
use crate::io::{Run, inputs};
use crate::problem::Problems;
use crate::report::influence::{Ranking, Tornado, rows, text};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Ranks the draws of a finished run by what one σ of each does to the damping ratio of a mode, from the
/// derivatives stored with every case (`[sensitivity]` in the run file), and solves the nominal vehicle with
/// each key alone at its low and high place for a tornado chart.
///
/// Shares count the variance of the damping ratio that is linear in a key; the bound is one of its total
/// index. `tvse sensitivity` gives indices from the sample itself. All numbers go to analysis/influence.csv
/// in the run's folder.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse influence runs/worst-on-worst
  tvse influence runs/worst-on-worst --variant jet_damping --time 110 --output influence.csv")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Population
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Variant (default: all that have derivatives)
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Flight time, s (default: all that have derivatives)
    #[arg(long, value_name = "S")]
    time: Option<f64>,
    /// Mode (default: all)
    #[arg(long, value_name = "NAME")]
    mode: Option<String>,
    /// Draws shown and solved for the tornado chart
    #[arg(long, value_name = "N", default_value_t = 20)]
    top: usize,
    /// Low and high place of the tornado chart, in σ
    #[arg(long, value_name = "N", default_value_t = 3.0)]
    sigma: f64,
    /// File for a copy of the table with all numbers, as CSV; it must not exist
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// No such run or population; a run without derivatives; damaged tables or inputs; an output that cannot be
/// written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let stored = Run::open(&args.run)?;
    let outline = stored.outline();
    let definition = &outline.definition;
    let population = selection::population(&stored, &args.population)?;
    if definition.sensitivity.is_none() {
        let message = "the run stores no derivatives; give its run file a table [sensitivity]";
        return Err(Error::Usage(message.to_owned()));
    }
    if !(args.sigma > 0.0 && args.sigma <= 8.0) {
        let message = format!("--sigma: found {}; allowed: above 0, up to 8", args.sigma);
        return Err(Error::Usage(message));
    }
    let wanted = |asked: &Option<String>, name: &str| asked.as_ref().is_none_or(|a| a == name);
    let mut all: BTreeMap<[usize; 3], Influences> = BTreeMap::new();
    let of = &definition.populations[population];
    stored.modes(population, 0..of.cases, |row| {
        let (Some(mode), Ok(pole)) = (row.mode, &row.outcome) else { return Ok(()) };
        let Some(sensitivity) = &pole.sensitivity else { return Ok(()) };
        let chosen = pole.branch == Branch::Primary
            && wanted(&args.variant, &definition.variants[row.variant].name)
            && wanted(&args.mode, &definition.modes[mode])
            && args.time.is_none_or(|time| time == definition.flight_times_s[row.flight_time]);
        if chosen {
            let key = [row.variant, row.flight_time, mode];
            let influences = all.entry(key).or_insert_with(|| Influences::new(Sample::of(of)));
            influences.add(row.case, pole.damping_ratio(), sensitivity).map_err(|e| {
                Problems::damage("tables/modes.parquet", "", e.to_string(), "finite numbers")
            })?;
        }
        Ok(())
    })?;
    if all.is_empty() {
        let message = "found no ranking; allowed: --variant, --time and --mode with derivatives";
        return Err(Error::Usage(message.to_owned()));
    }
    let loaded = inputs::read(&args.run, &outline.inputs)?;
    let sampler = loaded.sampler(definition)?;
    let evaluator = Evaluator::new(&loaded.vehicle.vehicle, &sampler, definition, false)
        .map_err(|error| unprepared(Path::new(&loaded.run.0), &error))?;
    let mut rankings = Vec::new();
    for (key, influences) in &all {
        let [variant, flight_time, mode] = *key;
        let objective = Objective {
            evaluator: &evaluator,
            dispersion: &loaded.dispersion,
            aim: Aim { variant, baseline: None, mode, quantity: Quantity::DampingRatio },
            flight_time,
        };
        let ranking = influences.ranking();
        let with_tornado = |(place, influence): (usize, Influence)| {
            let solved = |sigma: f64| {
                let mut z = vec![None; outline.draws.len()];
                z[influence.draw] = Some(sigma);
                objective.value(&z).ok()
            };
            let shown = place < args.top;
            let ends = || Some([solved(-args.sigma)?, solved(args.sigma)?]);
            let tornado: Tornado = if shown { ends() } else { None };
            (influence, tornado)
        };
        let ranking = Ranking {
            variant: &definition.variants[variant].name,
            flight_time_s: definition.flight_times_s[flight_time],
            mode: &definition.modes[mode],
            nominal: objective.value(&vec![None; outline.draws.len()]).ok(),
            sigma: args.sigma,
            all: ranking.into_iter().enumerate().map(with_tornado).collect(),
        };
        writeln!(
            out,
            "{} at {} s, mode {}: {} cases, {} near veering; ζ at ∓{} σ of one key, all else nominal",
            ranking.variant,
            ranking.flight_time_s,
            ranking.mode,
            influences.cases,
            influences.veering,
            args.sigma
        )?;
        let shown = &ranking.all[..args.top.min(ranking.all.len())];
        writeln!(out, "{}", text(&outline.draws, shown))?;
        rankings.push(ranking);
    }
    let intervals = all.values().map(Influences::intervals).next();
    match Sample::of(of).without_intervals(of.cases as usize) {
        Some(without) => writeln!(out, "{without}")?,
        None if intervals == Some(Intervals::Replicates) => {
            writeln!(out, "intervals: Student's t over the means of replicates or outer draws")?;
        }
        None => {}
    }
    let rows = rows(&outline.draws, &rankings);
    selection::keep(&args.run, "influence.csv", args.output.as_deref(), &rows, out)?;
    Ok(PASS)
}
