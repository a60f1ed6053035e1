//! The vehicle: validated values, with no randomness, no files and no equations.

pub mod actuator;
pub mod aerodynamics;
pub mod autopilot;
pub mod delay;
pub mod engine;
pub mod filter;
pub mod motor;
pub mod package;
pub mod state_space;
pub mod tank;
pub mod transfer_function;

pub use actuator::{
    Actuator, ActuatorSet, Bearing, Electrohydraulic, Law, SecondOrder, StateSpaceActuator,
    TransferActuator,
};
pub use aerodynamics::Aerodynamics;
pub use autopilot::{Allocation, Autopilot, Axis, Path, Sensor, SensorKind};
pub use engine::{Ablation, Engine, Nozzle};
pub use filter::{Filter, FilterDraw, FilterKind};
pub use motor::Motor;
pub use package::{Grid, MassProperties, Modal, Mode, ModeSet, Parent};
pub use state_space::StateSpace;
pub use tank::{Slosh, Tank};
pub use transfer_function::TransferFunction;

use nalgebra::Vector3;

/// Standard gravity, m/s² (CGPM 1901), by which a specific impulse in seconds is defined.
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// A validated vehicle: the modal data of its body and its engines.
#[derive(Debug, Clone)]
pub struct Vehicle {
    /// Name shown wherever results are shown, for instance `SLS-like, synthetic`.
    pub name: String,
    /// Structural damping ratio of every mode unless dispersed, −.
    pub structural_damping: f64,
    /// Flight time at which the nominal frequency of a label decides its band, s.
    pub band_time_s: f64,
    /// Named modes: name, and the labels that carry it; at a flight time the first one present counts.
    pub named_modes: Vec<NamedMode>,
    /// Engines in file order.
    pub engines: Vec<Engine>,
    /// Autopilot, if the vehicle has one.
    pub autopilot: Option<Autopilot>,
    /// Tanks in file order.
    pub tanks: Vec<Tank>,
    /// Aerodynamics, if any.
    pub aerodynamics: Option<Aerodynamics>,
    /// Modes per flight time.
    pub modal: Modal,
}

impl Vehicle {
    /// Names of the alternative sets of actuators, in file order.
    pub fn actuator_sets(&self) -> Vec<&str> {
        let mut sets: Vec<&str> = Vec::new();
        for set in self.engines.iter().flat_map(|engine| &engine.alternatives) {
            if !sets.contains(&set.name.as_str()) {
                sets.push(&set.name);
            }
        }
        sets
    }

    /// Modulus of the nominal mean acceleration at the flight time of `set`, m/s²: `Σ R u` over the
    /// mass of the body and of what its modes do not contain.
    pub fn nominal_acceleration_m_s2(&self, set: &ModeSet) -> f64 {
        let time_s = set.flight_time_s;
        let mut mass = set.body.mass_kg;
        let mut force = Vector3::zeros();
        for engine in &self.engines {
            force += engine.thrust_direction * engine.motor.thrust_at(time_s);
            if !engine.in_modes {
                let factor = engine.nozzle.ablation.map_or(0.0, |ablation| ablation.factor);
                let share = factor * engine.motor.burned_fraction_at(time_s);
                mass += engine.nozzle.ablated(share).mass_kg;
            }
        }
        mass += (self.tanks.iter().filter(|tank| !tank.in_modes))
            .map(|tank| tank.mass_kg(time_s))
            .sum::<f64>();
        force.norm() / mass
    }
}

/// A mode of interest by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedMode {
    /// Name, for instance `tvse`.
    pub name: String,
    /// Labels of the modal package that carry the name, the first one present at a flight time counts.
    pub labels: Vec<String>,
}
