//! Upper points of Student's t law for any whole number of degrees of freedom.
//!
//! Through the finite trigonometric series, whose terms are all positive: no incomplete beta
//! function whose continued fraction is cut off at many degrees of freedom.

use super::{normal, root};

/// Above this number of degrees of freedom Fisher's expansion is as exact as a double.
const EXPANSION: u64 = 2000;

/// P(|t| ≤ √ν tan θ) and its derivative with respect to θ (Abramowitz and Stegun 26.7.3, 26.7.4).
fn central(freedom: u64, theta: f64) -> (f64, f64) {
    let (sine, cosine) = theta.sin_cos();
    let square = cosine * cosine;
    let odd = freedom % 2 == 1;
    // The series cos θ + 2/3 cos³θ + 2·4/(3·5) cos⁵θ … (odd ν), 1 + 1/2 cos²θ + 1·3/(2·4) cos⁴θ …
    // (even ν), up to cosᵛ⁻²θ; and the factor 2 Γ((ν+1)/2) / (√π Γ(ν/2)) of the derivative.
    let (first, mut term, mut factor) =
        if odd { (1, cosine, std::f64::consts::FRAC_2_PI) } else { (2, 1.0, 1.0) };
    let mut sum = 0.0;
    for nu in (first..freedom).step_by(2) {
        sum += term;
        let below = (if odd { nu + 2 } else { nu }) as f64;
        term *= square * (below - 1.0) / below;
        factor *= (nu + 1) as f64 / nu as f64;
    }
    let probability =
        if odd { std::f64::consts::FRAC_2_PI * (theta + sine * sum) } else { sine * (sum + term) };
    (probability, factor * cosine.powf((freedom - 1) as f64))
}

/// The t that is exceeded with probability `risk`, `freedom` at least 1.
pub(super) fn upper_point(freedom: u64, risk: f64) -> f64 {
    if risk > 0.5 {
        return -upper_point(freedom, 1.0 - risk);
    }
    if freedom > EXPANSION {
        return expansion(freedom, normal::upper_point(risk));
    }
    let target = 1.0 - 2.0 * risk;
    let theta = root::of_increasing(0.0, std::f64::consts::FRAC_PI_2, |theta| {
        let (probability, slope) = central(freedom, theta);
        (probability - target, slope)
    });
    (freedom as f64).sqrt() * theta.tan()
}

/// Fisher's expansion of t in 1/ν about the normal point x (Abramowitz and Stegun 26.7.5).
fn expansion(freedom: u64, x: f64) -> f64 {
    let nu = freedom as f64;
    let s = x * x;
    let g1 = x * (s + 1.0) / 4.0;
    let g2 = x * ((5.0 * s + 16.0) * s + 3.0) / 96.0;
    let g3 = x * (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0;
    let g4 = x * ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92_160.0;
    x + (g1 + (g2 + (g3 + g4 / nu) / nu) / nu) / nu
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_two_and_four_degrees_of_freedom_have_their_closed_forms() {
        for risk in [0.3, 0.05, 0.025, 0.001] {
            let p: f64 = 1.0 - risk;
            let one = (std::f64::consts::PI * (p - 0.5)).tan();
            let alpha = 4.0 * p * (1.0 - p);
            let two = 2.0 * (p - 0.5) * (2.0 / alpha).sqrt();
            let root = alpha.sqrt();
            let four = 2.0 * ((root.acos() / 3.0).cos() / root - 1.0).sqrt();
            for (freedom, exact) in [(1, one), (2, two), (4, four)] {
                let point = upper_point(freedom, risk);
                // The tail is a difference from 1: relative error ε/risk.
                assert!((point / exact - 1.0).abs() < 10.0 * f64::EPSILON / risk, "{freedom}");
            }
        }
    }

    #[test]
    fn lower_points_mirror_upper_ones() {
        for freedom in [1, 6, 5000] {
            assert_eq!(upper_point(freedom, 0.75), -upper_point(freedom, 0.25));
        }
    }

    #[test]
    fn tabulated_points_are_met() {
        // Tables of t to four and more digits (Abramowitz and Stegun 26.10).
        for (freedom, risk, table) in [
            (3, 0.025, 3.182),
            (5, 0.005, 4.032),
            (10, 0.05, 1.812),
            (30, 0.025, 2.042),
            (120, 0.005, 2.617),
        ] {
            assert!((upper_point(freedom, risk) - table).abs() <= 0.5e-3);
        }
    }

    #[test]
    fn series_and_expansion_meet_where_they_change_over() {
        for risk in [0.25, 0.05, 0.025, 0.005, 0.0005] {
            let series = upper_point(EXPANSION, risk);
            let expanded = expansion(EXPANSION, normal::upper_point(risk));
            // The first term left out is of size x¹¹/ν⁵, here under 1e-12; the tail's ε/risk.
            assert!((series / expanded - 1.0).abs() < 1e-12 + 10.0 * f64::EPSILON / risk);
        }
    }
}
