//! A sampler: the draws of a case, and what they do to the parameters of the vehicle.
//!
//! Where uniforms come from is decided in `plan`: independent draws for every population but the one
//! that the sampler's scheme is for.

use super::draw::{Dispersion, Role};
use super::law::Position;
use super::parameter::Affine;
use super::plan::{Design, Listed, Plan};
use super::scheme::{Refusal, Scheme};

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
    seed: u64,
    independent: Plan,
    planned: Option<(Scheme, Plan)>,
}

/// Consecutive cases whose uniforms are made at once: one buffer of the stream's generator
/// (64 words), so that a single case costs no more.
const WINDOW: usize = 32;

impl<'a> Sampler<'a> {
    /// Independent draws under `seed`.
    pub fn new(dispersion: &'a Dispersion, seed: u64) -> Self {
        let independent = Plan::monte_carlo(dispersion, seed);
        Self { dispersion, seed, independent, planned: None }
    }

    /// With `cases` cases of `scheme` for [`Cursor::draw_planned`]; `listed` are those of its file.
    ///
    /// # Errors
    /// A scheme that cannot be carried out so.
    pub fn with_plan(
        mut self,
        scheme: &Scheme,
        cases: u64,
        listed: Option<&Listed>,
    ) -> Result<Self, Refusal> {
        let plan = Plan::new(scheme, cases, self.dispersion, self.seed, listed)?;
        self.planned = Some((scheme.clone(), plan));
        Ok(self)
    }

    /// The scheme of the planned cases: independent draws unless told otherwise.
    pub fn scheme(&self) -> &Scheme {
        self.planned.as_ref().map_or(&Scheme::MonteCarlo, |(scheme, _)| scheme)
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
            loaded: None,
            uniforms: vec![0.0; count * WINDOW],
            correlated: self.dispersion.groups().iter().map(|g| vec![0.0; g.draws.len()]).collect(),
            fixed: Vec::new(),
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
    /// First of the cases whose uniforms are at hand, and whether they are planned ones.
    loaded: Option<(bool, u64)>,
    /// Uniforms, `WINDOW` a draw.
    uniforms: Vec<f64>,
    /// Normal scores of each group of correlated draws in the case at hand.
    correlated: Vec<Vec<f64>>,
    /// Draws of a designed case.
    fixed: Vec<(usize, f64)>,
    draws: Draws,
}

impl Cursor<'_> {
    /// The draws of `case`.
    ///
    /// `fixed` holds draws (index and value) at a given value. With `drawn` the others are drawn;
    /// without, they stay nominal, but for those that take part in a fixed common score: they
    /// move with it, their individual score being zero. A fixed draw does not move those that are
    /// correlated with it.
    ///
    /// # Panics
    /// If an index in `fixed` is not that of a draw.
    pub fn draw(&mut self, case: u64, fixed: &[(usize, f64)], drawn: bool) -> &Draws {
        if drawn {
            self.load(case, false);
        }
        self.apply(case, fixed, drawn, false)
    }

    /// The draws of `case` of the sampler's scheme.
    ///
    /// # Panics
    /// If a design has no such case.
    pub fn draw_planned(&mut self, case: u64) -> &Draws {
        let sampler = self.sampler;
        match &sampler.planned {
            None => self.draw(case, &[], true),
            Some((_, Plan::Designed(design))) => self.draw_designed(case, design),
            Some((_, plan)) => {
                self.load(case, true);
                self.apply(case, &[], true, plan.correlates())
            }
        }
    }

    fn draw_designed(&mut self, case: u64, design: &Design) -> &Draws {
        let mut fixed = std::mem::take(&mut self.fixed);
        design.fixed(case, &mut fixed);
        self.apply(case, &fixed, false, false);
        self.fixed = fixed;
        &self.draws
    }

    /// The draws of `case`, whose uniforms are at hand if they are drawn.
    fn apply(
        &mut self,
        case: u64,
        fixed: &[(usize, f64)],
        drawn: bool,
        correlated: bool,
    ) -> &Draws {
        let slot = (case % WINDOW as u64) as usize;
        let all = self.sampler.dispersion.draws();
        if drawn && !correlated {
            self.correlate(slot);
        }
        let Draws { values, scores, effects } = &mut self.draws;
        values.fill(None);
        scores.fill(None);
        for &(index, value) in fixed {
            values[index] = Some(value);
            scores[index] = all[index].law.score(value);
        }
        let groups = self.sampler.dispersion.groups();
        let individual = |index: usize| {
            if !drawn {
                return None;
            }
            for (group, scores) in groups.iter().zip(&self.correlated).filter(|_| !correlated) {
                if let Some(place) = group.draws.iter().position(|draw| *draw == index) {
                    return Some(Position::of_score(scores[place]));
                }
            }
            Some(Position::of_uniform(self.uniforms[index * WINDOW + slot]))
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

    /// Has the normal scores of the correlated draws of the case in `slot` at hand.
    fn correlate(&mut self, slot: usize) {
        for (group, scores) in self.sampler.dispersion.groups().iter().zip(&mut self.correlated) {
            let uniform = |draw: &usize| self.uniforms[draw * WINDOW + slot];
            let independent: Vec<f64> =
                group.draws.iter().map(|d| Position::of_uniform(uniform(d)).score()).collect();
            group.correlate(&independent, scores);
        }
    }

    /// Has the uniforms of the window around `case` at hand.
    fn load(&mut self, case: u64, planned: bool) {
        let first = case - case % WINDOW as u64;
        if self.loaded != Some((planned, first)) {
            let sampler = self.sampler;
            let plan = match &sampler.planned {
                Some((_, plan)) if planned => plan,
                _ => &sampler.independent,
            };
            plan.fill(sampler.dispersion, first, &mut self.uniforms);
            self.loaded = Some((planned, first));
        }
    }
}

#[cfg(test)]
mod tests;
