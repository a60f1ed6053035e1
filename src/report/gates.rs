//! The outcomes of gates as a text table, with a sentence for each that did not pass.
//!
//! Verdicts are made in `gate`; who prints the text is decided in `cli`.

use super::{percent, significant};
use crate::gate::{Outcome, Report, Severity, Verdict};
use comfy_table::{CellAlignment, Table, presets};

/// The table, the sentences below it and the verdict of all gates together; `folder` is that of the run.
pub fn gates(report: &Report, folder: &str) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header([
        "gate",
        "verdict",
        "statistic",
        "value",
        "bound",
        "limit",
        "cases",
        "against",
        "worst case",
    ]);
    for gate in &report.gates {
        table.add_row([
            gate.id.clone(),
            verdict(gate),
            gate.statistic.clone(),
            number(gate.value),
            number(gate.bound),
            limit(gate),
            gate.cases.to_string(),
            gate.violations.to_string(),
            gate.worst_case.map_or("–".into(), |case| case.to_string()),
        ]);
    }
    for column in [3, 4, 6, 7, 8] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let mut text = format!("{table}\n");
    for gate in report.gates.iter().filter(|gate| gate.verdict != Verdict::Pass) {
        let rationale = gate.rationale.split_whitespace().collect::<Vec<_>>().join(" ");
        text += &format!("\n{}: {}: {}.\n  {rationale}\n", gate.id, verdict(gate), gate.message);
        if let Some(offender) = gate.offenders.first() {
            text += &format!("  worst: {}\n", replay(folder, &gate.population, offender.case));
        }
    }
    text += &format!("\n{}", total(report));
    if report.claims_at_once > 1 {
        let claims = report.claims_at_once;
        text += &format!("; {claims} claims at once, each with its own confidence");
    }
    text + "\n"
}

/// "fail (3 in all): 1 passed, 2 failed, 0 inconclusive, 0 incomplete".
pub fn total(report: &Report) -> String {
    let counted = |wanted| report.gates.iter().filter(|gate| gate.verdict == wanted).count();
    format!(
        "{} ({} in all): {} passed, {} failed, {} inconclusive, {} incomplete",
        report.verdict.name(),
        report.gates.len(),
        counted(Verdict::Pass),
        counted(Verdict::Fail),
        counted(Verdict::Inconclusive),
        counted(Verdict::Incomplete),
    )
}

/// The command that replays a case of the run in `folder`.
pub fn replay(folder: &str, population: &str, case: u64) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=".contains(c);
    let quoted = |word: &str| match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    format!("tvse replay {} --population {} --case {case}", quoted(folder), quoted(population))
}

/// What a gate found in one line: value, bound, limit with their unit, counts and worst case.
pub fn line(gate: &Outcome) -> String {
    let with_unit = |value: Option<f64>, unit: &str| match (value, unit) {
        (None, _) => "none".to_owned(),
        (Some(value), "1") => significant(value),
        (Some(value), "percent") => format!("{} %", significant(value)),
        (Some(value), unit) => format!("{} {unit}", significant(value)),
    };
    let mut text = format!(
        "{}: value {}, bound {}, limit {}; {}",
        gate.statistic,
        with_unit(gate.value, &gate.unit),
        with_unit(gate.bound, &gate.unit),
        limit(gate),
        gate.message
    );
    if let Some(case) = gate.worst_case {
        let value = with_unit(gate.worst_value, &gate.metric_unit);
        text += &format!("; worst case {case} of {} with {value}", gate.population);
    }
    text
}

/// The verdict in words, a warning marked.
pub fn verdict(gate: &Outcome) -> String {
    match (gate.severity, gate.verdict) {
        (Severity::Warning, verdict) if verdict != Verdict::Pass => {
            format!("{} (warning)", verdict.name())
        }
        (_, verdict) => verdict.name().into(),
    }
}

/// "≥ 5 s at 95 %".
pub fn limit(gate: &Outcome) -> String {
    let sign = if gate.sense == "at_least" { '≥' } else { '≤' };
    let unit = match gate.unit.as_str() {
        "1" => String::new(),
        "percent" => " %".into(),
        unit => format!(" {unit}"),
    };
    let confidence = gate
        .confidence
        .map_or(String::new(), |confidence| format!(" at {} %", percent(confidence)));
    format!("{sign} {}{unit}{confidence}", gate.limit)
}

/// Four digits, or a dash.
pub fn number(value: Option<f64>) -> String {
    value.map_or("–".into(), significant)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn outcome(verdict: Verdict, severity: Severity) -> Outcome {
        Outcome {
            id: "unstable".into(),
            population: "dispersed".into(),
            verdict,
            severity,
            statistic: "share of damping_ratio below 0".into(),
            value: Some(69.0),
            bound: Some(70.712_345),
            sense: "at_most",
            limit: 5.0,
            unit: "percent".into(),
            confidence: Some(0.95),
            cases: 2000,
            failures: 0,
            missing: 0,
            violations: 1380,
            most_violations: Some(82),
            worst_case: Some(17),
            worst_value: Some(-0.01),
            metric_unit: "1".into(),
            cases_needed: None,
            cases_needed_at_observed_rate: None,
            offenders: vec![],
            message: "1380 of 2000 cases count against the gate".into(),
            rationale: "two\nlines".into(),
        }
    }

    #[test]
    fn a_failed_gate_shows_value_bound_limit_and_why_it_is_there() {
        let text = gates(&Report::new(vec![outcome(Verdict::Fail, Severity::Error)]), "run");
        for part in ["| unstable", "69", "70.71", "≤ 5 % at 95 %", "1380", "17", "two lines"] {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
        assert!(
            text.ends_with("fail (1 in all): 0 passed, 1 failed, 0 inconclusive, 0 incomplete\n")
        );
    }

    #[test]
    fn a_replay_can_be_pasted_into_a_shell() {
        assert_eq!(
            replay("runs/a", "dispersed", 3),
            "tvse replay runs/a --population dispersed --case 3"
        );
        assert_eq!(
            replay("my run's", "p", 0),
            r"tvse replay 'my run'\''s' --population p --case 0"
        );
    }

    #[test]
    fn a_warning_says_so_and_a_pass_has_no_sentence() {
        let text = gates(
            &Report::new(vec![
                outcome(Verdict::Fail, Severity::Warning),
                outcome(Verdict::Pass, Severity::Error),
            ]),
            "run",
        );
        assert!(text.contains("fail (warning)"));
        assert_eq!(text.matches("two lines").count(), 1);
        assert!(text.contains("2 claims at once"));
    }
}
