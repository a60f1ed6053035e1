//! One drawn vehicle at one flight time: the numbers that enter the equations of motion.
//!
//! Where they come from (nominal values and draws) is decided in `campaign`.

use crate::vehicle::{FilterDraw, StateSpace};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// An actuator as drawn, with the flex bearing beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnActuator {
    /// Stiffness directly on the gimbal rotation, N·m/rad: second-order actuator, separate bearing.
    pub stiffness_n_m_rad: f64,
    /// Damping directly on the gimbal rotation, N·m·s/rad.
    pub damping_n_m_s_rad: f64,
    /// Torque beside them, N·m, from [δ_c, Θ, Θ̇].
    pub torque: StateSpace,
}

impl DrawnActuator {
    /// A spring and a damper between command and nozzle.
    pub fn spring(stiffness_n_m_rad: f64, damping_n_m_s_rad: f64) -> Self {
        let command = DMatrix::from_row_slice(1, 3, &[stiffness_n_m_rad, 0.0, 0.0]);
        Self { stiffness_n_m_rad, damping_n_m_s_rad, torque: StateSpace::gain(command) }
    }
}

/// A sensor as drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DrawnSensor {
    /// Scale factor, −.
    pub scale: f64,
    /// Gain on the slope of each mode at its grid, −.
    pub slope_gain: Vec<f64>,
}

/// A path of the autopilot as drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DrawnPath {
    /// Gain, −.
    pub gain: f64,
    /// What the draw makes of each filter.
    pub filters: Vec<FilterDraw>,
}

/// The autopilot as drawn; empty for a vehicle without one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DrawnAutopilot {
    /// Loop delay, s.
    pub delay_s: f64,
    /// Sensors, in the order of the vehicle.
    pub sensors: Vec<DrawnSensor>,
    /// Paths, in the order of the vehicle.
    pub paths: Vec<DrawnPath>,
}

/// An engine as drawn, ablation and gains applied.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DrawnEngine {
    /// Thrust R, N.
    pub thrust_n: f64,
    /// Mass flow ṁ, kg/s.
    pub mass_flow_kg_s: f64,
    /// Moving mass m, kg.
    pub mass_kg: f64,
    /// Distance of the cg from the gimbal along the exhaust direction, m.
    pub cg_m: f64,
    /// Transverse inertia about the gimbal J_G, kg·m².
    pub inertia_kg_m2: f64,
    /// Inertia about the nozzle axis, kg·m².
    pub axial_inertia_kg_m2: f64,
    /// Nozzle length L_n, m.
    pub length_m: f64,
    /// Actuators of each set, one per gimbal axis, as in `Engine::sets`.
    pub actuators: Vec<[DrawnActuator; 2]>,
    /// Gain on the gimbal shape Φ_g per mode, −.
    pub shape_gain: Vec<f64>,
    /// Gain on the gimbal slope Ψ_g per mode, −.
    pub slope_gain: Vec<f64>,
}

impl DrawnEngine {
    /// Transverse inertia about the engine's own cg `J_c = J_G − m r²`, kg·m².
    pub fn central_inertia_kg_m2(&self) -> f64 {
        self.inertia_kg_m2 - self.mass_kg * self.cg_m * self.cg_m
    }

    /// Inertia tensor about the engine's own cg for an axis of symmetry `axis` (unit), kg·m².
    pub fn central_inertia_tensor(&self, axis: &Vector3<f64>) -> Matrix3<f64> {
        let along = axis * axis.transpose();
        along * self.axial_inertia_kg_m2
            + (Matrix3::identity() - along) * self.central_inertia_kg_m2()
    }
}

/// The body as drawn: frequency and damping per mode, inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnBody {
    /// Natural frequency Ω per mode, rad/s.
    pub frequency_rad_s: Vec<f64>,
    /// Damping ratio ζ per mode, −.
    pub damping_ratio: Vec<f64>,
    /// Gain on the inertia of the body about x (roll), y (pitch) and z (yaw), −.
    pub inertia_gain: [f64; 3],
}

impl Default for DrawnBody {
    fn default() -> Self {
        Self { frequency_rad_s: Vec::new(), damping_ratio: Vec::new(), inertia_gain: [1.0; 3] }
    }
}

/// The slosh mass of a tank as drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DrawnTank {
    /// Slosh mass m_s, kg.
    pub mass_kg: f64,
    /// Slosh frequency ω_s, rad/s.
    pub frequency_rad_s: f64,
    /// Slosh damping ratio ζ_s, −.
    pub damping_ratio: f64,
}

/// The aerodynamics as drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DrawnAerodynamics {
    /// Dynamic pressure q, Pa.
    pub dynamic_pressure_pa: f64,
    /// Slope of the normal force coefficient C_Nα, 1/rad.
    pub normal_force_slope_1_rad: f64,
    /// Station of the centre of pressure, structural frame, m.
    pub center_of_pressure_x_m: f64,
    /// Axial force coefficient C_A, −.
    pub axial_force: f64,
    /// Damping coefficient in pitch and yaw C_mq, −, negative where it damps.
    pub pitch_damping: f64,
    /// Damping coefficient in roll C_lp, −, negative where it damps.
    pub roll_damping: f64,
}

/// A drawn vehicle at one flight time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DrawnVehicle {
    /// The body.
    pub body: DrawnBody,
    /// Every engine of the vehicle, in its order.
    pub engines: Vec<DrawnEngine>,
    /// The autopilot.
    pub autopilot: DrawnAutopilot,
    /// Every tank of the vehicle, in its order.
    pub tanks: Vec<DrawnTank>,
    /// Aerodynamics at this flight time, if the vehicle has them.
    pub aerodynamics: Option<DrawnAerodynamics>,
}
