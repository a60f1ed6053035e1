//! The whole spectrum of a model near a known one, every pole with a proven bound.
//!
//! Poles are predicted from a base, the determinant is evaluated once near each, and the roots of the polynomial
//! that these values determine are found and certified by discs (`secular`). What cannot be certified is left to
//! the dense solver, `eigen`.

mod elimination;
mod gram;
pub mod lanes;
mod pencil;
mod predict;
mod reduction;
mod scaled;
mod secular;

pub use predict::Base;
pub use secular::{Bounded, Uncertain};

use self::lanes::{Complexes, Level, WIDTH};
use self::pencil::Pencil;
use self::reduction::Reduction;
use self::secular::Secular;
use super::{Solver, eigen};
use crate::dynamics::Model;
use faer::c64;

/// Second-order coordinates beyond which elimination of whole matrices at every pole costs more than a dense solve.
const MOST_COORDINATES: f64 = 64.0;
/// Rounds of evaluations before a spectrum is given up.
const MOST_ROUNDS: usize = 6;

/// Buffers for models of one size.
pub struct Spectrum {
    level: Level,
    pencil: Pencil,
    secular: Secular,
    guesses: Vec<c64>,
    evaluations: usize,
}

impl Base {
    /// The base of `model`, by the dense solver.
    ///
    /// # Errors
    /// As [`Solver::poles`].
    pub fn of(model: &Model, solver: &mut Solver) -> Result<Self, eigen::Error> {
        let mut poles = Vec::new();
        solver.poles(model, &mut poles)?;
        let pairs: Vec<_> = poles.iter().map(|pole| solver.pair(model, *pole)).collect();
        Ok(Self::new(&pairs))
    }

    /// The base of `model`, where determinants pay and certify the model itself: a model too large, or whose poles
    /// are too sensitive for discs, would only cost determinants before the dense solver answers.
    pub fn proven(model: &Model, solver: &mut Solver) -> Option<Self> {
        let mut reduction = Reduction::default();
        reduction.set(model);
        // Determinants cost as many times their own effort as there are poles, the dense solve the cube of the poles.
        let effort = if reduction.count > 0 { reduction.effort() } else { (model.second_order as f64).powi(3) };
        let worth = effort <= MOST_COORDINATES * (model.second_order as f64).powi(2);
        let base = worth.then(|| Self::of(model, solver).ok()).flatten()?;
        Spectrum::new().solve(&base, model).is_ok().then_some(base)
    }
}

impl Spectrum {
    /// Buffers.
    pub fn new() -> Self {
        Self::with(Level::best())
    }

    /// Buffers, with this instruction set.
    pub fn with(level: Level) -> Self {
        Self {
            level,
            pencil: Pencil::new(),
            secular: Secular::default(),
            guesses: Vec::new(),
            evaluations: 0,
        }
    }

    pub fn reduced(&self) -> [usize; 3] { let r = self.pencil.reduction(); [r.elastic.len(), r.count, r.others.len()] }
    /// Determinants evaluated for the last model.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// All poles of `model`, found from those of `base`: pairs by their member in the upper half plane, sorted by
    /// imaginary, then real part; without those at the origin that are known by construction.
    ///
    /// # Errors
    /// Why there is no certificate.
    pub fn solve(&mut self, base: &Base, model: &Model) -> Result<Vec<Bounded>, Uncertain> {
        self.evaluations = 0;
        if base.degree() != model.states() {
            return Err(Uncertain::Unresolved);
        }
        if !self.pencil.set(model) {
            return Err(Uncertain::NonFinite);
        }
        base.predict(self.level, model, self.pencil.reduction(), &mut self.guesses);
        if !self.guesses.iter().all(|s| s.re.is_finite() && s.im.is_finite()) {
            return Err(Uncertain::NonFinite);
        }
        let logarithms: f64 = self.guesses.iter().map(|s| s.norm().ln()).sum();
        let typical = (logarithms / self.guesses.len() as f64).exp();
        self.pencil.equilibrate(if typical > 0.0 { typical } else { 1.0 });
        self.pencil.lead_reduced(self.level);
        self.secular.start(self.guesses.iter().copied());
        // Idle lanes of the first round, at least one, look beside the poles expected.
        let count = self.guesses.len();
        let idle = WIDTH - count % WIDTH;
        let beside: Vec<c64> = (0..idle.min(count))
            .map(|k| {
                let s = self.guesses[(2 * k + 1) * count / (2 * idle.min(count))];
                s + c64::new(0.03, 0.02 + 0.005 * k as f64) * s.norm()
            })
            .collect();
        let mut elsewhere = Vec::with_capacity(beside.len());
        for round in 0..MOST_ROUNDS {
            let mut points: Vec<c64> = self.secular.pending().collect();
            let nodes = points.len();
            if round == 0 {
                points.extend(&beside);
            }
            self.evaluations += points.len();
            for (group, chunk) in points.chunks(WIDTH).enumerate() {
                let mut packed = Complexes::ZERO;
                for lane in 0..WIDTH {
                    let s = chunk[lane.min(chunk.len() - 1)];
                    (packed.re[lane], packed.im[lane]) = (s.re, s.im);
                }
                let values = self.pencil.evaluate(self.level, &packed);
                for (lane, &point) in chunk.iter().enumerate() {
                    let (value, error) = (values.value[lane], values.error[lane]);
                    let index = group * WIDTH + lane;
                    if index < nodes {
                        self.secular.take(index, value, error);
                    } else {
                        elsewhere.push((point, value, error));
                    }
                }
            }
            self.secular.solve(self.level)?;
            if self.secular.pending().len() == 0 || round + 1 == MOST_ROUNDS {
                break;
            }
            self.secular.renew();
        }
        self.secular.certify(elsewhere)
    }
}

#[cfg(test)]
mod tests;
