//! Gates: rules over the reduced values of the cases of a run, and their verdicts.
//!
//! Pure: rules come from text, values from a [`Source`]; reading tables and printing are elsewhere.
//! The keys are described at [`RawGate`].

mod evaluate;
mod outcome;
mod raw;
mod resolve;
mod rule;
mod source;
mod verdict;

pub use evaluate::{check, evaluate, visit};
pub use outcome::{Offender, Outcome, Report, report_schema};
pub use raw::{RawGate, RawGates, RawSeverity, RawStatistic, Region, schema};
pub use rule::{Gate, Limit, Quantity, Selection, Sense, Statistic, parse};
pub use source::{
    CaseValue, Metric, MissingMeans, Names, NestedPlan, Population, Query, Searched, Source, Table,
    Worst, reduce,
};
pub use verdict::{Severity, Verdict, combine};
