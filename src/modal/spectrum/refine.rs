//! Poles and vectors of a reduced model with what is of no few motions, from those of the model without it.
//!
//! With L = L₀ + F, F the full part less its diagonal: `x ← x − L₀⁻¹ L(s) x` and the same for the left vector, s from
//! `yᵀ L(s) x = 0`. What is left falls by about ‖F‖ over the distance of the poles a step, the error of s by its square.
//! Near its pole L₀ is singular along its own vectors v and w, which are kept out: with `wᵀ L₀' v = 1`, of a residual r what
//! `v (wᵀ r)` stands for, and of its solution what lies along v.

use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::pencil::{Frequencies, Pencil};
use faer::c64;

/// What is left of a bound after a step that no longer makes it better.
const STILL: f64 = 0.8;
/// Steps before a pole is given up: where two are as near as they are coupled each leaves half of what was.
const MOST_STEPS: usize = 40;
/// Steps in which a pole rests only if each leaves a small part of what was: vectors are near those of the start then, and
/// `yᵀ L' x` is near one.
const FEW: usize = 6;
/// Distance of the point of the factors from the pole of L₀, relative.
const ASIDE: f64 = 1e-12;
/// Relative bound of a pole that is good enough.
const RESTED: f64 = 2e-11;
/// What the bound leaves for what is not of first order.
const SAFETY: f64 = 2.0;

/// Poles of one group, with vectors over the other coordinates of the pencil and then the elastic ones.
#[derive(Debug, Default)]
pub struct Refined {
    /// Poles.
    pub poles: Complexes,
    /// Distance from an exact pole, to first order; not finite where the steps did not come to rest.
    pub bound: [f64; WIDTH],
    /// First-order change of each pole by the full part.
    pub shift: Complexes,
    /// Right vectors.
    pub right: Vec<Complexes>,
    /// Left vectors y, `yᵀ L = 0`.
    pub left: Vec<Complexes>,
}

/// Vectors at work.
#[derive(Debug, Default)]
pub struct Room {
    /// v and w, and `L₀' v` and `L₀'ᵀ w`.
    own: [Vec<Complexes>; 2],
    slopes: [Vec<Complexes>; 2],
    residual: Vec<Complexes>,
    core: [Vec<Complexes>; 2],
}

impl Refined {
    /// Finds the poles near `starts`, those of the model without its full part.
    pub fn find(&mut self, level: Level, pencil: &mut Pencil, room: &mut Room, starts: &Complexes) {
        let size = pencil.places();
        let Room { own, slopes, residual, core } = room;
        let vectors = [&mut self.right, &mut self.left, residual];
        for vector in vectors.into_iter().chain(own).chain(slopes) {
            vector.resize(size, Complexes::ZERO);
        }
        for core in core {
            core.resize(pencil.size(), Complexes::ZERO);
        }
        level.run(Find { to: self, room, pencil, starts });
    }
}

struct Find<'a> {
    to: &'a mut Refined,
    room: &'a mut Room,
    pencil: &'a mut Pencil,
    starts: &'a Complexes,
}

#[inline(always)]
fn dot<V: Vector>(a: &[Complexes], b: &[Complexes]) -> Complex<V> {
    let mut sums = [Complex::<V>::splat(0.0, 0.0); 2];
    for (a, b) in a.chunks(2).zip(b.chunks(2)) {
        for i in 0..a.len() {
            sums[i] = sums[i].add_product(Complex::load(&a[i]), Complex::load(&b[i]));
        }
    }
    sums[0].add(sums[1])
}

/// `to −= factor · vector`.
#[inline(always)]
fn subtract<V: Vector>(to: &mut [Complexes], factor: Complex<V>, vector: &[Complexes]) {
    for (to, vector) in to.iter_mut().zip(vector) {
        Complex::<V>::load(to).subtract_product(factor, Complex::load(vector)).store(to);
    }
}

/// `to −= change − along · own`.
#[inline(always)]
fn correct<V: Vector>(
    to: &mut [Complexes],
    change: &[Complexes],
    along: Complex<V>,
    own: &[Complexes],
) {
    for (to, (change, own)) in to.iter_mut().zip(change.iter().zip(own)) {
        let change = Complex::<V>::load(change).subtract_product(along, Complex::load(own));
        Complex::<V>::load(to).sub(change).store(to);
    }
}

#[inline(always)]
fn scale<V: Vector>(vector: &mut [Complexes], factor: Complex<V>) {
    for value in vector {
        Complex::<V>::load(value).mul(factor).store(value);
    }
}

/// Makes the largest element one in modulus.
#[inline(always)]
fn normalise<V: Vector>(vector: &mut [Complexes]) {
    let mut largest = V::splat(f64::MIN_POSITIVE);
    for value in vector.iter() {
        largest = largest.max(Complex::<V>::load(value).square());
    }
    let unit = V::splat(1.0).div(largest.sqrt());
    scale::<V>(vector, Complex { re: unit, im: V::splat(0.0) });
}

impl Kernel for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { to, room, pencil, starts } = self;
        let Refined { poles, bound, shift, right, left } = to;
        let Room { own, slopes, residual, core } = room;
        let start = Complex::<V>::load(starts);
        let mut aside = Complexes::ZERO;
        start.scale(V::splat(1.0 + ASIDE)).store(&mut aside);
        pencil.factor::<V>(&aside);
        let at_factors = Frequencies::<V>::new(&aside, 1.0);
        let [v, w] = own;
        pencil.null_vectors::<V>(v, w);
        let derivative = Frequencies::<V>::slope(start);
        normalise::<V>(v);
        normalise::<V>(w);
        pencil.apply::<V>(&derivative, None, false, v, &mut core[0], &mut slopes[0]);
        let unit = dot::<V>(w, &slopes[0]).reciprocal();
        scale::<V>(w, unit);
        pencil.apply::<V>(&derivative, None, true, w, &mut core[0], &mut slopes[1]);
        right.copy_from_slice(v);
        left.copy_from_slice(w);
        let mut s = start;
        let mut last = V::splat(f64::MAX);
        let mut rested = [false; WIDTH];
        let mut slow = false;
        for step in 0..MOST_STEPS {
            s.store(poles);
            let at = Frequencies::<V>::new(poles, 1.0);
            let full = Some([s, Complex::splat(1.0, 0.0)]);
            pencil.apply::<V>(&at, full, false, right, &mut core[0], residual);
            // Over wᵀ L₀' v, which is one, for yᵀ L' x, which is near it.
            let change = dot::<V>(left, residual);
            s = s.sub(change);
            if step == 0 {
                Complex::<V>::splat(0.0, 0.0).sub(change).store(shift);
            }
            // The residual at the new s, to first order in its change.
            subtract::<V>(residual, change, &slopes[0]);
            let (first, rounding) = pencil.uncertainty::<V>(&at, right, left, residual);
            let doubt = rounding.mul_add(V::splat(0.5 * f64::EPSILON), first);
            let doubt = doubt.add(change.square().sqrt()).mul(V::splat(SAFETY));
            let (mut moduli, mut before) = ([0.0; WIDTH], [0.0; WIDTH]);
            s.square().sqrt().store(&mut moduli);
            doubt.store(bound);
            last.store(&mut before);
            for lane in 0..WIDTH {
                // Known well enough, or no better than before.
                let still = step > 1 && !(bound[lane] < STILL * before[lane]);
                slow |= still || step >= FEW;
                rested[lane] |= step > 0 && (bound[lane] <= RESTED * moduli[lane] || still);
            }
            last = doubt;
            let done = rested == [true; WIDTH] || step + 1 == MOST_STEPS;
            let along = dot::<V>(w, residual);
            subtract::<V>(residual, along, &slopes[0]);
            pencil.solve::<V>(residual, core);
            let along = dot::<V>(&slopes[1], residual);
            correct::<V>(right, residual, along, v);
            let full = Some([s, Complex::splat(1.0, 0.0)]);
            pencil.apply::<V>(&at, full, true, left, &mut core[0], residual);
            let along = dot::<V>(v, residual);
            subtract::<V>(residual, along, &slopes[1]);
            pencil.solve_transposed::<V>(&at_factors, residual, core);
            let along = dot::<V>(&slopes[0], residual);
            correct::<V>(left, residual, along, w);
            if done {
                break;
            }
        }
        s.store(poles);
        if slow {
            // What yᵀ L' x has become: near nothing where two poles and their vectors meet.
            let derivative = Frequencies::<V>::slope(s);
            let full = Some([Complex::splat(1.0, 0.0), Complex::splat(0.0, 0.0)]);
            pencil.apply::<V>(&derivative, full, false, right, &mut core[0], residual);
            let over = dot::<V>(left, residual).reciprocal();
            V::load(bound).mul(over.square().sqrt()).store(bound);
        }
        for lane in 0..WIDTH {
            if starts.im[lane] == 0.0 {
                poles.im[lane] = 0.0;
            }
            if !rested[lane] {
                bound[lane] = f64::INFINITY;
            }
        }
    }
}

/// Up to eight points as they lie in lanes, the last one repeated.
pub fn pack(points: &[c64]) -> Complexes {
    let mut packed = Complexes::ZERO;
    for lane in 0..WIDTH {
        let s = points[lane.min(points.len() - 1)];
        (packed.re[lane], packed.im[lane]) = (s.re, s.im);
    }
    packed
}
