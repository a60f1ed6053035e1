//! `tvse worst`: searches for the worst cases of a finished run.

use super::interrupt::Interrupt;
use super::{Error, FAIL, PASS, campaign, run::unprepared, selection};
use crate::campaign::worst::{
    self, Aim, Method, Quantity, Standing, WorstCase, search::MOST_CORNER_KEYS,
};
use crate::campaign::{Definition, Evaluator, Pool, Population};
use crate::dispersion::{Draws, Scheme};
use crate::io::replay::Replay;
use crate::io::scenario::Loaded;
use crate::io::worst::Found;
use crate::io::{self, Run, files, inputs};
use crate::report::{self, worst::Around};
use crate::spelling::allowed_instead;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Worst on worst: searches the draws of a finished run for the vehicle with the least damping.
///
/// Four methods, each at every flight time: every key at the side its derivative calls adverse; all
/// corners of the most influential keys; descent with analytic derivatives inside the box of ±σ for every
/// key, and inside the ellipsoid of equal joint likelihood, from the median, the corners and the worst
/// cases of the sample. Modes are followed on the way. The cases found go to worst/ in the run's folder, as
/// tables and as fixed cases for other runs; `tvse replay RUN --worst NAME` rebuilds one.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse worst runs/reference --variant jet_damping
  tvse worst runs/reference --variant jet_damping --objective time-to-double --time 110 --corners 14
  tvse worst runs/closed --variant closed --baseline open
  tvse worst runs/reference --variant jet_damping --output fixed.toml --around 500")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Variant (default: the last)
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Makes the gain over this variant least, on the same draws, for instance what feedback adds
    #[arg(long, value_name = "NAME")]
    baseline: Option<String>,
    /// Mode (default: the first)
    #[arg(long, value_name = "NAME")]
    mode: Option<String>,
    /// What is made worst
    #[arg(long, value_enum, default_value_t = What::Damping)]
    objective: What,
    /// Flight time, s; may be given again (default: all of the run)
    #[arg(long, value_name = "S")]
    time: Vec<f64>,
    /// Half width of the box, in σ of every key
    #[arg(long, value_name = "N", default_value_t = 3.0, value_parser = sigma)]
    sigma: f64,
    /// Radius of the ellipsoid, in σ
    #[arg(long, value_name = "N", default_value_t = 3.0, value_parser = sigma)]
    radius: f64,
    /// Number of most influential keys whose corners are all evaluated, 2^N; 0 for none
    #[arg(long, value_name = "N", default_value_t = 10,
        value_parser = clap::value_parser!(u8).range(0..=MOST_CORNER_KEYS as i64))]
    corners: u8,
    /// Worst cases of the sample from which descents start
    #[arg(long, value_name = "N", default_value_t = 5)]
    starts: usize,
    /// Population that is the sample
    #[arg(long, value_name = "NAME", default_value = "dispersed")]
    population: String,
    /// Threads (default: all processors); results do not depend on it
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Fixed cases come with Monte Carlo of so many cases around each, all but the keys held being drawn
    #[arg(long, value_name = "CASES")]
    around: Option<u64>,
    /// Keys held in that: those with the greatest shares of the objective
    #[arg(long, value_name = "N", default_value_t = 10, requires = "around")]
    hold: usize,
    /// File for the cases as fixed cases of a run file; it must not exist
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum What {
    /// The damping ratio
    Damping,
    /// The rate of decay, whose negative is the rate of growth ln 2/(time to double)
    TimeToDouble,
}

fn sigma(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e: std::num::ParseFloatError| e.to_string())?;
    let allowed = "a number above 0, up to 8";
    if value > 0.0 && value <= 8.0 { Ok(value) } else { Err(allowed.to_owned()) }
}

/// Runs the command.
///
/// # Errors
/// No such run, variant, mode or flight time; a run of synthetic parts; damaged tables or inputs; output
/// that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    if let Some(path) = &args.output {
        files::refuse_existing(path)?;
    }
    let stored = Run::open(&args.run)?;
    let outline = stored.outline();
    let definition = &outline.definition;
    let (aim, flight_times) = aim(args, definition)?;
    let population = selection::population(&stored, &args.population)?;
    let sample = io::worst::sample(&stored, population, &aim, &flight_times)?;

    let loaded = inputs::read(&args.run, &outline.inputs)?;
    let dispersion = &loaded.dispersion;
    let bad = sample.iter().take(args.starts.max(1));
    let draws = stored.draws(population, bad.map(|case| case.case))?;
    let scores_of = |case: u64| {
        let stored = &draws[&case];
        let (values, scores) = (stored.values.clone(), stored.scores.clone());
        dispersion.scores_of(&Draws { values, scores, effects: Vec::new() })
    };
    let plan = worst::Plan {
        aim,
        flight_times,
        box_sigma: args.sigma,
        radius_sigma: args.radius,
        corner_keys: usize::from(args.corners),
        starts: (sample.iter().take(args.starts))
            .map(|case| (case.flight_time, scores_of(case.case)))
            .collect(),
    };
    let sampler = loaded.sampler(definition)?;
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, definition, false)
        .map_err(|error| unprepared(Path::new(&loaded.run.0), &error))?;
    let jobs = args.jobs.map_or_else(campaign::processors, usize::from);
    let pool = Pool::new(jobs).map_err(|e| Error::Usage(format!("--jobs {jobs}: {e}")))?;
    let interrupt = Interrupt::listen().map_err(|e| Error::Usage(format!("signals: {e}")))?;
    let stop = interrupt.stop();
    let found = pool.install(|| worst::search(&evaluator, dispersion, definition, &plan, stop));
    let (mut cases, work) = found.map_err(|error| match error {
        worst::Error::Stopped => campaign::stopped(&interrupt, "in the search", false),
        error => unprepared(Path::new(&loaded.run.0), &error),
    })?;
    if let Some(worst) = sample.first() {
        let stored = &draws[&worst.case];
        let value = |(draw, value): (usize, &Option<f64>)| Some((draw, (*value)?));
        let case = WorstCase {
            name: Method::Sample.name().to_owned(),
            method: Method::Sample,
            flight_time: worst.flight_time,
            values: stored.values.iter().enumerate().filter_map(value).collect(),
            scores: scores_of(worst.case),
            by_score: Vec::new(),
            objective: worst.value,
            pole: [worst.pole.re, worst.pole.im],
            gap: None,
            switches: 0,
        };
        cases.insert(0, case);
    }
    let name = name(&aim, definition);
    for case in &mut cases {
        case.name = format!("{name}_{}", case.name);
    }
    let values: Vec<f64> = sample.iter().map(|case| case.value).collect();
    let standing: Vec<Option<Standing>> =
        cases.iter().map(|case| Standing::of(case.objective, &values)).collect();

    let around = args.around.map(|cases| Around { cases, held: args.hold });
    let texts = vec![
        ("worst.csv", report::worst::cases(definition, &cases, &standing).csv()),
        ("parameters.csv", report::worst::parameters(&outline.draws, &cases).csv()),
        ("fixed.toml", report::worst::fixed(&outline.draws, &cases, around)),
    ];
    if let Some(path) = &args.output {
        files::write(path, texts[2].1.as_bytes())?;
    }
    writeln!(out, "{}", vehicle.name)?;
    writeln!(out, "{}", report::worst::text(definition, &cases, &standing))?;
    let worst = cases.iter().filter(|case| case.method != Method::Sample);
    if let Some(case) = worst.min_by(|a, b| a.objective.total_cmp(&b.objective)) {
        writeln!(out, "What makes {} (score, share of the objective):", case.name)?;
        writeln!(out, "{}", report::worst::keys(&outline.draws, case))?;
    }
    writeln!(
        out,
        "{} corners and {} points with derivatives evaluated; {} of {} descents ended at a stationary point",
        work.corners, work.evaluations, work.converged, work.descents
    )?;
    for case in cases.iter().filter(|case| case.gap.is_some()) {
        let gap = report::significant(case.gap.unwrap_or_default());
        writeln!(out, "{}: at most {gap} more by the linear prediction", case.name)?;
    }
    if let Err(refused) = Method::Box.drawing().independent() {
        writeln!(out, "no share, quantile or tolerance bound follows from these cases: {refused}")?;
    }
    let found = Found {
        run: outline.identity(),
        aim,
        flight_times: plan.flight_times,
        box_sigma: args.sigma,
        radius_sigma: args.radius,
        cases,
    };
    for path in io::worst::write(&args.run.join(io::worst::FOLDER).join(&name), &found, texts)? {
        writeln!(out, "{}", path.display())?;
    }
    Ok(PASS)
}

/// What the arguments ask for.
fn aim(args: &Args, definition: &Definition) -> Result<(Aim, Vec<usize>), Error> {
    let variant = |option: &str, name: &String| {
        let names = || definition.variants.iter().map(|variant| variant.name.as_str());
        names().position(|known| known == name).ok_or_else(|| {
            let allowed = allowed_instead(name, names());
            Error::Usage(format!("--{option}: found \"{name}\"; allowed: {allowed}"))
        })
    };
    let last = definition.variants.len() - 1;
    let chosen = args.variant.as_ref().map_or(Ok(last), |name| variant("variant", name))?;
    let baseline = args.baseline.as_ref().map(|name| variant("baseline", name)).transpose()?;
    if baseline == Some(chosen) {
        return Err(Error::Usage("--baseline: found the variant itself; allowed: another".into()));
    }
    let mode = match &args.mode {
        None => 0,
        Some(name) => definition.modes.iter().position(|known| known == name).ok_or_else(|| {
            let allowed = allowed_instead(name, definition.modes.iter().map(String::as_str));
            Error::Usage(format!("--mode: found \"{name}\"; allowed: {allowed}"))
        })?,
    };
    let times = &definition.flight_times_s;
    let mut flight_times: Vec<usize> = Vec::new();
    for asked in &args.time {
        let known = times.iter().position(|time| time == asked).ok_or_else(|| {
            Error::Usage(format!("--time: found {asked}; allowed: one of {times:?}"))
        })?;
        flight_times.push(known);
    }
    if flight_times.is_empty() {
        flight_times.extend(0..times.len());
    }
    flight_times.sort_unstable();
    flight_times.dedup();
    let quantity = match args.objective {
        What::Damping => Quantity::DampingRatio,
        What::TimeToDouble => Quantity::Decay,
    };
    Ok((Aim { variant: chosen, baseline, mode, quantity }, flight_times))
}

/// Name of a search: what cases and folder are called by.
fn name(aim: &Aim, definition: &Definition) -> String {
    let variant = |index: usize| definition.variants[index].name.as_str();
    let mut name = format!("{}_{}", variant(aim.variant), definition.modes[aim.mode]);
    if let Some(baseline) = aim.baseline {
        name = format!("{name}_over_{}", variant(baseline));
    }
    if aim.quantity == Quantity::Decay {
        name += "_decay";
    }
    name
}

/// Rebuilds the worst case called `name`, and compares it with what the search stored.
///
/// # Errors
/// No such case; output that cannot be written.
pub fn replay(
    folder: &Path,
    name: &str,
    (stored, loaded): (&Run, &Loaded),
    (target, force): (Option<&Path>, bool),
    out: &mut dyn Write,
) -> Result<u8, Error> {
    let outline = stored.outline();
    let found = io::worst::read(folder, &outline.identity())?;
    let all = || found.iter().flat_map(|found| found.cases.iter().map(move |case| (found, case)));
    let Some((search, case)) = all().find(|(_, case)| case.name == name) else {
        let known: Vec<&str> = all().map(|(_, case)| case.name.as_str()).collect();
        let allowed = match known.is_empty() {
            true => "the name of a case that tvse worst found".to_owned(),
            false => allowed_instead(name, known),
        };
        return Err(Error::Usage(format!("--worst: found \"{name}\"; allowed: {allowed}")));
    };
    let population = Population {
        name: case.name.clone(),
        cases: 1,
        fixed: case.values.clone(),
        drawn: false,
        scheme: Scheme::MonteCarlo,
    };
    let definition = Definition {
        populations: vec![population],
        sensitivity: None,
        margins: None,
        ..outline.definition.clone()
    };
    let sampler = loaded.sampler(&definition)?;
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false)
        .map_err(|error| unprepared(Path::new(&loaded.run.0), &error))?;
    let mut replay = Replay::default();
    let mut unsolved = Vec::new();
    let record = evaluator.visit(0, 0, |view| {
        if let Err(failure) = replay.add(&definition, view) {
            unsolved.push(failure.to_string());
        }
    });
    let default = folder.join("replay").join(name);
    let files = replay.write(target.unwrap_or(&default), force || target.is_none())?;
    writeln!(out, "{}\n{}", vehicle.name, report::nominal::table(&definition, &record))?;
    for failure in unsolved {
        writeln!(out, "not solved: {failure}")?;
    }
    for file in files {
        writeln!(out, "{}", file.display())?;
    }
    let evaluations = record.evaluations.iter().filter(|evaluation| {
        (evaluation.variant, evaluation.flight_time) == (search.aim.variant, case.flight_time)
    });
    let poles = evaluations.filter_map(|evaluation| evaluation.outcome.as_ref().ok()).flatten();
    let same = |pole: &crate::campaign::Pole| {
        [pole.value.re, pole.value.im].map(f64::to_bits) == case.pole.map(f64::to_bits)
    };
    if poles.into_iter().any(same) {
        writeln!(out, "the pole is bit for bit as stored")?;
        return Ok(PASS);
    }
    writeln!(
        out,
        "the pole differs from that stored, {} ± {} i rad/s. Bits are kept by one program on one \
         instruction set: see manifest.json",
        case.pole[0], case.pole[1]
    )?;
    Ok(FAIL)
}
