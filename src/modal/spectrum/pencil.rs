//! The determinant of `L(s) = M s² + D s + K` at eight frequencies at once.
//!
//! Poles at the origin that are known by construction are divided out column by column, exactly. First-order
//! states come first: their rows are sparse. Determinants are those of `elimination`, roots are found in
//! `secular`.

use super::elimination::{Determinants, Elimination};
use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::scaled::{self, Scaled};
use crate::dynamics::Model;
use faer::c64;

/// A polynomial with the poles of a model as its roots.
pub struct Pencil {
    size: usize,
    /// Coefficients of s², s and 1 of every entry, row by row, the null states divided out.
    entries: Vec<[f64; 3]>,
    /// Null states divided out of each column.
    degree: Vec<usize>,
    /// The coordinate at each place.
    order: Vec<usize>,
    /// Entries of first-order rows and columns that are not zero, for which the order is.
    nonzero: Vec<bool>,
    /// Determinant of the mass matrix, the leading coefficient.
    leading: Scaled,
    /// Bound of its relative error.
    leading_error: f64,
    elimination: Elimination,
    /// Scales of rows and columns at the typical modulus.
    scale: [Vec<f64>; 2],
    /// Scales of rows and columns in each lane, powers of two.
    lanes: [Vec<[f64; WIDTH]>; 2],
    largest: Vec<f64>,
    /// Modulus for which the scales are.
    typical: f64,
    factor: Vec<f64>,
}

impl Pencil {
    /// A pencil for models of `size` coordinates.
    pub fn new(size: usize) -> Self {
        Self {
            size,
            entries: vec![[0.0; 3]; size * size],
            degree: vec![0; size],
            order: Vec::new(),
            nonzero: Vec::new(),
            leading: Scaled::ONE,
            leading_error: 0.0,
            elimination: Elimination::new(size),
            scale: [vec![1.0; size], vec![1.0; size]],
            largest: vec![0.0; size],
            typical: 1.0,
            lanes: [vec![[1.0; WIDTH]; size], vec![[1.0; WIDTH]; size]],
            factor: vec![0.0; size * size],
        }
    }

    /// Takes the entries of a model; false where it is not finite or its mass matrix is not positive
    /// definite.
    pub fn set(&mut self, model: &Model) -> bool {
        let (size, n) = (self.size, model.second_order);
        let states = size - n;
        self.arrange(model);
        for (column, &from) in self.order.iter().enumerate() {
            let null = |state| usize::from(model.null_states.contains(&state));
            let degree = if from < n { null(from) + null(n + from) } else { 0 };
            self.degree[column] = degree;
            let [m, d, k] = [&model.mass, &model.damping, &model.stiffness]
                .map(|matrix| matrix.col_as_slice(from));
            let rows = self.entries.iter_mut().skip(column).step_by(size);
            for (entry, &to) in rows.zip(&self.order) {
                *entry = match degree {
                    0 => [m[to], d[to], k[to]],
                    1 => [m[to], d[to], 0.0],
                    _ => [m[to], 0.0, 0.0],
                };
            }
        }
        // A motion that nothing damps: its columns add up to s² M v.
        if let Some(motion) = &model.null_motion {
            let column = |state: usize| state - n + states;
            for row in self.entries.chunks_exact_mut(size) {
                let sum = motion.others.iter().map(|(state, ratio)| ratio * row[column(*state)][0]);
                let most = column(motion.state);
                row[most] = [row[most][0] + sum.sum::<f64>(), 0.0, 0.0];
            }
        }
        let entries = &self.entries;
        self.elimination.shape(states, |row, column| entries[row * size + column] != [0.0; 3]);
        self.entries.iter().flatten().all(|value| value.is_finite()) && self.lead(model)
    }

    /// Puts the first-order states first, in an order in which eliminating them fills in little (Markowitz: the
    /// least product of what is left of row and column), as long as pivots are on the diagonal.
    fn arrange(&mut self, model: &Model) {
        let (size, n) = (self.size, model.second_order);
        let entry = |row: usize, column: usize| {
            let has = |matrix: &faer::Mat<f64>| matrix.col_as_slice(column)[row] != 0.0;
            row == column || has(&model.stiffness) || has(&model.damping)
        };
        let states = (n..size).flat_map(|state| (0..size).map(move |other| (state, other)));
        let both = || states.clone().flat_map(|(a, b)| [(a, b), (b, a)]);
        let known = self.order.len() == size && self.nonzero.len() == 2 * (size - n) * size;
        if known && both().zip(&self.nonzero).all(|((a, b), known)| entry(a, b) == *known) {
            return;
        }
        self.nonzero.clear();
        self.nonzero.extend(both().map(|(a, b)| entry(a, b)));
        let mut filled = vec![false; size * size];
        for (row, column) in both() {
            filled[row * size + column] = entry(row, column);
        }
        let mut left: Vec<usize> = (n..size).collect();
        self.order.clear();
        while !left.is_empty() {
            let others = |state: usize| {
                let active = |other: &usize| *other < n || left.contains(other);
                (0..size).filter(active).filter(move |other| *other != state)
            };
            let product = |state: &usize| {
                let row = others(*state).filter(|other| filled[state * size + other]).count();
                let column = others(*state).filter(|other| filled[other * size + state]).count();
                row * column
            };
            let (at, _) =
                left.iter().map(product).enumerate().min_by_key(|(_, p)| *p).unwrap_or((0, 0));
            let state = left[at];
            let rows: Vec<usize> = others(state).filter(|o| filled[o * size + state]).collect();
            let columns: Vec<usize> = others(state).filter(|o| filled[state * size + o]).collect();
            for &row in &rows {
                for &column in &columns {
                    filled[row * size + column] = true;
                }
            }
            left.remove(at);
            self.order.push(state);
        }
        self.order.extend(0..n);
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
        let powers = powers_of(modulus);
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

    /// The polynomial over its leading coefficient at eight frequencies, rad/s.
    pub fn evaluate(&mut self, level: Level, points: &Complexes) -> Determinants {
        let mut found = level.run(Evaluate { pencil: self, points });
        for (value, error) in found.value.iter_mut().zip(&mut found.error) {
            *value = value.over(self.leading);
            *error += self.leading_error;
        }
        found
    }
}

/// Powers of s that go with the coefficients of an entry from whose column a power was divided out.
type Powers<T> = [[T; 3]; 3];

/// Fills in the scaled matrices and eliminates.
struct Evaluate<'a> {
    pencil: &'a mut Pencil,
    points: &'a Complexes,
}

impl Kernel for Evaluate<'_> {
    type Output = Determinants;

    #[inline(always)]
    fn run<V: Vector>(self) -> Determinants {
        let pencil = self.pencil;
        let n = pencil.size;
        let s = Complex::<V>::load(self.points);
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let square = s.square().max(V::splat(f64::MIN_POSITIVE));
        let modulus = square.sqrt();
        let [zeros, ones] = [zero, one].map(|re| Complex { re, im: zero });
        let powers = [[s.mul(s), s, ones], [s, ones, zeros], [ones, zeros, zeros]];
        let sizes = [[square, modulus, one], [modulus, one, zero], [one, zero, zero]];
        let exponent = scale(pencil, &sizes);
        let Pencil { entries, degree, elimination, lanes, .. } = pencil;
        for i in 0..n {
            let row_scale = V::load(&lanes[0][i]);
            let mut j = elimination.element(i, 0);
            while j < n {
                let [m, d, k] = entries[i * n + j].map(V::splat);
                let factor = row_scale.mul(V::load(&lanes[1][j]));
                let [square, linear, constant] = powers[degree[j]];
                let value = constant.scale(k).add_real_product(d, linear);
                let value = value.add_real_product(m, square).scale(factor);
                value.store(&mut elimination.matrix[i * n + j]);
                // Each term of an element is rounded a few times.
                let [square, linear, constant] = sizes[degree[j]];
                let size = k.abs().mul(constant);
                let size = m.abs().mul_add(square, d.abs().mul_add(linear, size));
                size.mul(V::splat(4.0)).mul(factor).store(&mut elimination.doubt[i * n + j]);
                j = elimination.element(i, j + 1);
            }
        }
        let mut found = elimination.run::<V>();
        for (value, exponent) in found.value.iter_mut().zip(exponent) {
            *value = value.shifted(exponent);
        }
        found
    }
}

/// Scales of each lane: those of the typical modulus, moved with the diagonal; powers of two. Gives the
/// exponents that the determinants lack.
#[inline(always)]
fn scale<V: Vector>(pencil: &mut Pencil, sizes: &Powers<V>) -> [i64; WIDTH] {
    let mut exponent = [0; WIDTH];
    let ratio = sizes[0][1].mul(V::splat(1.0 / pencil.typical));
    let lacking = [V::splat(1.0), ratio, ratio.mul(ratio)];
    for i in 0..pencil.size {
        let degree = pencil.degree[i];
        let terms = pencil.entries[i * pencil.size + i].map(f64::abs);
        let typical = powers_of(pencil.typical)[degree];
        let typical: f64 = terms.iter().zip(typical).map(|(term, power)| term * power).sum();
        let [m, d, k] = terms.map(V::splat);
        let [square, linear, constant] = sizes[degree];
        let diagonal = m.mul_add(square, d.mul_add(linear, k.mul(constant)));
        let moved = if typical > 0.0 { V::splat(typical).div(diagonal) } else { V::splat(1.0) };
        let row = moved.div(lacking[degree]).sqrt().mul(V::splat(pencil.scale[0][i]));
        let column = moved.mul(lacking[degree]).sqrt().mul(V::splat(pencil.scale[1][i]));
        for (side, value) in [row, column].into_iter().enumerate() {
            let to = &mut pencil.lanes[side][i];
            value.store(to);
            for (value, exponent) in to.iter_mut().zip(&mut exponent) {
                *value = scaled::power_near(*value);
                *exponent -= scaled::exponent(*value);
            }
        }
    }
    exponent
}

/// The powers at a modulus.
fn powers_of(modulus: f64) -> Powers<f64> {
    [[modulus * modulus, modulus, 1.0], [modulus, 1.0, 0.0], [1.0, 0.0, 0.0]]
}
