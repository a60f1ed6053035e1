//! Slosh: a spring-mass per tank and lateral axis (physics of section 3; Dodge, SP-106).
//!
//! The mass m_s moves by `ξ − r_s× θ + Φ_s η + E δ`, with E the two axes normal to the tank axis; where
//! its numbers come from is decided in `vehicle::tank`.

use super::Model;
use super::attached::Columns;
use super::drawn::DrawnTank;
use nalgebra::{Matrix3x2, Vector3};

/// How the slosh mass of one tank is attached to the body at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct TankAttachment {
    /// The two axes E normal to the tank axis, orthonormal.
    pub axes: Matrix3x2<f64>,
    /// Translation of the slosh mass, locked, per body coordinate: rigid columns where the rigid
    /// body is free, then Φ_s per mode, kg^-1/2.
    pub shape: Vec<Vector3<f64>>,
    /// Rotation of the tank per body coordinate: rigid columns, then Ψ_s, rad/m per kg^1/2.
    pub slope: Vec<Vector3<f64>>,
    /// Whether the modes already contain the slosh mass, locked.
    pub in_modes: bool,
}

impl TankAttachment {
    /// Adds one drawn slosh mass to the model: `m_s` as a congruence, `m_s ω_s²` and `2 ζ_s m_s ω_s` on δ,
    /// and with the rigid body free the acceleration stiffness, of which `K_ηδ = −m_s Ψ_sᵀ g0× E`.
    pub fn add(
        &self,
        tank: &DrawnTank,
        columns: &Columns,
        acceleration: &Vector3<f64>,
        model: &mut Model,
    ) {
        let mass = tank.mass_kg;
        let mut displacement = self.shape.clone();
        if columns.count() > columns.body {
            displacement.extend(self.axes.column_iter().map(|axis| axis.into_owned()));
        }
        for b in 0..columns.count() {
            if self.in_modes && b < columns.body {
                continue;
            }
            let momentum = displacement[b] * mass;
            for (a, displacement) in displacement[..=b].iter().enumerate() {
                let value = displacement.dot(&momentum);
                let (row, column) = (columns.coordinate(a), columns.coordinate(b));
                model.mass[(row, column)] += value;
                if row != column {
                    model.mass[(column, row)] += value;
                }
            }
        }
        for (local, displacement) in displacement.iter().enumerate().skip(columns.body) {
            let at = columns.coordinate(local);
            let omega = tank.frequency_rad_s;
            model.stiffness[(at, at)] += mass * omega * omega;
            model.damping[(at, at)] += 2.0 * tank.damping_ratio * mass * omega;
            if columns.rigid > 0 {
                let moment = acceleration.cross(displacement) * -mass;
                for mode in columns.rigid..columns.body {
                    let value = self.slope[mode].dot(&moment);
                    model.stiffness[(mode, at)] += value;
                    model.stiffness[(at, mode)] += value;
                }
            }
        }
        columns.add_rotation_stiffness(&displacement, mass, acceleration, self.in_modes, model);
    }
}
