//! An engine on the body: inertia, thrust, acceleration stiffness and jet damping of (5), (6), (13)
//! and (14).
//!
//! Actuators and the autopilot act on its gimbal rotations elsewhere.

use super::attached::Columns;
use super::drawn::DrawnEngine;
use super::{Effects, Model, NozzleJet};
use nalgebra::{Matrix3, Matrix3x2, Vector3};

/// How one engine is attached to the body at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct Attachment {
    /// Unit vector u of the thrust force on the vehicle.
    pub thrust_direction: Vector3<f64>,
    /// Gimbal axes T, orthonormal and normal to the thrust direction.
    pub axes: Matrix3x2<f64>,
    /// Translation of the gimbal per body coordinate: rigid columns where the rigid body is free
    /// (m/m and m/rad), then the nominal virtual gimbal shape Φ_g per mode, kg^-1/2.
    pub shape: Vec<Vector3<f64>>,
    /// Rotation of the gimbal per body coordinate: rigid columns, then the nominal virtual gimbal
    /// slope Ψ_g per mode, rad/m per kg^1/2.
    pub slope: Vec<Vector3<f64>>,
    /// Case jet damping per unit mass flow over the body coordinates, square, row-major (1/kg between
    /// modes); empty without a case.
    pub case_per_flow: Vec<f64>,
    /// Whether the modes already contain the engine's mass (integrated body).
    pub in_modes: bool,
    /// Number of the pair of actuators that moves it, as in `Engine::sets`.
    pub actuators: usize,
}

impl Attachment {
    /// Adds one drawn engine to the model.
    pub fn add(
        &self,
        engine: &DrawnEngine,
        columns: &Columns,
        acceleration: &Vector3<f64>,
        effects: &Effects,
        model: &mut Model,
    ) {
        let motion = Motion::new(self, engine, columns);
        motion.add_mass(self, engine, columns, model);
        motion.add_thrust(self, engine, columns, effects, model);
        motion.add_jet(self, engine, columns, effects, model);
        motion.add_acceleration_stiffness(self, engine, columns, acceleration, model);
    }
}

/// Motion of an engine per unit rate of each local column: gimbal point and rotations.
struct Motion {
    /// Translation of the gimbal point: rigid body, Φ_g, then 0.
    gimbal: Vec<Vector3<f64>>,
    /// Rotation of the nozzle: rigid body, Ψ_g, then T.
    rotation: Vec<Vector3<f64>>,
}

impl Motion {
    fn new(attachment: &Attachment, engine: &DrawnEngine, columns: &Columns) -> Self {
        let mut gimbal = attachment.shape.clone();
        let mut rotation = attachment.slope.clone();
        gimbal.resize(columns.count(), Vector3::zeros());
        let modes = columns.rigid..columns.body;
        for (mode, local) in modes.enumerate() {
            gimbal[local] *= engine.shape_gain[mode];
            rotation[local] *= engine.slope_gain[mode];
        }
        if columns.count() > columns.body {
            rotation.extend(attachment.axes.column_iter().map(|axis| axis.into_owned()));
        }
        Self { gimbal, rotation }
    }

    /// Mass as a congruence `Bᵀ blkdiag(m 1₃, J_c) B` with `u_c = ξ − (r_g + r_e)× θ + Φ_g η −
    /// r_e× (Ψ_g η + T Θ)` and `ρ_c = θ + Ψ_g η + T Θ`. For an integrated body only the blocks with a
    /// Θ index.
    fn add_mass(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        model: &mut Model,
    ) {
        let axis = -attachment.thrust_direction;
        let cg = axis * engine.cg_m;
        let inertia = engine.central_inertia_tensor(&axis);
        for b in 0..columns.count() {
            let momentum = (self.gimbal[b] + self.rotation[b].cross(&cg)) * engine.mass_kg;
            let angular = inertia * self.rotation[b];
            // Moment of momentum about the gimbal, so that each row needs its gimbal motion only.
            let angular = angular + cg.cross(&momentum);
            for a in 0..=b {
                if attachment.in_modes && b < columns.body {
                    continue;
                }
                let value = self.gimbal[a].dot(&momentum) + self.rotation[a].dot(&angular);
                let (row, column) = (columns.coordinate(a), columns.coordinate(b));
                model.mass[(row, column)] += value;
                if row != column {
                    model.mass[(column, row)] += value;
                }
            }
        }
    }

    /// Thrust on the body: `−R u× T Θ` at the displaced gimbal, with follower thrust `−R u× Ψ_g η`
    /// besides. Of the rigid body: `−R u× θ` on the translation, `−R u× Φ_g η` as a moment, and none
    /// from θ on the rotation, since gimbal and thrust turn together.
    fn add_thrust(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        effects: &Effects,
        model: &mut Model,
    ) {
        let thrust = attachment.thrust_direction * (effects.thrust * engine.thrust_n);
        let first = if effects.follower_thrust { columns.rigid } else { columns.body };
        for local in first..columns.count() {
            let force = thrust.cross(&self.rotation[local]);
            for body in 0..columns.body {
                model.stiffness[(body, columns.coordinate(local))] += self.gimbal[body].dot(&force);
            }
        }
        for (axis, rotation) in columns.rotation.clone().enumerate() {
            let force = thrust.cross(&Vector3::ith(axis, 1.0));
            for translation in 0..3 {
                model.stiffness[(translation, rotation)] += force[translation];
            }
            for mode in columns.rigid..columns.body {
                model.stiffness[(rotation, mode)] += thrust.cross(&self.gimbal[mode])[axis];
            }
        }
    }

    /// Jet damping of the case (14) and of the nozzle: (13), or exactly
    /// `∫ 2ṁ (Φ_g − x î× ρ)ᵀ î× ρ̇ dx` over the nozzle with ρ its rotation.
    fn add_jet(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        effects: &Effects,
        model: &mut Model,
    ) {
        let flow = effects.thrust * engine.mass_flow_kg_s;
        let body = columns.body;
        if effects.case_jet_damping && !attachment.case_per_flow.is_empty() {
            for (row, entries) in attachment.case_per_flow.chunks_exact(body).enumerate() {
                for (column, entry) in entries.iter().enumerate() {
                    model.damping[(row, column)] -= flow * entry;
                }
            }
        }
        if effects.nozzle_jet_damping == NozzleJet::Off {
            return;
        }
        let exhaust = -attachment.thrust_direction;
        let length = engine.length_m;
        let normal = Matrix3::identity() - exhaust * exhaust.transpose();
        for b in 0..columns.count() {
            let force = exhaust.cross(&self.rotation[b]) * (2.0 * flow * length);
            let column = columns.coordinate(b);
            for row in 0..body {
                model.damping[(row, column)] -= self.gimbal[row].dot(&force);
            }
            if effects.nozzle_jet_damping == NozzleJet::RigidNozzle {
                let moment = normal * self.rotation[b] * (flow * length * length);
                for a in 0..columns.count() {
                    model.damping[(columns.coordinate(a), column)] += self.rotation[a].dot(&moment);
                }
            }
        }
    }

    /// Stiffness of `V = m g0 · (second-order displacement of the cg)`: `Tᵀ m g0× r_e× T` on the gimbal
    /// rotations, and with the rigid body free `K_ηΘ = m Ψ_gᵀ g0× r_e× T` and the terms of θ.
    fn add_acceleration_stiffness(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        acceleration: &Vector3<f64>,
        model: &mut Model,
    ) {
        let cg = -attachment.thrust_direction * engine.cg_m;
        for local in columns.body..columns.count() {
            // Tᵀ (m g0× r_e×) T = −m (g0 · r_e) 1, since T is normal to r_e.
            let at = columns.coordinate(local);
            model.stiffness[(at, at)] += -engine.mass_kg * acceleration.dot(&cg);
        }
        if columns.rigid == 0 {
            return;
        }
        for local in columns.body..columns.count() {
            let moment = acceleration.cross(&cg.cross(&self.rotation[local])) * engine.mass_kg;
            let column = columns.coordinate(local);
            for mode in columns.rigid..columns.body {
                let value = self.rotation[mode].dot(&moment);
                model.stiffness[(mode, column)] += value;
                model.stiffness[(column, mode)] += value;
            }
        }
        let displacement: Vec<Vector3<f64>> = (self.gimbal.iter().zip(&self.rotation))
            .map(|(gimbal, rotation)| gimbal + rotation.cross(&cg))
            .collect();
        columns.add_rotation_stiffness(
            &displacement,
            engine.mass_kg,
            acceleration,
            attachment.in_modes,
            model,
        );
    }
}
