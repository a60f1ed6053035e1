//! A small vehicle for the tests of this module; nothing but tests uses it.

use crate::vehicle::{
    Ablation, Actuator, Bearing, Engine, Law, MassProperties, Modal, Mode, ModeSet, Motor, Nozzle,
    Parent, SecondOrder, Slosh, Tank, Vehicle,
};
use nalgebra::{Matrix3, Matrix3x2, Vector3};
use std::sync::Arc;

fn actuator(name: &str, bearing: Bearing) -> Actuator {
    Actuator {
        name: name.into(),
        attach_grid: "b1".into(),
        attach_m: Vector3::new(0.0, 1.0, 0.0),
        action_line: Vector3::x(),
        bearing,
        law: Law::SecondOrder(SecondOrder {
            stiffness_n_m_rad: 3.76e7,
            damping_ratio: 0.3,
            reference_inertia_kg_m2: 24_000.0,
        }),
    }
}

pub fn engine(group: &str, name: &str, bearing: Bearing) -> Engine {
    let motor = Motor {
        name: "motor".into(),
        specific_impulse_s: 267.4,
        time_s: vec![0.0, 120.0],
        thrust_n: vec![1.2e7, 1.0e7],
        mass_flow_kg_s: vec![4600.0, 3800.0],
        burned_fraction: vec![0.0, 1.0],
    };
    Engine {
        group: group.into(),
        name: name.into(),
        thrust_direction: -Vector3::x(),
        gimbal_grid: "g".into(),
        axes: Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, 1.0),
        motor: Arc::new(motor),
        nozzle: Nozzle {
            mass_kg: 8100.0,
            cg_m: 0.7,
            inertia_kg_m2: 24_000.0,
            axial_inertia_kg_m2: 15_000.0,
            length_m: 4.0,
            ablation: Some(Ablation {
                factor: 1.0,
                mass_loss_kg: 800.0,
                inertia_loss_kg_m2: 2500.0,
                cg_change_m: -0.03,
            }),
        },
        bearing_stiffness_n_m_rad: 2.0e6,
        bearing_damping_n_m_s_rad: 0.0,
        actuators: [actuator("rock", bearing), actuator("tilt", bearing)],
        alternatives: Vec::new(),
        case_stations: Vec::new(),
        in_modes: false,
    }
}

fn modes(flight_time_s: f64, labels: &[(&str, f64)]) -> ModeSet {
    let mode = |&(label, frequency_hz): &(&str, f64)| Mode {
        label: label.into(),
        frequency_hz,
        shape: Vec::new(),
        slope: Vec::new(),
    };
    ModeSet {
        flight_time_s,
        body: MassProperties {
            mass_kg: 1e6,
            cg_m: Vector3::zeros(),
            inertia_kg_m2: Matrix3::identity(),
        },
        grids: Vec::new(),
        modes: labels.iter().map(mode).collect(),
    }
}

fn tank(name: &str) -> Tank {
    Tank {
        name: name.into(),
        grid: format!("tank.{name}"),
        axes: Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, 1.0),
        time_s: vec![0.0],
        slosh: Slosh::Given { mass_kg: vec![1e5], frequency_hz: vec![0.5] },
        damping_ratio: 0.01,
        in_modes: false,
    }
}

fn with_modes(sets: Vec<ModeSet>, parents: Vec<Parent>) -> Vehicle {
    Vehicle {
        name: "test".into(),
        structural_damping: 0.005,
        band_time_s: 100.0,
        named_modes: Vec::new(),
        engines: vec![
            engine("booster", "left", Bearing::Included),
            engine("booster", "right", Bearing::Included),
        ],
        autopilot: None,
        tanks: ["lox", "lh2"].map(tank).into(),
        aerodynamics: None,
        modal: Modal {
            source: "test".into(),
            contains_engines: Vec::new(),
            contains_tanks: Vec::new(),
            sets,
            parents,
        },
    }
}

/// Two boosters and three modes (4, 5 and 10 Hz) at 100 s.
pub fn vehicle() -> Vehicle {
    with_modes(vec![modes(100.0, &[("m001", 4.0), ("m002", 5.0), ("m003", 10.0)])], Vec::new())
}

/// Modes at 90 and 100 s: m004 descends from m002 with overlap 0.8, m005 from m003 with 0.5.
pub fn vehicle_with_descendants() -> Vehicle {
    let parent = |label: &str, parent: &str, overlap| Parent {
        flight_time_s: 100.0,
        label: label.into(),
        parent: parent.into(),
        overlap,
    };
    with_modes(
        vec![
            modes(90.0, &[("m001", 3.9), ("m002", 4.9), ("m003", 9.9)]),
            modes(100.0, &[("m001", 4.0), ("m004", 5.2), ("m005", 10.0)]),
        ],
        vec![parent("m004", "m002", 0.8), parent("m005", "m003", 0.5)],
    )
}
