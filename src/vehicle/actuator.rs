//! An actuator of one gimbal axis, as nominal data.

use nalgebra::Vector3;

/// Whether the flex bearing is part of the actuator's stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bearing {
    /// The bearing stiffness is inside the actuator stiffness and is not added.
    Included,
    /// The bearing stiffness acts on the gimbal rotation besides the actuator.
    Separate,
}

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
    /// Whether the flex bearing is part of the stiffness.
    pub bearing: Bearing,
    /// Torque law.
    pub law: SecondOrder,
}
