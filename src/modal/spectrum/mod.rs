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
mod refine;
mod scaled;
mod secular;
mod sparsity;
mod transfer;

pub use predict::Base;
pub use secular::{Bounded, Uncertain};
pub use transfer::Transfer;

use self::lanes::{Level, WIDTH};
use self::pencil::Pencil;
use self::reduction::Reduction;
use self::refine::{Refined, Room, pack};
use self::scaled::Scaled;
use self::secular::Secular;
use super::{Solver, eigen};
use crate::dynamics::Model;
use faer::c64;

/// Second-order coordinates beyond which elimination of whole matrices at every pole costs more than a dense solve.
const MOST_COORDINATES: f64 = 80.0;
/// Rounds of evaluations before a spectrum is given up.
const MOST_ROUNDS: usize = 6;
/// Largest bound of a pole by its residual, relative: the bound itself is of first order.
const LARGEST_BOUND: f64 = 1e-8;
/// Error of the first-order change of a pole by that of its vectors, relative.
const TRACE: f64 = 1e-9;

/// Buffers for models of one size.
pub struct Spectrum {
    level: Level,
    pencil: Pencil,
    secular: Secular,
    guesses: Vec<c64>,
    /// Determinants of a round with their errors.
    values: Vec<(Scaled, f64)>,
    evaluations: usize,
    /// Number of poles of the last model that was certified.
    degree: usize,
    /// Poles of the last model with its full part and their vectors, group by group.
    groups: Vec<Refined>,
    /// Poles whose vectors alone are asked for.
    aside: Refined,
    room: Room,
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
        reduction.set(Level::best(), model);
        // Determinants cost as many times their own effort as there are poles, the dense solve the cube of the poles.
        let worth =
            reduction.effort(model) <= MOST_COORDINATES * (model.second_order as f64).powi(2);
        let base = worth.then(|| Self::of(model, solver).ok()).flatten()?;
        Spectrum::new().solve(&base, model).is_ok().then_some(base)
    }
}

impl Default for Spectrum {
    fn default() -> Self {
        Self::new()
    }
}

impl Spectrum {
    /// Buffers, with the fastest instruction set of this machine.
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
            values: Vec::new(),
            evaluations: 0,
            degree: 0,
            groups: Vec::new(),
            aside: Refined::default(),
            room: Room::default(),
        }
    }

    /// Elastic coordinates that were eliminated for the last model and the motions that others see of them.
    pub fn reduced(&self) -> [usize; 2] {
        let reduction = self.pencil.reduction();
        [reduction.elastic.len(), reduction.count]
    }

    /// Determinants evaluated for the last model.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Floating-point operations of the last model, `model`: those of its determinants, and of products with its full part.
    pub fn operations(&self, model: &Model) -> f64 {
        8.0 / 3.0 * self.pencil.reduction().effort(model) * self.evaluations as f64
    }

    /// Poles of the last model solved, conjugates included, found or not; without those at the origin that are known by
    /// construction.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All poles of `model`, found from those of `base`: pairs by their member in the upper half plane, sorted by
    /// imaginary, then real part; without those at the origin that are known by construction.
    ///
    /// # Errors
    /// Why there is no certificate.
    pub fn solve(&mut self, base: &Base, model: &Model) -> Result<Vec<Bounded>, Uncertain> {
        let found = self.solve_structure(base, model)?;
        if self.is_refined() { self.refine(&found) } else { Ok(found) }
    }

    /// Like [`Spectrum::solve`], but of a model with a full part only poles near `guesses`: at least the `count` nearest
    /// to each, filled up to whole groups of eight. Each is proven by its residual, and no two are the same; that there
    /// are no others is proven of the model without its full part alone.
    ///
    /// # Errors
    /// Why there is no certificate.
    pub fn solve_near(
        &mut self,
        base: &Base,
        model: &Model,
        guesses: &[c64],
        count: usize,
    ) -> Result<Vec<Bounded>, Uncertain> {
        let found = self.solve_structure(base, model)?;
        if self.is_refined() { self.refine(&nearest(&found, guesses, count)) } else { Ok(found) }
    }

    /// All poles of `model` without its full part.
    fn solve_structure(&mut self, base: &Base, model: &Model) -> Result<Vec<Bounded>, Uncertain> {
        self.evaluations = 0;
        if base.degree() != model.states() {
            return Err(Uncertain::Unresolved);
        }
        if !self.pencil.set(self.level, model) {
            return Err(Uncertain::NonFinite);
        }
        base.predict(self.level, model, self.pencil.reduction(), &mut self.guesses);
        if !self.guesses.iter().all(|s| s.re.is_finite() && s.im.is_finite()) {
            return Err(Uncertain::NonFinite);
        }
        let logarithms: f64 = self.guesses.iter().map(|s| s.norm().ln()).sum();
        let typical = (logarithms / self.guesses.len() as f64).exp();
        self.pencil.equilibrate(if typical > 0.0 { typical } else { 1.0 });
        self.secular.start(self.guesses.iter().copied());
        // Idle lanes of the first round, at least one, look beside the poles expected; one finds the leading
        // coefficient, where it is not known.
        let mut leading = self.pencil.leading();
        let sought = usize::from(leading.is_none());
        let count = self.guesses.len();
        let idle = (WIDTH - (count + sought) % WIDTH).min(count);
        let beside: Vec<c64> = (0..idle)
            .map(|k| {
                let s = self.guesses[(2 * k + 1) * count / (2 * idle)];
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
            if leading.is_none() {
                points.push(c64::new(f64::INFINITY, 0.0));
            }
            self.evaluations += points.len();
            self.values.clear();
            for chunk in points.chunks(WIDTH) {
                let found = self.pencil.evaluate(self.level, &pack(chunk));
                let values = found.value.into_iter().zip(found.error);
                self.values.extend(values.take(chunk.len()));
            }
            if leading.is_none() {
                leading = self.values.pop();
            }
            let Some((highest, highest_error)) = leading else { return Err(Uncertain::NonFinite) };
            for (index, &(value, error)) in self.values.iter().enumerate() {
                let (value, error) = (value.over(highest), error + highest_error);
                match points[index] {
                    point if index >= nodes => elsewhere.push((point, value, error)),
                    _ => self.secular.take(index, value, error),
                }
            }
            self.secular.solve(self.level)?;
            if self.secular.pending().len() == 0 || round + 1 == MOST_ROUNDS {
                break;
            }
            self.secular.renew();
        }
        let found = self.secular.certify(elsewhere)?;
        self.degree = found.iter().map(Bounded::conjugates).sum();
        Ok(found)
    }

    /// Poles of the model with its full part, sorted, from those `without` it: each by its residual, and their discs do not
    /// meet. Where these are all, their sum is that of the first-order changes, which is that of all (a trace). Repeated poles
    /// stay as they are where the full part does not act on their vectors, of which those found are one that stands for
    /// all: that of a right-hand side of no order.
    fn refine(&mut self, without: &[Bounded]) -> Result<Vec<Bounded>, Uncertain> {
        let mut found = Vec::with_capacity(without.len());
        let (mut lacking, mut allowed) = (0.0, 0.0);
        self.groups.resize_with(without.len().div_ceil(WIDTH), Refined::default);
        for (group, refined) in without.chunks(WIDTH).zip(&mut self.groups) {
            let starts: Vec<c64> = group.iter().map(|pole| pole.root).collect();
            refined.find(self.level, &mut self.pencil, &mut self.room, &pack(&starts));
            for (lane, start) in group.iter().enumerate() {
                let Refined { poles, bound, shift, .. } = &*refined;
                let root = c64::new(poles.re[lane], poles.im[lane]);
                let bound = bound[lane];
                if !(bound <= LARGEST_BOUND * root.norm()) {
                    return Err(Uncertain::Unresolved);
                }
                let times = start.conjugates() as f64;
                lacking += times * (root.re - start.root.re - shift.re[lane]);
                let size = shift.re[lane].hypot(shift.im[lane]);
                allowed += times * (bound + start.bound + TRACE * size);
                let multiplicity = start.multiplicity;
                if multiplicity == 1 {
                    found.push(Bounded { root, bound, multiplicity });
                } else {
                    let bound = bound + (root - start.root).norm();
                    if !(bound <= start.bound) {
                        return Err(Uncertain::Unresolved);
                    }
                    found.push(Bounded { bound: bound + start.bound, ..*start });
                }
            }
        }
        found.sort_by(|a, b| a.root.im.total_cmp(&b.root.im).then(a.root.re.total_cmp(&b.root.re)));
        let largest = found.iter().map(|pole| pole.bound).fold(0.0, f64::max);
        // Each disc meets those of its own cluster and no other.
        let mut met = vec![1; found.len()];
        for (index, a) in found.iter().enumerate() {
            let near = found[index + 1..].iter().enumerate();
            for (at, b) in near.take_while(|(_, b)| b.root.im - a.root.im <= a.bound + largest) {
                if a.meets(b) {
                    met[index] += 1;
                    met[index + 1 + at] += 1;
                }
            }
        }
        let counted = met.iter().zip(&found).all(|(met, pole)| *met == pole.multiplicity);
        if !counted || found.iter().any(|a| a.root.im != 0.0 && !(a.root.im > a.bound)) {
            return Err(Uncertain::Unresolved);
        }
        let all = without.iter().map(Bounded::conjugates).sum::<usize>() == self.degree;
        if !all || lacking.abs() <= allowed { Ok(found) } else { Err(Uncertain::Contradicted) }
    }

    /// Right and left vectors of poles of `model`, the last one solved; none where it is not reduced.
    pub fn vectors(&mut self, model: &Model, poles: &[c64]) -> Vec<(c64, [Vec<c64>; 2])> {
        let refined = self.is_refined();
        let Self { level, pencil, groups, aside, room, .. } = self;
        if pencil.reduction().count == 0 || poles.is_empty() {
            return Vec::new();
        }
        let mut found = Vec::with_capacity(poles.len());
        for group in poles.chunks(WIDTH) {
            if !refined {
                aside.find(*level, pencil, room, &pack(group));
            }
            for (lane, &pole) in group.iter().enumerate() {
                let is = |of: &Refined, lane: usize| {
                    of.poles.re[lane] == pole.re && of.poles.im[lane] == pole.im
                };
                let known = groups
                    .iter()
                    .find_map(|of| (0..WIDTH).find(|lane| is(of, *lane)).map(|lane| (of, lane)));
                let (of, lane) = match refined {
                    true => match known {
                        Some(known) => known,
                        None => continue,
                    },
                    false => (&*aside, lane),
                };
                let vectors = [&of.right[..], &of.left[..]];
                found.push((pole, pencil.unpack(model, pole, lane, vectors)));
            }
        }
        found
    }

    /// Whether the last poles are known by their residuals, not by discs that hold all roots.
    pub fn is_refined(&self) -> bool {
        self.pencil.reduction().is_full()
    }
}

/// At least the `count` poles nearest to each guess, whole clusters, filled up to whole groups; in their order.
fn nearest(poles: &[Bounded], guesses: &[c64], count: usize) -> Vec<Bounded> {
    // The place of each in the distances from one of the guesses.
    let mut ranks = vec![(usize::MAX, f64::INFINITY); poles.len()];
    for guess in guesses {
        let mut order: Vec<(f64, usize)> =
            poles.iter().map(|pole| (pole.root - guess).norm()).zip(0..).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (rank, (distance, at)) in order.into_iter().enumerate() {
            if rank < ranks[at].0 {
                ranks[at] = (rank, distance);
            }
        }
    }
    let mut order: Vec<usize> = (0..poles.len()).collect();
    order.sort_by(|a, b| ranks[*a].0.cmp(&ranks[*b].0).then(ranks[*a].1.total_cmp(&ranks[*b].1)));
    let wanted = ranks.iter().filter(|(rank, _)| *rank < count).count();
    order.truncate(wanted.next_multiple_of(WIDTH));
    let chosen = |at: usize| {
        let pole = &poles[at];
        let mate = |other: &usize| pole.meets(&poles[*other]);
        order.contains(&at) || pole.multiplicity > 1 && order.iter().any(mate)
    };
    (0..poles.len()).filter(|at| chosen(*at)).map(|at| poles[at]).collect()
}

#[cfg(test)]
mod tests;
