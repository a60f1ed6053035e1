//! Determinants of eight matrices of one structure at once, by elimination, with a bound of their rounding.
//!
//! What the matrices are is decided in `pencil`. Rows that are sparse by structure (first-order states) come
//! first and are combined where they are not zero; the others are dense.

use super::lanes::{Complex, Complexes, Vector, WIDTH};
use super::scaled::{self, Scaled};
use faer::c64;

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
    /// Elements that are not zero by structure: of the matrix, and of the factors.
    structure: Pattern,
    filled: Pattern,
    /// The row of the matrix at each place.
    rows: Vec<usize>,
    /// The same lane by lane, where single lanes exchanged theirs.
    origin: Vec<[u16; WIDTH]>,
    column: Vec<Complexes>,
    /// Columns of a sparse pivot's row.
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

/// A bit for each element of a matrix, row by row.
#[derive(Clone, Default)]
struct Pattern {
    words: usize,
    bits: Vec<u64>,
}

impl Pattern {
    fn new(size: usize) -> Self {
        let words = size.div_ceil(64);
        Self { words, bits: vec![0; size * words] }
    }

    #[inline(always)]
    fn row(&self, row: usize) -> &[u64] {
        &self.bits[row * self.words..][..self.words]
    }

    #[inline(always)]
    fn has(&self, row: usize, column: usize) -> bool {
        self.bits[row * self.words + column / 64] >> (column % 64) & 1 == 1
    }

    #[inline(always)]
    fn set(&mut self, row: usize, column: usize) {
        self.bits[row * self.words + column / 64] |= 1 << (column % 64);
    }

    /// Sets the columns from `first` on and before `end`.
    #[inline(always)]
    fn set_from(&mut self, row: usize, first: usize, end: usize) {
        for word in first / 64..self.words {
            let low = u64::MAX << first.saturating_sub(64 * word);
            let count = end - 64 * word;
            let high = if count < 64 { (1 << count) - 1 } else { u64::MAX };
            self.bits[row * self.words + word] |= low & high;
        }
    }

    /// The next column of a row from `first` on; beyond the last where there is none.
    #[inline(always)]
    fn next(&self, row: usize, first: usize) -> usize {
        let words = self.row(row);
        let mut word = first / 64;
        let Some(start) = words.get(word) else { return usize::MAX };
        let mut left = start & (u64::MAX << (first % 64));
        while left == 0 {
            word += 1;
            let Some(next) = words.get(word) else { return usize::MAX };
            left = *next;
        }
        64 * word + left.trailing_zeros() as usize
    }
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
            structure: Pattern::new(0),
            filled: Pattern::new(0),
            rows: Vec::new(),
            origin: Vec::new(),
            column: Vec::new(),
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
        self.structure = Pattern::new(size);
        self.filled = Pattern::new(size);
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

    /// The first column of a row from `first` on whose element is not zero by structure.
    #[inline(always)]
    pub fn element(&self, row: usize, first: usize) -> usize {
        self.structure.next(row, first)
    }

    /// Takes the structure: the numbers of rows and of sparse rows, and which elements are not zero.
    pub fn shape(
        &mut self,
        size: usize,
        sparse: usize,
        mut nonzero: impl FnMut(usize, usize) -> bool,
    ) {
        if size != self.size {
            self.resize(size);
        }
        self.sparse = sparse;
        self.structure.bits.fill(0);
        for row in 0..self.size {
            for column in 0..self.size {
                if nonzero(row, column) {
                    self.structure.set(row, column);
                }
            }
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
        self.filled.bits.copy_from_slice(&self.structure.bits);
        let mut product = scaled::Product::<V>::new();
        let mut sign = [1.0; WIDTH];
        for k in 0..self.sparse {
            self.eliminate_sparse::<V>(k, &mut product, &mut sign);
        }
        for i in self.sparse..n {
            self.fill_row(self.rows[i], self.sparse);
        }
        for j in self.sparse..n {
            self.eliminate_dense::<V>(j, &mut product, &mut sign);
        }
        let value = product.finish();
        let value = std::array::from_fn(|lane| value[lane].times(c64::new(sign[lane], 0.0)));
        let error = self.rounding::<V>();
        Determinants { value, error }
    }

    /// Makes a row dense from column `first` on.
    #[inline(always)]
    fn fill_row(&mut self, row: usize, first: usize) {
        let n = self.size;
        let mut from = first;
        while from < n {
            let next = self.filled.next(row, from).min(n);
            self.matrix[row * n + from..row * n + next].fill(Complexes::ZERO);
            from = next + 1;
        }
        self.filled.set_from(row, first, n);
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
        let mut most = V::splat(0.0);
        for i in k..n {
            let row = self.rows[i];
            self.column[i] = Complexes::ZERO;
            if self.filled.has(row, k) {
                self.column[i] = self.matrix[row * n + k];
                most = most.max(Complex::<V>::load(&self.column[i]).square());
            }
        }
        let inverse = self.choose::<V>(k, self.sparse, most, product, sign);
        let pivot_row = self.rows[k];
        inverse.store(&mut self.matrix[pivot_row * n + k]);
        self.listed.clear();
        let mut j = self.filled.next(pivot_row, k + 1);
        while j < n {
            self.listed.push(j);
            j = self.filled.next(pivot_row, j + 1);
        }
        for i in k + 1..n {
            let row = self.rows[i];
            if !self.filled.has(row, k) {
                continue;
            }
            let multiplier = Complex::<V>::load(&self.column[i]).mul(inverse);
            multiplier.store(&mut self.matrix[row * n + k]);
            self.fill_missing(row, pivot_row, k + 1);
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
        let words = self.filled.words;
        for word in first / 64..words {
            let low = first.saturating_sub(64 * word);
            let theirs = self.filled.bits[other * words + word] & (u64::MAX << low);
            let mut missing = theirs & !self.filled.bits[row * words + word];
            self.filled.bits[row * words + word] |= theirs;
            while missing != 0 {
                let column = 64 * word + missing.trailing_zeros() as usize;
                self.matrix[row * self.size + column] = Complexes::ZERO;
                missing &= missing - 1;
            }
        }
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
        let inverse = self.choose::<V>(j, n, most, product, sign);
        inverse.store(&mut self.matrix[self.rows[j] * n + j]);
        for i in first..j {
            self.matrix[self.rows[i] * n + j] = self.column[i];
        }
        for i in j + 1..n {
            let value = Complex::<V>::load(&self.column[i]).mul(inverse);
            value.store(&mut self.matrix[self.rows[i] * n + j]);
        }
    }

    /// Brings a good pivot to place `j`, from the places before `end` if there is one, multiplies the determinant by
    /// it, and gives its reciprocal. `most` is the largest square of the column.
    #[inline(always)]
    fn choose<V: Vector>(
        &mut self,
        j: usize,
        end: usize,
        most: V,
        product: &mut scaled::Product<V>,
        sign: &mut [f64; WIDTH],
    ) -> Complex<V> {
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
        guard(&mut self.column[j]);
        let pivot = Complex::<V>::load(&self.column[j]);
        product.times(pivot);
        pivot.reciprocal()
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

    /// The first column from `first` on of the factors' row at a place that is not zero by structure: all are
    /// where both are of the dense part.
    #[inline(always)]
    fn next(&self, place: usize, row: usize, first: usize) -> usize {
        let dense = first >= self.sparse && place >= self.sparse;
        if dense { first } else { self.filled.next(row, first) }
    }

    /// Solves with the factors: right sides by row of the matrix, solutions by column.
    #[inline(always)]
    pub fn solve<V: Vector>(&mut self, right_side: &[Complexes], to: &mut [Complexes]) {
        let n = self.size;
        for i in 0..n {
            self.gather(i, right_side);
            let row = self.rows[i];
            let mut sum = Complex::<V>::load(&self.column[i]);
            let mut k = self.next(i, row, 0);
            while k < i {
                let l = Complex::load(&self.matrix[row * n + k]);
                sum = sum.subtract_product(l, Complex::load(&self.column[k]));
                k = self.next(i, row, k + 1);
            }
            sum.store(&mut self.column[i]);
        }
        for k in (0..n).rev() {
            let row = self.rows[k];
            let mut sum = Complex::<V>::load(&self.column[k]);
            let mut j = self.next(k, row, k + 1);
            while j < n {
                let u = Complex::<V>::load(&self.matrix[row * n + j]);
                sum = sum.subtract_product(u, Complex::load(&to[j]));
                j = self.next(k, row, j + 1);
            }
            sum.mul(Complex::load(&self.matrix[row * n + k])).store(&mut to[k]);
        }
    }

    /// Solves with the transposed factors: right sides by column of the matrix, solutions by row.
    #[inline(always)]
    pub fn solve_transposed<V: Vector>(&mut self, right_side: &[Complexes], to: &mut [Complexes]) {
        let n = self.size;
        self.column.copy_from_slice(right_side);
        for i in 0..n {
            let row = self.rows[i];
            let inverse = Complex::load(&self.matrix[row * n + i]);
            let a = Complex::<V>::load(&self.column[i]).mul(inverse);
            a.store(&mut self.column[i]);
            let mut k = self.next(i, row, i + 1);
            while k < n {
                let u = Complex::load(&self.matrix[row * n + k]);
                let value = Complex::<V>::load(&self.column[k]);
                value.subtract_product(a, u).store(&mut self.column[k]);
                k = self.next(i, row, k + 1);
            }
        }
        for i in (0..n).rev() {
            let row = self.rows[i];
            let b = Complex::<V>::load(&self.column[i]);
            let mut k = self.next(i, row, 0);
            while k < i {
                let l = Complex::load(&self.matrix[row * n + k]);
                let value = Complex::<V>::load(&self.column[k]);
                value.subtract_product(b, l).store(&mut self.column[k]);
                k = self.next(i, row, k + 1);
            }
            for lane in 0..WIDTH {
                let row = usize::from(self.origin[i][lane]);
                to[row].re[lane] = self.column[i].re[lane];
                to[row].im[lane] = self.column[i].im[lane];
            }
        }
    }

    /// Puts the right side of the row at a place there, lane by lane.
    #[inline(always)]
    fn gather(&mut self, place: usize, right_side: &[Complexes]) {
        for lane in 0..WIDTH {
            let from = &right_side[usize::from(self.origin[place][lane])];
            self.column[place].re[lane] = from.re[lane];
            self.column[place].im[lane] = from.im[lane];
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
        for i in 0..n {
            let row = self.rows[i];
            let mut sum = Complex::<V>::load(&self.column[i]);
            let mut k = self.next(i, row, 0);
            while k < i.min(skip) {
                let l = Complex::load(&self.matrix[row * n + k]);
                sum = sum.subtract_product(l, Complex::load(&self.column[k]));
                k = self.next(i, row, k + 1);
            }
            sum.store(&mut self.column[i]);
        }
        self.solve_lower::<V>(n - skip);
        // … and with U from the last, |U||v| beside it.
        let mut across = Complex::<V>::splat(0.0, 0.0);
        for k in (0..n).rev() {
            let row = self.rows[k];
            let mut sum = Complex::<V>::load(&self.column[k]);
            let mut weight = V::splat(0.0);
            let mut j = self.next(k, row, k + 1);
            while j < n {
                let u = Complex::<V>::load(&self.matrix[row * n + j]);
                sum = sum.subtract_product(u, Complex::load(&self.column[j]));
                weight = modulus(u).mul_add(V::load(&self.moduli[0][j]), weight);
                j = self.next(k, row, j + 1);
            }
            let inverse = Complex::<V>::load(&self.matrix[row * n + k]);
            let v = sum.mul(inverse);
            v.store(&mut self.column[k]);
            v.store(&mut self.right[k]);
            modulus(v).store(&mut self.moduli[0][k]);
            let own = modulus(v).mul(modulus(inverse.reciprocal()));
            own.add(weight).store(&mut self.moduli[2][k]);
            let b = self.probe[n - 1 - k];
            across = across.add(Complex::splat(b.re, b.im).mul(v));
        }
        // |L||U||v|.
        for i in (0..n).rev() {
            let row = self.rows[i];
            let mut sum = V::load(&self.moduli[2][i]);
            let mut k = self.next(i, row, 0);
            while k < i {
                let l = modulus(Complex::<V>::load(&self.matrix[row * n + k]));
                sum = l.mul_add(V::load(&self.moduli[2][k]), sum);
                k = self.next(i, row, k + 1);
            }
            sum.store(&mut self.moduli[2][i]);
        }
        // y: with Uᵀ from the first place, then with Lᵀ from the last.
        for (k, value) in self.column.iter_mut().enumerate() {
            let unit = self.probe[n - 1 - k];
            *value = Complexes { re: [unit.re; WIDTH], im: [unit.im; WIDTH] };
        }
        for i in 0..n {
            let row = self.rows[i];
            let inverse = Complex::load(&self.matrix[row * n + i]);
            let a = Complex::<V>::load(&self.column[i]).mul(inverse);
            a.store(&mut self.column[i]);
            let mut k = self.next(i, row, i + 1);
            while k < n {
                let value = Complex::<V>::load(&self.column[k]);
                let u = Complex::load(&self.matrix[row * n + k]);
                value.subtract_product(a, u).store(&mut self.column[k]);
                k = self.next(i, row, k + 1);
            }
        }
        let mut eliminated = V::splat(0.0);
        for i in (0..n).rev() {
            let row = self.rows[i];
            let b = Complex::<V>::load(&self.column[i]);
            let mut k = self.next(i, row, 0);
            while k < i {
                let value = Complex::<V>::load(&self.column[k]);
                let l = Complex::load(&self.matrix[row * n + k]);
                value.subtract_product(b, l).store(&mut self.column[k]);
                k = self.next(i, row, k + 1);
            }
            let size = modulus(b);
            eliminated = size.mul_add(V::load(&self.moduli[2][i]), eliminated);
            let mut stored = [0.0; WIDTH];
            size.store(&mut stored);
            for (lane, size) in stored.into_iter().enumerate() {
                let row = usize::from(self.origin[i][lane]);
                self.moduli[1][row][lane] = size;
                self.left[row].re[lane] = self.column[i].re[lane];
                self.left[row].im[lane] = self.column[i].im[lane];
            }
        }
        let mut entered = V::splat(0.0);
        for i in 0..n {
            let mut sum = V::splat(0.0);
            let mut j = self.structure.next(i, 0);
            while j < n {
                sum = V::load(&self.doubt[i * n + j]).mul_add(V::load(&self.moduli[0][j]), sum);
                j = self.structure.next(i, j + 1);
            }
            entered = sum.mul_add(V::load(&self.moduli[1][i]), entered);
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
