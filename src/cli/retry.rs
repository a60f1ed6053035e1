//! `tvse retry`: evaluates cases of a finished run again.

use super::campaign::{self, evaluate, finish};
use super::interrupt::Interrupt;
use super::progress::{Show, Shown};
use super::{Error, PASS};
use crate::campaign::pool::{Pool, Span};
use crate::campaign::{Evaluator, StoredPoles};
use crate::io::store::{Access, Store};
use crate::io::{Results, Run, inputs};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Evaluates the failed cases of a finished run again, from the inputs stored with the run: the
/// same draws, the same program. What was found replaces their rows; all others stay as they are.
///
/// A failure that follows from the draws comes back; one of the machine (no memory, a panic) may not.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse retry runs/reference --failed")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// The cases with a failed evaluation
    #[arg(long, required = true)]
    failed: bool,
    /// Threads (default: all processors)
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// How progress is shown
    #[arg(long, value_enum, default_value_t = Show::Auto)]
    progress: Show,
}

/// Runs the command.
///
/// # Errors
/// No such run, damaged tables or inputs, another program or instruction set, a signal.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let stored = Run::open(&args.run)?;
    let failed = failed(&stored)?;
    let before = cases(&failed);
    if before == 0 {
        writeln!(out, "no case failed")?;
        return Ok(PASS);
    }
    let outline = stored.outline();
    let definition = &outline.definition;
    let loaded = inputs::read(&args.run, &outline.inputs)?;
    let sampler = loaded.sampler(definition)?;
    let all = outline.poles == StoredPoles::All;
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, definition, all)
        .map_err(|error| super::run::unprepared(Path::new(&loaded.run.0), &error))?;
    let jobs = args.jobs.map_or_else(campaign::processors, usize::from);
    let pool = Pool::new(jobs).map_err(|e| Error::Usage(format!("--jobs {jobs}: {e}")))?;
    let interrupt = Interrupt::listen().map_err(|e| Error::Usage(format!("signals: {e}")))?;
    let expected = outline.clone();
    let store = Store::resume(&args.run, expected, true, None, Access::Whole)?;
    let results = Results::of(store);
    campaign::say_mended(&results);
    let case = |population, case| evaluator.evaluate(population, case);
    let shown = Shown::new(args.progress, None);
    let results = evaluate(results, definition, &failed, &pool, shown, &interrupt, case)?;
    let code = finish(results, jobs, &vehicle.name, None, out)?;
    let after = cases(&self::failed(&Run::open(&args.run)?)?);
    writeln!(out, "{before} failed cases were evaluated again, {after} of them fail still")?;
    Ok(code)
}

fn cases(spans: &[Span]) -> u64 {
    spans.iter().map(|span| span.cases.end - span.cases.start).sum()
}

/// The failed cases of a run.
fn failed(run: &Run) -> Result<Vec<Span>, Error> {
    let mut spans: Vec<Span> = Vec::new();
    for population in 0..run.outline().definition.populations.len() {
        run.failures(population, |case, _| {
            match spans.last_mut() {
                Some(span) if span.population == population && span.cases.end == case => {
                    span.cases.end += 1;
                }
                _ => spans.push(Span { population, cases: case..case + 1 }),
            }
            Ok(())
        })?;
    }
    Ok(spans)
}
