//! Response of nozzles on their actuators to external load torques, as a table.
//!
//! It is computed in `dynamics::load_response`.

use crate::dynamics::load_response::NozzleOnActuator;
use crate::vehicle::{Engine, Law};
use comfy_table::{CellAlignment, Table, presets};
use std::f64::consts::TAU;

/// Nozzle states of an engine by name, with their inertias about the pivot, kg·m²: unablated, and ablated
/// as after full burn with the nominal factor.
pub fn nozzle_states(engine: &Engine) -> Vec<(&'static str, f64)> {
    let mut states = vec![("unablated", engine.nozzle.inertia_kg_m2)];
    if let Some(ablation) = engine.nozzle.ablation {
        states.push(("ablated", engine.nozzle.ablated(ablation.factor).inertia_kg_m2));
    }
    states
}

/// A row per actuator of every set and nozzle state.
pub fn table<'a>(engines: impl Iterator<Item = &'a Engine>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header([
        "actuator",
        "set",
        "kind",
        "nozzle",
        "inertia\nkg·m²",
        "static\ncompliance\nrad/(MN·m)",
        "TVC\nresonance\nHz",
        "equivalent\ndamping\nratio",
        "equivalent\nstiffness\nMN·m/rad",
        "equivalent\ndamping\nkN·m·s/rad",
    ]);
    for engine in engines {
        let actuators = engine.sets().flat_map(|(set, pair)| pair.iter().map(move |a| (set, a)));
        for (set, actuator) in actuators {
            let kind = match actuator.law {
                Law::SecondOrder(_) => "second-order",
                Law::Electrohydraulic(_) => "electrohydraulic",
                Law::TransferFunction(_) => "transfer-function",
                Law::StateSpace(_) => "state-space",
            };
            for (state, inertia) in nozzle_states(engine) {
                let response = NozzleOnActuator::new(engine, actuator, inertia).load_response();
                let mut row = vec![
                    format!("{}.{}", engine.path(), actuator.name),
                    set.unwrap_or("").to_owned(),
                    kind.to_owned(),
                    state.to_owned(),
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
    for column in table.column_iter_mut().skip(4) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
