//! Where the values come from: what a run offers to gates, asked through one trait.
//!
//! Implemented by the reader of the tables; here is no file and no table.

use super::raw::Region;
use crate::problem::Problems;
use crate::stats::Drawing;

/// Which table of a run a metric is a column of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// One row a case.
    Cases,
    /// One row a case, variant, flight time and mode.
    Modes,
}

/// What a NULL of a metric means in an evaluation that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissingMeans {
    /// No value was found: the case counts as failed.
    NoValue,
    /// The quantity does not arise, and that is good: the time to double of a stable pole.
    NotApplicableGood,
}

/// A column that gates may ask for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Metric {
    /// Name of the column.
    pub name: String,
    /// Unit as the data dictionary has it (`s`, `Hz`, `rad/s`); `1` where there is none.
    pub unit: String,
    /// Which table.
    pub table: Table,
    /// What NULL means.
    pub missing: MissingMeans,
}

/// A population of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Population {
    /// Name.
    pub name: String,
    /// Cases the run was asked for.
    pub planned: u64,
    /// How they came about.
    pub drawing: Drawing,
    /// The statements of a nested plan.
    pub nested: Option<NestedPlan>,
}

/// What a nested plan states of each outer draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NestedPlan {
    /// Cases of an outer draw, in a row.
    pub inner: u64,
    /// Share of them that may be bad.
    pub allowed_share: f64,
    /// Risk of the statement that no more are.
    pub risk: f64,
}

/// What a search for worst cases found in a region.
#[derive(Debug, Clone, PartialEq)]
pub struct Searched {
    /// Name of the worst case.
    pub name: String,
    /// The metric there; `None` where it does not arise, which is good.
    pub value: Option<f64>,
    /// The metric at the linear prediction of what the search left.
    pub at_worst: Option<f64>,
    /// Cases found in the region.
    pub cases: u64,
}

/// Which end of a case's values is its worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Worst {
    /// The smallest value.
    Smallest,
    /// The largest value.
    Largest,
}

/// What a gate asks of a run; all names have been checked against the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Query<'a> {
    /// Column.
    pub metric: &'a Metric,
    /// Population.
    pub population: &'a str,
    /// Variant; `None` for the table of cases.
    pub variant: Option<&'a str>,
    /// Variant whose value is subtracted row by row, before the reduction.
    pub baseline: Option<&'a str>,
    /// Whether the value of the baseline run is subtracted row by row, before the reduction.
    pub baseline_run: bool,
    /// Flight times, s; `None`: all.
    pub flight_times_s: Option<&'a [f64]>,
    /// Named mode; `None`: all named modes.
    pub mode: Option<&'a str>,
    /// How a case is reduced over rows: times, modes, and the branches of a mode.
    pub worst: Worst,
}

/// One case reduced to one value.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseValue {
    /// Case index.
    pub case: u64,
    /// Its worst value, `None` where no selected row holds one, or why it failed.
    pub value: Result<Option<f64>, String>,
}

/// What a run has, finished or planned.
pub trait Names {
    /// The columns that hold a number.
    fn metrics(&self) -> Vec<Metric>;
    /// The populations.
    fn populations(&self) -> Vec<Population>;
    /// The variants.
    fn variants(&self) -> Vec<String>;
    /// The flight times, s.
    fn flight_times_s(&self) -> Vec<f64>;
    /// The named modes.
    fn modes(&self) -> Vec<String>;
    /// What the run has that this one is compared with, if any.
    fn baseline(&self) -> Option<&dyn Names> {
        None
    }
}

/// A finished run as gates see it.
pub trait Source: Names {
    /// Hands one value for each case that is present to `visit`, in ascending order of case, by
    /// [`reduce`]; the same ones each time.
    fn visit(
        &self,
        query: &Query<'_>,
        visit: &mut dyn FnMut(CaseValue) -> Result<(), Problems>,
    ) -> Result<(), Problems>;

    /// The worst case that a search found in a region of so many σ, at just the flight times of the query;
    /// `None` where there was no such search.
    fn worst(
        &self,
        query: &Query<'_>,
        region: Region,
        sigma: f64,
    ) -> Result<Option<Searched>, Problems>;
}

/// Reduces the selected rows of a case to its worst.
///
/// A failed row fails the case, and so does a NULL that means that no value was found or a value
/// that is not finite: the worst of a case is not known without them.
pub fn reduce(
    rows: impl IntoIterator<Item = Result<Option<f64>, String>>,
    metric: &Metric,
    worst: Worst,
) -> Result<Option<f64>, String> {
    let mut reduced: Option<f64> = None;
    for row in rows {
        let value = match (row?, metric.missing) {
            (Some(value), _) if value.is_finite() => value,
            (Some(value), _) => return Err(format!("{} is {value}", metric.name)),
            (None, MissingMeans::NotApplicableGood) => continue,
            (None, MissingMeans::NoValue) => return Err(format!("{} has no value", metric.name)),
        };
        reduced = Some(match (reduced, worst) {
            (None, _) => value,
            (Some(so_far), Worst::Smallest) => so_far.min(value),
            (Some(so_far), Worst::Largest) => so_far.max(value),
        });
    }
    Ok(reduced)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metric(missing: MissingMeans) -> Metric {
        Metric { name: "m".into(), unit: "1".into(), table: Table::Modes, missing }
    }

    #[test]
    fn a_case_is_its_worst_row() {
        let rows = || [Ok(Some(2.0)), Ok(Some(-1.0)), Ok(Some(3.0))];
        let metric = metric(MissingMeans::NoValue);
        assert_eq!(reduce(rows(), &metric, Worst::Smallest), Ok(Some(-1.0)));
        assert_eq!(reduce(rows(), &metric, Worst::Largest), Ok(Some(3.0)));
    }

    #[test]
    fn a_row_that_failed_or_is_not_finite_fails_the_case() {
        let metric = metric(MissingMeans::NotApplicableGood);
        for bad in [Err("draw".to_string()), Ok(Some(f64::NAN)), Ok(Some(f64::INFINITY))] {
            assert!(reduce([Ok(Some(1.0)), bad], &metric, Worst::Smallest).is_err());
        }
    }

    #[test]
    fn a_missing_value_is_good_or_a_failure_as_the_metric_says() {
        let good = metric(MissingMeans::NotApplicableGood);
        assert_eq!(reduce([Ok(None), Ok(Some(4.0))], &good, Worst::Smallest), Ok(Some(4.0)));
        assert_eq!(reduce([Ok(None), Ok(None)], &good, Worst::Smallest), Ok(None));
        let none = metric(MissingMeans::NoValue);
        assert!(reduce([Ok(None), Ok(Some(4.0))], &none, Worst::Smallest).is_err());
    }
}
