//! The frequency response `C (s − A)⁻¹ B + D` of a state space at any complex frequency.
//!
//! One reduction to Hessenberg form per model, then one elimination by columns per frequency, with
//! no more memory than two columns. What the signals mean, and what follows from the curves, is decided
//! in `margins`.

use super::eigen::Error;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::evd::hessenberg::{self, HessenbergParams};
use faer::linalg::evd::{self, ComputeEigenvectors, EvdParams};
use faer::linalg::{householder, qr};
use faer::{Conj, Mat, MatMut, MatRef, Par, Spec};
use nalgebra::{Complex, DMatrix, DVector};

/// A state space of n states, m inputs and p outputs, prepared for its response.
///
/// The states are balanced (Parlett and Reinsch 1969) and turned by an orthogonal Q so that A is a
/// Hessenberg matrix (Laub, "Efficient multivariable frequency response computations", IEEE
/// Trans. Autom. Control 26, 1981): n³ operations once, n² a frequency for three inputs and more.
#[derive(Debug, Clone)]
pub struct Response {
    states: usize,
    /// −QᵀAQ, column-major.
    columns: Vec<f64>,
    /// QᵀB, column-major.
    input: DMatrix<f64>,
    /// CQ, column-major.
    output: DMatrix<f64>,
    direct: DMatrix<f64>,
    right_side: Vec<Complexes>,
    column: Complexes,
    next: Complexes,
    column_output: Vec<Complex<f64>>,
    next_output: Vec<Complex<f64>>,
}

/// Complex numbers by parts, which vector instructions prefer.
#[derive(Debug, Clone, Default)]
struct Complexes {
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Complexes {
    fn zeros(count: usize) -> Self {
        Self { re: vec![0.0; count], im: vec![0.0; count] }
    }

    fn at(&self, index: usize) -> Complex<f64> {
        Complex::new(self.re[index], self.im[index])
    }

    fn set_real(&mut self, values: &[f64]) {
        self.re[..values.len()].copy_from_slice(values);
        self.im[..values.len()].fill(0.0);
    }

    /// Takes `factor` times the first `count` numbers of `other` from the first of these.
    fn subtract(&mut self, factor: Complex<f64>, other: &Self, count: usize) {
        let to = self.re[..count].iter_mut().zip(&mut self.im[..count]);
        let from = other.re[..count].iter().zip(&other.im[..count]);
        for ((re, im), (x, y)) in to.zip(from) {
            *re -= factor.re * x - factor.im * y;
            *im -= factor.re * y + factor.im * x;
        }
    }
}

impl Response {
    /// Prepares `ẋ = A x + B u`, `y = C x + D u`, with A n×n, B n×m, C p×n, D p×m.
    ///
    /// # Errors
    /// [`Error::NonFinite`] where an entry, or the square of A, is not finite.
    ///
    /// # Panics
    /// If the sizes do not fit.
    pub fn new(
        a: &DMatrix<f64>,
        b: &DMatrix<f64>,
        c: &DMatrix<f64>,
        d: &DMatrix<f64>,
    ) -> Result<Self, Error> {
        let (n, m, p) = (a.nrows(), b.ncols(), c.nrows());
        assert!(
            a.is_square() && b.nrows() == n && c.ncols() == n && d.shape() == (p, m),
            "the sizes of a state space fit"
        );
        // Balancing would halve the norm of an infinite row for ever.
        if !a.norm_squared().is_finite() {
            return Err(Error::NonFinite("the square of the state matrix"));
        }
        if !(b.iter().chain(c).chain(d).all(|value| value.is_finite())) {
            return Err(Error::NonFinite("an input, output or direct matrix"));
        }
        let scale = scale(a);
        let mut state = DMatrix::from_fn(n, n, |i, j| a[(i, j)] * (scale[j] / scale[i]));
        // C and Bᵀ stand above each other: both are multiplied by Q from the right.
        let mut outside = DMatrix::zeros(p + m, n);
        for column in 0..n {
            for row in 0..p {
                outside[(row, column)] = c[(row, column)] * scale[column];
            }
            for row in 0..m {
                outside[(p + row, column)] = b[(column, row)] / scale[column];
            }
        }
        reduce(&mut state, &mut outside);
        state.neg_mut();
        Ok(Self {
            states: n,
            columns: state.as_slice().to_vec(),
            input: outside.rows(p, m).transpose(),
            output: outside.rows(0, p).into_owned(),
            direct: d.clone(),
            right_side: vec![Complexes::zeros(n); m],
            column: Complexes::zeros(n),
            next: Complexes::zeros(n),
            column_output: vec![Complex::default(); p],
            next_output: vec![Complex::default(); p],
        })
    }

    /// Outputs p.
    pub fn outputs(&self) -> usize {
        self.direct.nrows()
    }

    /// Inputs m.
    pub fn inputs(&self) -> usize {
        self.direct.ncols()
    }

    /// The poles, rad/s, one of each complex pair (in the upper half plane).
    ///
    /// # Errors
    /// See [`Error`].
    pub fn poles(&self) -> Result<Vec<Complex<f64>>, Error> {
        let n = self.states;
        let (mut re, mut im) = (vec![0.0; n], vec![0.0; n]);
        let parameters = Spec::<EvdParams, f64>::default();
        let no = ComputeEigenvectors::No;
        let scratch = evd::evd_scratch::<f64>(n, no, no, Par::Seq, parameters);
        let mut memory = MemBuffer::new(scratch);
        evd::evd_real(
            MatRef::from_column_major_slice(&self.columns, n, n),
            faer::ColMut::from_slice_mut(&mut re).as_diagonal_mut(),
            faer::ColMut::from_slice_mut(&mut im).as_diagonal_mut(),
            None,
            None,
            Par::Seq,
            MemStack::new(&mut memory),
            parameters,
        )
        .map_err(|_| Error::NoConvergence)?;
        // The columns are those of −A.
        let poles = re.into_iter().zip(im).map(|(re, im)| Complex::new(-re, -im));
        Ok(poles.filter(|pole| pole.im >= 0.0).collect())
    }

    /// The response at the complex frequency `s`, rad/s, written into `response`, p×m.
    ///
    /// Columns of `s − H` are eliminated from the last, each by its neighbour with the larger pivot
    /// (`(s − H) R = T`, T upper triangular); `T Y = B` and `C R Y` are taken along. At a pole the
    /// result is not finite.
    pub fn at(&mut self, s: Complex<f64>, response: &mut DMatrix<Complex<f64>>) {
        let n = self.states;
        for (to, from) in response.iter_mut().zip(&self.direct) {
            *to = Complex::new(*from, 0.0);
        }
        if n == 0 {
            return;
        }
        for (to, from) in self.right_side.iter_mut().zip(self.input.column_iter()) {
            to.set_real(from.as_slice());
        }
        let Self { columns, output, right_side, column, next, column_output, next_output, .. } =
            self;
        let load = |index: usize, rows: usize, to: &mut Complexes, out: &mut [Complex<f64>]| {
            to.set_real(&columns[index * n..index * n + rows]);
            to.re[index] += s.re;
            to.im[index] += s.im;
            for (to, from) in out.iter_mut().zip(output.column(index).iter()) {
                *to = Complex::new(*from, 0.0);
            }
        };
        load(n - 1, n, column, column_output);
        for last in (0..n).rev() {
            if last > 0 {
                load(last - 1, last + 1, next, next_output);
                if next.at(last).norm_sqr() > column.at(last).norm_sqr() {
                    std::mem::swap(column, next);
                    std::mem::swap(column_output, next_output);
                }
            }
            let reciprocal = column.at(last).inv();
            for (input, right) in right_side.iter_mut().enumerate() {
                let y = right.at(last) * reciprocal;
                right.subtract(y, column, last);
                for (row, value) in column_output.iter().enumerate() {
                    response[(row, input)] += value * y;
                }
            }
            if last > 0 {
                let factor = next.at(last) * reciprocal;
                next.subtract(factor, column, last);
                for (to, from) in next_output.iter_mut().zip(column_output.iter()) {
                    *to -= factor * from;
                }
                std::mem::swap(column, next);
                std::mem::swap(column_output, next_output);
            }
        }
    }
}

/// Powers of two by which the states are balanced. Entries that are small in their row and in their
/// column have no say: where symmetry uncouples states, what rounding leaves between them would pull the
/// scales of whole groups apart, and cost the digits that balancing is to save (Watkins, "A case where balancing is
/// harmful", ETNA 23, 2006).
fn scale(a: &DMatrix<f64>) -> DVector<f64> {
    let small = f64::EPSILON.sqrt();
    let rows: Vec<f64> = a.row_iter().map(|row| small * row.amax()).collect();
    let columns: Vec<f64> = a.column_iter().map(|column| small * column.amax()).collect();
    let mut counted = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| {
        let value = a[(i, j)];
        if value.abs() < rows[i].min(columns[j]) { 0.0 } else { value }
    });
    nalgebra::linalg::balancing::balance_parlett_reinsch(&mut counted)
}

/// Turns `state` into the Hessenberg matrix `QᵀAQ` and `outside` into `outside Q`.
fn reduce(state: &mut DMatrix<f64>, outside: &mut DMatrix<f64>) {
    let (n, rows) = (state.nrows(), outside.nrows());
    if n < 3 {
        return;
    }
    let block = qr::no_pivoting::factor::recommended_block_size::<f64>(n - 1, n - 1);
    let parameters = Spec::<HessenbergParams, f64>::default();
    let mut memory = MemBuffer::new(StackReq::any_of(&[
        hessenberg::hessenberg_in_place_scratch::<f64>(n, block, Par::Seq, parameters),
        householder::apply_block_householder_sequence_on_the_right_in_place_scratch::<f64>(
            n - 1,
            block,
            rows,
        ),
    ]));
    let mut factors = Mat::<f64>::zeros(block, n - 1);
    hessenberg::hessenberg_in_place(
        MatMut::from_column_major_slice_mut(state.as_mut_slice(), n, n),
        factors.as_mut(),
        Par::Seq,
        MemStack::new(&mut memory),
        parameters,
    );
    householder::apply_block_householder_sequence_on_the_right_in_place_with_conj(
        MatRef::from_column_major_slice(state.as_slice(), n, n).submatrix(1, 0, n - 1, n - 1),
        factors.as_ref(),
        Conj::No,
        MatMut::from_column_major_slice_mut(outside.as_mut_slice(), rows, n).subcols_mut(1, n - 1),
        Par::Seq,
        MemStack::new(&mut memory),
    );
    // Below the subdiagonal stand the reflections.
    for column in 0..n {
        for row in column + 2..n {
            state[(row, column)] = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [−1, 1) that look random (SplitMix64).
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * f64::EPSILON - 1.0
    }

    fn matrix(rows: usize, columns: usize, state: &mut u64) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| random(state))
    }

    /// The response by a dense factorisation of s − A.
    fn dense([a, b, c, d]: [&DMatrix<f64>; 4], s: Complex<f64>) -> (DMatrix<Complex<f64>>, f64) {
        let complex = |m: &DMatrix<f64>| m.map(|value| Complex::new(value, 0.0));
        let pencil = DMatrix::from_diagonal_element(a.nrows(), a.nrows(), s) - complex(a);
        let inverse = pencil.clone().try_inverse().expect("not a pole");
        // Rounding moves the response by at most a modest multiple of n ε ‖s − A‖ ‖C (s − A)⁻¹‖ ‖(s − A)⁻¹ B‖.
        let error = pencil.norm() * (complex(c) * &inverse).norm() * (&inverse * complex(b)).norm();
        (complex(c) * inverse * complex(b) + complex(d), error)
    }

    fn check(matrices: [&DMatrix<f64>; 4], frequencies: &[Complex<f64>]) {
        let [a, b, c, d] = matrices;
        let mut response = Response::new(a, b, c, d).expect("finite");
        let mut found = DMatrix::zeros(c.nrows(), b.ncols());
        for &s in frequencies {
            response.at(s, &mut found);
            let (expected, error) = dense(matrices, s);
            let off = (&found - &expected).norm();
            let bound = 10.0 * a.nrows() as f64 * f64::EPSILON * (error + expected.norm());
            assert!(off <= bound, "{s}: {off:.2e} > {bound:.2e}");
        }
    }

    #[test]
    fn the_response_is_that_of_a_dense_solve_for_any_size() {
        let state = &mut 1;
        let frequencies =
            [(0.0, 1e-3), (0.0, 0.7), (0.3, 0.0), (0.0, 30.0), (1.0, -2.0), (0.0, 1e4)]
                .map(|(re, im)| Complex::new(re, im));
        for n in [1, 2, 3, 4, 7, 20, 61] {
            let a = matrix(n, n, state);
            let (b, c, d) = (matrix(n, 3, state), matrix(6, n, state), matrix(6, 3, state));
            check([&a, &b, &c, &d], &frequencies);
        }
    }

    #[test]
    fn rigid_poles_at_zero_do_no_harm() {
        // A double integrator beside a light mode: 1/s² + 1/(s² + 2 0.005 s + 1).
        let a = DMatrix::from_row_slice(
            4,
            4,
            &[0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 0., -1., 0., -0.01],
        );
        let b = DMatrix::from_row_slice(4, 1, &[0., 0., 1., 1.]);
        let c = DMatrix::from_row_slice(1, 4, &[1., 1., 0., 0.]);
        let mut response = Response::new(&a, &b, &c, &DMatrix::zeros(1, 1)).expect("finite");
        let mut found = DMatrix::zeros(1, 1);
        for omega in [1e-6, 1e-2, 0.999, 1.0, 50.0] {
            let s = Complex::new(0.0, omega);
            response.at(s, &mut found);
            let expected = 1.0 / (s * s) + 1.0 / (s * s + 0.01 * s + 1.0);
            assert!((found[(0, 0)] - expected).norm() < 1e-13 * expected.norm(), "{omega}");
        }
    }

    #[test]
    fn what_rounding_leaves_between_uncoupled_states_costs_no_digits() {
        // Two oscillators; the second drives the first, and rounding the second back.
        let mut a = DMatrix::zeros(4, 4);
        for (at, omega) in [(0, 3.0), (2, 5.0)] {
            a[(at, at + 1)] = 1.0;
            a[(at + 1, at)] = -omega * omega;
            a[(at + 1, at + 1)] = -0.01 * omega;
        }
        a[(1, 2)] = 1.0;
        a[(3, 0)] = 1e-19;
        let b = DMatrix::from_row_slice(4, 1, &[0.0, 1.0, 0.0, 1.0]);
        let c = DMatrix::from_row_slice(2, 4, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let mut response = Response::new(&a, &b, &c, &DMatrix::zeros(2, 1)).expect("finite");
        let mut found = DMatrix::zeros(2, 1);
        for omega in [0.1, 2.99, 4.0, 5.0] {
            let s = Complex::new(0.0, omega);
            response.at(s, &mut found);
            let second = 1.0 / (s * s + 0.05 * s + 25.0);
            let first = (1.0 + second) / (s * s + 0.03 * s + 9.0);
            for (found, expected) in [(found[(0, 0)], first), (found[(1, 0)], second)] {
                assert!((found - expected).norm() < 1e-13 * expected.norm(), "{omega}");
            }
        }
    }

    #[test]
    fn poles_come_once_a_pair() {
        let a = DMatrix::from_row_slice(3, 3, &[0., 1., 0., -4., -0.4, 0., 1., 0., 2.]);
        let empty = (DMatrix::zeros(3, 0), DMatrix::zeros(0, 3), DMatrix::zeros(0, 0));
        let response = Response::new(&a, &empty.0, &empty.1, &empty.2).expect("finite");
        let mut poles = response.poles().expect("solved");
        poles.sort_by(|a, b| a.re.total_cmp(&b.re));
        assert_eq!(poles.len(), 2);
        assert!((poles[0] - Complex::new(-0.2, 3.96_f64.sqrt())).norm() < 1e-14);
        assert!((poles[1] - Complex::new(2.0, 0.0)).norm() < 1e-14);
    }

    #[test]
    fn states_of_very_different_size_lose_no_digits() {
        // A lag of 1/(s + 1) whose state is in pascals, in series with one of order one.
        let a = DMatrix::from_row_slice(2, 2, &[-1.0, 1e12, 0.0, -3.0]);
        let b = DMatrix::from_row_slice(2, 1, &[0.0, 1.0]);
        let c = DMatrix::from_row_slice(1, 2, &[1e-12, 0.0]);
        let mut response = Response::new(&a, &b, &c, &DMatrix::zeros(1, 1)).expect("finite");
        let mut found = DMatrix::zeros(1, 1);
        let s = Complex::new(0.0, 2.0);
        response.at(s, &mut found);
        let expected = 1.0 / ((s + 1.0) * (s + 3.0));
        assert!((found[(0, 0)] - expected).norm() < 8.0 * f64::EPSILON * expected.norm());
    }

    #[test]
    fn matrices_that_are_not_finite_are_refused() {
        let one = DMatrix::from_element(1, 1, 1.0);
        for bad in [f64::NAN, f64::INFINITY] {
            let bad = DMatrix::from_element(1, 1, bad);
            assert!(Response::new(&bad, &one, &one, &one).is_err());
            assert!(Response::new(&one, &bad, &one, &one).is_err());
            assert!(Response::new(&one, &one, &bad, &one).is_err());
            assert!(Response::new(&one, &one, &one, &bad).is_err());
        }
    }
}
