//! `tvse report`: a finished run as one HTML page, and its figures as files.

use super::{Error, PASS, gate, selection};
use crate::campaign::influence::Influences;
use crate::campaign::metric::{Quantity, metrics};
use crate::campaign::sensitivity::{Input, Ranking, rank};
use crate::campaign::{Branch, Evaluator, Sample, statistics};
use crate::gate::Source;
use crate::io::pair::{Common, Pair};
use crate::io::{self, Run, files, inputs, report as gather, summarise};
use crate::problem::Problems;
use crate::report::chart::png;
use crate::report::html::contents::{
    Comparison, Distribution, Gated, Influenced, PairedMetric, Shape, focus,
};
use crate::report::html::{Contents, Section, page, sections, shape};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The report of a finished run: one HTML file with all figures, which needs no network.
///
/// It shows what the run has: poles, damping against flight time, distributions with order-statistic bounds and
/// gates, what the draws do, worst cases with the commands that rebuild them, added damping, the flight control loops,
/// the mode on the vehicle, failures and provenance. Pointing at a mark shows its case.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse report runs/reference
  tvse report runs/reference --gates runs/reference.gates.toml --figures figures
  tvse report runs/all-engines --compare runs/reference -o difference.html")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// File of the report, replaced if it is there (default: report.html in the run's folder)
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Folder for every figure as SVG and PNG; files of the same names are replaced
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// Gates whose values are drawn against their limits
    #[arg(long, value_name = "FILE")]
    gates: Option<PathBuf>,
    /// Another run on the same draws, whose values are subtracted
    #[arg(long, value_name = "RUN")]
    compare: Option<PathBuf>,
    /// Population
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
}

/// Cases from which draws are ranked, at most: the memory is that of all draws.
const RANKED: usize = 20_000;
/// Resamples of the bootstrap of the ranking.
const RESAMPLES: usize = 200;
/// Points of a PNG for each of its figure's own.
const SCALE: f32 = 2.0;

/// Runs the command.
///
/// # Errors
/// No such run or population; problems of the gate file; draws that two runs do not have in common; damaged tables or
/// inputs; output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let run = Run::open(&args.run)?;
    let target = args.output.clone().unwrap_or_else(|| args.run.join("report.html"));
    let within = files::resolved(target.parent().unwrap_or(Path::new("")));
    let contents = contents(args, &run, within == files::resolved(&args.run))?;
    let sections = sections(&contents);
    let title = format!("tvse report: {}", contents.outline.definition.name);
    let subtitle = contents.vehicle.clone().unwrap_or_default();
    files::create_parents(&target)?;
    files::write(&target, page(&title, &subtitle, &sections).as_bytes())?;
    writeln!(out, "{}", target.display())?;
    if let Some(folder) = &args.figures {
        write_figures(folder, &sections, out)?;
    }
    Ok(PASS)
}

fn write_figures(folder: &Path, sections: &[Section], out: &mut dyn Write) -> Result<(), Error> {
    files::ensure_folder(folder)?;
    for figure in sections.iter().flat_map(|section| &section.figures) {
        let svg = folder.join(format!("{}.svg", figure.id));
        files::write(&svg, figure.file().as_bytes())?;
        let picture = png(figure, SCALE)
            .map_err(|error| Error::Usage(format!("{}: no PNG: {error}", figure.id)))?;
        let target = folder.join(format!("{}.png", figure.id));
        files::write(&target, &picture)?;
        writeln!(out, "{}\n{}", svg.display(), target.display())?;
    }
    Ok(())
}

fn contents(args: &Args, run: &Run, beside: bool) -> Result<Contents, Error> {
    let outline = run.outline();
    let definition = &outline.definition;
    let population = selection::population(run, &args.population)?;
    let summary = summarise::summary(run, summarise::MEMORY)?;
    let focused: Vec<(usize, usize)> = (0..definition.modes.len())
        .map(|mode| focus(outline, &summary, population, mode))
        .collect();
    let times: Vec<usize> = focused.iter().map(|(_, time)| *time).collect();
    let rules = args.gates.as_deref();
    let (comparison, gates) = match &args.compare {
        None => (None, gates(rules, run)?),
        Some(folder) => {
            let other = Run::open(folder)?;
            let pair = Pair { run, baseline: &other };
            (Some(comparison(args, &pair, folder, population)?), gates(rules, &pair)?)
        }
    };
    let mut contents = Contents {
        folder: args.run.display().to_string(),
        beside,
        vehicle: None,
        structural_damping: None,
        outline: outline.clone(),
        population,
        worst: summarise::worst(run, super::campaign::WORST)?,
        clouds: gather::clouds(run, population, &times)?,
        least: gather::least(run, population)?,
        gates,
        rankings: rankings(run, population)?,
        influences: influences(run, population)?,
        searched: io::worst::read(&args.run, &outline.identity())?
            .into_iter()
            .map(|found| (found.aim, found.cases))
            .collect(),
        gains: gather::gains(run, population)?,
        feedback: io::feedback::added(run)?,
        loops: gather::loops(run, population)?,
        shapes: Vec::new(),
        failures: gather::failures(run, population)?,
        provenance: gather::provenance(&args.run)?,
        comparison,
        summary,
    };
    if outline.inputs.iter().any(|input| input.name == inputs::VEHICLE) {
        let loaded = inputs::read(&args.run, &outline.inputs)?;
        let vehicle = &loaded.vehicle.vehicle;
        contents.vehicle = Some(vehicle.name.clone());
        contents.structural_damping = Some(vehicle.structural_damping);
        contents.shapes = shapes(args, &loaded, outline, &focused)?;
    }
    Ok(contents)
}

/// The gates with their values; those on the difference to a baseline run need the other run.
fn gates(path: Option<&Path>, source: &impl Source) -> Result<Vec<Gated>, Error> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let (rules, name) = gate::rules(path, source)?;
    let outcomes = crate::gate::evaluate(&rules, source, &name)?;
    let mut gated = Vec::new();
    for (gate, outcome) in rules.into_iter().zip(outcomes) {
        let values = gather::gate_values(source, &gate, &name)?;
        gated.push(Gated { gate, outcome, values });
    }
    Ok(gated)
}

type Rankings = Result<Vec<(String, usize, Ranking)>, String>;

/// What the draws do to the smallest damping ratio of each variant and mode.
fn rankings(run: &Run, population: usize) -> Result<Rankings, Error> {
    let outline = run.outline();
    let of = &outline.definition.populations[population];
    let columns: Vec<&str> = outline.draws.iter().map(|draw| draw.column.as_str()).collect();
    if columns.is_empty() {
        return Ok(Err("the run has no draws".to_owned()));
    }
    // The ranking of a plan of its own needs all of its cases.
    let used = if of.scheme.is_monte_carlo() { RANKED } else { usize::MAX };
    let mut drawn = gather::columns(run, population, &columns)?;
    drawn.iter_mut().for_each(|column| column.truncate(used));
    let cases = drawn.first().map_or(0, Vec::len);
    let inputs: Vec<Input> = (drawn.into_iter().zip(&outline.draws))
        .map(|(values, draw)| Input { key: draw.key.clone(), values })
        .collect();
    let mut found = Vec::new();
    for metric in metrics(&outline.definition) {
        if metric.quantity != Quantity::DampingRatioMin {
            continue;
        }
        let mut results = gather::columns(run, population, &[&metric.name])?.remove(0);
        results.truncate(used);
        let seed = outline.definition.seed;
        match rank(Sample::of(of), &of.scheme, &inputs, &results, RESAMPLES, seed) {
            Ok(ranking) => found.push((metric.name, cases, ranking)),
            Err(error) => return Ok(Err(error.to_string())),
        }
    }
    Ok(Ok(found))
}

/// What the derivatives of the cases say of each mode and variant, at the least damped flight time that has
/// them.
fn influences(run: &Run, population: usize) -> Result<Vec<Influenced>, Error> {
    let definition = &run.outline().definition;
    if definition.sensitivity.is_none() {
        return Ok(Vec::new());
    }
    let of = &definition.populations[population];
    let mut all: BTreeMap<[usize; 3], (f64, Influences)> = BTreeMap::new();
    run.modes(population, 0..of.cases, |row| {
        let (Some(mode), Ok(pole)) = (row.mode, &row.outcome) else { return Ok(()) };
        let Some(sensitivity) =
            pole.sensitivity.as_ref().filter(|_| pole.branch == Branch::Primary)
        else {
            return Ok(());
        };
        let key = [mode, row.variant, row.flight_time];
        let none = || (0.0, Influences::new(Sample::of(of)));
        let (sum, influences) = all.entry(key).or_insert_with(none);
        *sum += pole.damping_ratio();
        influences.add(row.case, pole.damping_ratio(), sensitivity).map_err(|error| {
            Problems::damage("tables/modes.parquet", "", error.to_string(), "finite numbers")
        })
    })?;
    let mut least: BTreeMap<[usize; 2], (f64, Influenced)> = BTreeMap::new();
    for ([mode, variant, flight_time], (sum, influences)) in all {
        let mean = sum / influences.cases as f64;
        if least.get(&[mode, variant]).is_none_or(|(other, _)| mean < *other) {
            let ranking = influences.ranking();
            let cases = [influences.cases, influences.veering];
            let found = Influenced { variant, flight_time, mode, cases, ranking };
            least.insert([mode, variant], (mean, found));
        }
    }
    Ok(least.into_values().map(|(_, found)| found).collect())
}

/// Every named mode of the nominal vehicle at its least damped flight time.
fn shapes(
    args: &Args,
    loaded: &io::scenario::Loaded,
    outline: &crate::campaign::Outline,
    focused: &[(usize, usize)],
) -> Result<Vec<Shape>, Error> {
    let mut shapes = Vec::new();
    for (mode, &(variant, time)) in focused.iter().enumerate() {
        // Only what is drawn is prepared.
        let mut definition = outline.definition.clone();
        definition.flight_times_s = vec![definition.flight_times_s[time]];
        definition.variants = vec![definition.variants[variant].clone()];
        definition.modes = vec![definition.modes[mode].clone()];
        definition.margins = None;
        let sampler = loaded.sampler(&definition)?;
        let vehicle = &loaded.vehicle.vehicle;
        let evaluator = Evaluator::new(vehicle, &sampler, &definition, false)
            .map_err(|error| super::run::unprepared(&args.run, &error))?;
        let found = shape::of(vehicle, &definition, &evaluator, [0, 0, 0]);
        shapes.extend(found.map(|shape| Shape { mode, variant, flight_time: time, ..shape }));
    }
    Ok(shapes)
}

/// What the two runs of a pair show on their common draws.
fn comparison(
    args: &Args,
    pair: &Pair<'_>,
    folder: &Path,
    population: usize,
) -> Result<Comparison, Error> {
    let (run, other) = (pair.run, pair.baseline);
    let there = selection::population(other, &args.population)?;
    let named = [files::name(&args.run), files::name(folder)];
    let Common { cases, keys, .. } = pair.common(&args.population, [&named[0], &named[1]])?;
    let cases = cases as usize;
    let names = selection::columns(run, &[])?;
    let known = selection::columns(other, &[])?;
    let mut metrics = Vec::new();
    for name in names.into_iter().filter(|name| known.contains(name)) {
        let first = gather::columns(run, population, &[&name])?.remove(0);
        let second = gather::columns(other, there, &[&name])?.remove(0);
        let (first, second) = (&first[..cases], &second[..cases]);
        let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
        let sample = Sample::of(&run.outline().definition.populations[population]);
        let lines = statistics::paired(sample, first, second)
            .map_err(|error| Error::Incomplete(format!("{name}: {error}")))?;
        let (dots, seen) = gather::thinned(second, &differences);
        let by_case = differences.iter().enumerate().map(|(case, value)| (case as u64, *value));
        let differences = Distribution::of(by_case);
        metrics.push(PairedMetric { name, dots, seen, differences, lines });
    }
    if metrics.is_empty() {
        let message = "--compare: the runs have no smallest damping ratio of the same name";
        return Err(Error::Usage(message.to_owned()));
    }
    Ok(Comparison {
        folder: folder.display().to_string(),
        outline: other.outline().clone(),
        summary: summarise::summary(other, summarise::MEMORY)?,
        common: (cases, keys),
        metrics,
        provenance: gather::provenance(folder)?,
    })
}
