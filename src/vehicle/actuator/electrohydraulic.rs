//! The electrohydraulic actuator: servo valve, cylinder and load path, with a position loop and dynamic
//! pressure feedback.

use crate::vehicle::StateSpace;
use nalgebra::DMatrix;

/// A linear electrohydraulic actuator with a massless piston.
///
/// With F the force on the nozzle (positive extends), `P = F/A` the load pressure on the piston area A and x_p
/// the position of the piston, whose mass is neglected:
/// - load path, N: `F = K_s (x_p − r_a Θ)`;
/// - valve flow, m³/s: `Q = K_q i − (K_q/K_p) P`, with i the valve current, A, K_q the flow gain at no load,
///   m³/(s·A), and K_p the pressure gain with the load blocked, Pa/A;
/// - flow balance of the cylinder: `Q = A ẋ_p + (A²/K_h) Ṗ + C_l P`, with K_h = 4 β A²/V the stiffness of the
///   trapped oil on the piston, N/m, and C_l the leakage past it, m³/(s·Pa);
/// - amplifier: `i = K_x (r_a δ_c − x_p) − K_f P_h`, with K_x the gain of the position loop, A/m, on the position
///   of the piston, K_f the gain of the dynamic pressure feedback, A/Pa, and P_h the load pressure
///   through the high pass `s/(s + ω_f)`; ω_f = 0 feeds back the pressure itself.
///
/// With `x_p = r_a Θ + F/K_s`, `1/K_L = 1/K_h + 1/K_s`, `K_v = K_q K_x/A` (1/s), and the compliances in
/// m/(N·s) `c_s = (K_q/K_p + C_l)/A²` and `c_f = K_q K_f/A²` this is
///
/// ```text
/// Ḟ = K_L [ K_v (r_a (δ_c − Θ) − F/K_s) − c_s F − c_f (F − F_l) − r_a Θ̇ ]
/// Ḟ_l = ω_f (F − F_l)          τ = r_a F
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Electrohydraulic {
    /// Moment arm r_a of the actuator about the pivot, m.
    pub arm_m: f64,
    /// Piston area A, m².
    pub piston_area_m2: f64,
    /// Stiffness K_s of the load path (both attachments and the rod) at the actuator, N/m.
    pub load_path_stiffness_n_m: f64,
    /// Stiffness K_h of the trapped oil, N/m.
    pub oil_stiffness_n_m: f64,
    /// Leakage C_l past the piston, m³/(s·Pa).
    pub leakage_m3_s_pa: f64,
    /// Flow gain K_q of the servo valve, m³/(s·A).
    pub valve_flow_gain_m3_s_a: f64,
    /// Pressure gain K_p of the servo valve, Pa/A; infinite for an ideal one.
    pub valve_pressure_gain_pa_a: f64,
    /// Gain K_x of the position loop, A/m.
    pub position_gain_a_m: f64,
    /// Gain K_f of the dynamic pressure feedback, A/Pa.
    pub pressure_feedback_a_pa: f64,
    /// Corner ω_f of the high pass in the pressure feedback, rad/s; 0 for none.
    pub pressure_corner_rad_s: f64,
}

impl Electrohydraulic {
    /// Torque τ, N·m, from [δ_c, Θ, Θ̇]; states F and, where there is a high pass, F_l, N.
    pub fn state_space(&self) -> StateSpace {
        let area = self.piston_area_m2;
        let compliance = 1.0 / self.oil_stiffness_n_m + 1.0 / self.load_path_stiffness_n_m;
        let stiffness = 1.0 / compliance;
        let velocity = self.valve_flow_gain_m3_s_a * self.position_gain_a_m / area;
        let valve = self.valve_flow_gain_m3_s_a / self.valve_pressure_gain_pa_a;
        let still = (valve + self.leakage_m3_s_pa) / (area * area);
        let feedback = self.valve_flow_gain_m3_s_a * self.pressure_feedback_a_pa / (area * area);
        let relief = velocity / self.load_path_stiffness_n_m + still + feedback;
        let (arm, corner) = (self.arm_m, self.pressure_corner_rad_s);
        let drive = stiffness * velocity * arm;
        let inputs = [drive, -drive, -stiffness * arm];
        let d = DMatrix::zeros(1, 3);
        if corner == 0.0 {
            return StateSpace {
                a: DMatrix::from_element(1, 1, -stiffness * relief),
                b: DMatrix::from_row_slice(1, 3, &inputs),
                c: DMatrix::from_element(1, 1, arm),
                d,
            };
        }
        let a = [-stiffness * relief, stiffness * feedback, corner, -corner];
        let b = [inputs[0], inputs[1], inputs[2], 0.0, 0.0, 0.0];
        StateSpace {
            a: DMatrix::from_row_slice(2, 2, &a),
            b: DMatrix::from_row_slice(2, 3, &b),
            c: DMatrix::from_row_slice(1, 2, &[arm, 0.0]),
            d,
        }
    }
}
