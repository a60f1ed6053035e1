//! What every mass attached to the body has in common: its local columns, and the acceleration
//! stiffness that the mean acceleration gives it.
//!
//! Inertia and forces of an engine or a slosh mass are added in `engine` and `slosh`.

use super::gradient::{C, C3};
use super::{Layout, Model};
use nalgebra::Vector3;
use std::ops::Range;

/// The coordinates on which an attached mass acts: those of the body, then two of its own unless
/// it is locked.
#[derive(Debug, Clone)]
pub struct Columns {
    /// Coordinates of the body, rigid and elastic.
    pub body: usize,
    /// Coordinates of the rigid rotation.
    pub rotation: Range<usize>,
    /// Rigid coordinates.
    pub rigid: usize,
    /// First own coordinate.
    own: Option<usize>,
}

impl Columns {
    /// The columns of a mass whose own coordinates start at `own`, `None` where it is locked.
    pub fn new(layout: &Layout, own: Option<usize>) -> Self {
        let rotation = layout.rotation();
        Self { body: layout.body().end, rigid: rotation.end, rotation, own }
    }

    /// Number of local columns.
    pub fn count(&self) -> usize {
        self.body + if self.own.is_some() { 2 } else { 0 }
    }

    /// Coordinate of local column `local`.
    pub fn coordinate(&self, local: usize) -> usize {
        match self.own {
            Some(first) if local >= self.body => first + local - self.body,
            _ => local,
        }
    }

    /// The rigid rotation in a vector; zero where the rigid body is held.
    pub fn rotation_of(&self, z: &[C]) -> C3 {
        let first = self.rotation.start;
        if self.rotation.is_empty() {
            return C3::zeros();
        }
        C3::new(z[first], z[first + 1], z[first + 2])
    }

    /// Adds the acceleration stiffness between the rigid rotation and every column but the rigid
    /// translation: `V = m g0 · (θ × u)` for a mass m whose displacement per unit of each local column is
    /// `displacement`, `K_bθ = −m u_bᵀ (θ̂ × g0)` and its transpose.
    ///
    /// For the rotations themselves this is `m r× g0×`: the symmetric `½ m (g0× r× + r× g0×)` of V and
    /// the moment that trims the mean state, which differ only where the cg is off the line of
    /// acceleration. So a rotated vehicle that accelerates along its rotated thrust is in
    /// equilibrium in every draw. With `in_modes` only the columns of the mass itself count.
    pub fn add_rotation_stiffness(
        &self,
        displacement: &[Vector3<f64>],
        mass_kg: f64,
        acceleration: &Vector3<f64>,
        in_modes: bool,
        model: &mut Model,
    ) {
        for (axis, rotation) in self.rotation.clone().enumerate() {
            let force = Vector3::ith(axis, -mass_kg).cross(acceleration);
            let first = if in_modes { self.body } else { self.rotation.start };
            for (local, displacement) in displacement.iter().enumerate().skip(first) {
                let value = displacement.dot(&force);
                let other = self.coordinate(local);
                model.stiffness[(other, rotation)] += value;
                if !self.rotation.contains(&other) {
                    model.stiffness[(rotation, other)] += value;
                }
            }
        }
    }
}

/// Rigid-body columns of a point at `from_reference` from the vehicle's reference: three
/// translations and three rotations, as translation and rotation of the point.
pub fn rigid_motion(from_reference: &Vector3<f64>) -> [(Vector3<f64>, Vector3<f64>); 6] {
    std::array::from_fn(|column| {
        let unit = Vector3::ith(column % 3, 1.0);
        if column < 3 { (unit, Vector3::zeros()) } else { (unit.cross(from_reference), unit) }
    })
}
