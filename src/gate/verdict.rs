//! The verdict of a gate, its severity, and what all gates together mean for the process.
//!
//! How a verdict comes about is in `evaluate`.

/// What a gate concludes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The confidence bound keeps the limit.
    Pass,
    /// The confidence bound on the other side breaks the limit, or a case that must hold does not.
    Fail,
    /// Neither is shown; more cases are needed.
    Inconclusive,
    /// Cases are missing, or none could be evaluated.
    Incomplete,
}

impl Verdict {
    /// The word printed and stored.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Inconclusive => "inconclusive",
            Self::Incomplete => "incomplete",
        }
    }

    /// Exit code of a process that ends with this verdict (2, wrong usage, is no verdict).
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Pass => 0,
            Self::Fail => 1,
            Self::Incomplete => 3,
            Self::Inconclusive => 4,
        }
    }
}

/// Whether a gate decides the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// It does.
    Error,
    /// It is only shown.
    Warning,
}

/// The verdict of all gates together.
///
/// Of the gates with severity error the first of fail, incomplete, inconclusive that occurs: a fail
/// is shown whatever else is missing, so nothing may hide it; an incomplete gate could still turn
/// into a fail and is no evidence at all, so it goes before an inconclusive one. Gates of severity
/// warning never change that, with one exception: where no gate of either severity evaluated
/// anything the whole is incomplete, since nothing evaluated is not a pass.
pub fn combine(gates: impl IntoIterator<Item = (Severity, Verdict)>) -> Verdict {
    let gates: Vec<_> = gates.into_iter().collect();
    let occurs = |verdict| gates.contains(&(Severity::Error, verdict));
    let anything_evaluated = gates.iter().any(|&(_, verdict)| verdict != Verdict::Incomplete);
    [Verdict::Fail, Verdict::Incomplete, Verdict::Inconclusive]
        .into_iter()
        .find(|&verdict| occurs(verdict))
        .unwrap_or(if anything_evaluated { Verdict::Pass } else { Verdict::Incomplete })
}

#[cfg(test)]
mod tests {
    use super::*;
    use Severity::{Error, Warning};
    use Verdict::{Fail, Incomplete, Inconclusive, Pass};

    #[test]
    fn the_combination_follows_its_truth_table() {
        let table: [(&[(Severity, Verdict)], Verdict); 11] = [
            (&[], Incomplete),
            (&[(Error, Pass)], Pass),
            (&[(Error, Pass), (Error, Fail)], Fail),
            (&[(Error, Incomplete), (Error, Fail)], Fail),
            (&[(Error, Inconclusive), (Error, Fail)], Fail),
            (&[(Error, Inconclusive), (Error, Incomplete)], Incomplete),
            (&[(Error, Inconclusive), (Error, Pass)], Inconclusive),
            (&[(Error, Pass), (Warning, Fail)], Pass),
            (&[(Error, Pass), (Warning, Incomplete)], Pass),
            (&[(Warning, Fail)], Pass),
            (&[(Warning, Incomplete)], Incomplete),
        ];
        for (gates, verdict) in table {
            assert_eq!(combine(gates.iter().copied()), verdict, "{gates:?}");
        }
    }

    #[test]
    fn exit_codes_are_those_of_the_command_line() {
        assert_eq!(Pass.exit_code(), crate::cli::PASS);
        assert_eq!(Fail.exit_code(), crate::cli::FAIL);
        assert_eq!(Incomplete.exit_code(), crate::cli::INCOMPLETE);
        assert_eq!(Inconclusive.exit_code(), crate::cli::INCONCLUSIVE);
    }
}
