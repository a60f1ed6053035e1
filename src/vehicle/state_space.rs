//! A linear time-invariant system `ẋ = A x + B u`, `y = C x + D u`.
//!
//! It holds numbers; names of inputs and outputs are known to those who connect systems.

use nalgebra::{Complex, DMatrix};

/// Most sweeps of the QR iteration, far more than the few a pole that any matrix needs.
const MOST_SWEEPS: usize = 10_000;

/// The four matrices of a system, SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// A, states × states.
    pub a: DMatrix<f64>,
    /// B, states × inputs.
    pub b: DMatrix<f64>,
    /// C, outputs × states.
    pub c: DMatrix<f64>,
    /// D, outputs × inputs.
    pub d: DMatrix<f64>,
}

impl StateSpace {
    /// A system without states.
    pub fn gain(d: DMatrix<f64>) -> Self {
        let (outputs, inputs) = d.shape();
        Self {
            a: DMatrix::zeros(0, 0),
            b: DMatrix::zeros(0, inputs),
            c: DMatrix::zeros(outputs, 0),
            d,
        }
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.d.ncols()
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.d.nrows()
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        [&self.a, &self.b, &self.c, &self.d].iter().all(|m| m.iter().all(|x| x.is_finite()))
    }

    /// Eigenvalues of A, rad/s; `None` where it is not finite or the iteration does not converge.
    pub fn poles(&self) -> Option<Vec<Complex<f64>>> {
        if self.order() == 0 {
            return Some(Vec::new());
        }
        // The QR iteration loops for ever on NaN.
        if !self.is_finite() {
            return None;
        }
        let mut a = self.a.clone();
        nalgebra::linalg::balancing::balance_parlett_reinsch(&mut a);
        let schur = nalgebra::linalg::Schur::try_new(a, f64::EPSILON, MOST_SWEEPS)?;
        Some(schur.complex_eigenvalues().iter().copied().collect())
    }

    /// Frequency response `C (s 1 − A)⁻¹ B + D`, outputs × inputs; `None` at a pole.
    pub fn response(&self, s: Complex<f64>) -> Option<DMatrix<Complex<f64>>> {
        let complex = |m: &DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
        if self.order() == 0 {
            return Some(complex(&self.d));
        }
        let mut pencil = complex(&-&self.a);
        for i in 0..self.order() {
            pencil[(i, i)] += s;
        }
        Some(complex(&self.c) * pencil.lu().solve(&complex(&self.b))? + complex(&self.d))
    }

    /// The system whose input passes this one and then `next`.
    ///
    /// # Panics
    /// If `next` has not as many inputs as this one has outputs.
    pub fn then(&self, next: &Self) -> Self {
        let (n, m) = (self.order(), next.order());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((n, 0), (m, n)).copy_from(&(&next.b * &self.c));
        a.view_mut((n, n), (m, m)).copy_from(&next.a);
        let mut b = DMatrix::zeros(n + m, self.inputs());
        b.rows_mut(0, n).copy_from(&self.b);
        b.rows_mut(n, m).copy_from(&(&next.b * &self.d));
        let mut c = DMatrix::zeros(next.outputs(), n + m);
        c.columns_mut(0, n).copy_from(&(&next.d * &self.c));
        c.columns_mut(n, m).copy_from(&next.c);
        Self { a, b, c, d: &next.d * &self.d }
    }

    /// The sum of this system and `other`, side by side on the same inputs.
    ///
    /// # Panics
    /// If they differ in inputs or outputs.
    pub fn beside(&self, other: &Self) -> Self {
        let (n, m) = (self.order(), other.order());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((n, n), (m, m)).copy_from(&other.a);
        let mut b = DMatrix::zeros(n + m, self.inputs());
        b.rows_mut(0, n).copy_from(&self.b);
        b.rows_mut(n, m).copy_from(&other.b);
        let mut c = DMatrix::zeros(self.outputs(), n + m);
        c.columns_mut(0, n).copy_from(&self.c);
        c.columns_mut(n, m).copy_from(&other.c);
        Self { a, b, c, d: &self.d + &other.d }
    }

    /// The system with its inputs made as `weights · u` of others.
    pub fn after(mut self, weights: &DMatrix<f64>) -> Self {
        self.b *= weights;
        self.d *= weights;
        self
    }

    /// The system with all outputs multiplied by `gain`, and every time constant by `time_scale`:
    /// `gain · G(time_scale · s)`.
    pub fn scaled(&self, gain: f64, time_scale: f64) -> Self {
        Self {
            a: &self.a / time_scale,
            b: &self.b / time_scale,
            c: &self.c * gain,
            d: &self.d * gain,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    /// `ω²/(s² + 2ζωs + ω²)`.
    fn second_order(omega: f64, zeta: f64) -> StateSpace {
        StateSpace {
            a: dmatrix![0.0, omega; -omega, -2.0 * zeta * omega],
            b: dmatrix![0.0; omega],
            c: dmatrix![1.0, 0.0],
            d: dmatrix![0.0],
        }
    }

    /// `(s + z)/(s + p)`.
    fn lead(z: f64, p: f64) -> StateSpace {
        StateSpace { a: dmatrix![-p], b: dmatrix![1.0], c: dmatrix![z - p], d: dmatrix![1.0] }
    }

    #[test]
    fn a_response_is_that_of_the_transfer_function() {
        let (omega, zeta) = (32.0, 0.1);
        for w in [0.0, 3.0, 32.0, 900.0] {
            let s = Complex::new(0.0, w);
            let expected = omega * omega / (s * s + s * (2.0 * zeta * omega) + omega * omega);
            let found = second_order(omega, zeta).response(s).unwrap()[(0, 0)];
            assert!((found - expected).norm() <= 1e-14 * expected.norm(), "{w}");
        }
        assert_eq!(lead(1.0, 0.0).response(Complex::new(0.0, 0.0)), None);
    }

    #[test]
    fn a_series_multiplies_responses_and_joins_poles() {
        let (first, second) = (second_order(10.0, 0.3), lead(2.0, 50.0));
        let both = first.then(&second);
        let s = Complex::new(-0.2, 11.0);
        let product = first.response(s).unwrap()[(0, 0)] * second.response(s).unwrap()[(0, 0)];
        assert!((both.response(s).unwrap()[(0, 0)] - product).norm() < 1e-14);
        let mut poles = both.poles().unwrap();
        poles.sort_by(|a, b| a.re.total_cmp(&b.re));
        assert!((poles[0] - Complex::new(-50.0, 0.0)).norm() < 1e-12);
        assert!((poles[1].re + 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_scaled_system_is_faster_by_its_time_scale() {
        let system = second_order(10.0, 0.3);
        let s = Complex::new(0.0, 7.0);
        let expected = system.response(s * 0.5).unwrap()[(0, 0)] * 3.0;
        assert!((system.scaled(3.0, 0.5).response(s).unwrap()[(0, 0)] - expected).norm() < 1e-14);
    }

    #[test]
    fn a_system_that_is_not_finite_has_no_poles() {
        assert_eq!(second_order(f64::NAN, 0.1).poles(), None);
        assert_eq!(StateSpace::gain(dmatrix![2.0, 3.0]).poles(), Some(Vec::new()));
    }
}
