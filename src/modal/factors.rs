//! Factors of one complex matrix, made eight rows at a time: `P A = L U` with partial pivoting, and the solutions
//! of `A x = b` and `Aᴴ y = b`.
//!
//! Which matrix it is, and what solutions mean, is decided in `eigen`.

use super::spectrum::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use faer::c64;

/// A matrix, then its factors; columns stand in blocks of eight rows, the last of which ends in zeros.
pub struct Factors {
    level: Level,
    size: usize,
    /// The matrix, then what is above its diagonal; zero elsewhere.
    upper: Vec<Complexes>,
    /// What is below the diagonal, zero elsewhere.
    lower: Vec<Complexes>,
    /// Diagonal of U.
    pivots: Vec<c64>,
    /// Row with which each row was exchanged, in turn.
    exchanges: Vec<usize>,
    work: Vec<Complexes>,
}

fn get(column: &[Complexes], row: usize) -> c64 {
    let block = &column[row / WIDTH];
    c64::new(block.re[row % WIDTH], block.im[row % WIDTH])
}

fn set(column: &mut [Complexes], row: usize, value: c64) {
    let block = &mut column[row / WIDTH];
    (block.re[row % WIDTH], block.im[row % WIDTH]) = (value.re, value.im);
}

fn swap(column: &mut [Complexes], a: usize, b: usize) {
    let (at_a, at_b) = (get(column, a), get(column, b));
    set(column, a, at_b);
    set(column, b, at_a);
}

impl Factors {
    /// Buffers for matrices of `size` rows.
    pub fn new(size: usize) -> Self {
        Self::with(size, Level::best())
    }

    /// Buffers for matrices of `size` rows, with this instruction set.
    pub fn with(size: usize, level: Level) -> Self {
        let blocks = size.div_ceil(WIDTH);
        Self {
            level,
            size,
            upper: vec![Complexes::ZERO; size * blocks],
            lower: vec![Complexes::ZERO; size * blocks],
            pivots: vec![c64::new(1.0, 0.0); size],
            exchanges: (0..size).collect(),
            work: vec![Complexes::ZERO; blocks],
        }
    }

    /// Sets a column of the matrix, before it is factored.
    pub fn set_column(&mut self, column: usize, values: impl IntoIterator<Item = c64>) {
        let blocks = self.size.div_ceil(WIDTH);
        let to = &mut self.upper[column * blocks..][..blocks];
        values.into_iter().enumerate().for_each(|(row, value)| set(to, row, value));
    }

    /// Factors the matrix. A pivot that is rounding beside the largest before it, as the last one is at a pole, is
    /// made no less than that: solutions are then large, not infinite.
    pub fn factor(&mut self) {
        self.level.run(Factor(self));
    }

    /// The solution of `A x = b`, in place.
    pub fn solve(&mut self, b: &mut [c64]) {
        self.level.run(Solve { factors: self, b, adjoint: false });
    }

    /// The solution of `Aᴴ y = b`, in place.
    pub fn solve_adjoint(&mut self, b: &mut [c64]) {
        self.level.run(Solve { factors: self, b, adjoint: true });
    }
}

/// `to −= factor · column`, for one or more columns of the same length.
#[inline(always)]
fn subtract<V: Vector, const N: usize>(
    to: &mut [Complexes],
    factors: [c64; N],
    columns: [&[Complexes]; N],
) {
    let factors = factors.map(|factor| Complex::<V>::splat(factor.re, factor.im));
    let columns = columns.map(|column| &column[..to.len()]);
    for (block, to) in to.iter_mut().enumerate() {
        let mut value = Complex::load(to);
        for (factor, column) in factors.iter().zip(&columns) {
            value = value.subtract_product(*factor, Complex::load(&column[block]));
        }
        value.store(to);
    }
}

/// `columnᴴ · vector`.
#[inline(always)]
fn product<V: Vector>(column: &[Complexes], vector: &[Complexes]) -> c64 {
    let mut sum = Complex::<V>::splat(0.0, 0.0);
    for (a, b) in column.iter().zip(vector) {
        let (a, b) = (Complex::<V>::load(a), Complex::<V>::load(b));
        sum = Complex {
            re: a.im.mul_add(b.im, a.re.mul_add(b.re, sum.re)),
            im: a.im.negative_mul_add(b.re, a.re.mul_add(b.im, sum.im)),
        };
    }
    let mut lanes = Complexes::ZERO;
    sum.store(&mut lanes);
    c64::new(lanes.re.iter().sum(), lanes.im.iter().sum())
}

struct Factor<'a>(&'a mut Factors);

impl Kernel for Factor<'_> {
    type Output = ();

    /// Column by column from the left.
    #[inline(always)]
    fn run<V: Vector>(self) {
        let Factors { size, upper, lower, pivots, exchanges, work, .. } = self.0;
        let blocks = work.len();
        let mut largest = 0.0_f64;
        for j in 0..*size {
            work.copy_from_slice(&upper[j * blocks..][..blocks]);
            for (k, other) in exchanges[..j].iter().enumerate() {
                swap(work, k, *other);
            }
            // Two columns at a time: each load of the work serves both.
            for k in (0..j / 2).map(|pair| 2 * pair) {
                let first = k / WIDTH;
                let (one, two) = lower[k * blocks..][..2 * blocks].split_at(blocks);
                let factor = get(work, k);
                let next = get(work, k + 1) - factor * get(one, k + 1);
                subtract::<V, _>(
                    &mut work[first..],
                    [factor, next],
                    [&one[first..], &two[first..]],
                );
            }
            if j % 2 == 1 {
                let (k, first) = (j - 1, (j - 1) / WIDTH);
                let factor = get(work, k);
                subtract::<V, _>(
                    &mut work[first..],
                    [factor],
                    [&lower[k * blocks..][first..blocks]],
                );
            }
            let (first, mut best, mut most) = (j / WIDTH, j, get(work, j).norm_sqr());
            for (block, values) in work.iter().enumerate().skip(first) {
                let mut squares = [0.0; WIDTH];
                Complex::<V>::load(values).square().store(&mut squares);
                for (lane, square) in squares.into_iter().enumerate() {
                    let row = block * WIDTH + lane;
                    if square > most && row > j {
                        (best, most) = (row, square);
                    }
                }
            }
            exchanges[j] = best;
            if best != j {
                swap(work, j, best);
                for column in lower.chunks_exact_mut(blocks).take(j) {
                    swap(column, j, best);
                }
            }
            let modulus = most.sqrt();
            largest = largest.max(modulus);
            pivots[j] = get(work, j);
            if !(modulus > largest * f64::EPSILON * f64::EPSILON) {
                let least = if largest > 0.0 { largest * f64::EPSILON } else { 1.0 };
                pivots[j] = c64::new(least, 0.0);
            }
            let inverse = pivots[j].inv();
            let inverse = Complex::<V>::splat(inverse.re, inverse.im);
            let (above, below) = (&mut upper[j * blocks..][..blocks], &mut lower[j * blocks..]);
            for (to, value) in below[first..blocks].iter_mut().zip(&work[first..]) {
                Complex::<V>::load(value).mul(inverse).store(to);
            }
            below[..first].fill(Complexes::ZERO);
            above[..=first].copy_from_slice(&work[..=first]);
            above[first + 1..].fill(Complexes::ZERO);
            for row in first * WIDTH..=j {
                set(below, row, c64::new(0.0, 0.0));
            }
            for row in j..(first + 1) * WIDTH {
                set(above, row, c64::new(0.0, 0.0));
            }
        }
    }
}

/// A column of a factor.
fn column(of: &[Complexes], k: usize, blocks: usize) -> &[Complexes] {
    &of[k * blocks..][..blocks]
}

struct Solve<'a> {
    factors: &'a mut Factors,
    b: &'a mut [c64],
    adjoint: bool,
}

impl Kernel for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Factors { size, upper, lower, pivots, exchanges, work, .. } = self.factors;
        let (size, blocks, b) = (*size, work.len(), self.b);
        work.fill(Complexes::ZERO);
        b.iter().enumerate().for_each(|(row, value)| set(work, row, *value));
        // The blocks of a column that are not zero.
        let above = |k: usize| 0..k / WIDTH + 1;
        let below = |k: usize| k / WIDTH..blocks;
        if self.adjoint {
            for k in 0..size {
                let sum = product::<V>(&column(upper, k, blocks)[above(k)], &work[above(k)]);
                let value = (get(work, k) - sum) / pivots[k].conj();
                set(work, k, value);
            }
            for k in (0..size).rev() {
                let sum = product::<V>(&column(lower, k, blocks)[below(k)], &work[below(k)]);
                let value = get(work, k) - sum;
                set(work, k, value);
            }
            for k in (0..size).rev() {
                swap(work, k, exchanges[k]);
            }
        } else {
            for (k, other) in exchanges.iter().enumerate() {
                swap(work, k, *other);
            }
            for k in 0..size {
                let factor = get(work, k);
                subtract::<V, 1>(
                    &mut work[below(k)],
                    [factor],
                    [&column(lower, k, blocks)[below(k)]],
                );
            }
            for k in (0..size).rev() {
                let factor = get(work, k) / pivots[k];
                subtract::<V, 1>(
                    &mut work[above(k)],
                    [factor],
                    [&column(upper, k, blocks)[above(k)]],
                );
                set(work, k, factor);
            }
        }
        b.iter_mut().enumerate().for_each(|(row, value)| *value = get(work, row));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number that looks random, between −1 and 1.
    fn odd(seed: usize) -> f64 {
        (78.233 * seed as f64 + 0.4).sin()
    }

    fn entry(size: usize, row: usize, column: usize) -> c64 {
        let seed = row * size + column;
        // Some zeros on the diagonal, so that rows must be exchanged.
        if row == column && row.is_multiple_of(3) {
            return c64::new(0.0, 0.0);
        }
        c64::new(odd(seed), odd(seed + 7919))
    }

    #[test]
    fn solutions_satisfy_their_equations_at_every_size_and_level() {
        for level in Level::all() {
            // An interpreter takes minutes for the large ones.
            for size in [1, 2, 7, 8, 9, 16, 41, 80].into_iter().filter(|n| !cfg!(miri) || *n < 16) {
                let mut factors = Factors::with(size, level);
                let matrix = |row: usize, column: usize| {
                    if size == 1 { c64::new(2.0, 1.0) } else { entry(size, row, column) }
                };
                // Twice, since buffers are reused.
                for _ in 0..2 {
                    for column in 0..size {
                        factors.set_column(column, (0..size).map(|row| matrix(row, column)));
                    }
                    factors.factor();
                }
                let b: Vec<c64> = (0..size).map(|i| c64::new(odd(i + 31), odd(i + 77))).collect();
                let (mut x, mut y) = (b.clone(), b.clone());
                factors.solve(&mut x);
                factors.solve_adjoint(&mut y);
                // Backward stable to n ε ‖A‖ ‖x‖ times the growth of pivots, here below ten.
                let bound = |v: &[c64]| {
                    let norm = v.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
                    10.0 * (size * size) as f64 * f64::EPSILON * norm.max(1.0)
                };
                for (i, of_b) in b.iter().enumerate() {
                    let row: c64 = (0..size).map(|j| matrix(i, j) * x[j]).sum();
                    let column: c64 = (0..size).map(|j| matrix(j, i).conj() * y[j]).sum();
                    assert!((row - of_b).norm() <= bound(&x), "{level:?} {size}: {row}");
                    assert!((column - of_b).norm() <= bound(&y), "{level:?} {size}: {column}");
                }
            }
        }
    }

    #[test]
    fn a_singular_matrix_gives_its_null_vectors() {
        // Rows 1, 2, 3 of an arithmetic progression: A (1, −2, 1)ᵀ = 0 and (1, −2, 1) A = 0.
        let mut factors = Factors::new(3);
        for column in 0..3 {
            let entry = |row: usize| c64::new((3 * row + column + 1) as f64, 0.0);
            factors.set_column(column, (0..3).map(entry));
        }
        factors.factor();
        let (mut x, mut y) = (vec![c64::new(1.0, 0.5); 3], vec![c64::new(1.0, 0.2); 3]);
        x[0] = c64::new(3.0, 0.0);
        y[0] = c64::new(3.0, 0.0);
        factors.solve(&mut x);
        factors.solve_adjoint(&mut y);
        for v in [x, y] {
            assert!(v.iter().all(|z| z.is_finite()));
            for (i, expected) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                assert!((v[i] / v[0] - expected).norm() < 1e3 * f64::EPSILON, "{v:?}");
            }
        }
    }

    #[test]
    fn avx2_and_avx_512_give_the_same_bits() {
        let solutions =
            Level::all().into_iter().filter(|level| *level != Level::Portable).map(|level| {
                let mut factors = Factors::with(21, level);
                for column in 0..21 {
                    factors.set_column(column, (0..21).map(|row| entry(21, row, column)));
                }
                factors.factor();
                let mut x = vec![c64::new(1.0, -0.5); 21];
                factors.solve(&mut x);
                factors.solve_adjoint(&mut x);
                x
            });
        let solutions: Vec<_> = solutions.collect();
        assert!(solutions.windows(2).all(|pair| pair[0] == pair[1]));
    }
}
