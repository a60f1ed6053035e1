//! Assembly of the equations of motion (5) and (6) with jet damping (13) and (14).
//!
//! One `Plant` a flight time holds what no draw changes; `assemble` adds up one drawn vehicle.
//! Poles and vectors are found in `modal`.

use super::aerodynamics::AerodynamicPlant;
use super::attached::Columns;
use super::drawn::DrawnVehicle;
use super::engine::Attachment;
use super::rigid_body::{self, Flow, Steady};
use super::slosh::TankAttachment;
use super::{Layout, Model, Servo, interface};
use crate::vehicle::MassProperties;
use nalgebra::Vector3;

/// How the nozzle flow enters as jet damping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NozzleJet {
    /// No nozzle jet damping.
    Off,
    /// Equation (13): the part linear in the nozzle length.
    Linear,
    /// Exact for a rigid nozzle with straight flow; also damps the nozzle's own rotation.
    RigidNozzle,
}

/// Which effects act, beside structure, inertia and actuators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    /// Factor on thrust, mean acceleration and mass flow, − (1 in flight, 0 with thrust off;
    /// values between serve the continuation of poles).
    pub thrust: f64,
    /// Case jet damping (14).
    pub case_jet_damping: bool,
    /// Nozzle jet damping.
    pub nozzle_jet_damping: NozzleJet,
    /// Thrust that follows elastic rotation, `−Φ_gᵀ R u× Ψ_g η`.
    pub follower_thrust: bool,
    /// Factor on aerodynamic forces, −.
    pub aerodynamics: f64,
    /// Factor on the feedback of the autopilot, where it acts, −.
    pub feedback: f64,
}

impl Effects {
    /// The effects with `factor` on everything that drives the structure from outside: thrust, flow,
    /// air and autopilot.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            thrust: factor * self.thrust,
            aerodynamics: factor * self.aerodynamics,
            feedback: factor * self.feedback,
            ..self
        }
    }
}

/// What no draw changes, at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Coordinates.
    pub layout: Layout,
    /// Mass properties of the body whose modes these are.
    pub body: MassProperties,
    /// One attachment per engine of the vehicle.
    pub attachments: Vec<Attachment>,
    /// One attachment per tank of the vehicle.
    pub tanks: Vec<TankAttachment>,
    /// Aerodynamics, if any.
    pub aerodynamics: Option<AerodynamicPlant>,
    /// Actuators and autopilot; `None` holds every gimbal by its springs alone, without commands.
    pub servo: Option<Servo>,
}

impl Plant {
    /// Mean acceleration `g0 = Σ R u / M_total` over all engines, less drag where aerodynamics is on,
    /// m/s².
    pub fn mean_acceleration(&self, drawn: &DrawnVehicle, effects: &Effects) -> Vector3<f64> {
        let mut force = Vector3::zeros();
        for (attachment, engine) in self.attachments.iter().zip(&drawn.engines) {
            force += attachment.thrust_direction * (effects.thrust * engine.thrust_n);
        }
        if let (Some(plant), Some(air)) = (&self.aerodynamics, &drawn.aerodynamics) {
            force.x += effects.aerodynamics * plant.drag_n(air);
        }
        force / self.total_mass_kg(drawn)
    }

    /// Mass of the body and all that is attached to it, kg.
    pub(super) fn total_mass_kg(&self, drawn: &DrawnVehicle) -> f64 {
        let mut mass = self.body.mass_kg;
        for (attachment, engine) in self.attachments.iter().zip(&drawn.engines) {
            if !attachment.in_modes {
                mass += engine.mass_kg;
            }
        }
        for (attachment, tank) in self.tanks.iter().zip(&drawn.tanks) {
            if !attachment.in_modes {
                mass += tank.mass_kg;
            }
        }
        mass
    }

    /// The directions of the flows that damp under `effects`: a case's along x, a nozzle's its own.
    fn flow(&self, drawn: &DrawnVehicle, effects: &Effects) -> Flow {
        let mut flow = Flow::None;
        for (attachment, engine) in self.attachments.iter().zip(&drawn.engines) {
            if effects.thrust * engine.mass_flow_kg_s == 0.0 {
                continue;
            }
            if effects.case_jet_damping && !attachment.case_per_flow.is_empty() {
                flow = flow.with(Vector3::x());
            }
            if effects.nozzle_jet_damping != NozzleJet::Off {
                flow = flow.with(attachment.thrust_direction);
            }
        }
        flow
    }

    /// Builds the model of `drawn` under `effects` into `model`, which has the layout's size.
    pub fn assemble(&self, drawn: &DrawnVehicle, effects: &Effects, model: &mut Model) {
        let layout = &self.layout;
        model.clear(layout.second_order());
        rigid_body::add(&self.body, &drawn.body, layout, model);
        let acceleration = self.mean_acceleration(drawn, effects);
        for (index, (attachment, engine)) in self.attachments.iter().zip(&drawn.engines).enumerate()
        {
            let own = layout.gimbal(index);
            let columns = Columns::new(layout, own);
            attachment.add(engine, &columns, &acceleration, effects, model);
            let actuators = &engine.actuators[attachment.actuators];
            for (at, actuator) in
                own.into_iter().flat_map(|first| [first, first + 1]).zip(actuators)
            {
                model.stiffness[(at, at)] += actuator.stiffness_n_m_rad;
                model.damping[(at, at)] += actuator.damping_n_m_s_rad;
            }
        }
        for (index, (attachment, tank)) in self.tanks.iter().zip(&drawn.tanks).enumerate() {
            let columns = Columns::new(layout, layout.slosh(index));
            attachment.add(tank, &columns, &acceleration, model);
        }
        let still = rigid_body::attitude_columns(layout, model);
        if let Some(servo) = self.servo.as_ref().filter(|servo| servo.is_active()) {
            servo.attach(&servo.compose(drawn), drawn, effects.feedback, layout, model);
        }
        let sensed = rigid_body::sensed(layout, &still, model);
        let modes = drawn.body.frequency_rad_s.iter().zip(&drawn.body.damping_ratio);
        let own = modes.map(|(omega, zeta)| [1.0, 2.0 * zeta * omega, omega * omega]);
        interface::add_own(layout, own, model);
        if effects.case_jet_damping {
            for (attachment, engine) in self.attachments.iter().zip(&drawn.engines) {
                attachment.add_case(effects.thrust * engine.mass_flow_kg_s, layout, model);
            }
        }
        let mut speed_m_s = None;
        if let (Some(plant), Some(air)) = (&self.aerodynamics, &drawn.aerodynamics) {
            plant.add(air, effects.aerodynamics, layout, model);
            speed_m_s = plant.feels_attack_alone(layout).then_some(plant.speed_m_s);
        }
        let flow = self.flow(drawn, effects);
        let steady = Steady { before: &still, sensed: &sensed, flow, acceleration, speed_m_s };
        rigid_body::find_null_states(layout, &steady, model);
    }
}

#[cfg(test)]
mod tests;
