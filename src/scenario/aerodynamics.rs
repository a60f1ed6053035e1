//! Aerodynamics of the vehicle file: what its values mean together and with the modal data.
//!
//! The forces they make are in `dynamics::aerodynamics`.

use super::names;
use super::table::Findings;
use super::vehicle_file::{AerodynamicsFile, VehicleFile};
use crate::spelling::allowed_instead;
use crate::vehicle::Modal;
use crate::vehicle::aerodynamics::{Aerodynamics, Generalised};

/// Rigid coordinates that a generalised matrix may name, beside modal labels.
const RIGID: [&str; 6] = ["xi.x", "xi.y", "xi.z", "theta.x", "theta.y", "theta.z"];

/// The aerodynamics of the file; the outer `None` where they are not usable.
pub fn resolve(
    file: &VehicleFile,
    modal: Option<&Modal>,
    f: &mut Findings,
) -> Option<Option<Aerodynamics>> {
    let Some(raw) = &file.aerodynamics else { return Some(None) };
    let key = "aerodynamics";
    let mut good = names::table_of_times(f, key, &raw.time_s, &file.flight_times_s);
    let count = raw.time_s.len();
    /// Key, values, what holds for each, and that in words.
    type Table<'a> = (&'a str, &'a [f64], fn(f64) -> bool, &'a str);
    let tables: [Table; 7] = [
        ("dynamic_pressure_pa", &raw.dynamic_pressure_pa, |x| x >= 0.0, "numbers ≥ 0"),
        ("speed_m_s", &raw.speed_m_s, |x| x > 0.0, "numbers > 0"),
        ("normal_force_slope_1_rad", &raw.normal_force_slope_1_rad, f64::is_finite, "numbers"),
        ("center_of_pressure_x_m", &raw.center_of_pressure_x_m, f64::is_finite, "numbers"),
        ("axial_force", &raw.axial_force, |x| x >= 0.0, "numbers ≥ 0"),
        ("pitch_damping", &raw.pitch_damping, f64::is_finite, "numbers"),
        ("roll_damping", &raw.roll_damping, f64::is_finite, "numbers"),
    ];
    for (name, values, holds, allowed) in tables {
        good &= names::table_entries(f, &format!("{key}.{name}"), values, count, holds, allowed);
    }
    let mut seen: Vec<f64> = Vec::new();
    let mut generalised = Vec::new();
    for (i, matrix) in raw.matrix.iter().enumerate() {
        let key = format!("{key}.matrix[{i}]");
        let time = matrix.flight_time_s;
        if !file.flight_times_s.contains(&time) || seen.contains(&time) {
            let allowed = "a flight time of the vehicle, each once";
            f.push(format!("{key}.flight_time_s"), format!("{time} s"), allowed);
            good = false;
        }
        seen.push(time);
        let labels = modal.map(Modal::labels).unwrap_or_default();
        for (j, name) in matrix.coordinates.iter().enumerate() {
            let known = || labels.iter().copied().chain(RIGID);
            if modal.is_some() && !known().any(|k| k == name) {
                let found = format!("\"{name}\"");
                f.push(format!("{key}.coordinates[{j}]"), found, allowed_instead(name, known()));
                good = false;
            }
        }
        let size = matrix.coordinates.len();
        for (name, rows) in [("stiffness", &matrix.stiffness), ("damping", &matrix.damping)] {
            if rows.len() != size || rows.iter().any(|row| row.len() != size) {
                let found = format!(
                    "{} rows of {:?} entries",
                    rows.len(),
                    rows.iter().map(Vec::len).collect::<Vec<_>>()
                );
                let allowed = format!("{size} rows of {size} numbers, as many as `coordinates`");
                f.push(format!("{key}.{name}"), found, allowed);
                good = false;
            }
        }
        generalised.push(Generalised {
            flight_time_s: time,
            coordinates: matrix.coordinates.clone(),
            stiffness: matrix.stiffness.clone(),
            damping: matrix.damping.clone(),
        });
    }
    good.then(|| Some(values(raw, generalised)))
}

fn values(file: &AerodynamicsFile, generalised: Vec<Generalised>) -> Aerodynamics {
    Aerodynamics {
        area_m2: file.area_m2,
        length_m: file.length_m,
        time_s: file.time_s.clone(),
        dynamic_pressure_pa: file.dynamic_pressure_pa.clone(),
        speed_m_s: file.speed_m_s.clone(),
        normal_force_slope_1_rad: file.normal_force_slope_1_rad.clone(),
        center_of_pressure_x_m: file.center_of_pressure_x_m.clone(),
        axial_force: file.axial_force.clone(),
        pitch_damping: file.pitch_damping.clone(),
        roll_damping: file.roll_damping.clone(),
        generalised,
    }
}
