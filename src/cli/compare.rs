//! `tvse compare`: paired differences between two finished runs on common draws.

use super::{Error, PASS, selection};
use crate::campaign::{Sample, statistics};
use crate::io::Run;
use crate::problem::Problems;
use crate::report::statistics::lines;
use std::path::{Path, PathBuf};

/// Differences of metrics between two finished runs, case by case, with 95 % intervals.
///
/// The runs must share their draws: the same seed and plan, and equal values of every draw key that both
/// have. Cases that failed in either are left out and counted.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse compare runs/all-engines runs/reference --metric damping_ratio_min_jet_damping_tvse")]
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
}

/// Draw columns read at once.
const AT_ONCE: usize = 16;

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
    let population = |i: usize| &runs[i].outline().definition.populations[places[i]];
    let cases = common_cases(&args.first, &args.second, [population(0), population(1)])?;
    let (keys, only) = common_draws([&args.first, &args.second], &runs, &places, cases)?;
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
    let sample = Sample::of(population(0));
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
    if claims == 0 {
        writeln!(out, "no intervals: these cases are {}", sample.drawing().describe())?;
    }
    selection::write(args.output.as_deref(), &rows)?;
    Ok(PASS)
}

/// Number of cases that both populations have in common.
pub(super) fn common_cases(
    first: &Path,
    second: &Path,
    [a, b]: [&crate::campaign::Population; 2],
) -> Result<usize, Error> {
    let input = |found: String, allowed: &str| {
        let file = format!("{} and {}", first.display(), second.display());
        Err(Problems::input(file, &a.name, found, allowed).into())
    };
    if a.scheme != b.scheme || a.drawn != b.drawn {
        let found = format!("{}, and {}", a.scheme.describe(), b.scheme.describe());
        return input(found, "the same plan");
    }
    if a.cases != b.cases && !a.scheme.keeps_first_cases() {
        let found = format!("{} and {} cases", a.cases, b.cases);
        return input(found, "the same number: more cases change the first ones of this plan");
    }
    Ok(a.cases.min(b.cases) as usize)
}

/// Number of draw keys that both runs have, all with equal values, and of those that one has.
pub(super) fn common_draws(
    folders: [&Path; 2],
    runs: &[Run; 2],
    places: &[usize],
    cases: usize,
) -> Result<(usize, usize), Error> {
    let draws = |i: usize| &runs[i].outline().draws;
    let mut pairs = Vec::new();
    for draw in draws(0) {
        if let Some(other) = draws(1).iter().find(|other| other.key == draw.key) {
            pairs.push((draw, other));
        }
    }
    for pairs in pairs.chunks(AT_ONCE) {
        let first: Vec<String> = pairs.iter().map(|(a, _)| a.column.clone()).collect();
        let second: Vec<String> = pairs.iter().map(|(_, b)| b.column.clone()).collect();
        let first = selection::values(&runs[0], places[0], &first)?;
        let second = selection::values(&runs[1], places[1], &second)?;
        for ((a, b), (draw, _)) in first.iter().zip(&second).zip(pairs) {
            let differ = |i: &usize| a[*i].to_bits() != b[*i].to_bits();
            if let Some(case) = (0..cases).find(differ) {
                let file = format!("{} and {}", folders[0].display(), folders[1].display());
                let found = format!("{} and {} in case {case}", a[case], b[case]);
                let allowed = "the same draws: one seed, one plan, one law for each key";
                return Err(Problems::input(file, &draw.key, found, allowed).into());
            }
        }
    }
    Ok((pairs.len(), draws(0).len() + draws(1).len() - 2 * pairs.len()))
}
