//! Gradients by independent normal scores: from the effects on parameters back to the draw keys.
//!
//! Every key has one independent standard normal score: a common score itself, the individual score of a
//! key that takes part in one, in a group of correlated keys the one from which its score is made, else the
//! score of its own value. What a parameter does is not known here.

use super::correlation::Group;
use super::draw::{Dispersion, Role};
use super::law::Position;
use super::parameter::Place;
use super::sampler::Draws;
use nalgebra::Complex;

/// A complex gradient by scale and offset of the effect on one parameter, see [`super::Affine`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AffineGradient {
    /// By the scale.
    pub scale: Complex<f64>,
    /// By the offset.
    pub offset: Complex<f64>,
}

/// What a gradient by the effect on a parameter adds to that by the independent score of a draw.
#[derive(Debug, Clone, Copy)]
struct Term {
    parameter: usize,
    draw: usize,
    scale: f64,
    offset: f64,
}

/// The way from the effects on parameters back to the independent scores at the draws of one case: linear,
/// so that it is made once however many gradients take it.
#[derive(Debug, Clone, Default)]
pub struct Chain<'a> {
    /// Zero, or none where a value has no slope.
    start: Vec<Option<Complex<f64>>>,
    terms: Vec<Term>,
    groups: &'a [Group],
}

impl Chain<'_> {
    /// The gradient by the independent score of every draw, from that by the effects on parameters. `None`
    /// where the value has no slope: a discrete law, a value that its law cannot give.
    pub fn gradient(&self, effects: &[AffineGradient]) -> Vec<Option<Complex<f64>>> {
        let mut found = self.start.clone();
        for term in &self.terms {
            let by = effects[term.parameter];
            if let Some(found) = &mut found[term.draw] {
                *found += by.scale * term.scale + by.offset * term.offset;
            }
        }
        for group in self.groups {
            let by: Vec<_> = group.draws.iter().map(|&i| found[i].unwrap_or_default()).collect();
            for (&index, by) in group.draws.iter().zip(group.pull(&by)) {
                found[index] = found[index].and(Some(by));
            }
        }
        found
    }
}

/// Weight of the individual score beside a common one of weight w, √(1 − w²).
fn rest(weight: f64) -> f64 {
    ((1.0 - weight) * (1.0 + weight)).sqrt()
}

impl Dispersion {
    /// Per parameter, whether a draw acts on it.
    pub fn acts(&self) -> Vec<bool> {
        let mut acts = vec![false; self.parameters().count()];
        for combination in self.combinations() {
            acts[combination.parameter] = true;
        }
        acts
    }

    /// Per engine, of as many, whether a draw acts on one of its parameters.
    pub fn acts_on_engines(&self, engines: usize) -> Vec<bool> {
        let mut acts = vec![false; engines];
        for combination in self.combinations() {
            match self.parameters().all()[combination.parameter].place {
                Place::Engine(engine) | Place::Actuator(engine, _) | Place::Gimbal(engine, _) => {
                    acts[engine] = true;
                }
                _ => {}
            }
        }
        acts
    }

    /// The [`Chain`] at the draws of a case.
    ///
    /// A draw that stays nominal counts as one at its median; one of the `fixed` draws (index and value)
    /// does not move with its common score.
    pub fn chain(&self, draws: &Draws, fixed: &[(usize, f64)]) -> Chain<'_> {
        let all = self.draws();
        let slope = |(index, draw): (usize, &super::Draw)| {
            let (value, score) = match (draws.values[index], draws.scores[index]) {
                (Some(value), score) => (value, score?),
                (None, _) => (draw.law.value(&Position::of_score(0.0)), 0.0),
            };
            draw.law.slope(value, score)
        };
        let slopes: Vec<Option<f64>> = all.iter().enumerate().map(slope).collect();
        let mut held = vec![false; all.len()];
        fixed.iter().for_each(|(index, _)| held[*index] = true);
        let mut terms = Vec::with_capacity(2 * all.len());
        let mut add = |parameter: usize, index: usize, scale: f64, offset: f64| {
            let Some(slope) = slopes[index] else { return };
            let mut to = |draw, factor| {
                let [scale, offset] = [scale, offset].map(|by| by * factor);
                terms.push(Term { parameter, draw, scale, offset });
            };
            match &all[index].role {
                Role::Value { common: Some(shared), .. } if !held[index] => {
                    to(shared.draw, slope * shared.weight);
                    to(index, slope * rest(shared.weight));
                }
                _ => to(index, slope),
            }
        };
        let value = |index: usize| draws.values[index];
        for combination in self.combinations() {
            let parameter = combination.parameter;
            let base = combination.absolute.and_then(value);
            // By the product of all factors: of the nominal or the absolute value.
            let [scale, offset] = base.map_or([1.0, 0.0], |base| [0.0, base]);
            let product_without = |left_out: Option<usize>| -> f64 {
                let others = combination.scales.iter().filter(|&&i| Some(i) != left_out);
                others.filter_map(|&i| value(i)).product()
            };
            if let Some(index) = combination.absolute {
                add(parameter, index, 0.0, product_without(None));
            }
            for &index in &combination.scales {
                let product = product_without(Some(index));
                add(parameter, index, scale * product, offset * product);
            }
            for &index in &combination.offsets {
                add(parameter, index, 0.0, 1.0);
            }
        }
        let found = slopes.iter().zip(all).map(|(slope, draw)| {
            (slope.is_some() || draw.role == Role::Common).then_some(Complex::ZERO)
        });
        Chain { start: found.collect(), terms, groups: self.groups() }
    }

    /// The values of all draws at independent scores, index and value; draws without a score are left out.
    pub fn values_at(&self, scores: &[Option<f64>]) -> Vec<(usize, f64)> {
        let mut values = Vec::new();
        let mut individual = scores.to_vec();
        for group in self.groups() {
            let independent: Vec<f64> =
                group.draws.iter().map(|&i| scores[i].unwrap_or(0.0)).collect();
            let mut correlated = independent.clone();
            group.correlate(&independent, &mut correlated);
            for (&index, score) in group.draws.iter().zip(correlated) {
                individual[index] = individual[index].and(Some(score));
            }
        }
        for (index, draw) in self.draws().iter().enumerate() {
            let own = individual[index];
            let score = match &draw.role {
                Role::Value { common: Some(shared), .. } => {
                    let common = scores[shared.draw].map(|z| shared.weight * z);
                    let own = own.map(|z| rest(shared.weight) * z);
                    match (common, own) {
                        (None, None) => None,
                        (common, own) => Some(common.unwrap_or(0.0) + own.unwrap_or(0.0)),
                    }
                }
                _ => own,
            };
            values.extend(score.map(|z| (index, draw.law.value(&Position::of_score(z)))));
        }
        values
    }

    /// Independent scores of drawn values, the inverse of [`Dispersion::values_at`]; `None` where a draw
    /// stays nominal or has no score.
    pub fn scores_of(&self, draws: &Draws) -> Vec<Option<f64>> {
        let own = |(index, draw): (usize, &super::Draw)| {
            let score = draws.scores[index]?;
            let Role::Value { common: Some(shared), .. } = &draw.role else { return Some(score) };
            let common = draws.scores[shared.draw].unwrap_or(0.0);
            let rest = rest(shared.weight);
            // With all of the weight on the common score there is nothing of its own.
            Some(if rest > 0.0 { (score - shared.weight * common) / rest } else { 0.0 })
        };
        let mut found: Vec<Option<f64>> = self.draws().iter().enumerate().map(own).collect();
        for group in self.groups() {
            let correlated: Vec<f64> =
                group.draws.iter().map(|&i| found[i].unwrap_or(0.0)).collect();
            for (&index, score) in group.draws.iter().zip(group.independent(&correlated)) {
                found[index] = found[index].and(Some(score));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests;
