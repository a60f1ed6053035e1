//! The cases that count against gates, as a flat Parquet table beside `gates.json`.
//!
//! Which cases those are is decided in `gate`.

use super::column::Column;
use super::files::Aside;
use super::table::{Table, problem};
use crate::gate::{Offender, Outcome, Report};
use crate::problem::Problems;
use crate::report::gates::replay;
use std::path::Path;

/// Name of the file in the run's folder.
pub const FILE: &str = "gate_offenders.parquet";

struct Row {
    gate: String,
    verdict: &'static str,
    population: String,
    unit: String,
    offender: Offender,
    replay: String,
}

fn columns() -> Vec<Column<Row>> {
    vec![
        Column::text("gate", "Id of the gate", |r: &Row| Some(&r.gate)),
        Column::text("verdict", "What the gate concludes", |r: &Row| Some(r.verdict)),
        Column::text("population", "Population of the case", |r: &Row| Some(&r.population)),
        Column::count("case", "Case index inside the population", |r: &Row| {
            Some(r.offender.case as i64)
        }),
        Column::number("value", "", "Worst value of the case, in `unit`; NULL where it failed", {
            |r: &Row| r.offender.value
        }),
        Column::text("unit", "Unit of the metric", |r: &Row| Some(&r.unit)),
        Column::text("failure", "Why the case failed; NULL where it has a value", |r: &Row| {
            r.offender.failure.as_deref()
        }),
        Column::text("replay", "Command that evaluates the case again", |r: &Row| Some(&r.replay)),
    ]
}

/// Writes the cases that count against the gates of a report on the run in `folder`, at most
/// [`Outcome::OFFENDERS`] a gate, the worst first.
///
/// # Errors
/// One problem if the file cannot be written.
pub fn write(report: &Report, folder: &str, target: &Path) -> Result<(), Problems> {
    let failed = |error| problem(target, &error);
    let out = Aside::beside(target)?;
    let metadata = [("most_cases_a_gate", Outcome::OFFENDERS.to_string())];
    let mut table = Table::new(columns(), &metadata, out, None).map_err(failed)?;
    for gate in &report.gates {
        for offender in &gate.offenders {
            table.push(&Row {
                gate: gate.id.clone(),
                verdict: gate.verdict.name(),
                population: gate.population.clone(),
                unit: gate.metric_unit.clone(),
                offender: offender.clone(),
                replay: replay(folder, &gate.population, offender.case),
            });
        }
    }
    table.close().map_err(failed)?.0.finish()
}
