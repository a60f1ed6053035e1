//! What is made worst: an objective of the poles of a case, with its gradient by the draws' independent
//! scores, along a path on which the poles are followed.

use super::descent::At;
use crate::campaign::derivative::damping;
use crate::campaign::evaluator::{Evaluator, Followed};
use crate::campaign::record::{Failure, FailureKind};
use crate::dispersion::Dispersion;
use crate::modal::Reference;
use crate::modal::identify::STEP_OVERLAP;
use serde::{Deserialize, Serialize};

/// What of a pole is made least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// The damping ratio.
    DampingRatio,
    /// The rate of decay −Re s, rad/s: of an unstable pole, its shortest time to double.
    Decay,
}

/// Where and what is made least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Aim {
    /// Index of the variant.
    pub variant: usize,
    /// Index of the variant from which it is counted, on the same draws: what is made least is the gain
    /// over it.
    pub baseline: Option<usize>,
    /// Index of the mode.
    pub mode: usize,
    /// What.
    pub quantity: Quantity,
}

impl Quantity {
    /// Its value for a pole.
    pub fn of(self, pole: nalgebra::Complex<f64>) -> f64 {
        match self {
            Self::DampingRatio => -pole.re / pole.norm(),
            Self::Decay => -pole.re,
        }
    }

    fn gradient(self, followed: &Followed) -> Vec<f64> {
        let pole = followed.pole.value;
        let by = followed.by_score.iter();
        by.map(|by| match (by, self) {
            (None, _) => 0.0,
            (Some(by), Self::DampingRatio) => damping(pole, *by),
            (Some(by), Self::Decay) => -by.re,
        })
        .collect()
    }
}

/// The poles at a point of a path, in the variant and in the baseline.
#[derive(Debug, Clone)]
pub struct Spot {
    /// The pole of the variant, rad/s.
    pub pole: nalgebra::Complex<f64>,
    /// The poles followed.
    references: Vec<Reference>,
    /// Whether each was the only pole that could be the mode.
    alone: Vec<bool>,
}

/// An objective at one flight time.
pub struct Objective<'a, 'e> {
    /// Evaluates.
    pub evaluator: &'a Evaluator<'e>,
    /// From scores to values.
    pub dispersion: &'a Dispersion,
    /// What is made least.
    pub aim: Aim,
    /// Index of the flight time.
    pub flight_time: usize,
}

impl Objective<'_, '_> {
    /// Variants that are looked at, with the sign of their share.
    fn sides(&self) -> impl Iterator<Item = (usize, f64)> {
        let baseline = self.aim.baseline.map(|variant| (variant, -1.0));
        std::iter::once((self.aim.variant, 1.0)).chain(baseline)
    }

    fn poles(
        &self,
        z: &[Option<f64>],
        variant: usize,
        derivatives: bool,
    ) -> Result<Vec<Followed>, Failure> {
        let values = self.dispersion.values_at(z);
        self.evaluator.follow(&values, [self.flight_time, variant, self.aim.mode], derivatives)
    }

    /// The value alone, by the rule of the campaign: of each variant the less stable of the poles that may
    /// be the mode.
    ///
    /// # Errors
    /// As an evaluation fails.
    pub fn value(&self, z: &[Option<f64>]) -> Result<f64, Failure> {
        let mut value = 0.0;
        for (variant, sign) in self.sides() {
            let poles = self.poles(z, variant, false)?;
            let of = |followed: &Followed| self.aim.quantity.of(followed.pole.value);
            value += sign * poles.iter().map(of).fold(f64::INFINITY, f64::min);
        }
        Ok(value)
    }

    /// The objective with its gradient by the rule of the campaign, as [`Objective::value`].
    ///
    /// # Errors
    /// As an evaluation fails.
    pub fn fresh(&self, z: &[Option<f64>]) -> Result<At<Spot>, Failure> {
        self.choose(z, |_, poles| {
            let of = |at: usize| self.aim.quantity.of(poles[at].pole.value);
            (0..poles.len()).min_by(|a, b| of(*a).total_cmp(&of(*b)))
        })
        .and_then(|found| {
            let message = "the objective or its gradient is not finite";
            found.ok_or_else(|| Failure::new(FailureKind::NonFinite, message))
        })
    }

    /// The objective of the poles that `from` follows; `None` where an evaluation fails or a pole cannot be
    /// told: where several may be the mode, the one followed must overlap as in a step of a homotopy.
    pub fn followed(&self, z: &[Option<f64>], from: &Spot) -> Option<At<Spot>> {
        self.choose(z, |side, poles| {
            let overlap = |at: &usize| from.references[side].overlap(&poles[*at].reference).norm();
            let best = (0..poles.len()).max_by(|a, b| overlap(a).total_cmp(&overlap(b)))?;
            let sure = poles.len() == 1 && from.alone[side];
            (sure || overlap(&best) >= STEP_OVERLAP).then_some(best)
        })
        .ok()
        .flatten()
    }

    fn choose(
        &self,
        z: &[Option<f64>],
        choice: impl Fn(usize, &[Followed]) -> Option<usize>,
    ) -> Result<Option<At<Spot>>, Failure> {
        let mut value = 0.0;
        let mut gradient = vec![0.0; self.dispersion.draws().len()];
        let mut pole = None;
        let (mut references, mut alone) = (Vec::new(), Vec::new());
        for (side, (variant, sign)) in self.sides().enumerate() {
            let mut poles = self.poles(z, variant, true)?;
            let Some(chosen) = choice(side, &poles) else { return Ok(None) };
            alone.push(poles.len() == 1);
            let chosen = poles.swap_remove(chosen);
            value += sign * self.aim.quantity.of(chosen.pole.value);
            for (sum, by) in gradient.iter_mut().zip(self.aim.quantity.gradient(&chosen)) {
                *sum += sign * by;
            }
            pole.get_or_insert(chosen.pole.value);
            references.push(chosen.reference);
        }
        let pole = pole.expect("an aim has a variant");
        let finite = value.is_finite() && gradient.iter().all(|g| g.is_finite());
        Ok(finite.then_some(At { value, gradient, point: Spot { pole, references, alone } }))
    }
}
