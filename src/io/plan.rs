//! The draws of a run as a Parquet file of their own.

use super::files::{self, Aside};
use super::scratch::Scratch;
use super::table::{self, Table};
use super::{results, schema};
use crate::campaign::metric::ReducedCase;
use crate::campaign::row::CaseRow;
use crate::campaign::{Outline, Record};
use crate::dispersion::Sampler;
use crate::problem::Problems;
use std::path::Path;

/// Writes the draws of every case of the outline's populations; gives the number of rows.
///
/// # Errors
/// An input problem if the file exists or cannot be written.
pub fn write(path: &Path, outline: &Outline, sampler: &Sampler<'_>) -> Result<u64, Problems> {
    files::refuse_existing(path)?;
    let text = serde_json::to_string(outline).expect("an outline has text keys only");
    let failed = |error| table::problem(path, &error);
    let metadata = results::metadata(schema::TableName::Cases, &text);
    let columns = schema::plan(outline);
    let aside = Aside::beside(path)?;
    let scratch = Some(Scratch::within(files::folder_of(path))?);
    let mut table = Table::new(columns, &metadata, aside, scratch).map_err(failed)?;
    let block = schema::TableName::Cases.block_cases(outline);
    let group = schema::TableName::Cases.group_cases(outline);
    let mut cursor = sampler.cursor();
    for (index, population) in outline.definition.populations.iter().enumerate() {
        for case in 0..population.cases {
            let draws = if population.scheme.is_monte_carlo() {
                cursor.draw(case, &population.fixed, population.drawn)
            } else {
                cursor.draw_planned(case)
            };
            let record = Record {
                population: index,
                case,
                values: draws.values.clone(),
                scores: draws.scores.clone(),
                evaluations: Vec::new(),
            };
            table.push(&CaseRow {
                population: index,
                case,
                reduced: ReducedCase::new(&outline.definition, &record),
                values: record.values,
                scores: record.scores,
                loops: Vec::new(),
                failure: None,
            });
            if (case + 1) % group == 0 {
                table.end_group().map_err(failed)?;
            } else if (case + 1) % block == 0 {
                table.end_block().map_err(failed)?;
            }
        }
        table.end_group().map_err(failed)?;
    }
    let (aside, content) = table.close().map_err(failed)?;
    aside.finish()?;
    Ok(content.rows)
}
