//! What a gate found: verdict, value, bound, limit, counts and the cases behind them.
//!
//! Written as `gates.json`; the table for people is made in `report`.

use super::verdict::{Severity, Verdict, combine};

/// A case that breaks the limit of a gate.
#[derive(Debug, Clone, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct Offender {
    /// Case index inside the population.
    pub case: u64,
    /// Its worst value, in the unit of the metric; null for a failed case.
    pub value: Option<f64>,
    /// Why it failed; null for a case with a value.
    pub failure: Option<String>,
}

/// What a gate found.
#[derive(Debug, Clone, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct Outcome {
    /// Name of the gate.
    pub id: String,
    /// The population whose cases are held against the limit.
    pub population: String,
    /// What it concludes.
    pub verdict: Verdict,
    /// Whether it decides the exit code.
    pub severity: Severity,
    /// What is held against the limit, in words.
    pub statistic: String,
    /// Its value for the sample, in `unit`; null where a failed case stands in its place or where
    /// no case has one.
    pub value: Option<f64>,
    /// The confidence bound that is held against the limit, in `unit`; null where the sample is
    /// too small for one, where a failed case stands in its place or where no case has one.
    pub bound: Option<f64>,
    /// `at_least` or `at_most`.
    pub sense: &'static str,
    /// The limit, in `unit`.
    pub limit: f64,
    /// Unit of value, bound and limit.
    pub unit: String,
    /// Confidence of the verdict; null for a statement about the evaluated cases only.
    pub confidence: Option<f64>,
    /// Cases that are present, failed ones included.
    pub cases: u64,
    /// Cases that failed; they count as violations.
    pub failures: u64,
    /// Cases that were planned and are not present.
    pub missing: u64,
    /// Cases that count against the gate: beyond the limit or the threshold, or failed.
    pub violations: u64,
    /// Most violations with which this number of cases would pass; null where it cannot pass.
    pub most_violations: Option<u64>,
    /// Case with the worst value.
    pub worst_case: Option<u64>,
    /// The worst value, in the unit of the metric.
    pub worst_value: Option<f64>,
    /// Unit of the metric.
    pub metric_unit: String,
    /// Further cases needed for a pass if none of them is a violation.
    pub cases_needed: Option<u64>,
    /// Further cases needed for a pass if violations go on at the observed rate; null where no
    /// number is enough.
    pub cases_needed_at_observed_rate: Option<u64>,
    /// The worst violations, failed cases first. `gates.json` lists 20; up to 1000 are stored as a
    /// table beside it.
    #[serde(serialize_with = "listed")]
    pub offenders: Vec<Offender>,
    /// One sentence for people.
    pub message: String,
    /// Why the gate is there.
    pub rationale: String,
}

impl Outcome {
    /// Offenders kept at most.
    pub const OFFENDERS: usize = 1000;
    /// Offenders listed in `gates.json` at most.
    pub const LISTED: usize = 20;
}

fn listed<S: serde::Serializer>(offenders: &[Offender], serializer: S) -> Result<S::Ok, S::Error> {
    serde::Serialize::serialize(&offenders[..offenders.len().min(Outcome::LISTED)], serializer)
}

/// All outcomes, as `gates.json` has them.
#[derive(Debug, Clone, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct Report {
    /// Version of this layout.
    pub schema_version: u32,
    /// The verdict of all gates together.
    pub verdict: Verdict,
    /// Exit code that goes with it.
    pub exit_code: u8,
    /// Gates that make a statement with a confidence: each of them holds with its own.
    pub claims_at_once: usize,
    /// The gates in file order.
    pub gates: Vec<Outcome>,
}

impl Report {
    /// Puts the outcomes together.
    pub fn new(gates: Vec<Outcome>) -> Self {
        let verdict = combine(gates.iter().map(|gate| (gate.severity, gate.verdict)));
        Self {
            schema_version: 1,
            verdict,
            exit_code: verdict.exit_code(),
            claims_at_once: gates.iter().filter(|gate| gate.confidence.is_some()).count(),
            gates,
        }
    }

    /// The text of `gates.json`.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers, texts and lists always serialise")
            + "\n"
    }
}

/// The JSON Schema of `gates.json`.
pub fn report_schema() -> schemars::Schema {
    schemars::generate::SchemaSettings::draft2020_12()
        .for_serialize()
        .into_generator()
        .into_root_schema_for::<Report>()
}
