//! The outcomes of gates as a text table, with a sentence for each that did not pass.
//!
//! Verdicts are made in `gate`; who prints the text is decided in `cli`.

use super::{percent, significant};
use crate::gate::{Outcome, Report, Severity, Verdict};
use comfy_table::{CellAlignment, Table, presets};

/// The table, the sentences below it and the verdict of all gates together.
pub fn gates(report: &Report) -> String {
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
    }
    let counted = |wanted| report.gates.iter().filter(|gate| gate.verdict == wanted).count();
    text += &format!(
        "\n{} ({} in all): {} passed, {} failed, {} inconclusive, {} incomplete",
        report.verdict.name(),
        report.gates.len(),
        counted(Verdict::Pass),
        counted(Verdict::Fail),
        counted(Verdict::Inconclusive),
        counted(Verdict::Incomplete),
    );
    if report.claims_at_once > 1 {
        let claims = report.claims_at_once;
        text += &format!("; {claims} claims at once, each with its own confidence");
    }
    text + "\n"
}

fn verdict(gate: &Outcome) -> String {
    match (gate.severity, gate.verdict) {
        (Severity::Warning, verdict) if verdict != Verdict::Pass => {
            format!("{} (warning)", verdict.name())
        }
        (_, verdict) => verdict.name().into(),
    }
}

fn limit(gate: &Outcome) -> String {
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

fn number(value: Option<f64>) -> String {
    value.map_or("–".into(), significant)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(verdict: Verdict, severity: Severity) -> Outcome {
        Outcome {
            id: "unstable".into(),
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
        let text = gates(&Report::new(vec![outcome(Verdict::Fail, Severity::Error)]));
        for part in ["| unstable", "69", "70.71", "≤ 5 % at 95 %", "1380", "17", "two lines"] {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
        assert!(
            text.ends_with("fail (1 in all): 0 passed, 1 failed, 0 inconclusive, 0 incomplete\n")
        );
    }

    #[test]
    fn a_warning_says_so_and_a_pass_has_no_sentence() {
        let text = gates(&Report::new(vec![
            outcome(Verdict::Fail, Severity::Warning),
            outcome(Verdict::Pass, Severity::Error),
        ]));
        assert!(text.contains("fail (warning)"));
        assert_eq!(text.matches("two lines").count(), 1);
        assert!(text.contains("2 claims at once"));
    }
}
