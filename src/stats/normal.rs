//! The standard normal law as the intervals here need it.

use statrs::function::erf::{erfc, erfc_inv};

/// Φ(x) to ten digits.
pub(super) fn probability(x: f64) -> f64 {
    0.5 * erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

/// The x that is exceeded with probability `risk`.
pub(super) fn upper_point(risk: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inv(2.0 * risk)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_points_are_met() {
        // NIST: Φ⁻¹(0.975) = 1.959963984540054, Φ⁻¹(0.99865) = 2.999976992703393.
        assert!((upper_point(0.025) - 1.959_963_984_540_054).abs() < 1e-14);
        assert!((upper_point(1.0 - 0.99865) - 2.999_976_992_703_393).abs() < 1e-11);
        // The erfc of statrs is good to eleven digits, which is plenty for a bootstrap's level.
        assert!((probability(1.0) - 0.841_344_746_068_542_9).abs() < 1e-10);
    }
}
