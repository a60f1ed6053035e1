//! The way back of a draw: from the gradient by drawn numbers to that by the effects on parameters.
//!
//! It mirrors `draw` step by step; gradients by the draws themselves follow in `dispersion`.

use super::super::draw_servo::{self, Target};
use super::Slots;
use crate::dispersion::{Affine, AffineGradient, Parameters, Place, Quantity};
use crate::dynamics::gradient::C;
use crate::dynamics::{DrawnPath, DrawnVehicle, Gradient, Plant};
use crate::vehicle::motor::interpolate;
use crate::vehicle::{STANDARD_GRAVITY_M_S2, Vehicle};
use std::f64::consts::TAU;

/// Step of a central difference of the matrices of one actuator, filter or delay, relative: the third
/// root of the rounding, where truncation and cancellation are equal.
const STEP: f64 = 6.055_454_452_393_343e-6;

/// `(f(v + h) − f(v − h))/2h`.
fn slope(value: f64, of: impl Fn(f64) -> C) -> C {
    let step = if value == 0.0 { STEP } else { STEP * value.abs() };
    let (above, below) = (value + step, value - step);
    (of(above) - of(below)) / (above - below)
}

/// What a way back starts from.
pub struct Back<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// Its parameters.
    pub parameters: &'a Parameters,
    /// Effect on each parameter, of which `drawn` is made.
    pub effects: &'a [Affine],
    /// Per parameter, whether a draw acts on it; the others are left out.
    pub acts: &'a [bool],
    /// Per engine, whether a draw acts on one of its parameters; the others are left out.
    pub engines: &'a [bool],
    /// The plant.
    pub plant: &'a Plant,
    /// The drawn vehicle.
    pub drawn: &'a DrawnVehicle,
    /// Gradient by its numbers.
    pub gradient: &'a Gradient,
}

impl Back<'_> {
    /// The drawn value of a parameter and what follows from the gradient `by` it.
    fn give(&self, to: &mut [AffineGradient], index: usize, nominal: f64, by: C) -> C {
        to[index].scale += by * nominal;
        to[index].offset += by;
        // By the nominal value itself, where that is drawn too.
        by * self.effects[index].scale
    }

    fn acts(&self, quantity: Quantity, place: Place) -> bool {
        self.acts[self.parameters.index(quantity, place)]
    }
}

impl Slots {
    /// Gradient by the effect on every parameter of the vehicle; those on which nothing acts stay zero
    /// where they cost anything.
    pub fn pull(&self, back: &Back<'_>) -> Vec<AffineGradient> {
        let Back { vehicle, parameters, effects, gradient, plant, drawn, .. } = *back;
        let mut found = vec![AffineGradient::default(); parameters.count()];
        let to = &mut found[..];
        let time_s = self.flight_time_s;

        let common = effects[self.structural_damping].apply(vehicle.structural_damping);
        let mut by_common = C::ZERO;
        for (index, mode) in self.modes.iter().enumerate() {
            let by_hz = gradient.frequency_rad_s[index] * TAU;
            back.give(to, mode.frequency, mode.nominal_rad_s / TAU, by_hz);
            by_common += back.give(to, mode.damping, common, gradient.damping_ratio[index]);
        }
        back.give(to, self.structural_damping, vehicle.structural_damping, by_common);

        let whole = |quantity| parameters.index(quantity, Place::Vehicle);
        let inertia = [Quantity::RollInertia, Quantity::PitchInertia, Quantity::YawInertia];
        for (quantity, by) in inertia.into_iter().zip(gradient.inertia_gain) {
            back.give(to, whole(quantity), 1.0, by);
        }
        for (index, (tank, by)) in vehicle.tanks.iter().zip(&gradient.tanks).enumerate() {
            let omega = tank.frequency_rad_s(time_s, self.acceleration_m_s2);
            for (quantity, nominal, by) in [
                (Quantity::SloshMass, tank.mass_kg(time_s), by.mass_kg),
                (Quantity::SloshFrequency, omega / TAU, by.frequency_rad_s * TAU),
                (Quantity::SloshDamping, tank.damping_ratio, by.damping_ratio),
            ] {
                back.give(to, parameters.index(quantity, Place::Tank(index)), nominal, by);
            }
        }
        if let (Some(air), Some(by)) = (&vehicle.aerodynamics, &gradient.aerodynamics) {
            for (quantity, table, by) in [
                (Quantity::DynamicPressure, &air.dynamic_pressure_pa, by.dynamic_pressure_pa),
                (
                    Quantity::NormalForceSlope,
                    &air.normal_force_slope_1_rad,
                    by.normal_force_slope_1_rad,
                ),
                (
                    Quantity::CenterOfPressure,
                    &air.center_of_pressure_x_m,
                    by.center_of_pressure_x_m,
                ),
                (Quantity::AxialForce, &air.axial_force, by.axial_force),
                (Quantity::PitchDamping, &air.pitch_damping, by.pitch_damping),
                (Quantity::RollDamping, &air.roll_damping, by.roll_damping),
            ] {
                back.give(to, whole(quantity), interpolate(&air.time_s, table, time_s), by);
            }
        }
        for slots in self.engines.iter().filter(|slots| back.engines[slots.engine]) {
            self.pull_engine(back, slots.engine, to);
            let by = &gradient.engines[slots.engine];
            for (mode, [shape, slope]) in slots.gains.iter().enumerate() {
                back.give(to, *shape, 1.0, by.shape_gain[mode]);
                back.give(to, *slope, 1.0, by.slope_gain[mode]);
            }
        }
        if let (Some(_), Some(form), Some(servo)) =
            (&vehicle.autopilot, &gradient.servo, &plant.servo)
        {
            let part = |path: usize, draw: &DrawnPath| servo.path_part(form, path, draw);
            self.pull_autopilot(back, to, &part, &|delay_s| servo.delay_part(form, delay_s));
            for (sensor, gains) in self.sensors.iter().enumerate() {
                let nominal = vehicle.autopilot.as_ref().map_or(1.0, |a| a.sensors[sensor].scale);
                let index = parameters.index(Quantity::SensorScale, Place::Sensor(sensor));
                back.give(to, index, nominal, form.scale[sensor]);
                for (index, by) in gains.iter().zip(&form.slope_gain[sensor]) {
                    back.give(to, *index, 1.0, *by);
                }
            }
        }
        debug_assert_eq!(drawn.body.frequency_rad_s.len(), self.modes.len());
        found
    }

    fn pull_engine(&self, back: &Back<'_>, index: usize, to: &mut [AffineGradient]) {
        let Back { vehicle, parameters, effects, gradient, plant, drawn, .. } = *back;
        let (engine, by) = (&vehicle.engines[index], &gradient.engines[index]);
        let slot = |quantity| parameters.index(quantity, Place::Engine(index));
        let value = |quantity, nominal: f64| effects[slot(quantity)].apply(nominal);

        // Mass flow R/(Isp g) times profile, and what acts on it directly.
        let motor = &engine.motor;
        let thrust = drawn.engines[index].thrust_n;
        let impulse = value(Quantity::SpecificImpulse, motor.specific_impulse_s);
        let nominal_profile = motor.flow_profile_at(self.flight_time_s);
        let profile = value(Quantity::FlowProfile, nominal_profile);
        let per_profile = thrust / (impulse * STANDARD_GRAVITY_M_S2);
        let flow = per_profile * profile;
        let by_flow = back.give(to, slot(Quantity::MassFlow), flow, by.mass_flow_kg_s);
        let per_thrust = profile / (impulse * STANDARD_GRAVITY_M_S2);
        let by_thrust = by.thrust_n + by_flow * per_thrust;
        let nominal_thrust = motor.thrust_at(self.flight_time_s);
        back.give(to, slot(Quantity::Thrust), nominal_thrust, by_thrust);
        let by_impulse = by_flow * (-flow / impulse);
        back.give(to, slot(Quantity::SpecificImpulse), motor.specific_impulse_s, by_impulse);
        back.give(to, slot(Quantity::FlowProfile), nominal_profile, by_flow * per_profile);

        let nozzle = &engine.nozzle;
        for (quantity, nominal, by) in [
            (Quantity::NozzleMass, nozzle.mass_kg, by.mass_kg),
            (Quantity::NozzleCg, nozzle.cg_m, by.cg_m),
            (Quantity::NozzleInertia, nozzle.inertia_kg_m2, by.inertia_kg_m2),
            (Quantity::NozzleAxialInertia, nozzle.axial_inertia_kg_m2, by.axial_inertia_kg_m2),
            (Quantity::NozzleLength, nozzle.length_m, by.length_m),
        ] {
            back.give(to, slot(quantity), nominal, by);
        }
        if let Some(loss) = &nozzle.ablation {
            let by_share = by.cg_m * loss.cg_change_m
                - by.mass_kg * loss.mass_loss_kg
                - by.inertia_kg_m2 * loss.inertia_loss_kg_m2;
            let burned = motor.burned_fraction_at(self.flight_time_s);
            back.give(to, slot(Quantity::NozzleAblation), loss.factor, by_share * burned);
        }

        // Actuators: the pair that the plant has, of a gimballed engine.
        if by.gimbal.is_none() {
            return;
        }
        let set = plant.attachments[index].actuators;
        let bearing = [
            (Quantity::BearingStiffness, engine.bearing_stiffness_n_m_rad),
            (Quantity::BearingDamping, engine.bearing_damping_n_m_s_rad),
        ];
        let drawn_bearing = bearing.map(|(quantity, nominal)| value(quantity, nominal));
        for axis in 0..2 {
            let number = 2 * set + axis;
            let nominal = engine.actuator(number);
            let place = Place::Actuator(index, number);
            let own =
                |quantity, nominal: f64| effects[parameters.index(quantity, place)].apply(nominal);
            // The actuator with one of its numbers, or of the bearing, changed.
            let part = |changed: Quantity, changed_to: f64| {
                let of = |quantity, nominal| {
                    Ok(if quantity == changed { changed_to } else { own(quantity, nominal) })
                };
                let mut bearing_now = drawn_bearing;
                for ((quantity, _), value) in bearing.iter().zip(&mut bearing_now) {
                    if *quantity == changed {
                        *value = changed_to;
                    }
                }
                let drawn = draw_servo::drawn(nominal, bearing_now, &of);
                drawn.map_or(C::ZERO, |drawn| gradient.actuator(index, axis, &drawn))
            };
            for (quantity, nominal) in bearing {
                if back.acts[slot(quantity)] {
                    let by = slope(value(quantity, nominal), |v| part(quantity, v));
                    back.give(to, slot(quantity), nominal, by);
                }
            }
            for (quantity, nominal) in draw_servo::numbers(&nominal.law) {
                if back.acts(quantity, place) {
                    let by = slope(own(quantity, nominal), |v| part(quantity, v));
                    back.give(to, parameters.index(quantity, place), nominal, by);
                }
            }
        }
    }

    /// Numbers of paths and the delay.
    fn pull_autopilot(
        &self,
        back: &Back<'_>,
        to: &mut [AffineGradient],
        part: &impl Fn(usize, &DrawnPath) -> C,
        delayed: &impl Fn(f64) -> C,
    ) {
        let Some(autopilot) = &back.vehicle.autopilot else { return };
        let drawn = &back.drawn.autopilot;
        let index = |target: Target| match target {
            Target::Delay => back.parameters.index(Quantity::LoopDelay, Place::Vehicle),
            Target::Gain(p) => back.parameters.index(Quantity::PathGain, Place::Path(p)),
            Target::Filter(quantity, p, f) => back.parameters.index(quantity, Place::Filter(p, f)),
            Target::Scale(_) | Target::Slope(..) => unreachable!("a gradient of their own"),
        };
        let mut give = |target: Target, nominal: f64, value: f64, of: &dyn Fn(f64) -> C| {
            let index = index(target);
            if back.acts[index] {
                let by = slope(value, of);
                back.give(to, index, nominal, by);
            }
        };
        if autopilot.delay_s > 0.0 {
            give(Target::Delay, autopilot.delay_s, drawn.delay_s, &|v| delayed(v));
        }
        for (p, path) in autopilot.paths.iter().enumerate() {
            let with = |change: &dyn Fn(&mut DrawnPath)| {
                let mut draw = drawn.paths[p].clone();
                change(&mut draw);
                part(p, &draw)
            };
            let now = &drawn.paths[p];
            give(Target::Gain(p), path.gain, now.gain, &|v| with(&|draw| draw.gain = v));
            for (f, filter) in path.filters.iter().enumerate() {
                let (kind, nominal, now) = (&filter.kind, filter.kind.nominal(), now.filters[f]);
                let target = |quantity| Target::Filter(quantity, p, f);
                give(target(Quantity::FilterGain), nominal.gain, now.gain, &|v| {
                    with(&|draw| draw.filters[f].gain = v)
                });
                if kind.has_frequency() {
                    let target = target(Quantity::FilterFrequency);
                    give(target, nominal.frequency, now.frequency, &|v| {
                        with(&|draw| draw.filters[f].frequency = v)
                    });
                }
                if kind.has_damping() {
                    give(target(Quantity::FilterDamping), nominal.damping, now.damping, &|v| {
                        with(&|draw| draw.filters[f].damping = v)
                    });
                }
                if kind.has_delay() {
                    give(target(Quantity::FilterDelay), nominal.delay_s, now.delay_s, &|v| {
                        with(&|draw| draw.filters[f].delay_s = v)
                    });
                }
            }
        }
    }
}
