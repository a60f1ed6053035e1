//! The second-order actuator: a spring and a damper between command and nozzle.

use crate::vehicle::StateSpace;
use nalgebra::DMatrix;

/// Second-order actuator, its stiffness and damping held at the reference inertia
/// (`K_a = J_ref ω_n²`, `C_a = 2ζ√(J_ref K_a)`; paper, after (2)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder {
    /// Nominal stiffness K_a, N·m/rad.
    pub stiffness_n_m_rad: f64,
    /// Closed-loop damping ratio ζ at the reference inertia, −.
    pub damping_ratio: f64,
    /// Reference inertia about the pivot J_ref, kg·m².
    pub reference_inertia_kg_m2: f64,
}

impl SecondOrder {
    /// Nominal damping `C_a = 2ζ√(J_ref K_a)`, N·m·s/rad.
    pub fn damping_n_m_s_rad(&self) -> f64 {
        let critical = (self.reference_inertia_kg_m2 * self.stiffness_n_m_rad).sqrt();
        2.0 * self.damping_ratio * critical
    }

    /// Torque `τ = K_a (δ_c − Θ) − C_a Θ̇`, N·m, from [δ_c, Θ, Θ̇].
    pub fn state_space(&self) -> StateSpace {
        let (k, c) = (self.stiffness_n_m_rad, self.damping_n_m_s_rad());
        StateSpace::gain(DMatrix::from_row_slice(1, 3, &[k, -k, -c]))
    }
}
