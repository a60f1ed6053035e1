//! A gate, checked: what is held against which limit, with which confidence.
//!
//! Whether a run has what the gate asks for is checked in `evaluate`.

use super::raw::{Entry, PREFIXES, RawSeverity, RawStatistic, Region, read};
use super::verdict::Severity;
use crate::problem::Problems;
use crate::stats::{Confidence, Probability};
use std::collections::BTreeSet;
use std::fmt;

/// On which side of the limit it is good.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// At the limit or above.
    AtLeast,
    /// At the limit or below.
    AtMost,
}

/// A number with the unit that its key names.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// The number as written.
    pub value: f64,
    /// The unit as column names write it; `1` and `percent` have no dimension.
    pub unit: String,
}

impl Quantity {
    /// Size of the unit in that of the metric: 0.01 for percent.
    pub fn scale(&self) -> f64 {
        if self.unit == "percent" { 0.01 } else { 1.0 }
    }

    /// The number in the unit of the metric.
    pub fn base(&self) -> f64 {
        if self.unit == "percent" { self.value / 100.0 } else { self.value }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit.as_str() {
            "1" => write!(f, "{}", self.value),
            "percent" => write!(f, "{} %", self.value),
            unit => write!(f, "{} {unit}", self.value),
        }
    }
}

/// The limit of a gate.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// On which side it is good.
    pub sense: Sense,
    /// The limit.
    pub quantity: Quantity,
}

/// What is held against the limit.
#[derive(Debug, Clone, PartialEq)]
pub enum Statistic {
    /// The worst case itself: minimum for a limit from below, maximum for one from above.
    Extreme,
    /// Share of the population with a value below the threshold.
    ShareBelow {
        /// Threshold of the metric.
        threshold: Quantity,
        /// Confidence of the verdict.
        confidence: Confidence,
    },
    /// Share of the population with a value above the threshold.
    ShareAbove {
        /// Threshold of the metric.
        threshold: Quantity,
        /// Confidence of the verdict.
        confidence: Confidence,
    },
    /// Quantile of the population.
    Quantile {
        /// Level.
        level: Probability,
        /// Confidence of the verdict.
        confidence: Confidence,
    },
    /// The value that a share of the population keeps.
    ToleranceBound {
        /// Share of the population.
        coverage: Probability,
        /// Confidence of the verdict.
        confidence: Confidence,
    },
    /// Share of outer draws of a nested plan of which its statement on values below the threshold is shown.
    NestedStatement {
        /// Threshold of the metric.
        threshold: Quantity,
        /// Confidence of the verdict.
        confidence: Confidence,
    },
    /// The worst case of a search.
    WorstOnWorst {
        /// Where it was searched.
        region: Region,
        /// Its size, σ.
        sigma: f64,
    },
}

/// Which rows of which cases count.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Population.
    pub population: String,
    /// Variant.
    pub variant: Option<String>,
    /// Variant whose value is subtracted.
    pub baseline: Option<String>,
    /// Whether the value of the baseline run is subtracted.
    pub baseline_run: bool,
    /// Flight times, s; `None`: all.
    pub flight_times_s: Option<Vec<f64>>,
    /// Named mode; `None`: all.
    pub mode: Option<String>,
}

/// A gate whose keys agree with each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Gate {
    /// Name, once in its file.
    pub id: String,
    /// Column.
    pub metric: String,
    /// Which rows count.
    pub selection: Selection,
    /// What is held against the limit.
    pub statistic: Statistic,
    /// The limit.
    pub limit: Limit,
    /// Whether the gate decides the exit code.
    pub severity: Severity,
    /// Least number of cases for a pass.
    pub min_cases: u64,
    /// Why the gate is there.
    pub rationale: String,
}

/// Reads a gate file; every problem of the file at once.
pub fn parse(text: &str, file: &str) -> Result<Vec<Gate>, Problems> {
    let (entries, mut problems) = read(text, file);
    let mut seen = BTreeSet::new();
    let mut gates = Vec::new();
    for (index, entry) in entries.into_iter().enumerate() {
        let refused = entry.refused.clone();
        let mut check = Check { file, index, refused, problems: &mut problems };
        if let Some(id) = &entry.gate.id
            && !seen.insert(id.clone())
        {
            check.problem("id", format!("{id:?} for the second time"), "a name used once");
        }
        gates.extend(check.gate(entry));
    }
    problems.into_result(gates)
}

/// Checks one gate and notes its problems.
struct Check<'a> {
    file: &'a str,
    index: usize,
    refused: Vec<String>,
    problems: &'a mut Problems,
}

impl Check<'_> {
    fn problem(&mut self, key: &str, found: impl Into<String>, allowed: impl Into<String>) {
        let reported = |refused: &String| match key {
            "limit" => PREFIXES[..2].iter().any(|prefix| refused.starts_with(prefix)),
            "threshold" => refused.starts_with(PREFIXES[2]),
            _ => refused == key,
        };
        if self.refused.iter().any(reported) {
            return;
        }
        let path = format!("gate[{}].{key}", self.index);
        self.problems.extend(Problems::input(self.file, path, found, allowed));
    }

    /// A text that must be there and not be blank.
    fn text(&mut self, key: &str, value: Option<String>) -> Option<String> {
        match value {
            Some(text) if !text.trim().is_empty() => Some(text),
            found => {
                self.problem(key, found.map_or("nothing", |_| "an empty text"), "a text");
                None
            }
        }
    }

    /// A number strictly between 0 and 1 under `key`.
    fn probability(&mut self, key: &str, value: Option<f64>) -> Option<Probability> {
        let found = match value {
            None => "nothing".to_string(),
            Some(value) => match Probability::new(value) {
                Ok(probability) => return Some(probability),
                Err(_) => value.to_string(),
            },
        };
        self.problem(key, found, "a number above 0 and below 1");
        None
    }

    fn confidence(&mut self, confidence: Option<f64>, risk: Option<f64>) -> Option<Confidence> {
        const ALLOWED: &str = "confidence above 0.5 and below 1, or risk above 0 and below 0.5";
        let (key, value, read) = match (confidence, risk) {
            (Some(value), None) => ("confidence", value, Confidence::new(value)),
            (None, Some(value)) => ("risk", value, Confidence::from_risk(value)),
            (both, _) => {
                let found = if both.is_some() { "both confidence and risk" } else { "nothing" };
                self.problem("confidence", found, ALLOWED);
                return None;
            }
        };
        // At a risk of one half and more a gate could be shown to pass and to fail at once.
        match read {
            Ok(confidence) if confidence.risk() < 0.5 => Some(confidence),
            _ => {
                self.problem(key, value.to_string(), ALLOWED);
                None
            }
        }
    }

    /// The one key that begins with one of the prefixes.
    fn quantity(
        &mut self,
        entry: &Entry,
        prefixes: &[&str],
        label: &str,
    ) -> Option<(usize, Quantity)> {
        let found: Vec<(usize, &String, f64)> = entry
            .limits
            .iter()
            .filter_map(|(key, &value)| {
                let index = prefixes.iter().position(|prefix| key.starts_with(prefix))?;
                Some((index, key, value))
            })
            .collect();
        let allowed =
            prefixes.iter().map(|p| format!("{p}<unit>")).collect::<Vec<_>>().join(" or ");
        match found[..] {
            [(index, key, value)] => {
                let unit = key[prefixes[index].len()..].to_string();
                Some((index, Quantity { value, unit }))
            }
            [] => {
                self.problem(label, "nothing", allowed);
                None
            }
            _ => {
                let keys = found.iter().map(|(_, key, _)| key.as_str()).collect::<Vec<_>>();
                self.problem(label, keys.join(" and "), format!("one of {allowed}"));
                None
            }
        }
    }

    /// Keys that a statistic does not use.
    fn unused(&mut self, entry: &Entry, statistic: RawStatistic) {
        use RawStatistic::{
            Maximum, Minimum, NestedStatement, Quantile, ShareAbove, ShareBelow, ToleranceBound,
            WorstOnWorst,
        };
        let share = matches!(statistic, ShareBelow | ShareAbove | NestedStatement);
        let searched = statistic == WorstOnWorst;
        let extreme = matches!(statistic, Minimum | Maximum | WorstOnWorst);
        let raw = &entry.gate;
        for (key, unused) in [
            ("quantile", raw.quantile.is_some() && statistic != Quantile),
            ("coverage", raw.coverage.is_some() && statistic != ToleranceBound),
            ("confidence", raw.confidence.is_some() && extreme),
            ("risk", raw.risk.is_some() && extreme),
            ("region", raw.region.is_some() && !searched),
            ("sigma", raw.sigma.is_some() && !searched),
            ("min_cases", raw.min_cases.is_some() && searched),
            ("baseline_run", raw.baseline_run == Some(true) && searched),
        ] {
            if unused {
                self.problem(key, "a value", "nothing: the statistic does not use it");
            }
        }
        for key in entry.limits.keys().filter(|key| key.starts_with(PREFIXES[2]) && !share) {
            self.problem(key, "a value", "nothing: the statistic does not use it");
        }
    }

    fn gate(&mut self, entry: Entry) -> Option<Gate> {
        if let Some(statistic) = entry.gate.statistic {
            self.unused(&entry, statistic);
        } else {
            self.problem(
                "statistic",
                "nothing",
                "one of minimum, maximum, share_below, share_above, quantile, tolerance_bound, \
                 nested_statement, worst_on_worst",
            );
        }
        let limit = self.quantity(&entry, &PREFIXES[..2], "limit").map(|(index, quantity)| Limit {
            sense: if index == 0 { Sense::AtLeast } else { Sense::AtMost },
            quantity,
        });
        let statistic = entry.gate.statistic.and_then(|raw| self.statistic(raw, &entry, &limit));
        let raw = entry.gate;
        if let Some(id) = &raw.id
            && !id.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "_-".contains(c))
        {
            self.problem("id", format!("{id:?}"), "letters a-z, digits, _ and -");
        }
        let id = self.text("id", raw.id);
        let metric = self.text("metric", raw.metric);
        let rationale = self.text("rationale", raw.rationale);
        if raw.min_cases == Some(0) {
            self.problem("min_cases", "0", "1 or more: nothing evaluated is not a pass");
        }
        if let Some(times) = &raw.flight_times_s
            && (times.is_empty() || !times.iter().all(|time| time.is_finite()))
        {
            self.problem("flight_times_s", format!("{times:?}"), "one or more finite numbers");
        }
        if raw.baseline.is_some() && raw.baseline == raw.variant {
            self.problem(
                "baseline",
                format!("{:?}", raw.baseline.unwrap_or_default()),
                "another variant than `variant`",
            );
            return None;
        }
        let baseline_run = raw.baseline_run.unwrap_or(false);
        if baseline_run && raw.baseline.is_some() {
            self.problem(
                "baseline_run",
                "true",
                "false, or no `baseline`: one difference at a time",
            );
            return None;
        }
        Some(Gate {
            id: id?,
            metric: metric?,
            selection: Selection {
                population: raw.population.unwrap_or_else(|| "dispersed".into()),
                variant: raw.variant,
                baseline: raw.baseline,
                baseline_run,
                flight_times_s: raw.flight_times_s,
                mode: raw.mode,
            },
            statistic: statistic?,
            limit: limit?,
            severity: match raw.severity {
                Some(RawSeverity::Warning) => Severity::Warning,
                Some(RawSeverity::Error) | None => Severity::Error,
            },
            min_cases: raw.min_cases.unwrap_or(1),
            rationale: rationale?,
        })
    }

    fn statistic(
        &mut self,
        raw: RawStatistic,
        entry: &Entry,
        limit: &Option<Limit>,
    ) -> Option<Statistic> {
        let sense = limit.as_ref().map(|limit| limit.sense);
        if matches!(raw, RawStatistic::NestedStatement | RawStatistic::WorstOnWorst)
            && sense == Some(Sense::AtMost)
        {
            self.problem("limit", "at_most", "at_least for this statistic");
            return None;
        }
        match raw {
            RawStatistic::Minimum | RawStatistic::Maximum => {
                let wanted =
                    if raw == RawStatistic::Minimum { Sense::AtLeast } else { Sense::AtMost };
                if sense.is_some_and(|sense| sense != wanted) {
                    self.problem(
                        "limit",
                        if wanted == Sense::AtLeast { "at_most" } else { "at_least" },
                        "at_least for a minimum, at_most for a maximum",
                    );
                    return None;
                }
                Some(Statistic::Extreme)
            }
            RawStatistic::ShareBelow | RawStatistic::ShareAbove | RawStatistic::NestedStatement => {
                let confidence = self.confidence(entry.gate.confidence, entry.gate.risk);
                let threshold = self.quantity(entry, &PREFIXES[2..], "threshold");
                if let Some(Limit { quantity, .. }) = limit {
                    if !matches!(quantity.unit.as_str(), "percent" | "1") {
                        self.problem("limit", &quantity.unit, "percent or 1 for a share");
                    } else if !(quantity.base() > 0.0 && quantity.base() < 1.0) {
                        self.problem(
                            "limit",
                            quantity.value.to_string(),
                            "above 0 and below 100 %: no number of cases shows that a share is 0; \
                             for every case use minimum or maximum",
                        );
                    }
                }
                let (threshold, confidence) = (threshold?.1, confidence?);
                Some(match raw {
                    RawStatistic::ShareBelow => Statistic::ShareBelow { threshold, confidence },
                    RawStatistic::ShareAbove => Statistic::ShareAbove { threshold, confidence },
                    _ => Statistic::NestedStatement { threshold, confidence },
                })
            }
            RawStatistic::Quantile => {
                let level = self.probability("quantile", entry.gate.quantile);
                let confidence = self.confidence(entry.gate.confidence, entry.gate.risk);
                Some(Statistic::Quantile { level: level?, confidence: confidence? })
            }
            RawStatistic::ToleranceBound => {
                let coverage = self.probability("coverage", entry.gate.coverage);
                let confidence = self.confidence(entry.gate.confidence, entry.gate.risk);
                Some(Statistic::ToleranceBound { coverage: coverage?, confidence: confidence? })
            }
            RawStatistic::WorstOnWorst => {
                let region = entry.gate.region;
                if region.is_none() {
                    self.problem("region", "nothing", "box or ellipsoid");
                }
                let sigma = entry.gate.sigma.filter(|sigma| *sigma > 0.0 && sigma.is_finite());
                if sigma.is_none() {
                    let found = entry.gate.sigma.map_or("nothing".into(), |s| s.to_string());
                    self.problem("sigma", found, "a number above 0, that of the search");
                }
                Some(Statistic::WorstOnWorst { region: region?, sigma: sigma? })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GOOD: &str = r#"
[[gate]]
id = "unstable"
metric = "damping_ratio"
variant = "jet_damping"
flight_times_s = [105, 110.0]
mode = "tvse"
statistic = "share_below"
threshold_1 = 0
at_most_percent = 5.0
confidence = 0.95
severity = "warning"
min_cases = 300
rationale = "why"
"#;

    #[test]
    fn a_gate_reads_as_it_is_written() {
        let gates = parse(GOOD, "gates.toml").unwrap();
        let gate = &gates[0];
        assert_eq!(gate.selection.population, "dispersed");
        assert_eq!(gate.selection.flight_times_s, Some(vec![105.0, 110.0]));
        assert_eq!((gate.severity, gate.min_cases), (Severity::Warning, 300));
        assert_eq!(gate.limit.sense, Sense::AtMost);
        assert_eq!(gate.limit.quantity.base(), 0.05);
        assert!(matches!(&gate.statistic, Statistic::ShareBelow { threshold, .. }
            if threshold.unit == "1" && threshold.value == 0.0));
    }

    fn keys(text: &str) -> Vec<String> {
        parse(text, "gates.toml").unwrap_err().0.into_iter().map(|problem| problem.key).collect()
    }

    #[test]
    fn every_problem_of_a_file_is_reported_with_its_key() {
        let text = r#"
title = "x"
[[gate]]
id = 3
metrik = "damping_ratio"
statistic = "minimun"
min_cases = -1
at_least_1 = "zero"
[[gate]]
id = "a b"
metric = ""
statistic = "minimum"
at_most_1 = 0
confidence = 0.9
min_cases = 0
flight_times_s = []
rationale = " "
"#;
        assert_eq!(
            keys(text),
            [
                "title",
                "gate[0].at_least_1",
                "gate[0].id",
                "gate[0].metrik",
                "gate[0].min_cases",
                "gate[0].statistic",
                "gate[0].metric",
                "gate[0].rationale",
                "gate[1].confidence",
                "gate[1].limit",
                "gate[1].id",
                "gate[1].metric",
                "gate[1].rationale",
                "gate[1].min_cases",
                "gate[1].flight_times_s",
            ]
        );
        let problems = parse(text, "gates.toml").unwrap_err();
        assert!(problems.to_string().contains("did you mean `metric`?"));
    }

    #[test]
    fn keys_that_contradict_each_other_are_refused() {
        for (from, to, key) in [
            ("at_most_percent = 5.0", "at_most_percent = 5.0\nat_least_1 = 0", "gate[0].limit"),
            ("at_most_percent = 5.0", "", "gate[0].limit"),
            ("at_most_percent = 5.0", "at_most_s = 5.0", "gate[0].limit"),
            ("at_most_percent = 5.0", "at_most_percent = 0", "gate[0].limit"),
            ("at_most_percent = 5.0", "at_most_percent = 100", "gate[0].limit"),
            ("threshold_1 = 0", "", "gate[0].threshold"),
            ("threshold_1 = 0", "threshold_1 = nan", "gate[0].threshold_1"),
            ("confidence = 0.95", "", "gate[0].confidence"),
            ("confidence = 0.95", "confidence = 0.95\nrisk = 0.05", "gate[0].confidence"),
            ("confidence = 0.95", "confidence = 0.5", "gate[0].confidence"),
            ("confidence = 0.95", "risk = 0.5", "gate[0].risk"),
            ("confidence = 0.95", "confidence = 0.95\ncoverage = 0.9", "gate[0].coverage"),
            ("share_below", "tolerance_bound", "gate[0].threshold_1"),
            ("mode =", "baseline = \"jet_damping\"\nmode =", "gate[0].baseline"),
        ] {
            assert!(keys(&GOOD.replace(from, to)).contains(&key.to_string()), "{to}");
        }
        assert_eq!(keys(&format!("{GOOD}{GOOD}")), ["gate[1].id"]);
    }

    #[test]
    fn a_text_that_is_not_toml_or_has_no_gate_is_one_problem() {
        assert_eq!(keys("[[gate]\n"), [""]);
        assert!(parse("a = 1\n[[gate]\n", "f").unwrap_err().to_string().contains("line 2"));
        assert_eq!(keys(""), ["gate"]);
        assert_eq!(keys("gate = []"), ["gate"]);
        assert_eq!(keys("gate = 3"), ["gate"]);
        assert_eq!(keys("gate = [3]")[0], "gate[0]");
    }

    #[test]
    fn the_shipped_gates_are_read() {
        let text = include_str!("../../runs/reference.gates.toml");
        let gates = parse(text, "runs/reference.gates.toml").unwrap();
        assert!(gates.iter().any(|gate| gate.selection.baseline.is_some()));
    }

    proptest! {
        #[test]
        fn no_text_makes_the_reader_panic(text in "\\PC{0,200}") {
            let _ = parse(&text, "f");
        }

        #[test]
        fn no_mix_of_keys_and_values_makes_the_reader_panic(
            lines in proptest::collection::vec((
                prop_oneof![
                    "id|metric|population|variant|baseline|flight_times_s|mode|statistic",
                    "quantile|coverage|confidence|risk|severity|min_cases|rationale",
                    "(at_least|at_most|threshold)_(1|s|percent)?",
                    "[a-z_]{1,9}",
                ],
                prop_oneof![
                    "-?[0-9]{1,19}",
                    "-?[0-9]\\.[0-9]{1,3}e-?[0-9]{1,3}",
                    "nan|inf|true|\\[\\]|\\[1, 2.5\\]|\\{\\}|1979-05-27",
                    "'(minimum|share_below|quantile|tolerance_bound|error|[a-zé ]{0,5})'",
                ],
            ), 0..14)
        ) {
            let body: String =
                lines.iter().map(|(key, value)| format!("{key} = {value}\n")).collect();
            if let Ok(gates) = parse(&format!("[[gate]]\n{body}"), "f") {
                prop_assert_eq!(gates.len(), 1);
                prop_assert!(gates[0].limit.quantity.value.is_finite());
            }
        }
    }
}
