//! Response of a nozzle on its actuator to an external load torque: static compliance, TVC
//! resonance and the second-order model equivalent there.
//!
//! It works on any dynamic stiffness; actuator models come from elsewhere.

use crate::vehicle::{Actuator, Bearing, Engine, StateSpace};
use nalgebra::Complex;

/// A nozzle on one of its actuators and the flex bearing, in the plane of one gimbal axis.
#[derive(Debug, Clone, PartialEq)]
pub struct NozzleOnActuator {
    inertia_kg_m2: f64,
    bearing_stiffness_n_m_rad: f64,
    bearing_damping_n_m_s_rad: f64,
    torque: StateSpace,
}

impl NozzleOnActuator {
    /// A nozzle of inertia `inertia_kg_m2` about its pivot on `actuator`, with the bearing of `engine`.
    pub fn new(engine: &Engine, actuator: &Actuator, inertia_kg_m2: f64) -> Self {
        let [bearing_stiffness_n_m_rad, bearing_damping_n_m_s_rad] = match actuator.bearing {
            Bearing::Included => [0.0; 2],
            Bearing::Separate => {
                [engine.bearing_stiffness_n_m_rad, engine.bearing_damping_n_m_s_rad]
            }
        };
        Self {
            inertia_kg_m2,
            bearing_stiffness_n_m_rad,
            bearing_damping_n_m_s_rad,
            torque: actuator.law.state_space(),
        }
    }

    /// Torque per command, N·m/rad, and dynamic stiffness τ/Θ of nozzle, bearing and actuator, N·m/rad, at
    /// the complex frequency s, rad/s; the latter is infinite at a pole of the actuator.
    fn at(&self, s: Complex<f64>) -> [Complex<f64>; 2] {
        let Some(torque) = self.torque.response(s) else {
            return [Complex::from(f64::INFINITY); 2];
        };
        let held = s * s * self.inertia_kg_m2
            + s * self.bearing_damping_n_m_s_rad
            + self.bearing_stiffness_n_m_rad;
        [torque[(0, 0)], held - torque[(0, 1)] - torque[(0, 2)] * s]
    }

    /// Response to a load torque, the command held.
    pub fn load_response(&self) -> LoadResponse {
        LoadResponse::of(self.inertia_kg_m2, |s| self.at(s)[1])
    }

    /// Compliance Θ/τ to a load torque, rad/(N·m), and response Θ/δ_c to a command at the frequency
    /// `omega_rad_s`.
    pub fn response(&self, omega_rad_s: f64) -> [Complex<f64>; 2] {
        let [drive, stiffness] = self.at(Complex::new(0.0, omega_rad_s));
        [1.0 / stiffness, drive / stiffness]
    }
}

/// What a nozzle on its actuator does under an external load torque, the command held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadResponse {
    /// Static compliance Θ/τ, rad/(N·m).
    pub static_compliance_rad_n_m: f64,
    /// TVC resonance; `None` where Θ never lags by 90° below [`HIGHEST_RAD_S`].
    pub resonance: Option<Resonance>,
}

/// The TVC resonance and the model `J (s² + 2ζω s + ω²) Θ = τ` equivalent there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Frequency ω at which Θ lags the load torque by 90°, rad/s.
    pub omega_rad_s: f64,
    /// Equivalent damping ratio ζ, −.
    pub damping_ratio: f64,
    /// Equivalent stiffness J ω², N·m/rad.
    pub stiffness_n_m_rad: f64,
    /// Equivalent damping 2 ζ J ω, N·m·s/rad.
    pub damping_n_m_s_rad: f64,
}

/// Lowest frequency searched for the resonance, rad/s.
const LOWEST_RAD_S: f64 = 1e-3;
/// Highest frequency searched for the resonance, rad/s.
pub const HIGHEST_RAD_S: f64 = 1e5;
/// Steps a decade: neighbouring frequencies differ by 0.6 %, less than the width of a resonance
/// of ζ = 0.003.
const STEPS_PER_DECADE: i32 = 400;

impl LoadResponse {
    /// Response of a nozzle of inertia `inertia_kg_m2` about its pivot whose dynamic stiffness
    /// τ/Θ at the complex frequency s, rad/s, is `stiffness`, inertia included: for a second-order
    /// actuator `J s² + C s + K`. The inverse of Θ/τ is taken because it is finite in an
    /// undamped resonance.
    ///
    /// Θ = τ/Z lags by 90° where Re Z(jω) passes from positive to negative; there `Z = jω C`.
    pub fn of(inertia_kg_m2: f64, stiffness: impl Fn(Complex<f64>) -> Complex<f64>) -> Self {
        let at = |omega: f64| stiffness(Complex::new(0.0, omega));
        let decades = (HIGHEST_RAD_S / LOWEST_RAD_S).log10();
        let steps = (decades * f64::from(STEPS_PER_DECADE)).ceil() as i32;
        let omega_of =
            |step: i32| LOWEST_RAD_S * 10_f64.powf(f64::from(step) / f64::from(STEPS_PER_DECADE));
        let bracket = (0..steps)
            .map(|step| [omega_of(step), omega_of(step + 1)])
            .find(|[low, high]| at(*low).re > 0.0 && at(*high).re <= 0.0);
        let resonance = bracket.map(|[mut low, mut high]| {
            // Halve until no number lies between.
            loop {
                let middle = 0.5 * (low + high);
                if !(low < middle && middle < high) {
                    break;
                }
                if at(middle).re > 0.0 { low = middle } else { high = middle }
            }
            let damping = at(high).im / high;
            Resonance {
                omega_rad_s: high,
                damping_ratio: damping / (2.0 * inertia_kg_m2 * high),
                stiffness_n_m_rad: inertia_kg_m2 * high * high,
                damping_n_m_s_rad: damping,
            }
        });
        Self { static_compliance_rad_n_m: 1.0 / at(0.0).re, resonance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_second_order_actuator_is_its_own_equivalent() {
        let (j, k, c) = (2.15e4, 3.76e7, 5.7e5);
        let response = LoadResponse::of(j, |s| s * s * j + s * c + k);
        let resonance = response.resonance.unwrap();
        assert!((response.static_compliance_rad_n_m * k - 1.0).abs() < 1e-15);
        assert!((resonance.omega_rad_s / (k / j).sqrt() - 1.0).abs() < 1e-15);
        assert!((resonance.stiffness_n_m_rad / k - 1.0).abs() < 1e-14);
        assert!((resonance.damping_n_m_s_rad / c - 1.0).abs() < 1e-14);
        assert!((resonance.damping_ratio * 2.0 * (k * j).sqrt() / c - 1.0).abs() < 1e-14);
    }

    /// Hydraulic actuator with a massless piston and load-pressure feedback (verification 8):
    /// `Z = J s² + K_b + r_a² K_L (s + K_v)/(s + a)`.
    fn hydraulic(a: f64) -> LoadResponse {
        let (j, arm, k_h, k_s, k_v, k_b) = (2.4e4, 1.79, 2.4e8, 1e8, 20.0, 2e6);
        let k_l = 1.0 / (1.0 / k_h + 1.0 / k_s);
        LoadResponse::of(j, |s| s * s * j + k_b + (s + k_v) / (s + a) * (arm * arm * k_l))
    }

    #[test]
    fn the_hydraulic_actuator_has_the_stated_resonance_and_equivalent_damping() {
        for (a, hertz, zeta) in [(80.0, 12.1200, 0.304_32), (160.0, 6.7602, 0.566_72)] {
            let resonance = hydraulic(a).resonance.unwrap();
            assert!((resonance.omega_rad_s / TAU - hertz).abs() < 5.1e-5);
            assert!((resonance.damping_ratio - zeta).abs() < 5.1e-6);
        }
    }

    #[test]
    fn a_hydraulic_actuator_without_net_lag_is_undamped() {
        let resonance = hydraulic(20.0).resonance.unwrap();
        // √((K_b + r_a² K_L)/J)/2π = 15.518347 Hz, one off in the last digit stated.
        assert!((resonance.omega_rad_s / TAU - 15.518_347).abs() < 5.1e-7);
        assert!(resonance.damping_ratio.abs() < 1e-12);
    }

    #[test]
    fn a_nozzle_without_inertia_has_no_resonance() {
        assert_eq!(LoadResponse::of(1.0, |s| s * 10.0 + 5.0).resonance, None);
        assert_eq!(LoadResponse::of(1.0, |_| Complex::new(f64::NAN, 0.0)).resonance, None);
    }
}
