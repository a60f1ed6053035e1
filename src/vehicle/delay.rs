//! A pure delay, exactly and by Padé approximation.
//!
//! Where a loop is delayed is known to the autopilot.

use super::StateSpace;
use nalgebra::{Complex, DMatrix};

/// Highest order of a Padé approximation; at any frequency of interest a higher one adds nothing.
pub const HIGHEST_ORDER: usize = 12;

/// The exact delay `e^(−sτ)` at the complex frequency s, rad/s; `delay_s` is τ, s.
pub fn response(delay_s: f64, s: Complex<f64>) -> Complex<f64> {
    (-s * delay_s).exp()
}

/// The diagonal Padé approximation [n/n] of the delay `delay_s` ≥ 0, s; without states where it is zero.
///
/// It is the stability function of the Gauss method with n stages, `R(z) = 1 + z e₁ᵀ(1 − zX)⁻¹e₁` at
/// z = −sτ, with X tridiagonal: ½ in its first entry and ∓ξ_k beside the diagonal,
/// ξ_k = 1/(2√(4k² − 1)) (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5). Since
/// X + Xᵀ = e₁e₁ᵀ the poles are stable for every order, and no polynomial is formed.
///
/// # Panics
/// If the order is 0 or above [`HIGHEST_ORDER`].
pub fn pade(delay_s: f64, order: usize) -> StateSpace {
    assert!((1..=HIGHEST_ORDER).contains(&order), "a Padé order of {order}");
    if delay_s == 0.0 {
        return StateSpace::gain(DMatrix::from_element(1, 1, 1.0));
    }
    let mut x = DMatrix::zeros(order, order);
    x[(0, 0)] = 0.5;
    for k in 1..order {
        let xi = 0.5 / (4.0 * (k * k) as f64 - 1.0).sqrt();
        x[(k - 1, k)] = -xi;
        x[(k, k - 1)] = xi;
    }
    let inverse = x.try_inverse().expect("its symmetric part and its chain make X regular");
    // R = 1 − e₁ᵀX⁻¹e₁ + e₁ᵀX⁻¹(sτ + X⁻¹)⁻¹X⁻¹e₁, where the first two terms add to ±1.
    let direct = if order.is_multiple_of(2) { 1.0 } else { -1.0 };
    StateSpace {
        b: inverse.columns(0, 1) / delay_s,
        c: inverse.rows(0, 1).into_owned(),
        a: inverse / -delay_s,
        d: DMatrix::from_element(1, 1, direct),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `Σ c_k (∓z)^k`, c_k = (2n−k)! n! / ((2n)! k! (n−k)!).
    fn ratio(order: usize, z: Complex<f64>) -> Complex<f64> {
        let mut coefficient = 1.0;
        let (mut above, mut below) = (Complex::new(1.0, 0.0), Complex::new(1.0, 0.0));
        let mut power = Complex::new(1.0, 0.0);
        for k in 1..=order {
            coefficient *= (order + 1 - k) as f64 / (k as f64 * (2 * order + 1 - k) as f64);
            power *= z;
            above += power * coefficient * if k % 2 == 0 { 1.0 } else { -1.0 };
            below += power * coefficient;
        }
        above / below
    }

    #[test]
    fn the_approximation_is_the_ratio_of_the_pade_polynomials() {
        for order in 1..=HIGHEST_ORDER {
            for omega in [0.0, 1.0, 10.0, 60.0] {
                let s = Complex::new(0.0, omega);
                let found = pade(0.06, order).response(s).unwrap()[(0, 0)];
                assert!((found - ratio(order, s * 0.06)).norm() < 1e-12, "{order} {omega}");
                assert!((found.norm() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn every_order_is_stable_and_better_than_the_one_before() {
        let s = Complex::new(0.0, 2.0 * std::f64::consts::TAU);
        let mut last = f64::INFINITY;
        for order in 1..=6 {
            let system = pade(0.06, order);
            assert!(system.poles().unwrap().iter().all(|p| p.re < 0.0));
            let error = (system.response(s).unwrap()[(0, 0)] - response(0.06, s)).norm();
            assert!(error < last);
            last = error;
        }
        assert!(last < 1e-12);
    }

    #[test]
    fn no_delay_has_no_states() {
        assert_eq!(pade(0.0, 4).order(), 0);
        assert_eq!(pade(0.0, 4).d[(0, 0)], 1.0);
    }
}
