//! An axis: the range of its numbers, where they lie, and its ticks.
//!
//! It knows no pixels: places are fractions of the axis from 0 to 1.

use crate::report::significant;
use statrs::distribution::{ContinuousCDF, Normal};

/// How numbers are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Spacing {
    Linear,
    /// Equal steps for equal ratios.
    Logarithmic,
    /// Numbers are normal scores; ticks are the shares that belong to them, in percent.
    Probability,
}

/// An axis with a label that ends with its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    spacing: Spacing,
}

/// Shares that may be ticks of a probability axis, %.
const SHARES: [f64; 17] = [
    0.001, 0.01, 0.1, 0.5, 1.0, 5.0, 10.0, 25.0, 50.0, 75.0, 90.0, 95.0, 99.0, 99.5, 99.9, 99.99,
    99.999,
];

/// The normal score of a share between 0 and 1.
pub fn probit(share: f64) -> f64 {
    Normal::standard().inverse_cdf(share)
}

/// Least and greatest of the finite numbers, with a little room on either side; never empty.
pub fn room(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let finite = values.into_iter().filter(|value| value.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return [0.0, 1.0];
    }
    let space = 0.04 * (high - low);
    let space = if space > 0.0 { space } else { 0.5 * low.abs().max(1e-12) };
    [low - space, high + space]
}

impl Axis {
    /// Equal steps from `low` to `high`, of which the second is greater.
    pub fn linear(label: impl Into<String>, [low, high]: [f64; 2]) -> Self {
        Self { label: label.into(), low, high, spacing: Spacing::Linear }
    }

    /// Equal ratios from `low` to `high`, both above zero.
    pub fn logarithmic(label: impl Into<String>, [low, high]: [f64; 2]) -> Self {
        Self { label: label.into(), low, high, spacing: Spacing::Logarithmic }
    }

    /// Shares of a population, given as their normal scores.
    pub fn probability(label: impl Into<String>, [low, high]: [f64; 2]) -> Self {
        Self { label: label.into(), low, high, spacing: Spacing::Probability }
    }

    /// The label, with its unit.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// The ends.
    pub fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// Whether steps are equal ratios, equal differences or neither: the word for readers of the
    /// drawing.
    pub(super) fn word(&self) -> &'static str {
        match self.spacing {
            Spacing::Linear => "linear",
            Spacing::Logarithmic => "log",
            Spacing::Probability => "probit",
        }
    }

    /// Where a number lies, 0 at the low end, 1 at the high.
    pub fn place(&self, value: f64) -> f64 {
        match self.spacing {
            Spacing::Linear | Spacing::Probability => (value - self.low) / (self.high - self.low),
            Spacing::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        }
    }

    /// Ticks, about as many as `most`, with their texts.
    pub fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        let inside = |value: &f64| (-1e-9..=1.0 + 1e-9).contains(&self.place(*value));
        match self.spacing {
            Spacing::Linear => {
                let step = step((self.high - self.low) / most.max(1) as f64);
                let first = (self.low / step).ceil() as i64;
                let last = (self.high / step).floor() as i64;
                let digits = (-(step.log10() + 1e-9).floor()).clamp(0.0, 12.0) as usize;
                let plain = step >= 1e-5 && self.low.abs().max(self.high.abs()) < 1e6;
                let text = |value: f64| match plain {
                    true => format!("{:.digits$}", value + 0.0).replace('-', "\u{2212}"),
                    false => significant(value).replace('-', "\u{2212}"),
                };
                let value = |i: i64| if i == 0 { 0.0 } else { i as f64 * step };
                (first..=last).map(|i| (value(i), text(value(i)))).collect()
            }
            Spacing::Logarithmic => {
                let decades = (self.high / self.low).log10();
                let factors: &[f64] = if decades > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
                let exponents = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
                let all = exponents
                    .flat_map(|exponent| factors.iter().map(move |f| f * 10_f64.powi(exponent)));
                all.filter(inside).map(|value| (value, significant(value))).collect()
            }
            Spacing::Probability => {
                let all = SHARES.into_iter().map(|share| (probit(share / 100.0), share));
                let all = all.filter(|(score, _)| inside(score));
                all.map(|(score, share)| (score, significant(share))).collect()
            }
        }
    }
}

/// The step of 1, 2 or 5 times a power of ten that is not below `least`.
fn step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * power >= least * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::linear("ζ, %", [-0.31, 0.52]);
        let texts: Vec<String> = axis.ticks(5).into_iter().map(|(_, text)| text).collect();
        assert_eq!(texts, ["\u{2212}0.2", "0.0", "0.2", "0.4"]);
        let axis = Axis::logarithmic("f, Hz", [0.02, 20.0]);
        let values: Vec<f64> = axis.ticks(9).into_iter().map(|(value, _)| value).collect();
        assert_eq!(values.len(), 10);
        assert!((values[0] - 0.02).abs() < 1e-12 && (values[9] - 20.0).abs() < 1e-9, "{values:?}");
    }

    #[test]
    fn a_share_lies_at_its_normal_score() {
        let axis = Axis::probability("share, %", [probit(0.01), probit(0.99)]);
        assert!((axis.place(probit(0.5)) - 0.5).abs() < 1e-12);
        assert_eq!(axis.ticks(9).first().map(|(_, text)| text.as_str()), Some("1"));
    }

    #[test]
    fn equal_values_still_have_room() {
        assert_eq!(room([2.0, 2.0]), [1.0, 3.0]);
        assert_eq!(room([f64::NAN]), [0.0, 1.0]);
        assert!(room([0.0])[1] > 0.0);
    }
}
