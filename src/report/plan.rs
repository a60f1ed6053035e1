//! What the draws of a run look like beside their laws, as a table for the terminal.

use super::significant;
use crate::campaign::Definition;
use crate::dispersion::{Draw, Sampler};
use crate::stats::Moments;
use comfy_table::{CellAlignment, Table, presets};

/// Per draw key: unit, law range, and mean, standard deviation, smallest and largest value over
/// the cases of the `dispersed` population.
pub fn table(definition: &Definition, draws: &[Draw], sampler: &Sampler<'_>) -> String {
    let dispersed = definition.populations.iter().find(|p| p.name == "dispersed");
    let cases = dispersed.map_or(0, |p| p.cases);
    let scheme = dispersed.map_or_else(String::new, |p| p.scheme.describe());
    let mut values = vec![Vec::new(); draws.len()];
    let mut cursor = sampler.cursor();
    for case in 0..cases {
        let drawn = cursor.draw_planned(case);
        for (value, values) in drawn.values.iter().zip(&mut values) {
            values.extend(value);
        }
    }
    let mut table = Table::new();
    table
        .load_style(presets::ASCII_MARKDOWN)
        .set_header(["draw key", "unit", "law", "mean", "sd", "smallest", "largest"]);
    for (draw, values) in draws.iter().zip(&values) {
        let law = draw.law.range().map_or("unbounded".to_owned(), |[low, high]| {
            format!("{} to {}", significant(low), significant(high))
        });
        let moments = Moments::of(values).ok();
        let shown = |value: Option<f64>| value.map_or_else(String::new, significant);
        table.add_row([
            draw.key.clone(),
            draw.unit.to_owned(),
            law,
            shown(moments.and_then(|m| m.mean())),
            shown(moments.and_then(|m| m.standard_deviation())),
            shown(values.iter().copied().min_by(f64::total_cmp)),
            shown(values.iter().copied().max_by(f64::total_cmp)),
        ]);
    }
    for column in table.column_iter_mut().skip(3) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    format!(
        "{cases} dispersed cases, {scheme}, seed {}, {} draw keys\n{table}\n",
        definition.seed,
        draws.len()
    )
}
