//! The gate file as it is written: its keys, their types and their JSON Schema.
//!
//! What a combination of keys means, and whether it is allowed, is decided in `rule`.

use crate::problem::Problems;
use crate::spelling::allowed_instead;
use std::collections::BTreeMap;

/// A gate file: a list of gates.
#[derive(Debug, Clone, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawGates {
    /// The gates.
    #[schemars(length(min = 1))]
    pub gate: Vec<RawGate>,
}

/// One gate.
///
/// Beside the keys below a gate has a limit, `at_least_<unit>` or `at_most_<unit>`, and, for the
/// statistics `share_below`, `share_above` and `nested_statement`, a `threshold_<unit>`. The unit is that of the metric
/// as column names write it (`s`, `hz`, `rad_s`; `1` or `percent` for a metric without unit); the
/// limit of a share is in `percent` or `1`.
#[derive(Debug, Clone, Default, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(extend(
    "required" = ["id", "metric", "statistic", "rationale"],
    "patternProperties" = {
        "^(at_least|at_most|threshold)_[a-z0-9_]+$": { "type": "number" }
    }
))]
pub struct RawGate {
    /// Name of the gate, `[a-z0-9_-]+`, once in the file.
    pub id: Option<String>,
    /// Column of the table `modes` or `cases`.
    pub metric: Option<String>,
    /// Population of cases; `dispersed` unless given.
    pub population: Option<String>,
    /// Variant of the run; needed for columns of `modes`.
    pub variant: Option<String>,
    /// Variant to compare with: the metric becomes its value in `variant` less that in `baseline`,
    /// on the same draw, flight time and mode.
    pub baseline: Option<String>,
    /// Whether the metric is its value in this run less that in the baseline run that the command
    /// names (`--baseline`), on the same draw, flight time and mode.
    pub baseline_run: Option<bool>,
    /// Flight times, s; all unless given. A case counts with its worst.
    pub flight_times_s: Option<Vec<f64>>,
    /// Named mode; all unless given. A case counts with its worst.
    pub mode: Option<String>,
    /// What is held against the limit.
    pub statistic: Option<RawStatistic>,
    /// Level of the quantile, between 0 and 1.
    pub quantile: Option<f64>,
    /// Share of the population that a tolerance bound covers, between 0 and 1.
    pub coverage: Option<f64>,
    /// Region that `tvse worst` searched.
    pub region: Option<Region>,
    /// Half width of the box or radius of the ellipsoid, σ, as `tvse worst` was told.
    pub sigma: Option<f64>,
    /// Confidence of the verdict, above 0.5 and below 1 (or give `risk`).
    pub confidence: Option<f64>,
    /// Consumer's risk, 1 − confidence.
    pub risk: Option<f64>,
    /// Whether the gate decides the exit code; `error` unless given.
    pub severity: Option<RawSeverity>,
    /// Least number of cases for a pass; 1 unless given.
    #[schemars(range(min = 1))]
    pub min_cases: Option<u64>,
    /// Why the gate is there and its limit is what it is.
    pub rationale: Option<String>,
}

/// What is held against the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RawStatistic {
    /// The least value of all cases, `at_least` the limit: every case holds. Says nothing of cases
    /// that were not evaluated.
    Minimum,
    /// The greatest value of all cases, `at_most` the limit.
    Maximum,
    /// Share of the population with a value below the threshold, by its exact binomial bound.
    ShareBelow,
    /// Share of the population with a value above the threshold, by its exact binomial bound.
    ShareAbove,
    /// Quantile of the population, by its distribution-free bound.
    Quantile,
    /// Bound that `coverage` of the population keeps, an order statistic (Wilks; consumer's risk).
    ToleranceBound,
    /// Of a nested plan, the share of outer draws whose inner cases show, at the plan's risk, that at most
    /// the plan's allowed share lies below the threshold; `at_least` the limit, by its exact bound.
    NestedStatement,
    /// The worst of what `tvse worst` found in the `region` of `sigma`, `at_least` the limit. A search, no
    /// sample: nothing is said of a share.
    WorstOnWorst,
}

/// Region of a search for worst cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// Every draw key within ±sigma: vertices, corners and descents.
    Box,
    /// All keys together within sigma, √Σz²: equal joint likelihood.
    Ellipsoid,
}

impl Region {
    /// The word in gate files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Ellipsoid => "ellipsoid",
        }
    }
}

/// Whether a gate decides the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RawSeverity {
    /// It does.
    Error,
    /// It is only shown.
    Warning,
}

/// The JSON Schema of gate files.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(RawGates)
}

/// Beginnings of the keys that end with a unit.
pub(super) const PREFIXES: [&str; 3] = ["at_least_", "at_most_", "threshold_"];

/// A gate and its keys that end with a unit.
#[derive(Debug, Clone, Default)]
pub(super) struct Entry {
    pub gate: RawGate,
    pub limits: BTreeMap<String, f64>,
    /// Keys whose value was refused: a rule does not also call them missing.
    pub refused: Vec<String>,
}

/// Reads the gates; a gate with problems keeps what could be read.
pub(super) fn read(text: &str, file: &str) -> (Vec<Entry>, Problems) {
    let mut problems = Problems::default();
    let mut table = match text.parse::<toml::Table>() {
        Ok(table) => table,
        Err(error) => {
            let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            let found = format!("{} in line {line}", error.message());
            return (Vec::new(), Problems::input(file, "", found, "valid TOML"));
        }
    };
    let gates = table.remove("gate");
    for key in table.keys() {
        problems.extend(Problems::input(
            file,
            key,
            "an unknown key",
            allowed_instead(key, ["gate"]),
        ));
    }
    let entries = match gates {
        Some(toml::Value::Array(gates)) if !gates.is_empty() => gates
            .into_iter()
            .enumerate()
            .map(|(index, gate)| read_gate(gate, file, &format!("gate[{index}]"), &mut problems))
            .collect(),
        other => {
            let found = other.map_or("nothing", |value| match value {
                toml::Value::Array(_) => "no gate",
                _ => "no list",
            });
            problems.extend(Problems::input(file, "gate", found, "at least one [[gate]]"));
            Vec::new()
        }
    };
    (entries, problems)
}

/// Reads every key by itself, so that one wrong key does not hide the next.
fn read_gate(gate: toml::Value, file: &str, path: &str, problems: &mut Problems) -> Entry {
    let toml::Value::Table(table) = gate else {
        problems.extend(Problems::input(file, path, gate.type_str(), "a table [[gate]]"));
        return Entry::default();
    };
    let known = known_keys();
    let mut entry = Entry::default();
    let mut sound = toml::Table::new();
    for (key, value) in table {
        let path = format!("{path}.{key}");
        if PREFIXES.iter().any(|prefix| key.starts_with(prefix)) {
            match number(&value) {
                Some(number) => {
                    entry.limits.insert(key, number);
                }
                None => {
                    problems.extend(Problems::input(file, path, show(&value), "a finite number"));
                    entry.refused.push(key);
                }
            }
        } else if !known.contains(&key) {
            let mut all = known.clone();
            all.extend(PREFIXES.map(|prefix| format!("{prefix}<unit>")));
            let allowed = allowed_instead(&key, all.iter().map(|n| n.as_ref()));
            problems.extend(Problems::input(file, path, "an unknown key", allowed));
        } else {
            let alone = toml::Table::from_iter([(key.clone(), value.clone())]);
            match alone.try_into::<RawGate>() {
                Ok(_) => {
                    sound.insert(key, value);
                }
                Err(error) => {
                    let allowed = error.message().lines().next().unwrap_or_default();
                    problems.extend(Problems::input(file, path, show(&value), allowed));
                    entry.refused.push(key);
                }
            }
        }
    }
    // Every key was read by itself, so all of them can be read together.
    entry.gate = sound.try_into().unwrap_or_default();
    entry
}

/// A finite number, written with or without a decimal point.
fn number(value: &toml::Value) -> Option<f64> {
    let number = match value {
        toml::Value::Integer(integer) => *integer as f64,
        toml::Value::Float(float) => *float,
        _ => return None,
    };
    number.is_finite().then_some(number)
}

fn show(value: &toml::Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// The keys of a gate, from its schema.
fn known_keys() -> Vec<String> {
    let schema = schemars::schema_for!(RawGate);
    schema
        .get("properties")
        .and_then(|properties| properties.as_object())
        .map(|properties| properties.keys().cloned().collect())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_knows_every_key_and_forbids_others() {
        let schema = serde_json::to_value(schema()).unwrap();
        let gate = &schema["$defs"]["RawGate"];
        assert_eq!(gate["additionalProperties"], false);
        for key in known_keys() {
            assert!(gate["properties"][&key].is_object(), "{key}");
        }
        assert!(gate["required"].as_array().unwrap().contains(&"rationale".into()));
        assert!(gate["patternProperties"].is_object());
    }
}
