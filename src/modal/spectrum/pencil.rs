//! The determinant of `L(s) = M s² + D s + K` at eight frequencies at once.
//!
//! Poles at the origin that are known by construction are divided out column by column, exactly. First-order
//! states come first: their rows are sparse. Elastic coordinates that act through a few motions (`reduction`) are
//! eliminated in closed form (`gram`): with y = Bη, `det L = Π e det [[I + GZ, Ga], [β, L]]` over the motions and the
//! other coordinates. Determinants are those of `elimination`, roots are found in `secular`.

#![expect(
    clippy::needless_range_loop,
    reason = "closures and iterators do not inline into kernels of an instruction set"
)]

use super::elimination::{Determinants, Elimination};
use super::gram::Gram;
use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::reduction::{BLOCK, MOST_MOTIONS, Reduction};
use super::scaled::{Product, Scaled};
use crate::dynamics::Model;
use faer::c64;

/// Rows that are summed at once.
const ROWS: usize = 8;

/// A polynomial with the poles of a model as its roots.
pub struct Pencil {
    /// Coordinates of the matrix: others, then motions.
    size: usize,
    reduction: Reduction,
    gram: Gram,
    /// Coefficients of s², s and 1 of every entry, row by row, the null states divided out; for motions [Z, a].
    entries: Vec<[f64; 3]>,
    /// Null states divided out of each column.
    degree: Vec<usize>,
    /// The coordinate of the model at each place that is no motion.
    order: Vec<usize>,
    /// Number of first-order states, the first places.
    states: usize,
    /// Entries of first-order rows and columns that are not zero, for which the order is.
    nonzero: Vec<bool>,
    /// Determinant of the mass matrix, the leading coefficient.
    leading: Scaled,
    /// Bound of its relative error.
    leading_error: f64,
    elimination: Elimination,
    /// Entries of motions that are not zero: the first of each column, their rows, and their values.
    first: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<Complexes>,
    /// Places of all entries that are not zero, of a reduced model: row by row, and column by column.
    occupied: [Vec<[usize; 2]>; 2],
    /// Forces on motions in the null vectors.
    forces: [Vec<Complexes>; 2],
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
    /// A pencil for models of any size.
    pub fn new() -> Self {
        Self {
            size: 0,
            reduction: Reduction::default(),
            gram: Gram::default(),
            entries: Vec::new(),
            degree: Vec::new(),
            order: Vec::new(),
            states: 0,
            nonzero: Vec::new(),
            leading: Scaled::ONE,
            leading_error: 0.0,
            elimination: Elimination::new(),
            first: Vec::new(),
            rows: Vec::new(),
            values: Vec::new(),
            occupied: [Vec::new(), Vec::new()],
            forces: [Vec::new(), Vec::new()],
            scale: [Vec::new(), Vec::new()],
            lanes: [Vec::new(), Vec::new()],
            largest: Vec::new(),
            typical: 1.0,
            factor: Vec::new(),
        }
    }

    /// How the model is reduced.
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// Takes the entries of a model; false where it is not finite or its mass matrix is not positive
    /// definite.
    pub fn set(&mut self, level: Level, model: &Model) -> bool {
        self.reduction.set(level, model);
        let n = model.second_order;
        let reduced = self.reduction.elastic.clone();
        self.states = model.coordinates() - n;
        self.arrange(model);
        self.order.retain(|at| !reduced.contains(at));
        let others = self.order.len();
        let size = others + self.reduction.count;
        self.resize(size);
        for (column, &from) in self.order.iter().enumerate() {
            let null = |state| usize::from(model.null_states.contains(&state));
            self.degree[column] = if from < n { null(from) + null(n + from) } else { 0 };
        }
        self.degree[others..].fill(0);
        self.fill(model);
        for row in self.entries.chunks_exact_mut(size) {
            for (entry, degree) in row.iter_mut().zip(&self.degree) {
                let [m, d, _] = *entry;
                match degree {
                    0 => {}
                    1 => *entry = [m, d, 0.0],
                    _ => *entry = [m, 0.0, 0.0],
                }
            }
        }
        // A motion at no cost: its columns add up to s² M v where it is a turn that goes on, and to
        // s (M v s + D v + M w) where it is a turn v with a velocity w.
        if let Some(motion) = &model.null_motion {
            let place = |state: usize| self.order.iter().position(|at| *at == state % n);
            let turned = motion.state < n;
            let Some(most) = place(motion.state) else { return false };
            if self.degree[most] != 2 - usize::from(turned) {
                return false;
            }
            for &(state, ratio) in &motion.others {
                let Some(other) = place(state) else { return false };
                for row in self.entries.chunks_exact_mut(size) {
                    let [mut m, mut d, _] = row[most];
                    let other = row[other];
                    match (turned, state < n) {
                        (true, true) => (m, d) = (m + ratio * other[0], d + ratio * other[1]),
                        (true, false) => d += ratio * other[0],
                        (false, _) => (m, d) = (m + ratio * other[0], 0.0),
                    }
                    row[most] = [m, d, 0.0];
                }
            }
            for row in self.entries.chunks_exact_mut(size) {
                row[most][2] = 0.0;
            }
        }
        let entries = &self.entries;
        let forced: Vec<bool> = (0..size)
            .map(|column| (others..size).any(|row| entries[row * size + column] != [0.0; 3]))
            .collect();
        // Gimbals and the like see a few motions each.
        let sparse = if self.reduction.count > 0 { others } else { self.states };
        self.elimination.shape(size, sparse, |row, column| {
            if row < others {
                entries[row * size + column] != [0.0; 3]
            } else {
                forced[column] || row == column
            }
        });
        if !self.entries.iter().flatten().all(|value| value.is_finite()) {
            return false;
        }
        if self.reduction.count == 0 {
            return self.lead(model);
        }
        self.gram.resize(level, &self.reduction);
        self.list();
        true
    }

    fn resize(&mut self, size: usize) {
        self.size = size;
        self.entries.clear();
        self.entries.resize(size * size, [0.0; 3]);
        self.degree.resize(size, 0);
        self.largest.resize(size, 0.0);
        for scale in &mut self.scale {
            scale.clear();
            scale.resize(size, 1.0);
        }
        for lanes in &mut self.lanes {
            lanes.resize(size, [1.0; WIDTH]);
        }
    }

    /// Entries of the model in the order of places.
    fn fill(&mut self, model: &Model) {
        let size = self.size;
        let others = self.order.len();
        if self.reduction.count == 0 {
            for (column, &from) in self.order.iter().enumerate() {
                let [m, d, k] = [&model.mass, &model.damping, &model.stiffness]
                    .map(|matrix| matrix.col_as_slice(from));
                let rows = self.entries.iter_mut().skip(column).step_by(size);
                for (entry, &to) in rows.zip(&self.order) {
                    *entry = [m[to], d[to], k[to]];
                }
            }
            return;
        }
        let count = self.reduction.count;
        let known = &self.reduction.others;
        let of = |at: &usize| count + known.binary_search(at).unwrap_or_default();
        let places: Vec<usize> = self.order.iter().map(of).chain(0..count).collect();
        debug_assert_eq!(places.len(), others + count);
        for (row, &to) in places.iter().enumerate() {
            for (column, &from) in places.iter().enumerate() {
                self.entries[row * size + column] = self.reduction.entries[to * size + from];
            }
        }
    }

    /// Lists the entries that are not zero, those of motions by column.
    fn list(&mut self) {
        let (size, others) = (self.size, self.order.len());
        self.first.clear();
        self.rows.clear();
        for column in 0..size {
            self.first.push(self.rows.len());
            let nonzero = |row: &usize| self.entries[(others + row) * size + column] != [0.0; 3];
            self.rows.extend((0..size - others).filter(nonzero));
        }
        self.first.push(self.rows.len());
        self.values.resize(self.rows.len(), Complexes::ZERO);
        let places = || (0..size).flat_map(|i| (0..size).map(move |j| [i, j]));
        let nonzero = |[i, j]: &[usize; 2]| self.entries[i * size + j] != [0.0; 3];
        let [rows, columns] = &mut self.occupied;
        rows.clear();
        rows.extend(places().filter(nonzero));
        columns.clear();
        columns.extend(places().map(|[j, i]| [i, j]).filter(nonzero));
        for forces in &mut self.forces {
            forces.resize(self.reduction.count, Complexes::ZERO);
        }
    }

    /// Puts the first-order states first, in an order in which eliminating them fills in little (Markowitz: the
    /// least product of what is left of row and column), as long as pivots are on the diagonal.
    fn arrange(&mut self, model: &Model) {
        let (size, n) = (model.coordinates(), model.second_order);
        let entry = |row: usize, column: usize| {
            let has = |matrix: &faer::Mat<f64>| matrix.col_as_slice(column)[row] != 0.0;
            row == column || has(&model.stiffness) || has(&model.damping)
        };
        let states = (n..size).flat_map(|state| (0..size).map(move |other| (state, other)));
        let both = || states.clone().flat_map(|(a, b)| [(a, b), (b, a)]);
        let known = self.order.len() + self.reduction.elastic.len() == size
            && self.nonzero.len() == 2 * (size - n) * size;
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
        self.factor.resize(n * n, 0.0);
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
        let (size, others) = (self.size, self.order.len());
        let powers = powers_of(modulus);
        let [rows, columns] = &mut self.scale;
        let (rows, columns) = (&mut rows[..others], &mut columns[..others]);
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
            for (i, entries) in self.entries.chunks_exact(size).take(others).enumerate() {
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

    /// The determinants at eight frequencies, rad/s; at an infinite one the coefficient of the highest power, which is
    /// evaluated so for reduced models alone.
    pub fn evaluate(&mut self, level: Level, points: &Complexes) -> Determinants {
        level.run(Evaluate { pencil: self, points })
    }

    /// The leading coefficient with the bound of its relative error, where it is known without evaluation.
    pub fn leading(&self) -> Option<(Scaled, f64)> {
        (self.reduction.count == 0).then_some((self.leading, self.leading_error))
    }
}

/// Products and solutions of a reduced model; vectors are over the other places, then the elastic coordinates.
impl Pencil {
    /// Number of elements of a vector.
    pub fn places(&self) -> usize {
        self.order.len() + self.reduction.elastic.len()
    }

    /// The coordinate of the model of each element of a vector.
    pub fn coordinates(&self) -> Vec<usize> {
        self.order.iter().copied().chain(self.reduction.elastic.clone()).collect()
    }

    /// The right and left vector of a lane in the coordinates of the model, for the pole `s`.
    pub fn unpack(
        &self,
        model: &Model,
        s: c64,
        lane: usize,
        vectors: [&[Complexes]; 2],
    ) -> [Vec<c64>; 2] {
        let others = self.order.len();
        let at = |vector: &[Complexes], place: usize| {
            c64::new(vector[place].re[lane], vector[place].im[lane])
        };
        let mut unpacked = vectors.map(|vector| {
            let mut to = vec![c64::new(0.0, 0.0); model.coordinates()];
            for (place, coordinate) in self.order.iter().enumerate() {
                to[*coordinate] = at(vector, place);
            }
            for (mode, coordinate) in self.reduction.elastic.clone().enumerate() {
                to[coordinate] = at(vector, others + mode);
            }
            to
        });
        // Columns from which powers were divided out, and one that stands for several.
        for (coordinate, degree) in self.order.iter().zip(&self.degree) {
            unpacked[0][*coordinate] /= s.powi(*degree as i32);
        }
        if let Some(motion) = &model.null_motion {
            let n = model.second_order;
            let turn = unpacked[0][motion.state % n];
            for &(state, ratio) in &motion.others {
                let drifts = motion.state < n && state >= n;
                let turn = if drifts { turn / s } else { turn };
                unpacked[0][state % n] += turn * ratio;
            }
        }
        unpacked
    }

    /// Number of places of the matrix that is eliminated.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Factors the matrices at eight frequencies.
    #[inline(always)]
    pub fn factor<V: Vector>(&mut self, points: &Complexes) {
        Evaluate { pencil: self, points }.run::<V>();
    }

    /// The null vectors that the factors gave.
    #[inline(always)]
    pub fn null_vectors<V: Vector>(&self, right: &mut [Complexes], left: &mut [Complexes]) {
        let others = self.order.len();
        for i in 0..others {
            let (rows, columns) = (V::load(&self.lanes[0][i]), V::load(&self.lanes[1][i]));
            Complex::<V>::load(&self.elimination.right[i]).scale(columns).store(&mut right[i]);
            Complex::<V>::load(&self.elimination.left[i]).scale(rows).store(&mut left[i]);
        }
        let minus = V::splat(-1.0);
        let modes = self.reduction.own.len();
        for first in (0..modes).step_by(BLOCK) {
            let from_right = self.gram.forces_on::<V, BLOCK>(first, &self.forces[0]);
            let from_left = self.gram.forces_on::<V, BLOCK>(first, &self.forces[1]);
            for i in 0..BLOCK.min(modes - first) {
                let (mode, place) = (first + i, others + first + i);
                let weight = self.gram.weight::<V>(mode);
                from_right[i].mul(weight).scale(minus).store(&mut right[place]);
                from_left[i].mul(weight).store(&mut left[place]);
            }
        }
    }

    /// What the motions see of the elastic coordinates.
    #[inline(always)]
    fn see<V: Vector>(&self, elastic: &[Complexes], weighted: bool, motions: &mut [Complexes]) {
        let stride = self.reduction.stride;
        let mut first = 0;
        while first + ROWS <= stride {
            self.see_some::<V, ROWS>(first, elastic, weighted, motions);
            first += ROWS;
        }
        if first < motions.len() {
            self.see_some::<V, BLOCK>(first, elastic, weighted, motions);
        }
    }

    #[inline(always)]
    fn see_some<V: Vector, const N: usize>(
        &self,
        first: usize,
        elastic: &[Complexes],
        weighted: bool,
        motions: &mut [Complexes],
    ) {
        let mut sums = [Complex::<V>::splat(0.0, 0.0); N];
        let rows = self.reduction.motions.chunks_exact(self.reduction.stride);
        for (mode, row) in rows.enumerate() {
            let mut value = Complex::<V>::load(&elastic[mode]);
            if weighted {
                value = value.mul(self.gram.weight::<V>(mode));
            }
            let row = &row[first..first + N];
            for i in 0..N {
                sums[i] = sums[i].add_real_product(V::splat(row[i]), value);
            }
        }
        for i in 0..N.min(motions.len() - first) {
            sums[i].store(&mut motions[first + i]);
        }
    }

    /// The matrix with these powers for s², s and 1, with factors of its full damping and stiffness, or its transpose, times
    /// a vector.
    #[inline(always)]
    pub fn apply<V: Vector>(
        &self,
        at: &Frequencies<V>,
        full: Option<[Complex<V>; 2]>,
        transposed: bool,
        x: &[Complexes],
        core: &mut [Complexes],
        to: &mut [Complexes],
    ) {
        let others = self.order.len();
        let elastic = &x[others..];
        self.see::<V>(elastic, false, &mut core[others..]);
        core[..others].copy_from_slice(&x[..others]);
        to[..others].fill(Complexes::ZERO);
        let mut forces = [Complexes::ZERO; MOST_MOTIONS];
        // Row by row, transposed column by column.
        let line_of = usize::from(transposed);
        for places in self.occupied[line_of].chunk_by(|a, b| a[line_of] == b[line_of]) {
            let mut sum = Complex::<V>::splat(0.0, 0.0);
            for &[row, column] in places {
                let entry = self.entries[row * self.size + column];
                let x = Complex::<V>::load(&core[if transposed { row } else { column }]);
                sum = sum.add_product(value::<V>(entry, at.powers[0][self.degree[column]]), x);
            }
            let line = places[0][line_of];
            match line.checked_sub(others) {
                Some(motion) => sum.store(&mut forces[motion]),
                None => sum.store(&mut to[line]),
            }
        }
        let Reduction { count, own, .. } = &self.reduction;
        for first in (0..own.len()).step_by(ROWS) {
            let sums = self.gram.forces_on::<V, ROWS>(first, &forces[..*count]);
            for i in 0..ROWS.min(own.len() - first) {
                let mode = first + i;
                let own = value::<V>(own[mode], at.powers[0][0]);
                let sum = sums[i].add_product(own, Complex::load(&elastic[mode]));
                sum.store(&mut to[others + mode]);
            }
        }
        let Some(factors) = full else { return };
        for (matrices, factor) in self.reduction.full.iter().zip(factors) {
            add_product::<V>(&matrices[line_of], factor, elastic, &mut to[others..]);
        }
    }

    /// The solution with the factors, in place.
    #[inline(always)]
    pub fn solve<V: Vector>(&mut self, r: &mut [Complexes], core: &mut [Vec<Complexes>; 2]) {
        let others = self.order.len();
        let [right_side, solution] = core;
        right_side[..others].copy_from_slice(&r[..others]);
        self.see::<V>(&r[others..], true, &mut right_side[others..]);
        for i in 0..self.size {
            let value = Complex::<V>::load(&right_side[i]).scale(V::load(&self.lanes[0][i]));
            value.store(&mut right_side[i]);
        }
        self.elimination.solve::<V>(right_side, solution);
        // Forces on motions, with the entries as they were scaled by columns.
        let mut forces = [Complexes::ZERO; MOST_MOTIONS];
        for j in 0..self.size {
            let value = Complex::<V>::load(&solution[j]);
            for at in self.first[j]..self.first[j + 1] {
                let sum = &mut forces[self.rows[at]];
                let entry = Complex::load(&self.values[at]);
                Complex::<V>::load(sum).add_product(entry, value).store(sum);
            }
        }
        for i in 0..others {
            let value = Complex::<V>::load(&solution[i]).scale(V::load(&self.lanes[1][i]));
            value.store(&mut r[i]);
        }
        self.substitute::<V>(&forces[..self.reduction.count], V::splat(-1.0), &mut r[others..]);
    }

    /// The solution with the transposed factors, in place; `at` are the powers they were made with.
    #[inline(always)]
    pub fn solve_transposed<V: Vector>(
        &mut self,
        at: &Frequencies<V>,
        r: &mut [Complexes],
        core: &mut [Vec<Complexes>; 2],
    ) {
        let others = self.order.len();
        let [right_side, solution] = core;
        let mut seen = [Complexes::ZERO; MOST_MOTIONS];
        self.see::<V>(&r[others..], true, &mut seen[..self.reduction.count]);
        right_side[..others].copy_from_slice(&r[..others]);
        right_side[others..].fill(Complexes::ZERO);
        for j in 0..self.size {
            let mut sum = Complex::<V>::load(&right_side[j]);
            for item in self.first[j]..self.first[j + 1] {
                let row = self.rows[item];
                let entry = self.entries[(others + row) * self.size + j];
                let value = value::<V>(entry, at.powers[0][self.degree[j]]);
                sum = sum.subtract_product(value, Complex::load(&seen[row]));
            }
            sum.scale(V::load(&self.lanes[1][j])).store(&mut right_side[j]);
        }
        self.elimination.solve_transposed::<V>(right_side, solution);
        for i in 0..self.size {
            let value = Complex::<V>::load(&solution[i]).scale(V::load(&self.lanes[0][i]));
            value.store(if i < others { &mut r[i] } else { &mut seen[i - others] });
        }
        self.substitute::<V>(&seen[..self.reduction.count], V::splat(1.0), &mut r[others..]);
    }

    /// `(r + sign Bᵀ f)/e`, in place.
    #[inline(always)]
    fn substitute<V: Vector>(&self, forces: &[Complexes], sign: V, r: &mut [Complexes]) {
        let modes = self.reduction.own.len();
        for first in (0..modes).step_by(ROWS) {
            let forces = self.gram.forces_on::<V, ROWS>(first, forces);
            for i in 0..ROWS.min(modes - first) {
                let r = &mut r[first + i];
                let sum = Complex::<V>::load(r).add_real_product(sign, forces[i]);
                sum.mul(self.gram.weight::<V>(first + i)).store(r);
            }
        }
    }

    /// `Σ|y||r|`, and what rounding does to `yᵀ L x` in units of the unit roundoff.
    #[inline(always)]
    pub fn uncertainty<V: Vector>(
        &self,
        at: &Frequencies<V>,
        right: &[Complexes],
        left: &[Complexes],
        residual: &[Complexes],
    ) -> (V, V) {
        let others = self.order.len();
        let modes = self.reduction.own.len() as f64;
        let (mut first, mut size) = (V::splat(0.0), V::splat(0.0));
        for i in 0..right.len() {
            let own = match i.checked_sub(others) {
                Some(mode) => modulus::<V>(self.reduction.own[mode], at.moduli[0][0]),
                None => modulus::<V>(self.entries[i * self.size + i], at.moduli[0][self.degree[i]]),
            };
            let y = Complex::<V>::load(&left[i]).square().root_above();
            let x = Complex::<V>::load(&right[i]).square().root_above();
            let r = Complex::<V>::load(&residual[i]).square().root_above();
            first = y.mul_add(r, first);
            size = own.mul(y).mul_add(x, size);
        }
        // Own terms, the forces that balance them, and sums over motions and the full part.
        let left_out = self.reduction.left_out / (0.5 * f64::EPSILON);
        let rounding = size.mul(V::splat(16.0 + 4.0 * modes.sqrt() + left_out));
        (first, rounding)
    }
}

/// `to += factor · matrix · x` with a real square matrix, row by row, or none.
#[inline(always)]
fn add_product<V: Vector>(
    matrix: &[f64],
    factor: Complex<V>,
    x: &[Complexes],
    to: &mut [Complexes],
) {
    let count = x.len();
    for first in (0..matrix.len() / count).step_by(ROWS) {
        let rows = (count - first).min(ROWS);
        let mut sums = [Complex::<V>::splat(0.0, 0.0); ROWS];
        // The last block takes the last row again and again.
        let mut lines = [&matrix[..count]; ROWS];
        for i in 0..ROWS {
            lines[i] = &matrix[(first + i.min(rows - 1)) * count..][..count];
        }
        for column in 0..count {
            let value = Complex::<V>::load(&x[column]);
            for i in 0..ROWS {
                sums[i] = sums[i].add_real_product(V::splat(lines[i][column]), value);
            }
        }
        for i in 0..rows {
            let to = &mut to[first + i];
            Complex::<V>::load(to).add_product(sums[i], factor).store(to);
        }
    }
}

/// Powers of s that go with the coefficients of an entry from whose column a power was divided out.
type Powers<T> = [[T; 3]; 3];

/// Fills in the scaled matrices and eliminates.
struct Evaluate<'a> {
    pencil: &'a mut Pencil,
    points: &'a Complexes,
}

/// Powers of s and of its modulus.
#[derive(Clone, Copy)]
pub struct Frequencies<V> {
    /// In second-order rows, in first-order rows.
    powers: [Powers<Complex<V>>; 2],
    moduli: [Powers<V>; 2],
    modulus: V,
}

impl<V: Vector> Frequencies<V> {
    /// At infinity only the highest powers count: s² in second-order rows, s in first-order ones.
    #[inline(always)]
    pub fn new(points: &Complexes, typical: f64) -> Self {
        let (zero, one, far) = (V::splat(0.0), V::splat(1.0), V::splat(f64::MAX));
        let [zeros, ones] = [Complex { re: zero, im: zero }, Complex { re: one, im: zero }];
        let s = Complex::<V>::load(points);
        let infinite = s.re;
        let s = Complex::where_greater(infinite, far, ones, s);
        let square = s.square().max(V::splat(f64::MIN_POSITIVE));
        let modulus = infinite.where_greater(far, V::splat(typical), square.sqrt());
        let second = [(s.mul(s), square), (s, modulus), (ones, one), (zeros, zero), (zeros, zero)];
        let mut found = Self { powers: [[[zeros; 3]; 3]; 2], moduli: [[[zero; 3]; 3]; 2], modulus };
        for degree in 0..3 {
            for kind in 0..3 {
                let (power, modulus) = second[degree + kind];
                for row in 0..2 {
                    let (highest, size) = if kind == row { (ones, one) } else { (zeros, zero) };
                    found.powers[row][degree][kind] =
                        Complex::where_greater(infinite, far, highest, power);
                    found.moduli[row][degree][kind] = infinite.where_greater(far, size, modulus);
                }
            }
        }
        found
    }

    /// What the powers become when the polynomial is derived by s; moduli are left at zero.
    #[inline(always)]
    pub fn slope(s: Complex<V>) -> Self {
        let zeros = Complex::splat(0.0, 0.0);
        let ones = Complex::splat(1.0, 0.0);
        let powers = [[s.add(s), ones, zeros], [ones, zeros, zeros], [zeros; 3]];
        let none = V::splat(0.0);
        Self { powers: [powers; 2], moduli: [[[none; 3]; 3]; 2], modulus: none }
    }
}

#[inline(always)]
fn value<V: Vector>(entry: [f64; 3], powers: [Complex<V>; 3]) -> Complex<V> {
    let (m, d, k) = (V::splat(entry[0]), V::splat(entry[1]), V::splat(entry[2]));
    let value = powers[2].scale(k).add_real_product(d, powers[1]);
    value.add_real_product(m, powers[0])
}

#[inline(always)]
fn modulus<V: Vector>(entry: [f64; 3], moduli: [V; 3]) -> V {
    let (m, d, k) = (V::splat(entry[0].abs()), V::splat(entry[1].abs()), V::splat(entry[2].abs()));
    m.mul_add(moduli[0], d.mul_add(moduli[1], k.mul(moduli[2])))
}

impl Kernel for Evaluate<'_> {
    type Output = Determinants;

    #[inline(always)]
    fn run<V: Vector>(self) -> Determinants {
        let pencil = self.pencil;
        let (n, others) = (pencil.size, pencil.order.len());
        let at = Frequencies::<V>::new(self.points, pencil.typical);
        let mut exponents = [0.0; WIDTH];
        scale(pencil, &at).store(&mut exponents);
        let exponent = exponents.map(|exponent| -exponent as i64);
        let product = match pencil.reduction.count == 0 {
            true => Product::new(),
            false => pencil.gram.form::<V>(&pencil.reduction, at.powers[0][0], at.moduli[0][0]),
        };
        scale_motions::<V>(pencil);
        for i in 0..others {
            let kind = usize::from(i < pencil.states);
            let row_scale = V::load(&pencil.lanes[0][i]);
            for at_element in 0..pencil.elimination.elements(i).len() {
                let j = pencil.elimination.elements(i)[at_element];
                let entry = pencil.entries[i * n + j];
                let factor = row_scale.mul(V::load(&pencil.lanes[1][j]));
                let degree = pencil.degree[j];
                let element = value::<V>(entry, at.powers[kind][degree]).scale(factor);
                element.store(&mut pencil.elimination.matrix[i * n + j]);
                // Each term of an element is rounded a few times.
                let size = modulus::<V>(entry, at.moduli[kind][degree]).mul(factor);
                size.mul(V::splat(4.0)).store(&mut pencil.elimination.doubt[i * n + j]);
            }
        }
        if pencil.reduction.count == 0 {
            let mut found = pencil.elimination.run::<V>();
            for (value, exponent) in found.value.iter_mut().zip(exponent) {
                *value = value.shifted(exponent);
            }
            return found;
        }
        condense(pencil, &at);
        let product = product.finish();
        let mut found = pencil.elimination.run::<V>();
        let mut rounding = [0.0; WIDTH];
        doubt::<V>(pencil).store(&mut rounding);
        let count = pencil.reduction.elastic.len() as f64;
        for lane in 0..WIDTH {
            let value = found.value[lane].shifted(exponent[lane]);
            let Scaled { mantissa, exponent } = product[lane];
            found.value[lane] = value.times(mantissa).shifted(exponent);
            found.error[lane] += 0.5 * f64::EPSILON * (rounding[lane] + 8.0 * count);
        }
        found
    }
}

/// Scales of each lane, powers of two: those of the typical modulus, moved with the diagonal. The sum of their
/// exponents, which the determinants lack.
#[inline(always)]
fn scale<V: Vector>(pencil: &mut Pencil, at: &Frequencies<V>) -> V {
    let ratio = at.modulus.mul(V::splat(1.0 / pencil.typical));
    let roots = [V::splat(1.0), ratio.root_above(), ratio];
    let over = roots.map(V::reciprocal);
    let mut exponents = V::splat(0.0);
    for i in 0..pencil.order.len() {
        let degree = pencil.degree[i];
        let entry = pencil.entries[i * pencil.size + i];
        let [m, d, k] = powers_of(pencil.typical)[degree];
        let typical = entry[0].abs() * m + entry[1].abs() * d + entry[2].abs() * k;
        let kind = usize::from(i < pencil.states);
        let diagonal = modulus::<V>(entry, at.moduli[kind][degree]);
        let mut moved = V::splat(1.0);
        if typical > 0.0 {
            moved = diagonal.reciprocal().mul(V::splat(typical)).root_above();
        }
        let row = moved.mul(over[degree]).mul(V::splat(pencil.scale[0][i]));
        let column = moved.mul(roots[degree]).mul(V::splat(pencil.scale[1][i]));
        exponents = exponents.add(power_near(row, &mut pencil.lanes[0][i]));
        exponents = exponents.add(power_near(column, &mut pencil.lanes[1][i]));
    }
    exponents
}

/// Stores the power of two below; its exponent.
#[inline(always)]
fn power_near<V: Vector>(value: V, to: &mut [f64; WIDTH]) -> V {
    let (exponent, reciprocal) = value.exponent();
    reciprocal.exponent().1.store(to);
    exponent
}

/// Scales of motions: the roots of the diagonal of moduli of G, which cancel in the determinant.
#[inline(always)]
fn scale_motions<V: Vector>(pencil: &mut Pencil) {
    let others = pencil.order.len();
    for i in 0..pencil.reduction.count {
        let (_, reciprocal) = V::load(&pencil.gram.sizes[i]).exponent();
        reciprocal.store(&mut pencil.lanes[0][others + i]);
        reciprocal.exponent().1.store(&mut pencil.lanes[1][others + i]);
    }
}

/// Fills in the rows of motions, `[I + GZ, Ga]`.
#[inline(always)]
fn condense<V: Vector>(pencil: &mut Pencil, at: &Frequencies<V>) {
    let Pencil {
        size, gram, entries, degree, order, first, rows, values, lanes, elimination, ..
    } = pencil;
    let (n, others, stride) = (*size, order.len(), pencil.reduction.stride);
    let count = n - others;
    // A sum of as many terms as there are modes, then one over motions; Z itself is known to as much only, and the
    // reduced form is the model but for what it leaves out.
    let reduction = &pencil.reduction;
    let roundings = 32.0
        + 2.0 * (reduction.elastic.len() as f64).sqrt()
        + reduction.left_out / (0.5 * f64::EPSILON);
    for j in 0..n {
        let range = first[j]..first[j + 1];
        let degree = degree[j];
        let column_scale = V::load(&lanes[1][j]);
        let mut size = V::splat(0.0);
        for at_entry in range.clone() {
            let row = rows[at_entry];
            let entry = entries[(others + row) * n + j];
            let element = value::<V>(entry, at.powers[0][degree]).scale(column_scale);
            element.store(&mut values[at_entry]);
            let modulus = modulus::<V>(entry, at.moduli[0][degree]).mul(column_scale);
            size = modulus.mul_add(V::load(&gram.sizes[row]), size);
        }
        if range.is_empty() && j < others {
            continue;
        }
        let size = size.mul(V::splat(roundings));
        let (rows, values) = (&rows[range.clone()], &values[range]);
        for block in (0..count).step_by(4) {
            let mut sums = [Complex::<V>::splat(0.0, 0.0); 4];
            for (row, value) in rows.iter().zip(values) {
                let value = Complex::<V>::load(value);
                for i in 0..4 {
                    let g = Complex::<V>::load(&gram.elements[(block + i) * stride + row]);
                    sums[i] = sums[i].add_product(g, value);
                }
            }
            for i in 0..(count - block).min(4) {
                let to = others + block + i;
                let row_scale = V::load(&lanes[0][to]);
                let mut sum = sums[i].scale(row_scale);
                if to == j {
                    sum.re = sum.re.add(V::splat(1.0));
                }
                sum.store(&mut elimination.matrix[to * n + j]);
                // The root of G's diagonal times the scale is less than two.
                let root = V::load(&gram.sizes[block + i]).mul(row_scale);
                root.mul(size).store(&mut elimination.doubt[to * n + j]);
            }
        }
    }
}

/// What rounding of the elastic coordinates' own equations may do to the determinant, in units of the unit roundoff:
/// with the null vectors that elimination found.
#[inline(always)]
fn doubt<V: Vector>(pencil: &mut Pencil) -> V {
    let Pencil { size, order, gram, first, rows, values, lanes, elimination, forces, .. } = pencil;
    let others = order.len();
    let count = *size - others;
    for forces in forces.iter_mut() {
        forces.fill(Complexes::ZERO);
    }
    // Forces [Z, a] v of the right vector; the left one is of forces already.
    for j in 0..*size {
        let v = Complex::<V>::load(&elimination.right[j]);
        for at in first[j]..first[j + 1] {
            let to = &mut forces[0][rows[at]];
            Complex::<V>::load(to).add_product(Complex::load(&values[at]), v).store(to);
        }
    }
    for i in 0..count {
        let row_scale = V::load(&lanes[0][others + i]);
        let y = Complex::<V>::load(&elimination.left[others + i]);
        y.scale(row_scale).store(&mut forces[1][i]);
    }
    let across = V::load(&elimination.across);
    gram.rounding::<V>(&forces[0], &forces[1], across)
}

/// The powers at a modulus.
fn powers_of(modulus: f64) -> Powers<f64> {
    [[modulus * modulus, modulus, 1.0], [modulus, 1.0, 0.0], [1.0, 0.0, 0.0]]
}
