//! Determinants of eight matrices of one structure at once, by elimination, with a bound of their rounding.
//!
//! What the matrices are is decided in `pencil`. Rows that are sparse by structure (first-order states) come
//! first and are combined where they are not zero; the others are dense.

use super::lanes::{Complex, Complexes, Vector, WIDTH};
use super::scaled::{self, Scaled};
use super::sparsity::{Lists, Pattern, Ragged};
use faer::c64;
use std::ops::Range;

/// Multiplier of a row beyond which rows are exchanged, squared.
const LARGEST_MULTIPLIER: f64 = 64.0;
/// What the bound of a determinant leaves for what two vectors do not see of the inverse.
const SAFETY: f64 = 2.0;

/// Eight matrices and their factors.
pub struct Elimination {
    size: usize,
    /// Number of sparse rows and columns, the first ones.
    sparse: usize,
    /// Elements, row by row; then the factors, with reciprocals of the pivots on the diagonal.
    pub matrix: Vec<Complexes>,
    /// What rounding may have done to each element before, in units of the unit roundoff.
    pub doubt: Vec<[f64; WIDTH]>,
    /// Elements that are not zero by structure: of the matrix, of the factors as long as no sparse rows are exchanged, and
    /// of the factors.
    structure: Pattern,
    planned: Pattern,
    filled: Pattern,
    /// The planned factors and, where rows were exchanged so that they are others, the factors.
    plan: Lists,
    found: Lists,
    exchanged: bool,
    /// Rows with an element in each sparse column of the planned factors, below its diagonal.
    beneath: Ragged,
    /// Columns of each row of the matrix that are not zero by structure.
    elements: Ragged,
    /// Elements of the planned factors that are zero in the matrix.
    missing: Vec<usize>,
    /// The row of the matrix at each place.
    rows: Vec<usize>,
    /// The same lane by lane, where single lanes exchanged theirs.
    origin: Vec<[u16; WIDTH]>,
    column: Vec<Complexes>,
    /// Places of the rows with an element in a sparse pivot's column, and columns of its row.
    below: Vec<usize>,
    listed: Vec<usize>,
    /// Elements of unit modulus and no order.
    probe: Vec<c64>,
    /// Moduli of a solution by column, of a transposed one by row, and of what the factors make of the first.
    moduli: [Vec<[f64; WIDTH]>; 3],
    /// v = A⁻¹a by column and y = A⁻ᵀb by row: null vectors where A is singular.
    pub right: Vec<Complexes>,
    /// See [`Elimination::right`].
    pub left: Vec<Complexes>,
    /// |bᵀv|: near a singular matrix A⁻¹ is nearly v yᵀ over it.
    pub across: [f64; WIDTH],
}

/// Determinants, and bounds of their relative errors.
pub struct Determinants {
    /// Determinants.
    pub value: [Scaled; WIDTH],
    /// Bounds.
    pub error: [f64; WIDTH],
}

/// At least the modulus, at most √2 of it.
#[inline(always)]
fn modulus<V: Vector>(z: Complex<V>) -> V {
    z.re.abs().add(z.im.abs())
}

impl Elimination {
    /// Without room yet.
    pub fn new() -> Self {
        Self {
            size: 0,
            sparse: 0,
            matrix: Vec::new(),
            doubt: Vec::new(),
            structure: Pattern::default(),
            planned: Pattern::default(),
            filled: Pattern::default(),
            plan: Lists::default(),
            found: Lists::default(),
            exchanged: false,
            beneath: Ragged::default(),
            elements: Ragged::default(),
            missing: Vec::new(),
            rows: Vec::new(),
            origin: Vec::new(),
            column: Vec::new(),
            below: Vec::new(),
            listed: Vec::new(),
            probe: Vec::new(),
            moduli: Default::default(),
            right: Vec::new(),
            left: Vec::new(),
            across: [0.0; WIDTH],
        }
    }

    fn resize(&mut self, size: usize) {
        let angle = |i: usize| (i as f64 + 1.0) * (i as f64 + 2.0) * 0.618_033_988_749_894_9;
        self.size = size;
        self.matrix.resize(size * size, Complexes::ZERO);
        self.doubt.resize(size * size, [0.0; WIDTH]);
        for pattern in [&mut self.structure, &mut self.planned, &mut self.filled] {
            *pattern = Pattern::new(size);
        }
        self.rows.resize(size, 0);
        self.origin.resize(size, [0; WIDTH]);
        self.probe = (0..size).map(|i| c64::new(angle(i).cos(), angle(i).sin())).collect();
        for vector in [&mut self.column, &mut self.right, &mut self.left] {
            vector.resize(size, Complexes::ZERO);
        }
        for moduli in &mut self.moduli {
            moduli.resize(size, [0.0; WIDTH]);
        }
    }

    /// Columns of a row whose elements are not zero by structure.
    #[inline(always)]
    pub fn elements(&self, row: usize) -> &[usize] {
        self.elements.get(row)
    }

    /// Takes the structure: the numbers of rows and of sparse rows, and which elements are not zero.
    pub fn shape(
        &mut self,
        size: usize,
        sparse: usize,
        mut nonzero: impl FnMut(usize, usize) -> bool,
    ) {
        let known = size == self.size && sparse == self.sparse;
        if size != self.size {
            self.resize(size);
        }
        self.sparse = sparse;
        // The pattern before is in `filled`, which every run sets anew.
        std::mem::swap(&mut self.structure, &mut self.filled);
        self.structure.clear();
        for row in 0..size {
            for column in 0..size {
                if nonzero(row, column) {
                    self.structure.set(row, column);
                }
            }
        }
        if !known || self.structure != self.filled {
            self.plan();
        }
    }

    /// The factors' structure where sparse rows are not exchanged.
    fn plan(&mut self) {
        let (n, sparse) = (self.size, self.sparse);
        let planned = &mut self.planned;
        planned.copy_from(&self.structure);
        for k in 0..sparse {
            for row in k + 1..n {
                if planned.has(row, k) {
                    for column in k + 1..n {
                        if planned.has(k, column) {
                            planned.set(row, column);
                        }
                    }
                }
            }
        }
        for row in sparse..n {
            planned.set_from(row, sparse, n);
        }
        let rows: Vec<usize> = (0..n).collect();
        self.plan.take(planned, &rows, sparse);
        self.beneath.clear(sparse);
        for k in 0..sparse {
            self.beneath.set(k, (k + 1..n).filter(|row| planned.has(*row, k)));
        }
        self.elements.clear(n);
        for row in 0..n {
            self.elements.set(row, self.structure.columns(row, 0, n));
        }
        self.missing.clear();
        for row in rows {
            let filled = planned.columns(row, 0, n).filter(|j| !self.structure.has(row, *j));
            self.missing.extend(filled.map(|column| row * n + column));
        }
    }

    /// The determinants of [`Elimination::matrix`], whose elements of the structure are set.
    #[inline(always)]
    pub fn run<V: Vector>(&mut self) -> Determinants {
        let n = self.size;
        for (i, (row, origin)) in self.rows.iter_mut().zip(&mut self.origin).enumerate() {
            *row = i;
            *origin = [i as u16; WIDTH];
        }
        for &at in &self.missing {
            self.matrix[at] = Complexes::ZERO;
        }
        self.filled.copy_from(&self.planned);
        self.exchanged = false;
        let mut product = scaled::Product::<V>::new();
        let mut sign = [1.0; WIDTH];
        for k in 0..self.sparse {
            self.eliminate_sparse::<V>(k, &mut product, &mut sign);
        }
        if self.exchanged {
            for i in self.sparse..n {
                self.fill_row(self.rows[i], self.sparse);
            }
        }
        for j in self.sparse..n {
            self.eliminate_dense::<V>(j, &mut product, &mut sign);
        }
        if self.exchanged {
            self.found.take(&self.filled, &self.rows, self.sparse);
        }
        let value = product.finish();
        let value = std::array::from_fn(|lane| value[lane].times(c64::new(sign[lane], 0.0)));
        let error = self.rounding::<V>();
        Determinants { value, error }
    }

    /// Makes a row dense from column `first` on.
    fn fill_row(&mut self, row: usize, first: usize) {
        for column in first..self.size {
            if !self.filled.has(row, column) {
                self.filled.set(row, column);
                self.matrix[row * self.size + column] = Complexes::ZERO;
            }
        }
    }

    /// Finds the rows with an element in a sparse pivot's column by their pattern.
    fn look_below(&mut self, k: usize) {
        let Self { size, rows, filled, below, .. } = self;
        below.clear();
        below.extend((k + 1..*size).filter(|i| filled.has(rows[*i], k)));
    }

    /// Eliminates a sparse column: rows that have an element there are combined with the pivot's at once.
    #[inline(always)]
    fn eliminate_sparse<V: Vector>(
        &mut self,
        k: usize,
        product: &mut scaled::Product<V>,
        sign: &mut [f64; WIDTH],
    ) {
        let n = self.size;
        if self.exchanged {
            self.look_below(k);
        } else {
            self.below.clear();
            self.below.extend_from_slice(self.beneath.get(k));
        }
        let mut most = V::splat(0.0);
        for &i in [k].iter().chain(&self.below) {
            self.column[i] = self.matrix[self.rows[i] * n + k];
            most = most.max(Complex::<V>::load(&self.column[i]).square());
        }
        if most.any_greater(self.pivot_limit::<V>(k)) {
            for i in k..n {
                if !self.filled.has(self.rows[i], k) {
                    self.column[i] = Complexes::ZERO;
                }
            }
            self.exchange::<V>(k, self.sparse, most, sign);
            self.exchanged = true;
            self.look_below(k);
        }
        let inverse = self.take_pivot::<V>(k, product);
        let pivot_row = self.rows[k];
        inverse.store(&mut self.matrix[pivot_row * n + k]);
        self.listed.clear();
        if self.exchanged {
            self.listed.extend(self.filled.columns(pivot_row, k + 1, n));
        } else {
            self.listed.extend_from_slice(self.plan.upper.get(k));
        }
        for at in 0..self.below.len() {
            let i = self.below[at];
            let row = self.rows[i];
            let multiplier = Complex::<V>::load(&self.column[i]).mul(inverse);
            multiplier.store(&mut self.matrix[row * n + k]);
            if self.exchanged {
                self.fill_missing(row, pivot_row, k + 1);
            }
            let [of, from] = if row < pivot_row {
                let (low, high) = self.matrix.split_at_mut(pivot_row * n);
                [&mut low[row * n..][..n], &mut high[..n]]
            } else {
                let (low, high) = self.matrix.split_at_mut(row * n);
                [&mut high[..n], &mut low[pivot_row * n..][..n]]
            };
            for &j in &self.listed {
                let value = Complex::<V>::load(&of[j]);
                value.subtract_product(multiplier, Complex::load(&from[j])).store(&mut of[j]);
            }
        }
    }

    /// Gives a row the columns of another from `first` on that it has not: zeros.
    #[inline(always)]
    fn fill_missing(&mut self, row: usize, other: usize, first: usize) {
        let Self { size, matrix, filled, exchanged, .. } = self;
        filled.add_row(row, other, first, |column| {
            *exchanged = true;
            matrix[row * *size + column] = Complexes::ZERO;
        });
    }

    /// Eliminates a dense column: what all columns left of it contribute, four rows at a time (Crout).
    #[inline(always)]
    fn eliminate_dense<V: Vector>(
        &mut self,
        j: usize,
        product: &mut scaled::Product<V>,
        sign: &mut [f64; WIDTH],
    ) {
        let (n, first) = (self.size, self.sparse);
        for i in first..n {
            self.column[i] = self.matrix[self.rows[i] * n + j];
        }
        self.solve_lower::<V>(j - first);
        let mut most = V::splat(0.0);
        for value in &self.column[j..] {
            most = most.max(Complex::<V>::load(value).square());
        }
        if most.any_greater(self.pivot_limit::<V>(j)) {
            self.exchange::<V>(j, n, most, sign);
        }
        let inverse = self.take_pivot::<V>(j, product);
        inverse.store(&mut self.matrix[self.rows[j] * n + j]);
        for i in first..j {
            self.matrix[self.rows[i] * n + j] = self.column[i];
        }
        for i in j + 1..n {
            let value = Complex::<V>::load(&self.column[i]).mul(inverse);
            value.store(&mut self.matrix[self.rows[i] * n + j]);
        }
    }

    /// What no square in the column may be greater than, so that the row at place `j` can stay.
    #[inline(always)]
    fn pivot_limit<V: Vector>(&self, j: usize) -> V {
        Complex::<V>::load(&self.column[j]).square().mul(V::splat(LARGEST_MULTIPLIER))
    }

    /// Multiplies the determinant by the pivot at place `j` and gives its reciprocal.
    #[inline(always)]
    fn take_pivot<V: Vector>(&mut self, j: usize, product: &mut scaled::Product<V>) -> Complex<V> {
        let square = Complex::<V>::load(&self.column[j]).square();
        if V::splat(f64::MIN_POSITIVE).any_greater(square) {
            guard(&mut self.column[j]);
        }
        let pivot = Complex::<V>::load(&self.column[j]);
        product.times(pivot);
        pivot.reciprocal()
    }

    /// Brings a good pivot to place `j`, from the places before `end` if there is one. `most` is the largest square of the
    /// column.
    #[inline(always)]
    fn exchange<V: Vector>(&mut self, j: usize, end: usize, most: V, sign: &mut [f64; WIDTH]) {
        let (mut best, good) = pivot::<V>(&self.column[j..end], most);
        if !good && end < self.size {
            (best, _) = pivot::<V>(&self.column[j..], most);
        }
        if best > 0 {
            self.rows.swap(j, j + best);
            self.column.swap(j, j + best);
            self.origin.swap(j, j + best);
            *sign = sign.map(|sign| -sign);
        }
        self.exchange_lanes::<V>(j, most, sign);
    }

    /// Exchanges rows in those lanes alone whose pivot is still far below the largest.
    #[inline(always)]
    fn exchange_lanes<V: Vector>(&mut self, j: usize, most: V, sign: &mut [f64; WIDTH]) {
        let (mut largest, mut square) = ([0.0; WIDTH], [0.0; WIDTH]);
        most.store(&mut largest);
        Complex::<V>::load(&self.column[j]).square().store(&mut square);
        let n = self.size;
        for lane in 0..WIDTH {
            if square[lane] * LARGEST_MULTIPLIER >= largest[lane] {
                continue;
            }
            let size = |i: &usize| {
                let value = &self.column[*i];
                value.re[lane] * value.re[lane] + value.im[lane] * value.im[lane]
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
            exchange(&mut self.column, j, best);
            let (row, other) = (self.rows[j], self.rows[best]);
            self.fill_missing(row, other, 0);
            self.fill_missing(other, row, 0);
            for c in 0..n {
                if self.filled.has(row, c) {
                    exchange(&mut self.matrix, row * n + c, other * n + c);
                }
            }
            let (mine, theirs) = (self.origin[j][lane], self.origin[best][lane]);
            (self.origin[j][lane], self.origin[best][lane]) = (theirs, mine);
            sign[lane] = -sign[lane];
        }
    }

    /// Subtracts from each element of the dense part of the column what the rows above it, at most `known`,
    /// contribute: `c_i −= Σ_{k < min(i, known)} l_ik c_k`.
    #[inline(always)]
    fn solve_lower<V: Vector>(&mut self, known: usize) {
        let (size, skip) = (self.size, self.sparse);
        let n = size - skip;
        let (matrix, rows) = (&self.matrix, &self.rows[skip..]);
        let column = &mut self.column[skip..];
        let mut first = 0;
        while first < n {
            let length = first.min(known);
            let count = (n - first).min(4);
            let (done, rest) = column.split_at_mut(first);
            let done = &done[..length];
            let of = |i: usize| &matrix[rows[first + i] * size + skip..][..n];
            if count == 4 {
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
                    let from = of(i);
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

    /// Solves with the factors: right sides by row of the matrix, solutions by column.
    #[inline(always)]
    pub fn solve<V: Vector>(&mut self, right_side: &[Complexes], to: &mut [Complexes]) {
        let Self { matrix, rows, plan, found, exchanged, sparse, origin, column, .. } = self;
        let lists = if *exchanged { found } else { plan };
        let factors = Factors { matrix, rows, lists, sparse: *sparse };
        for i in 0..factors.rows.len() {
            for (lane, &row) in origin[i].iter().enumerate() {
                let from = &right_side[usize::from(row)];
                column[i].re[lane] = from.re[lane];
                column[i].im[lane] = from.im[lane];
            }
            let sum = Complex::<V>::load(&column[i]);
            factors.without(i, factors.left(i), sum, column).store(&mut column[i]);
        }
        for k in (0..factors.rows.len()).rev() {
            let sum = Complex::<V>::load(&column[k]);
            let sum = factors.without(k, factors.right(k), sum, to);
            sum.mul(Complex::load(&factors.row(k)[k])).store(&mut to[k]);
        }
    }

    /// Solves with the transposed factors: right sides by column of the matrix, solutions by row.
    #[inline(always)]
    pub fn solve_transposed<V: Vector>(&mut self, right_side: &[Complexes], to: &mut [Complexes]) {
        let Self { matrix, rows, plan, found, exchanged, sparse, origin, column, .. } = self;
        let lists = if *exchanged { found } else { plan };
        let factors = Factors { matrix, rows, lists, sparse: *sparse };
        column.copy_from_slice(right_side);
        for i in 0..factors.rows.len() {
            let inverse = Complex::load(&factors.row(i)[i]);
            let a = Complex::<V>::load(&column[i]).mul(inverse);
            a.store(&mut column[i]);
            factors.spread(i, factors.right(i), a, column);
        }
        for i in (0..factors.rows.len()).rev() {
            let b = Complex::<V>::load(&column[i]);
            factors.spread(i, factors.left(i), b, column);
            for (lane, &row) in origin[i].iter().enumerate() {
                let row = usize::from(row);
                to[row].re[lane] = column[i].re[lane];
                to[row].im[lane] = column[i].im[lane];
            }
        }
    }

    /// Bound of the relative error of the determinants by rounding.
    ///
    /// The factors are those of A + E, and `det(A + E)/det A − 1 = tr A⁻¹E` to first order. An element of E gathers
    /// min(i, j) roundings of terms of (|L||U|)_ij: below `(2√N + 8) u (|L||U|)_ij` with high probability (Higham
    /// and Mary, SIAM J. Sci. Comput. 41, 2019); and what the element itself is in doubt by. Near a pole A⁻¹ is
    /// `v yᵀ/bᵀv` for nearly all right-hand sides a and b, `v = A⁻¹a`, `y = A⁻ᵀb`: the trace is then at most
    /// `Σ |y||E||v|/|bᵀv|`, whatever the scales of rows and columns. What else A⁻¹ has adds roundings of order N.
    /// Values beside the nodes check it in every case.
    #[inline(always)]
    fn rounding<V: Vector>(&mut self) -> [f64; WIDTH] {
        let (n, skip) = (self.size, self.sparse);
        // v: with L from the first place …
        for (value, unit) in self.column.iter_mut().zip(&self.probe) {
            *value = Complexes { re: [unit.re; WIDTH], im: [unit.im; WIDTH] };
        }
        let Self { matrix, rows, plan, found, exchanged, column, .. } = self;
        let lists = if *exchanged { found } else { plan };
        for i in 0..n {
            let mut sum = Complex::<V>::load(&column[i]);
            let row = &matrix[rows[i] * n..][..n];
            for &k in lists.lower.get(rows[i]) {
                sum = sum.subtract_product(Complex::load(&row[k]), Complex::load(&column[k]));
            }
            sum.store(&mut column[i]);
        }
        self.solve_lower::<V>(n - skip);
        // … and with U from the last, |U||v| beside it.
        let Self { matrix, rows, plan, found, exchanged, column, .. } = self;
        let lists = if *exchanged { found } else { plan };
        let factors = Factors { matrix, rows, lists, sparse: skip };
        let [of_right, of_left, of_factors] = &mut self.moduli;
        let mut across = Complex::<V>::splat(0.0, 0.0);
        for k in (0..n).rev() {
            let sum = Complex::<V>::load(&column[k]);
            let sum = factors.without(k, factors.right(k), sum, column);
            let weight = factors.moduli(k, factors.right(k), V::splat(0.0), of_right);
            let inverse = Complex::<V>::load(&factors.row(k)[k]);
            let v = sum.mul(inverse);
            v.store(&mut column[k]);
            v.store(&mut self.right[k]);
            modulus(v).store(&mut of_right[k]);
            let own = modulus(v).mul(modulus(inverse.reciprocal()));
            own.add(weight).store(&mut of_factors[k]);
            let b = self.probe[n - 1 - k];
            across = across.add(Complex::splat(b.re, b.im).mul(v));
        }
        // |L||U||v|.
        for i in (0..n).rev() {
            let sum = V::load(&of_factors[i]);
            factors.moduli(i, factors.left(i), sum, of_factors).store(&mut of_factors[i]);
        }
        // y: with Uᵀ from the first place, then with Lᵀ from the last.
        for (k, value) in column.iter_mut().enumerate() {
            let unit = self.probe[n - 1 - k];
            *value = Complexes { re: [unit.re; WIDTH], im: [unit.im; WIDTH] };
        }
        for i in 0..n {
            let inverse = Complex::load(&factors.row(i)[i]);
            let a = Complex::<V>::load(&column[i]).mul(inverse);
            a.store(&mut column[i]);
            factors.spread(i, factors.right(i), a, column);
        }
        let mut eliminated = V::splat(0.0);
        for i in (0..n).rev() {
            let b = Complex::<V>::load(&column[i]);
            factors.spread(i, factors.left(i), b, column);
            let size = modulus(b);
            eliminated = size.mul_add(V::load(&of_factors[i]), eliminated);
            let mut stored = [0.0; WIDTH];
            size.store(&mut stored);
            for (lane, size) in stored.into_iter().enumerate() {
                let row = usize::from(self.origin[i][lane]);
                of_left[row][lane] = size;
                self.left[row].re[lane] = column[i].re[lane];
                self.left[row].im[lane] = column[i].im[lane];
            }
        }
        let mut entered = V::splat(0.0);
        for (i, size) in of_left.iter().enumerate() {
            let mut sum = V::splat(0.0);
            for &j in self.elements.get(i) {
                sum = V::load(&self.doubt[i * n + j]).mul_add(V::load(&of_right[j]), sum);
            }
            entered = sum.mul_add(V::load(size), entered);
        }
        let unit = 0.5 * f64::EPSILON;
        let count = n as f64;
        let total = eliminated.mul_add(V::splat(2.0 * count.sqrt() + 8.0), entered);
        let across = across.square().sqrt();
        across.store(&mut self.across);
        let relative = total.mul(V::splat(SAFETY * unit)).div(across);
        let mut error = [0.0; WIDTH];
        relative.add(V::splat(32.0 * count * unit)).store(&mut error);
        error
    }
}

/// Columns of a row of factors: a list, and a range.
type Columns<'a> = (&'a [usize], Range<usize>);

/// Factors, read by place.
struct Factors<'a> {
    matrix: &'a [Complexes],
    rows: &'a [usize],
    lists: &'a Lists,
    sparse: usize,
}

impl Factors<'_> {
    #[inline(always)]
    fn row(&self, place: usize) -> &[Complexes] {
        let n = self.rows.len();
        &self.matrix[self.rows[place] * n..][..n]
    }

    /// Columns on the left of the diagonal: sparse ones listed, dense ones in a range.
    #[inline(always)]
    fn left(&self, place: usize) -> Columns<'_> {
        (self.lists.lower.get(self.rows[place]), self.sparse.min(place)..place)
    }

    /// Columns on the right of the diagonal: those of a sparse row listed, of a dense one in a range.
    #[inline(always)]
    fn right(&self, place: usize) -> Columns<'_> {
        let n = self.rows.len();
        let dense = if place < self.sparse { n } else { place + 1 };
        (self.lists.upper.get(self.rows[place]), dense..n)
    }

    /// `sum − Σ a_ij x_j` over some columns.
    #[inline(always)]
    fn without<V: Vector>(
        &self,
        place: usize,
        (listed, dense): Columns,
        mut sum: Complex<V>,
        x: &[Complexes],
    ) -> Complex<V> {
        let row = self.row(place);
        for &j in listed {
            sum = sum.subtract_product(Complex::load(&row[j]), Complex::load(&x[j]));
        }
        // Two sums, so that one need not wait for the other.
        let mut other = Complex::<V>::splat(0.0, 0.0);
        for (a, x) in row[dense.clone()].chunks(2).zip(x[dense].chunks(2)) {
            sum = sum.subtract_product(Complex::load(&a[0]), Complex::load(&x[0]));
            if a.len() > 1 {
                other = other.subtract_product(Complex::load(&a[1]), Complex::load(&x[1]));
            }
        }
        sum.add(other)
    }

    /// `x_j −= a_ij b` over some columns.
    #[inline(always)]
    fn spread<V: Vector>(
        &self,
        place: usize,
        (listed, dense): Columns,
        b: Complex<V>,
        x: &mut [Complexes],
    ) {
        let row = self.row(place);
        for &j in listed {
            let value = Complex::<V>::load(&x[j]);
            value.subtract_product(b, Complex::load(&row[j])).store(&mut x[j]);
        }
        for (a, x) in row[dense.clone()].iter().zip(&mut x[dense]) {
            Complex::<V>::load(x).subtract_product(b, Complex::load(a)).store(x);
        }
    }

    /// `sum + Σ |a_ij| x_j` over some columns.
    #[inline(always)]
    fn moduli<V: Vector>(
        &self,
        place: usize,
        (listed, dense): Columns,
        mut sum: V,
        x: &[[f64; WIDTH]],
    ) -> V {
        let row = self.row(place);
        for &j in listed {
            sum = modulus(Complex::<V>::load(&row[j])).mul_add(V::load(&x[j]), sum);
        }
        for (a, x) in row[dense.clone()].iter().zip(&x[dense]) {
            sum = modulus(Complex::<V>::load(a)).mul_add(V::load(x), sum);
        }
        sum
    }
}

/// The row whose element is nowhere far below the largest, the first where it does; and whether it is good
/// enough.
#[inline(always)]
fn pivot<V: Vector>(column: &[Complexes], most: V) -> (usize, bool) {
    let mut best = (0, -1.0);
    for (i, value) in column.iter().enumerate() {
        let square = Complex::<V>::load(value).square();
        let mut shares = [0.0; WIDTH];
        square.div(most).store(&mut shares);
        let share = shares.iter().fold(f64::INFINITY, |least, share| least.min(*share));
        if share > best.1 {
            best = (i, share);
        }
        if i == 0 && share * LARGEST_MULTIPLIER >= 1.0 {
            break;
        }
    }
    (best.0, best.1 * LARGEST_MULTIPLIER >= 1.0)
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
