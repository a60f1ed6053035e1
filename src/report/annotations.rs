//! Gates that did not pass as annotations of GitHub Actions: workflow commands on the standard output.
//!
//! A step shows ten errors and ten warnings; the tenth then says how many are left out. Whether to print
//! them is decided in `cli`.

use super::gates::{line, verdict};
use crate::gate::{Outcome, Report, Severity, Verdict};

/// Annotations of one kind that a step shows.
const SHOWN: usize = 10;
/// Longest message, in characters.
const LONGEST: usize = 1000;

/// The workflow commands for the run in `folder`, one a line; `file` is that of the gates.
pub fn text(report: &Report, folder: &str, file: &str) -> String {
    let not_passed = report.gates.iter().filter(|gate| gate.verdict != Verdict::Pass);
    let (errors, warnings): (Vec<_>, Vec<_>) =
        not_passed.partition(|gate| gate.severity == Severity::Error);
    of_kind("error", &errors, folder, file) + &of_kind("warning", &warnings, folder, file)
}

fn of_kind(kind: &str, gates: &[&Outcome], folder: &str, file: &str) -> String {
    let shown = if gates.len() > SHOWN { SHOWN - 1 } else { gates.len() };
    let mut text = String::new();
    let mut annotate = |title: &str, message: &str| {
        let message: String = message.chars().take(LONGEST).collect();
        let (file, title) = (property(file), property(title));
        text += &format!("::{kind} file={file},title={title}::{}\n", data(&message));
    };
    for gate in &gates[..shown] {
        annotate(&format!("{}: {}", gate.id, verdict(gate)), &format!("{folder}: {}", line(gate)));
    }
    if gates.len() > shown {
        let left = gates.len() - shown;
        annotate(&format!("{left} more gates"), "did not pass; the job summary has all of them");
    }
    text
}

fn data(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}

#[cfg(test)]
mod tests {
    use super::super::gates::tests::outcome;
    use super::*;

    #[test]
    fn only_what_did_not_pass_is_annotated_on_one_line_each() {
        let gates = vec![
            outcome(Verdict::Pass, Severity::Error),
            outcome(Verdict::Fail, Severity::Error),
            outcome(Verdict::Inconclusive, Severity::Warning),
        ];
        let text = text(&Report::new(gates), "a\n::error::b", "runs/g.toml");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 2, "{text}");
        assert!(lines[0].starts_with("::error file=runs/g.toml,title=unstable%3A fail::a%0A"));
        assert!(lines[0].contains("value 69 %25, bound 70.71 %25, limit ≤ 5 %25 at 95 %25"));
        assert!(lines[1].starts_with("::warning "));
    }

    #[test]
    fn a_step_has_ten_errors_at_most_and_the_last_counts_the_others() {
        for (gates, lines, last) in
            [(10, 10, "unstable"), (11, 10, "2 more gates"), (40, 10, "31 more")]
        {
            let gates = vec![outcome(Verdict::Fail, Severity::Error); gates];
            let text = text(&Report::new(gates), "run", "g.toml");
            assert_eq!(text.lines().count(), lines);
            assert!(text.lines().last().unwrap().contains(last), "{text}");
        }
    }
}
