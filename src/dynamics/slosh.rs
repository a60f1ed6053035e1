//! Slosh: a spring-mass per tank and lateral axis (physics of section 3; Dodge, SP-106).
//!
//! The mass m_s moves by `ξ − r_s× θ + Φ_s η + E δ`, with E the two axes normal to the tank axis; where
//! its numbers come from is decided in `vehicle::tank`.

use super::Model;
use super::attached::Columns;
use super::drawn::DrawnTank;
use super::gradient::{Attached, C, C3, Vectors, complex};
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
        model.interface.add_motion(&displacement[columns.rigid..columns.body]);
        if columns.rigid > 0 {
            model.interface.add_motion(&self.slope[columns.rigid..columns.body]);
        }
    }

    /// The part of the slosh mass in the form of [`super::gradient`], and its gradient with the mean
    /// acceleration held.
    pub fn form(
        &self,
        tank: &DrawnTank,
        columns: &Columns,
        acceleration: &Vector3<f64>,
        vectors: &Vectors<'_>,
    ) -> (Attached, TankGradient) {
        let (s, mass, omega) = (vectors.s, tank.mass_kg, tank.frequency_rad_s);
        let zeta = tank.damping_ratio;
        let [left, right] = [vectors.left, vectors.right].map(|z| self.see(columns, z));
        let mut inertia = left.all().dot(&right.all());
        if self.in_modes {
            inertia -= left.body().dot(&right.body());
        }
        let spring = s * (2.0 * zeta * omega) + omega * omega;
        let own: C =
            (columns.body..columns.count()).map(|k| vectors.product(columns.coordinate(k))).sum();
        // Per unit mass, by the acceleration.
        let mut by_acceleration = C3::zeros();
        if columns.rigid > 0 {
            by_acceleration -= right.own.cross(&left.slope) + left.own.cross(&right.slope);
            let felt = |side: &Side, turning: bool| {
                let turned = if turning { side.turned } else { C3::zeros() };
                if self.in_modes { side.own } else { side.own + side.elastic + turned }
            };
            by_acceleration -= felt(&left, true).cross(&right.rotation)
                + felt(&right, false).cross(&left.rotation);
        }
        let per_mass = s * s * inertia + own * spring + by_acceleration.dot(&complex(acceleration));
        let gradient = TankGradient {
            mass_kg: per_mass,
            frequency_rad_s: own * mass * (s * (2.0 * zeta) + 2.0 * omega),
            damping_ratio: own * s * (2.0 * mass * omega),
        };
        let mass = C::from(mass);
        (Attached { value: per_mass * mass, acceleration: by_acceleration * mass }, gradient)
    }

    /// What the slosh mass sees of a vector.
    fn see(&self, columns: &Columns, z: &[C]) -> Side {
        let sum = |of: &[Vector3<f64>], locals: std::ops::Range<usize>| {
            locals.map(|local| complex(&of[local]) * z[local]).sum::<C3>()
        };
        let (turning, rigid, body) = (columns.rotation.clone(), columns.rigid, columns.body);
        let own = (body..columns.count()).zip(self.axes.column_iter());
        Side {
            moved: sum(&self.shape, 0..turning.start),
            turned: sum(&self.shape, turning.clone()),
            elastic: sum(&self.shape, rigid..body),
            slope: sum(&self.slope, rigid..body),
            own: own.map(|(k, axis)| complex(&axis.into_owned()) * z[columns.coordinate(k)]).sum(),
            rotation: columns.rotation_of(z),
        }
    }
}

/// Displacement of the slosh mass in a vector, by what moves it.
struct Side {
    /// Rigid translation.
    moved: C3,
    /// Rigid rotation.
    turned: C3,
    /// Modes.
    elastic: C3,
    /// The rotation of the tank by the modes.
    slope: C3,
    /// Its own motion in the tank.
    own: C3,
    /// The rigid rotation itself.
    rotation: C3,
}

impl Side {
    fn body(&self) -> C3 {
        self.moved + self.turned + self.elastic
    }

    fn all(&self) -> C3 {
        self.body() + self.own
    }
}

/// Gradient by the numbers of the same names in [`DrawnTank`].
#[derive(Debug, Clone, Copy, Default)]
pub struct TankGradient {
    /// By the slosh mass.
    pub mass_kg: C,
    /// By the slosh frequency.
    pub frequency_rad_s: C,
    /// By the slosh damping ratio.
    pub damping_ratio: C,
}
