//! Eigenvalue derivatives of a case: how a pole follows the normal score of every draw.
//!
//! `dλ/dz = −(yᴴ ∂L/∂z x)/(yᴴ L'(λ) x)`; the gradient of the form is made in `dynamics` and carried back
//! through the draw. Near veering the derivative is right but good for little: the second-order change by
//! the nearest poles says for how much.

use super::draw::Slots;
use super::draw::gradient::Back;
use crate::dispersion::{Affine, AffineGradient, Chain, Parameters};
use crate::dynamics::gradient::C;
use crate::dynamics::{DrawnVehicle, Effects, Plant, Vectors};
use crate::modal::Reference;
use crate::vehicle::Vehicle;

/// Second-order change of one σ, relative to the first-order one, beyond which a row is flagged: beyond a
/// tenth a derivative is no longer what a finite change does.
pub const LARGEST_CURVATURE: f64 = 0.1;

/// Change of a pole per σ of every draw, in the order of the draws: of the independent normal score of its
/// key, all others held.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Change of the damping ratio per σ, −; `None` where a key has no slope.
    pub damping_ratio: Vec<Option<f64>>,
    /// Change of the real part per σ, rad/s.
    pub real_part_rad_s: Vec<Option<f64>>,
    /// Second-order change of the pole by the nearest other poles, for one σ of each key in turn, over the
    /// first-order change (root sums of squares over the keys), −.
    pub curvature: Option<f64>,
}

impl Sensitivity {
    /// From the derivatives of a `pole`.
    pub fn new(pole: C, by_score: &[Option<C>], curvature: Option<f64>) -> Self {
        Self {
            damping_ratio: {
                let cube = pole.norm().powi(3);
                by_score.iter().map(|by| by.map(|by| damping_over(pole, cube, by))).collect()
            },
            real_part_rad_s: by_score.iter().map(|by| by.map(|by| by.re)).collect(),
            curvature,
        }
    }

    /// Whether a pole is so near that the derivatives hold for small changes only.
    pub fn is_veering(&self) -> bool {
        !self.curvature.is_some_and(|curvature| curvature <= LARGEST_CURVATURE)
    }
}

/// Change of the damping ratio −σ/|λ| of `pole` for the change `by` of the pole: −ω (ω dσ − σ dω)/|λ|³.
pub fn damping(pole: C, by: C) -> f64 {
    damping_over(pole, pole.norm().powi(3), by)
}

fn damping_over(pole: C, cube: f64, by: C) -> f64 {
    pole.im * (pole.re * by.im - pole.im * by.re) / cube
}

/// Where derivatives are taken.
pub struct Place<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// Its parameters.
    pub parameters: &'a Parameters,
    /// Per parameter, whether a draw acts on it.
    pub acts: &'a [bool],
    /// Per engine, whether a draw acts on one of its parameters.
    pub engines: &'a [bool],
    /// From draws to the drawn vehicle at the flight time.
    pub slots: &'a Slots,
    /// The plant of the variant.
    pub plant: &'a Plant,
    /// What acts.
    pub effects: &'a Effects,
    /// Effect on each parameter.
    pub draws: &'a [Affine],
    /// From these to the scores; empty where no derivative is asked for.
    pub chain: &'a Chain<'a>,
    /// The drawn vehicle.
    pub drawn: &'a DrawnVehicle,
}

impl Place<'_> {
    /// The derivative of a pole by the independent score of every draw, rad/s.
    pub fn by_score(&self, pole: &Reference) -> Vec<Option<C>> {
        let scale = -pole.derivative().inv();
        let form = self.form_by_score(pole.pair.pole, pole, pole);
        form.into_iter().map(|by| by.map(|by| by * scale)).collect()
    }

    /// [`Sensitivity`] of a pole, `near` being the poles of the same model that are nearest to it.
    pub fn sensitivity(
        &self,
        pole: &Reference,
        near: impl IntoIterator<Item = Reference>,
    ) -> Sensitivity {
        let by_score = self.by_score(pole);
        let squares = |of: &[Option<C>]| of.iter().flatten().map(|by| by.norm_sqr()).sum::<f64>();
        let second: f64 = near.into_iter().map(|near| self.second_order(pole, &near)).sum();
        let curvature = (second / squares(&by_score)).sqrt();
        let finite = Some(curvature).filter(|curvature| curvature.is_finite());
        Sensitivity::new(pole.pair.pole, &by_score, finite)
    }

    /// Sum of squares over the draws of `½ λ''` as far as one other pole makes it:
    /// `(y_kᴴ L_z x_j)(y_jᴴ L_z x_k) / (n_k n_j (λ_k − λ_j))` with n = yᴴ L' x.
    fn second_order(&self, pole: &Reference, near: &Reference) -> f64 {
        let s = pole.pair.pole;
        let there = self.form_by_score(s, pole, near);
        let back = self.form_by_score(s, near, pole);
        let scale = pole.derivative() * near.derivative() * (s - near.pair.pole);
        let both = there.into_iter().zip(back);
        both.filter_map(|(a, b)| Some((a? * b?).norm_sqr())).sum::<f64>() / scale.norm_sqr()
    }

    /// Gradient of yᴴ L(s) x by the scores, y of `left` and x of `right`.
    fn form_by_score(&self, s: C, left: &Reference, right: &Reference) -> Vec<Option<C>> {
        let conjugate: Vec<C> = left.pair.left.iter().map(|z| z.conj()).collect();
        let vectors = Vectors { s, left: &conjugate, right: &right.pair.right };
        let gradient = self.plant.gradient(self.drawn, self.effects, &vectors, self.engines);
        let effects: Vec<AffineGradient> = self.slots.pull(&Back {
            vehicle: self.vehicle,
            parameters: self.parameters,
            effects: self.draws,
            acts: self.acts,
            engines: self.engines,
            plant: self.plant,
            drawn: self.drawn,
            gradient: &gradient,
        });
        self.chain.gradient(&effects)
    }
}
