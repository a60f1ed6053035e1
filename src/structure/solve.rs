//! From a stick model to labelled mode sets at flight times.
//!
//! It puts the parts together; reading text is `stick`, writing packages is `io::package`.

use super::label::{self, Thresholds};
use super::weigh::FREEDOMS;
use super::{Rigid, Stick, free_free, weigh};
use crate::vehicle::{Modal, Mode, ModeSet};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Why a stick model has no modes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A table does not reach the flight time.
    #[error("`{what}` is not tabulated at the flight time {time_s} s")]
    Time {
        /// Flight time, s.
        time_s: f64,
        /// Name of the mass.
        what: String,
    },
    /// The flight times are not finite and increasing.
    #[error("flight times must be finite and strictly increasing")]
    Times,
    /// The model weighs nothing.
    #[error("the model has no mass at the flight time {time_s} s")]
    NoInertia {
        /// Flight time, s.
        time_s: f64,
    },
    /// Some rigid motion meets no inertia.
    #[error(
        "a rigid translation or rotation meets no inertia: some mass must take part in axial \
         motion and some in torsion, or lie off the axis"
    )]
    Massless,
    /// Motions without strain besides the six of the rigid body.
    #[error(
        "{zero_modes} modes without strain where a free body has 6: a mechanism or a loose part \
         moves at grid `{grid}`"
    )]
    Mechanism {
        /// Number of modes without strain.
        zero_modes: usize,
        /// Grid that moves in the first of the surplus ones.
        grid: String,
    },
    /// Nothing is left of the modes.
    #[error("no elastic mode is selected at the flight time {time_s} s")]
    NoModes {
        /// Flight time, s.
        time_s: f64,
    },
    /// The eigen-solver gave up, or the matrices are not finite.
    #[error("the eigenvalue solver did not converge: the values are too large or too small")]
    NoConvergence,
}

/// Which elastic modes are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Selection {
    /// All up to a frequency, Hz.
    UpTo(f64),
    /// The lowest ones, as many as there are.
    Count(usize),
}

/// Elastic modes at one flight time, without labels, and the quality of the rigid-body modes.
///
/// # Errors
/// See [`Error`].
pub fn mode_set(
    stick: &Stick,
    time_s: f64,
    selection: Selection,
) -> Result<(ModeSet, Rigid), Error> {
    let model = weigh::weigh(stick, time_s)?;
    let (limit, count) = match selection {
        Selection::UpTo(hz) => ((TAU * hz).powi(2), usize::MAX),
        Selection::Count(count) => (f64::INFINITY, count),
    };
    let solved = free_free::free_free(&model, limit, count)?;
    let modes = solved.omega2.iter().enumerate().map(|(j, omega2)| {
        let part = |node: usize, at: usize| {
            Vector3::from_fn(|i, _| solved.shapes[(FREEDOMS * node + at + i, j)])
        };
        let (shape, slope) = (model.links.iter())
            .map(|&(node, arm)| {
                let slope = part(node, 3);
                (part(node, 0) + slope.cross(&arm), slope)
            })
            .unzip();
        Mode { label: String::new(), frequency_hz: omega2.sqrt() / TAU, shape, slope }
    });
    let modes = modes.collect();
    Ok((
        ModeSet { flight_time_s: time_s, body: model.body, grids: model.grids, modes },
        solved.rigid,
    ))
}

/// Labelled modes at all of `times_s`, and the quality of the rigid-body modes at each; with
/// [`Selection::Count`] a model gives any number of modes, for instance to benches.
///
/// # Errors
/// See [`Error`].
pub fn solve(
    stick: &Stick,
    times_s: &[f64],
    selection: Selection,
    thresholds: &Thresholds,
) -> Result<(Modal, Vec<Rigid>), Error> {
    if !(times_s.iter().all(|t| t.is_finite()) && times_s.windows(2).all(|w| w[0] < w[1])) {
        return Err(Error::Times);
    }
    let (mut sets, mut rigid) = (Vec::new(), Vec::new());
    for &time_s in times_s {
        let (set, quality) = mode_set(stick, time_s, selection)?;
        if set.modes.is_empty() {
            return Err(Error::NoModes { time_s });
        }
        sets.push(set);
        rigid.push(quality);
    }
    let parents = label::label(&mut sets, thresholds);
    let modal = Modal {
        source: format!("stick model: {}", stick.name),
        contains_engines: Vec::new(),
        contains_tanks: Vec::new(),
        sets,
        parents,
    };
    Ok((modal, rigid))
}
