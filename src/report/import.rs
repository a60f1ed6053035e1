//! What an import found, as text: the files, rigid-body modes, mass, chosen grids, warnings.
//!
//! The modes themselves are shown by `modes`.

use super::significant;
use crate::import::{Chosen, Made};
use std::fmt::Write;

/// The findings of an import.
pub fn findings(made: &Made) -> String {
    let mut text = String::new();
    for (time, set) in made.times.iter().zip(&made.modal.sets) {
        let _ = writeln!(
            text,
            "at {} s: {} grids with results and {} modes by {}; {} elastic modes taken",
            time.flight_time_s,
            time.grids,
            time.modes,
            time.program,
            set.modes.len()
        );
        let rigid = &time.rigid.modes;
        if rigid.is_empty() {
            let _ = writeln!(text, "  no rigid-body modes");
        } else {
            let worst = rigid.iter().map(|m| m.residual).fold(0.0, f64::max);
            let highest = rigid.iter().map(|m| m.frequency_hz.abs()).fold(0.0, f64::max);
            let _ = writeln!(
                text,
                "  {} rigid-body modes: residual to a rigid motion at most {worst:.1e}, frequency at \
                 most {highest:.1e} Hz, {:.1e} of the first elastic mode",
                rigid.len(),
                highest / time.first_elastic_hz
            );
        }
        let body = &set.body;
        let _ = writeln!(
            text,
            "  mass {} kg, cg {}, {}, {} m",
            significant(body.mass_kg),
            significant(body.cg_m.x),
            significant(body.cg_m.y),
            significant(body.cg_m.z)
        );
        for (by, found) in &time.estimates {
            let _ = writeln!(
                text,
                "  by the {by}: {} kg, cg {}, {}, {} m",
                significant(found.mass_kg),
                significant(found.cg_m.x),
                significant(found.cg_m.y),
                significant(found.cg_m.z)
            );
        }
    }
    if let Some(time) = made.times.first() {
        let _ = writeln!(text, "grids, at {} s:", time.flight_time_s);
        // A row of grids that are made alike is one line.
        let row =
            |name: &str| name.rsplit_once('.').map_or(String::new(), |(row, _)| row.to_owned());
        let alike = |a: &Chosen, b: &Chosen| {
            a.from == b.from && row(&a.grid) == row(&b.grid) && !row(&a.grid).is_empty()
        };
        for chosen in time.chosen.chunk_by(alike) {
            let (first, last) = (&chosen[0], &chosen[chosen.len() - 1]);
            let role = made.roles.get(&first.grid).map_or(String::new(), |r| format!(" ({r})"));
            let to = if chosen.len() > 1 { format!(" to {}", last.grid) } else { String::new() };
            let _ = writeln!(text, "  {}{to}{role}: {}", first.grid, first.from);
        }
    }
    let worst = made.sections.iter().max_by(|a, b| a.residual.total_cmp(&b.residual));
    if let Some(worst) = worst {
        let _ = writeln!(
            text,
            "greatest residual of a section: {:.3}, `{}` in {} at {} s",
            worst.residual, worst.grid, worst.label, worst.flight_time_s
        );
    }
    for warning in &made.warnings {
        let _ = writeln!(text, "warning: {warning}");
    }
    shown(&text)
}

/// Text whose parts come from files must not steer the terminal on which it is shown.
fn shown(text: &str) -> String {
    text.chars()
        .map(|c| {
            if c.is_control() && c != '\n' { c.escape_default().to_string() } else { c.to_string() }
        })
        .collect()
}
