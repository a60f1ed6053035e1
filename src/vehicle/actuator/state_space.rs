//! The actuator given by its matrices.

use crate::vehicle::StateSpace;
use std::sync::Arc;

/// `ẋ = (A x + B [δ_c, Θ, Θ̇])/h`, `τ = g (C x + D [δ_c, Θ, Θ̇])`, with factors g on the gain and h on the time
/// constants.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpaceActuator {
    /// A, B (n×3), C (1×n) and D (1×3), τ in N·m.
    pub system: Arc<StateSpace>,
    /// Factor g, −.
    pub gain: f64,
    /// Factor h, −.
    pub time_scale: f64,
}

impl StateSpaceActuator {
    /// Torque τ, N·m, from [δ_c, Θ, Θ̇].
    pub fn state_space(&self) -> StateSpace {
        self.system.scaled(self.gain, self.time_scale)
    }
}
