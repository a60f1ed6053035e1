//! The reference vehicle file and modal data that fit it, for the tests of this module.

use crate::vehicle::{Grid, MassProperties, Modal, Mode, ModeSet};
use nalgebra::{Matrix3, Vector3};

/// The reference vehicle file.
pub const VEHICLE: &str = include_str!("../../vehicles/sls-like/vehicle.toml");

/// A label that the named mode of the reference vehicle carries.
pub fn label() -> String {
    let table: toml::Table = VEHICLE.parse().unwrap();
    table["named_mode"][0]["labels"][0].as_str().unwrap().into()
}

/// Modes with the grids of the reference vehicle at its flight times: the named mode at 5.2 Hz
/// between two others.
pub fn modal() -> Modal {
    let mut points: Vec<(String, [f64; 3])> = Vec::new();
    for (side, y) in [("left", -6.35), ("right", 6.35_f64)] {
        let outboard = y + 1.2657 * y.signum();
        points.push((format!("booster.{side}.gimbal"), [90.7, y, 0.0]));
        points.push((format!("booster.{side}.rock"), [90.7, outboard, 1.2657]));
        points.push((format!("booster.{side}.tilt"), [90.7, outboard, -1.2657]));
        for i in 0..5 {
            let x = 52.0 + 8.0 * f64::from(i);
            points.push((format!("booster.{side}.case.{:02}", i + 1), [x, y, 0.0]));
        }
        points.push((format!("booster.{side}.aft.01"), [88.725, y, 0.0]));
        points.push((format!("booster.{side}.aft.02"), [89.7, y, 0.0]));
        points.push((format!("booster.{side}.aft.03"), [91.5, y, 0.0]));
    }
    for (i, (y, z)) in [(-2.0, 2.0), (2.0, 2.0), (-2.0, -2.0), (2.0, -2.0_f64)].iter().enumerate() {
        let y: &f64 = y;
        points.push((format!("core.{}.gimbal", i + 1), [94.0, *y, *z]));
        points.push((format!("core.{}.rock", i + 1), [94.0, *y, z + 0.76 * z.signum()]));
        points.push((format!("core.{}.tilt", i + 1), [94.0, y + 0.76 * y.signum(), *z]));
    }
    points.push(("tank.lox".into(), [42.1, 0.0, 0.0]));
    points.push(("tank.lh2".into(), [65.4, 0.0, 0.0]));
    for (name, x) in [("core.aft", 93.0), ("intertank", 56.0), ("upper", 20.0)] {
        points.push((format!("gyro.{name}"), [x, 0.0, 0.0]));
    }
    let grids: Vec<Grid> = points
        .into_iter()
        .map(|(name, at)| Grid {
            name,
            position_m: Vector3::from(at),
            mass_kg: Vector3::zeros(),
            inertia_kg_m2: Vector3::zeros(),
        })
        .collect();
    let count = grids.len();
    let mode = |label: &str, frequency_hz| Mode {
        label: label.into(),
        frequency_hz,
        shape: vec![Vector3::zeros(); count],
        slope: vec![Vector3::zeros(); count],
    };
    let modes = vec![mode("below", 4.0), mode(&label(), 5.2), mode("above", 12.0)];
    let body =
        MassProperties { mass_kg: 1e6, cg_m: Vector3::zeros(), inertia_kg_m2: Matrix3::identity() };
    let sets = [80.0, 90.0, 95.0, 100.0, 105.0, 110.0, 112.0, 114.0]
        .map(|flight_time_s| ModeSet {
            flight_time_s,
            body,
            grids: grids.clone(),
            modes: modes.clone(),
        })
        .to_vec();
    Modal {
        source: "test".into(),
        contains_engines: Vec::new(),
        contains_tanks: Vec::new(),
        sets,
        parents: Vec::new(),
    }
}
