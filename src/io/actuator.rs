//! Frequency responses of nozzles on their actuators, as a table on disk.
//!
//! They are computed in `dynamics::load_response`.

use super::files;
use super::flat::{Column, Holds, Layout, Table};
use super::model::Format;
use crate::dynamics::load_response::NozzleOnActuator;
use crate::problem::Problems;
use crate::report::actuator::nozzle_states;
use crate::vehicle::Engine;
use std::f64::consts::TAU;
use std::path::Path;

const RESPONSE: Layout = Layout {
    name: "actuator_response",
    columns: &[
        Column("engine", Holds::Text, "Path of the engine"),
        Column("actuator", Holds::Text, "Name of the actuator"),
        Column("set", Holds::Text, "Alternative set; empty for the engine's own actuators"),
        Column("nozzle", Holds::Text, "unablated, or ablated as after full burn"),
        Column("frequency_hz", Holds::Number("Hz"), "Frequency"),
        Column("compliance_re_rad_n_m", Holds::Number("rad/(N m)"), "Load compliance: real part"),
        Column(
            "compliance_im_rad_n_m",
            Holds::Number("rad/(N m)"),
            "Load compliance: imaginary part",
        ),
        Column(
            "compliance_magnitude_rad_n_m",
            Holds::Number("rad/(N m)"),
            "Load compliance: modulus",
        ),
        Column("compliance_phase_deg", Holds::Number("deg"), "Load compliance: phase, -180 to 180"),
        Column("command_re", Holds::Number("1"), "Rotation per command: real part"),
        Column("command_im", Holds::Number("1"), "Rotation per command: imaginary part"),
        Column("command_magnitude", Holds::Number("1"), "Rotation per command: modulus"),
        Column(
            "command_phase_deg",
            Holds::Number("deg"),
            "Rotation per command: phase, -180 to 180",
        ),
    ],
};

/// Writes the responses of every actuator and nozzle state of `engines` at these frequencies, Hz.
///
/// # Errors
/// An input problem if it cannot be written.
pub fn write<'a>(
    target: &Path,
    format: Format,
    engines: impl Iterator<Item = &'a Engine>,
    frequency_hz: &[f64],
) -> Result<(), Problems> {
    let mut table = Table::new(&RESPONSE);
    for engine in engines {
        let path = engine.path();
        for (set, actuator) in
            engine.sets().flat_map(|(set, pair)| pair.iter().map(move |a| (set, a)))
        {
            for (state, inertia) in nozzle_states(engine) {
                let nozzle = NozzleOnActuator::new(engine, actuator, inertia);
                let texts = [path.as_str(), actuator.name.as_str(), set.unwrap_or(""), state];
                for &hertz in frequency_hz {
                    let mut numbers = vec![hertz];
                    for z in nozzle.response(TAU * hertz) {
                        numbers.extend([z.re, z.im, z.norm(), z.arg().to_degrees()]);
                    }
                    table.push(&texts, &numbers);
                }
            }
        }
    }
    files::write(target, &format.bytes(&RESPONSE, &table, target)?)
}
