//! What elastic coordinates pass on between motions, at eight frequencies: `G = B diag(e)⁻¹ Bᵀ`.
//!
//! Where the motions come from is decided in `reduction`, what is done with G in `pencil`.

use super::lanes::{Complex, Complexes, Vector, WIDTH};
use super::reduction::{BLOCK, Reduction};
use super::scaled::Product;

/// Rows of a block of G that is summed at once.
const ROWS: usize = 2;
/// Roundings of e: three terms and their sum.
const ROUNDINGS: f64 = 4.0;

/// G and what it is made of.
#[derive(Debug, Default)]
pub struct Gram {
    stride: usize,
    /// 1/e, and moduli.
    weights: Vec<Complexes>,
    moduli: Vec<[f64; WIDTH]>,
    /// What rounding may have done to each e, in units of the unit roundoff.
    doubt: Vec<[f64; WIDTH]>,
    /// G, row by row.
    pub elements: Vec<Complexes>,
    /// `Σ B² |1/e|` of each motion: no element of a row and column is greater than the root of their product.
    pub sizes: Vec<[f64; WIDTH]>,
}

impl Gram {
    /// Makes room for the motions and elastic coordinates of a model.
    pub fn resize(&mut self, reduction: &Reduction) {
        let (modes, stride) = (reduction.own.len(), reduction.stride);
        self.stride = stride;
        self.weights.resize(modes, Complexes::ZERO);
        self.moduli.resize(modes, [0.0; WIDTH]);
        self.doubt.resize(modes, [0.0; WIDTH]);
        self.elements.resize(stride * stride, Complexes::ZERO);
        self.sizes.resize(stride, [0.0; WIDTH]);
    }

    /// Forms G at frequencies with these powers s², s and 1 and their moduli; the product of all e.
    #[inline(always)]
    pub fn form<V: Vector>(
        &mut self,
        reduction: &Reduction,
        powers: [Complex<V>; 3],
        moduli: [V; 3],
    ) -> Product<V> {
        let mut product = Product::new();
        let floor = V::splat(f64::EPSILON);
        for (mode, own) in reduction.own.iter().enumerate() {
            let (m, d, k) = (V::splat(own[0]), V::splat(own[1]), V::splat(own[2]));
            let value = powers[2].scale(k).add_real_product(d, powers[1]);
            let value = value.add_real_product(m, powers[0]);
            let size =
                m.abs().mul_add(moduli[0], d.abs().mul_add(moduli[1], k.abs().mul(moduli[2])));
            // At the pole of a mode to the last digit, where e is rounding.
            let least = Complex { re: size.mul(floor), im: V::splat(0.0) };
            let square = value.square();
            let value = Complex::where_greater(square, least.re.mul(least.re), value, least);
            product.times(value);
            let inverse = V::splat(1.0).div(value.square());
            let minus = V::splat(0.0).sub(inverse);
            let weight = Complex { re: value.re.mul(inverse), im: value.im.mul(minus) };
            weight.store(&mut self.weights[mode]);
            inverse.sqrt().store(&mut self.moduli[mode]);
            size.mul(V::splat(ROUNDINGS)).store(&mut self.doubt[mode]);
        }
        self.measure::<V>(&reduction.motions);
        for row in (0..self.stride).step_by(ROWS) {
            for column in (row / BLOCK * BLOCK..self.stride).step_by(BLOCK) {
                self.block::<V>(&reduction.motions, row, column);
            }
        }
        product
    }

    #[inline(always)]
    fn measure<V: Vector>(&mut self, motions: &[f64]) {
        for first in (0..self.stride).step_by(BLOCK) {
            let mut sums = [V::splat(0.0); BLOCK];
            for (row, size) in motions.chunks_exact(self.stride).zip(&self.moduli) {
                let size = V::load(size);
                for i in 0..BLOCK {
                    let motion = row[first + i];
                    sums[i] = V::splat(motion * motion).mul_add(size, sums[i]);
                }
            }
            for i in 0..BLOCK {
                sums[i].store(&mut self.sizes[first + i]);
            }
        }
    }

    /// A block of G and its mirror image.
    #[inline(always)]
    fn block<V: Vector>(&mut self, motions: &[f64], row: usize, column: usize) {
        let mut sums = [[Complex::<V>::splat(0.0, 0.0); BLOCK]; ROWS];
        for (motions, weight) in motions.chunks_exact(self.stride).zip(&self.weights) {
            let weight = Complex::<V>::load(weight);
            let columns = &motions[column..column + BLOCK];
            let rows = &motions[row..row + ROWS];
            for i in 0..ROWS {
                let scaled = weight.scale(V::splat(rows[i]));
                for j in 0..BLOCK {
                    sums[i][j] = sums[i][j].add_real_product(V::splat(columns[j]), scaled);
                }
            }
        }
        for i in 0..ROWS {
            for j in 0..BLOCK {
                sums[i][j].store(&mut self.elements[(row + i) * self.stride + column + j]);
                sums[i][j].store(&mut self.elements[(column + j) * self.stride + row + i]);
            }
        }
    }

    /// 1/e of an elastic coordinate.
    #[inline(always)]
    pub fn weight<V: Vector>(&self, mode: usize) -> Complex<V> {
        Complex::load(&self.weights[mode])
    }

    /// The elastic coordinate `bᵀ f/e`, b its row of motions and f forces on these.
    #[inline(always)]
    pub fn elastic<V: Vector>(&self, row: &[f64], mode: usize, forces: &[Complexes]) -> Complex<V> {
        let row = &row[..forces.len()];
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
        motions: &[f64],
        right: &[Complexes],
        left: &[Complexes],
        across: V,
    ) -> V {
        let mut own = V::splat(0.0);
        let mut shared = V::splat(0.0);
        for (mode, row) in motions.chunks_exact(self.stride).enumerate() {
            let doubt = V::load(&self.doubt[mode]);
            let product = self.elastic::<V>(row, mode, right);
            let product = product.mul(self.elastic::<V>(row, mode, left));
            shared = doubt.mul_add(product.square().sqrt(), shared);
            own = doubt.mul_add(V::load(&self.moduli[mode]), own);
        }
        own.add(shared.div(across))
    }
}
