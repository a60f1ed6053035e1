//! The frequency response `C (s − A)⁻¹ B + D` of a state space at any complex frequency.
//!
//! One reduction to Hessenberg form per model, then one elimination by columns per eight frequencies, with
//! no more memory than a column and the right-hand sides. What the signals mean, and what follows from the curves, is decided
//! in `margins`.

use super::eigen::Error;
use super::spectrum::lanes::{Complex as Lanes, Complexes, Kernel, Level, Vector, WIDTH};
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
    level: Level,
    /// What is left of the right-hand sides, state by state and input by input.
    right_side: Vec<Complexes>,
    /// What is left of a column, state by state, then output by output.
    column: Vec<Complexes>,
    /// The response, column-major.
    found: Vec<Complexes>,
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
            level: Level::best(),
            right_side: vec![Complexes::ZERO; n * m],
            column: vec![Complexes::ZERO; n + p],
            found: vec![Complexes::ZERO; p * m],
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

    /// The responses at the complex frequencies `points`, rad/s, each p×m.
    ///
    /// Columns of `s − H` are eliminated from the last, each by its neighbour with the larger pivot
    /// (`(s − H) R = T`, T upper triangular); `T Y = B` and `C R Y` are taken along. At a pole the
    /// result is not finite. What else is asked for in one call does not change a result.
    pub fn at(&mut self, points: &[Complex<f64>]) -> Vec<DMatrix<Complex<f64>>> {
        let (p, m) = self.direct.shape();
        let mut responses = Vec::with_capacity(points.len());
        for chunk in points.chunks(WIDTH) {
            let mut s = Complexes::ZERO;
            for lane in 0..WIDTH {
                let point = chunk[lane.min(chunk.len() - 1)];
                (s.re[lane], s.im[lane]) = (point.re, point.im);
            }
            self.level.run(Elimination { response: self, s });
            responses.extend((0..chunk.len()).map(|lane| {
                DMatrix::from_fn(p, m, |row, column| {
                    let found = &self.found[column * p + row];
                    Complex::new(found.re[lane], found.im[lane])
                })
            }));
        }
        responses
    }
}

/// The response at eight frequencies at once.
struct Elimination<'a> {
    response: &'a mut Response,
    s: Complexes,
}

impl Kernel for Elimination<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Response { states, columns, input, output, direct, right_side, column, found, .. } =
            self.response;
        let (n, [p, m]) = (*states, [direct.nrows(), direct.ncols()]);
        let real = |value: f64| Lanes::<V>::splat(value, 0.0);
        let s = Lanes::<V>::load(&self.s);
        for (to, from) in found.iter_mut().zip(direct.as_slice()) {
            real(*from).store(to);
        }
        for state in 0..n {
            for k in 0..m {
                real(input[(state, k)]).store(&mut right_side[state * m + k]);
            }
        }
        if n == 0 {
            return;
        }
        for (to, from) in column.iter_mut().zip(&columns[(n - 1) * n..]) {
            real(*from).store(to);
        }
        Lanes::<V>::load(&column[n - 1]).add(s).store(&mut column[n - 1]);
        for row in 0..p {
            real(output[(row, n - 1)]).store(&mut column[n + row]);
        }
        for last in (0..n).rev() {
            let own = Lanes::<V>::load(&column[last]);
            // The neighbour on the left, whose place on the subdiagonal has no s.
            let left = if last > 0 { &columns[(last - 1) * n..][..n] } else { &[][..] };
            let zero = real(0.0);
            let beside = if last > 0 { real(left[last]) } else { zero };
            let (a, b) = (beside.square(), own.square());
            let reciprocal = Lanes::where_greater(a, b, beside, own).reciprocal();
            let factor = Lanes::where_greater(a, b, own, beside).mul(reciprocal);
            let (above, from) = right_side.split_at_mut(last * m);
            for y in &mut from[..m] {
                Lanes::<V>::load(y).mul(reciprocal).store(y);
            }
            for i in 0..last {
                let shift = if i + 1 == last { s } else { zero };
                let (mine, next) = (Lanes::load(&column[i]), real(left[i]).add(shift));
                let pivot = Lanes::where_greater(a, b, next, mine);
                let other = Lanes::where_greater(a, b, mine, next);
                for (right, y) in above[i * m..(i + 1) * m].iter_mut().zip(&*from) {
                    let value = Lanes::<V>::load(right);
                    value.subtract_product(Lanes::load(y), pivot).store(right);
                }
                other.subtract_product(factor, pivot).store(&mut column[i]);
            }
            for row in 0..p {
                let mine = Lanes::load(&column[n + row]);
                let next = if last > 0 { real(output[(row, last - 1)]) } else { zero };
                let pivot = Lanes::where_greater(a, b, next, mine);
                let other = Lanes::where_greater(a, b, mine, next);
                for (k, y) in from[..m].iter().enumerate() {
                    let to = &mut found[k * p + row];
                    Lanes::<V>::load(to).add(pivot.mul(Lanes::load(y))).store(to);
                }
                other.subtract_product(factor, pivot).store(&mut column[n + row]);
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
        // One more than two groups, so that lanes are idle and full.
        let points: Vec<_> = frequencies.iter().copied().cycle().take(17).collect();
        for (s, found) in points.iter().copied().zip(response.at(&points)) {
            assert_eq!(found, response.at(&[s])[0]);
            let (expected, error) = dense(matrices, s);
            let off = (found - &expected).norm();
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
        for omega in [1e-6, 1e-2, 0.999, 1.0, 50.0] {
            let s = Complex::new(0.0, omega);
            let found = &response.at(&[s])[0];
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
        for omega in [0.1, 2.99, 4.0, 5.0] {
            let s = Complex::new(0.0, omega);
            let found = &response.at(&[s])[0];
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
        let s = Complex::new(0.0, 2.0);
        let found = &response.at(&[s])[0];
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
