//! Intervals from independent replicates of a whole design: Latin hypercubes, scrambled sequences,
//! outer draws with their inner campaigns.
//!
//! Inside a replicate cases depend on each other; only the replicates' own results are a sample.

use super::{Confidence, Error, Estimate, Independent, Method, Moments, Sides};

/// Values expected beyond a quantile in every replicate from which an interval over them follows: with fewer their
/// quantiles are those of their ends.
pub const BEYOND_EACH: f64 = 5.0;

/// The mean of a statistic over its values in independent replicates, with Student's t interval:
/// exact for normal values, approximate, better with their number, for others.
///
/// # Errors
/// Fewer than two replicates, a value that is not finite, or values that are all equal, which show
/// nothing of their spread.
pub fn of_replicates(
    values: &[f64],
    confidence: Confidence,
    independent: Independent,
) -> Result<Estimate, Error> {
    let moments = Moments::of(values)?;
    let mean = moments.mean_interval(confidence, Sides::Two, independent)?;
    if moments.standard_deviation() == Some(0.0) {
        return Err(Error::Undefined("all replicates are alike: no interval follows"));
    }
    let ends = (mean.lower(), mean.upper());
    Ok(Estimate::new(mean.point(), ends, Sides::Two, confidence, Method::Replicates))
}

/// A statistic that is no mean with its value of all cases, `whole`, and an interval from its values in independent
/// replicates (sectioning; Asmussen and Glynn, Stochastic Simulation, 2007, III.5a): Student's t times the root mean
/// square of their distances from `whole`. About their own mean the interval would miss the more often the more
/// replicates there are, since every one has the bias of a small sample.
///
/// # Errors
/// As [`of_replicates`].
pub fn of_sections(
    whole: f64,
    values: &[f64],
    confidence: Confidence,
    independent: Independent,
) -> Result<Estimate, Error> {
    let about_mean = of_replicates(values, confidence, independent)?;
    let mean = about_mean.point();
    let squares = |about: f64| values.iter().map(|value| (value - about).powi(2)).sum::<f64>();
    let half = (about_mean.upper() - mean) * (squares(whole) / squares(mean)).sqrt();
    if !half.is_finite() {
        return Err(Error::Undefined("the statistic of all cases is not finite"));
    }
    let ends = (whole - half, whole + half);
    Ok(Estimate::new(whole, ends, Sides::Two, confidence, Method::Replicates))
}

#[cfg(test)]
mod tests {
    use super::super::Drawing;
    use super::*;

    #[test]
    fn the_interval_is_students() {
        let independent = Drawing::LatinHypercube.independent_replicates(4).unwrap();
        let values = [1.0, 2.0, 3.0, 6.0];
        let confidence = Confidence::new(0.95).unwrap();
        let found = of_replicates(&values, confidence, independent).unwrap();
        // 3 ± t √(14/12) with the tabulated t(0.975, 3) = 3.182446.
        let half = 3.182_446 * (14.0_f64 / 12.0).sqrt();
        assert!((found.lower() - (3.0 - half)).abs() < 1e-6, "{}", found.lower());
        assert!((found.upper() - (3.0 + half)).abs() < 1e-6);
        assert_eq!((found.point(), found.method()), (3.0, Method::Replicates));
    }

    #[test]
    fn sections_are_students_interval_about_the_statistic_of_all_cases() {
        let independent = Drawing::LatinHypercube.independent_replicates(4).unwrap();
        let values = [1.0, 2.0, 3.0, 6.0];
        let confidence = Confidence::new(0.95).unwrap();
        let found = of_sections(4.0, &values, confidence, independent).unwrap();
        // 4 ± t √(18/12) with the tabulated t(0.975, 3) = 3.182446.
        let half = 3.182_446 * (18.0_f64 / 12.0).sqrt();
        assert!((found.lower() - (4.0 - half)).abs() < 1e-6, "{}", found.lower());
        assert!((found.upper() - (4.0 + half)).abs() < 1e-6);
        assert_eq!(found.point(), 4.0);
        assert!(of_sections(f64::NAN, &values, confidence, independent).is_err());
    }

    #[test]
    fn one_replicate_equal_replicates_and_other_drawings_give_none() {
        for drawing in [Drawing::LatinHypercube, Drawing::LowDiscrepancy, Drawing::Nested] {
            assert!(drawing.independent_replicates(1).is_err());
            assert!(drawing.independent_replicates(2).is_ok());
        }
        for drawing in [Drawing::Designed, Drawing::Selected, Drawing::Crossed] {
            assert!(drawing.independent_replicates(8).is_err());
        }
        let independent = Drawing::LatinHypercube.independent_replicates(3).unwrap();
        let confidence = Confidence::new(0.9).unwrap();
        assert!(of_replicates(&[0.5; 3], confidence, independent).is_err());
    }
}
