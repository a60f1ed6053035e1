//! What elastic coordinates pass on between motions, at eight frequencies: `G = B diag(e)⁻¹ Bᵀ`.
//!
//! Where the motions come from is decided in `reduction`, what is done with G in `pencil`.

#![expect(
    clippy::needless_range_loop,
    reason = "closures and iterators do not inline into kernels of an instruction set"
)]

use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::reduction::{BLOCK, MOST_MOTIONS, Reduction};
use super::scaled::Product;

/// Elements of G that are summed at once: as many as registers hold, real and imaginary parts.
const PAIRS: usize = 12;
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
    /// The motions, for which the products are.
    motions: Vec<f64>,
    /// Row and column of the elements of G on and above its diagonal, and for each block of them and each elastic
    /// coordinate the products of the two motions; zeros end the last block.
    pairs: Vec<[usize; 2]>,
    products: Vec<[f64; PAIRS]>,
    /// Squares of the motions.
    squares: Vec<f64>,
    /// G, row by row.
    pub elements: Vec<Complexes>,
    /// Roots of `Σ B² |1/e|` of each motion: no element of a row and column is greater than their product.
    pub sizes: Vec<[f64; WIDTH]>,
}

impl Gram {
    /// Makes room for the motions and elastic coordinates of a model.
    pub fn resize(&mut self, level: Level, reduction: &Reduction) {
        let (modes, stride) = (reduction.own.len(), reduction.stride);
        self.stride = stride;
        self.weights.resize(modes, Complexes::ZERO);
        self.moduli.resize(modes, [0.0; WIDTH]);
        self.doubt.resize(modes, [0.0; WIDTH]);
        self.elements.resize(stride * stride, Complexes::ZERO);
        self.sizes.resize(stride, [0.0; WIDTH]);
        if self.motions != reduction.motions || self.pairs.last() != Some(&[reduction.count - 1; 2])
        {
            self.multiply(level, reduction);
        }
    }

    /// Products of motions.
    fn multiply(&mut self, level: Level, reduction: &Reduction) {
        self.motions.clone_from(&reduction.motions);
        self.pairs.clear();
        let count = reduction.count;
        self.pairs.extend((0..count).flat_map(|row| (row..count).map(move |column| [row, column])));
        self.squares.clear();
        self.squares.extend(self.motions.iter().map(|motion| motion * motion));
        let blocks = self.pairs.len().div_ceil(PAIRS);
        self.products.resize(blocks * reduction.own.len(), [0.0; PAIRS]);
        level.run(Products { gram: self, count });
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
            let inverse = value.square().reciprocal();
            let minus = V::splat(0.0).sub(inverse);
            let weight = Complex { re: value.re.mul(inverse), im: value.im.mul(minus) };
            weight.store(&mut self.weights[mode]);
            inverse.root_above().store(&mut self.moduli[mode]);
            size.mul(V::splat(ROUNDINGS)).store(&mut self.doubt[mode]);
        }
        self.measure::<V>();
        for block in 0..self.pairs.len().div_ceil(PAIRS) {
            self.block::<V>(block);
        }
        product
    }

    #[inline(always)]
    fn measure<V: Vector>(&mut self) {
        for first in (0..self.stride).step_by(BLOCK) {
            let mut sums = [V::splat(0.0); BLOCK];
            for (row, size) in self.squares.chunks_exact(self.stride).zip(&self.moduli) {
                let size = V::load(size);
                let row = &row[first..first + BLOCK];
                for i in 0..BLOCK {
                    sums[i] = V::splat(row[i]).mul_add(size, sums[i]);
                }
            }
            for i in 0..BLOCK {
                sums[i].root_above().store(&mut self.sizes[first + i]);
            }
        }
    }

    /// A block of G and its mirror image.
    #[inline(always)]
    fn block<V: Vector>(&mut self, block: usize) {
        let mut sums = [Complex::<V>::splat(0.0, 0.0); PAIRS];
        let modes = self.weights.len();
        for (products, weight) in self.products[block * modes..].iter().zip(&self.weights) {
            let weight = Complex::<V>::load(weight);
            for i in 0..PAIRS {
                sums[i] = sums[i].add_real_product(V::splat(products[i]), weight);
            }
        }
        // By way of memory: an index that is not known would keep the sums there all along.
        let mut stored = [Complexes::ZERO; PAIRS];
        for i in 0..PAIRS {
            sums[i].store(&mut stored[i]);
        }
        for (sum, &[row, column]) in stored.iter().zip(&self.pairs[block * PAIRS..]) {
            self.elements[row * self.stride + column] = *sum;
            self.elements[column * self.stride + row] = *sum;
        }
    }

    /// 1/e of an elastic coordinate.
    #[inline(always)]
    pub fn weight<V: Vector>(&self, mode: usize) -> Complex<V> {
        Complex::load(&self.weights[mode])
    }

    /// What rounding of the e may do to a determinant near zero, in units of the unit roundoff and of it: with the
    /// right and left forces of its null vectors on the motions, and the modulus of what normalises these.
    #[inline(always)]
    pub fn rounding<V: Vector>(&self, right: &[Complexes], left: &[Complexes], across: V) -> V {
        let mut own = V::splat(0.0);
        let mut shared = V::splat(0.0);
        let modes = self.weights.len();
        for first in (0..modes).step_by(BLOCK) {
            let right = self.forces_on::<V, BLOCK>(first, right);
            let left = self.forces_on::<V, BLOCK>(first, left);
            for i in 0..BLOCK.min(modes - first) {
                let mode = first + i;
                // |bᵀf/e| of both.
                let doubt = V::load(&self.doubt[mode]);
                let size = V::load(&self.moduli[mode]);
                let product = right[i].mul(left[i]).square().root_above();
                shared = doubt.mul(size.mul(size)).mul_add(product, shared);
                own = doubt.mul_add(size, own);
            }
        }
        own.add(shared.div(across))
    }

    /// The forces `bᵀ f` on a block of elastic coordinates, b their rows of motions and f forces on these; beyond the last
    /// coordinate those on it.
    #[inline(always)]
    pub fn forces_on<V: Vector, const N: usize>(
        &self,
        first: usize,
        forces: &[Complexes],
    ) -> [Complex<V>; N] {
        let Self { motions, stride, .. } = self;
        let (count, last) = (forces.len(), self.weights.len() - 1);
        let mut rows = [&motions[..count]; N];
        for i in 0..N {
            rows[i] = &motions[(first + i).min(last) * stride..][..count];
        }
        let mut sums = [Complex::<V>::splat(0.0, 0.0); N];
        for at in 0..count {
            let force = Complex::<V>::load(&forces[at]);
            for i in 0..N {
                sums[i] = sums[i].add_real_product(V::splat(rows[i][at]), force);
            }
        }
        sums
    }
}

/// Products of the motions on each elastic coordinate.
struct Products<'a> {
    gram: &'a mut Gram,
    count: usize,
}

impl Kernel for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { gram: Gram { motions, stride, pairs, products, .. }, count } = self;
        let modes = motions.len() / *stride;
        let blocks = pairs.len().div_ceil(PAIRS);
        // A row of motions, and its products in the order of the pairs: lanes beyond the last motion are zero there, and
        // are overwritten here.
        let mut row = [0.0; MOST_MOTIONS + WIDTH];
        let mut line = vec![0.0; blocks * PAIRS + WIDTH];
        for mode in 0..modes {
            row[..count].copy_from_slice(&motions[mode * *stride..][..count]);
            let mut start = 0;
            for first in 0..count {
                let factor = V::splat(row[first]);
                let length = count - first;
                for block in (0..length).step_by(WIDTH) {
                    let others = row[first + block..].first_chunk().expect("padded");
                    let to = line[start + block..].first_chunk_mut().expect("padded");
                    factor.mul(V::load(others)).store(to);
                }
                start += length;
            }
            for block in 0..blocks {
                products[block * modes + mode].copy_from_slice(&line[block * PAIRS..][..PAIRS]);
            }
        }
    }
}
