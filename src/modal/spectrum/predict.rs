//! Where the poles of a model are expected: by the vectors of a model near it.
//!
//! The Rayleigh functional yᴴ (M s² + D s + K) x = 0 is stationary in x and y, so that its root is off by the
//! square of their error. What is expected here is only a start: `secular` proves what it finds.

use super::super::Pair;
use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::reduction::{BLOCK, Reduction};
use crate::dynamics::Model;
use faer::c64;

/// Poles of a reference model with their vectors.
#[derive(Debug, Clone)]
pub struct Base {
    /// Poles, one of each pair or real.
    pub poles: Vec<c64>,
    /// Vectors x and conjugate y of eight poles each, element by element.
    groups: Vec<Vec<[Complexes; 2]>>,
}

impl Base {
    /// The base of a model whose poles and vectors are `pairs`.
    pub fn new(pairs: &[Pair]) -> Self {
        let groups = pairs.chunks(WIDTH).map(|pairs| {
            let element = |at: usize| {
                let mut both = [Complexes::ZERO; 2];
                for (lane, pair) in pairs.iter().enumerate() {
                    for (to, value) in both.iter_mut().zip([pair.right[at], pair.left[at].conj()]) {
                        (to.re[lane], to.im[lane]) = (value.re, value.im);
                    }
                }
                both
            };
            (0..pairs.first().map_or(0, |pair| pair.right.len())).map(element).collect()
        });
        Self { poles: pairs.iter().map(|pair| pair.pole).collect(), groups: groups.collect() }
    }

    /// Number of poles, conjugates included.
    pub fn degree(&self) -> usize {
        self.poles.iter().map(|pole| if pole.im == 0.0 { 1 } else { 2 }).sum()
    }

    /// The poles expected in `model`, real ones real and the others above the axis; by its reduction where there is
    /// one.
    pub fn predict(
        &self,
        level: Level,
        model: &Model,
        reduction: &Reduction,
        guesses: &mut Vec<c64>,
    ) {
        guesses.clear();
        for (vectors, poles) in self.groups.iter().zip(self.poles.chunks(WIDTH)) {
            let forms = match reduction.count {
                0 => level.run(Forms { vectors, model }),
                _ => level.run(Reduced { vectors, reduction }),
            };
            for (lane, &pole) in poles.iter().enumerate() {
                let [m, d, k] = forms.each_ref().map(|f| c64::new(f.re[lane], f.im[lane]));
                guesses.push(guess(m, d, k, pole));
            }
        }
    }
}

/// The root of m s² + d s + k nearest to `pole`, of its kind.
fn guess(m: c64, d: c64, k: c64, pole: c64) -> c64 {
    let root = (d * d - 4.0 * m * k).sqrt();
    // The larger of the two without cancellation, the other by their product.
    let sum = if (d + root).norm_sqr() >= (d - root).norm_sqr() { d + root } else { d - root };
    let roots = [-0.5 * sum / m, -2.0 * k / sum];
    let distance = |s: &c64| (s - pole).norm_sqr();
    let finite = roots.into_iter().filter(|s| s.re.is_finite() && s.im.is_finite());
    let best = finite.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(pole);
    if pole.im == 0.0 {
        return c64::new(if best.re == 0.0 { pole.re } else { best.re }, 0.0);
    }
    let least = 0.05 * best.norm();
    c64::new(
        best.re,
        if best.im.abs() >= least { best.im.abs() } else { least.max(f64::MIN_POSITIVE) },
    )
}

/// yᴴMx, yᴴDx and yᴴKx of eight poles.
struct Forms<'a> {
    vectors: &'a [[Complexes; 2]],
    model: &'a Model,
}

impl Kernel for Forms<'_> {
    type Output = [Complexes; 3];

    #[inline(always)]
    fn run<V: Vector>(self) -> [Complexes; 3] {
        let zero = Complex::<V>::splat(0.0, 0.0);
        let mut forms = [zero; 3];
        let matrices = [&self.model.mass, &self.model.damping, &self.model.stiffness];
        for (column, [right, _]) in self.vectors.iter().enumerate() {
            let mut sums = [zero; 3];
            let columns = matrices.map(|matrix| matrix.col(column));
            for (row, [_, left]) in self.vectors.iter().enumerate() {
                let left = Complex::<V>::load(left);
                for (sum, column) in sums.iter_mut().zip(&columns) {
                    *sum = sum.add_real_product(V::splat(column[row]), left);
                }
            }
            let right = Complex::<V>::load(right);
            for (form, sum) in forms.iter_mut().zip(sums) {
                *form = form.add(sum.mul(right));
            }
        }
        let mut stored = [Complexes::ZERO; 3];
        for (to, form) in stored.iter_mut().zip(forms) {
            form.store(to);
        }
        stored
    }
}

/// The same by the reduction of a model.
struct Reduced<'a> {
    vectors: &'a [[Complexes; 2]],
    reduction: &'a Reduction,
}

impl Kernel for Reduced<'_> {
    type Output = [Complexes; 3];

    #[inline(always)]
    fn run<V: Vector>(self) -> [Complexes; 3] {
        let Reduction { elastic, others, count, stride, own, motions, entries, occupied, .. } =
            self.reduction;
        let zero = Complex::<V>::splat(0.0, 0.0);
        let mut forms = [zero; 3];
        let elastic = &self.vectors[elastic.clone()];
        for ([right, left], own) in elastic.iter().zip(own) {
            let product = Complex::<V>::load(right).mul(Complex::load(left));
            for kind in 0..3 {
                forms[kind] = forms[kind].add_real_product(V::splat(own[kind]), product);
            }
        }
        // The motions in both vectors, then the other coordinates.
        let mut seen = vec![[Complexes::ZERO; 2]; count + others.len()];
        for first in (0..*count).step_by(BLOCK) {
            let mut sums = [[zero; 2]; BLOCK];
            for (row, vectors) in motions.chunks_exact(*stride).zip(elastic) {
                let (right, left) = (Complex::<V>::load(&vectors[0]), Complex::load(&vectors[1]));
                let row = &row[first..first + BLOCK];
                for i in 0..BLOCK {
                    let part = V::splat(row[i]);
                    sums[i][0] = sums[i][0].add_real_product(part, right);
                    sums[i][1] = sums[i][1].add_real_product(part, left);
                }
            }
            for i in 0..(count - first).min(BLOCK) {
                sums[i][0].store(&mut seen[first + i][0]);
                sums[i][1].store(&mut seen[first + i][1]);
            }
        }
        for (seen, other) in seen[*count..].iter_mut().zip(others) {
            *seen = self.vectors[*other];
        }
        for &[row, column] in occupied {
            let entry = entries[row * seen.len() + column];
            let (right, left) =
                (Complex::<V>::load(&seen[column][0]), Complex::load(&seen[row][1]));
            let product = right.mul(left);
            for kind in 0..3 {
                forms[kind] = forms[kind].add_real_product(V::splat(entry[kind]), product);
            }
        }
        let mut stored = [Complexes::ZERO; 3];
        for kind in 0..3 {
            forms[kind].store(&mut stored[kind]);
        }
        stored
    }
}
