//! What an audit found, in words.

use crate::campaign::audit::Audit;
use std::fmt::Write;

/// Disagreements shown.
const SHOWN: usize = 10;

/// One line, and the first disagreements if there are any.
pub fn text(audit: &Audit) -> String {
    let Audit { cases, evaluations, fallbacks, poles, .. } = *audit;
    let mut text = format!(
        "audit: {cases} cases both ways, {evaluations} evaluations ({fallbacks} of them dense in both), {poles} \
         poles; largest difference {:.1e}, largest bound {:.1e} of the modulus: {}\n",
        audit.largest,
        audit.largest_bound,
        if audit.disagreements.is_empty() { "agreed" } else { "NOT agreed" }
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
