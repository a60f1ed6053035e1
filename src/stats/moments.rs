//! Mean, standard deviation, skewness and kurtosis, from central sums that can be merged.
//!
//! Intervals other than Student's for the mean come from `bootstrap`.

use super::{Confidence, Error, Estimate, Independent, Method, Sides, student};

/// Number of values and their central sums Σ(x − mean)ᵏ, k = 2, 3, 4.
///
/// Parts are merged by Pébay's formulas (SAND2008-6212). Reduce over fixed parts in index order:
/// then the result does not depend on who computed which part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    count: u64,
    mean: f64,
    sums: [f64; 3],
}

/// Values whose central sums are formed about their own mean, before they are merged.
const CHUNK: usize = 1024;

impl Moments {
    /// Moments of the values; an error names the first that is not finite. No values give the
    /// empty part.
    pub fn of(values: &[f64]) -> Result<Self, Error> {
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(Error::NotFinite { index, found: values[index], allowed: "finite" });
        }
        Ok(values.chunks(CHUNK).map(Self::of_chunk).fold(Self::default(), Self::merge))
    }

    /// Two passes: the mean first, corrected by the mean of what is left over, then the sums.
    fn of_chunk(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let rough = values.iter().map(|x| x / count).sum::<f64>();
        let mean = rough + values.iter().map(|x| (x - rough) / count).sum::<f64>();
        let mut sums = [0.0; 3];
        for x in values {
            let d = x - mean;
            sums[0] += d * d;
            sums[1] += d * d * d;
            sums[2] += d * d * d * d;
        }
        Self { count: values.len() as u64, mean, sums }
    }

    /// Moments of both parts together.
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        if self.count == 0 {
            return other;
        }
        if other.count == 0 {
            return self;
        }
        let (a, b) = (self.count as f64, other.count as f64);
        let n = a + b;
        let d = other.mean - self.mean;
        let ([a2, a3, a4], [b2, b3, b4]) = (self.sums, other.sums);
        Self {
            count: self.count + other.count,
            mean: self.mean + d * b / n,
            sums: [
                a2 + b2 + d * d * a * b / n,
                a3 + b3 + d.powi(3) * a * b * (a - b) / (n * n) + 3.0 * d * (a * b2 - b * a2) / n,
                a4 + b4
                    + d.powi(4) * a * b * (a * a - a * b + b * b) / n.powi(3)
                    + 6.0 * d * d * (a * a * b2 + b * b * a2) / (n * n)
                    + 4.0 * d * (a * b3 - b * a3) / n,
            ],
        }
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean; `None` of no values.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then_some(self.mean)
    }

    /// Standard deviation with n − 1; `None` of fewer than two values.
    pub fn standard_deviation(&self) -> Option<f64> {
        (self.count > 1).then(|| (self.sums[0] / (self.count - 1) as f64).sqrt())
    }

    /// Skewness m₃/m₂^{3/2} with mₖ = Σ(x − mean)ᵏ/n; `None` where all values are equal.
    pub fn skewness(&self) -> Option<f64> {
        let n = self.count as f64;
        (self.sums[0] > 0.0).then(|| n.sqrt() * self.sums[1] / self.sums[0].powf(1.5))
    }

    /// Kurtosis m₄/m₂² with mₖ = Σ(x − mean)ᵏ/n, 3 for a normal law; `None` where all values are
    /// equal.
    pub fn kurtosis(&self) -> Option<f64> {
        let n = self.count as f64;
        (self.sums[0] > 0.0).then(|| n * self.sums[2] / (self.sums[0] * self.sums[0]))
    }

    /// Mean with Student's t interval, which is exact for normal values and approximate, better
    /// with n, for others.
    pub fn mean_interval(
        &self,
        confidence: Confidence,
        sides: Sides,
        _: Independent,
    ) -> Result<Estimate, Error> {
        let Some(deviation) = self.standard_deviation() else {
            return Err(Error::TooFew { found: self.count, needed: 2 });
        };
        let error = deviation / (self.count as f64).sqrt();
        let half = |risk| student::upper_point(self.count - 1, risk) * error;
        let (below, above) = sides.risks(confidence);
        let ends = (
            below.map_or(f64::NEG_INFINITY, |risk| self.mean - half(risk)),
            above.map_or(f64::INFINITY, |risk| self.mean + half(risk)),
        );
        Ok(Estimate::new(self.mean, ends, sides, confidence, Method::StudentT))
    }
}

/// Moments of values that come one by one; the same as [`Moments::of`] of all of them.
#[derive(Debug, Clone, Default)]
pub struct RunningMoments {
    whole: Moments,
    chunk: Vec<f64>,
}

impl RunningMoments {
    /// Takes a value.
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn push(&mut self, value: f64) -> Result<(), Error> {
        if !value.is_finite() {
            let index = self.whole.count() as usize + self.chunk.len();
            return Err(Error::NotFinite { index, found: value, allowed: "finite" });
        }
        self.chunk.push(value);
        if self.chunk.len() == CHUNK {
            self.whole = self.moments();
            self.chunk.clear();
        }
        Ok(())
    }

    /// Moments of the values so far.
    pub fn moments(&self) -> Moments {
        if self.chunk.is_empty() {
            return self.whole;
        }
        self.whole.merge(Moments::of_chunk(&self.chunk))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::Drawing;

    #[test]
    fn moments_of_one_to_n_have_their_closed_forms() {
        // Discrete uniform: mean (n+1)/2, variance n(n+1)/12 with n−1, kurtosis
        // 3/5 (3n²−7)/(n²−1), skewness 0.
        let n = 10_000.0_f64;
        let values: Vec<f64> = (1..=10_000).map(f64::from).collect();
        let moments = Moments::of(&values).unwrap();
        // Pairs of chunks: each merge rounds a few times.
        let tolerance = 50.0 * f64::EPSILON;
        assert!((moments.mean().unwrap() / ((n + 1.0) / 2.0) - 1.0).abs() < tolerance);
        let variance = n * (n + 1.0) / 12.0;
        assert!((moments.standard_deviation().unwrap().powi(2) / variance - 1.0).abs() < tolerance);
        let kurtosis = 0.6 * (3.0 * n * n - 7.0) / (n * n - 1.0);
        assert!((moments.kurtosis().unwrap() / kurtosis - 1.0).abs() < tolerance);
        assert!(moments.skewness().unwrap().abs() < tolerance);
    }

    #[test]
    fn values_that_come_one_by_one_give_the_same_bits() {
        let values: Vec<f64> = (0..2500).map(|i| (f64::from(i) * 0.7).sin()).collect();
        let mut running = RunningMoments::default();
        for (count, value) in (1..).zip(&values) {
            running.push(*value).unwrap();
            if [1, 1023, 1024, 1025, 2048, 2500].contains(&count) {
                assert_eq!(running.moments(), Moments::of(&values[..count]).unwrap());
            }
        }
        assert!(running.push(f64::NAN).is_err());
    }

    #[test]
    fn skewness_of_a_rare_event_is_that_of_bernoulli() {
        let mut values = vec![0.0; 90];
        values.extend([1.0; 10]);
        let moments = Moments::of(&values).unwrap();
        // (1 − 2p)/√(pq) = 0.8/0.3.
        assert!((moments.skewness().unwrap() - 0.8 / 0.3).abs() < 1e-13);
    }

    #[test]
    fn a_large_mean_does_not_drown_the_deviation() {
        // The sum of squares of these values would need 21 digits.
        let values: Vec<f64> = [4.0, 7.0, 13.0, 16.0].iter().map(|x| 1e9 + x).collect();
        assert_eq!(Moments::of(&values).unwrap().standard_deviation(), Some(30_f64.sqrt()));
    }

    #[test]
    fn merged_parts_equal_the_whole() {
        let values: Vec<f64> =
            (0..5000).map(|i| (f64::from(i) * 0.7).sin() + 1e-3 * f64::from(i)).collect();
        let whole = Moments::of(&values).unwrap();
        for split in [0, 1, 7, 1024, 4999, 5000] {
            let (left, right) = values.split_at(split);
            let merged = Moments::of(left).unwrap().merge(Moments::of(right).unwrap());
            assert_eq!(merged.count(), 5000);
            // Sums of 5000 rounded terms of one size.
            for (a, b) in [
                (merged.mean(), whole.mean()),
                (merged.standard_deviation(), whole.standard_deviation()),
                (merged.skewness(), whole.skewness()),
                (merged.kurtosis(), whole.kurtosis()),
            ] {
                assert!((a.unwrap() - b.unwrap()).abs() < 5000.0 * f64::EPSILON);
            }
        }
        let chunked = values
            .chunks(2048)
            .map(|part| Moments::of(part).unwrap())
            .fold(Moments::default(), Moments::merge);
        assert!((chunked.mean().unwrap() - whole.mean().unwrap()).abs() < 1e-12);
    }

    #[test]
    fn what_does_not_exist_is_none_and_what_is_not_finite_is_an_error() {
        let empty = Moments::of(&[]).unwrap();
        assert_eq!((empty.mean(), empty.standard_deviation()), (None, None));
        let equal = Moments::of(&[2.0, 2.0]).unwrap();
        assert_eq!((equal.skewness(), equal.kurtosis()), (None, None));
        assert_eq!(equal.standard_deviation(), Some(0.0));
        for bad in [f64::NAN, f64::INFINITY] {
            let error = Moments::of(&[1.0, bad]).unwrap_err();
            assert!(matches!(error, Error::NotFinite { index: 1, .. }));
        }
    }

    #[test]
    fn the_interval_of_the_mean_is_students() {
        // 1, 2, 3: mean 2, s/√3 = 1/√3, t(0.975, 2) = 4.302652729911275 in closed form below.
        let witness = Drawing::Independent.independent().unwrap();
        let t = 0.95 / (2.0_f64 * 0.975 * 0.025).sqrt();
        let interval = Moments::of(&[1.0, 2.0, 3.0])
            .unwrap()
            .mean_interval(Confidence::new(0.95).unwrap(), Sides::Two, witness)
            .unwrap();
        assert!((interval.upper() - (2.0 + t / 3_f64.sqrt())).abs() < 1e-13);
        assert!((interval.lower() - (2.0 - t / 3_f64.sqrt())).abs() < 1e-13);
    }
}
