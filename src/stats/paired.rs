//! Differences between two evaluations of the same draws, with intervals.
//!
//! Pairing removes what both have in common; whether two runs may be paired is decided elsewhere.

use super::{Confidence, Error, Estimate, Independent, Moments, Ordered, Probability, Sides};

/// What the differences `first − second` of paired values show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedDifference {
    /// Mean with Student's t interval.
    pub mean: Estimate,
    /// Median with the interval of the sign test, between order statistics.
    pub median: Estimate,
    /// Least difference and its position.
    pub smallest: (usize, f64),
    /// Greatest difference and its position.
    pub largest: (usize, f64),
    /// Number of pairs.
    pub pairs: usize,
}

impl PairedDifference {
    /// Differences `first[i] − second[i]`; at least two pairs, all values finite.
    pub fn of(
        first: &[f64],
        second: &[f64],
        confidence: Confidence,
        independent: Independent,
    ) -> Result<Self, Error> {
        if first.len() != second.len() {
            return Err(Error::NotPaired { left: first.len(), right: second.len() });
        }
        for values in [first, second] {
            Moments::of(values)?;
        }
        let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
        let mean = Moments::of(&differences)?.mean_interval(confidence, Sides::Two, independent)?;
        let half = Probability::new(0.5)?;
        let median = Ordered::new(&differences)?.quantile_interval(
            half,
            confidence,
            Sides::Two,
            independent,
        );
        let mut smallest = (0, differences[0]);
        let mut largest = smallest;
        for (index, &difference) in differences.iter().enumerate() {
            if difference < smallest.1 {
                smallest = (index, difference);
            }
            if difference > largest.1 {
                largest = (index, difference);
            }
        }
        Ok(Self { mean, median, smallest, largest, pairs: differences.len() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::Drawing;

    #[test]
    fn a_constant_shift_is_found_without_spread() {
        let witness = Drawing::Independent.independent().unwrap();
        let second: Vec<f64> = (0..20).map(f64::from).collect();
        let first: Vec<f64> = second.iter().map(|x| x + 0.5).collect();
        let confidence = Confidence::new(0.95).unwrap();
        let difference = PairedDifference::of(&first, &second, confidence, witness).unwrap();
        assert_eq!((difference.mean.lower(), difference.mean.upper()), (0.5, 0.5));
        assert_eq!((difference.median.lower(), difference.median.upper()), (0.5, 0.5));
        assert_eq!((difference.smallest, difference.largest), ((0, 0.5), (0, 0.5)));
    }

    #[test]
    fn extremes_name_their_position() {
        let witness = Drawing::Independent.independent().unwrap();
        let confidence = Confidence::new(0.9).unwrap();
        let difference =
            PairedDifference::of(&[1.0, 5.0, 2.0], &[1.0, 1.0, 4.0], confidence, witness).unwrap();
        assert_eq!(difference.smallest, (2, -2.0));
        assert_eq!(difference.largest, (1, 4.0));
        assert_eq!(difference.pairs, 3);
    }

    #[test]
    fn values_that_do_not_pair_are_refused() {
        let witness = Drawing::Independent.independent().unwrap();
        let confidence = Confidence::new(0.9).unwrap();
        assert_eq!(
            PairedDifference::of(&[1.0], &[1.0, 2.0], confidence, witness),
            Err(Error::NotPaired { left: 1, right: 2 })
        );
        assert!(PairedDifference::of(&[], &[], confidence, witness).is_err());
        // ∞ − ∞ would be NaN: the operand is named, not the difference.
        let infinite = [1.0, f64::INFINITY];
        assert!(PairedDifference::of(&infinite, &infinite, confidence, witness).is_err());
    }
}
