//! Synthetic runs on the disk, for tests.

use super::results::{Finished, Opening, Results};
use super::store::{Access, Store};
use crate::campaign::pool::{Part, Pool};
use crate::campaign::{Outline, synthetic};
use crate::problem::Problems;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Carries out the synthetic run of an outline; case 19 of every population panics.
pub fn run(folder: &Path, outline: Outline, jobs: usize) -> Result<Finished, Problems> {
    evaluate(Results::create(folder, outline)?, jobs, u64::MAX)?.finish(jobs, 3)
}

/// Goes on with a synthetic run, or begins it, and finishes it.
pub fn resume(folder: &Path, outline: Outline, jobs: usize) -> Result<Finished, Problems> {
    let again = Opening::Resume { cases: true };
    let results = Results::open(folder, outline, None, again, Access::Whole)?;
    evaluate(results, jobs, u64::MAX)?.finish(jobs, 3)
}

/// Evaluates one part of a synthetic run.
pub fn part(folder: &Path, outline: Outline, part: Part) -> Result<Results, Problems> {
    let again = Opening::Resume { cases: true };
    let results = Results::open(folder, outline, None, again, Access::Part(part))?;
    evaluate(results, 2, u64::MAX)
}

/// Makes the tables of a synthetic run from its parts.
pub fn merge(folder: &Path, from: &[std::path::PathBuf]) -> Result<Finished, Problems> {
    Results::of(Store::gather(folder, from)?).finish(1, 3)
}

/// Evaluates what is missing, a shard every 40 cases, and stops after so many cases.
pub fn evaluate(mut results: Results, jobs: usize, most: u64) -> Result<Results, Problems> {
    let outline = results.store().outline().clone();
    let definition = &outline.definition;
    let missing = results.store().missing();
    let stop = AtomicBool::new(most == 0);
    let mut done = 0;
    Pool::new(jobs).unwrap().run(
        definition,
        &missing,
        |population, case| {
            assert!(case != 19, "case 19 breaks");
            synthetic::evaluate(definition, population, case, outline.poles)
        },
        |record| {
            done += 1;
            stop.store(done >= most, Ordering::Relaxed);
            results.push(record)?;
            if done % 40 == 0 { results.checkpoint() } else { Ok(()) }
        },
        |_| (),
        &stop,
    )?;
    results.checkpoint()?;
    Ok(results)
}
