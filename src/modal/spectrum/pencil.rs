//! The determinant of `L(s) = M s² + D s + K` at eight frequencies at once, by elimination.
//!
//! Poles at the origin that are known by construction are divided out column by column, exactly. Roots are found
//! in `secular`.

use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::scaled::{self, Scaled};
use crate::dynamics::Model;
use faer::c64;

/// Multiplier of a row beyond which rows are exchanged, squared.
const LARGEST_MULTIPLIER: f64 = 64.0;
/// What the bound of a determinant leaves for the estimate of the norm of the inverse by one vector.
const SAFETY: f64 = 2.0;

/// A polynomial with the poles of a model as its roots.
pub struct Pencil {
    size: usize,
    /// Coefficients of s², s and 1 of every entry, row by row, the null states divided out.
    entries: Vec<[f64; 3]>,
    /// Null states divided out of each column.
    degree: Vec<usize>,
    /// Determinant of the mass matrix, the leading coefficient.
    leading: Scaled,
    /// Bound of its relative error.
    leading_error: f64,
    matrix: Vec<Complexes>,
    column: Vec<Complexes>,
    rows: Vec<usize>,
    /// Scales of rows and columns at the typical modulus.
    scale: [Vec<f64>; 2],
    /// Scales of rows and columns in each lane, powers of two.
    lanes: [Vec<[f64; WIDTH]>; 2],
    largest: Vec<f64>,
    /// Elements of unit modulus and no structure.
    probe: Vec<c64>,
    /// Modulus for which the scales are.
    typical: f64,
    factor: Vec<f64>,
}

/// Values at eight frequencies: the polynomial over its leading coefficient, and the bounds of their
/// relative errors.
pub struct Values {
    /// Values.
    pub value: [Scaled; WIDTH],
    /// Bounds.
    pub error: [f64; WIDTH],
}

impl Pencil {
    /// A pencil for models of `size` coordinates.
    pub fn new(size: usize) -> Self {
        Self {
            size,
            entries: vec![[0.0; 3]; size * size],
            degree: vec![0; size],
            leading: Scaled::ONE,
            leading_error: 0.0,
            matrix: vec![Complexes::ZERO; size * size],
            column: vec![Complexes::ZERO; size],
            rows: (0..size).collect(),
            scale: [vec![1.0; size], vec![1.0; size]],
            largest: vec![0.0; size],
            probe: (0..size)
                .map(|i| {
                    let angle = (i as f64 + 1.0) * (i as f64 + 2.0) * 0.618_033_988_749_894_9;
                    c64::new(angle.cos(), angle.sin())
                })
                .collect(),
            typical: 1.0,
            lanes: [vec![[1.0; WIDTH]; size], vec![[1.0; WIDTH]; size]],
            factor: vec![0.0; size * size],
        }
    }

    /// Takes the entries of a model; false where it is not finite or its mass matrix is not positive
    /// definite.
    pub fn set(&mut self, model: &Model) -> bool {
        let (size, n) = (self.size, model.second_order);
        // A turn with a velocity is left to the dense solver.
        if model.null_motion.as_ref().is_some_and(|motion| motion.state < n) {
            return false;
        }
        for (column, degree) in self.degree.iter_mut().enumerate() {
            let null = |state| usize::from(model.null_states.contains(&state));
            *degree = if column < n { null(column) + null(n + column) } else { 0 };
            for row in 0..size {
                let at = (row, column);
                let [m, d, k] = [model.mass[at], model.damping[at], model.stiffness[at]];
                self.entries[row * size + column] = match degree {
                    0 => [m, d, k],
                    1 => [m, d, 0.0],
                    _ => [m, 0.0, 0.0],
                };
            }
        }
        // A motion that nothing damps: its columns add up to s² M v.
        if let Some(motion) = &model.null_motion {
            let most = motion.state - n;
            for row in self.entries.chunks_exact_mut(size) {
                let sum = motion.others.iter().map(|(state, ratio)| ratio * row[state - n][0]);
                row[most] = [row[most][0] + sum.sum::<f64>(), 0.0, 0.0];
            }
        }
        self.entries.iter().flatten().all(|value| value.is_finite()) && self.lead(model)
    }

    /// The determinant of the mass matrix by Cholesky, on a unit diagonal: there the elements of |R||Rᵀ| are
    /// at most one, so that the factors are those of `M + E`, `|E| ≤ γ_{n+1}`, and the determinant is off
    /// by at most `γ_{n+1} Σ|M⁻¹| ≤ γ_{n+1} n tr M⁻¹` (Higham, Accuracy and Stability, theorem 10.3).
    fn lead(&mut self, model: &Model) -> bool {
        let n = model.second_order;
        let factor = &mut self.factor[..n * n];
        let mut leading = Scaled::ONE;
        let mut unit = vec![0.0; n];
        for (i, unit) in unit.iter_mut().enumerate() {
            let diagonal = model.mass[(i, i)];
            if !(diagonal > 0.0) {
                return false;
            }
            *unit = 1.0 / diagonal.sqrt();
            leading = leading.times(c64::new(diagonal, 0.0));
        }
        for i in 0..n {
            for j in 0..=i {
                let (row, other) = (&factor[i * n..i * n + j], &factor[j * n..j * n + j]);
                let dot: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
                let value = model.mass[(i, j)] * unit[i] * unit[j] - dot;
                if i > j {
                    factor[i * n + j] = value / factor[j * n + j];
                } else if value > 0.0 {
                    factor[i * n + i] = value.sqrt();
                    leading = leading.times(c64::new(value, 0.0));
                } else {
                    return false;
                }
            }
        }
        // tr M⁻¹ = ‖R⁻¹‖², column by column of R⁻¹.
        let mut trace = 0.0;
        let mut inverse = vec![0.0; n];
        for column in 0..n {
            for i in column..n {
                let row = &factor[i * n + column..i * n + i];
                let dot: f64 = row.iter().zip(&inverse[column..]).map(|(a, b)| a * b).sum();
                let unit = if i == column { 1.0 } else { 0.0 };
                inverse[i] = (unit - dot) / factor[i * n + i];
                trace += inverse[i] * inverse[i];
            }
        }
        self.leading = leading;
        self.leading_error = (n as f64 + 8.0) * n as f64 * f64::EPSILON * trace;
        self.leading_error.is_finite()
    }

    /// Scales that bring the largest entries of rows and columns near one at frequencies of this modulus.
    pub fn equilibrate(&mut self, modulus: f64) {
        let size = self.size;
        let powers = [[modulus * modulus, modulus, 1.0], [modulus, 1.0, 0.0], [1.0, 0.0, 0.0]];
        let [rows, columns] = &mut self.scale;
        for (i, (row, column)) in rows.iter_mut().zip(columns.iter_mut()).enumerate() {
            let [m, d, k] = self.entries[i * size + i].map(f64::abs);
            let of = powers[self.degree[i]];
            let diagonal = m * of[0] + d * of[1] + k * of[2];
            // Where s was divided out of a column, its row still has all powers.
            let root = if diagonal > 0.0 { diagonal.sqrt().recip() } else { 1.0 };
            let lacking = modulus.powi(self.degree[i] as i32).sqrt();
            (*row, *column) = (root / lacking, root * lacking);
        }
        for _ in 0..2 {
            self.largest.fill(0.0);
            for (i, entries) in self.entries.chunks_exact(size).enumerate() {
                let mut most = 0.0_f64;
                for (((entry, degree), column), largest) in
                    entries.iter().zip(&self.degree).zip(&*columns).zip(&mut self.largest)
                {
                    let of = powers[*degree];
                    let [m, d, k] = entry.map(f64::abs);
                    let value = (m * of[0] + d * of[1] + k * of[2]) * column * rows[i];
                    most = most.max(value);
                    *largest = largest.max(value);
                }
                // A row is divided at once by the root of its largest entry, columns at the end.
                if most > 0.0 {
                    rows[i] /= most.sqrt();
                }
            }
            for (column, largest) in columns.iter_mut().zip(&self.largest) {
                if *largest > 0.0 {
                    *column /= largest.sqrt();
                }
            }
        }
        self.typical = modulus;
    }

    /// Scales of each lane: those of the typical modulus, moved with the diagonal; powers of two. Gives the
    /// exponents that the determinants lack.
    fn scale_lanes(&mut self, points: &Complexes) -> [i64; WIDTH] {
        let mut exponent = [0; WIDTH];
        let modulus: [f64; WIDTH] = std::array::from_fn(|lane| {
            points.re[lane].hypot(points.im[lane]).max(f64::MIN_POSITIVE)
        });
        let [rows, columns] = &self.scale;
        for i in 0..self.size {
            let [m, d, k] = self.entries[i * self.size + i].map(f64::abs);
            let degree = self.degree[i] as i32;
            let diagonal = |s: f64| match degree {
                0 => (m * s + d) * s + k,
                1 => m * s + d,
                _ => m,
            };
            let typical = diagonal(self.typical);
            for lane in 0..WIDTH {
                let moved = if typical > 0.0 { typical / diagonal(modulus[lane]) } else { 1.0 };
                let lacking = (modulus[lane] / self.typical).powi(degree);
                let row = scaled::power_near(rows[i] * (moved / lacking).sqrt());
                let column = scaled::power_near(columns[i] * (moved * lacking).sqrt());
                (self.lanes[0][i][lane], self.lanes[1][i][lane]) = (row, column);
                exponent[lane] -= scaled::exponent(row) + scaled::exponent(column);
            }
        }
        exponent
    }

    /// The polynomial over its leading coefficient at eight frequencies, rad/s.
    pub fn evaluate(&mut self, level: Level, points: &Complexes) -> Values {
        let exponent = self.scale_lanes(points);
        let rounding = 0.5 * f64::EPSILON;
        let Factored { mut value, norm, growth } = level.run(Factor { pencil: self, points });
        // The factors are those of A + E, whose elements gather min(i, j) roundings of sums below g and those of
        // the entries: √min(i, j) of them with high probability (Higham and Mary, SIAM J. Sci. Comput. 41,
        // 2019), so that ‖E‖ is below (2 N^1.5 + 8 N) u g. det(A + E)/det A − 1 is tr A⁻¹E ≤ ‖A⁻¹‖ ‖E‖ to first
        // order. Values beside the nodes check it in every case.
        let n = self.size as f64;
        let backward = (2.0 * n * n.sqrt() + 8.0 * n) * rounding;
        let mut error = [0.0; WIDTH];
        for lane in 0..WIDTH {
            value[lane] = value[lane].shifted(exponent[lane]).over(self.leading);
            let relative = SAFETY * backward * growth[lane] * norm[lane];
            error[lane] = relative + self.leading_error + 8.0 * n * f64::EPSILON;
        }
        Values { value, error }
    }
}

/// What elimination gives.
struct Factored {
    /// Determinants of the scaled matrix.
    value: [Scaled; WIDTH],
    /// Estimates of ‖A⁻¹‖ (Frobenius) of the scaled matrix.
    norm: [f64; WIDTH],
    /// Largest moduli met.
    growth: [f64; WIDTH],
}

/// Fills the scaled matrix and factors it: rows are combined column by column from the left
/// (Crout), four rows at a time, and exchanged for all lanes alike.
struct Factor<'a> {
    pencil: &'a mut Pencil,
    points: &'a Complexes,
}

impl Kernel for Factor<'_> {
    type Output = Factored;

    #[inline(always)]
    fn run<V: Vector>(self) -> Factored {
        let Pencil { size: n, entries, degree, matrix, column, rows, lanes, probe, .. } =
            self.pencil;
        let n = *n;
        let s = Complex::<V>::load(self.points);
        let one = Complex::<V>::splat(1.0, 0.0);
        let zero = Complex::<V>::splat(0.0, 0.0);
        let powers = [[s.mul(s), s, one], [s, one, zero], [one, zero, zero]];
        let mut largest = V::splat(0.0);
        for i in 0..n {
            let row_scale = V::load(&lanes[0][i]);
            for j in 0..n {
                let [m, d, k] = entries[i * n + j];
                let to = &mut matrix[i * n + j];
                if m == 0.0 && d == 0.0 && k == 0.0 {
                    *to = Complexes::ZERO;
                    continue;
                }
                let factor = row_scale.mul(V::load(&lanes[1][j]));
                let [square, linear, constant] = powers[degree[j]];
                let value = constant.scale(V::splat(k));
                let value = value.add_real_product(V::splat(d), linear);
                let value = value.add_real_product(V::splat(m), square).scale(factor);
                largest = largest.max(value.square());
                value.store(to);
            }
        }
        for (i, row) in rows.iter_mut().enumerate() {
            *row = i;
        }
        let mut product = scaled::Product::<V>::new();
        let mut sign = [1.0; WIDTH];
        for j in 0..n {
            for (i, to) in column.iter_mut().enumerate() {
                *to = matrix[rows[i] * n + j];
            }
            solve_lower::<V>(matrix, rows, column, j, n);
            let mut most = V::splat(0.0);
            for value in &column[j..] {
                most = most.max(Complex::<V>::load(value).square());
            }
            for value in &column[..j] {
                largest = largest.max(Complex::<V>::load(value).square());
            }
            largest = largest.max(most);
            let best = pivot::<V>(&column[j..], most);
            if best > 0 {
                rows.swap(j, j + best);
                column.swap(j, j + best);
                sign = sign.map(|sign: f64| -sign);
            }
            exchange_lanes::<V>(matrix, rows, column, j, most, &mut sign);
            guard(&mut column[j]);
            let pivot = Complex::<V>::load(&column[j]);
            product.times(pivot);
            let inverse = pivot.reciprocal();
            inverse.store(&mut matrix[rows[j] * n + j]);
            for i in 0..j {
                matrix[rows[i] * n + j] = column[i];
            }
            for i in j + 1..n {
                Complex::<V>::load(&column[i]).mul(inverse).store(&mut matrix[rows[i] * n + j]);
            }
        }
        let norm = inverse_norm::<V>(matrix, rows, column, probe, n);
        let mut growth = [0.0; WIDTH];
        largest.sqrt().store(&mut growth);
        let value = product.finish();
        let value = std::array::from_fn(|lane| value[lane].times(c64::new(sign[lane], 0.0)));
        Factored { value, norm, growth }
    }
}

/// Subtracts from each element of `column` what the rows above it, at most `known`, contribute:
/// `c_i −= Σ_{k < min(i, known)} l_ik c_k`.
#[inline(always)]
fn solve_lower<V: Vector>(
    matrix: &[Complexes],
    rows: &[usize],
    column: &mut [Complexes],
    known: usize,
    n: usize,
) {
    let mut first = 0;
    while first < n {
        let length = first.min(known);
        let count = (n - first).min(4);
        let (done, rest) = column.split_at_mut(first);
        let done = &done[..length];
        if count == 4 {
            let of = |i: usize| &matrix[rows[first + i] * n..][..n];
            let from = [of(0), of(1), of(2), of(3)];
            let mut sum: [Complex<V>; 4] = std::array::from_fn(|i| Complex::load(&rest[i]));
            let known_rows = from.map(|row| &row[..length]);
            for k in 0..length {
                let c = Complex::<V>::load(&done[k]);
                for i in 0..4 {
                    sum[i] = sum[i].subtract_product(Complex::load(&known_rows[i][k]), c);
                }
            }
            for i in 1..4 {
                for k in 0..i {
                    if first + k < known {
                        let l = Complex::load(&from[i][first + k]);
                        sum[i] = sum[i].subtract_product(l, sum[k]);
                    }
                }
            }
            for i in 0..4 {
                sum[i].store(&mut rest[i]);
            }
        } else {
            for i in 0..count {
                let from = &matrix[rows[first + i] * n..][..n];
                let mut sum = Complex::<V>::load(&rest[i]);
                for (l, c) in from[..length].iter().zip(done) {
                    sum = sum.subtract_product(Complex::load(l), Complex::load(c));
                }
                for k in 0..i {
                    if first + k < known {
                        let l = Complex::load(&from[first + k]);
                        sum = sum.subtract_product(l, Complex::load(&rest[k]));
                    }
                }
                sum.store(&mut rest[i]);
            }
        }
        first += count;
    }
}

/// The row whose element is nowhere far below the largest; the first where it does.
#[inline(always)]
fn pivot<V: Vector>(column: &[Complexes], most: V) -> usize {
    let mut largest = [0.0; WIDTH];
    most.store(&mut largest);
    let least = |value: &Complexes| {
        let mut square = [0.0; WIDTH];
        Complex::<V>::load(value).square().store(&mut square);
        let shares = square.iter().zip(&largest).map(|(square, largest)| square / largest);
        shares.fold(f64::INFINITY, f64::min)
    };
    if least(&column[0]) * LARGEST_MULTIPLIER >= 1.0 {
        return 0;
    }
    let mut best = (0, -1.0);
    for (i, value) in column.iter().enumerate() {
        let share = least(value);
        if share > best.1 {
            best = (i, share);
        }
    }
    best.0
}

/// Exchanges rows in those lanes alone whose pivot is still far below the largest.
#[inline(always)]
fn exchange_lanes<V: Vector>(
    matrix: &mut [Complexes],
    rows: &[usize],
    column: &mut [Complexes],
    j: usize,
    most: V,
    sign: &mut [f64; WIDTH],
) {
    let (mut largest, mut square) = ([0.0; WIDTH], [0.0; WIDTH]);
    most.store(&mut largest);
    Complex::<V>::load(&column[j]).square().store(&mut square);
    let n = rows.len();
    for lane in 0..WIDTH {
        if square[lane] * LARGEST_MULTIPLIER >= largest[lane] {
            continue;
        }
        let size = |i: &usize| {
            let value = &column[*i];
            value.re[lane].hypot(value.im[lane])
        };
        let best = (j..n).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(j);
        if best == j {
            continue;
        }
        let exchange = |a: &mut [Complexes], first: usize, second: usize| {
            let (low, high) = (first.min(second), first.max(second));
            let (left, right) = a.split_at_mut(high);
            std::mem::swap(&mut left[low].re[lane], &mut right[0].re[lane]);
            std::mem::swap(&mut left[low].im[lane], &mut right[0].im[lane]);
        };
        exchange(column, j, best);
        for c in 0..n {
            exchange(matrix, rows[j] * n + c, rows[best] * n + c);
        }
        sign[lane] = -sign[lane];
    }
}

/// Puts a pivot of the size of rounding where there is none: no farther from the matrix than its factors are.
#[inline(always)]
fn guard(pivot: &mut Complexes) {
    for lane in 0..WIDTH {
        if pivot.re[lane] == 0.0 && pivot.im[lane] == 0.0 {
            pivot.re[lane] = f64::EPSILON;
        }
    }
}

/// ‖A⁻¹ v‖ for a vector of elements of unit modulus and no structure, in expectation the Frobenius norm.
#[inline(always)]
fn inverse_norm<V: Vector>(
    matrix: &[Complexes],
    rows: &[usize],
    column: &mut [Complexes],
    probe: &[c64],
    n: usize,
) -> [f64; WIDTH] {
    for (value, unit) in column.iter_mut().zip(probe) {
        *value = Complexes { re: [unit.re; WIDTH], im: [unit.im; WIDTH] };
    }
    solve_lower::<V>(matrix, rows, column, n, n);
    let mut sum = V::splat(0.0);
    for k in (0..n).rev() {
        let inverse = Complex::<V>::load(&matrix[rows[k] * n + k]);
        let x = Complex::<V>::load(&column[k]).mul(inverse);
        sum = sum.add(x.square());
        for i in 0..k {
            let u = Complex::<V>::load(&matrix[rows[i] * n + k]);
            let value = Complex::<V>::load(&column[i]);
            value.subtract_product(u, x).store(&mut column[i]);
        }
    }
    let mut norm = [0.0; WIDTH];
    sum.sqrt().store(&mut norm);
    norm
}
