//! What feedback does to the damping of the named modes, counted over the cases.
//!
//! The paired gain of a case is a metric; reading it from a run is left to `io`.

use super::definition::{Definition, Feedback};

/// Cases in which feedback lowers the damping that are kept by number.
pub const MOST_LOWERED: usize = 20;

/// What feedback adds to the damping ratio of a mode over the cases of a population, the least over
/// the flight times of each case.
#[derive(Debug, Clone, PartialEq)]
pub struct Added {
    /// Index of the population.
    pub population: usize,
    /// Index of the variant with feedback; the first variant is the same without.
    pub variant: usize,
    /// Index of the mode.
    pub mode: usize,
    /// Cases of the population.
    pub cases: u64,
    /// Cases without the two damping ratios: they failed in one of the variants.
    pub missing: u64,
    /// Least damping added, −, and its case.
    pub least: Option<(f64, u64)>,
    /// Cases in which it is not above zero.
    pub lowered: u64,
    /// The first of these.
    pub first_lowered: Vec<u64>,
}

/// The variants that are the first one with its feedback changed from open.
pub fn variants(definition: &Definition) -> Vec<usize> {
    let Some(first) = definition.variants.first().filter(|v| v.feedback == Feedback::Open) else {
        return Vec::new();
    };
    let same = |index: &usize| {
        let variant = &definition.variants[*index];
        let mut open = variant.clone();
        open.name.clone_from(&first.name);
        open.feedback = Feedback::Open;
        variant.feedback != Feedback::Open && open == *first
    };
    (1..definition.variants.len()).filter(same).collect()
}

impl Added {
    /// Of a population with so many cases, before the first one.
    pub fn new([population, variant, mode]: [usize; 3], cases: u64) -> Self {
        let first_lowered = Vec::new();
        Self {
            population,
            variant,
            mode,
            cases,
            missing: 0,
            least: None,
            lowered: 0,
            first_lowered,
        }
    }

    /// Counts a case; NaN where it has no gain.
    pub fn add(&mut self, case: u64, gain: f64) {
        if gain.is_nan() {
            self.missing += 1;
            return;
        }
        if self.least.is_none_or(|(least, _)| gain < least) {
            self.least = Some((gain, case));
        }
        if !(gain > 0.0) {
            self.lowered += 1;
            if self.first_lowered.len() < MOST_LOWERED {
                self.first_lowered.push(case);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic;
    use super::*;

    #[test]
    fn only_variants_that_differ_by_feedback_alone_are_compared() {
        let mut definition = synthetic::definition(&[1, 3]);
        let open = definition.variants[0].clone();
        let closed = |name: &str| crate::campaign::Variant {
            name: name.to_owned(),
            feedback: Feedback::Closed,
            ..open.clone()
        };
        let mut other = closed("closed_and_rigid");
        other.rigid_body = true;
        definition.variants.extend([closed("closed"), other]);
        assert_eq!(variants(&definition), [2]);
        definition.variants[0].feedback = Feedback::Inverted;
        assert!(variants(&definition).is_empty());
    }

    #[test]
    fn cases_that_are_lowered_or_lost_are_counted_and_named() {
        let mut found = Added::new([1, 1, 0], 5);
        for (case, gain) in [0.01, -0.002, f64::NAN, 0.0, 0.03].into_iter().enumerate() {
            found.add(case as u64, gain);
        }
        assert_eq!((found.missing, found.lowered), (1, 2));
        assert_eq!(found.least, Some((-0.002, 1)));
        assert_eq!(found.first_lowered, [1, 3]);
    }
}
