//! Tanks of the vehicle file: what their values mean together and with the modal data.
//!
//! The equations of slosh are in `vehicle::tank`.

use super::table::Findings;
use super::vehicle_file::{TankFile, VehicleFile};
use super::{gimbal, names};
use crate::spelling::allowed_instead;
use crate::vehicle::{Modal, ModeSet, Slosh, Tank};
use nalgebra::{Matrix3x2, Vector3};

/// The tanks of the file, `None` where one of them is not usable.
pub fn resolve(
    file: &VehicleFile,
    sets: &[&ModeSet],
    modal: Option<&Modal>,
    f: &mut Findings,
) -> Option<Vec<Tank>> {
    names::unique(f, "tank", file.tank.iter().map(|tank| tank.name.as_str()));
    let contained: &[String] = modal.map_or(&[], |modal| &modal.contains_tanks);
    let known = || file.tank.iter().map(|tank| tank.name.as_str());
    for name in contained.iter().filter(|name| !known().any(|tank| tank == *name)) {
        let found = format!("a package whose modes contain a tank \"{name}\"");
        f.push("modal_package", found, allowed_instead(name, known()));
    }
    let tanks: Vec<Option<Tank>> = (file.tank.iter().enumerate())
        .map(|(i, raw)| {
            let in_modes = contained.contains(&raw.name);
            tank(raw, &format!("tank[{i}]"), &file.flight_times_s, sets, in_modes, f)
        })
        .collect();
    tanks.into_iter().collect()
}

fn tank(
    file: &TankFile,
    key: &str,
    flight_times_s: &[f64],
    sets: &[&ModeSet],
    in_modes: bool,
    f: &mut Findings,
) -> Option<Tank> {
    names::word(f, &format!("{key}.name"), &file.name);
    let mut good = names::table_of_times(f, key, &file.time_s, flight_times_s);
    if let Some(set) = sets.iter().find(|set| set.grid(&file.grid).is_none()) {
        let found = format!("grid \"{}\", missing at {} s", file.grid, set.flight_time_s);
        let known = set.grids.iter().map(|grid| grid.name.as_str());
        f.push(format!("{key}.grid"), found, allowed_instead(&file.grid, known));
        good = false;
    }
    let count = file.time_s.len();
    let mut positive = |name: &str, values: &[f64]| {
        names::table_entries(f, &format!("{key}.{name}"), values, count, |x| x > 0.0, "numbers > 0")
    };
    let given = match (&file.slosh_mass_kg, &file.frequency_hz) {
        (Some(mass), Some(frequency)) => {
            good &= positive("slosh_mass_kg", mass) & positive("frequency_hz", frequency);
            Some(Slosh::Given { mass_kg: mass.clone(), frequency_hz: frequency.clone() })
        }
        _ => None,
    };
    let shaped = match (&file.cylinder, &file.liquid_kg) {
        (Some(cylinder), Some(liquid)) => {
            good &= positive("liquid_kg", liquid);
            Some(Slosh::Cylinder {
                radius_m: cylinder.radius_m,
                density_kg_m3: cylinder.density_kg_m3,
                liquid_kg: liquid.clone(),
            })
        }
        _ => None,
    };
    let some = [
        (file.slosh_mass_kg.is_some(), "slosh_mass_kg"),
        (file.frequency_hz.is_some(), "frequency_hz"),
        (file.cylinder.is_some(), "cylinder"),
        (file.liquid_kg.is_some(), "liquid_kg"),
    ];
    let present: Vec<&str> = some.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
    let slosh = match (given, shaped) {
        (Some(slosh), None) | (None, Some(slosh)) if present.len() == 2 => Some(slosh),
        _ => {
            let found =
                if present.is_empty() { "neither".to_owned() } else { present.join(" and ") };
            let allowed = "`slosh_mass_kg` and `frequency_hz`, or `cylinder` and `liquid_kg`";
            f.push(key, found, allowed);
            None
        }
    };
    let axis = gimbal::unit(file.axis)
        .map_err(|(found, allowed)| f.push(format!("{key}.axis"), found, allowed))
        .ok()?;
    Some(Tank {
        name: file.name.clone(),
        grid: file.grid.clone(),
        axes: lateral(&axis),
        time_s: file.time_s.clone(),
        slosh: slosh.filter(|_| good)?,
        damping_ratio: file.damping_ratio,
        in_modes,
    })
}

/// Two lateral axes of a tank: the first nearest to y (to z for a tank along y), the second making
/// `axis`, first, second a right-handed frame; y and z for a tank along x.
fn lateral(axis: &Vector3<f64>) -> Matrix3x2<f64> {
    let start = if axis.y.abs() < 0.9 { Vector3::y() } else { Vector3::z() };
    let first = (start - axis * axis.dot(&start)).normalize();
    Matrix3x2::from_columns(&[first, axis.cross(&first)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lateral_axes_are_orthonormal_and_y_and_z_along_the_centreline() {
        assert_eq!(lateral(&Vector3::x()), Matrix3x2::from_columns(&[Vector3::y(), Vector3::z()]));
        for axis in [[0.0, 1.0, 0.0], [0.6, 0.64, 0.48]].map(Vector3::from) {
            let axes = lateral(&axis);
            let product = axes.transpose() * axes;
            assert!((product - nalgebra::Matrix2::identity()).amax() < 1e-15);
            assert!((axes.transpose() * axis).amax() < 1e-15);
        }
    }
}
