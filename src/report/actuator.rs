//! Response of nozzles on their actuators to external load torques, as a table.
//!
//! It is computed in `dynamics::load_response`.

use crate::dynamics::load_response::LoadResponse;
use crate::vehicle::Engine;
use comfy_table::{CellAlignment, Table, presets};
use std::f64::consts::TAU;

/// A row per actuator and nozzle state: unablated, and ablated as after full burn with the nominal
/// factor.
pub fn table<'a>(engines: impl Iterator<Item = &'a Engine>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header([
        "actuator",
        "nozzle",
        "inertia\nkg·m²",
        "static\ncompliance\nrad/(MN·m)",
        "TVC\nresonance\nHz",
        "equivalent\ndamping\nratio",
        "equivalent\nstiffness\nMN·m/rad",
        "equivalent\ndamping\nkN·m·s/rad",
    ]);
    for engine in engines {
        let mut states = vec![("unablated", engine.nozzle)];
        if let Some(ablation) = engine.nozzle.ablation {
            states.push(("ablated", engine.nozzle.ablated(ablation.factor)));
        }
        for (axis, actuator) in engine.actuators.iter().enumerate() {
            let (stiffness, damping) = engine.gimbal_stiffness_and_damping(axis);
            for (state, nozzle) in &states {
                let inertia = nozzle.inertia_kg_m2;
                let response =
                    LoadResponse::of(inertia, |s| s * s * inertia + s * damping + stiffness);
                let mut row = vec![
                    format!("{}.{}", engine.path(), actuator.name),
                    (*state).to_string(),
                    format!("{inertia:.0}"),
                    format!("{:.6}", response.static_compliance_rad_n_m * 1e6),
                ];
                row.extend(match response.resonance {
                    Some(r) => [
                        format!("{:.4}", r.omega_rad_s / TAU),
                        format!("{:.5}", r.damping_ratio),
                        format!("{:.4}", r.stiffness_n_m_rad / 1e6),
                        format!("{:.2}", r.damping_n_m_s_rad / 1e3),
                    ],
                    None => ["none", "", "", ""].map(String::from),
                });
                table.add_row(row);
            }
        }
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
