//! From the draws of a case to the drawn vehicle at one flight time.
//!
//! The order in which parameters act on each other is here: mass flow follows thrust and specific
//! impulse, ablation follows the unablated nozzle, damping coefficients follow the reference
//! inertia. What the drawn numbers do to the motion is decided in `dynamics`.

pub mod gradient;

use super::draw_servo::{self, Target};
use super::{Failure, FailureKind};
use crate::dispersion::{Affine, Parameters, Place, Quantity};
use crate::dynamics::{DrawnAerodynamics, DrawnBody, DrawnEngine, DrawnTank, DrawnVehicle};
use crate::vehicle::motor::interpolate;
use crate::vehicle::{Aerodynamics, Engine, ModeSet, STANDARD_GRAVITY_M_S2, Vehicle};
use std::f64::consts::TAU;

/// Where the parameters of one flight time stand among the effects of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Slots {
    flight_time_s: f64,
    /// Nominal mean acceleration, m/s², under which liquids slosh.
    acceleration_m_s2: f64,
    structural_damping: usize,
    modes: Vec<ModeSlots>,
    engines: Vec<EngineSlots>,
    /// Slope gain per sensor and mode.
    sensors: Vec<Vec<usize>>,
}

#[derive(Debug, Clone, PartialEq)]
struct ModeSlots {
    nominal_rad_s: f64,
    frequency: usize,
    damping: usize,
}

#[derive(Debug, Clone, PartialEq)]
struct EngineSlots {
    engine: usize,
    /// Gimbal shape and slope gain per mode.
    gains: Vec<[usize; 2]>,
}

impl Slots {
    /// The slots of `vehicle` with the modes of `set`.
    ///
    /// # Panics
    /// If a label of `set` is not one of the vehicle's.
    pub fn new(vehicle: &Vehicle, set: &ModeSet, parameters: &Parameters) -> Self {
        let labels: Vec<usize> = set
            .modes
            .iter()
            .map(|mode| parameters.label(&mode.label).expect("a label of the vehicle"))
            .collect();
        let modes = (set.modes.iter().zip(&labels))
            .map(|(mode, &label)| ModeSlots {
                nominal_rad_s: TAU * mode.frequency_hz,
                frequency: parameters.index(Quantity::ModeFrequency, Place::Mode(label)),
                damping: parameters.index(Quantity::ModeDamping, Place::Mode(label)),
            })
            .collect();
        let gains = |engine: usize| {
            let gain = |quantity, label| parameters.index(quantity, Place::Gimbal(engine, label));
            (labels.iter())
                .map(|&l| [gain(Quantity::GimbalShape, l), gain(Quantity::GimbalSlope, l)])
                .collect()
        };
        Self {
            flight_time_s: set.flight_time_s,
            acceleration_m_s2: vehicle.nominal_acceleration_m_s2(set),
            structural_damping: parameters.index(Quantity::StructuralDamping, Place::Vehicle),
            modes,
            engines: (0..vehicle.engines.len())
                .map(|engine| EngineSlots { engine, gains: gains(engine) })
                .collect(),
            sensors: (0..vehicle.autopilot.as_ref().map_or(0, |a| a.sensors.len()))
                .map(|sensor| {
                    let place = |label: &usize| Place::SensorMode(sensor, *label);
                    let index = |label| parameters.index(Quantity::SensorSlope, place(label));
                    labels.iter().map(index).collect()
                })
                .collect(),
        }
    }

    /// The vehicle drawn by `effects` (one per parameter), written into `drawn`.
    ///
    /// # Errors
    /// [`FailureKind::Draw`] where a drawn value is physically impossible; it names the parameter
    /// and the value.
    pub fn draw(
        &self,
        vehicle: &Vehicle,
        parameters: &Parameters,
        effects: &[Affine],
        drawn: &mut DrawnVehicle,
    ) -> Result<(), Failure> {
        let value = |index: usize, nominal: f64| {
            let value = effects[index].apply(nominal);
            let parameter = &parameters.all()[index];
            let domain = parameter.quantity.definition().domain;
            if domain.contains(value) {
                return Ok(value);
            }
            let message = format!("{} is {value}, allowed is {}", parameter.path, domain.words());
            Err(Failure::new(FailureKind::Draw, message))
        };
        let common = value(self.structural_damping, vehicle.structural_damping)?;
        self.draw_body(&mut drawn.body, common, &value)?;
        let whole = |quantity, nominal| value(parameters.index(quantity, Place::Vehicle), nominal);
        let inertia = [Quantity::RollInertia, Quantity::PitchInertia, Quantity::YawInertia];
        for (gain, quantity) in drawn.body.inertia_gain.iter_mut().zip(inertia) {
            *gain = whole(quantity, 1.0)?;
        }
        drawn.tanks.clear();
        for (index, tank) in vehicle.tanks.iter().enumerate() {
            let of =
                |quantity, nominal| value(parameters.index(quantity, Place::Tank(index)), nominal);
            let omega = tank.frequency_rad_s(self.flight_time_s, self.acceleration_m_s2);
            drawn.tanks.push(DrawnTank {
                mass_kg: of(Quantity::SloshMass, tank.mass_kg(self.flight_time_s))?,
                frequency_rad_s: TAU * of(Quantity::SloshFrequency, omega / TAU)?,
                damping_ratio: of(Quantity::SloshDamping, tank.damping_ratio)?,
            });
        }
        let air = vehicle.aerodynamics.as_ref();
        drawn.aerodynamics = air.map(|air| self.draw_air(air, &whole)).transpose()?;
        drawn.engines.resize(vehicle.engines.len(), DrawnEngine::default());
        for slots in &self.engines {
            let engine = &vehicle.engines[slots.engine];
            let of = |quantity, nominal| {
                value(parameters.index(quantity, Place::Engine(slots.engine)), nominal)
            };
            let actuator = |number, quantity, nominal| {
                value(parameters.index(quantity, Place::Actuator(slots.engine, number)), nominal)
            };
            let to = &mut drawn.engines[slots.engine];
            self.draw_flow(engine, to, &of)?;
            self.draw_nozzle(engine, to, &of)?;
            draw_servo::actuators(engine, to, &of, &actuator)?;
            to.shape_gain.clear();
            to.slope_gain.clear();
            for [shape, slope] in &slots.gains {
                to.shape_gain.push(value(*shape, 1.0)?);
                to.slope_gain.push(value(*slope, 1.0)?);
            }
        }
        if let Some(autopilot) = &vehicle.autopilot {
            let target = |target: Target, nominal: f64| {
                let index = match target {
                    Target::Delay => parameters.index(Quantity::LoopDelay, Place::Vehicle),
                    Target::Scale(s) => parameters.index(Quantity::SensorScale, Place::Sensor(s)),
                    Target::Slope(sensor, mode) => self.sensors[sensor][mode],
                    Target::Gain(p) => parameters.index(Quantity::PathGain, Place::Path(p)),
                    Target::Filter(quantity, p, f) => {
                        parameters.index(quantity, Place::Filter(p, f))
                    }
                };
                value(index, nominal)
            };
            draw_servo::autopilot(autopilot, self.modes.len(), &mut drawn.autopilot, &target)?;
        }
        Ok(())
    }

    fn draw_body(
        &self,
        body: &mut DrawnBody,
        structural_damping: f64,
        value: &impl Fn(usize, f64) -> Result<f64, Failure>,
    ) -> Result<(), Failure> {
        body.frequency_rad_s.clear();
        body.damping_ratio.clear();
        for mode in &self.modes {
            // Rows on frequency are in hertz; the factor is exact in effect, not in rounding, so
            // that an undispersed mode keeps its nominal value bit for bit.
            let nominal_hz = mode.nominal_rad_s / TAU;
            let drawn_hz = value(mode.frequency, nominal_hz)?;
            let omega = if drawn_hz == nominal_hz { mode.nominal_rad_s } else { TAU * drawn_hz };
            body.frequency_rad_s.push(omega);
            body.damping_ratio.push(value(mode.damping, structural_damping)?);
        }
        Ok(())
    }

    /// Coefficients at the flight condition.
    fn draw_air(
        &self,
        air: &Aerodynamics,
        of: &impl Fn(Quantity, f64) -> Result<f64, Failure>,
    ) -> Result<DrawnAerodynamics, Failure> {
        let draw = |quantity, table: &[f64]| {
            of(quantity, interpolate(&air.time_s, table, self.flight_time_s))
        };
        Ok(DrawnAerodynamics {
            dynamic_pressure_pa: draw(Quantity::DynamicPressure, &air.dynamic_pressure_pa)?,
            normal_force_slope_1_rad: draw(
                Quantity::NormalForceSlope,
                &air.normal_force_slope_1_rad,
            )?,
            center_of_pressure_x_m: draw(Quantity::CenterOfPressure, &air.center_of_pressure_x_m)?,
            axial_force: draw(Quantity::AxialForce, &air.axial_force)?,
            pitch_damping: draw(Quantity::PitchDamping, &air.pitch_damping)?,
            roll_damping: draw(Quantity::RollDamping, &air.roll_damping)?,
        })
    }

    /// ṁ = R_drawn/(Isp_drawn g) · profile_drawn, then any direct row.
    fn draw_flow(
        &self,
        engine: &Engine,
        to: &mut DrawnEngine,
        of: &impl Fn(Quantity, f64) -> Result<f64, Failure>,
    ) -> Result<(), Failure> {
        let motor = &engine.motor;
        to.thrust_n = of(Quantity::Thrust, motor.thrust_at(self.flight_time_s))?;
        let impulse = of(Quantity::SpecificImpulse, motor.specific_impulse_s)?;
        let profile = of(Quantity::FlowProfile, motor.flow_profile_at(self.flight_time_s))?;
        let flow = to.thrust_n / (impulse * STANDARD_GRAVITY_M_S2) * profile;
        to.mass_flow_kg_s = of(Quantity::MassFlow, flow)?;
        Ok(())
    }

    /// Mass, cg and inertia scaled by their draws, then less the liner loss a·b(t)·(Δm, ΔJ, Δr).
    fn draw_nozzle(
        &self,
        engine: &Engine,
        to: &mut DrawnEngine,
        of: &impl Fn(Quantity, f64) -> Result<f64, Failure>,
    ) -> Result<(), Failure> {
        let nozzle = &engine.nozzle;
        to.mass_kg = of(Quantity::NozzleMass, nozzle.mass_kg)?;
        to.cg_m = of(Quantity::NozzleCg, nozzle.cg_m)?;
        to.inertia_kg_m2 = of(Quantity::NozzleInertia, nozzle.inertia_kg_m2)?;
        to.axial_inertia_kg_m2 = of(Quantity::NozzleAxialInertia, nozzle.axial_inertia_kg_m2)?;
        to.length_m = of(Quantity::NozzleLength, nozzle.length_m)?;
        if let Some(ablation) = &nozzle.ablation {
            let share = of(Quantity::NozzleAblation, ablation.factor)?
                * engine.motor.burned_fraction_at(self.flight_time_s);
            to.mass_kg -= share * ablation.mass_loss_kg;
            to.inertia_kg_m2 -= share * ablation.inertia_loss_kg_m2;
            to.cg_m += share * ablation.cg_change_m;
        }
        let positive = |what: &str, value: f64| {
            if value > 0.0 {
                return Ok(());
            }
            let message = format!("{}: {what} is {value}, allowed is above zero", engine.path());
            Err(Failure::new(FailureKind::Draw, message))
        };
        positive("nozzle mass after ablation", to.mass_kg)?;
        positive("nozzle inertia about its cg, J_G − m r²,", to.central_inertia_kg_m2())
    }
}
