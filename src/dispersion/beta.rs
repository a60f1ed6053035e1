//! The beta distribution on (0, 1): both tails and their inverse.
//!
//! Stretching to another interval is done in `law`.

use statrs::function::{beta::beta_reg, gamma::ln_gamma};
use std::ops::RangeInclusive;

/// Shapes for which the continued fraction of the incomplete beta function (140 terms; it needs
/// of the order of the root of the larger shape) has converged.
pub const SHAPES: RangeInclusive<f64> = 0.1..=1000.0;

/// A beta distribution with density t^(α−1) (1−t)^(β−1) / B(α, β).
#[derive(Debug, Clone, PartialEq)]
pub struct Beta {
    alpha: f64,
    beta: f64,
    ln_beta: f64,
}

impl Beta {
    /// Shapes α and β inside [`SHAPES`].
    pub fn new(alpha: f64, beta: f64) -> Self {
        let ln_beta = ln_gamma(alpha) + ln_gamma(beta) - ln_gamma(alpha + beta);
        Self { alpha, beta, ln_beta }
    }

    /// Probability below and above `t`, where `rest` is 1 − t.
    pub fn tails(&self, t: f64, rest: f64) -> (f64, f64) {
        (beta_reg(self.alpha, self.beta, t), beta_reg(self.beta, self.alpha, rest))
    }

    /// The density at `t`, where `rest` is 1 − t.
    pub fn density(&self, t: f64, rest: f64) -> f64 {
        ((self.alpha - 1.0) * t.ln() + (self.beta - 1.0) * rest.ln() - self.ln_beta).exp()
    }

    /// The t with probability `below` beneath and `above` over it, and 1 − t.
    pub fn quantile(&self, below: f64, above: f64) -> (f64, f64) {
        if self.alpha == self.beta && below == above {
            (0.5, 0.5)
        } else if below <= above {
            let t = self.lower(below);
            (t, 1.0 - t)
        } else {
            let mirrored = Self { alpha: self.beta, beta: self.alpha, ln_beta: self.ln_beta };
            let rest = mirrored.lower(above);
            (1.0 - rest, rest)
        }
    }

    /// Solves I_t = p for p ≤ ½ by Newton's method on ln I over ln t, in which I is a straight
    /// line as t → 0; a step out of the bracket is replaced by halving it.
    fn lower(&self, p: f64) -> f64 {
        let Self { alpha, beta, ln_beta } = *self;
        let (mut low, mut high) = (0.0, 1.0);
        // The leading term t^α / (α B) of the series about zero.
        let mut t = ((p.ln() + alpha.ln() + ln_beta) / alpha).exp().min(alpha / (alpha + beta));
        // Halving alone reaches the last digit of the smallest t of interest in far fewer steps.
        for _ in 0..200 {
            if !(low < t && t < high) {
                t = 0.5 * (low + high);
            }
            let value = beta_reg(alpha, beta, t);
            if value < p {
                low = t;
            } else {
                high = t;
            }
            // t · density, the derivative of I with respect to ln t.
            let slope = (alpha * t.ln() + (beta - 1.0) * (-t).ln_1p() - ln_beta).exp();
            let step = (p / value).ln() * value / slope;
            let next = t * step.exp();
            let done =
                (next - t).abs() <= 2.0 * f64::EPSILON * t || high - low <= f64::EPSILON * low;
            t = next;
            if done {
                break;
            }
        }
        t.clamp(low, high)
    }
}
