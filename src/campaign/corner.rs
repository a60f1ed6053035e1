//! Adverse corners: which side of its `worst` pair lowers the damping of a mode, draw by draw.
//!
//! Each side of each draw is one case with all else nominal; the search for the worst combination
//! is not here.

use super::definition::Solver;
use super::evaluator::{self, Evaluator};
use super::pool::{Pool, spans};
use super::{Definition, Population, Record};
use crate::dispersion::{Dispersion, Sampler, Scheme};
use crate::vehicle::Vehicle;
use std::convert::Infallible;
use std::sync::atomic::AtomicBool;

/// Why the sides of a corner could not be chosen.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The evaluation could not be prepared.
    #[error("{0}")]
    Evaluator(#[from] evaluator::Error),
    /// Both sides of a draw failed.
    #[error("`{key}` fails at both of its `worst` values: {message}")]
    BothFailed {
        /// The draw key.
        key: String,
        /// Why, at the high side.
        message: String,
    },
    /// The search was stopped before its end.
    #[error("stopped")]
    Stopped,
}

/// The adverse side of each of `draws` (indices of draws that have `worst` values): the one that
/// gives `mode` in `variant` (indices in `definition`) the lesser damping ratio, at its least over
/// the flight times and over both branches. All other draws are nominal. An impossible side loses.
/// Once `stop` is set no case is begun.
///
/// # Errors
/// See [`Error`].
pub fn adverse_sides(
    vehicle: &Vehicle,
    dispersion: &Dispersion,
    definition: &Definition,
    draws: &[usize],
    (mode, variant): (usize, usize),
    pool: &Pool,
    stop: &AtomicBool,
) -> Result<Vec<(usize, f64)>, Error> {
    let sides = |&draw: &usize| {
        let worst = dispersion.draws()[draw].worst.unwrap_or_default();
        worst.map(|value| Population {
            name: String::new(),
            cases: 1,
            fixed: vec![(draw, value)],
            drawn: false,
            scheme: Scheme::MonteCarlo,
        })
    };
    let trial = Definition {
        populations: draws.iter().flat_map(sides).collect(),
        variants: vec![definition.variants[variant].clone()],
        modes: vec![definition.modes[mode].clone()],
        margins: None,
        sensitivity: None,
        // Where both sides are equal rounding chooses; it is that of one solver, whatever the run's.
        solver: Solver::Dense,
        ..definition.clone()
    };
    let sampler = Sampler::new(dispersion, definition.seed);
    let evaluator = Evaluator::new(vehicle, &sampler, &trial, false)?;
    let mut records = Vec::new();
    let done: Result<_, Infallible> = pool.run(
        &trial,
        &spans(&trial.populations),
        |population, case| evaluator.evaluate(population, case),
        |record| {
            records.push(record);
            Ok(())
        },
        |_| (),
        stop,
    );
    match done {
        Ok(progress) if progress.done < progress.total => return Err(Error::Stopped),
        Ok(_) => {}
        Err(never) => match never {},
    }
    let mut chosen = Vec::new();
    for (pair, &draw) in records.chunks_exact(2).zip(draws) {
        let worst = dispersion.draws()[draw].worst.unwrap_or_default();
        let side = match (least_damping(&pair[0]), least_damping(&pair[1])) {
            (Some(low), Some(high)) => usize::from(high < low),
            (Some(_), None) => 0,
            (None, Some(_)) => 1,
            (None, None) => {
                let message = pair[1].failure().map(ToString::to_string).unwrap_or_default();
                let key = dispersion.draws()[draw].key.clone();
                return Err(Error::BothFailed { key, message });
            }
        };
        chosen.push((draw, worst[side]));
    }
    Ok(chosen)
}

/// Least damping ratio of the named poles of a record, `None` if an evaluation failed.
fn least_damping(record: &Record) -> Option<f64> {
    let mut least = f64::INFINITY;
    for evaluation in &record.evaluations {
        for pole in evaluation.outcome.as_ref().ok()?.iter().filter(|pole| pole.mode.is_some()) {
            let damping = pole.damping_ratio();
            // Not `min`, which would pass a NaN over.
            if !(damping >= least) {
                least = damping;
            }
        }
    }
    least.is_finite().then_some(least)
}
