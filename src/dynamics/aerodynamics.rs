//! Aerodynamics at one flight condition: normal force, pitch and roll damping of the rigid vehicle,
//! and generalised matrices supplied with it.
//!
//! Quasi-steady and linear about zero angle of attack; where its numbers come from is decided in
//! `vehicle::aerodynamics`.

use super::drawn::DrawnAerodynamics;
use super::gradient::{C, C3, Vectors, complex};
use super::{Layout, Model};
use nalgebra::Vector3;

/// Entry of a generalised aerodynamic matrix: force on coordinate `row` per unit dynamic pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Coordinate of the force.
    pub row: usize,
    /// Coordinate of the motion.
    pub column: usize,
    /// Force per displacement and dynamic pressure (m² in SI units between modes per kg).
    pub stiffness: f64,
    /// Force per rate and dynamic pressure.
    pub damping: f64,
}

/// The aerodynamics of one vehicle at one flight time, fixed for all draws.
#[derive(Debug, Clone, PartialEq)]
pub struct AerodynamicPlant {
    /// Position of the vehicle's reference (its cg), structural frame, m.
    pub reference_m: Vector3<f64>,
    /// Reference area S, m².
    pub area_m2: f64,
    /// Reference length D, m.
    pub length_m: f64,
    /// Speed V, m/s.
    pub speed_m_s: f64,
    /// Generalised matrices.
    pub entries: Vec<Entry>,
}

impl AerodynamicPlant {
    /// Axial force (drag) `q S C_A`, N, which acts along +x.
    pub fn drag_n(&self, drawn: &DrawnAerodynamics) -> f64 {
        drawn.dynamic_pressure_pa * self.area_m2 * drawn.axial_force
    }

    /// Whether the rigid motion acts by the angle of attack and its rates alone, not by a generalised matrix.
    pub fn feels_attack_alone(&self, layout: &Layout) -> bool {
        let rigid = |entry: &Entry| {
            layout.translation().contains(&entry.column)
                || layout.rotation().contains(&entry.column)
        };
        !self.entries.iter().any(rigid)
    }

    /// Adds forces and moments, scaled by `factor`, to the model.
    ///
    /// The angle of attack is that of the reference (its cg), `α_y = θ_z + ξ̇_y/V` and `α_z = −θ_y + ξ̇_z/V`;
    /// the normal force is `−q S C_Nα α` at the centre of pressure. The axial force `A = q S C_A x̂` turns with
    /// the body: `θ × A` on the translation. Moments of rates are `q S D²/(2V) C_mq θ̇` in pitch and yaw
    /// and the same with C_lp in roll (coefficients negative where they damp): C_mq is the whole
    /// derivative of the moment about the reference, the normal force of the rate at the centre of pressure
    /// included (Etkin and Reid, Dynamics of Flight, 3rd edition, 5.4).
    pub fn add(&self, drawn: &DrawnAerodynamics, factor: f64, layout: &Layout, model: &mut Model) {
        let pressure = factor * drawn.dynamic_pressure_pa;
        for entry in &self.entries {
            let at = (entry.row, entry.column);
            model.stiffness[at] -= pressure * entry.stiffness;
            model.damping[at] -= pressure * entry.damping;
            let at = [entry.row, entry.column];
            model.interface.add_full(0, at, -pressure * entry.damping);
            model.interface.add_full(1, at, -pressure * entry.stiffness);
        }
        let (translation, rotation) = (layout.translation(), layout.rotation());
        if rotation.is_empty() {
            return;
        }
        let normal = pressure * self.area_m2 * drawn.normal_force_slope_1_rad;
        let arm = drawn.center_of_pressure_x_m - self.reference_m.x;
        // Axis of the force, axis of the rotation that turns the body into it, and their sign.
        for (axis, turn, sign) in [(1, 2, 1.0), (2, 1, -1.0)] {
            let (force, angle) = (translation.start + axis, rotation.start + turn);
            // Moment of a force along `axis` at the arm about `turn` is sign · arm · force.
            for (row, lever) in [(force, 1.0), (angle, sign * arm)] {
                model.stiffness[(row, angle)] += lever * normal * sign;
                model.damping[(row, force)] += lever * normal / self.speed_m_s;
            }
        }
        let axial = Vector3::x() * (factor * self.drag_n(drawn));
        for (axis, angle) in rotation.clone().enumerate() {
            let force = axial.cross(&Vector3::ith(axis, 1.0));
            for (row, force) in translation.clone().zip(force.iter()) {
                model.stiffness[(row, angle)] += force;
            }
        }
        let damping =
            pressure * self.area_m2 * self.length_m * self.length_m / (2.0 * self.speed_m_s);
        let coefficients = [drawn.roll_damping, drawn.pitch_damping, drawn.pitch_damping];
        for (angle, coefficient) in rotation.zip(coefficients) {
            model.damping[(angle, angle)] -= damping * coefficient;
        }
    }
    /// The part of the aerodynamics in the form of [`super::gradient`], and its gradient with the mean
    /// acceleration held.
    pub fn form(
        &self,
        drawn: &DrawnAerodynamics,
        factor: f64,
        layout: &Layout,
        vectors: &Vectors<'_>,
    ) -> (C, AerodynamicGradient) {
        let (s, left, right) = (vectors.s, vectors.left, vectors.right);
        let pressure = factor * drawn.dynamic_pressure_pa;
        let mut to = AerodynamicGradient::default();
        // Everything is in proportion to the pressure.
        let mut per_pressure = C::new(0.0, 0.0);
        for entry in &self.entries {
            let product = left[entry.row] * right[entry.column];
            per_pressure -= product * (s * entry.damping + entry.stiffness);
        }
        let (translation, rotation) = (layout.translation(), layout.rotation());
        if !rotation.is_empty() {
            let arm = drawn.center_of_pressure_x_m - self.reference_m.x;
            let slope = self.area_m2 * drawn.normal_force_slope_1_rad;
            for (axis, turn, sign) in [(1, 2, 1.0), (2, 1, -1.0)] {
                let (force, angle) = (translation.start + axis, rotation.start + turn);
                let felt = left[force] + left[angle] * (sign * arm);
                let attack = right[angle] * sign + right[force] * (s / self.speed_m_s);
                let product = felt * attack;
                per_pressure += product * slope;
                to.normal_force_slope_1_rad += product * (pressure * self.area_m2);
                let by_arm = left[angle] * attack;
                to.center_of_pressure_x_m += by_arm * (pressure * slope * sign);
            }
            let part = |z: &[C], range: &std::ops::Range<usize>| {
                C3::new(z[range.start], z[range.start + 1], z[range.start + 2])
            };
            let (xi, theta) = (part(left, &translation), part(right, &rotation));
            let axial = xi.dot(&complex(&Vector3::x()).cross(&theta));
            per_pressure += axial * (self.area_m2 * drawn.axial_force);
            to.axial_force = axial * (pressure * self.area_m2);
            let damping = self.area_m2 * self.length_m * self.length_m / (2.0 * self.speed_m_s);
            let [roll, pitch, yaw] =
                [0, 1, 2].map(|axis| vectors.product(rotation.start + axis) * s * damping);
            per_pressure -= roll * drawn.roll_damping + (pitch + yaw) * drawn.pitch_damping;
            to.roll_damping = -roll * pressure;
            to.pitch_damping = -(pitch + yaw) * pressure;
        }
        to.dynamic_pressure_pa = per_pressure * factor;
        (per_pressure * pressure, to)
    }
}

/// Gradient by the numbers of the same names in [`DrawnAerodynamics`].
#[derive(Debug, Clone, Copy, Default)]
pub struct AerodynamicGradient {
    /// By the dynamic pressure.
    pub dynamic_pressure_pa: C,
    /// By the slope of the normal force coefficient.
    pub normal_force_slope_1_rad: C,
    /// By the station of the centre of pressure.
    pub center_of_pressure_x_m: C,
    /// By the axial force coefficient.
    pub axial_force: C,
    /// By the damping coefficient in pitch and yaw.
    pub pitch_damping: C,
    /// By the damping coefficient in roll.
    pub roll_damping: C,
}

impl AerodynamicGradient {
    /// Adds what pressure and axial force do through the drag, by which the gradient is `by_drag`.
    pub fn add_drag(&mut self, plant: &AerodynamicPlant, drawn: &DrawnAerodynamics, by_drag: C) {
        self.dynamic_pressure_pa += by_drag * (plant.area_m2 * drawn.axial_force);
        self.axial_force += by_drag * (drawn.dynamic_pressure_pa * plant.area_m2);
    }
}
