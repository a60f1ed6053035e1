//! Gradients by independent normal scores: from the effects on parameters back to the draw keys.
//!
//! Every key has one independent standard normal score: a common score itself, the individual score of a
//! key that takes part in one, in a group of correlated keys the one from which its score is made, else the
//! score of its own value. What a parameter does is not known here.

use super::draw::{Dispersion, Role};
use super::law::Position;
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

    /// The gradient by the independent score of every draw, from that by the effects on parameters.
    ///
    /// A draw that stays nominal counts as one at its median; one of the `fixed` draws (index and value)
    /// does not move with its common score. `None` where the value has no slope: a discrete law, a value
    /// that its law cannot give.
    pub fn score_gradient(
        &self,
        draws: &Draws,
        fixed: &[(usize, f64)],
        effects: &[AffineGradient],
    ) -> Vec<Option<Complex<f64>>> {
        let by_value = self.value_gradient(draws, effects);
        let all = self.draws();
        let mut found: Vec<Option<Complex<f64>>> = vec![Some(Complex::ZERO); all.len()];
        for (index, draw) in all.iter().enumerate() {
            let Role::Value { common, .. } = &draw.role else { continue };
            let score = match (draws.values[index], draws.scores[index]) {
                (Some(_), score) => score,
                (None, _) => Some(0.0),
            };
            let slope = score.and_then(|score| draw.law.slope(&Position::of_score(score)));
            let by_score = slope.map(|slope| by_value[index] * slope);
            let held = fixed.iter().any(|(fixed, _)| *fixed == index);
            found[index] = match common {
                Some(shared) if !held => {
                    if let (Some(total), Some(by_score)) = (&mut found[shared.draw], by_score) {
                        *total += by_score * shared.weight;
                    }
                    by_score.map(|by_score| by_score * rest(shared.weight))
                }
                _ => by_score,
            };
        }
        for group in self.groups() {
            let by: Vec<_> = group.draws.iter().map(|&i| found[i].unwrap_or_default()).collect();
            for (&index, by) in group.draws.iter().zip(group.pull(&by)) {
                found[index] = found[index].and(Some(by));
            }
        }
        found
    }

    /// The gradient by the value of every draw.
    fn value_gradient(&self, draws: &Draws, effects: &[AffineGradient]) -> Vec<Complex<f64>> {
        let mut found = vec![Complex::ZERO; self.draws().len()];
        let value = |index: usize| draws.values[index];
        for combination in self.combinations() {
            let by = effects[combination.parameter];
            let base = combination.absolute.and_then(value);
            // By the product of all factors: of the nominal or the absolute value.
            let by_product = base.map_or(by.scale, |base| by.offset * base);
            let product_without = |left_out: Option<usize>| -> f64 {
                let others = combination.scales.iter().filter(|&&i| Some(i) != left_out);
                others.filter_map(|&i| value(i)).product()
            };
            if let Some(index) = combination.absolute {
                found[index] += by.offset * product_without(None);
            }
            for &index in &combination.scales {
                found[index] += by_product * product_without(Some(index));
            }
            for &index in &combination.offsets {
                found[index] += by.offset;
            }
        }
        found
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
