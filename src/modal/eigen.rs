//! The eigen-solver: poles of a model by a dense solve, eigenvectors by inverse iteration.
//!
//! With `response` the only file that names faer's solvers. Mass matrix by Cholesky, Parlett–Reinsch balancing,
//! Hessenberg QR, all sequential and in buffers that are reused; what poles mean is decided in
//! `identify`.

use super::factors::Factors;
use crate::dynamics::Model;
use crate::dynamics::servo::Row;
use crate::vehicle::StateSpace;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt;
use faer::linalg::evd::{self, ComputeEigenvectors, EvdParams};
use faer::{Mat, MatMut, MatRef, Par, Spec, c64};
use nalgebra::DMatrix;

/// Why a solve failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// An entry of the model or a pole is NaN or infinite.
    #[error("{0} is not finite")]
    NonFinite(&'static str),
    /// The mass matrix is not positive definite.
    #[error("the mass matrix is not positive definite (pivot {pivot})")]
    SingularMass {
        /// Coordinate at which the factorisation stopped.
        pivot: usize,
    },
    /// The QR iteration did not converge.
    #[error("the QR iteration did not converge")]
    NoConvergence,
    /// The least pole is lost in the rounding of the greatest.
    #[error("poles from {least:.2e} to {greatest:.2e} rad/s cannot be told in one model")]
    Spread {
        /// Least modulus of a pole, rad/s.
        least: f64,
        /// Greatest modulus of a pole, rad/s.
        greatest: f64,
    },
    /// Sums of the poles disagree with the traces of the matrix.
    #[error("{what} of the poles is off by {error:.2e}, allowed {bound:.2e}")]
    Trace {
        /// Which sum.
        what: &'static str,
        /// Relative difference.
        error: f64,
        /// Largest relative difference allowed.
        bound: f64,
    },
}

/// A right and a left eigenvector of `L(s) = M s² + D s + K` at a pole: `L x = 0`, `yᴴ L = 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The pole, rad/s.
    pub pole: c64,
    /// Right vector x, unit norm.
    pub right: Vec<c64>,
    /// Left vector y, unit norm.
    pub left: Vec<c64>,
    /// Root of the sum of squares of ‖L x‖ and ‖yᴴ L‖ over ‖M‖|s|² + ‖D‖|s| + ‖K‖ (Frobenius norms), −,
    /// in coordinates scaled so that the diagonal is near one.
    pub residual: f64,
    /// Distance of the pole from an exact one to first order, ‖L x‖ ‖y‖/|yᴴ L' x| in those coordinates, rad/s.
    pub bound: f64,
}

/// Buffers of the solver for models of one size.
pub struct Solver {
    coordinates: usize,
    factor: Mat<f64>,
    right_side: Mat<f64>,
    state: DMatrix<f64>,
    /// State [q, q̇, x_a] of each row of the state matrix.
    kept: Vec<usize>,
    real: Vec<f64>,
    imaginary: Vec<f64>,
    pencil: Factors,
    /// Power of two by which each coordinate is scaled in the pencil.
    scale: Vec<f64>,
    right: Vec<c64>,
    left: Vec<c64>,
    memory: MemBuffer,
}

/// Allowed relative error of Σλ and Σλ², in units of n ε: the backward error of the balanced QR
/// iteration is a modest multiple of n ε ‖A‖, and the sums are compared on the scale Σ|λ|, Σ|λ|².
const TRACE_FACTOR: f64 = 1e4;

impl Solver {
    /// A solver for models with `coordinates` coordinates, of second or first order.
    pub fn new(coordinates: usize) -> Self {
        let states = 2 * coordinates;
        let requirements = [
            llt::factor::cholesky_in_place_scratch::<f64>(
                coordinates,
                Par::Seq,
                Spec::<llt::factor::LltParams, f64>::default(),
            ),
            llt::solve::solve_in_place_scratch::<f64>(coordinates, states, Par::Seq),
            evd::evd_scratch::<f64>(
                states,
                ComputeEigenvectors::No,
                ComputeEigenvectors::No,
                Par::Seq,
                Spec::<EvdParams, f64>::default(),
            ),
        ];
        Self {
            coordinates,
            factor: Mat::zeros(coordinates, coordinates),
            right_side: Mat::zeros(coordinates, states),
            state: DMatrix::zeros(states, states),
            kept: Vec::with_capacity(states),
            real: vec![0.0; states],
            imaginary: vec![0.0; states],
            pencil: Factors::new(coordinates),
            scale: vec![1.0; coordinates],
            right: Vec::with_capacity(coordinates),
            left: Vec::with_capacity(coordinates),
            memory: MemBuffer::new(StackReq::any_of(&requirements)),
        }
    }

    /// All poles of the model, rad/s, appended to `poles` (cleared first) with each complex pair
    /// represented by its member in the upper half plane; sorted by imaginary, then real part. The
    /// null states of the model are no part of them: each is one more pole, at the origin. Nor are as many
    /// as [`Model::at_origin`] that rounding does not tell from zero.
    ///
    /// # Errors
    /// See [`Error`]; poles are checked against the traces of the state matrix and its square.
    pub fn poles(&mut self, model: &Model, poles: &mut Vec<c64>) -> Result<(), Error> {
        poles.clear();
        self.build_state(model)?;
        let (trace, trace_of_square) = traces(&self.state);
        // Balancing compares norms of rows and columns, and would halve an infinite one for ever;
        // where their sum of squares is finite they all are, and balancing only lowers it.
        if !self.state.norm_squared().is_finite() {
            return Err(Error::NonFinite("the square of the state matrix"));
        }
        nalgebra::linalg::balancing::balance_parlett_reinsch(&mut self.state);
        let states = self.kept.len();
        let (real, imaginary) = (&mut self.real[..states], &mut self.imaginary[..states]);
        evd::evd_real(
            MatRef::from_column_major_slice(self.state.as_slice(), states, states),
            faer::ColMut::from_slice_mut(real).as_diagonal_mut(),
            faer::ColMut::from_slice_mut(imaginary).as_diagonal_mut(),
            None,
            None,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Spec::<EvdParams, f64>::default(),
        )
        .map_err(|_| Error::NoConvergence)?;
        let (real, imaginary) = (&self.real[..states], &self.imaginary[..states]);
        let all = || real.iter().zip(imaginary).map(|(re, im)| c64::new(*re, *im));
        if !all().all(|s| s.re.is_finite() && s.im.is_finite()) {
            return Err(Error::NonFinite("a pole"));
        }
        let bound = TRACE_FACTOR * states as f64 * f64::EPSILON;
        let sums = all().fold((0.0, 0.0, 0.0, 0.0), |(a, b, c, d), s| {
            (a + s.re, b + s.re * s.re - s.im * s.im, c + s.norm(), d + s.norm_sqr())
        });
        for (what, error) in [
            ("the sum", (sums.0 - trace).abs() / sums.2),
            ("the sum of squares", (sums.1 - trace_of_square).abs() / sums.3),
        ] {
            if !(error <= bound) {
                return Err(Error::Trace { what, error, bound });
            }
        }
        // The error of a pole is a modest multiple of n ε times the greatest one.
        let greatest = all().map(|s| s.norm()).fold(0.0, f64::max);
        let told = |s: &c64| s.norm() >= bound * greatest;
        if all().filter(|s| !told(s)).count() > model.at_origin {
            let least = all().map(|s| s.norm()).fold(f64::INFINITY, f64::min);
            return Err(Error::Spread { least, greatest });
        }
        poles.extend(all().filter(|s| s.im >= 0.0 && told(s)));
        poles.sort_by(|a, b| a.im.total_cmp(&b.im).then(a.re.total_cmp(&b.re)));
        Ok(())
    }

    /// The state matrix A of `ẋ = A x`, x = [q, q̇, x_a] without the null states, square,
    /// column-major, in SI units.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn state_matrix(&mut self, model: &Model) -> Result<&DMatrix<f64>, Error> {
        self.build_state(model)?;
        Ok(&self.state)
    }

    /// The state space of the model driven by `E w` on its right-hand side (`inputs` is E, coordinates ×
    /// inputs) with the outputs `rows`, linear in coordinates or rates, which read no null state.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn state_space(
        &mut self,
        model: &Model,
        inputs: &DMatrix<f64>,
        rows: &[Row],
    ) -> Result<StateSpace, Error> {
        let n = model.second_order;
        self.build_state(model)?;
        let mut accelerations = Mat::from_fn(n, inputs.ncols(), |i, j| inputs[(i, j)]);
        llt::solve::solve_in_place(
            self.factor.as_ref().submatrix(0, 0, n, n),
            accelerations.as_mut(),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        let b =
            DMatrix::from_fn(self.kept.len(), inputs.ncols(), |row, input| match self.kept[row] {
                state if state < n => 0.0,
                state if state < 2 * n => accelerations[(state - n, input)],
                state => inputs[(state - n, input)],
            });
        let mut c = DMatrix::zeros(rows.len(), self.kept.len());
        for (output, row) in rows.iter().enumerate() {
            for &(coordinate, factor) in &row.entries {
                let state = coordinate + if row.rate { n } else { 0 };
                let kept = self.kept.binary_search(&state);
                c[(output, kept.expect("outputs read no null state"))] += factor;
            }
        }
        let d = DMatrix::zeros(rows.len(), inputs.ncols());
        Ok(StateSpace { a: self.state.clone(), b, c, d })
    }

    /// `A = [[0, 1, 0], [−M⁻¹K, −M⁻¹D, −M⁻¹K_qa], [−K_aq, −D_aq, −K_aa]]` without the rows and columns of
    /// the null states, which nothing else reads.
    fn build_state(&mut self, model: &Model) -> Result<(), Error> {
        let (size, n) = (self.coordinates, model.second_order);
        assert_eq!(model.coordinates(), size, "the solver was made for another size");
        if !model.is_finite() {
            return Err(Error::NonFinite("the model"));
        }
        let mut factor = self.factor.as_mut().submatrix_mut(0, 0, n, n);
        factor.copy_from(model.mass.as_ref().submatrix(0, 0, n, n));
        llt::factor::cholesky_in_place(
            factor.as_mut(),
            llt::factor::LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Spec::<llt::factor::LltParams, f64>::default(),
        )
        .map_err(|error| {
            let llt::factor::LltError::NonPositivePivot { index } = error;
            Error::SingularMass { pivot: index }
        })?;
        // Columns [K_qq, D_qq, K_qa], in the order of the states.
        let mut right_side = self.right_side.as_mut().submatrix_mut(0, 0, n, n + size);
        let rows = |matrix: &'_ Mat<f64>, from: usize, count: usize, mut to: MatMut<'_, f64>| {
            to.copy_from(matrix.as_ref().submatrix(0, from, n, count));
        };
        rows(&model.stiffness, 0, n, right_side.as_mut().subcols_mut(0, n));
        rows(&model.damping, 0, n, right_side.as_mut().subcols_mut(n, n));
        rows(&model.stiffness, n, size - n, right_side.as_mut().subcols_mut(2 * n, size - n));
        llt::solve::solve_in_place(
            factor.as_ref(),
            right_side.as_mut(),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        self.kept.clear();
        self.kept.extend((0..n + size).filter(|state| !model.null_states.contains(state)));
        let states = self.kept.len();
        if self.state.nrows() != states {
            self.state = DMatrix::zeros(states, states);
        }
        for (column, &from) in self.kept.iter().enumerate() {
            for (row, &to) in self.kept.iter().enumerate() {
                self.state[(row, column)] = if to < n {
                    f64::from(u8::from(from == n + to))
                } else if to < 2 * n {
                    -right_side[(to - n, from)]
                } else if from < n {
                    -model.stiffness[(to - n, from)]
                } else if from < 2 * n {
                    -model.damping[(to - n, from - n)]
                } else {
                    -model.stiffness[(to - n, from - n)]
                };
            }
        }
        // Less the null motion v: of z = z̃ + v z_j/v_j only z̃ acts, and z̃_i = z_i − v_i z_j/v_j changes.
        let Some(motion) = &model.null_motion else { return Ok(()) };
        for &(other, ratio) in &motion.others {
            let Some(row) = self.kept.iter().position(|state| *state == other) else { continue };
            for (column, &from) in self.kept.iter().enumerate() {
                // The row of the state left out: of a position, its rate.
                let rate = match motion.state.checked_sub(n) {
                    Some(acceleration) => -right_side[(acceleration, from)],
                    None => f64::from(u8::from(from == n + motion.state)),
                };
                self.state[(row, column)] -= ratio * rate;
            }
        }
        Ok(())
    }

    /// Right and left eigenvectors at `pole` by inverse iteration on `L(s)`.
    ///
    /// For a repeated pole any vector of the eigenspace may come back.
    pub fn pair(&mut self, model: &Model, pole: c64) -> Pair {
        self.fill_pencil(model, pole);
        self.pencil.factor();
        // A start with no structure that could be orthogonal to the vector sought.
        let start =
            (0..self.coordinates).map(|row| c64::new(1.0 + 0.5 * (row as f64 + 1.0).sin(), 0.0));
        self.right.clear();
        self.right.extend(start);
        self.left.clone_from(&self.right);
        for _ in 0..2 {
            self.pencil.solve(&mut self.right);
            self.pencil.solve_adjoint(&mut self.left);
            for vector in [&mut self.right, &mut self.left] {
                let scale = norm(vector).recip();
                vector.iter_mut().for_each(|z| *z *= scale);
            }
        }
        self.pair_of(model, pole)
    }

    /// The pair of vectors found elsewhere, `yᵀ L = 0`, judged as those of [`Solver::pair`] are.
    pub fn judge(&mut self, model: &Model, pole: c64, [right, left]: &[Vec<c64>; 2]) -> Pair {
        self.weigh(model, pole);
        let scaled = |vector: &[c64], to: &mut Vec<c64>, scale: &[f64]| {
            to.clear();
            to.extend(vector.iter().zip(scale).map(|(z, scale)| z / *scale));
            let unit = norm(to).recip();
            to.iter_mut().for_each(|z| *z *= unit);
        };
        scaled(right, &mut self.right, &self.scale);
        scaled(left, &mut self.left, &self.scale);
        self.left.iter_mut().for_each(|z| *z = z.conj());
        self.pair_of(model, pole)
    }

    /// The pair of the scaled vectors at hand.
    fn pair_of(&self, model: &Model, pole: c64) -> Pair {
        let (residual, bound) = self.residual(model, pole);
        let unscaled = |vector: &[c64]| {
            let scaled = || vector.iter().zip(&self.scale).map(|(z, scale)| z * *scale);
            let norm = scaled().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
            scaled().map(|z| z / norm).collect()
        };
        Pair { pole, right: unscaled(&self.right), left: unscaled(&self.left), residual, bound }
    }

    /// Powers of two S that bring the diagonal of `S (|M||s|² + |D||s| + |K|) S` near one: coordinates of metres,
    /// radians and states are told apart by their equations, not by their units.
    fn weigh(&mut self, model: &Model, s: c64) {
        let modulus = s.norm();
        for (i, scale) in self.scale.iter_mut().enumerate() {
            let at = (i, i);
            let size = model.mass[at].abs() * modulus * modulus
                + model.damping[at].abs() * modulus
                + model.stiffness[at].abs();
            let power = (-0.5 * size.log2()).round();
            *scale = if power.is_finite() { power.exp2() } else { 1.0 };
        }
    }

    /// Fills the pencil with `S L(s) S`.
    fn fill_pencil(&mut self, model: &Model, s: c64) {
        self.weigh(model, s);
        let square = s * s;
        for (column, of_column) in self.scale.iter().enumerate() {
            let entries = self.scale.iter().zip(model.column(column));
            let entries =
                entries.map(|(of_row, [m, d, k])| (square * m + s * d + k) * (of_row * of_column));
            self.pencil.set_column(column, entries);
        }
    }

    /// Relative residual of the vectors found and the bound of the pole, see [`Pair`].
    fn residual(&self, model: &Model, s: c64) -> (f64, f64) {
        let n = model.coordinates();
        let modulus = s.norm();
        let mut rows = vec![c64::new(0.0, 0.0); n];
        let mut columns = rows.clone();
        let mut sums = [0.0_f64; 3];
        let mut derivative = c64::new(0.0, 0.0);
        for (column, (of_column, right)) in self.scale.iter().zip(&self.right).enumerate() {
            let (mut to_column, mut by_column) = (c64::new(0.0, 0.0), c64::new(0.0, 0.0));
            let lines = rows.iter_mut().zip(&self.left).zip(&self.scale);
            for (((to_row, left), of_row), values) in lines.zip(model.column(column)) {
                let [m, d, k] = values.map(|value| value * (of_row * of_column));
                let (linear, left) = (s * m + d, left.conj());
                let entry = s * linear + k;
                *to_row += entry * right;
                to_column += left * entry;
                by_column += left * (s * m + linear);
                sums = [sums[0] + m * m, sums[1] + d * d, sums[2] + k * k];
            }
            columns[column] = to_column;
            derivative += by_column * right;
        }
        let [m, d, k] = sums.map(f64::sqrt);
        let size = m * modulus * modulus + d * modulus + k;
        // Both vectors have unit norm; rounding of L x itself is no less than ε of its size.
        let bound = (norm(&rows) + n as f64 * f64::EPSILON * size) / derivative.norm();
        (norm(&rows).hypot(norm(&columns)) / size, bound)
    }
}

/// Euclidean norm.
fn norm(v: &[c64]) -> f64 {
    v.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt()
}

/// Trace of the matrix and of its square.
fn traces(matrix: &DMatrix<f64>) -> (f64, f64) {
    let n = matrix.nrows();
    let mut square = 0.0;
    for i in 0..n {
        for j in 0..n {
            square += matrix[(i, j)] * matrix[(j, i)];
        }
    }
    (matrix.trace(), square)
}
