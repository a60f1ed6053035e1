//! Every column that tables can have, described for people from the registry of `schema`.
//!
//! Names that come from a run (variants, modes, draw keys) stand in angle brackets.

use super::schema;
use crate::campaign::Outline;

/// A run with everything that gives a column: two variants, loops, replicates, an outer plan.
const EVERYTHING: &str = include_str!("reference.json");

/// A column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnDoc {
    /// Table.
    pub table: &'static str,
    /// Name, with `<variant>`, `<mode>`, `<key>` for what a run calls so.
    pub name: String,
    /// Type.
    pub type_name: &'static str,
    /// Unit; empty for text.
    pub unit: String,
    /// Meaning.
    pub description: String,
}

/// Every column of every table, in order.
///
/// # Panics
/// If the example no longer fits the outline of a run.
pub fn columns() -> Vec<ColumnDoc> {
    let outline: Outline = serde_json::from_str(EVERYTHING).expect("the example is an outline");
    let described = schema::dictionary(&outline).into_iter();
    // The first variant has no column that the second has not.
    let of_first = |column: &str| column.contains("_first_") || column.ends_with("_first");
    described
        .filter(|d| !of_first(&d.column))
        .map(|d| ColumnDoc {
            table: d.table.name(),
            name: named(&d.column),
            type_name: d.type_name,
            unit: d.unit,
            description: d
                .description
                .replace("variant variant, mode mode", "of a variant and mode")
                .replace("variant variant", "of a variant"),
        })
        .collect()
}

/// The name of a column with what a run names in angle brackets.
fn named(column: &str) -> String {
    let words =
        column.replace("_variant_mode", "_<variant>_<mode>").replace("_variant_", "_<variant>_");
    let words = match words.strip_suffix("_variant") {
        Some(stem) => format!("{stem}_<variant>"),
        None => words,
    };
    match words.strip_suffix("_key") {
        Some(stem) => format!("{stem}_<key>"),
        None => words,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_table_is_there_and_no_name_of_the_example_is_left() {
        let all = columns();
        let tables: BTreeSet<&str> = all.iter().map(|c| c.table).collect();
        assert_eq!(tables.len(), schema::TableName::ALL.len());
        let has = |table: &str, name: &str| all.iter().any(|c| c.table == table && c.name == name);
        assert!(has("cases", "damping_ratio_gain_min_<variant>_<mode>"));
        assert!(has("cases", "draw_<key>") && has("cases", "z_<key>") && has("cases", "outer"));
        assert!(has("modes", "variant") && has("modes", "mode") && has("summary", "statement"));
        assert!(all.iter().all(|c| !c.name.contains("first") && !c.description.is_empty()));
    }
}
