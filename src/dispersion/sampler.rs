//! A sampler: the draws of a case, and what they do to the parameters of the vehicle.
//!
//! Where uniforms come from is decided in `plan`.

use super::draw::{Dispersion, Role};
use super::law::Position;
use super::parameter::Affine;
use super::plan::Plan;

/// The draws of one case, in the order of [`Dispersion::draws`].
#[derive(Debug, Clone, PartialEq)]
pub struct Draws {
    /// Value of each draw in the units of its law; `None` where the parameter stays nominal.
    pub values: Vec<Option<f64>>,
    /// Normal score Φ⁻¹(F(x)) of each value; `None` where it stays nominal or lies outside its law
    /// (a fixed value), or at its very end.
    pub scores: Vec<Option<f64>>,
    /// Effect on each parameter, by its number in [`super::Parameters`].
    pub effects: Vec<Affine>,
}

/// Draws cases of a dispersion under a plan.
#[derive(Debug, Clone)]
pub struct Sampler<'a> {
    dispersion: &'a Dispersion,
    plan: Plan,
}

/// Consecutive cases whose uniforms are made at once: one buffer of the stream's generator
/// (64 words), so that a single case costs no more.
const WINDOW: usize = 32;

impl<'a> Sampler<'a> {
    /// Independent draws under `seed`.
    pub fn new(dispersion: &'a Dispersion, seed: u64) -> Self {
        Self { dispersion, plan: Plan::monte_carlo(dispersion, seed) }
    }

    /// The dispersion from which it draws.
    pub fn dispersion(&self) -> &'a Dispersion {
        self.dispersion
    }

    /// A cursor with buffers of its own, one a thread.
    pub fn cursor(&self) -> Cursor<'_> {
        let count = self.dispersion.draws().len();
        Cursor {
            sampler: self,
            first_case: None,
            uniforms: vec![0.0; count * WINDOW],
            draws: Draws {
                values: vec![None; count],
                scores: vec![None; count],
                effects: vec![Affine::IDENTITY; self.dispersion.parameters().count()],
            },
        }
    }
}

/// Draws one case after the other without allocating. The draws of a case do not depend on the
/// cases drawn before it.
#[derive(Debug, Clone)]
pub struct Cursor<'a> {
    sampler: &'a Sampler<'a>,
    /// First of the cases whose uniforms are at hand.
    first_case: Option<u64>,
    /// Uniforms, `WINDOW` a draw.
    uniforms: Vec<f64>,
    draws: Draws,
}

impl Cursor<'_> {
    /// The draws of `case`.
    ///
    /// `fixed` holds draws (index and value) at a given value. With `drawn` the others are drawn;
    /// without, they stay nominal, but for those that take part in a fixed common score: they
    /// move with it, their individual score being zero.
    ///
    /// # Panics
    /// If an index in `fixed` is not that of a draw.
    pub fn draw(&mut self, case: u64, fixed: &[(usize, f64)], drawn: bool) -> &Draws {
        if drawn {
            self.load(case);
        }
        let slot = (case % WINDOW as u64) as usize;
        let all = self.sampler.dispersion.draws();
        let Draws { values, scores, effects } = &mut self.draws;
        values.fill(None);
        scores.fill(None);
        for &(index, value) in fixed {
            values[index] = Some(value);
            scores[index] = all[index].law.score(value);
        }
        let individual = |index: usize| {
            drawn.then(|| Position::of_uniform(self.uniforms[index * WINDOW + slot]))
        };
        // Common scores come first, since the others need them.
        for (index, draw) in all.iter().enumerate() {
            if values[index].is_none() && draw.role == Role::Common {
                values[index] = individual(index).map(|position| position.score());
                scores[index] = values[index];
            }
        }
        for (index, draw) in all.iter().enumerate() {
            let Role::Value { common, .. } = &draw.role else { continue };
            if values[index].is_some() {
                continue;
            }
            let own = individual(index);
            let shared = common.and_then(|c| values[c.draw].map(|z| (c.weight, z)));
            let position = match shared {
                Some((weight, z)) => {
                    let rest = ((1.0 - weight) * (1.0 + weight)).sqrt();
                    let own = own.map_or(0.0, |position| position.score());
                    Position::of_score(weight * z + rest * own)
                }
                None => match own {
                    Some(position) => position,
                    None => continue,
                },
            };
            let value = draw.law.value(&position);
            values[index] = Some(value);
            scores[index] = if draw.law.is_continuous() {
                Some(position.score())
            } else {
                draw.law.score(value)
            };
        }
        for combination in self.sampler.dispersion.combinations() {
            let mut effect = match combination.absolute.and_then(|index| values[index]) {
                Some(value) => Affine { scale: 0.0, offset: value },
                None => Affine::IDENTITY,
            };
            for factor in combination.scales.iter().filter_map(|&index| values[index]) {
                effect.scale *= factor;
                effect.offset *= factor;
            }
            for term in combination.offsets.iter().filter_map(|&index| values[index]) {
                effect.offset += term;
            }
            effects[combination.parameter] = effect;
        }
        &self.draws
    }

    /// Has the uniforms of the window around `case` at hand.
    fn load(&mut self, case: u64) {
        let first = case - case % WINDOW as u64;
        if self.first_case != Some(first) {
            for (draw, uniforms) in self.uniforms.chunks_exact_mut(WINDOW).enumerate() {
                self.sampler.plan.fill(draw, first, uniforms);
            }
            self.first_case = Some(first);
        }
    }
}

#[cfg(test)]
mod tests;
