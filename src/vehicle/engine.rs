//! An engine: a vectored nozzle on a gimbal, with its actuators and its flow path.

use super::{Actuator, ActuatorSet, Motor};
use nalgebra::{Matrix3x2, Vector3};
use std::sync::Arc;

/// Liner ablation of a nozzle: the loss at full burn and unit ablation factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ablation {
    /// Nominal ablation factor a, −.
    pub factor: f64,
    /// Mass lost, kg.
    pub mass_loss_kg: f64,
    /// Transverse inertia about the pivot lost, kg·m².
    pub inertia_loss_kg_m2: f64,
    /// Change of the cg distance from the pivot, m (negative: towards the pivot).
    pub cg_change_m: f64,
}

/// The moving part of an engine, rotationally symmetric about its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nozzle {
    /// Moving mass m, unablated, kg.
    pub mass_kg: f64,
    /// Distance of the cg from the pivot along the exhaust direction, m.
    pub cg_m: f64,
    /// Transverse inertia about the pivot J_G, unablated, kg·m².
    pub inertia_kg_m2: f64,
    /// Inertia about the nozzle's own axis, kg·m².
    pub axial_inertia_kg_m2: f64,
    /// Length from the pivot to the exit plane L_n, m.
    pub length_m: f64,
    /// Liner ablation, if any.
    pub ablation: Option<Ablation>,
}

impl Nozzle {
    /// The nozzle after the share `a·b` of the liner loss (ablation factor times burned propellant
    /// fraction, −); the nozzle itself where it has no ablation.
    pub fn ablated(&self, share: f64) -> Self {
        let Some(loss) = self.ablation else { return *self };
        Self {
            mass_kg: self.mass_kg - share * loss.mass_loss_kg,
            cg_m: self.cg_m + share * loss.cg_change_m,
            inertia_kg_m2: self.inertia_kg_m2 - share * loss.inertia_loss_kg_m2,
            ..*self
        }
    }

    /// Transverse inertia about the nozzle's own cg `J_c = J_G − m r²`, kg·m².
    pub fn central_inertia_kg_m2(&self) -> f64 {
        self.inertia_kg_m2 - self.mass_kg * self.cg_m * self.cg_m
    }
}

/// One engine of the vehicle.
#[derive(Debug, Clone)]
pub struct Engine {
    /// Group, the first segment of its parameter paths, for instance `booster`.
    pub group: String,
    /// Name inside the group, the second segment, for instance `left`.
    pub name: String,
    /// Unit vector u of the thrust force on the vehicle (nominally −x).
    pub thrust_direction: Vector3<f64>,
    /// Grid of the gimbal point.
    pub gimbal_grid: String,
    /// The two gimbal axes as columns, orthonormal and normal to the thrust direction.
    pub axes: Matrix3x2<f64>,
    /// Thrust and mass flow in time.
    pub motor: Arc<Motor>,
    /// The moving part.
    pub nozzle: Nozzle,
    /// Flex bearing stiffness K_e, N·m/rad.
    pub bearing_stiffness_n_m_rad: f64,
    /// Flex bearing damping D_e, N·m·s/rad.
    pub bearing_damping_n_m_s_rad: f64,
    /// Actuators, one per gimbal axis, in the order of `axes`.
    pub actuators: [Actuator; 2],
    /// Alternative actuators in their place.
    pub alternatives: Vec<ActuatorSet>,
    /// Case centreline grids from the head end to the throat; empty for an engine without a case.
    pub case_stations: Vec<String>,
    /// Whether the modes already contain this engine's mass (integrated body).
    pub in_modes: bool,
}

impl Engine {
    /// `group.name`, the instance path of the engine.
    pub fn path(&self) -> String {
        format!("{}.{}", self.group, self.name)
    }

    /// Pairs of actuators: the engine's own and the alternatives, each with the name of its set.
    pub fn sets(&self) -> impl Iterator<Item = (Option<&str>, &[Actuator; 2])> {
        let others = self.alternatives.iter().map(|set| (Some(set.name.as_str()), &set.actuators));
        std::iter::once((None, &self.actuators)).chain(others)
    }

    /// Actuator number `index`: those of the pairs of [`Engine::sets`], in order.
    pub fn actuator(&self, index: usize) -> &Actuator {
        match index / 2 {
            0 => &self.actuators[index],
            set => &self.alternatives[set - 1].actuators[index % 2],
        }
    }

    /// Number of the pair of [`Engine::sets`] that stands for the set called `name`: the engine's own
    /// where it has no such set.
    pub fn set(&self, name: Option<&str>) -> usize {
        self.sets().position(|(set, _)| set == name).unwrap_or(0)
    }
}
