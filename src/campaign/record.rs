//! The record of one case: its draws and what was found, failures included.
//!
//! A record is a value; how it is stored is decided in `io`.

use super::definition::Solver;
use super::derivative::Sensitivity;
use super::loops::Loops;
use crate::dynamics::Part;
use nalgebra::Complex;

/// Why an evaluation failed. An unstable pole is a result, not a failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FailureKind {
    /// A draw is impossible, for instance a negative inertia.
    Draw,
    /// The model could not be built from the drawn vehicle.
    Build,
    /// The mass matrix is not positive definite.
    SingularMass,
    /// The eigen-solver did not converge.
    NoConvergence,
    /// A matrix or a pole is not finite.
    NonFinite,
    /// A residual or trace check is beyond its bound.
    Residual,
    /// A named mode could not be followed from the nominal to the case.
    IdentityLost,
    /// The response of a flight control loop could not be followed.
    Loop,
    /// The program panicked inside the case.
    Panic,
}

impl FailureKind {
    /// Every kind, in the order of declaration.
    pub const ALL: [Self; 9] = [
        Self::Draw,
        Self::Build,
        Self::SingularMass,
        Self::NoConvergence,
        Self::NonFinite,
        Self::Residual,
        Self::IdentityLost,
        Self::Loop,
        Self::Panic,
    ];

    /// The word stored in the `status` columns.
    pub fn name(self) -> &'static str {
        match self {
            Self::Draw => "draw",
            Self::Build => "build",
            Self::SingularMass => "singular_mass",
            Self::NoConvergence => "no_convergence",
            Self::NonFinite => "non_finite",
            Self::Residual => "residual",
            Self::IdentityLost => "identity_lost",
            Self::Loop => "loop",
            Self::Panic => "panic",
        }
    }
}

/// A failed evaluation: its kind and what happened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {message}", kind.name())]
pub struct Failure {
    /// Kind.
    pub kind: FailureKind,
    /// Message with the names and numbers involved.
    pub message: String,
}

impl Failure {
    /// A failure of `kind` with a message.
    pub fn new(kind: FailureKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }
}

/// Which pole of a named mode a row holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Branch {
    /// The pole identified as the named mode.
    Primary,
    /// The pole with which the named mode exchanges character.
    Partner,
    /// A pole that belongs to no named mode (stored with `--poles all`).
    Other,
}

impl Branch {
    /// The word stored in the `branch` column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Partner => "partner",
            Self::Other => "other",
        }
    }
}

/// One pole of one evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct Pole {
    /// Index of the named mode in the run definition; `None` for [`Branch::Other`].
    pub mode: Option<usize>,
    /// Which pole of the named mode.
    pub branch: Branch,
    /// Modal label that the pole carries; `None` where it carries none (an actuator pole).
    pub label: Option<String>,
    /// The pole, rad/s, with non-negative imaginary part.
    pub value: Complex<f64>,
    /// Two-sided overlap with the nominal pole of the same name, modulus, −; `None` for other poles.
    pub identity_confidence: Option<f64>,
    /// Sums of the participation factors of the states of each part, −, in the order of
    /// [`Part::ALL`].
    pub participation: Option<[f64; Part::ALL.len()]>,
    /// Relative residual of the eigenpair, −; `None` where no vector was computed.
    pub residual: Option<f64>,
    /// Bound of the pole's error, rad/s: by discs where the certificate says so, else to first order from the
    /// residual; `None` where there is none.
    pub error_bound: Option<f64>,
    /// Derivatives, where the run stores them.
    pub sensitivity: Option<Box<Sensitivity>>,
}

impl Pole {
    /// Frequency |Im s|/2π, Hz.
    pub fn frequency_hz(&self) -> f64 {
        frequency_hz(self.value)
    }

    /// Damping ratio −Re s/|s|, −; not finite for a pole at the origin.
    pub fn damping_ratio(&self) -> f64 {
        damping_ratio(self.value)
    }

    /// Time to double ln 2/Re s, s, where Re s > 0.
    pub fn time_to_double_s(&self) -> Option<f64> {
        (self.value.re > 0.0).then(|| std::f64::consts::LN_2 / self.value.re)
    }
}

/// Frequency |Im s|/2π of a pole in rad/s, Hz.
pub fn frequency_hz(pole: Complex<f64>) -> f64 {
    pole.im.abs() / std::f64::consts::TAU
}

/// Damping ratio −Re s/|s| of a pole, −; not finite at the origin.
pub fn damping_ratio(pole: Complex<f64>) -> f64 {
    -pole.re / pole.norm()
}

/// What proves the poles of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certificate {
    /// Disjoint discs with one pole each, as many as there are poles.
    Discs,
    /// Disjoint discs, of which some hold several poles that cannot be told apart.
    Clusters,
    /// Residuals of the pairs, sums of poles against traces: of a dense solve; or of a structured one of a model with a full
    /// part, where the residuals' discs do not meet.
    Residual,
    /// Residuals of the pairs near the modes of interest, whose discs do not meet, of a structured solve of a model with a full
    /// part; all other poles are proven without it alone.
    Near,
}

impl Certificate {
    /// Every certificate, in the order of declaration.
    pub const ALL: [Self; 4] = [Self::Discs, Self::Clusters, Self::Residual, Self::Near];

    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Discs => "discs",
            Self::Clusters => "clusters",
            Self::Residual => "residual",
            Self::Near => "near",
        }
    }
}

/// How the poles of an evaluation were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Solution {
    /// Solver that gave them.
    pub solver: Solver,
    /// What proves them.
    pub certificate: Certificate,
    /// Determinants evaluated, also where the dense solver answered in the end.
    pub determinants: usize,
}

/// One evaluation of a case: one variant at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Index of the variant in the run definition.
    pub variant: usize,
    /// Index of the flight time in the run definition.
    pub flight_time: usize,
    /// Number of poles at the origin known by construction, beside those solved for.
    pub null_poles: usize,
    /// How the poles were found; `None` where they were not.
    pub solution: Option<Solution>,
    /// The poles asked for, named modes first in the order of the run definition, or a failure.
    pub outcome: Result<Vec<Pole>, Failure>,
    /// The flight control loops, where they are assessed.
    pub loops: Option<Result<Loops, Failure>>,
}

/// One case: the draws of one dispersed vehicle and all its evaluations.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Index of the population in the run's list of populations.
    pub population: usize,
    /// Case index inside the population.
    pub case: u64,
    /// Drawn value per draw key, in the order of the dispersion's keys; `None` where it stays nominal.
    pub values: Vec<Option<f64>>,
    /// Normal score Φ⁻¹(F(x)) per draw key; `None` where it stays nominal or the law cannot
    /// give it.
    pub scores: Vec<Option<f64>>,
    /// Evaluations ordered by flight time, then variant.
    pub evaluations: Vec<Evaluation>,
}

impl Evaluation {
    /// Why there are no poles, or else no margins.
    pub fn failure(&self) -> Option<&Failure> {
        let loops = self.loops.as_ref().and_then(|loops| loops.as_ref().err());
        self.outcome.as_ref().err().or(loops)
    }
}

impl Record {
    /// Whether a named mode is unstable in some evaluation.
    pub fn unstable(&self) -> bool {
        let poles = self.evaluations.iter().filter_map(|e| e.outcome.as_ref().ok()).flatten();
        poles.into_iter().any(|pole| pole.mode.is_some() && pole.value.re > 0.0)
    }

    /// The first failure of the case, in the order of its evaluations.
    pub fn failure(&self) -> Option<&Failure> {
        self.evaluations.iter().find_map(Evaluation::failure)
    }

    /// The record with every evaluation that lacks a primary pole of one of the `modes` named
    /// modes, or a damping ratio of one of their poles, turned into a failure.
    pub fn checked(mut self, modes: usize) -> Self {
        for evaluation in &mut self.evaluations {
            let Ok(poles) = &evaluation.outcome else { continue };
            let named = poles.iter().filter(|pole| pole.mode.is_some());
            let failure = if let Some(pole) = named.clone().find(|p| !p.damping_ratio().is_finite())
            {
                let message = format!("the pole {} has no damping ratio", pole.value);
                Failure::new(FailureKind::NonFinite, message)
            } else if let Some(lost) = (0..modes).find(|mode| {
                !named.clone().any(|p| p.mode == Some(*mode) && p.branch == Branch::Primary)
            }) {
                let message = format!("no pole of the named mode {lost}");
                Failure::new(FailureKind::IdentityLost, message)
            } else {
                continue;
            };
            evaluation.outcome = Err(failure);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic;
    use super::*;

    #[test]
    fn an_evaluation_without_a_finite_pole_of_every_named_mode_is_a_failure() {
        let definition = synthetic::definition(&[3]);
        let whole = synthetic::record(&definition, 0, 2);
        assert_eq!(whole.clone().checked(2), whole);
        let mut damaged = whole.clone();
        damaged.evaluations[0].outcome.as_mut().unwrap()[0].value.re = f64::NAN;
        damaged.evaluations[1].outcome.as_mut().unwrap().pop();
        let checked = damaged.checked(2);
        let kind = |index: usize| checked.evaluations[index].outcome.as_ref().map_err(|f| f.kind);
        assert_eq!(kind(0), Err(FailureKind::NonFinite));
        assert_eq!(kind(1), Err(FailureKind::IdentityLost));
        assert_eq!(checked.evaluations[2..], whole.evaluations[2..]);
    }
}
