//! The standard normal distribution: Φ and its inverse, accurate in both tails.
//!
//! Laws are not known here.

use libm::{erf, erfc};
// The inverses of `statrs` are good to the last digits; its erf and erfc are not used, since their
// rational approximations carry constants cut to ten digits.
use statrs::function::erf::{erf_inv, erfc_inv};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI, SQRT_2};

/// Φ(z), the probability below `z`; relative error below 1e-14 down to the smallest normal
/// number (z ≈ −37.5).
pub fn below(z: f64) -> f64 {
    if z > 0.0 { 1.0 - above(z) } else { above(-z) }
}

/// 1 − Φ(z), the probability above `z`; relative error below 1e-14 up to z ≈ 37.5.
pub fn above(z: f64) -> f64 {
    if z < 0.0 {
        return 1.0 - above(-z);
    }
    // erfc(t) varies as exp(−t²), so that rounding t = z/√2 alone costs a relative z² ε. The
    // factor exp(t² − z²/2) takes it away, with both squares as product and rest.
    let t = z * FRAC_1_SQRT_2;
    let (t_square, z_square) = (t * t, z * z);
    let rest = t.mul_add(t, -t_square) - 0.5 * z.mul_add(z, -z_square);
    let correction = (t_square - 0.5 * z_square) + rest;
    let value = 0.5 * erfc(t);
    // An infinite z has no correction; and below 1 erfc is not of that form, nor does it matter.
    if z > 1.0 && correction.is_finite() { value + value * correction } else { value }
}

/// φ(z), the density.
pub fn density(z: f64) -> f64 {
    FRAC_1_SQRT_2 * 0.5 * FRAC_2_SQRT_PI * (-0.5 * z * z).exp()
}

/// Φ(b) − Φ(a) for a ≤ b, without cancellation where the two lie on different sides of zero or
/// in the same tail.
fn between(a: f64, b: f64) -> f64 {
    if a > 0.0 {
        above(a) - above(b)
    } else if b < 0.0 {
        below(b) - below(a)
    } else {
        0.5 * (erf(b * FRAC_1_SQRT_2) - erf(a * FRAC_1_SQRT_2))
    }
}

/// The z with probability `below` beneath it and `above` over it; the smaller of the two counts,
/// so that neither tail loses digits. Zero where they are equal.
pub fn score(below: f64, above: f64) -> f64 {
    if below == above {
        0.0
    } else if below < above {
        -SQRT_2 * erfc_inv(2.0 * below)
    } else {
        SQRT_2 * erfc_inv(2.0 * above)
    }
}

/// The standard normal law truncated to [a, b].
#[derive(Debug, Clone, PartialEq)]
pub struct Truncated {
    scores: [f64; 2],
    erf: [f64; 2],
    below: [f64; 2],
    above: [f64; 2],
    /// Φ(b) − Φ(a).
    inside: f64,
}

impl Truncated {
    /// Truncated to scores a < b, which may be infinite.
    pub fn new(scores: [f64; 2]) -> Self {
        let erf = scores.map(|z| erf(z * FRAC_1_SQRT_2));
        let inside = between(scores[0], scores[1]);
        Self { scores, erf, below: scores.map(below), above: scores.map(above), inside }
    }

    /// The score with the share `below` of the law's probability beneath it and `above` =
    /// 1 − `below` over it.
    pub fn score(&self, below: f64, above: f64) -> f64 {
        // Φ(z) = above Φ(a) + below Φ(b), written for erf in the middle and for the nearer tail
        // elsewhere: no form subtracts numbers that are nearly equal.
        let mean = |ends: [f64; 2]| above * ends[0] + below * ends[1];
        let middle = mean(self.erf);
        let z = if middle.abs() <= 0.5 {
            SQRT_2 * erf_inv(middle)
        } else if middle < 0.0 {
            -SQRT_2 * erfc_inv(2.0 * mean(self.below))
        } else {
            SQRT_2 * erfc_inv(2.0 * mean(self.above))
        };
        // Rounding of the last digit must not step over a bound; no probability is moved.
        z.clamp(self.scores[0], self.scores[1])
    }

    /// φ(z)/φ(t) times the probability inside, for the score t at which the law stands where a whole
    /// normal law stands at `z`: how fast t follows z.
    pub fn slope(&self, t: f64, z: f64) -> f64 {
        (0.5 * (t - z) * (t + z)).exp() * self.inside
    }

    /// The shares of the law's probability beneath and above the score `z`.
    pub fn tails(&self, z: f64) -> (f64, f64) {
        let [a, b] = self.scores;
        let z = z.clamp(a, b);
        (between(a, z) / self.inside, between(z, b) / self.inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 − Φ(z), evaluated with 40 digits (mpmath `ncdf`).
    #[expect(clippy::excessive_precision, reason = "digits as the reference gives them")]
    const TAIL: [(f64, f64); 12] = [
        (0.5, 0.308_537_538_725_986_896_36),
        (1.0, 0.158_655_253_931_457_051_41),
        (2.0, 0.022_750_131_948_179_207_2),
        (3.0, 0.001_349_898_031_630_094_526_7),
        (5.0, 2.866_515_718_791_939_116_7e-7),
        (8.0, 6.220_960_574_271_784_123_5e-16),
        (10.0, 7.619_853_024_160_526_066e-24),
        (15.0, 3.670_966_199_312_750_885_8e-51),
        (20.0, 2.753_624_118_606_233_695_1e-89),
        (25.0, 3.056_696_706_382_560_916_4e-138),
        (30.0, 4.906_713_927_148_187_059_5e-198),
        (37.0, 5.725_571_222_524_576_822_7e-300),
    ];

    #[test]
    fn both_tails_agree_with_forty_digit_values_to_1e_14() {
        for (z, tail) in TAIL {
            assert!((above(z) / tail - 1.0).abs() < 1e-14, "z = {z}: {:e}", above(z));
            assert_eq!(below(-z), above(z));
            assert_eq!(below(z), 1.0 - above(z));
        }
    }

    #[test]
    fn the_inverse_agrees_with_forty_digit_values_to_1e_14() {
        for (z, tail) in TAIL {
            assert!((score(1.0 - tail, tail) / z - 1.0).abs() < 1e-14, "z = {z}");
            assert_eq!(score(tail, 1.0 - tail), -score(1.0 - tail, tail));
        }
    }

    #[test]
    fn the_inverse_undoes_the_function_over_the_whole_range() {
        // The relative error of p enters z as δz = δp/p · Mills ratio ≤ δp/p.
        for k in -3700..=3700 {
            let z = f64::from(k) / 100.0;
            let back = score(below(z), above(z));
            assert!((back - z).abs() < 2e-14, "z = {z}: {back}");
        }
    }

    #[test]
    fn the_centre_is_exact() {
        assert_eq!(below(0.0), 0.5);
        assert_eq!(above(0.0), 0.5);
        assert_eq!(score(0.5, 0.5), 0.0);
        assert_eq!(Truncated::new([-3.0, 3.0]).score(0.5, 0.5), 0.0);
        assert_eq!(between(-f64::INFINITY, f64::INFINITY), 1.0);
    }

    #[test]
    #[expect(clippy::excessive_precision, reason = "digits as the reference gives them")]
    fn truncated_scores_agree_with_forty_digit_values_far_in_a_tail() {
        // Solved with mpmath's findroot at 40 digits for the double-precision arguments.
        for (u, a, b, z) in [
            (0.5, 30.0, 31.0, 30.023_070_467_827_308_926),
            (0.25, 30.0, 31.0, 30.009_577_257_491_084_983),
            (0.999, 30.0, 31.0, 30.229_130_430_949_585_109),
            (0.5, 8.0, 9.0, 8.084_888_899_018_166_433_3),
            (1.0 / 9_007_199_254_740_992.0, -3.0, 3.0, -2.999_999_999_999_975_016_6),
            (0.3, -1.0, 2.0, -0.242_403_817_889_226_826_23),
        ] {
            let upper = Truncated::new([a, b]).score(u, 1.0 - u);
            let lower = Truncated::new([-b, -a]).score(1.0 - u, u);
            assert!((upper / z - 1.0).abs() < 4e-15, "{u} [{a}, {b}]: {upper}");
            assert!((lower / z + 1.0).abs() < 4e-15, "{u} [{a}, {b}]: {lower}");
        }
    }
}
