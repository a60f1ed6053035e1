//! The form f = yᴴ L(s) x of one drawn vehicle at two fixed vectors, and its gradient by every drawn
//! number: `dλ/dp = −(∂f/∂p)/(yᴴ L'(λ) x)` at a pole λ.
//!
//! Matrices are never differenced: each effect adds its part of the form, through the few projections of
//! the vectors that it sees, beside its assembly. What draws do to the drawn numbers is not known here.

use super::aerodynamics::AerodynamicGradient;
use super::attached::Columns;
use super::engine::EngineGradient;
use super::servo::ServoForm;
use super::slosh::TankGradient;
use super::{DrawnActuator, DrawnVehicle, Effects, Plant, rigid_body};
use nalgebra::{Complex, Vector3};

/// A complex number.
pub type C = Complex<f64>;

/// A complex vector in space.
pub type C3 = Vector3<C>;

/// A real vector as a complex one.
pub fn complex(v: &Vector3<f64>) -> C3 {
    v.map(|x| C::new(x, 0.0))
}

/// The two vectors of the form, and s.
#[derive(Debug, Clone, Copy)]
pub struct Vectors<'a> {
    /// s, rad/s.
    pub s: C,
    /// ȳ, the conjugate of the left vector.
    pub left: &'a [C],
    /// x.
    pub right: &'a [C],
}

impl Vectors<'_> {
    /// `ȳ_i x_i` at a coordinate.
    pub fn product(&self, at: usize) -> C {
        self.left[at] * self.right[at]
    }
}

/// What an attached mass adds: its part of the form, and the gradient by the mean acceleration.
#[derive(Debug, Clone, Copy)]
pub struct Attached {
    /// Part of the form.
    pub value: C,
    /// Gradient by the mean acceleration, with the mass and all else held.
    pub acceleration: C3,
}

/// The form and its gradient; every entry is ∂f/∂(the number of the same name in [`DrawnVehicle`]), the
/// mean acceleration following.
#[derive(Debug, Clone)]
pub struct Gradient {
    /// f.
    pub value: C,
    /// By the natural frequency of each mode.
    pub frequency_rad_s: Vec<C>,
    /// By the damping ratio of each mode.
    pub damping_ratio: Vec<C>,
    /// By the gains on the inertia of the body.
    pub inertia_gain: [C; 3],
    /// By the numbers of each engine.
    pub engines: Vec<EngineGradient>,
    /// By the numbers of each tank.
    pub tanks: Vec<TankGradient>,
    /// By the aerodynamics, where they act.
    pub aerodynamics: Option<AerodynamicGradient>,
    /// The part of actuators with states and of the autopilot, where they act.
    pub servo: Option<ServoForm>,
    s: C,
}

impl Gradient {
    /// The part of the form that an actuator of an engine has with the numbers of `drawn`: linear in its
    /// matrices, so that its differences are those of the actuator alone. Zero for a locked engine.
    pub fn actuator(&self, engine: usize, axis: usize, drawn: &DrawnActuator) -> C {
        let Some(products) = self.engines[engine].gimbal else { return C::new(0.0, 0.0) };
        let spring = C::from(drawn.stiffness_n_m_rad) + self.s * drawn.damping_n_m_s_rad;
        let servo = self.servo.as_ref().map(|servo| servo.actuator(engine, axis, &drawn.torque));
        products[axis] * spring + servo.unwrap_or_default()
    }
}

impl Plant {
    /// The form of `drawn` under `effects` at `vectors`, and its gradient.
    ///
    /// Of the `engines`, those for which there is false have no gradient; where they are locked on a held
    /// body, so that no other number acts through them, they are no part of the form either.
    pub fn gradient(
        &self,
        drawn: &DrawnVehicle,
        effects: &Effects,
        vectors: &Vectors<'_>,
        engines: &[bool],
    ) -> Gradient {
        let asked = engines;
        let (layout, s) = (&self.layout, vectors.s);
        let mut value = C::new(0.0, 0.0);
        let mut frequency_rad_s = Vec::with_capacity(layout.elastic().len());
        let mut damping_ratio = Vec::with_capacity(layout.elastic().len());
        for (mode, at) in layout.elastic().enumerate() {
            let (omega, zeta) = (drawn.body.frequency_rad_s[mode], drawn.body.damping_ratio[mode]);
            let product = vectors.product(at);
            value += product * (s * s + s * (2.0 * zeta * omega) + omega * omega);
            frequency_rad_s.push(product * (s * (2.0 * zeta) + 2.0 * omega));
            damping_ratio.push(product * s * (2.0 * omega));
        }
        let (rigid, inertia_gain) = rigid_body::form(&self.body, &drawn.body, layout, vectors);
        value += rigid;
        for at in layout.first_order() {
            value += s * vectors.product(at);
        }
        let acceleration = self.mean_acceleration(drawn, effects);
        let mut by_acceleration = C3::zeros();
        let mut engines = Vec::with_capacity(self.attachments.len());
        for (index, (attachment, engine)) in self.attachments.iter().zip(&drawn.engines).enumerate()
        {
            let own = layout.gimbal(index);
            let columns = Columns::new(layout, own);
            if !asked[index] && own.is_none() && columns.rigid == 0 {
                engines.push(EngineGradient::default());
                continue;
            }
            let (part, mut gradient) =
                attachment.form(engine, &columns, &acceleration, effects, vectors);
            value += part.value;
            by_acceleration += part.acceleration;
            gradient.gimbal = own.map(|first| [vectors.product(first), vectors.product(first + 1)]);
            for (product, actuator) in
                gradient.gimbal.iter().flatten().zip(&engine.actuators[attachment.actuators])
            {
                value += product * (s * actuator.damping_n_m_s_rad + actuator.stiffness_n_m_rad);
            }
            engines.push(gradient);
        }
        let mut tanks = Vec::new();
        for (index, (attachment, tank)) in self.tanks.iter().zip(&drawn.tanks).enumerate() {
            let columns = Columns::new(layout, layout.slosh(index));
            let (part, gradient) = attachment.form(tank, &columns, &acceleration, vectors);
            value += part.value;
            by_acceleration += part.acceleration;
            tanks.push(gradient);
        }
        let servo = self.servo.as_ref().filter(|servo| servo.is_active());
        let servo = servo.map(|servo| servo.form(drawn, effects.feedback, layout, vectors));
        value += servo.as_ref().map_or(C::new(0.0, 0.0), |servo| servo.value);
        let mut aerodynamics = None;
        let mass = self.total_mass_kg(drawn);
        if let (Some(plant), Some(air)) = (&self.aerodynamics, &drawn.aerodynamics) {
            let (part, mut gradient) = plant.form(air, effects.aerodynamics, layout, vectors);
            value += part;
            let by_drag = by_acceleration.x * (effects.aerodynamics / mass);
            gradient.add_drag(plant, air, by_drag);
            aerodynamics = Some(gradient);
        }
        // g0 = F/M: dF/M by thrusts (and drag, above), −g0 dM/M by attached masses.
        let by_mass = -by_acceleration.dot(&complex(&acceleration)) / mass;
        for (attachment, gradient) in self.attachments.iter().zip(&mut engines) {
            let along = by_acceleration.dot(&complex(&attachment.thrust_direction));
            gradient.thrust_n += along * (effects.thrust / mass);
            if !attachment.in_modes {
                gradient.mass_kg += by_mass;
            }
        }
        for (attachment, gradient) in self.tanks.iter().zip(&mut tanks) {
            if !attachment.in_modes {
                gradient.mass_kg += by_mass;
            }
        }
        Gradient {
            value,
            frequency_rad_s,
            damping_ratio,
            inertia_gain,
            engines,
            tanks,
            aerodynamics,
            servo,
            s,
        }
    }
}

#[cfg(test)]
mod tests;
