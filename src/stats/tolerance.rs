//! Tolerance bounds from order statistics (Wilks) and the consumer's risk that goes with them.
//!
//! One-sided with k exceedances allowed: the (k+1)-th worst value bounds the stated share of the
//! population. Two-sided: the (k+1)-th smallest and the (k+1)-th greatest, k exceedances on each
//! side, enclose it. Both hold for any law and need independent draws.
//! S. S. Wilks, Ann. Math. Stat. 12 (1941); NASA/TP-2010-216447 for the consumer's risk.

use super::{
    Confidence, Error, Estimate, Independent, Method, Ordered, Probability, Sides, binomial,
};

/// Largest number of cases that is looked for: above it a double no longer counts single cases.
const MOST_CASES: u64 = 1 << 53;

/// Whether the population is bounded on one side or enclosed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tails {
    /// One bound; exceedances are counted beyond it.
    One,
    /// Two bounds; exceedances are counted on each side.
    Two,
}

impl Tails {
    /// Cases that may lie beyond the bounds or on them: their number less one.
    fn outside(self, exceedances: u64) -> u64 {
        match self {
            Self::One => exceedances,
            Self::Two => 2 * exceedances + 1,
        }
    }
}

fn in_range(exceedances: u64) -> Result<(), Error> {
    if exceedances < MOST_CASES / 4 {
        Ok(())
    } else {
        Err(Error::OutOfRange {
            name: "number of exceedances",
            found: exceedances as f64,
            allowed: "below 2^51",
        })
    }
}

/// Consumer's risk: the probability that the bound with `exceedances` beyond it, taken from
/// `cases` independent draws, covers less than `coverage` of the population,
/// P(X ≤ k | n, 1 − coverage) (2k + 1 in place of k for two bounds).
pub fn consumers_risk(
    exceedances: u64,
    cases: u64,
    coverage: Probability,
    tails: Tails,
) -> Result<f64, Error> {
    in_range(exceedances)?;
    Ok(binomial::at_most(tails.outside(exceedances), cases, 1.0 - coverage.get()))
}

/// Least number of independent draws whose bound with `exceedances` beyond it covers `coverage`
/// of the population with the confidence.
pub fn least_cases(
    exceedances: u64,
    coverage: Probability,
    confidence: Confidence,
    tails: Tails,
) -> Result<u64, Error> {
    in_range(exceedances)?;
    let outside = tails.outside(exceedances);
    let holds =
        |cases| binomial::at_most(outside, cases, 1.0 - coverage.get()) <= confidence.risk();
    // As many cases as may lie outside never do; the risk falls with every further case.
    let mut low = outside;
    let mut high = outside + 1;
    while !holds(high) {
        low = high;
        high *= 2;
        if high > MOST_CASES {
            return Err(Error::Undefined(
                "more than 2^53 cases would be needed: coverage or confidence is too near 1",
            ));
        }
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(high)
}

/// Greatest number of exceedances that `cases` independent draws may show; `None` where even none
/// is not enough.
pub fn most_exceedances(
    cases: u64,
    coverage: Probability,
    confidence: Confidence,
    tails: Tails,
) -> Option<u64> {
    let holds = |exceedances| {
        let outside = tails.outside(exceedances);
        binomial::at_most(outside, cases, 1.0 - coverage.get()) <= confidence.risk()
    };
    if !holds(0) {
        return None;
    }
    let (mut low, mut high) = (0, cases.min(MOST_CASES) + 1);
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

/// A one-sided tolerance bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToleranceBound {
    /// Point: the sample quantile at the coverage; bound: the order statistic.
    pub estimate: Estimate,
    /// Values beyond the order statistic that is the bound, at most.
    pub exceedances: u64,
    /// Actual consumer's risk, at most the one asked for.
    pub risk: f64,
}

/// Two values that enclose the stated share of the population.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToleranceInterval {
    /// Lower bound, an order statistic.
    pub lower: f64,
    /// Upper bound, an order statistic.
    pub upper: f64,
    /// Values beyond each of the bounds, at most.
    pub exceedances: u64,
    /// Share of the population enclosed.
    pub coverage: Probability,
    /// Confidence of the statement.
    pub confidence: Confidence,
    /// Actual consumer's risk, at most the one asked for.
    pub risk: f64,
}

/// The bound that `coverage` of the population lies above ([`Sides::Lower`]) or below
/// ([`Sides::Upper`]); [`Error::TooFew`] names the cases needed.
pub fn tolerance_bound(
    sample: &Ordered,
    coverage: Probability,
    confidence: Confidence,
    sides: Sides,
    _: Independent,
) -> Result<ToleranceBound, Error> {
    let cases = sample.len() as u64;
    let Some(exceedances) = most_exceedances(cases, coverage, confidence, Tails::One) else {
        let needed = least_cases(0, coverage, confidence, Tails::One)?;
        return Err(Error::TooFew { found: cases, needed });
    };
    let skip = exceedances as usize;
    let (point, ends) = match sides {
        Sides::Lower => {
            (sample.quantile_at(1.0 - coverage.get()), (sample.values()[skip], f64::INFINITY))
        }
        Sides::Upper => (
            sample.quantile_at(coverage.get()),
            (f64::NEG_INFINITY, sample.values()[sample.len() - 1 - skip]),
        ),
        Sides::Two => {
            return Err(Error::Undefined("a bound has one side; see the tolerance interval"));
        }
    };
    Ok(ToleranceBound {
        estimate: Estimate::new(point, ends, sides, confidence, Method::OrderStatistics),
        exceedances,
        risk: consumers_risk(exceedances, cases, coverage, Tails::One)?,
    })
}

/// The order statistics that enclose `coverage` of the population, equally many values beyond
/// each; [`Error::TooFew`] names the cases needed.
pub fn tolerance_interval(
    sample: &Ordered,
    coverage: Probability,
    confidence: Confidence,
    _: Independent,
) -> Result<ToleranceInterval, Error> {
    let cases = sample.len() as u64;
    let Some(exceedances) = most_exceedances(cases, coverage, confidence, Tails::Two) else {
        let needed = least_cases(0, coverage, confidence, Tails::Two)?;
        return Err(Error::TooFew { found: cases, needed });
    };
    let skip = exceedances as usize;
    Ok(ToleranceInterval {
        lower: sample.values()[skip],
        upper: sample.values()[sample.len() - 1 - skip],
        exceedances,
        coverage,
        confidence,
        risk: consumers_risk(exceedances, cases, coverage, Tails::Two)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::Drawing;

    fn coverage(value: f64) -> Probability {
        Probability::new(value).unwrap()
    }

    fn risk(value: f64) -> Confidence {
        Confidence::from_risk(value).unwrap()
    }

    #[test]
    fn least_cases_equal_the_published_table() {
        // verification table, item 10: coverage, risk, least N for k = 0, 1, 2, 3.
        for (share, beta, table) in [
            (0.95, 0.05, [59, 93, 124, 153]),
            (0.95, 0.10, [45, 77, 105, 132]),
            (0.99, 0.05, [299, 473, 628, 773]),
            (0.99, 0.10, [230, 388, 531, 667]),
            (0.9973, 0.10, [852, 1440, 1970, 2473]),
            (0.9973, 0.05, [1109, 1756, 2330, 2870]),
            (0.99865, 0.10, [1705, 2880, 3941, 4947]),
            (0.99865, 0.05, [2218, 3513, 4662, 5742]),
        ] {
            for (k, cases) in (0..).zip(table) {
                let least = least_cases(k, coverage(share), risk(beta), Tails::One).unwrap();
                assert_eq!(least, cases, "coverage {share}, risk {beta}, k {k}");
            }
        }
    }

    #[test]
    fn most_exceedances_of_two_thousand_cases_equal_the_published_table() {
        for (share, k) in [(0.95, 87), (0.99, 13), (0.9973, 2), (0.99865, 0)] {
            assert_eq!(most_exceedances(2000, coverage(share), risk(0.1), Tails::One), Some(k));
        }
        assert_eq!(most_exceedances(2000, coverage(0.9999), risk(0.1), Tails::One), None);
        assert_eq!(most_exceedances(0, coverage(0.5), risk(0.1), Tails::One), None);
    }

    #[test]
    fn the_actual_risk_equals_the_published_figures() {
        for (k, published) in (0..).zip([0.00448, 0.02876, 0.09446, 0.21291]) {
            let actual = consumers_risk(k, 2000, coverage(0.9973), Tails::One).unwrap();
            // Published to five decimals.
            assert!((actual - published).abs() <= 0.5e-5, "k {k}: {actual}");
        }
    }

    #[test]
    fn two_sided_bounds_need_the_cases_of_wilks() {
        for (k, cases) in (0..).zip([93, 153, 208, 260, 311]) {
            let least = least_cases(k, coverage(0.95), risk(0.05), Tails::Two).unwrap();
            assert_eq!(least, cases);
            assert_eq!(most_exceedances(cases, coverage(0.95), risk(0.05), Tails::Two), Some(k));
            let before = most_exceedances(cases - 1, coverage(0.95), risk(0.05), Tails::Two);
            assert_eq!(before, k.checked_sub(1));
        }
    }

    #[test]
    fn least_cases_and_most_exceedances_are_inverse_to_each_other() {
        for share in [0.5, 0.9, 0.9973] {
            for tails in [Tails::One, Tails::Two] {
                for k in [0, 1, 5, 40] {
                    let least = least_cases(k, coverage(share), risk(0.1), tails).unwrap();
                    assert_eq!(most_exceedances(least, coverage(share), risk(0.1), tails), Some(k));
                    assert_eq!(
                        most_exceedances(least - 1, coverage(share), risk(0.1), tails),
                        k.checked_sub(1)
                    );
                }
            }
        }
    }

    #[test]
    fn a_coverage_too_near_one_and_a_huge_count_are_errors_not_endless_loops() {
        let near = coverage(1.0 - f64::EPSILON);
        assert!(least_cases(0, near, risk(1e-300), Tails::One).is_err());
        assert!(least_cases(u64::MAX, coverage(0.5), risk(0.1), Tails::Two).is_err());
        assert!(consumers_risk(u64::MAX, 1, coverage(0.5), Tails::Two).is_err());
        assert!(most_exceedances(u64::MAX, coverage(0.5), risk(0.1), Tails::One).is_some());
    }

    #[test]
    fn the_bound_is_the_order_statistic_with_the_allowed_exceedances_beyond_it() {
        let witness = Drawing::Independent.independent().unwrap();
        let values: Vec<f64> = (0..2000).rev().map(f64::from).collect();
        let sample = Ordered::new(&values).unwrap();
        let bound =
            tolerance_bound(&sample, coverage(0.9973), risk(0.1), Sides::Lower, witness).unwrap();
        assert_eq!(bound.exceedances, 2);
        assert_eq!(bound.estimate.lower(), 2.0);
        assert_eq!(bound.estimate.upper(), f64::INFINITY);
        let bound =
            tolerance_bound(&sample, coverage(0.9973), risk(0.1), Sides::Upper, witness).unwrap();
        assert_eq!(bound.estimate.upper(), 1997.0);
        let enclosed = tolerance_interval(&sample, coverage(0.95), risk(0.05), witness).unwrap();
        let k = enclosed.exceedances as f64;
        assert_eq!((enclosed.lower, enclosed.upper), (k, 1999.0 - k));
        assert!(enclosed.risk <= 0.05);
    }

    #[test]
    fn a_sample_too_small_says_how_many_cases_are_needed() {
        let witness = Drawing::Independent.independent().unwrap();
        let sample = Ordered::new(&[1.0; 92]).unwrap();
        assert_eq!(
            tolerance_interval(&sample, coverage(0.95), risk(0.05), witness),
            Err(Error::TooFew { found: 92, needed: 93 })
        );
        let sample = Ordered::new(&[1.0; 58]).unwrap();
        assert_eq!(
            tolerance_bound(&sample, coverage(0.95), risk(0.05), Sides::Upper, witness),
            Err(Error::TooFew { found: 58, needed: 59 })
        );
    }
}
