//! `tvse compare`: paired differences between two finished runs on common draws.

use super::gate::{self, Judged};
use super::{Error, PASS, selection};
use crate::campaign::{Sample, statistics};
use crate::io::pair::{Common, Pair};
use crate::io::{Run, files};
use crate::report::statistics::lines;
use std::path::PathBuf;

/// Differences of metrics between two finished runs, case by case, with 95 % intervals.
///
/// The runs must share their draws: the same seed and plan, and equal values of every draw key that both
/// have. Cases that failed in either are left out and counted.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse compare runs/new runs/reference --metric damping_ratio_min_jet_damping_tvse
  tvse compare runs/new runs/reference --gates runs/regression.gates.toml")]
pub struct Args {
    /// Folder of the first run
    first: PathBuf,
    /// Folder of the second run, whose values are subtracted
    second: PathBuf,
    /// Population
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Column of the table `cases` that both have; may be given again (default: every smallest damping
    /// ratio that both have)
    #[arg(long, value_name = "COLUMN")]
    metric: Vec<String>,
    /// File for the numbers as CSV; it must not exist
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Gates to hold the first run against, with `baseline_run = true` where the difference counts; the exit
    /// code is theirs (see `tvse gate`)
    #[arg(long, value_name = "FILE")]
    gates: Option<PathBuf>,
    #[command(flatten)]
    outputs: gate::Outputs,
}

/// Runs the command.
///
/// # Errors
/// No such run, population or metric; draws that are not common; damaged tables; an output that cannot
/// be written.
pub fn run(args: &Args, out: &mut dyn std::io::Write) -> Result<u8, Error> {
    let runs = [Run::open(&args.first)?, Run::open(&args.second)?];
    let mut places = Vec::new();
    for run in &runs {
        places.push(selection::population(run, &args.population)?);
    }
    let pair = Pair { run: &runs[0], baseline: &runs[1] };
    let folders = [files::name(&args.first), files::name(&args.second)];
    let Common { cases, keys, only } = pair.common(&args.population, [&folders[0], &folders[1]])?;
    let cases = cases as usize;
    let population = &runs[0].outline().definition.populations[places[0]];
    let mut names = selection::columns(&runs[0], &args.metric)?;
    let others = selection::columns(&runs[1], &[])?;
    if args.metric.is_empty() {
        names.retain(|name| others.contains(name));
    } else {
        selection::columns(&runs[1], &args.metric)?;
    }
    if names.is_empty() {
        return Err(Error::Usage(
            "--metric: the runs have no metric of that name in common".into(),
        ));
    }
    let first = selection::values(&runs[0], places[0], &names)?;
    let second = selection::values(&runs[1], places[1], &names)?;
    let sample = Sample::of(population);
    let mut all = Vec::new();
    for ((name, first), second) in names.iter().zip(&first).zip(&second) {
        let found = statistics::paired(sample, &first[..cases], &second[..cases]);
        all.push((name.as_str(), found.map_err(|e| Error::Incomplete(format!("{name}: {e}")))?));
    }
    let claims = all.iter().flat_map(|(_, l)| l).filter(|line| line.interval.is_some()).count();
    let rows = lines(all.iter().map(|(name, lines)| (*name, &lines[..])));
    writeln!(
        out,
        "{} less {}, {cases} common cases, {keys} common draw keys{}\n{}{claims} intervals of 95 % at once",
        args.first.display(),
        args.second.display(),
        if only > 0 { format!(", {only} that only one of them has") } else { String::new() },
        rows.text()
    )?;
    if let Some(without) = sample.without_intervals(cases) {
        writeln!(out, "{without}")?;
    }
    selection::write(args.output.as_deref(), &rows)?;
    match &args.gates {
        Some(gates) => {
            let judged = Judged { folder: &args.first, gates, outputs: &args.outputs };
            gate::judge_pair(&pair, &args.second, &judged, out)
        }
        None => Ok(PASS),
    }
}
