//! A tank whose liquid sloshes, as nominal data in flight time.
//!
//! Equations of the linear spring-mass model: Dodge (ed.), The Dynamic Behavior of Liquids in Moving
//! Containers, NASA SP-106, for the first antisymmetric mode of a flat-bottomed cylinder.

use super::motor::interpolate;
use nalgebra::Matrix3x2;

/// First zero ξ_1 of J_1′, to full precision.
pub const XI_1: f64 = 1.841_183_781_340_659_3;

/// How the slosh mass and its frequency follow from the liquid.
#[derive(Debug, Clone, PartialEq)]
pub enum Slosh {
    /// Given in flight time.
    Given {
        /// Slosh mass, kg.
        mass_kg: Vec<f64>,
        /// Slosh frequency, Hz.
        frequency_hz: Vec<f64>,
    },
    /// From the geometry of an upright flat-bottomed cylinder and its fill.
    Cylinder {
        /// Radius R, m.
        radius_m: f64,
        /// Density of the liquid, kg/m³.
        density_kg_m3: f64,
        /// Mass of the liquid in flight time, kg.
        liquid_kg: Vec<f64>,
    },
}

/// A tank.
#[derive(Debug, Clone, PartialEq)]
pub struct Tank {
    /// Name, for instance `lox`.
    pub name: String,
    /// Grid at which the slosh mass is attached.
    pub grid: String,
    /// The two lateral axes E, orthonormal and normal to the tank axis.
    pub axes: Matrix3x2<f64>,
    /// Flight times of the tables, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Mass and frequency.
    pub slosh: Slosh,
    /// Damping ratio ζ_s, −.
    pub damping_ratio: f64,
    /// Whether the modes already contain the slosh mass, locked.
    pub in_modes: bool,
}

impl Tank {
    /// Slosh mass m_1 at `time_s`, kg: given, or `m 2R tanh(ξ h/R) / (ξ h (ξ² − 1))` with
    /// `h = m/(ρ π R²)`.
    pub fn mass_kg(&self, time_s: f64) -> f64 {
        match &self.slosh {
            Slosh::Given { mass_kg, .. } => interpolate(&self.time_s, mass_kg, time_s),
            Slosh::Cylinder { radius_m, density_kg_m3, liquid_kg } => {
                let liquid = interpolate(&self.time_s, liquid_kg, time_s);
                let depth = XI_1 * fill_height_m(liquid, *radius_m, *density_kg_m3) / radius_m;
                liquid * 2.0 * depth.tanh() / (depth * (XI_1 * XI_1 - 1.0))
            }
        }
    }

    /// Slosh frequency at `time_s` under the mean acceleration g, m/s²: given, or
    /// `ω² = (g ξ/R) tanh(ξ h/R)`; rad/s.
    pub fn frequency_rad_s(&self, time_s: f64, acceleration_m_s2: f64) -> f64 {
        match &self.slosh {
            Slosh::Given { frequency_hz, .. } => {
                std::f64::consts::TAU * interpolate(&self.time_s, frequency_hz, time_s)
            }
            Slosh::Cylinder { radius_m, density_kg_m3, liquid_kg } => {
                let liquid = interpolate(&self.time_s, liquid_kg, time_s);
                let height = fill_height_m(liquid, *radius_m, *density_kg_m3);
                let depth = XI_1 * height / radius_m;
                (acceleration_m_s2 * XI_1 / radius_m * depth.tanh()).sqrt()
            }
        }
    }
}

/// Height h of a liquid in a flat-bottomed cylinder, m.
fn fill_height_m(liquid_kg: f64, radius_m: f64, density_kg_m3: f64) -> f64 {
    liquid_kg / (density_kg_m3 * std::f64::consts::PI * radius_m * radius_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cylinder(liquid_kg: f64) -> Tank {
        Tank {
            name: "lox".into(),
            grid: "tank.lox".into(),
            axes: Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, 1.0),
            time_s: vec![100.0],
            slosh: Slosh::Cylinder {
                radius_m: 4.2,
                density_kg_m3: 1141.0,
                liquid_kg: vec![liquid_kg],
            },
            damping_ratio: 0.01,
            in_modes: false,
        }
    }

    #[test]
    fn a_deep_cylinder_has_the_closed_form_of_sp_106() {
        // Verification case 9: m_1/m = 0.4545 R/h for a deep tank.
        let deep = cylinder(2e6);
        let height = 2e6 / (1141.0 * std::f64::consts::PI * 4.2 * 4.2);
        let ratio = deep.mass_kg(100.0) / 2e6;
        assert!((ratio * height / 4.2 - 0.4545).abs() < 5e-5, "{ratio}");
        let omega = deep.frequency_rad_s(100.0, 26.5);
        assert!((omega * omega * 4.2 / (26.5 * 1.8412) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_shallow_liquid_moves_whole_and_slowly() {
        // tanh x → x: m_1/m → 2/(ξ² − 1), ω² → g h ξ²/R².
        let shallow = cylinder(100.0);
        assert!((shallow.mass_kg(100.0) / 100.0 - 2.0 / (XI_1 * XI_1 - 1.0)).abs() < 1e-5);
        let height = 100.0 / (1141.0 * std::f64::consts::PI * 4.2 * 4.2);
        let omega = shallow.frequency_rad_s(100.0, 9.81);
        assert!((omega * omega * 4.2 * 4.2 / (9.81 * height * XI_1 * XI_1) - 1.0).abs() < 1e-5);
    }
}
