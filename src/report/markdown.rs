//! The outcomes of gates as Markdown, for the summary of a job and for merge requests.
//!
//! Names and texts from files are escaped: they show as they are and start nothing.

use super::gates::{limit, line, number, replay, total, verdict};
use crate::gate::{Outcome, Report, Verdict};

/// Most bytes that a job's summary takes from one step.
const MOST_BYTES: usize = 1 << 20;

/// A table with a row for each gate, and below it a paragraph for each that did not pass; `folder` is that
/// of the run.
pub fn text(report: &Report, folder: &str) -> String {
    let mut text = format!(
        "## Gates of `{}`: {}\n\n| gate | verdict | value | bound | limit | against | worst case |\n\
         |---|---|--:|--:|--:|--:|--:|\n",
        code(folder),
        total(report)
    );
    for gate in &report.gates {
        text += &format!(
            "| {} | {} {} | {} | {} | {} | {} of {} | {} |\n",
            escaped(&gate.id),
            mark(gate),
            verdict(gate),
            number(gate.value),
            number(gate.bound),
            escaped(&limit(gate)),
            gate.violations,
            gate.cases,
            gate.worst_case.map_or("–".into(), |case| case.to_string()),
        );
    }
    for gate in report.gates.iter().filter(|gate| gate.verdict != Verdict::Pass) {
        let rationale = gate.rationale.split_whitespace().collect::<Vec<_>>().join(" ");
        text += &format!(
            "\n**{}**: {}. {}\n",
            escaped(&gate.id),
            escaped(&line(gate)),
            escaped(&rationale)
        );
        if let Some(offender) = gate.offenders.first() {
            let command = replay(folder, &gate.population, offender.case);
            text += &format!("Its worst case: `{}`\n", code(&command));
        }
    }
    if report.claims_at_once > 1 {
        let claims = report.claims_at_once;
        text += &format!("\n{claims} claims are made at once, each with its own confidence.\n");
    }
    text
}

/// The text within what a job's summary takes: whole lines, and a last one that says so.
pub fn cut(text: &str) -> String {
    const LEFT_OUT: &str = "\nThe rest is left out: see gates.json.\n";
    if text.len() <= MOST_BYTES {
        return text.to_owned();
    }
    let mut short = String::new();
    for line in text.split_inclusive('\n') {
        if short.len() + line.len() + LEFT_OUT.len() > MOST_BYTES {
            break;
        }
        short += line;
    }
    short + LEFT_OUT
}

fn mark(gate: &Outcome) -> &'static str {
    match gate.verdict {
        Verdict::Pass => "✅",
        Verdict::Fail => "❌",
        Verdict::Inconclusive | Verdict::Incomplete => "❔",
    }
}

/// A text that Markdown shows as it is, on one line.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' | '>' | '&' | '|' | '`' | '*' | '_' | '[' | ']' | '\\' | '#' | '~' | '$' | '@'
            | ':' => {
                out += &format!("&#{};", u32::from(c));
            }
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// A text for a code span inside a table or a paragraph.
fn code(text: &str) -> String {
    text.chars().map(|c| if c == '`' || c.is_control() { '?' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::super::gates::tests::outcome;
    use super::*;
    use crate::gate::{Offender, Severity};

    #[test]
    fn every_gate_has_a_row_and_what_did_not_pass_its_reason_and_replay() {
        let mut failed = outcome(Verdict::Fail, Severity::Error);
        failed.offenders = vec![Offender { case: 17, value: Some(-0.01), failure: None }];
        let gates = vec![outcome(Verdict::Pass, Severity::Error), failed];
        let text = text(&Report::new(gates), "runs/reference");
        assert_eq!(text.lines().filter(|line| line.starts_with("| unstable")).count(), 2);
        assert!(
            text.contains("❌ fail | 69 | 70.71 | ≤ 5 % at 95 % | 1380 of 2000 | 17 |"),
            "{text}"
        );
        assert!(text.contains("`tvse replay runs/reference --population dispersed --case 17`"));
        assert!(text.contains("two lines"));
    }

    #[test]
    fn names_start_nothing() {
        let hostile = "<img src=x>|`[a](b)` **c** _d_\n# e @all";
        let shown = escaped(hostile);
        assert!(!shown.contains(['<', '>', '|', '`', '[', '*', '_', '\n', '@']), "{shown}");
        let mut gate = outcome(Verdict::Fail, Severity::Error);
        gate.rationale = hostile.into();
        gate.statistic = hostile.into();
        let text = text(&Report::new(vec![gate]), hostile);
        assert!(!text.contains("<img src=x>|`"), "{text}");
        assert!(!text.contains("\n# e"), "{text}");
    }

    #[test]
    fn a_long_text_is_cut_between_lines() {
        let gates = vec![outcome(Verdict::Fail, Severity::Error); 5000];
        let long = text(&Report::new(gates), "run");
        assert!(long.len() > MOST_BYTES);
        let short = cut(&long);
        assert!(short.len() <= MOST_BYTES && short.ends_with("see gates.json.\n"));
        assert_eq!(cut("a\n"), "a\n");
    }
}
