//! An estimate that cannot lose its interval.
//!
//! How intervals are made is in `proportion`, `moments`, `quantile`, `tolerance`, `bootstrap`.

use super::Confidence;

/// On which sides an estimate is bounded; an open side holds the end of the quantity's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    /// An interval; half of the risk on each side.
    Two,
    /// A lower bound; the whole risk below.
    Lower,
    /// An upper bound; the whole risk above.
    Upper,
}

impl Sides {
    /// Risks below the lower and above the upper end; `None` where the side is open.
    pub(super) fn risks(self, confidence: Confidence) -> (Option<f64>, Option<f64>) {
        let risk = confidence.risk();
        match self {
            Self::Two => (Some(risk / 2.0), Some(risk / 2.0)),
            Self::Lower => (Some(risk), None),
            Self::Upper => (None, Some(risk)),
        }
    }
}

/// How the interval of an estimate was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Exact binomial interval of Clopper and Pearson.
    ClopperPearson,
    /// Student's t interval of a mean.
    StudentT,
    /// Fisher's transformation of a correlation.
    Fisher,
    /// Distribution-free interval between order statistics.
    OrderStatistics,
    /// Student's t interval over independent replicates.
    Replicates,
    /// Percentile bootstrap.
    BootstrapPercentile,
    /// Bias-corrected and accelerated bootstrap.
    BootstrapBca,
}

impl Method {
    /// The word used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::ClopperPearson => "clopper_pearson",
            Self::StudentT => "student_t",
            Self::Fisher => "fisher",
            Self::OrderStatistics => "order_statistics",
            Self::Replicates => "replicates",
            Self::BootstrapPercentile => "bootstrap_percentile",
            Self::BootstrapBca => "bootstrap_bca",
        }
    }
}

/// A point estimate with its interval, the confidence of that and the method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    point: f64,
    lower: f64,
    upper: f64,
    sides: Sides,
    confidence: Confidence,
    method: Method,
}

impl Estimate {
    pub(super) fn new(
        point: f64,
        (lower, upper): (f64, f64),
        sides: Sides,
        confidence: Confidence,
        method: Method,
    ) -> Self {
        debug_assert!(lower <= upper, "interval from {lower} to {upper}");
        Self { point, lower, upper, sides, confidence, method }
    }

    /// The point estimate.
    pub fn point(&self) -> f64 {
        self.point
    }

    /// Lower end; −∞ or the least possible value where the sample gives none.
    pub fn lower(&self) -> f64 {
        self.lower
    }

    /// Upper end; +∞ or the greatest possible value where the sample gives none.
    pub fn upper(&self) -> f64 {
        self.upper
    }

    /// On which sides the estimate is bounded.
    pub fn sides(&self) -> Sides {
        self.sides
    }

    /// Confidence that the interval covers; exact methods cover at least that often.
    pub fn confidence(&self) -> Confidence {
        self.confidence
    }

    /// How the interval was made.
    pub fn method(&self) -> Method {
        self.method
    }
}
