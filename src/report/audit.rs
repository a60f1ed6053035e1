//! What an audit found, in words.

use crate::campaign::audit::Audit;
use std::fmt::Write;

/// Disagreements shown.
const SHOWN: usize = 10;

/// One line, and the first disagreements if there are any.
pub fn text(audit: &Audit) -> String {
    let Audit { cases, evaluations, fallbacks, poles, .. } = *audit;
    let mut text = format!(
        "audit: {cases} cases both ways, {evaluations} evaluations compared (without certificate, dense both ways: \
         {fallbacks}), {poles} poles; largest difference {:.1e}, largest bound {:.1e} of the modulus: {}\n",
        audit.largest,
        audit.largest_bound,
        match (audit.disagreements.is_empty(), audit.poles) {
            (true, 0) => "nothing to compare",
            (true, _) => "agreed",
            (false, _) => "NOT agreed",
        }
    );
    for disagreement in audit.disagreements.iter().take(SHOWN) {
        let _ = writeln!(text, "  {disagreement}");
    }
    let more = audit.disagreements.len().saturating_sub(SHOWN);
    if more > 0 {
        let _ = writeln!(text, "  and {more} more");
    }
    text
}
