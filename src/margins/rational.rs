//! A loop given as a ratio of polynomials with a delay.
//!
//! For loops that stand alone; those of a vehicle come from its model.

use crate::modal::Response;
use nalgebra::{Complex, DMatrix};

/// `L(s) = N(s)/(s^k D(s)) e^{−sτ}`, D(0) ≠ 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Rational {
    numerator: Vec<f64>,
    denominator: Vec<f64>,
    integrators: i32,
    delay_s: f64,
}

/// Why coefficients are no loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A coefficient or the delay is not finite, or the delay is below zero.
    #[error("coefficients must be finite, and the delay finite and not below zero")]
    NotFinite,
    /// The denominator is zero or empty.
    #[error("the denominator must have a coefficient other than zero")]
    NoDenominator,
    /// The numerator has the higher degree.
    #[error("the degree of the numerator must not exceed that of the denominator")]
    Improper,
    /// The closed loop has a pole at zero.
    #[error("the closed loop has a pole at zero: numerator and denominator add up to 0 there")]
    ClosedAtZero,
    /// The roots of the denominator were not found.
    #[error("the roots of the denominator were not found")]
    NoConvergence,
}

impl Rational {
    /// A loop from the coefficients of numerator and denominator, highest power first, and a delay, s.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn new(numerator: &[f64], denominator: &[f64], delay_s: f64) -> Result<Self, Error> {
        let finite = numerator.iter().chain(denominator).all(|value| value.is_finite());
        if !(finite && delay_s >= 0.0 && delay_s.is_finite()) {
            return Err(Error::NotFinite);
        }
        let leading = |coefficients: &[f64]| {
            let zeros = coefficients.iter().take_while(|value| **value == 0.0).count();
            coefficients[zeros..].to_vec()
        };
        let (numerator, mut denominator) = (leading(numerator), leading(denominator));
        if denominator.is_empty() {
            return Err(Error::NoDenominator);
        }
        if numerator.len() > denominator.len() {
            return Err(Error::Improper);
        }
        let mut integrators = 0;
        while denominator.last() == Some(&0.0) {
            denominator.pop();
            integrators += 1;
        }
        Ok(Self { numerator, denominator, integrators, delay_s })
    }

    /// L at the complex frequency `s`, rad/s.
    pub fn at(&self, s: Complex<f64>) -> Complex<f64> {
        let horner = |coefficients: &[f64]| {
            coefficients.iter().fold(Complex::default(), |sum: Complex<f64>, c| sum * s + c)
        };
        let ratio =
            horner(&self.numerator) / (horner(&self.denominator) * s.powi(self.integrators));
        if self.delay_s == 0.0 { ratio } else { ratio * (-s * self.delay_s).exp() }
    }

    /// Frequencies between which everything happens, rad/s: a millionth of the smallest and a thousand times
    /// the largest modulus of the poles and zeros of the loop, of those of `D + N` and `D − N`, and of 1/τ.
    ///
    /// # Errors
    /// [`Error::NoConvergence`], and [`Error::ClosedAtZero`] for a closed loop with a pole at zero.
    pub fn frequencies_rad_s(&self) -> Result<[f64; 2], Error> {
        let mut whole = self.denominator.clone();
        whole.resize(whole.len() + self.integrators as usize, 0.0);
        let first = whole.len() - self.numerator.len();
        let combined = |sign: f64| -> Vec<f64> {
            let added = |i: usize| i.checked_sub(first).map_or(0.0, |at| sign * self.numerator[at]);
            whole.iter().enumerate().map(|(i, d)| d + added(i)).collect()
        };
        let closed = combined(1.0);
        if closed.last() == Some(&0.0) {
            return Err(Error::ClosedAtZero);
        }
        let mut moduli = Vec::new();
        for polynomial in [self.numerator.clone(), whole.clone(), closed, combined(-1.0)] {
            // The roots of a polynomial are the poles of its inverse.
            let leading = polynomial.iter().take_while(|value| **value == 0.0).count();
            if leading < polynomial.len() {
                let inverse = Self::new(&[], &polynomial[leading..], 0.0)?;
                moduli.extend(inverse.poles()?.iter().map(|root| root.norm()));
            }
        }
        moduli.extend((self.delay_s > 0.0).then(|| self.delay_s.recip()));
        moduli.retain(|modulus| *modulus > 0.0 && modulus.is_finite());
        let smallest = moduli.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = moduli.iter().copied().fold(0.0, f64::max);
        Ok(if moduli.is_empty() { [1e-6, 1e3] } else { [1e-6 * smallest, 1e3 * largest] })
    }

    /// The poles that are not zero, one of each complex pair: eigenvalues of the companion matrix.
    ///
    /// # Errors
    /// [`Error::NoConvergence`].
    pub fn poles(&self) -> Result<Vec<Complex<f64>>, Error> {
        let n = self.denominator.len() - 1;
        let companion = DMatrix::from_fn(n, n, |row, column| match row {
            0 => -self.denominator[column + 1] / self.denominator[0],
            _ => f64::from(u8::from(column + 1 == row)),
        });
        let empty = (DMatrix::zeros(n, 0), DMatrix::zeros(0, n), DMatrix::zeros(0, 0));
        Response::new(&companion, &empty.0, &empty.1, &empty.2)
            .and_then(|response| response.poles())
            .map_err(|_| Error::NoConvergence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_do_not_depend_on_the_unit_of_time() {
        use crate::margins::{Settings, assess};
        use nalgebra::{Matrix3, Vector3};
        let found = |scale: f64| {
            let scaled = |list: &[f64]| -> Vec<f64> {
                let power = |i: usize| scale.powi(i as i32 + 1 - list.len() as i32);
                list.iter().enumerate().map(|(i, c)| c * power(i)).collect()
            };
            let loops = Rational::new(&[25.0], &scaled(&[1.0, 10.0, 10.0, 10.0]), 0.01 / scale);
            let loops = loops.unwrap();
            let [lowest, highest] = loops.frequencies_rad_s().unwrap();
            let settings = Settings {
                lowest_hz: lowest / std::f64::consts::TAU,
                highest_hz: highest / std::f64::consts::TAU,
                ..Settings::default()
            };
            let zero = Complex::default();
            let one =
                |s: &Complex<f64>| Matrix3::from_diagonal(&Vector3::new(loops.at(*s), zero, zero));
            let g = |points: &[Complex<f64>]| points.iter().map(one).collect();
            let margins = assess(g, &loops.poles().unwrap(), &[], &[], &settings).unwrap().axes[0];
            [
                margins.gain_high_db.value,
                margins.phase_deg.value,
                margins.disk.value,
                margins.phase_deg.omega_rad_s.unwrap() / scale,
            ]
        };
        let here = found(1.0);
        assert!(here[0] > 0.0 && here[0] < 40.0, "{here:?}");
        for scale in [1e-8, 1e8] {
            for (here, there) in here.iter().zip(found(scale)) {
                assert!((here - there).abs() < 1e-6 * here, "{here} {there} at {scale}");
            }
        }
    }

    #[test]
    fn a_closed_loop_with_a_pole_at_zero_is_refused() {
        let loops = Rational::new(&[-1.0], &[1.0, 1.0], 0.0).unwrap();
        assert_eq!(loops.frequencies_rad_s(), Err(Error::ClosedAtZero));
    }

    #[test]
    fn a_ratio_is_evaluated_with_its_delay_and_poles_at_zero() {
        let loops = Rational::new(&[0.0, 2.0, 1.0], &[1.0, 3.0, 2.0, 0.0, 0.0], 0.3).unwrap();
        let s = Complex::new(0.0, 1.7);
        let expected = (2.0 * s + 1.0) / (s * s * (s + 1.0) * (s + 2.0)) * (-s * 0.3).exp();
        assert!((loops.at(s) - expected).norm() < 1e-15);
        let mut poles: Vec<f64> = loops.poles().unwrap().iter().map(|pole| pole.re).collect();
        poles.sort_by(f64::total_cmp);
        assert!((poles[0] + 2.0).abs() < 1e-14 && (poles[1] + 1.0).abs() < 1e-14);
    }

    #[test]
    fn what_is_no_loop_is_refused() {
        assert_eq!(Rational::new(&[1.0], &[0.0], 0.0), Err(Error::NoDenominator));
        assert_eq!(Rational::new(&[1.0, 0.0], &[1.0], 0.0), Err(Error::Improper));
        assert_eq!(Rational::new(&[1.0], &[1.0, f64::NAN], 0.0), Err(Error::NotFinite));
        assert_eq!(Rational::new(&[1.0], &[1.0, 1.0], -0.1), Err(Error::NotFinite));
        // A constant has no poles.
        assert_eq!(Rational::new(&[1.0], &[2.0], 0.0).unwrap().poles(), Ok(vec![]));
    }
}
