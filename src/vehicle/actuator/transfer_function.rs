//! The actuator given by transfer functions: torque per command, and dynamic stiffness.

use crate::vehicle::{StateSpace, TransferFunction};
use nalgebra::DMatrix;
use std::sync::Arc;

/// `τ = g [G(hs) δ_c − Z(hs) Θ − C Θ̇]`, with factors g on the gain and h on the time constants.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferActuator {
    /// Torque per command G, N·m/rad; `None` where it is Z.
    pub command: Option<Arc<TransferFunction>>,
    /// Dynamic stiffness Z, N·m/rad.
    pub stiffness: Arc<TransferFunction>,
    /// Damping C beside it, N·m·s/rad.
    pub damping_n_m_s_rad: f64,
    /// Factor g, −.
    pub gain: f64,
    /// Factor h, −.
    pub time_scale: f64,
}

impl TransferActuator {
    /// Torque τ, N·m, from [δ_c, Θ, Θ̇].
    pub fn state_space(&self) -> StateSpace {
        let row = |values: &[f64]| DMatrix::from_row_slice(1, 3, values);
        let load = self.stiffness.state_space();
        let mut system = match &self.command {
            None => load.after(&row(&[1.0, -1.0, 0.0])),
            Some(command) => {
                let command = command.state_space().after(&row(&[1.0, 0.0, 0.0]));
                command.beside(&load.after(&row(&[0.0, -1.0, 0.0])))
            }
        };
        // The rate is no time constant of G or Z: C keeps its value.
        system = system.scaled(self.gain, self.time_scale);
        system.d[(0, 2)] -= self.gain * self.damping_n_m_s_rad;
        system
    }
}
