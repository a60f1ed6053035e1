//! What feedback adds to the damping of the named modes, as text.
//!
//! It is counted in `campaign::feedback`.

use crate::campaign::Outline;
use crate::campaign::feedback::Added;
use std::fmt::Write;

/// A sentence for each population, variant and mode, and an empty line; nothing if there is none.
pub fn text(outline: &Outline, all: &[Added]) -> String {
    let definition = &outline.definition;
    let mut text = String::new();
    for line in all {
        let names = [
            definition.modes[line.mode].as_str(),
            definition.populations[line.population].name.as_str(),
            definition.variants[line.variant].name.as_str(),
        ];
        let _ = write!(
            text,
            "feedback, {}, {}, {} against {}: ",
            names[0], names[1], names[2], definition.variants[0].name
        );
        let Some((least, case)) = line.least else {
            let _ = writeln!(text, "no case has both damping ratios");
            continue;
        };
        let whole = line.lowered == 0 && line.missing == 0;
        let _ = if whole {
            write!(text, "adds damping in every one of {} cases", line.cases)
        } else {
            write!(
                text,
                "does not add damping in {} of {} cases",
                line.lowered + line.missing,
                line.cases
            )
        };
        let _ = write!(text, ", least {:+.3} % in case {case}", 100.0 * least);
        if line.missing > 0 {
            let _ = write!(text, "; {} failed and count as not added", line.missing);
        }
        if line.lowered > 0 {
            let named: Vec<String> = line.first_lowered.iter().map(u64::to_string).collect();
            let more = if line.lowered > named.len() as u64 { ", …" } else { "" };
            let _ = write!(text, "; cases {}{more}", named.join(", "));
        }
        text.push('\n');
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{StoredPoles, synthetic};

    #[test]
    fn a_case_that_is_lowered_or_lost_is_never_said_to_be_helped() {
        let definition = synthetic::definition(&[1, 3]);
        let outline = Outline::new(definition, StoredPoles::Named, Vec::new(), Vec::new());
        let mut added = Added::new([1, 1, 0], 3);
        [0.02, 0.0041, 0.0031].iter().enumerate().for_each(|(i, gain)| added.add(i as u64, *gain));
        let said = text(&outline, std::slice::from_ref(&added));
        assert!(said.contains("every one of 3 cases, least +0.310 % in case 2"), "{said}");
        let mut added = Added::new([1, 1, 0], 3);
        [0.02, f64::NAN, -1e-3].iter().enumerate().for_each(|(i, gain)| added.add(i as u64, *gain));
        let said = text(&outline, &[added]);
        assert!(said.contains("in 2 of 3 cases, least -0.100 % in case 2"), "{said}");
        assert!(said.contains("1 failed") && said.contains("; cases 2\n"), "{said}");
    }
}
