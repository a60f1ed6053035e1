//! The share of cases with a property: exact binomial interval and exact one-sided tests.
//!
//! Which cases count, and that failed ones do, is decided by the caller.

use super::{Confidence, Error, Estimate, Independent, Method, Probability, Sides, binomial};

fn counts(events: u64, cases: u64) -> Result<(), Error> {
    if cases == 0 {
        return Err(Error::TooFew { found: 0, needed: 1 });
    }
    if events > cases {
        return Err(Error::OutOfRange {
            name: "number of events",
            found: events as f64,
            allowed: "at most the number of cases",
        });
    }
    Ok(())
}

/// Share events/cases with the interval of Clopper and Pearson (Biometrika 26, 1934).
///
/// Covers the true share at least with the stated confidence, whatever it is. No events give the
/// upper end 1 − risk^(1/n), all events the lower end risk^(1/n).
pub fn clopper_pearson(
    events: u64,
    cases: u64,
    confidence: Confidence,
    sides: Sides,
    _: Independent,
) -> Result<Estimate, Error> {
    counts(events, cases)?;
    let (below, above) = sides.risks(confidence);
    let lower = below.map_or(0.0, |risk| binomial::p_of_at_least(events, cases, risk));
    let upper = above.map_or(1.0, |risk| binomial::p_of_at_most(events, cases, risk));
    let share = events as f64 / cases as f64;
    Ok(Estimate::new(share, (lower, upper), sides, confidence, Method::ClopperPearson))
}

/// Whether so few events show, with the confidence, that the true share is at most `share`:
/// P(X ≤ events | share) ≤ risk. The same as an upper Clopper–Pearson bound at or below `share`.
pub fn rejects_at_least(
    events: u64,
    cases: u64,
    share: Probability,
    confidence: Confidence,
    _: Independent,
) -> Result<bool, Error> {
    counts(events, cases)?;
    Ok(binomial::at_most(events, cases, share.get()) <= confidence.risk())
}

/// Whether so many events show, with the confidence, that the true share is at least `share`:
/// P(X ≥ events | share) ≤ risk. The same as a lower Clopper–Pearson bound at or above `share`.
pub fn rejects_at_most(
    events: u64,
    cases: u64,
    share: Probability,
    confidence: Confidence,
    _: Independent,
) -> Result<bool, Error> {
    counts(events, cases)?;
    Ok(binomial::at_least(events, cases, share.get()) <= confidence.risk())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::Drawing;

    fn interval(k: u64, n: u64, confidence: f64) -> (f64, f64) {
        let estimate = clopper_pearson(
            k,
            n,
            Confidence::new(confidence).unwrap(),
            Sides::Two,
            Drawing::Independent.independent().unwrap(),
        )
        .unwrap();
        assert_eq!(estimate.point(), k as f64 / n as f64);
        (estimate.lower(), estimate.upper())
    }

    #[test]
    fn no_events_and_all_events_have_their_closed_forms() {
        for n in [1_u64, 10, 2000, 1_000_000] {
            let end = (0.025_f64.ln() / n as f64).exp();
            let (lower, upper) = interval(0, n, 0.95);
            assert_eq!(lower, 0.0);
            assert!((upper - (1.0 - end)).abs() <= 4.0 * f64::EPSILON, "{n}: {upper}");
            let (lower, upper) = interval(n, n, 0.95);
            assert!((lower - end).abs() <= 4.0 * f64::EPSILON, "{n}: {lower}");
            assert_eq!(upper, 1.0);
        }
    }

    // Bisection of exact rational tails to 25 digits (Python's fractions).
    const EXACT: [(u64, u64, f64, f64, f64); 6] = [
        (1, 10, 0.95, 0.002528578544461787, 0.4450161170281954),
        (5, 10, 0.9, 0.22244110100812906, 0.7775588989918709),
        (2, 100, 0.95, 0.0024313368239425436, 0.07038393247107012),
        (69, 100, 0.99, 0.5588328727346766, 0.8025281218327176),
        (3, 400, 0.9, 0.00204725866737227, 0.01926922928308818),
        (396, 400, 0.999, 0.9612958817839642, 0.9991090767578722),
    ];

    #[test]
    fn interval_ends_equal_exact_rational_bisection_to_twelve_digits() {
        for (k, n, confidence, lower, upper) in EXACT {
            let got = interval(k, n, confidence);
            assert!((got.0 / lower - 1.0).abs() <= 1e-12, "{k} {n}: {got:?}");
            assert!((got.1 / upper - 1.0).abs() <= 1e-12, "{k} {n}: {got:?}");
        }
    }

    #[test]
    fn events_and_their_absence_mirror_each_other() {
        for (k, n) in [(1, 10), (17, 2000), (999, 1000)] {
            let (lower, upper) = interval(k, n, 0.9);
            let (mirror_lower, mirror_upper) = interval(n - k, n, 0.9);
            assert!((lower - (1.0 - mirror_upper)).abs() < 1e-13);
            assert!((upper - (1.0 - mirror_lower)).abs() < 1e-13);
        }
    }

    #[test]
    fn a_one_sided_bound_spends_the_whole_risk_on_its_side() {
        let witness = Drawing::Independent.independent().unwrap();
        // Half of the risk of the two-sided 90 % interval, to the last bit.
        let confidence = Confidence::from_risk((1.0 - 0.9) / 2.0).unwrap();
        let bound = clopper_pearson(3, 50, confidence, Sides::Upper, witness).unwrap();
        assert_eq!((bound.lower(), bound.upper()), (0.0, interval(3, 50, 0.9).1));
        let bound = clopper_pearson(3, 50, confidence, Sides::Lower, witness).unwrap();
        assert_eq!((bound.lower(), bound.upper()), (interval(3, 50, 0.9).0, 1.0));
    }

    #[test]
    fn a_test_rejects_exactly_where_the_bound_lies_beyond_the_share() {
        let witness = Drawing::Independent.independent().unwrap();
        let confidence = Confidence::new(0.9).unwrap();
        for k in 0..=60 {
            for share in [0.01, 0.1, 0.35, 0.5, 0.77] {
                let p = Probability::new(share).unwrap();
                let upper = clopper_pearson(k, 60, confidence, Sides::Upper, witness).unwrap();
                let lower = clopper_pearson(k, 60, confidence, Sides::Lower, witness).unwrap();
                assert_eq!(
                    rejects_at_least(k, 60, p, confidence, witness).unwrap(),
                    upper.upper() <= share
                );
                assert_eq!(
                    rejects_at_most(k, 60, p, confidence, witness).unwrap(),
                    lower.lower() >= share
                );
            }
        }
    }

    #[test]
    fn no_cases_or_more_events_than_cases_are_errors() {
        let witness = Drawing::Independent.independent().unwrap();
        let confidence = Confidence::new(0.9).unwrap();
        assert!(clopper_pearson(0, 0, confidence, Sides::Two, witness).is_err());
        assert!(clopper_pearson(3, 2, confidence, Sides::Two, witness).is_err());
    }
}
