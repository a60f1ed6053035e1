//! Synthetic runs on the disk, for tests.

use super::results::{Finished, Results};
use crate::campaign::pool::{Pool, spans};
use crate::campaign::{Outline, synthetic};
use crate::problem::Problems;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Carries out the synthetic run of an outline; case 19 of every population panics.
pub fn run(folder: &Path, outline: Outline, jobs: usize) -> Result<Finished, Problems> {
    let definition = outline.definition.clone();
    let poles = outline.poles;
    let mut results = Results::create(folder, outline)?;
    Pool::new(jobs).unwrap().run(
        &definition,
        &spans(&definition.populations),
        |population, case| {
            assert!(case != 19, "case 19 breaks");
            synthetic::evaluate(&definition, population, case, poles)
        },
        |record| results.push(record),
        |_| (),
        &AtomicBool::new(false),
    )?;
    results.finish(jobs, 3)
}
