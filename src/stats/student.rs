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
    // Terms cos θ · 2/3 cos²θ · 4/5 cos²θ … (odd ν) or 1 · 1/2 cos²θ · 3/4 cos²θ … (even ν).
    let mut term = if odd { cosine } else { 1.0 };
    let mut sum = 0.0;
    // Γ((ν+1)/2)/Γ(ν/2), which doubles as the derivative's factor, grows by (ν+1)/ν every two ν.
    let mut factor = if odd { std::f64::consts::FRAC_2_PI } else { 1.0 };
    let first = if odd { 1 } else { 2 };
    for nu in (first..freedom).step_by(2) {
        let nu = nu as f64;
        sum += term;
        term *=
            square * (nu + if odd { 1.0 } else { -1.0 + 0.0 }) / (nu + if odd { 2.0 } else { 0.0 });
        factor *= (nu + 1.0) / nu;
    }
    let probability =
        if odd { std::f64::consts::FRAC_2_PI * (theta + sine * sum) } else { sine * (sum + term) };
    (probability, factor * cosine.powi(freedom as i32 - 1))
}

/// The t that is exceeded with probability `risk` (below one half), `freedom` at least 1.
pub(super) fn upper_point(freedom: u64, risk: f64) -> f64 {
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
