//! Table of the modes of a modal package, as text.
//!
//! It shows what is there; characters of modes are found in `structure::character`.

use crate::structure::Character;
use crate::vehicle::{Modal, ModeSet};
use comfy_table::{CellAlignment, Table, presets};
use std::fmt::Write;

/// One row a mode and flight time: time, label, frequency, character, parents of new labels.
pub fn modes(modal: &Modal) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["time s", "label", "frequency Hz", "character", "parents (overlap)"]);
    for set in &modal.sets {
        for (i, mode) in set.modes.iter().enumerate() {
            let time = if i == 0 { set.flight_time_s.to_string() } else { String::new() };
            let character = Character::of(mode, &set.grids)
                .map_or_else(String::new, |c| format!("{} {:.0} %", c.direction, 100.0 * c.share));
            let row = [
                time,
                mode.label.clone(),
                format!("{:.4}", mode.frequency_hz),
                character,
                parents(modal, set, &mode.label),
            ];
            table.add_row(row);
        }
    }
    for right in [0, 2] {
        if let Some(column) = table.column_mut(right) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let mut text = format!("{}\n{}\n", modal.source, table.trim_fmt());
    let body = match modal.contains_engines.as_slice() {
        [] => "a reduced body: no engine's mass is in the modes".to_owned(),
        engines => format!("the modes contain the mass of {}", engines.join(", ")),
    };
    let labels = modal.labels().len();
    let _ = writeln!(text, "{labels} labels at {} flight times; {body}", modal.sets.len());
    text
}

fn parents(modal: &Modal, set: &ModeSet, label: &str) -> String {
    let found = (modal.parents.iter())
        .filter(|p| p.label == label && p.flight_time_s == set.flight_time_s)
        .map(|p| format!("{} ({:.2})", p.parent, p.overlap));
    found.collect::<Vec<_>>().join(", ")
}
