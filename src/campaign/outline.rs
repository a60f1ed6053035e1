//! The outline of a run: all that its tables depend on and that a reader needs to understand them.
//!
//! No clock, host or thread count: two runs of one outline give the same bytes.

use super::definition::Definition;
use crate::dispersion::Draw;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Which poles the `modes` table holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StoredPoles {
    /// The poles of the named modes.
    Named,
    /// Every pole of every evaluation.
    All,
}

/// One draw key, described for a reader of the tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawColumn {
    /// Draw key, `instance path @ level # id`.
    pub key: String,
    /// Column of the drawn value in the `cases` table, `draw_…`.
    pub column: String,
    /// Unit of the drawn value.
    pub unit: String,
    /// What is drawn, by which law.
    pub description: String,
    /// Lower and upper end of a bounded law, in the unit of the value.
    pub range: Option<[f64; 2]>,
    /// Adverse values of the row that its law cannot give.
    pub beyond: Vec<f64>,
}

impl DrawColumn {
    /// The description of a draw of a dispersion.
    pub fn of(draw: &Draw) -> Self {
        let worst = draw.worst.into_iter().flatten();
        Self {
            key: draw.key.clone(),
            column: draw.column.clone(),
            unit: draw.unit.to_owned(),
            description: draw.description.to_owned(),
            range: draw.law.range(),
            beyond: worst.filter(|value| draw.law.is_outside(*value)).collect(),
        }
    }

    /// Column of the normal score in the `cases` table: `z_…`.
    pub fn score_column(&self) -> String {
        format!("z_{}", self.stem())
    }

    /// Column of the change of the damping ratio per σ in the `modes` table: `ddr_…`.
    pub fn damping_column(&self) -> String {
        format!("ddr_{}", self.stem())
    }

    /// Column of the change of the real part per σ in the `modes` table: `dre_…`.
    pub fn real_column(&self) -> String {
        format!("dre_{}", self.stem())
    }

    fn stem(&self) -> &str {
        self.column.strip_prefix("draw_").unwrap_or(&self.column)
    }

    /// Position of `value` in the range of a bounded law: 0 at the low, 1 at the high end.
    pub fn fraction_of_range(&self, value: f64) -> Option<f64> {
        self.range.map(|[low, high]| (value - low) / (high - low))
    }

    /// Whether `value` is an adverse value that the law cannot give.
    pub fn outside_law(&self, value: f64) -> bool {
        self.beyond.contains(&value)
    }
}

/// One input text or data file of the run, told by its content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Name of the input, for instance `dispersion`.
    pub name: String,
    /// BLAKE3 digest of its bytes, hexadecimal.
    pub blake3: String,
}

/// All that the tables of a run depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    /// Version of the program.
    pub program: String,
    /// The run definition.
    pub definition: Definition,
    /// Poles stored.
    pub poles: StoredPoles,
    /// Draw keys in the order of the dispersion.
    pub draws: Vec<DrawColumn>,
    /// Digests of the inputs.
    pub inputs: Vec<Input>,
}

impl Outline {
    /// The outline of a run by this version of the program.
    pub fn new(
        definition: Definition,
        poles: StoredPoles,
        draws: Vec<DrawColumn>,
        inputs: Vec<Input>,
    ) -> Self {
        let program = env!("CARGO_PKG_VERSION").to_owned();
        Self { program, definition, poles, draws, inputs }
    }

    /// Digest of all but the number of drawn cases: what two parts of one campaign have in common.
    pub fn identity(&self) -> String {
        let mut open = self.clone();
        open.definition.leave_cases_open();
        let text = serde_json::to_string(&open).expect("an outline has text keys only");
        blake3::hash(text.as_bytes()).to_hex().to_string()
    }

    /// What differs from another outline apart from the number of drawn cases: name, here, there.
    pub fn differences(&self, other: &Self) -> Vec<(String, String, String)> {
        let open = |outline: &Self| {
            let mut open = outline.clone();
            open.definition.leave_cases_open();
            let inputs = std::mem::take(&mut open.inputs);
            let value = serde_json::to_value(&open).expect("an outline has text keys only");
            let mut found = BTreeMap::new();
            let Value::Object(mut keys) = value else { return found };
            if let Some(Value::Object(definition)) = keys.remove("definition") {
                let inside = definition.into_iter();
                found.extend(inside.map(|(key, value)| (key, value.to_string())));
            }
            found.extend(keys.into_iter().map(|(key, value)| (key, value.to_string())));
            let digest = |input: Input| (input.name, format!("BLAKE3 {}", input.blake3));
            found.extend(inputs.into_iter().map(digest));
            found
        };
        let (here, there) = (open(self), open(other));
        let names: BTreeSet<&String> = here.keys().chain(there.keys()).collect();
        let text = |found: &BTreeMap<String, String>, name: &String| {
            let text = found.get(name).map_or("nothing", String::as_str);
            // Of a long list the place of the difference would not be seen anyway.
            if text.len() > 100 { "other content".to_owned() } else { text.to_owned() }
        };
        let differ = names.into_iter().filter(|name| here.get(*name) != there.get(*name));
        differ.map(|name| (name.clone(), text(&here, name), text(&there, name))).collect()
    }

    /// Number of cases of all populations.
    pub fn cases(&self) -> u64 {
        self.definition.populations.iter().map(|p| p.cases).sum()
    }
}
