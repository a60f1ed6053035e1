//! All roots of a polynomial from one value near each, with discs that hold them.
//!
//! With p(z_i) at as many nodes as it has roots, `p(s)/(c Π(s − z_i)) = 1 + Σ W_i/(s − z_i)` exactly,
//! `W_i = p(z_i)/(c Π_{j≠i}(z_i − z_j))`: what follows costs no more values. Roots of the right side by the
//! iteration of Ehrlich and Aberth; a root that the rounding of the W leaves too uncertain becomes a
//! node itself, and p is evaluated there. Nodes and roots come in conjugate pairs or are real.
//!
//! Certificate (Smith, "Error bounds for zeros of a polynomial", JACM 17, 1970): with the weights
//! `V_j = p(x_j)/(c Π_{i≠j}(x_j − x_i))` at the roots found, every root of p is in a disc |s − x_j| ≤ n |V_j|, and a
//! union of k discs that meets no other holds exactly k. Where every other disc is n times smaller than its
//! distance, the root is within `|V_j| Π |x_j − x_i|/|x_j − λ_i|`, less than 1.7 |V_j|.

use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::scaled::{Product, Scaled};
use faer::c64;

/// Sweeps over all roots before those that still move are looked at.
const MOST_SWEEPS: usize = 30;
/// Relative step at which a root rests.
const RESTED: f64 = 1e-13;
/// Relative step above which a root that does not come to rest may have changed its kind.
const ADRIFT: f64 = 1e-4;
/// Relative distance below which guesses are moved apart.
const APART: f64 = 1e-4;
/// Relative distance of roots that may be one repeated root; they become nodes in every round, which draws
/// nearer to it each time.
const CROWDED: f64 = 1e-3;
/// Bound, in units of the modulus, above which a root becomes a node.
const UNCERTAIN: f64 = 3e-11;
/// Bound above which a disc proves nothing of use: in units of the modulus of the root …
const LARGEST_BOUND: f64 = 1e-6;
/// … or, for slow roots among fast ones, of the geometric mean of all moduli.
const LARGEST_OF_ALL: f64 = 1e-8;

/// A root, real or with its conjugate: the slot of its own node, and that of its conjugate.
#[derive(Debug, Clone, Copy)]
struct Root {
    own: usize,
    partner: Option<usize>,
}

/// Nodes and roots.
#[derive(Debug, Default)]
pub struct Secular {
    /// Nodes.
    node: Vec<c64>,
    /// For the lower node of a conjugate pair, the upper one.
    mirror: Vec<Option<usize>>,
    /// p over its leading coefficient at the nodes, with the bound of its relative error.
    value: Vec<(Scaled, f64)>,
    /// Weights W with the bounds of their errors.
    weight: Vec<c64>,
    weight_error: Vec<f64>,
    /// Roots, less the nodes of their slots.
    offset: Vec<c64>,
    roots: Vec<Root>,
    /// |V| of every root, with its error.
    radius: Vec<f64>,
    /// Roots that are to become nodes.
    pending: Vec<usize>,
    /// Lane of each slot in the group at work.
    lane: Vec<u8>,
}

/// A root with its bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounded {
    /// The root.
    pub root: c64,
    /// It is nearer to an exact root than this.
    pub bound: f64,
    /// Roots in the disc.
    pub multiplicity: usize,
}

/// Why there is no certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uncertain {
    /// A value or a root is not finite.
    NonFinite,
    /// Roots are known worse than asked for.
    Unresolved,
    /// A value elsewhere is not that of the roots found.
    Contradicted,
}

const NO_LANE: u8 = u8::MAX;

impl Secular {
    /// Starts with these guesses, one of each conjugate pair (in the upper half plane) or real.
    pub fn start(&mut self, guesses: impl IntoIterator<Item = c64>) {
        self.node.clear();
        self.mirror.clear();
        self.roots.clear();
        for guess in guesses {
            let own = self.node.len();
            self.node.push(guess);
            self.mirror.push(None);
            let partner = (guess.im != 0.0).then(|| {
                self.node.push(guess.conj());
                self.mirror.push(Some(own));
                own + 1
            });
            self.roots.push(Root { own, partner });
        }
        let degree = self.node.len();
        let zero = c64::new(0.0, 0.0);
        self.value.clear();
        self.value.resize(degree, (Scaled::ONE, 0.0));
        self.weight.clear();
        self.weight.resize(degree, zero);
        self.weight_error.clear();
        self.weight_error.resize(degree, 0.0);
        self.offset.clear();
        self.offset.resize(degree, zero);
        self.lane.clear();
        self.lane.resize(degree, NO_LANE);
        self.radius.clear();
        self.radius.resize(self.roots.len(), f64::INFINITY);
        self.part(APART);
        self.pending.clear();
        self.pending.extend(0..self.roots.len());
        self.renew();
    }

    /// Number of roots, conjugates included.
    pub fn degree(&self) -> usize {
        self.node.len()
    }

    /// Roots in the order of their imaginary, then real parts, with their values.
    fn sorted(&self) -> Vec<(usize, c64)> {
        let all = self.roots.iter().enumerate();
        let mut order: Vec<(usize, c64)> = all.map(|(i, root)| (i, self.at(root.own))).collect();
        order.sort_by(|(_, a), (_, b)| a.im.total_cmp(&b.im).then(a.re.total_cmp(&b.re)));
        order
    }

    /// Moves guesses apart that are nearer than `least` of their modulus.
    fn part(&mut self, least: f64) {
        let order = self.sorted();
        for (position, &(index, _)) in order.iter().enumerate() {
            let root = self.roots[index];
            // A few neighbours above are enough: farther ones differ in their imaginary part.
            for &(second, _) in order[position + 1..].iter().take(4) {
                let other = self.roots[second];
                if root.partner.is_some() != other.partner.is_some() {
                    continue;
                }
                let (a, b) = (self.at(root.own), self.at(other.own));
                let distance = least * a.norm().max(b.norm());
                if (a - b).norm() < distance {
                    let pair = other.partner.is_some();
                    let step = if pair { c64::new(0.0, distance) } else { distance.into() };
                    self.offset[other.own] += step * 1.5;
                    if let Some(partner) = other.partner {
                        self.offset[partner] = self.at(other.own).conj() - self.node[partner];
                    }
                }
            }
        }
    }

    /// Per root, whether another is very near.
    fn crowded(&self) -> Vec<bool> {
        let order = self.sorted();
        let mut crowded = vec![false; order.len()];
        for (position, &(index, a)) in order.iter().enumerate() {
            for &(second, b) in &order[position + 1..] {
                let distance = CROWDED * a.norm();
                if b.im - a.im > distance {
                    break;
                }
                if (a - b).norm() <= distance {
                    (crowded[index], crowded[second]) = (true, true);
                }
            }
        }
        crowded
    }

    /// Nodes at which p is to be evaluated, those of the roots [`Secular::pending`].
    pub fn pending(&self) -> impl ExactSizeIterator<Item = c64> + '_ {
        self.pending.iter().map(|root| self.node[self.roots[*root].own])
    }

    /// Takes the value at a pending node, with the bound of its relative error.
    pub fn take(&mut self, pending: usize, value: Scaled, error: f64) {
        let root = self.roots[self.pending[pending]];
        self.value[root.own] = (value, error);
    }

    /// The root of a slot.
    fn at(&self, slot: usize) -> c64 {
        self.node[slot] + self.offset[slot]
    }

    /// Finds the roots with the values taken; pending are then those that should become nodes.
    ///
    /// # Errors
    /// Values or roots that are not finite.
    pub fn solve(&mut self, level: Level) -> Result<(), Uncertain> {
        self.weigh(level);
        if !self.weight.iter().all(|w| w.is_finite())
            || !self.weight_error.iter().all(|e| e.is_finite())
        {
            return Err(Uncertain::NonFinite);
        }
        for kind in 0..4 {
            let adrift = self.iterate(level);
            if !self.offset.iter().all(|offset| offset.is_finite()) {
                return Err(Uncertain::NonFinite);
            }
            if adrift.is_empty() || kind == 3 || !self.change_kind(&adrift) {
                break;
            }
        }
        self.measure(level);
        let crowded = self.crowded();
        self.pending.clear();
        for (index, root) in self.roots.iter().enumerate() {
            let radius = self.radius[index];
            // A node as near as that has its own rounding only, and would have it again.
            let far = !(self.offset[root.own].norm() <= 0.1 * radius);
            if (far || crowded[index]) && !(radius <= UNCERTAIN * self.at(root.own).norm()) {
                self.pending.push(index);
            }
        }
        Ok(())
    }

    /// Makes the pending roots nodes.
    pub fn renew(&mut self) {
        for &index in &self.pending {
            let Root { own, partner } = self.roots[index];
            let root = self.at(own);
            self.node[own] = root;
            self.offset[own] = c64::new(0.0, 0.0);
            self.mirror[own] = None;
            if let Some(partner) = partner {
                self.node[partner] = root.conj();
                self.offset[partner] = c64::new(0.0, 0.0);
                self.mirror[partner] = Some(own);
            }
        }
        // The other of two real roots that share a former pair of nodes has lost its mirror.
        for slot in 0..self.mirror.len() {
            if let Some(upper) = self.mirror[slot]
                && self.node[slot] != self.node[upper].conj()
            {
                self.mirror[slot] = None;
                let (value, error) = self.value[upper];
                let value = Scaled { mantissa: value.mantissa.conj(), ..value };
                self.value[slot] = (value, error);
            }
        }
        self.pending.sort_unstable();
    }

    /// Weights of all nodes.
    fn weigh(&mut self, level: Level) {
        let slots: Vec<usize> =
            (0..self.node.len()).filter(|slot| self.mirror[*slot].is_none()).collect();
        for group in slots.chunks(WIDTH) {
            let product = level.run(Products { secular: self, group });
            for (&slot, product) in group.iter().zip(product) {
                let (value, error) = self.value[slot];
                let weight = value.over(product).value();
                self.weight[slot] = weight;
                let rounding = 8.0 * self.node.len() as f64 * f64::EPSILON;
                self.weight_error[slot] = weight.norm() * (error + rounding);
            }
        }
        for slot in 0..self.node.len() {
            if let Some(upper) = self.mirror[slot] {
                self.weight[slot] = self.weight[upper].conj();
                self.weight_error[slot] = self.weight_error[upper];
            }
        }
    }

    /// Ehrlich and Aberth's iteration; the roots that do not come to rest.
    fn iterate(&mut self, level: Level) -> Vec<usize> {
        let groups = self.roots.len().div_ceil(WIDTH);
        let mut rested = vec![false; groups];
        let mut adrift = Vec::new();
        for sweep in 0..MOST_SWEEPS {
            for (group, rested) in rested.iter_mut().enumerate().filter(|(_, rested)| !**rested) {
                let first = group * WIDTH;
                let last = (first + WIDTH).min(self.roots.len());
                let step = level.run(Step { secular: self, first, last });
                *rested = true;
                for index in first..last {
                    let lane = index - first;
                    let Root { own, partner } = self.roots[index];
                    let mut step = c64::new(step.re[lane], step.im[lane]);
                    if partner.is_none() {
                        // A real root stays on the axis.
                        step.im = self.offset[own].im + self.node[own].im;
                    }
                    self.offset[own] -= step;
                    let root = self.at(own);
                    if let Some(partner) = partner {
                        self.offset[partner] = root.conj() - self.node[partner];
                        if self.node[partner] == self.node[own].conj() {
                            self.offset[partner] = self.offset[own].conj();
                        }
                    }
                    let step = step.norm();
                    *rested &= step <= RESTED * root.norm();
                    if sweep + 1 == MOST_SWEEPS && !(step <= ADRIFT * root.norm()) {
                        adrift.push(index);
                    }
                }
            }
            if rested.iter().all(|rested| *rested) {
                break;
            }
        }
        adrift
    }

    /// Splits a pair near the real axis into two real roots, or joins two real roots: false where
    /// none of the roots can be of another kind.
    fn change_kind(&mut self, adrift: &[usize]) -> bool {
        let mut changed = false;
        let mut gone = Vec::new();
        for (position, &index) in adrift.iter().enumerate() {
            if gone.contains(&index) {
                continue;
            }
            let Root { own, partner } = self.roots[index];
            let root = self.at(own);
            if let Some(partner) = partner {
                if !(root.im.abs() < 0.5 * root.norm()) {
                    continue;
                }
                let apart = root.im.abs().max(1e-3 * root.norm());
                for (slot, re) in [(own, root.re - apart), (partner, root.re + apart)] {
                    self.offset[slot] = c64::new(re, 0.0) - self.node[slot];
                }
                self.roots[index].partner = None;
                self.roots.push(Root { own: partner, partner: None });
                changed = true;
            } else {
                let others = adrift[position + 1..].iter().copied();
                let others = others
                    .filter(|other| self.roots[*other].partner.is_none() && !gone.contains(other));
                let distance = |other: &usize| (self.at(self.roots[*other].own) - root).norm();
                let Some(other) = others.min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
                    continue;
                };
                let second = self.roots[other].own;
                let middle = 0.5 * (root.re + self.at(second).re);
                let apart = (0.5 * distance(&other)).max(1e-3 * middle.abs());
                let joined = c64::new(middle, apart);
                self.offset[own] = joined - self.node[own];
                self.offset[second] = joined.conj() - self.node[second];
                self.roots[index].partner = Some(second);
                gone.push(other);
                changed = true;
            }
        }
        gone.sort_unstable();
        for index in gone.into_iter().rev() {
            self.roots.remove(index);
        }
        self.radius.resize(self.roots.len(), f64::INFINITY);
        changed
    }

    /// |V| of every root, with its error.
    fn measure(&mut self, level: Level) {
        for first in (0..self.roots.len()).step_by(WIDTH) {
            let last = (first + WIDTH).min(self.roots.len());
            let radius = level.run(Measure { secular: self, first, last });
            self.radius[first..last].copy_from_slice(&radius[..last - first]);
        }
    }

    /// The roots with their bounds, those of pairs in the upper half plane, sorted by imaginary then real part. A
    /// value of p at `elsewhere` must agree with them.
    ///
    /// # Errors
    /// Roots that are not known well enough, or a value that contradicts them.
    pub fn certify(
        &self,
        elsewhere: impl IntoIterator<Item = (c64, Scaled, f64)>,
    ) -> Result<Vec<Bounded>, Uncertain> {
        let degree = self.degree() as f64;
        // Centre, radius of its disc and |V|, in the upper half plane.
        let mut discs: Vec<(c64, f64, f64)> = self
            .roots
            .iter()
            .zip(&self.radius)
            .map(|(root, &v)| {
                let x = self.at(root.own);
                let x = if root.partner.is_some() && x.im < 0.0 { x.conj() } else { x };
                (x, degree * v, v)
            })
            .collect();
        discs.sort_by(|a, b| a.0.im.total_cmp(&b.0.im).then(a.0.re.total_cmp(&b.0.re)));
        let largest = discs.iter().map(|disc| disc.1).fold(0.0, f64::max);
        if !largest.is_finite() {
            return Err(Uncertain::Unresolved);
        }
        let mut found: Vec<Bounded> = Vec::with_capacity(discs.len());
        // Clusters: discs that meet, counted as one. A disc that meets the real axis meets its mirror image.
        let mut cluster: Vec<usize> = (0..discs.len()).collect();
        let mut near = vec![false; discs.len()];
        for i in 0..discs.len() {
            let (x, r, _) = discs[i];
            for j in i + 1..discs.len() {
                let (y, q, _) = discs[j];
                if y.im - x.im > 2.0 * degree * (largest + r) {
                    break;
                }
                let distance = (x - y).norm();
                if !(r + q < distance) {
                    let (from, to) = (cluster[j], cluster[i]);
                    cluster.iter_mut().filter(|c| **c == from).for_each(|c| *c = to);
                }
                near[i] |= !(2.0 * degree * q < distance);
                near[j] |= !(2.0 * degree * r < distance);
            }
            near[i] |= x.im > 0.0 && !(2.0 * degree * r < x.im);
        }
        let logarithms: f64 = discs.iter().map(|disc| disc.0.norm().ln()).sum();
        let mean = (logarithms / discs.len().max(1) as f64).exp();
        let clustered = (0..discs.len()).any(|i| cluster[i] != i);
        for (i, &(x, r, v)) in discs.iter().enumerate() {
            let members = || (0..discs.len()).filter(|j| cluster[*j] == cluster[i]);
            let multiplicity = members().count();
            let bound = if multiplicity > 1 || (x.im > 0.0 && r >= x.im) {
                members().map(|j| (discs[j].0 - x).norm() + 2.0 * discs[j].1).fold(0.0, f64::max)
            } else if near[i] || clustered {
                r
            } else {
                1.7 * v
            };
            // A pair whose discs meet each other across the axis may be two real roots.
            let certain = x.im == 0.0 || bound < x.im;
            if !(certain && bound <= (LARGEST_BOUND * x.norm()).max(LARGEST_OF_ALL * mean)) {
                return Err(Uncertain::Unresolved);
            }
            found.push(Bounded { root: x, bound, multiplicity });
        }
        for (point, value, error) in elsewhere {
            let mut expected = Scaled::ONE;
            let mut allowed = error + 8.0 * degree * f64::EPSILON;
            for bounded in &found {
                let (x, pair) = (bounded.root, bounded.root.im > 0.0);
                for x in [Some(x), pair.then(|| x.conj())].into_iter().flatten() {
                    expected = expected.times(point - x);
                    allowed += 2.0 * bounded.bound / (point - x).norm();
                }
            }
            let ratio = value.over(expected).value() - c64::new(1.0, 0.0);
            if !(ratio.norm() <= allowed) {
                return Err(Uncertain::Contradicted);
            }
        }
        Ok(found)
    }
}

/// One group of up to eight roots as it lies in memory.
struct Group {
    /// Nodes of their slots.
    node: Complexes,
    /// Offsets.
    offset: Complexes,
}

impl Secular {
    /// Marks the lanes of a group and gathers its nodes and offsets.
    #[inline(always)]
    fn gather(&mut self, slots: impl Iterator<Item = usize>) -> Group {
        let mut group = Group {
            node: Complexes { re: [1.0; WIDTH], ..Complexes::ZERO },
            offset: Complexes::ZERO,
        };
        for (lane, slot) in slots.enumerate() {
            self.lane[slot] = lane as u8;
            let (node, offset) = (self.node[slot], self.offset[slot]);
            (group.node.re[lane], group.node.im[lane]) = (node.re, node.im);
            (group.offset.re[lane], group.offset.im[lane]) = (offset.re, offset.im);
        }
        group
    }

    #[inline(always)]
    fn release(&mut self, slots: impl Iterator<Item = usize>) {
        slots.for_each(|slot| self.lane[slot] = NO_LANE);
    }
}

/// One in the lane that belongs to the slot itself.
#[inline(always)]
fn one_in<V: Vector>(lane: u8, value: Complex<V>) -> Complex<V> {
    if lane == NO_LANE {
        return value;
    }
    let mut stored = Complexes::ZERO;
    value.store(&mut stored);
    (stored.re[usize::from(lane)], stored.im[usize::from(lane)]) = (1.0, 0.0);
    Complex::load(&stored)
}

/// Zero in the lane that belongs to the slot itself.
#[inline(always)]
fn zero_in<V: Vector>(lane: u8, value: V) -> V {
    if lane == NO_LANE {
        return value;
    }
    let mut stored = [0.0; WIDTH];
    value.store(&mut stored);
    stored[usize::from(lane)] = 0.0;
    V::load(&stored)
}

/// Products of the distances of nodes from all others.
struct Products<'a, 'b> {
    secular: &'a mut Secular,
    group: &'b [usize],
}

impl Kernel for Products<'_, '_> {
    type Output = [Scaled; WIDTH];

    #[inline(always)]
    fn run<V: Vector>(self) -> Self::Output {
        let Self { secular, group } = self;
        let own = secular.gather(group.iter().copied());
        let own = Complex::<V>::load(&own.node);
        let mut product = Product::<V>::new();
        for (node, &lane) in secular.node.iter().zip(&secular.lane) {
            product.times(one_in(lane, own.sub(Complex::splat(node.re, node.im))));
        }
        secular.release(group.iter().copied());
        product.finish()
    }
}

/// One step for a group of roots.
struct Step<'a> {
    secular: &'a mut Secular,
    first: usize,
    last: usize,
}

impl Kernel for Step<'_> {
    type Output = Complexes;

    #[inline(always)]
    fn run<V: Vector>(self) -> Complexes {
        let Self { secular, first, last } = self;
        let slots: [usize; WIDTH] =
            std::array::from_fn(|lane| secular.roots[(first + lane).min(last - 1)].own);
        let count = last - first;
        let own = secular.gather(slots[..count].iter().copied());
        let (node, h) = (Complex::<V>::load(&own.node), Complex::<V>::load(&own.offset));
        let zero = Complex::<V>::splat(0.0, 0.0);
        let mut sum = Complex::<V>::splat(1.0, 0.0);
        let (mut slope, mut others) = (zero, zero);
        for slot in 0..secular.node.len() {
            let (z, w, o) = (secular.node[slot], secular.weight[slot], secular.offset[slot]);
            let lane = secular.lane[slot];
            // x − z and x − x' of every other slot; one division serves both reciprocals.
            let a = one_in(lane, node.sub(Complex::splat(z.re, z.im)).add(h));
            let b = one_in(lane, a.sub(Complex::splat(o.re, o.im)));
            let (size_a, size_b) = (a.square(), b.square());
            let inverse = V::splat(1.0).div(size_a.mul(size_b));
            let (over_a, over_b) = (inverse.mul(size_b), inverse.mul(size_a));
            let minus = V::splat(-1.0);
            let a = Complex { re: a.re.mul(over_a), im: a.im.mul(over_a).mul(minus) };
            let b = Complex { re: b.re.mul(over_b), im: b.im.mul(over_b).mul(minus) };
            let w =
                Complex { re: zero_in(lane, V::splat(w.re)), im: zero_in(lane, V::splat(w.im)) };
            let term = w.mul(a);
            sum = sum.add(term);
            slope = slope.subtract_product(term, a);
            others = others.add(a.sub(b));
        }
        let weight: Complexes = {
            let mut weight = Complexes::ZERO;
            for (lane, &slot) in slots[..count].iter().enumerate() {
                let w = secular.weight[slot];
                (weight.re[lane], weight.im[lane]) = (w.re, w.im);
            }
            weight
        };
        secular.release(slots[..count].iter().copied());
        let value = Complex::<V>::load(&weight).add(h.mul(sum));
        let derivative = sum.add(h.mul(slope)).add(value.mul(others));
        let mut step = Complexes::ZERO;
        value.mul(derivative.reciprocal()).store(&mut step);
        step
    }
}

/// |V| with its error for a group of roots.
struct Measure<'a> {
    secular: &'a mut Secular,
    first: usize,
    last: usize,
}

impl Kernel for Measure<'_> {
    type Output = [f64; WIDTH];

    #[inline(always)]
    fn run<V: Vector>(self) -> [f64; WIDTH] {
        let Self { secular, first, last } = self;
        let slots: [usize; WIDTH] =
            std::array::from_fn(|lane| secular.roots[(first + lane).min(last - 1)].own);
        let count = last - first;
        let own = secular.gather(slots[..count].iter().copied());
        let (node, h) = (Complex::<V>::load(&own.node), Complex::<V>::load(&own.offset));
        let mut sum = Complex::<V>::splat(1.0, 0.0);
        let mut error = V::splat(0.0);
        let mut moduli = V::splat(1.0);
        // Squares of moduli, the exponent of which is taken out now and then.
        let mut ratio = Product::<V>::new();
        for slot in 0..secular.node.len() {
            let (z, w, o) = (secular.node[slot], secular.weight[slot], secular.offset[slot]);
            let lane = secular.lane[slot];
            let a = one_in(lane, node.sub(Complex::splat(z.re, z.im)).add(h));
            let b = one_in(lane, a.sub(Complex::splat(o.re, o.im)));
            let size = (w.re * w.re + w.im * w.im).sqrt();
            let (re, im) = (zero_in(lane, V::splat(w.re)), zero_in(lane, V::splat(w.im)));
            let size = zero_in(lane, V::splat(size));
            let doubt = zero_in(lane, V::splat(secular.weight_error[slot]));
            // One division serves both reciprocals.
            let (size_a, size_b) = (a.square(), b.square());
            let inverse = V::splat(1.0).div(size_a.mul(size_b));
            let (over_a, over_b) = (inverse.mul(size_b), inverse.mul(size_a));
            let minus = V::splat(0.0).sub(over_a);
            let reciprocal = Complex { re: a.re.mul(over_a), im: a.im.mul(minus) };
            sum = sum.add(Complex { re, im }.mul(reciprocal));
            let over = over_a.sqrt();
            error = doubt.mul_add(over, error);
            moduli = size.mul_add(over, moduli);
            ratio.times_real(size_a.mul(over_b));
        }
        let ratio = ratio.finish();
        let rounding = (secular.node.len() as f64 + 16.0) * f64::EPSILON;
        let mut stored = [[0.0; WIDTH]; 2];
        error.store(&mut stored[0]);
        moduli.store(&mut stored[1]);
        let product = h.mul(sum);
        let mut value = Complexes::ZERO;
        product.store(&mut value);
        let [error, moduli] = stored;
        let radius = std::array::from_fn(|lane| {
            if lane >= count {
                return 0.0;
            }
            let slot = slots[lane];
            let (w, offset) = (secular.weight[slot], secular.offset[slot].norm());
            let g = c64::new(value.re[lane], value.im[lane]);
            let uncertain = secular.weight_error[slot]
                + offset * (error[lane] + rounding * moduli[lane])
                + 4.0 * f64::EPSILON * (w.norm() + g.norm());
            let size = (w + g).norm() + uncertain;
            size * ratio[lane].value().re.sqrt() * (1.0 + rounding)
        });
        secular.release(slots[..count].iter().copied());
        radius
    }
}
