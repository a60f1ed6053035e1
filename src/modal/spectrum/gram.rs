//! What elastic coordinates pass on between motions, at eight frequencies: `G = B diag(e)⁻¹ Bᵀ`.
//!
//! Where the motions come from is decided in `reduction`, what is done with G in `pencil`.

use super::lanes::{Complex, Complexes, Vector, WIDTH};
use super::reduction::Reduction;
use super::scaled::Product;

/// Rows and columns of G that are summed at once.
const ROWS: usize = 2;
const COLUMNS: usize = 4;
/// Roundings of e: three terms and their sum.
const ROUNDINGS: f64 = 4.0;

/// G and what it is made of.
#[derive(Debug, Default)]
pub struct Gram {
    /// Number of motions, rounded up to whole blocks.
    pub stride: usize,
    /// The motions, a padded row per elastic coordinate.
    motions: Vec<f64>,
    /// Coefficients of each e.
    own: Vec<[f64; 3]>,
    /// 1/e.
    weights: Vec<Complexes>,
    /// What rounding may have done to each e, in units of the unit roundoff.
    doubt: Vec<[f64; WIDTH]>,
    /// G, row by row.
    pub elements: Vec<Complexes>,
    /// `Σ B² |1/e|` of each motion: no element of a row and column is greater than the root of their product.
    pub sizes: Vec<[f64; WIDTH]>,
}

impl Gram {
    /// Takes the motions and own equations of a model.
    pub fn set(&mut self, reduction: &Reduction) {
        let count = reduction.count;
        self.stride = count.next_multiple_of(COLUMNS);
        self.own.clone_from(&reduction.own);
        self.motions.clear();
        for row in reduction.motions.chunks_exact(count.max(1)) {
            self.motions.extend(row);
            self.motions.resize(self.motions.len() + self.stride - count, 0.0);
        }
        self.weights.resize(self.own.len(), Complexes::ZERO);
        self.doubt.resize(self.own.len(), [0.0; WIDTH]);
        self.elements.resize(self.stride * self.stride, Complexes::ZERO);
        self.sizes.resize(self.stride, [0.0; WIDTH]);
    }

    /// Forms G at frequencies with these powers s², s and 1 and their moduli; the product of all e.
    #[inline(always)]
    pub fn form<V: Vector>(&mut self, powers: [Complex<V>; 3], moduli: [V; 3]) -> Product<V> {
        let mut product = Product::new();
        let floor = V::splat(f64::EPSILON);
        for ((own, weight), doubt) in self.own.iter().zip(&mut self.weights).zip(&mut self.doubt) {
            let [m, d, k] = own.map(V::splat);
            let value = powers[2].scale(k).add_real_product(d, powers[1]);
            let value = value.add_real_product(m, powers[0]);
            let size = m.abs().mul_add(moduli[0], d.abs().mul_add(moduli[1], k.abs().mul(moduli[2])));
            // At the pole of a mode to the last digit, where e is rounding.
            let least = Complex { re: size.mul(floor), im: V::splat(0.0) };
            let square = value.square();
            let value = Complex::where_greater(square, least.re.mul(least.re), value, least);
            product.times(value);
            value.reciprocal().store(weight);
            size.mul(V::splat(ROUNDINGS)).store(doubt);
        }
        self.measure::<V>();
        for row in (0..self.stride).step_by(ROWS) {
            for column in (row / COLUMNS * COLUMNS..self.stride).step_by(COLUMNS) {
                self.block::<V>(row, column);
            }
        }
        product
    }

    #[inline(always)]
    fn measure<V: Vector>(&mut self) {
        for first in (0..self.stride).step_by(COLUMNS) {
            let mut sums = [V::splat(0.0); COLUMNS];
            for (row, weight) in self.motions.chunks_exact(self.stride).zip(&self.weights) {
                let size = Complex::<V>::load(weight).square().sqrt();
                for i in 0..COLUMNS {
                    let motion = row[first + i];
                    sums[i] = V::splat(motion * motion).mul_add(size, sums[i]);
                }
            }
            for i in 0..COLUMNS {
                sums[i].store(&mut self.sizes[first + i]);
            }
        }
    }

    /// A block of G and its mirror image.
    #[inline(always)]
    fn block<V: Vector>(&mut self, row: usize, column: usize) {
        let mut sums = [[Complex::<V>::splat(0.0, 0.0); COLUMNS]; ROWS];
        for (motions, weight) in self.motions.chunks_exact(self.stride).zip(&self.weights) {
            let weight = Complex::<V>::load(weight);
            let columns = &motions[column..column + COLUMNS];
            let rows = &motions[row..row + ROWS];
            for i in 0..ROWS {
                let scaled = weight.scale(V::splat(rows[i]));
                for j in 0..COLUMNS {
                    sums[i][j] = sums[i][j].add_real_product(V::splat(columns[j]), scaled);
                }
            }
        }
        for i in 0..ROWS {
            for j in 0..COLUMNS {
                sums[i][j].store(&mut self.elements[(row + i) * self.stride + column + j]);
                sums[i][j].store(&mut self.elements[(column + j) * self.stride + row + i]);
            }
        }
    }

    /// The elastic coordinates `Bᵀ f/e`, for one group of forces f on the motions.
    #[inline(always)]
    fn elastic<V: Vector>(&self, mode: usize, forces: &[Complexes]) -> Complex<V> {
        let row = &self.motions[mode * self.stride..][..forces.len()];
        let mut sums = [Complex::<V>::splat(0.0, 0.0); 2];
        for (pair, forces) in row.chunks(2).zip(forces.chunks(2)) {
            for i in 0..forces.len() {
                let force = Complex::load(&forces[i]);
                sums[i] = sums[i].add_real_product(V::splat(pair[i]), force);
            }
        }
        sums[0].add(sums[1]).mul(Complex::load(&self.weights[mode]))
    }

    /// What rounding of the e may do to a determinant near zero, in units of the unit roundoff and of it: with the
    /// right and left forces of its null vectors on the motions, and the modulus of what normalises these.
    #[inline(always)]
    pub fn rounding<V: Vector>(
        &self,
        right: &[Complexes],
        left: &[Complexes],
        across: V,
    ) -> V {
        let mut own = V::splat(0.0);
        let mut shared = V::splat(0.0);
        for (mode, doubt) in self.doubt.iter().enumerate() {
            let doubt = V::load(doubt);
            let product = self.elastic::<V>(mode, right).mul(self.elastic::<V>(mode, left));
            shared = doubt.mul_add(product.square().sqrt(), shared);
            let weight = Complex::<V>::load(&self.weights[mode]).square().sqrt();
            own = doubt.mul_add(weight, own);
        }
        own.add(shared.div(across))
    }
}
