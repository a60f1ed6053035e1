//! Table of the modes of a modal package, as text.
//!
//! It shows what is there; characters of modes are found in `structure::character`.

use super::significant;
use crate::import::Moved;
use crate::structure::Character;
use crate::structure::effective::{effective_mass_kg, mass_at_grid_kg, rigid_modes};
use crate::vehicle::{Modal, Mode, ModeSet};
use comfy_table::{CellAlignment, Table, presets};
use nalgebra::Vector3;
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

/// Rigid and elastic modes at one flight time: frequency, generalised mass, effective mass in x, y
/// and z over that of the body, then a table a gimbal with its shape and slope in each mode, and
/// the mass that a force at the gimbal finds in the mode.
pub fn details(set: &ModeSet, gimbals: &[&str], sections: &[Moved]) -> String {
    let rigid = rigid_modes(set);
    let all = || rigid.iter().map(|m| (m, true)).chain(set.modes.iter().map(|m| (m, false)));
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header([
        "label",
        "kind",
        "frequency Hz",
        "generalised mass kg",
        "effective mass x, y, z %",
        "worst section residual",
    ]);
    for (mode, is_rigid) in all() {
        let worst = (sections.iter())
            .filter(|s| s.label == mode.label && s.flight_time_s == set.flight_time_s)
            .max_by(|a, b| a.residual.total_cmp(&b.residual));
        table.add_row([
            mode.label.clone(),
            if is_rigid { "rigid" } else { "elastic" }.to_owned(),
            format!("{:.4}", mode.frequency_hz),
            "1".to_owned(),
            effective(set, mode, is_rigid),
            worst.map_or("–".to_owned(), |s| format!("{:.3} {}", s.residual, s.grid)),
        ]);
    }
    align(&mut table, &[2, 3]);
    let mut text = format!(
        "\nmodes at {} s; mass {} kg, cg {} m\n{}\n",
        set.flight_time_s,
        significant(set.body.mass_kg),
        three(&set.body.cg_m),
        table.trim_fmt()
    );
    text.push_str(
        "rigid modes by the mass properties; effective mass of elastic modes on the masses of the \
         grids, zero of a free body but for lumping\n",
    );
    if gimbals.is_empty() {
        text.push_str("no grid has the role of a gimbal, and none is called so\n");
    }
    for gimbal in gimbals {
        let Some(place) = set.grid(gimbal) else { continue };
        let mut table = Table::new();
        table.load_style(presets::NOTHING);
        table.set_header([
            "label",
            "shape x, y, z kg^-1/2",
            "slope x, y, z rad/m kg^-1/2",
            "mass at gimbal kg",
        ]);
        for (mode, _) in all() {
            let (shape, slope) = (&mode.shape[place], &mode.slope[place]);
            table.add_row([
                mode.label.clone(),
                three(shape),
                three(slope),
                // A gimbal on a node of the mode finds no mass, but rounding.
                match mass_at_grid_kg(shape) {
                    mass if mass < 1e15 => significant(mass),
                    _ => "–".to_owned(),
                },
            ]);
        }
        align(&mut table, &[3]);
        let _ =
            writeln!(text, "\ngimbal {gimbal} at {} s\n{}", set.flight_time_s, table.trim_fmt());
    }
    text
}

fn effective(set: &ModeSet, mode: &Mode, is_rigid: bool) -> String {
    if is_rigid {
        let at_cg = ["rigid x", "rigid y", "rigid z"];
        let share = |name| if mode.label == name { "100" } else { "0" };
        return at_cg.map(share).join(", ");
    }
    effective_mass_kg(mode, &set.grids).map_or("–".to_owned(), |kg| {
        let share = kg * (100.0 / set.body.mass_kg);
        format!("{:.4}, {:.4}, {:.4}", share.x, share.y, share.z)
    })
}

fn three(v: &Vector3<f64>) -> String {
    v.iter().map(|x| significant(*x)).collect::<Vec<_>>().join(", ")
}

fn align(table: &mut Table, columns: &[usize]) {
    for &right in columns {
        if let Some(column) = table.column_mut(right) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::{Grid, MassProperties};
    use nalgebra::Matrix3;

    #[test]
    fn details_show_six_rigid_modes_and_the_motion_of_each_gimbal() {
        let grid = |x: f64, name: &str| Grid {
            name: name.to_owned(),
            position_m: Vector3::x() * x,
            mass_kg: Vector3::repeat(2.0),
            inertia_kg_m2: Vector3::zeros(),
        };
        let set = ModeSet {
            flight_time_s: 80.0,
            body: MassProperties {
                mass_kg: 4.0,
                cg_m: Vector3::x(),
                inertia_kg_m2: Matrix3::identity(),
            },
            grids: vec![grid(0.0, "nose"), grid(2.0, "gimbal")],
            modes: vec![Mode {
                label: "m001".to_owned(),
                frequency_hz: 3.5,
                shape: vec![Vector3::y() * 0.5, Vector3::y() * 0.5],
                slope: vec![Vector3::zeros(), Vector3::z() * 0.25],
            }],
        };
        let text = details(&set, &["gimbal"], &[]);
        let rigid = text.lines().filter(|line| line.starts_with(" rigid ")).count();
        assert_eq!(rigid, 6 + 6, "{text}");
        // (2 · 0.5 + 2 · 0.5)² is the whole mass of 4 kg; a force at the gimbal finds 1/0.25 kg.
        let row = text.lines().find(|l| l.contains("elastic   ") && l.contains("m001")).unwrap();
        assert!(row.contains("3.5000") && row.contains("0.0000, 100.0000, 0.0000"), "{row}");
        let row = text.lines().rfind(|l| l.contains("m001")).unwrap();
        assert!(row.contains("0, 0.5, 0") && row.contains("0, 0, 0.25"), "{row}");
        assert!(row.trim_end().ends_with(" 4"), "{row}");
    }
}
