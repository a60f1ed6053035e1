//! How the cases of a population came about, as far as statistics need it: which intervals follow.
//!
//! What is summed up is decided in `summary` and `statistics`.

use super::definition::Population;
use crate::dispersion::Scheme;
use crate::stats::{Confidence, Drawing, Estimate, Independent, of_replicates};

/// Confidence of the intervals of the summary.
pub const CONFIDENCE: f64 = 0.95;

/// Where the intervals of a row come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Intervals {
    /// Independent cases: exact binomial, Student's t, order statistics.
    Independent,
    /// Independent replicates of a design, or outer draws: Student's t over their results.
    Replicates,
    /// None follows from the cases.
    None,
}

impl Intervals {
    /// Every one, in the order of declaration.
    pub const ALL: [Self; 3] = [Self::Independent, Self::Replicates, Self::None];

    /// The word stored in the `intervals` column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent_cases",
            Self::Replicates => "replicates",
            Self::None => "none",
        }
    }
}

/// How cases came about, as far as intervals need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    drawing: Drawing,
    clusters: Clusters,
    /// Share of bad cases that an outer draw may have, and the risk of the statement.
    statement: Option<(f64, f64)>,
}

/// Which cases belong to a replicate, or to an outer draw.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Clusters {
    /// Cases take turns among so many replicates.
    Turns(usize),
    /// So many cases in a row.
    Rows(usize),
}

impl Sample {
    /// Independent cases.
    pub const INDEPENDENT: Self =
        Self { drawing: Drawing::Independent, clusters: Clusters::Turns(1), statement: None };

    /// The cases of a population.
    pub fn of(population: &Population) -> Self {
        let clusters = match population.scheme {
            Scheme::Nested { inner, .. } => Clusters::Rows(inner as usize),
            ref scheme => Clusters::Turns(scheme.replicates() as usize),
        };
        let statement = match population.scheme {
            Scheme::Nested { allowed_share, risk, .. } => Some((allowed_share, risk)),
            _ => None,
        };
        Self { drawing: population.drawing(), clusters, statement }
    }

    /// Cases that take turns among so many replicates.
    pub(super) const fn turns(drawing: Drawing, replicates: usize) -> Self {
        Self { drawing, clusters: Clusters::Turns(replicates), statement: None }
    }

    /// Cases of an outer draw of a nested plan, and the share of bad ones that it may have with the
    /// risk of saying so.
    pub fn nested(&self) -> Option<(u64, f64, f64)> {
        match (self.clusters, self.statement) {
            (Clusters::Rows(inner), Some((allowed, risk))) => Some((inner as u64, allowed, risk)),
            _ => None,
        }
    }

    /// Number of replicates among which cases take turns, where intervals follow from them.
    pub(super) fn turning(&self) -> usize {
        match (self.drawing, self.clusters) {
            (Drawing::LatinHypercube | Drawing::LowDiscrepancy, Clusters::Turns(count)) => count,
            _ => 1,
        }
    }

    /// How the cases came about.
    pub fn drawing(&self) -> Drawing {
        self.drawing
    }

    /// Number of cases by which a first part of them may grow and be a sample itself.
    ///
    /// # Errors
    /// How the cases came about, where no first part is a sample.
    pub fn step(&self) -> Result<usize, Drawing> {
        match (self.drawing, self.clusters) {
            (Drawing::Independent, _) => Ok(1),
            (Drawing::LowDiscrepancy, Clusters::Turns(step))
            | (Drawing::Nested, Clusters::Rows(step)) => Ok(step.max(1)),
            (drawing, _) => Err(drawing),
        }
    }

    /// Number of replicates or outer draws.
    pub fn replicates(&self, cases: usize) -> usize {
        match self.clusters {
            Clusters::Turns(count) => count,
            Clusters::Rows(length) => cases / length.max(1),
        }
    }

    /// The values of each replicate or outer draw; NaN is no value.
    pub(super) fn split(&self, values: &[f64]) -> Vec<Vec<f64>> {
        match self.clusters {
            Clusters::Turns(count) => (0..count)
                .map(|turn| known(values.iter().skip(turn).step_by(count.max(1))))
                .collect(),
            Clusters::Rows(length) => values.chunks(length.max(1)).map(known).collect(),
        }
    }

    /// The interval of a statistic: `exact` for independent cases, else from its replicates.
    pub(super) fn interval(
        &self,
        values: &[f64],
        exact: impl Fn(Independent) -> Option<[f64; 2]>,
        statistic: impl Fn(&[f64]) -> Option<f64>,
    ) -> Option<[f64; 2]> {
        if let Ok(independent) = self.drawing.independent() {
            return exact(independent);
        }
        let replicates = self.replicates(values.len());
        let independent = self.drawing.independent_replicates(replicates as u64).ok()?;
        let of_each: Option<Vec<f64>> = self.split(values).iter().map(|v| statistic(v)).collect();
        let confidence = Confidence::new(CONFIDENCE).ok()?;
        of_replicates(&of_each?, confidence, independent).ok().map(ends)
    }

    /// Replicate or outer draw of a case.
    pub(super) fn cluster(&self, case: u64) -> usize {
        match self.clusters {
            Clusters::Turns(count) => case as usize % count.max(1),
            Clusters::Rows(length) => case as usize / length.max(1),
        }
    }

    /// Why no interval follows from so many cases, and how to get some; none where intervals follow.
    pub fn without_intervals(&self, cases: usize) -> Option<String> {
        if self.intervals(cases) != Intervals::None {
            return None;
        }
        let what = self.drawing.describe();
        Some(match self.drawing {
            Drawing::LatinHypercube | Drawing::LowDiscrepancy => format!(
                "no intervals: one replicate of {what} shows nothing of its error; run again with `replicates = 8` \
                 (two or more, each of cases/replicates points) under [plan] of the run file"
            ),
            Drawing::Nested => format!(
                "no intervals: these cases are {what}, and one outer draw shows nothing of its error; run again with \
                 `outer = 30` (two or more) under [plan] of the run file"
            ),
            _ => format!("no intervals: these cases are {what}"),
        })
    }

    /// Where intervals come from, of so many cases.
    pub fn intervals(&self, cases: usize) -> Intervals {
        let replicates = self.replicates(cases) as u64;
        if self.drawing.independent().is_ok() {
            Intervals::Independent
        } else if self.drawing.independent_replicates(replicates).is_ok() {
            Intervals::Replicates
        } else {
            Intervals::None
        }
    }
}

pub(super) fn ends(estimate: Estimate) -> [f64; 2] {
    [estimate.lower(), estimate.upper()]
}

/// The values that are no NaN.
pub(super) fn known<'a>(values: impl IntoIterator<Item = &'a f64>) -> Vec<f64> {
    values.into_iter().copied().filter(|value| !value.is_nan()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_without_intervals_says_how_to_get_them() {
        for drawing in [Drawing::LatinHypercube, Drawing::LowDiscrepancy] {
            let words = Sample::turns(drawing, 1).without_intervals(100).unwrap();
            assert!(words.contains("`replicates = 8`") && words.contains("[plan]"), "{words}");
            assert_eq!(Sample::turns(drawing, 2).without_intervals(100), None);
        }
        let designed = Sample::turns(Drawing::Designed, 1).without_intervals(100).unwrap();
        assert_eq!(designed, "no intervals: these cases are chosen points, not draws");
        assert_eq!(Sample::INDEPENDENT.without_intervals(100), None);
    }
}
