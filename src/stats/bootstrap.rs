//! Bootstrap intervals of a statistic, for moments and quantiles inside the range of the data.
//!
//! The words that choose the resamples are handed in: nothing here draws. No bootstrap interval
//! reaches beyond the sample; for extremes use order statistics.

use super::{Confidence, Error, Estimate, Independent, Method, Ordered, Sides, normal};

/// How the interval is read off the resampled statistics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BootstrapInterval {
    /// Quantiles of the resampled statistics.
    Percentile,
    /// Bias-corrected and accelerated (Efron, JASA 82, 1987).
    Bca,
}

/// A bootstrap: number of resamples, confidence and kind of interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bootstrap {
    resamples: usize,
    confidence: Confidence,
    interval: BootstrapInterval,
}

/// Groups left out in turn for the acceleration; more cases than this are left out by equal groups.
const JACKKNIFE_GROUPS: usize = 1000;

impl Bootstrap {
    /// At least 10/risk resamples, so that five lie beyond each end.
    pub fn new(
        resamples: usize,
        confidence: Confidence,
        interval: BootstrapInterval,
    ) -> Result<Self, Error> {
        // A hair less, since risk = 1 − 0.95 is not 0.05 to the last bit.
        if resamples as f64 * confidence.risk() >= 10.0 * (1.0 - 1e-9) {
            Ok(Self { resamples, confidence, interval })
        } else {
            Err(Error::OutOfRange {
                name: "number of resamples",
                found: resamples as f64,
                allowed: "at least 10 / (1 − confidence)",
            })
        }
    }

    /// Estimate of the statistic with its two-sided interval.
    ///
    /// `statistic` may reorder the values it is given. `words` yields uniform 64-bit words, one per
    /// value and resample, and so fixes the result.
    pub fn estimate(
        &self,
        sample: &[f64],
        statistic: impl Fn(&mut [f64]) -> f64,
        mut words: impl FnMut() -> u64,
        _: Independent,
    ) -> Result<Estimate, Error> {
        if sample.len() < 2 {
            return Err(Error::TooFew { found: sample.len() as u64, needed: 2 });
        }
        if let Some(index) = sample.iter().position(|value| !value.is_finite()) {
            return Err(Error::NotFinite { index, found: sample[index], allowed: "finite" });
        }
        let mut scratch = sample.to_vec();
        let point = statistic(&mut scratch);
        let mut replicates = Vec::with_capacity(self.resamples);
        for _ in 0..self.resamples {
            for value in &mut scratch {
                // Uniform index by the high half of a product; its bias is below n/2⁶⁴.
                let index = (u128::from(words()) * sample.len() as u128) >> 64;
                *value = sample[index as usize];
            }
            replicates.push(statistic(&mut scratch));
        }
        if !point.is_finite() || !replicates.iter().all(|value| value.is_finite()) {
            return Err(Error::Undefined(
                "the statistic is not finite for the sample or a resample",
            ));
        }
        let levels = match self.interval {
            BootstrapInterval::Percentile => {
                (self.confidence.risk() / 2.0, 1.0 - self.confidence.risk() / 2.0)
            }
            BootstrapInterval::Bca => self.bca_levels(sample, &statistic, point, &replicates)?,
        };
        let replicates = Ordered::new(&replicates)?;
        let ends = (replicates.quantile_at(levels.0), replicates.quantile_at(levels.1));
        let method = match self.interval {
            BootstrapInterval::Percentile => Method::BootstrapPercentile,
            BootstrapInterval::Bca => Method::BootstrapBca,
        };
        Ok(Estimate::new(point, ends, Sides::Two, self.confidence, method))
    }

    /// Levels Φ(z₀ + (z₀ ± z)/(1 − a(z₀ ± z))) with bias correction z₀ and acceleration a.
    fn bca_levels(
        &self,
        sample: &[f64],
        statistic: &impl Fn(&mut [f64]) -> f64,
        point: f64,
        replicates: &[f64],
    ) -> Result<(f64, f64), Error> {
        let below: f64 = replicates
            .iter()
            .map(|&value| {
                if value < point {
                    1.0
                } else if value == point {
                    0.5
                } else {
                    0.0
                }
            })
            .sum::<f64>()
            / replicates.len() as f64;
        let bias = -normal::upper_point(below);
        if !bias.is_finite() {
            return Err(Error::Undefined("every resample lies on one side of the estimate"));
        }
        let acceleration = acceleration(sample, statistic);
        let z = normal::upper_point(self.confidence.risk() / 2.0);
        let level = |z: f64| {
            let shifted = bias + z;
            normal::probability(bias + shifted / (1.0 - acceleration * shifted))
        };
        let levels = (level(-z), level(z));
        if levels.0 < levels.1 {
            Ok(levels)
        } else {
            Err(Error::Undefined("the acceleration is too large for a corrected interval"))
        }
    }
}

/// Σd³ / (6 (Σd²)^{3/2}) of the jackknife differences d from their mean; 0 where they vanish.
fn acceleration(sample: &[f64], statistic: &impl Fn(&mut [f64]) -> f64) -> f64 {
    let groups = sample.len().min(JACKKNIFE_GROUPS);
    let mut left_out = Vec::with_capacity(groups);
    let mut rest = Vec::with_capacity(sample.len());
    for group in 0..groups {
        let from = group * sample.len() / groups;
        let to = (group + 1) * sample.len() / groups;
        rest.clear();
        rest.extend_from_slice(&sample[..from]);
        rest.extend_from_slice(&sample[to..]);
        left_out.push(statistic(&mut rest));
    }
    let mean = left_out.iter().sum::<f64>() / groups as f64;
    let (square, cube) = left_out.iter().fold((0.0, 0.0), |(square, cube), value| {
        let d = mean - value;
        (square + d * d, cube + d * d * d)
    });
    if square > 0.0 { cube / (6.0 * square.powf(1.5)) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::{Drawing, coverage::words};

    fn mean(values: &mut [f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn the_same_words_give_the_same_interval() {
        let witness = Drawing::Independent.independent().unwrap();
        let sample: Vec<f64> = (0..50).map(|i| f64::from(i).sqrt()).collect();
        let confidence = Confidence::new(0.95).unwrap();
        for interval in [BootstrapInterval::Percentile, BootstrapInterval::Bca] {
            let bootstrap = Bootstrap::new(400, confidence, interval).unwrap();
            let first = bootstrap.estimate(&sample, mean, words(1), witness).unwrap();
            assert_eq!(first, bootstrap.estimate(&sample, mean, words(1), witness).unwrap());
            assert_ne!(first, bootstrap.estimate(&sample, mean, words(2), witness).unwrap());
            assert!(first.lower() < first.point() && first.point() < first.upper());
        }
    }

    #[test]
    fn acceleration_of_a_mean_is_a_sixth_of_its_skewness() {
        // Jackknife of the mean: d = (x − mean)/(n−1), so a = skewness/(6√n).
        let sample: Vec<f64> = (0..100).map(|i| f64::from(i % 10).powi(2)).collect();
        let skewness = crate::stats::Moments::of(&sample).unwrap().skewness().unwrap();
        assert!((acceleration(&sample, &mean) - skewness / 60.0).abs() < 1e-12);
    }

    #[test]
    fn constant_values_give_a_point() {
        let witness = Drawing::Independent.independent().unwrap();
        let confidence = Confidence::new(0.9).unwrap();
        let bootstrap = Bootstrap::new(100, confidence, BootstrapInterval::Bca).unwrap();
        let estimate = bootstrap.estimate(&[2.0; 10], mean, words(3), witness).unwrap();
        assert_eq!((estimate.lower(), estimate.upper()), (2.0, 2.0));
    }

    #[test]
    fn nan_few_values_and_few_resamples_are_errors() {
        let witness = Drawing::Independent.independent().unwrap();
        let confidence = Confidence::new(0.95).unwrap();
        assert!(Bootstrap::new(199, confidence, BootstrapInterval::Bca).is_err());
        let bootstrap = Bootstrap::new(200, confidence, BootstrapInterval::Percentile).unwrap();
        assert!(bootstrap.estimate(&[1.0], mean, words(1), witness).is_err());
        assert!(bootstrap.estimate(&[1.0, f64::NAN], mean, words(1), witness).is_err());
        let undefined = bootstrap.estimate(&[1.0, 2.0], |_| f64::NAN, words(1), witness);
        assert!(matches!(undefined, Err(Error::Undefined(_))));
    }
}
