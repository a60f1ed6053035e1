//! Tables made of shards: rows in canonical order, cut into row groups at fixed case indices.
//!
//! So the bytes of a table depend on its rows alone, not on how the cases were shared out nor on
//! how often the run was interrupted. Memory holds one block of a row group and one shard.

use super::files::{self, Aside};
use super::results::metadata;
use super::run::Run;
use super::schema::TableName;
use super::scratch::Scratch;
use super::store::{Segment, Store};
use super::table::{self, Content, Sheet};
use crate::problem::Problems;
use arrow::array::{Array, AsArray};
use arrow::compute::concat;
use arrow::datatypes::Int64Type;
use arrow::record_batch::RecordBatch;
use std::path::Path;

/// Writes a table that follows the cases below `folder`, from all that `store` holds.
///
/// # Errors
/// Input: it cannot be written. Damage: a shard or an older table, by its name.
pub fn assemble(store: &Store, table: TableName, folder: &Path) -> Result<Content, Problems> {
    let outline = store.outline();
    let target = folder.join(table.file());
    let failed = |error| table::problem(&target, &error);
    let text = serde_json::to_string(outline).expect("an outline has text keys only");
    let aside = Aside::within(store.folder(), &target)?;
    let scratch = Some(Scratch::within(store.folder())?);
    let sheet = Sheet::new(table.fields(outline), &metadata(table, &text), aside, scratch)
        .map_err(failed)?;
    let (size, group) = (table.block_cases(outline), table.group_cases(outline));
    let mut cutter =
        Cutter { target: &target, size, blocks: group / size, block: None, pending: vec![], sheet };
    for Segment { span, shard } in store.segments() {
        let (first, last) = (span.cases.start, span.cases.end - 1);
        let mut seen: Option<(u64, u64)> = None;
        let mut take = |path: &Path, batch: &RecordBatch| -> Result<(), Problems> {
            let damage = |found: String| {
                let allowed = format!("cases {first} to {last}, each once and in order");
                Problems::damage(files::name(path), table.name(), found, allowed)
            };
            let cases = case_indices(batch).ok_or_else(|| damage("no case indices".to_owned()))?;
            for case in cases {
                let next = match seen {
                    None => case == first,
                    Some((_, before)) if table == TableName::Cases => case == before + 1,
                    Some((_, before)) => case == before || case == before + 1,
                };
                if !next {
                    return Err(damage(format!("case {case}")));
                }
                seen = Some((seen.map_or(case, |(first, _)| first), case));
            }
            cutter.push(span.population, batch)
        };
        let path = match shard {
            Some(index) => {
                let shard = &store.shards()[index];
                shard.rows(table, outline, |batch| take(&shard.path, batch))?;
                shard.path.clone()
            }
            None => {
                let run = store.tables().expect("a segment without a shard is in the tables");
                let path = run.path(table);
                old_rows(run, table, span.population, first, last, |batch| take(&path, batch))?;
                path
            }
        };
        if seen != Some((first, last)) {
            let found = seen.map_or("no case".to_owned(), |(a, b)| format!("cases {a} to {b}"));
            let allowed = format!("cases {first} to {last}");
            return Err(Problems::damage(files::name(&path), table.name(), found, allowed));
        }
    }
    cutter.end_group()?;
    let (aside, content) = cutter.sheet.close().map_err(failed)?;
    aside.finish()?;
    Ok(content)
}

/// Hands the rows of some cases in a finished table to `take`.
fn old_rows(
    run: &Run,
    table: TableName,
    population: usize,
    first: u64,
    last: u64,
    mut take: impl FnMut(&RecordBatch) -> Result<(), Problems>,
) -> Result<(), Problems> {
    run.batches(
        table,
        |_| true,
        population,
        &(first..last + 1),
        |batch| {
            let Some(cases) = case_indices(batch) else { return take(batch) };
            let from = cases.partition_point_by(|case| case < first);
            let to = cases.partition_point_by(|case| case <= last);
            if from < to { take(&batch.slice(from, to - from)) } else { Ok(()) }
        },
    )
}

/// The case indices of a batch.
struct Cases<'a>(&'a [i64], usize);

impl Cases<'_> {
    fn partition_point_by(&self, before: impl Fn(u64) -> bool) -> usize {
        self.0.partition_point(|case| before(*case as u64))
    }
}

impl Iterator for Cases<'_> {
    type Item = u64;

    fn next(&mut self) -> Option<u64> {
        let case = self.0.get(self.1)?;
        self.1 += 1;
        Some(*case as u64)
    }
}

fn case_indices(batch: &RecordBatch) -> Option<Cases<'_>> {
    let column = batch.column_by_name("case")?.as_primitive_opt::<Int64Type>()?;
    (column.null_count() == 0).then(|| Cases(column.values(), 0))
}

/// Rows on their way into blocks and row groups.
struct Cutter<'a> {
    target: &'a Path,
    /// Cases of a block.
    size: u64,
    /// Blocks of a row group.
    blocks: u64,
    /// Population and number of the block under way.
    block: Option<(usize, u64)>,
    pending: Vec<RecordBatch>,
    sheet: Sheet,
}

impl Cutter<'_> {
    fn push(&mut self, population: usize, batch: &RecordBatch) -> Result<(), Problems> {
        let cases = case_indices(batch).expect("looked at before");
        let mut from = 0;
        while from < batch.num_rows() {
            let number = cases.0[from] as u64 / self.size;
            let to = cases.partition_point_by(|case| case / self.size <= number);
            let group = |number: u64| number / self.blocks;
            match self.block {
                Some((p, n)) if (p, group(n)) != (population, group(number)) => self.end_group()?,
                Some((_, n)) if n != number => self.end_block()?,
                _ => (),
            }
            self.block = Some((population, number));
            self.pending.push(batch.slice(from, to - from));
            from = to;
        }
        Ok(())
    }

    fn end_group(&mut self) -> Result<(), Problems> {
        self.end_block()?;
        self.sheet.end_group().map_err(|error| table::problem(self.target, &error))
    }

    fn end_block(&mut self) -> Result<(), Problems> {
        let pending = std::mem::take(&mut self.pending);
        if pending.is_empty() {
            return Ok(());
        }
        let schema = self.sheet.schema().clone();
        let whole = |column: usize| {
            let parts: Vec<&dyn Array> =
                pending.iter().map(|b| b.column(column).as_ref()).collect();
            concat(&parts)
        };
        let columns: Result<Vec<_>, _> = (0..schema.fields().len()).map(whole).collect();
        let written = columns
            .and_then(|columns| RecordBatch::try_new(schema, columns))
            .map_err(Into::into)
            .and_then(|rows| self.sheet.block(&rows));
        written.map_err(|error| table::problem(self.target, &error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_of_cases_begins_with_population_and_case() {
        let outline =
            crate::campaign::synthetic::outline(&[1, 2], crate::campaign::StoredPoles::Named);
        for table in TableName::of_cases(&outline) {
            let fields = table.fields(&outline);
            assert_eq!(
                (fields[0].name().as_str(), fields[1].name().as_str()),
                ("population", "case")
            );
        }
    }
}
