//! The outcomes of gates as JUnit XML: one test case a gate.
//!
//! A gate that fails or is inconclusive is a failure, an incomplete one an error; a warning that does not
//! pass is a skipped test with its message, as it decides nothing.

use super::gates::{line, replay, verdict};
use crate::gate::{Outcome, Report as Outcomes, Severity, Verdict};
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

/// The XML text for the run in `folder`.
pub fn text(report: &Outcomes, folder: &str) -> String {
    let mut suite = TestSuite::new(folder);
    suite.add_test_cases(report.gates.iter().map(|gate| test_case(gate, folder)));
    let mut whole = Report::new("tvse gate");
    whole.add_test_suite(suite);
    whole.to_string().expect("texts always serialise")
}

fn test_case(gate: &Outcome, folder: &str) -> TestCase {
    let kind = match (gate.verdict, gate.severity) {
        (Verdict::Pass, _) => None,
        (_, Severity::Warning) => Some(TestCaseStatus::skipped()),
        (Verdict::Incomplete, _) => Some(TestCaseStatus::non_success(NonSuccessKind::Error)),
        (_, _) => Some(TestCaseStatus::non_success(NonSuccessKind::Failure)),
    };
    let status = kind.map_or_else(TestCaseStatus::success, |mut status| {
        status.set_message(format!("{}: {}", verdict(gate), line(gate)));
        status.set_type(gate.verdict.name());
        let worst = gate.offenders.first();
        let worst = worst.map(|worst| replay(folder, &gate.population, worst.case));
        status.set_description(format!("{}\n{}", gate.rationale.trim(), worst.unwrap_or_default()));
        status
    });
    let mut case = TestCase::new(gate.id.clone(), status);
    case.set_classname("tvse.gate");
    if gate.verdict == Verdict::Pass {
        case.set_system_out(line(gate));
    }
    case
}

#[cfg(test)]
mod tests {
    use super::super::gates::tests::outcome;
    use super::*;

    fn of(gates: Vec<Outcome>) -> Report {
        let text = text(&Outcomes::new(gates), "runs/a & b");
        Report::deserialize_from_str(&text).unwrap()
    }

    #[test]
    fn one_test_case_a_gate_and_its_verdict_counts() {
        let report = of(vec![
            outcome(Verdict::Pass, Severity::Error),
            outcome(Verdict::Fail, Severity::Error),
            outcome(Verdict::Inconclusive, Severity::Error),
            outcome(Verdict::Incomplete, Severity::Error),
            outcome(Verdict::Fail, Severity::Warning),
        ]);
        assert_eq!((report.tests, report.failures, report.errors), (5, 2, 1));
        let suite = &report.test_suites[0];
        assert_eq!((suite.name.as_str(), suite.skipped), ("runs/a & b", 1));
        let TestCaseStatus::NonSuccess { message: Some(message), .. } = &suite.test_cases[1].status
        else {
            panic!("a failed gate is a failure")
        };
        for part in ["69 %", "70.71 %", "≤ 5 % at 95 %", "worst case 17 of dispersed with -0.01"]
        {
            assert!(message.as_str().contains(part), "{part} is not in {}", message.as_str());
        }
    }

    #[test]
    fn texts_that_xml_cannot_hold_are_left_out() {
        let mut gate = outcome(Verdict::Fail, Severity::Error);
        gate.rationale = "a \u{1} <b> ]]> \u{7f}&".into();
        assert_eq!(of(vec![gate]).tests, 1);
    }
}
