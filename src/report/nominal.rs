//! The poles of one record as a table for the terminal.

use crate::campaign::{Definition, Record};
use crate::dynamics::Part;
use comfy_table::{CellAlignment, Table, presets};

/// One row per pole of each evaluation.
pub fn table(definition: &Definition, record: &Record) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN).set_header([
        "time, s",
        "variant",
        "mode",
        "branch",
        "label",
        "Re s, rad/s",
        "Im s, rad/s",
        "f, Hz",
        "ζ, %",
        "double, s",
        "structure",
        "nozzle",
    ]);
    let none = String::new;
    for evaluation in &record.evaluations {
        let time = definition.flight_times_s[evaluation.flight_time].to_string();
        let variant = definition.variants[evaluation.variant].name.clone();
        let poles = match &evaluation.outcome {
            Ok(poles) => poles,
            Err(failure) => {
                table.add_row([time, variant, failure.to_string()]);
                continue;
            }
        };
        for pole in poles {
            let share = |part: Part| {
                let index = Part::ALL.iter().position(|p| *p == part).expect("every part");
                pole.participation.map_or_else(none, |all| format!("{:.3}", all[index]))
            };
            table.add_row([
                time.clone(),
                variant.clone(),
                pole.mode.map_or_else(none, |mode| definition.modes[mode].clone()),
                pole.branch.name().to_owned(),
                pole.label.clone().unwrap_or_default(),
                format!("{:.5}", pole.value.re),
                format!("{:.5}", pole.value.im),
                format!("{:.4}", pole.frequency_hz()),
                format!("{:.3}", 100.0 * pole.damping_ratio()),
                pole.time_to_double_s().map_or_else(none, |t| format!("{t:.2}")),
                share(Part::Structure),
                share(Part::Nozzle),
            ]);
        }
    }
    for (index, column) in table.column_iter_mut().enumerate() {
        if index == 0 || index >= 5 {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.to_string()
}
