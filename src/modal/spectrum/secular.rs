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
use super::scaled::{Product, Scaled, modulus};
use faer::c64;
use std::ops::Range;

/// Sweeps over all roots before those that still move are looked at.
const MOST_SWEEPS: usize = 30;
/// Relative step at which a root rests, and what its next step would be: steps shrink at least as they did before.
const RESTED: f64 = 1e-13;
const SETTLED: f64 = 1e-15;
/// Relative step above which a root that does not come to rest may have changed its kind.
const ADRIFT: f64 = 1e-4;
/// Relative step of a root that wanders without a goal.
const LOST: f64 = 0.05;
/// Relative distance below which guesses are moved apart.
const APART: f64 = 1e-4;
/// Relative distance below which guesses are taken for those of one repeated pole, and the one to which these are moved:
/// the determinant loses digits so near to it, but of this distance.
const REPEATED: f64 = 1e-10;
const BESIDE: f64 = 1e-11;
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

/// A weight, its modulus and the bound of its error.
#[derive(Debug, Clone, Copy, Default)]
struct Weight {
    value: c64,
    size: f64,
    error: f64,
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
    /// Weights W.
    weight: Vec<Weight>,
    /// Roots, less the nodes of their slots.
    offset: Vec<c64>,
    roots: Vec<Root>,
    /// |V| of every root, with its error.
    radius: Vec<f64>,
    /// Roots that are to become nodes.
    pending: Vec<usize>,
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

impl Bounded {
    /// One where it is real, two where it stands for a pair.
    pub fn conjugates(&self) -> usize {
        if self.root.im == 0.0 { 1 } else { 2 }
    }

    /// Whether both may be the same root.
    pub fn meets(&self, other: &Self) -> bool {
        !((self.root - other.root).norm() > self.bound + other.bound)
    }
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
        self.weight.resize(degree, Weight::default());
        self.offset.clear();
        self.offset.resize(degree, zero);
        self.radius.clear();
        self.radius.resize(self.roots.len(), f64::INFINITY);
        self.part();
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

    /// Moves guesses apart that are too near.
    fn part(&mut self) {
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
                let (apart, size) = (modulus(a - b), modulus(a).max(modulus(b)));
                let distance = size * if apart <= REPEATED * size { BESIDE } else { APART };
                if apart < distance {
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
                let distance = CROWDED * modulus(a);
                if b.im - a.im > distance {
                    break;
                }
                if modulus(a - b) <= distance {
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
        if !self.weight.iter().all(|w| w.value.is_finite() && w.error.is_finite()) {
            return Err(Uncertain::NonFinite);
        }
        // Roots that are no new nodes were known well enough.
        let mut moving = self.pending.clone();
        for kind in 0..4 {
            let adrift = self.iterate(level, moving);
            if !self.offset.iter().all(|offset| offset.is_finite()) {
                return Err(Uncertain::NonFinite);
            }
            if adrift.is_empty() || kind == 3 || !self.change_kind(&adrift) {
                break;
            }
            moving = (0..self.roots.len()).collect();
        }
        self.measure(level);
        let crowded = self.crowded();
        self.pending.clear();
        for (index, root) in self.roots.iter().enumerate() {
            let radius = self.radius[index];
            // A node as near as that has its own rounding only, and would have it again.
            let far = !(modulus(self.offset[root.own]) <= 0.1 * radius);
            if (far || crowded[index]) && !(radius <= UNCERTAIN * modulus(self.at(root.own))) {
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
            let product = level.run(Products { secular: self, slots: group });
            for (&slot, product) in group.iter().zip(product) {
                let (value, error) = self.value[slot];
                let value = value.over(product).value();
                let size = modulus(value);
                let rounding = 8.0 * self.node.len() as f64 * f64::EPSILON;
                self.weight[slot] = Weight { value, size, error: size * (error + rounding) };
            }
        }
        for slot in 0..self.node.len() {
            if let Some(upper) = self.mirror[slot] {
                let weight = self.weight[upper];
                self.weight[slot] = Weight { value: weight.value.conj(), ..weight };
            }
        }
    }

    /// Ehrlich and Aberth's iteration of some roots; those that do not come to rest, with their last relative steps.
    fn iterate(&mut self, level: Level, mut moving: Vec<usize>) -> Vec<(usize, f64)> {
        // The last step of each, relative; none yet.
        let mut steps = vec![f64::NAN; self.roots.len()];
        for _ in 0..MOST_SWEEPS {
            let mut left = 0;
            for first in (0..moving.len()).step_by(WIDTH) {
                let count = (moving.len() - first).min(WIDTH);
                let mut slots = [0; WIDTH];
                for (slot, index) in slots.iter_mut().zip(&moving[first..]) {
                    *slot = self.roots[*index].own;
                }
                let step = level.run(Step { secular: self, slots: &slots[..count] });
                for lane in 0..count {
                    let index = moving[first + lane];
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
                    let step = modulus(step) / modulus(root);
                    let before = std::mem::replace(&mut steps[index], step);
                    if !(step <= RESTED || step * (step / before).powi(2) <= SETTLED) {
                        moving[left] = index;
                        left += 1;
                    }
                }
            }
            moving.truncate(left);
            if moving.is_empty() {
                break;
            }
        }
        let adrift = moving.into_iter().map(|index| (index, steps[index]));
        adrift.filter(|(_, step)| !(*step <= ADRIFT)).collect()
    }

    /// Splits a pair near the real axis into two real roots, or joins two real roots: false where
    /// none of the roots can be of another kind.
    fn change_kind(&mut self, adrift: &[(usize, f64)]) -> bool {
        let mut changed = false;
        let mut gone = Vec::new();
        for (position, &(index, step)) in adrift.iter().enumerate() {
            if gone.contains(&index) {
                continue;
            }
            let Root { own, partner } = self.roots[index];
            let root = self.at(own);
            if let Some(partner) = partner {
                // Small steps far from the axis are those towards a repeated root.
                if !(root.im.abs() < 0.5 * root.norm() || step > LOST) {
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
                let others = adrift[position + 1..].iter().map(|(other, _)| *other);
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
        let slots: Vec<usize> = self.roots.iter().map(|root| root.own).collect();
        for (group, slots) in slots.chunks(WIDTH).enumerate() {
            let radius = level.run(Measure { secular: self, slots });
            self.radius[group * WIDTH..][..slots.len()].copy_from_slice(&radius[..slots.len()]);
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
                let distance = modulus(x - y);
                if !(r + q < distance) {
                    let (from, to) = (cluster[j], cluster[i]);
                    cluster.iter_mut().filter(|c| **c == from).for_each(|c| *c = to);
                }
                near[i] |= !(2.0 * degree * q < distance);
                near[j] |= !(2.0 * degree * r < distance);
            }
            near[i] |= x.im > 0.0 && !(2.0 * degree * r < x.im);
        }
        let logarithms: f64 = discs.iter().map(|disc| modulus(disc.0).ln()).sum();
        let mean = (logarithms / discs.len().max(1) as f64).exp();
        let clustered = (0..discs.len()).any(|i| cluster[i] != i);
        for (i, &(x, r, v)) in discs.iter().enumerate() {
            let members = || (0..discs.len()).filter(|j| cluster[*j] == cluster[i]);
            let multiplicity = if clustered { members().count() } else { 1 };
            let bound = if multiplicity > 1 || (x.im > 0.0 && r >= x.im) {
                members().map(|j| (discs[j].0 - x).norm() + 2.0 * discs[j].1).fold(0.0, f64::max)
            } else if near[i] || clustered {
                r
            } else {
                1.7 * v
            };
            // A pair whose discs meet each other across the axis may be two real roots.
            let certain = x.im == 0.0 || bound < x.im;
            if !(certain && bound <= (LARGEST_BOUND * modulus(x)).max(LARGEST_OF_ALL * mean)) {
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
                    allowed += 2.0 * bounded.bound / modulus(point - x);
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

/// Up to eight slots, one in each lane.
struct Group {
    node: Complexes,
    offset: Complexes,
    weight: Complexes,
    /// Slots, ascending, with their lanes; then one beyond the last slot.
    own: [(usize, usize); WIDTH + 1],
    count: usize,
}

impl Group {
    #[inline(always)]
    fn of(secular: &Secular, slots: &[usize]) -> Self {
        // Lanes without a slot look at a place of no meaning.
        let nowhere = Complexes { re: [1.0; WIDTH], ..Complexes::ZERO };
        let own = [(secular.node.len(), WIDTH); WIDTH + 1];
        let [offset, weight] = [Complexes::ZERO; 2];
        let mut group = Self { node: nowhere, offset, weight, own, count: slots.len() };
        for (lane, &slot) in slots.iter().enumerate() {
            let Self { node, offset, weight, own, .. } = &mut group;
            own[lane] = (slot, lane);
            let values = [secular.node[slot], secular.offset[slot], secular.weight[slot].value];
            for (to, value) in [node, offset, weight].into_iter().zip(values) {
                (to.re[lane], to.im[lane]) = (value.re, value.im);
            }
        }
        group.own[..slots.len()].sort_unstable();
        group
    }
}

/// One in the lane that belongs to the slot itself.
#[inline(always)]
fn one_in<V: Vector>(lane: Option<usize>, value: Complex<V>) -> Complex<V> {
    let Some(lane) = lane else { return value };
    let mut stored = Complexes::ZERO;
    value.store(&mut stored);
    (stored.re[lane], stored.im[lane]) = (1.0, 0.0);
    Complex::load(&stored)
}

/// A number in all lanes but that which belongs to the slot itself.
#[inline(always)]
fn zero_in<V: Vector>(lane: Option<usize>, value: f64) -> V {
    let Some(lane) = lane else { return V::splat(value) };
    let mut stored = [value; WIDTH];
    stored[lane] = 0.0;
    V::load(&stored)
}

/// Products of the distances of nodes from all others.
struct Products<'a> {
    secular: &'a Secular,
    slots: &'a [usize],
}

impl Kernel for Products<'_> {
    type Output = [Scaled; WIDTH];

    #[inline(always)]
    fn run<V: Vector>(self) -> Self::Output {
        let Self { secular, slots } = self;
        let group = Group::of(secular, slots);
        let own = Complex::<V>::load(&group.node);
        let mut product = Product::<V>::new();
        let mut next = 0;
        for (slot, lane) in group.own.into_iter().take(group.count + 1) {
            for pair in secular.node[next..slot].chunks(2) {
                let a = own.sub(Complex::splat(pair[0].re, pair[0].im));
                match pair.get(1) {
                    Some(b) => product.times_both(a, own.sub(Complex::splat(b.re, b.im))),
                    None => product.times(a),
                }
            }
            if let Some(node) = secular.node.get(slot) {
                product.times(one_in(Some(lane), own.sub(Complex::splat(node.re, node.im))));
            }
            next = slot + 1;
        }
        product.finish()
    }
}

/// A node z, the offset of its root x' and its weight.
type Slot<'a> = (&'a c64, &'a c64, &'a Weight);

impl Secular {
    #[inline(always)]
    fn slots(&self, range: Range<usize>) -> impl Iterator<Item = Slot<'_>> {
        let (node, offset) = (&self.node[range.clone()], &self.offset[range.clone()]);
        let pairs = node.iter().zip(offset).zip(&self.weight[range]);
        pairs.map(|((node, offset), weight)| (node, offset, weight))
    }
}

/// A sum over slots.
trait Sum<V> {
    /// Adds a slot for the roots at `node + h`; to one of them, in this lane, it belongs itself.
    fn add(&mut self, slot: Slot, node: Complex<V>, h: Complex<V>, lane: Option<usize>);
}

impl Group {
    /// Adds all slots for the roots of this group.
    #[inline(always)]
    fn sum<V: Vector, S: Sum<V>>(&self, secular: &Secular, mut sum: S) -> S {
        let (node, h) = (Complex::load(&self.node), Complex::load(&self.offset));
        let mut next = 0;
        for &(own, lane) in &self.own[..=self.count] {
            for slot in secular.slots(next..own) {
                sum.add(slot, node, h, None);
            }
            if let Some(slot) = secular.slots(own..secular.node.len()).next() {
                sum.add(slot, node, h, Some(lane));
            }
            next = own + 1;
        }
        sum
    }
}

/// x − z and x − x' of a slot, and the reciprocals of their squares, from one.
struct Distances<V> {
    a: Complex<V>,
    b: Complex<V>,
    over_a: V,
    over_b: V,
    size_a: V,
}

impl<V: Vector> Distances<V> {
    #[inline(always)]
    fn of((z, o, _): Slot, node: Complex<V>, h: Complex<V>, lane: Option<usize>) -> Self {
        let a = one_in(lane, node.sub(Complex::splat(z.re, z.im)).add(h));
        let b = one_in(lane, a.sub(Complex::splat(o.re, o.im)));
        let (size_a, size_b) = (a.square(), b.square());
        let inverse = size_a.mul(size_b).reciprocal();
        let (over_a, over_b) = (inverse.mul(size_b), inverse.mul(size_a));
        Self { a, b, over_a, over_b, size_a }
    }
}

/// One step for the roots of these slots.
struct Step<'a> {
    secular: &'a Secular,
    slots: &'a [usize],
}

/// F without the root's own term, its slope less that term's, and what other roots add to the slope.
struct Slopes<V> {
    sum: Complex<V>,
    slope: Complex<V>,
    others: Complex<V>,
}

impl<V: Vector> Sum<V> for Slopes<V> {
    #[inline(always)]
    fn add(&mut self, slot: Slot, node: Complex<V>, h: Complex<V>, lane: Option<usize>) {
        let Distances { a, b, over_a, over_b, .. } = Distances::of(slot, node, h, lane);
        let (re, im) = (a.re.mul(over_a), a.im.mul(over_a));
        let w = slot.2;
        let (w_re, w_im): (V, V) = (zero_in(lane, w.value.re), zero_in(lane, w.value.im));
        let term = Complex {
            re: w_im.mul_add(im, w_re.mul(re)),
            im: w_re.negative_mul_add(im, w_im.mul(re)),
        };
        self.sum = self.sum.add(term);
        self.slope = Complex {
            re: term.im.negative_mul_add(im, term.re.negative_mul_add(re, self.slope.re)),
            im: term.re.mul_add(im, term.im.negative_mul_add(re, self.slope.im)),
        };
        self.others = Complex {
            re: over_b.negative_mul_add(b.re, self.others.re).add(re),
            im: over_b.mul_add(b.im, self.others.im).sub(im),
        };
    }
}

impl Kernel for Step<'_> {
    type Output = Complexes;

    #[inline(always)]
    fn run<V: Vector>(self) -> Complexes {
        let Self { secular, slots } = self;
        let group = Group::of(secular, slots);
        let zero = Complex::<V>::splat(0.0, 0.0);
        let one = Complex::<V>::splat(1.0, 0.0);
        let slopes = Slopes { sum: one, slope: zero, others: zero };
        let Slopes { sum, slope, others } = group.sum(secular, slopes);
        let h = Complex::load(&group.offset);
        let value = Complex::<V>::load(&group.weight).add(h.mul(sum));
        let derivative = sum.add(h.mul(slope)).add(value.mul(others));
        let mut step = Complexes::ZERO;
        value.mul(derivative.reciprocal()).store(&mut step);
        step
    }
}

/// |V| with its error for the roots of these slots.
struct Measure<'a> {
    secular: &'a Secular,
    slots: &'a [usize],
}

/// F without the root's own term, the errors of its weights, moduli of its terms, and Π |x − z|²/|x − x'|².
struct Sizes<V> {
    sum: Complex<V>,
    error: V,
    moduli: V,
    ratio: Product<V>,
}

impl<V: Vector> Sum<V> for Sizes<V> {
    #[inline(always)]
    fn add(&mut self, slot: Slot, node: Complex<V>, h: Complex<V>, lane: Option<usize>) {
        let Distances { a, over_a, over_b, size_a, .. } = Distances::of(slot, node, h, lane);
        let (re, im) = (a.re.mul(over_a), a.im.mul(over_a));
        let w = slot.2;
        let (w_re, w_im): (V, V) = (zero_in(lane, w.value.re), zero_in(lane, w.value.im));
        self.sum = Complex {
            re: w_im.mul_add(im, w_re.mul_add(re, self.sum.re)),
            im: w_re.negative_mul_add(im, w_im.mul_add(re, self.sum.im)),
        };
        let over = over_a.root_above();
        self.error = zero_in::<V>(lane, w.error).mul_add(over, self.error);
        self.moduli = zero_in::<V>(lane, w.size).mul_add(over, self.moduli);
        self.ratio.times_real(size_a.mul(over_b));
    }
}

impl Kernel for Measure<'_> {
    type Output = [f64; WIDTH];

    #[inline(always)]
    fn run<V: Vector>(self) -> [f64; WIDTH] {
        let Self { secular, slots } = self;
        let group = Group::of(secular, slots);
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let sum = Complex { re: one, im: zero };
        let sizes = Sizes { sum, error: zero, moduli: one, ratio: Product::new() };
        let Sizes { sum, error, moduli, ratio } = group.sum(secular, sizes);
        let ratio = ratio.finish();
        let rounding = (secular.node.len() as f64 + 16.0) * f64::EPSILON;
        let mut stored = [[0.0; WIDTH]; 2];
        error.store(&mut stored[0]);
        moduli.store(&mut stored[1]);
        let mut value = Complexes::ZERO;
        Complex::<V>::load(&group.offset).mul(sum).store(&mut value);
        let [error, moduli] = stored;
        let mut radius = [0.0; WIDTH];
        for (lane, &slot) in slots.iter().enumerate() {
            let (w, offset) = (secular.weight[slot], modulus(secular.offset[slot]));
            let g = c64::new(value.re[lane], value.im[lane]);
            let uncertain = w.error
                + offset * (error[lane] + rounding * moduli[lane])
                + 4.0 * f64::EPSILON * (w.size + modulus(g));
            let size = modulus(w.value + g) + uncertain;
            radius[lane] = size * ratio[lane].value().re.sqrt() * (1.0 + rounding);
        }
        radius
    }
}
