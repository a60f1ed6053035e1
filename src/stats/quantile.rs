//! An ordered sample, its quantiles and their distribution-free intervals.
//!
//! Bounds on a share of the population are in `tolerance`.

use super::{Confidence, Error, Estimate, Independent, Method, Probability, Sides, binomial};

/// The values of a sample in ascending order: not empty, no NaN.
///
/// An infinite value is allowed: it stands for "beyond every limit", as the time to double of a
/// stable case.
#[derive(Debug, Clone, PartialEq)]
pub struct Ordered(Vec<f64>);

impl Ordered {
    /// Sorts a copy of the values; an error names the first NaN.
    pub fn new(values: &[f64]) -> Result<Self, Error> {
        if values.is_empty() {
            return Err(Error::TooFew { found: 0, needed: 1 });
        }
        if let Some(index) = values.iter().position(|value| value.is_nan()) {
            return Err(Error::NotFinite { index, found: values[index], allowed: "a number" });
        }
        let mut values = values.to_vec();
        values.sort_unstable_by(f64::total_cmp);
        Ok(Self(values))
    }

    /// The values, ascending.
    pub fn values(&self) -> &[f64] {
        &self.0
    }

    /// Number of values, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "an ordered sample is never empty")]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The least value.
    pub fn smallest(&self) -> f64 {
        self.0[0]
    }

    /// The greatest value.
    pub fn largest(&self) -> f64 {
        self.0[self.0.len() - 1]
    }

    /// Sample quantile of type 7 (Hyndman and Fan 1996): linear between order statistics at
    /// (n−1)p, as numpy, pandas, polars and DuckDB's `quantile_cont` have it.
    pub fn quantile(&self, level: Probability) -> f64 {
        self.quantile_at(level.get())
    }

    pub(super) fn quantile_at(&self, level: f64) -> f64 {
        let (ranks, weight) = ranks_of(self.0.len() as u64, level);
        between(ranks.map(|rank| self.0[rank as usize]), weight)
    }

    /// Quantile with the distribution-free interval between order statistics.
    ///
    /// The lower end is the r-th smallest value with the greatest r such that
    /// P(X ≤ r−1) ≤ risk below, the upper end the s-th with the least s such that P(X ≥ s) ≤ risk
    /// above, X binomial of n trials with the level as probability (David and Nagaraja, Order
    /// Statistics, 7.1). An end that the sample is too small for is infinite.
    pub fn quantile_interval(
        &self,
        level: Probability,
        confidence: Confidence,
        sides: Sides,
        _: Independent,
    ) -> Estimate {
        let [lower, upper] = ranks_of_ends(self.0.len() as u64, level, confidence, sides);
        let lower = lower.map_or(f64::NEG_INFINITY, |rank| self.0[rank as usize]);
        let upper = upper.map_or(f64::INFINITY, |rank| self.0[rank as usize]);
        let point = self.quantile(level);
        Estimate::new(point, (lower, upper), sides, confidence, Method::OrderStatistics)
    }
}

/// Ranks (from 0) of the ends of [`Ordered::quantile_interval`] among `count` values, for a sample that
/// is not at hand; none where the sample is too small for an end.
pub fn interval_ranks(
    count: u64,
    level: Probability,
    confidence: Confidence,
    _: Independent,
) -> [Option<u64>; 2] {
    ranks_of_ends(count, level, confidence, Sides::Two)
}

fn ranks_of_ends(
    cases: u64,
    level: Probability,
    confidence: Confidence,
    sides: Sides,
) -> [Option<u64>; 2] {
    let p = level.get();
    let (below, above) = sides.risks(confidence);
    // Values that may lie below the lower end: r − 1, or none.
    let lower = below.and_then(|risk| greatest(cases, |r| binomial::at_most(r, cases, p) <= risk));
    // The same from above: P(X ≥ s) = P(n − X ≤ n − s).
    let upper =
        above.and_then(|risk| greatest(cases, |r| binomial::at_least(cases - r, cases, p) <= risk));
    [lower, upper.map(|skip| cases - 1 - skip)]
}

/// Quantile of type 7 of `count` values, at least one, of which `value` gives those at the ranks
/// (from 0) that are asked for: see [`Ordered::quantile`].
pub fn quantile_of(count: u64, level: Probability, value: impl FnMut(u64) -> f64) -> f64 {
    let (ranks, weight) = ranks_of(count, level.get());
    between(ranks.map(value), weight)
}

/// The two ranks between which a quantile lies, and the weight of the second.
fn ranks_of(count: u64, level: f64) -> ([u64; 2], f64) {
    let position = (count - 1) as f64 * level;
    let rank = position.floor() as u64;
    ([rank, (rank + 1).min(count - 1)], position - position.floor())
}

fn between([below, above]: [f64; 2], weight: f64) -> f64 {
    if weight == 0.0 || below == above || below.is_infinite() {
        below
    } else {
        below + weight * (above - below)
    }
}

/// Greatest r in 0 … n−1 for which a property holds that holds up to some r and not beyond.
fn greatest(n: u64, holds: impl Fn(u64) -> bool) -> Option<u64> {
    if !holds(0) {
        return None;
    }
    let (mut low, mut high) = (0, n);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::Drawing;

    fn p(value: f64) -> Probability {
        Probability::new(value).unwrap()
    }

    #[test]
    fn a_nan_is_named_and_never_sorted_in() {
        let error = Ordered::new(&[1.0, f64::NAN, 2.0]).unwrap_err();
        assert!(matches!(error, Error::NotFinite { index: 1, .. }));
        assert_eq!(Ordered::new(&[]), Err(Error::TooFew { found: 0, needed: 1 }));
    }

    #[test]
    fn quantiles_are_those_of_numpy() {
        // numpy.quantile([3, 1, 2, 10], q), default method "linear".
        let sample = Ordered::new(&[3.0, 1.0, 2.0, 10.0]).unwrap();
        for (level, value) in [(0.25, 1.75), (0.5, 2.5), (0.9, 7.9)] {
            assert!((sample.quantile(p(level)) - value).abs() <= 8.0 * f64::EPSILON * value);
        }
        assert_eq!((sample.smallest(), sample.largest()), (1.0, 10.0));
    }

    #[test]
    fn an_infinite_value_never_turns_into_nan() {
        let sample = Ordered::new(&[f64::INFINITY, f64::NEG_INFINITY, 1.0, f64::INFINITY]).unwrap();
        for level in [0.1, 0.3, 0.5, 0.7, 0.9] {
            assert!(!sample.quantile(p(level)).is_nan());
        }
        assert_eq!(sample.quantile(p(0.9)), f64::INFINITY);
    }

    #[test]
    fn the_median_interval_has_the_textbook_ranks() {
        // Conover, Practical Nonparametric Statistics: n = 10 at 95 %: 2nd and 9th (97.9 %);
        // n = 20: 6th and 15th (95.9 %).
        let witness = Drawing::Independent.independent().unwrap();
        for (n, low, high) in [(10, 2.0, 9.0), (20, 6.0, 15.0)] {
            let values: Vec<f64> = (1..=n).map(f64::from).collect();
            let interval = Ordered::new(&values).unwrap().quantile_interval(
                p(0.5),
                Confidence::new(0.95).unwrap(),
                Sides::Two,
                witness,
            );
            assert_eq!((interval.lower(), interval.upper()), (low, high));
        }
    }

    #[test]
    fn a_small_sample_gives_no_end_rather_than_a_wrong_one() {
        let witness = Drawing::Independent.independent().unwrap();
        let interval = Ordered::new(&[1.0, 2.0, 3.0]).unwrap().quantile_interval(
            p(0.9),
            Confidence::new(0.95).unwrap(),
            Sides::Two,
            witness,
        );
        assert_eq!(interval.upper(), f64::INFINITY);
        assert_eq!(interval.lower(), 1.0);
    }

    #[test]
    fn the_one_sided_bound_of_a_quantile_is_the_tolerance_bound() {
        let witness = Drawing::Independent.independent().unwrap();
        let values: Vec<f64> = (0..2000).map(f64::from).collect();
        let sample = Ordered::new(&values).unwrap();
        let confidence = Confidence::from_risk(0.1).unwrap();
        for sides in [Sides::Lower, Sides::Upper] {
            let level = if sides == Sides::Lower { 1.0 - 0.9973 } else { 0.9973 };
            let quantile = sample.quantile_interval(p(level), confidence, sides, witness);
            let bound =
                crate::stats::tolerance_bound(&sample, p(0.9973), confidence, sides, witness)
                    .unwrap();
            assert_eq!(quantile.lower(), bound.estimate.lower());
            assert_eq!(quantile.upper(), bound.estimate.upper());
        }
    }
}
