//! From a model to its interface: elastic coordinates with equations of their own, seen by the rest through a few
//! motions.
//!
//! With the elastic block `diag(e) + Bᵀ Z B` and its coupling `Bᵀ a` and `β B` to the other coordinates, what the
//! elastic coordinates do to the rest passes through `G = B diag(e)⁻¹ Bᵀ`; determinants of what is left are those of
//! `pencil`. Which motions B there may be says `dynamics::Interface`; which of them are independent, and Z, a and β, are
//! found in the matrices of the model themselves, and a product with a vector of signs proves that nothing is left out.

#![expect(
    clippy::needless_range_loop,
    reason = "closures and iterators do not inline into kernels of an instruction set"
)]

use super::lanes::{Kernel, Level, Vector, WIDTH};
use crate::dynamics::Model;
use faer::Mat;
use nalgebra::DMatrix;
use std::mem::swap;
use std::ops::Range;

/// Motions that are summed at once.
pub const BLOCK: usize = 4;
/// Most motions of a reduction; more would pay with many hundreds of modes alone.
pub const MOST_MOTIONS: usize = 64;
/// Operations per square of the elastic coordinates and pole of a full part, over 8/3: eight products.
const FULL: f64 = 12.0;
/// What is left of a motion, in parts of its largest element, that is of the others.
const DEPENDENT: f64 = 1e-13;
/// An element of Z, a or β, in parts of the terms of which it is the sum, that is rounding.
const ROUNDING: f64 = 2e-15;
/// Elastic coordinates below which a reduction saves less than it costs.
const LEAST_MODES: usize = 16;
/// Most coordinates of a model with a full part that are not reduced.
const MOST_WHOLE: usize = 48;
/// Largest part of the terms of a product that may be left out; what is counts as rounding.
const LEFT_OUT: f64 = 4e-12;

/// The interface of one model.
#[derive(Debug, Default)]
pub struct Reduction {
    /// The elastic coordinates that are reduced; none where there is no interface worth it.
    pub elastic: Range<usize>,
    /// The other coordinates, ascending.
    pub others: Vec<usize>,
    /// Number of motions.
    pub count: usize,
    /// Mass, damping and stiffness of each elastic coordinate by itself.
    pub own: Vec<[f64; 3]>,
    /// The motions B: a row per elastic coordinate, ended by zeros to a length of `stride`.
    pub motions: Vec<f64>,
    /// Number of motions, rounded up to whole blocks.
    pub stride: usize,
    /// Mass, damping and stiffness `[[Z, a], [β, L]]` over the motions, then the other coordinates, row by row.
    pub entries: Vec<[f64; 3]>,
    /// Row and column of each that is not zero.
    pub occupied: Vec<[usize; 2]>,
    /// What is of no few motions, less its diagonal, which is in `own`: damping and stiffness, and their transposes, square
    /// and row by row; empty where there is none.
    pub full: [[Vec<f64>; 2]; 2],
    /// Largest difference between the reduced form and the model, in parts of the terms that are summed.
    pub left_out: f64,
    /// Rows that may be motions, those of the model before, and what elimination leaves of them.
    candidates: Vec<f64>,
    before: Vec<f64>,
    left: Vec<[f64; WIDTH]>,
    /// Row and column of each pivot; the inverse of the candidates there, column by column, in every lane.
    pivots: Vec<[usize; 2]>,
    inverse: Vec<[f64; WIDTH]>,
    /// Elements of the model between pivots, mass, damping and stiffness and their moduli in lanes, column by column.
    between: Vec<[f64; WIDTH]>,
    half: Vec<[f64; WIDTH]>,
    /// Elements between pivots and another coordinate, in its column and in its row, three lanes each; what the motions
    /// make of them, and the sums of moduli.
    coupling: Vec<[f64; WIDTH]>,
    through: Vec<[[f64; WIDTH]; 2]>,
}

/// Operations per frequency, over 8/3: the cube of the size of a whole matrix that would cost as much.
fn effort(modes: usize, motions: usize, others: usize) -> f64 {
    let [k, c, o] = [modes, motions, others].map(|count| count as f64);
    let size = c + o;
    size.powi(3) + 0.375 * (2.0 * k * c * c + 16.0 * k * c + 8.0 * c * size * size.min(10.0))
}

impl Reduction {
    /// Operations of a determinant of the model taken, over 8/3, and what a full part adds for each pole; first-order
    /// states, whose rows are sparse, do not count.
    pub fn effort(&self, model: &Model) -> f64 {
        let n = model.second_order;
        if self.count == 0 {
            return (n as f64).powi(3);
        }
        let modes = self.elastic.len();
        let full = if self.is_full() { FULL * (modes * modes) as f64 } else { 0.0 };
        effort(modes, self.count, n - modes) + full
    }

    /// Whether the model has a part of no few motions.
    pub fn is_full(&self) -> bool {
        self.count > 0 && self.full.iter().any(|[plain, _]| !plain.is_empty())
    }

    /// Takes a model: its interface, or no elastic coordinates where there is none, or none that pays.
    pub fn set(&mut self, level: Level, model: &Model) {
        let size = model.coordinates();
        self.elastic = model.interface.elastic.clone();
        if self.elastic.len() < LEAST_MODES || !self.find(level, model) {
            self.elastic = 0..0;
            self.count = 0;
            self.others.clear();
            self.others.extend(0..size);
        }
    }

    fn find(&mut self, level: Level, model: &Model) -> bool {
        let interface = &model.interface;
        let size = model.coordinates();
        let elastic = self.elastic.clone();
        self.others.clear();
        self.others.extend((0..size).filter(|at| !elastic.contains(at)));
        let n = model.second_order;
        let whole = (n as f64).powi(3);
        swap(&mut self.candidates, &mut self.before);
        self.gather(model);
        let modes = elastic.len();
        let full = interface.full.iter().any(|full| !full.is_empty());
        let full = if full { FULL * (modes * modes) as f64 } else { 0.0 };
        // With a full part discs prove the poles of a whole matrix, residuals those of a reduced one: where the first is
        // at hand it is taken.
        let whole = if full > 0.0 && size <= MOST_WHOLE { 0.0 } else { whole };
        let worth = |count: usize| effort(modes, count, n - modes) + full < whole;
        // Most cases have the motions of the case before.
        let same = self.own.len() == modes
            && self.pivots.len().pow(2) == self.inverse.len()
            && self.candidates == self.before;
        let known = same && worth(self.pivots.len());
        if !(known || self.pivot(level, elastic.len(), worth)) {
            self.pivots.clear();
            return false;
        }
        self.own.clear();
        self.own.extend(&interface.own);
        for (kind, full) in interface.full.iter().enumerate() {
            let count = elastic.len();
            let [plain, transposed] = &mut self.full[kind];
            plain.clone_from(full);
            if full.is_empty() {
                transposed.clear();
                continue;
            }
            for (mode, own) in self.own.iter_mut().enumerate() {
                own[kind + 1] += std::mem::take(&mut plain[mode * count + mode]);
            }
            transposed.resize(count * count, 0.0);
            // A few rows at a time, which become pieces of lines of memory.
            for first in (0..count).step_by(WIDTH) {
                let rows = first..(first + WIDTH).min(count);
                for column in 0..count {
                    for row in rows.clone() {
                        transposed[column * count + row] = plain[row * count + column];
                    }
                }
            }
        }
        self.reduce(level, model) && self.complete(level, model)
    }

    /// Rows that may be motions: those known, and what other coordinates see that are not attached to the body.
    fn gather(&mut self, model: &Model) {
        let known = &model.interface;
        let (count, n) = (self.elastic.len(), model.second_order);
        self.candidates.clear();
        // Of a translation or rotation, components that are the rounding of the others are none.
        for axes in known.motions.chunks_exact(3 * count) {
            let least = DEPENDENT * largest(axes);
            let rows = axes.chunks_exact(count).filter(|row| largest(row) > least);
            rows.for_each(|row| self.candidates.extend(row));
        }
        let apart = self.others.iter().filter(|at| **at < self.elastic.start || **at >= n);
        let matrices = [&model.mass, &model.damping, &model.stiffness];
        for &at in apart {
            for matrix in matrices {
                let row = self.elastic.clone().map(|mode| matrix[(at, mode)]);
                if row.clone().any(|value| value != 0.0) {
                    self.candidates.extend(row);
                }
                let column = &matrix.col_as_slice(at)[self.elastic.clone()];
                if column.iter().any(|value| *value != 0.0) {
                    self.candidates.extend(column);
                }
            }
        }
    }

    /// Picks independent rows of the candidates, and an elastic coordinate for each: Gaussian elimination with complete
    /// pivoting of rows scaled alike. False as soon as there are too many.
    fn pivot(&mut self, level: Level, modes: usize, worth: impl Fn(usize) -> bool) -> bool {
        let width = modes.div_ceil(WIDTH);
        self.left.clear();
        for row in self.candidates.chunks_exact(modes) {
            let scale = largest(row).recip();
            let (whole, rest) = row.as_chunks::<WIDTH>();
            self.left.extend(whole.iter().map(|values| values.map(|value| value * scale)));
            if !rest.is_empty() {
                let mut last = [0.0; WIDTH];
                last.iter_mut().zip(rest).for_each(|(last, value)| *last = value * scale);
                self.left.push(last);
            }
        }
        self.pivots.clear();
        let mut open: Vec<usize> = (0..self.left.len() / width).collect();
        // Largest element left of each row.
        let mut most: Vec<f64> =
            self.left.chunks_exact(width).map(|row| largest(row.as_flattened())).collect();
        while let Some((at, &row)) =
            open.iter().enumerate().max_by(|(_, a), (_, b)| most[**a].total_cmp(&most[**b]))
        {
            if !(most[row] > DEPENDENT) {
                break;
            }
            if self.pivots.len() == MOST_MOTIONS || !worth(self.pivots.len() + 1) {
                return false;
            }
            open.remove(at);
            let of_row = &self.left[row * width..][..width];
            let is_most = |value: &f64| value.abs() == most[row];
            let column = of_row.iter().flatten().position(is_most).unwrap_or(0);
            self.pivots.push([row, column]);
            let pivot = of_row.to_vec();
            let left = &mut self.left;
            level.run(Clear { left, pivot: &pivot, column, open: &open, most: &mut most });
        }
        self.pivots.sort_unstable();
        let c = self.pivots.len();
        let at_pivots = DMatrix::from_fn(c, c, |i, j| {
            self.candidates[self.pivots[i][0] * modes + self.pivots[j][1]]
        });
        let Some(inverse) = at_pivots.try_inverse() else { return false };
        // Signed for values, moduli for the lanes of moduli.
        let lanes =
            |value: &f64| std::array::from_fn(|lane| if lane < 3 { *value } else { value.abs() });
        self.inverse.clear();
        self.inverse.extend(inverse.iter().map(lanes));
        c > 0
    }

    /// B, and Z, a and β by the elements of the model at the pivots.
    fn reduce(&mut self, level: Level, model: &Model) -> bool {
        let (c, first) = (self.pivots.len(), self.elastic.start);
        let size = c + self.others.len();
        let columns: Vec<usize> = self.pivots.iter().map(|[_, column]| first + column).collect();
        self.entries.clear();
        self.entries.resize(size * size, [0.0; 3]);
        let matrices = [&model.mass, &model.damping, &model.stiffness];
        self.between.clear();
        self.between.resize(c * c, [0.0; WIDTH]);
        let modes = self.elastic.len();
        for (kind, matrix) in matrices.into_iter().enumerate() {
            let full = kind.checked_sub(1).map_or(&[][..], |kind| &self.full[kind][0]);
            for (j, &column) in columns.iter().enumerate() {
                let values = matrix.col_as_slice(column);
                for (i, &row) in columns.iter().enumerate() {
                    let full = full.get((row - first) * modes + column - first);
                    let value = match i == j {
                        true => model.interface.attached[row - first][kind],
                        false => values[row] - full.unwrap_or(&0.0),
                    };
                    self.between[j * c + i][kind] = value;
                    self.between[j * c + i][3 + kind] = value.abs();
                }
            }
        }
        self.half.resize(c * c, [0.0; WIDTH]);
        let Self { between, half, inverse, .. } = self;
        level.run(Sandwich { matrix: between, half, factor: inverse, count: c });
        for (index, value) in self.between.iter().enumerate() {
            for kind in 0..3 {
                if value[kind].abs() > ROUNDING * value[3 + kind] {
                    self.entries[index % c * size + index / c][kind] = value[kind];
                }
            }
        }
        self.coupling.resize(c, [0.0; WIDTH]);
        self.through.resize(c, [[0.0; WIDTH]; 2]);
        for (j, &other) in self.others.iter().enumerate() {
            for (kind, matrix) in matrices.into_iter().enumerate() {
                let values = matrix.col_as_slice(other);
                for (coupling, &column) in self.coupling.iter_mut().zip(&columns) {
                    coupling[kind] = values[column];
                    coupling[3 + kind] = matrix[(other, column)];
                }
                for (i, &to) in self.others.iter().enumerate() {
                    self.entries[(c + i) * size + c + j][kind] = values[to];
                }
            }
            if self.coupling.iter().flatten().all(|value| *value == 0.0) {
                continue;
            }
            let Self { coupling, through, inverse, .. } = self;
            level.run(Through { vector: coupling, to: through, factor: inverse });
            for (i, [sums, sizes]) in self.through.iter().enumerate() {
                // A sum of products, zero where it is but rounding.
                let value = |lane: usize| match sums[lane].abs() > ROUNDING * sizes[lane] {
                    true => sums[lane],
                    false => 0.0,
                };
                self.entries[i * size + c + j] = [value(0), value(1), value(2)];
                self.entries[(c + j) * size + i] = [value(3), value(4), value(5)];
            }
        }
        self.keep_coupled();
        self.entries.iter().flatten().all(|value| value.is_finite())
    }

    /// Leaves out motions that act on nothing and that nothing acts on.
    fn keep_coupled(&mut self) {
        let count = self.pivots.len();
        let (modes, size) = (self.elastic.len(), count + self.others.len());
        let entries = &self.entries;
        let coupled = |i: usize| {
            (0..size)
                .any(|j| entries[i * size + j] != [0.0; 3] || entries[j * size + i] != [0.0; 3])
        };
        let kept: Vec<usize> = (0..size).filter(|i| *i >= count || coupled(*i)).collect();
        let entry = |i: &usize, j: &usize| entries[i * size + j];
        self.entries = kept.iter().flat_map(|i| kept.iter().map(move |j| entry(i, j))).collect();
        let places = (0..kept.len()).flat_map(|i| (0..kept.len()).map(move |j| [i, j]));
        self.occupied.clear();
        let entries = self.entries.iter().zip(places).filter(|(entry, _)| **entry != [0.0; 3]);
        self.occupied.extend(entries.map(|(_, place)| place));
        self.count = kept.len() - self.others.len();
        self.stride = self.count.next_multiple_of(BLOCK);
        self.motions.clear();
        for mode in 0..modes {
            let rows = kept[..self.count].iter().map(|i| self.pivots[*i][0]);
            self.motions.extend(rows.map(|row| self.candidates[row * modes + mode]));
            self.motions.resize((mode + 1) * self.stride, 0.0);
        }
    }

    /// Whether the reduced form is the model: rows and columns times a vector of signs on the elastic coordinates.
    fn complete(&mut self, level: Level, model: &Model) -> bool {
        let c = self.count;
        let (size, modes) = (c + self.others.len(), self.elastic.len());
        let sign = |at: usize| if (at * at + at / 3) % 5 < 2 { -1.0 } else { 1.0 };
        let signs: Vec<f64> = self.elastic.clone().map(sign).collect();
        // What the motions see of the signs, and could see at most.
        let mut seen = [vec![0.0; self.stride], vec![0.0; self.stride]];
        for (row, sign) in self.motions.chunks_exact(self.stride).zip(&signs) {
            let [sums, sizes] = &mut seen;
            for ((sum, size), motion) in sums.iter_mut().zip(sizes).zip(row) {
                *sum += motion * sign;
                *size += motion.abs();
            }
        }
        let difference = |value: f64, [sum, size]: [f64; 2]| match value == sum {
            true => 0.0,
            false => (value - sum).abs() / size,
        };
        // All three at once, at a typical frequency: what is left out of one is not made up for by another.
        let logarithms: f64 = self.own.iter().map(|own| own[2].ln()).sum();
        let square = (logarithms / modes as f64).exp();
        let powers = [square, square.sqrt(), 1.0];
        let at = |entry: [f64; 3]| entry[0] * powers[0] + entry[1] * powers[1] + entry[2];
        let mut products = [vec![0.0; model.coordinates()], vec![0.0; model.coordinates()]];
        let mut scaled = vec![0.0; model.coordinates()];
        for (matrix, power) in
            [&model.mass, &model.damping, &model.stiffness].into_iter().zip(powers)
        {
            let elastic = scaled[self.elastic.clone()].iter_mut();
            elastic.zip(&signs).for_each(|(scaled, sign)| *scaled = power * sign);
            level.run(TimesSigns { matrix, signs: &scaled, products: &mut products });
        }
        let mut most = 0.0_f64;
        let ones = vec![1.0; modes];
        let mut expected: Vec<[f64; 2]> = Vec::with_capacity(modes);
        for (transposed, product) in [false, true].into_iter().zip(&products) {
            let entry = |i: usize, j: usize| match transposed {
                false => at(self.entries[i * size + j]),
                true => at(self.entries[j * size + i]),
            };
            // Forces on a row of the reduced form: the sum, and the sum of moduli.
            let force = |i: usize| {
                (0..c).fold([0.0; 2], |[sum, most], j| {
                    let entry = entry(i, j);
                    [sum + entry * seen[0][j], most + entry.abs() * seen[1][j]]
                })
            };
            let mut forces = [vec![0.0; self.stride], vec![0.0; self.stride]];
            for i in 0..c {
                [forces[0][i], forces[1][i]] = force(i);
            }
            expected.clear();
            expected.extend(self.own.iter().zip(&signs).map(|(own, sign)| {
                let own = at(*own);
                [own * sign, own.abs()]
            }));
            let to = &mut expected;
            for (full, factor) in self.full.iter().zip(&powers[1..]) {
                let rows = &full[usize::from(transposed)];
                let (values, sizes, factor) = (&signs, &ones, *factor);
                level.run(TimesRows { rows, values, sizes, factor, to });
            }
            let [values, sizes] = &forces;
            level.run(TimesRows { rows: &self.motions, values, sizes, factor: 1.0, to });
            for (value, expected) in product[self.elastic.clone()].iter().zip(&expected) {
                let difference = difference(*value, *expected);
                if !(difference <= LEFT_OUT) {
                    return false;
                }
                most = most.max(difference);
            }
            for (place, &other) in self.others.iter().enumerate() {
                let difference = difference(product[other], force(c + place));
                if !(difference <= LEFT_OUT) {
                    return false;
                }
                most = most.max(difference);
            }
        }
        self.left_out = most;
        true
    }
}

/// Modulus of the largest element.
fn largest(row: &[f64]) -> f64 {
    // Several at a time, so that one need not wait for the other.
    let mut most = [0.0_f64; WIDTH];
    let (whole, rest) = row.as_chunks::<WIDTH>();
    for values in whole.iter().map(|values| &values[..]).chain([rest]) {
        for (most, value) in most.iter_mut().zip(values) {
            *most = most.max(value.abs());
        }
    }
    most.into_iter().fold(0.0, f64::max)
}

/// Subtracts from open rows what makes their element in the pivot's column zero; the largest that is left of each.
struct Clear<'a> {
    left: &'a mut [[f64; WIDTH]],
    pivot: &'a [[f64; WIDTH]],
    column: usize,
    open: &'a [usize],
    most: &'a mut [f64],
}

impl Kernel for Clear<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { left, pivot, column, open, most } = self;
        let (block, lane) = (column / WIDTH, column % WIDTH);
        for &row in open {
            let values = &mut left[row * pivot.len()..][..pivot.len()];
            let factor = values[block][lane] / pivot[block][lane];
            if factor == 0.0 {
                continue;
            }
            let factor = V::splat(factor);
            for i in 0..pivot.len() {
                let value = V::load(&values[i]);
                factor.negative_mul_add(V::load(&pivot[i]), value).store(&mut values[i]);
            }
            values[block][lane] = 0.0;
            let mut largest = V::splat(0.0);
            for i in 0..pivot.len() {
                largest = largest.max(V::load(&values[i]).abs());
            }
            let mut lanes = [0.0; WIDTH];
            largest.store(&mut lanes);
            most[row] = lanes.into_iter().fold(0.0, f64::max);
        }
    }
}

/// A matrix `A` becomes `Fᵀ A F`, in every lane; all column by column.
struct Sandwich<'a> {
    matrix: &'a mut [[f64; WIDTH]],
    half: &'a mut [[f64; WIDTH]],
    factor: &'a [[f64; WIDTH]],
    count: usize,
}

impl Kernel for Sandwich<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { matrix, half, factor, count } = self;
        // Aᵀ F, then (Aᵀ F)ᵀ F.
        times::<V>(matrix, factor, half, count);
        times::<V>(half, factor, matrix, count);
    }
}

/// `to = Aᵀ F`, all column by column, a block of its columns at once.
#[inline(always)]
fn times<V: Vector>(
    a: &[[f64; WIDTH]],
    factor: &[[f64; WIDTH]],
    to: &mut [[f64; WIDTH]],
    count: usize,
) {
    for i in 0..count {
        let column = &a[i * count..][..count];
        for first in (0..count).step_by(BLOCK) {
            let mut starts = [0; BLOCK];
            for j in 0..BLOCK {
                starts[j] = (first + j).min(count - 1) * count;
            }
            let factors = [
                &factor[starts[0]..][..count],
                &factor[starts[1]..][..count],
                &factor[starts[2]..][..count],
                &factor[starts[3]..][..count],
            ];
            let mut sums = [V::splat(0.0); BLOCK];
            for k in 0..count {
                let value = V::load(&column[k]);
                for j in 0..BLOCK {
                    sums[j] = V::load(&factors[j][k]).mul_add(value, sums[j]);
                }
            }
            for j in 0..BLOCK.min(count - first) {
                sums[j].store(&mut to[(first + j) * count + i]);
            }
        }
    }
}

/// A vector becomes `Fᵀ v`, with the sums of moduli beside it.
struct Through<'a> {
    vector: &'a [[f64; WIDTH]],
    to: &'a mut [[[f64; WIDTH]; 2]],
    factor: &'a [[f64; WIDTH]],
}

impl Kernel for Through<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { vector, to, factor } = self;
        for (to, factor) in to.iter_mut().zip(factor.chunks_exact(vector.len())) {
            let (mut sum, mut size) = (V::splat(0.0), V::splat(0.0));
            for (factor, value) in factor.iter().zip(vector) {
                let (factor, value) = (V::splat(factor[0]), V::load(value));
                sum = factor.mul_add(value, sum);
                size = factor.abs().mul_add(value.abs(), size);
            }
            sum.store(&mut to[0]);
            size.store(&mut to[1]);
        }
    }
}

/// Adds the products of rows with `values`, and of their moduli with `sizes`, each times `factor`.
struct TimesRows<'a> {
    rows: &'a [f64],
    values: &'a [f64],
    sizes: &'a [f64],
    factor: f64,
    to: &'a mut [[f64; 2]],
}

impl Kernel for TimesRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { rows, values, sizes, factor, to } = self;
        let ((values, last_values), (sizes, last_sizes)) =
            (values.as_chunks::<WIDTH>(), sizes.as_chunks::<WIDTH>());
        let width = values.len() * WIDTH + last_values.len();
        for (row, to) in rows.chunks_exact(width).zip(to) {
            let (row, last) = row.as_chunks::<WIDTH>();
            let (mut sum, mut size) = (V::splat(0.0), V::splat(0.0));
            for i in 0..row.len() {
                let row = V::load(&row[i]);
                sum = row.mul_add(V::load(&values[i]), sum);
                size = row.abs().mul_add(V::load(&sizes[i]), size);
            }
            let mut lanes = [[0.0; WIDTH]; 2];
            sum.store(&mut lanes[0]);
            size.store(&mut lanes[1]);
            for i in 0..last.len() {
                lanes[0][i] += last[i] * last_values[i];
                lanes[1][i] += last[i].abs() * last_sizes[i];
            }
            for (to, lanes) in to.iter_mut().zip(lanes) {
                *to += factor * lanes.iter().sum::<f64>();
            }
        }
    }
}

/// Adds a matrix and its transpose, each times `factor` and signs on the elastic coordinates and zeros elsewhere.
struct TimesSigns<'a> {
    matrix: &'a Mat<f64>,
    /// Factor and sign of every coordinate, zero where it is not elastic.
    signs: &'a [f64],
    products: &'a mut [Vec<f64>; 2],
}

impl Kernel for TimesSigns<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { matrix, signs, products: [product, transposed] } = self;
        let (signs, rest_of_signs) = signs.as_chunks::<WIDTH>();
        for (column, transposed) in transposed.iter_mut().enumerate() {
            let (values, rest) = matrix.col_as_slice(column).as_chunks::<WIDTH>();
            let (sums, rest_of_sums) = product.as_chunks_mut::<WIDTH>();
            let at = column / WIDTH;
            let sign = if at < signs.len() {
                signs[at][column % WIDTH]
            } else {
                rest_of_signs[column % WIDTH]
            };
            let factor = V::splat(sign);
            let mut dot = V::splat(0.0);
            for i in 0..values.len() {
                let value = V::load(&values[i]);
                dot = value.mul_add(V::load(&signs[i]), dot);
                value.mul_add(factor, V::load(&sums[i])).store(&mut sums[i]);
            }
            let mut lanes = [0.0; WIDTH];
            dot.store(&mut lanes);
            let mut sum: f64 = lanes.iter().sum();
            for i in 0..rest.len() {
                sum += rest[i] * rest_of_signs[i];
                rest_of_sums[i] += rest[i] * sign;
            }
            *transposed += sum;
        }
    }
}
