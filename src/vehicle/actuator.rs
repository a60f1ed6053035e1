//! An actuator of one gimbal axis, as nominal data; one file for each kind of torque law.

mod electrohydraulic;
mod second_order;
mod state_space;
mod transfer_function;

pub use electrohydraulic::Electrohydraulic;
pub use second_order::SecondOrder;
pub use state_space::StateSpaceActuator;
pub use transfer_function::TransferActuator;

use super::StateSpace;
use nalgebra::Vector3;

/// Whether the flex bearing is part of the actuator's figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bearing {
    /// Stiffness and damping of the bearing are inside those of the actuator and are not added.
    Included,
    /// Stiffness and damping of the bearing act on the gimbal rotation besides the actuator.
    Separate,
}

/// Torque law: torque τ on the nozzle from the command δ_c, the gimbal rotation Θ and its rate.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Spring and damper between command and nozzle.
    SecondOrder(SecondOrder),
    /// Servo valve, cylinder and load path.
    Electrohydraulic(Electrohydraulic),
    /// Transfer functions.
    TransferFunction(TransferActuator),
    /// Matrices.
    StateSpace(StateSpaceActuator),
}

impl Law {
    /// Torque τ, N·m, from [δ_c, Θ, Θ̇] (rad, rad, rad/s).
    pub fn state_space(&self) -> StateSpace {
        match self {
            Self::SecondOrder(law) => law.state_space(),
            Self::Electrohydraulic(law) => law.state_space(),
            Self::TransferFunction(law) => law.state_space(),
            Self::StateSpace(law) => law.state_space(),
        }
    }

    /// Most poles at the origin with the nozzle held; the same for every draw.
    pub fn poles_at_origin(&self) -> usize {
        match self {
            Self::SecondOrder(_) | Self::Electrohydraulic(_) => 0,
            Self::TransferFunction(law) => {
                let command = law.command.as_ref().map_or(0, |command| command.poles_at_origin());
                command + law.stiffness.poles_at_origin()
            }
            Self::StateSpace(law) if law.system.a.is_empty() => 0,
            // Of given matrices the rank tells.
            Self::StateSpace(law) => {
                let a = &law.system.a;
                let values = a.singular_values();
                let least = a.nrows() as f64 * f64::EPSILON * values.max();
                values.iter().filter(|value| !(**value > least)).count()
            }
        }
    }

    /// Number of states; the same for every draw.
    pub fn order(&self) -> usize {
        self.state_space().order()
    }
}

/// One actuator; it drives one gimbal axis of its engine.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuator {
    /// Name inside its engine, for instance `rock`.
    pub name: String,
    /// Grid of the backup structure to which it is attached (for the Improved Virtual Grid).
    pub attach_grid: String,
    /// Attach point from the gimbal r_b, m.
    pub attach_m: Vector3<f64>,
    /// Unit action line u_b.
    pub action_line: Vector3<f64>,
    /// Whether the flex bearing is part of its figures.
    pub bearing: Bearing,
    /// Torque law.
    pub law: Law,
}

/// An alternative pair of actuators of an engine, in the place of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct ActuatorSet {
    /// Name by which a variant picks it.
    pub name: String,
    /// One per gimbal axis, in the order of the axes.
    pub actuators: [Actuator; 2],
}

#[cfg(test)]
mod tests;
