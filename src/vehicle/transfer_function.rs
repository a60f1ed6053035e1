//! A proper rational transfer function and its realisation with states.
//!
//! What it stands for, a filter or an actuator, is known to others.

use super::StateSpace;
use nalgebra::{Complex, DMatrix};

/// Why two polynomials are no proper transfer function.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A coefficient is NaN or infinite.
    #[error("a coefficient that is not finite")]
    NonFinite,
    /// Every coefficient of the denominator is zero.
    #[error("a denominator without a coefficient that is not zero")]
    ZeroDenominator,
    /// More zeros than poles.
    #[error("a numerator of degree {numerator} over a denominator of degree {denominator}")]
    Improper {
        /// Degree of the numerator.
        numerator: usize,
        /// Degree of the denominator.
        denominator: usize,
    },
}

/// A proper ratio of polynomials in s, with real coefficients in falling powers.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    /// As long as the denominator, zeros in front where its degree is less.
    numerator: Vec<f64>,
    /// The first coefficient is not zero.
    denominator: Vec<f64>,
}

impl TransferFunction {
    /// The ratio of two polynomials, coefficients in falling powers of s (s in rad/s); leading zeros
    /// do not count.
    ///
    /// # Errors
    /// See [`Refusal`].
    pub fn new(numerator: &[f64], denominator: &[f64]) -> Result<Self, Refusal> {
        if !numerator.iter().chain(denominator).all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        let trimmed = |list: &[f64]| -> Vec<f64> {
            list.iter().skip_while(|x| **x == 0.0).copied().collect()
        };
        let (above, below) = (trimmed(numerator), trimmed(denominator));
        if below.is_empty() {
            return Err(Refusal::ZeroDenominator);
        }
        if above.len() > below.len() {
            return Err(Refusal::Improper {
                numerator: above.len() - 1,
                denominator: below.len() - 1,
            });
        }
        let mut numerator = vec![0.0; below.len() - above.len()];
        numerator.extend(above);
        Ok(Self { numerator, denominator: below })
    }

    /// Number of poles.
    pub fn order(&self) -> usize {
        self.denominator.len() - 1
    }

    /// Its value at the complex frequency s, rad/s.
    pub fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let value = |list: &[f64]| {
            list.iter().fold(Complex::new(0.0, 0.0), |sum, coefficient| sum * s + coefficient)
        };
        value(&self.numerator) / value(&self.denominator)
    }

    /// Number of poles at exactly zero.
    pub fn poles_at_origin(&self) -> usize {
        self.denominator.iter().rev().take_while(|x| **x == 0.0).count()
    }

    /// Poles, rad/s; those at zero exactly so. `None` where they cannot be found.
    pub fn poles(&self) -> Option<Vec<Complex<f64>>> {
        let zeros = self.poles_at_origin();
        let rest = Self::new(&[1.0], &self.denominator[..self.denominator.len() - zeros]).ok()?;
        let mut poles = rest.state_space().poles()?;
        poles.extend(vec![Complex::new(0.0, 0.0); zeros]);
        Some(poles)
    }

    /// A realisation: the companion form in the time scale of the poles, balanced.
    ///
    /// With `s = ω₀ p`, ω₀ the geometric mean of the moduli of the poles that are not zero, the
    /// coefficients of p are near one where the poles are near each other, and so are the states.
    pub fn state_space(&self) -> StateSpace {
        let n = self.order();
        let leading = self.denominator[0];
        let last = self.denominator.iter().rposition(|x| *x != 0.0).unwrap_or(0);
        let scale = match last {
            0 => 1.0,
            _ => (self.denominator[last] / leading).abs().powf(1.0 / last as f64),
        };
        // Coefficient of the power n − i of p, over the leading one.
        let scaled = |list: &[f64]| -> Vec<f64> {
            let at = |(i, x): (usize, &f64)| x / leading / scale.powi(i as i32);
            list.iter().enumerate().map(at).collect()
        };
        let (above, below) = (scaled(&self.numerator), scaled(&self.denominator));
        let direct = above[0];
        let mut a = DMatrix::zeros(n, n);
        let mut b = DMatrix::zeros(n, 1);
        let mut c = DMatrix::zeros(1, n);
        for state in 0..n {
            if state + 1 < n {
                a[(state, state + 1)] = scale;
            }
            a[(n - 1, state)] = -scale * below[n - state];
            c[(0, state)] = above[n - state] - direct * below[n - state];
        }
        if n > 0 {
            b[(n - 1, 0)] = scale;
            if a.iter().chain(c.iter()).all(|x| x.is_finite()) {
                let by = nalgebra::linalg::balancing::balance_parlett_reinsch(&mut a);
                for state in 0..n {
                    b[(state, 0)] /= by[state];
                    c[(0, state)] *= by[state];
                }
            }
        }
        StateSpace { a, b, c, d: DMatrix::from_element(1, 1, direct) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_realised(numerator: &[f64], denominator: &[f64], tolerance: f64) {
        let function = TransferFunction::new(numerator, denominator).unwrap();
        let system = function.state_space();
        assert_eq!(system.order(), function.order());
        for omega in [0.1, 1.0, 7.0, 31.0, 400.0, 1e4] {
            let s = Complex::new(0.0, omega);
            let (found, expected) = (system.response(s).unwrap()[(0, 0)], function.response(s));
            assert!((found - expected).norm() <= tolerance * expected.norm(), "{omega}");
        }
    }

    #[test]
    fn a_realisation_has_the_response_of_the_ratio() {
        assert_realised(&[3.0], &[2.0], 1e-15);
        assert_realised(&[1.0], &[0.05, 1.0], 1e-15);
        assert_realised(&[2.0, 0.0, 5.0], &[0.0, 1.0, 0.6, 9.0], 1e-13);
        assert_realised(&[1.0, 2.0], &[1.0, 4.0, 0.0], 1e-14);
        assert_realised(&[1.0], &[1.0, 0.0, 0.0], 1e-14);
        // Poles from 1 to 1000 rad/s: cancellation costs the ratio of their products.
        assert_realised(&[1.0, 3.0, 1e6], &[1.0, 1111.0, 112_110.0, 1_111_000.0, 1e6], 1e-11);
    }

    #[test]
    fn a_realisation_of_poles_in_one_place_has_entries_of_their_size() {
        // ((s + 40)/40)⁻⁶: coefficients from 2.4e-10 to 1.
        let coefficients: Vec<f64> = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0]
            .iter()
            .enumerate()
            .map(|(i, c)| c / 40_f64.powi(6 - i as i32))
            .collect();
        let system = TransferFunction::new(&[1.0], &coefficients).unwrap().state_space();
        assert!(system.a.amax() < 40.0 * 21.0, "{}", system.a);
        assert!((system.response(Complex::new(0.0, 0.0)).unwrap()[(0, 0)].re - 1.0).abs() < 1e-13);
    }

    #[test]
    fn poles_at_zero_are_exactly_zero() {
        let function = TransferFunction::new(&[1.0], &[1.0, 3.0, 2.0, 0.0]).unwrap();
        let mut poles: Vec<f64> = function.poles().unwrap().iter().map(|p| p.re).collect();
        poles.sort_by(f64::total_cmp);
        assert!((poles[0] + 2.0).abs() < 1e-14 && (poles[1] + 1.0).abs() < 1e-14);
        assert_eq!(poles[2], 0.0);
    }

    #[test]
    fn what_is_no_proper_ratio_is_refused() {
        let refused = |n: &[f64], d: &[f64]| TransferFunction::new(n, d).unwrap_err();
        assert_eq!(
            refused(&[1.0, 0.0, 0.0], &[0.0, 1.0, 2.0]),
            Refusal::Improper { numerator: 2, denominator: 1 }
        );
        assert_eq!(refused(&[1.0], &[0.0, 0.0]), Refusal::ZeroDenominator);
        assert_eq!(refused(&[f64::NAN], &[1.0]), Refusal::NonFinite);
        assert!(TransferFunction::new(&[0.0, 0.0, 1.0], &[1.0]).is_ok());
    }
}
