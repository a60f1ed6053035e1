//! From the draws of a case to its actuators and its autopilot.
//!
//! Order in which parameters act on each other: the damping of a second-order actuator follows its
//! nominal stiffness. Where the results go is decided in `draw`.

use super::Failure;
use crate::dispersion::Quantity;
use crate::dynamics::{DrawnActuator, DrawnAutopilot, DrawnEngine, DrawnPath, DrawnSensor};
use crate::vehicle::{
    Actuator, Autopilot, Bearing, Electrohydraulic, Engine, FilterDraw, Law, StateSpaceActuator,
    TransferActuator,
};
use std::f64::consts::TAU;

/// Draws the flex bearing and every set of actuators of an engine. `of` draws a quantity of the engine,
/// `actuator` one of the actuator of a number (see [`Engine::actuator`]).
pub fn actuators(
    engine: &Engine,
    to: &mut DrawnEngine,
    of: &impl Fn(Quantity, f64) -> Result<f64, Failure>,
    actuator: &impl Fn(usize, Quantity, f64) -> Result<f64, Failure>,
) -> Result<(), Failure> {
    let bearing = [
        of(Quantity::BearingStiffness, engine.bearing_stiffness_n_m_rad)?,
        of(Quantity::BearingDamping, engine.bearing_damping_n_m_s_rad)?,
    ];
    to.actuators.clear();
    for (set, (_, pair)) in engine.sets().enumerate() {
        let draw = |axis: usize| {
            let draw = |quantity, nominal| actuator(2 * set + axis, quantity, nominal);
            drawn(&pair[axis], bearing, &draw)
        };
        to.actuators.push([draw(0)?, draw(1)?]);
    }
    Ok(())
}

/// K_a and C_a = 2 ζ √(J_ref K_nom) of a second-order actuator, the torque of any other, and stiffness and
/// damping of the flex bearing where it is separate.
pub fn drawn(
    nominal: &Actuator,
    bearing: [f64; 2],
    draw: &impl Fn(Quantity, f64) -> Result<f64, Failure>,
) -> Result<DrawnActuator, Failure> {
    let [stiffness_n_m_rad, damping_n_m_s_rad] = match nominal.bearing {
        Bearing::Included => [0.0; 2],
        Bearing::Separate => bearing,
    };
    let torque = match &nominal.law {
        Law::SecondOrder(law) => {
            let stiffness = draw(Quantity::ActuatorStiffness, law.stiffness_n_m_rad)?;
            let ratio = draw(Quantity::ActuatorDamping, law.damping_ratio)?;
            let critical = (law.reference_inertia_kg_m2 * law.stiffness_n_m_rad).sqrt();
            let mut spring = DrawnActuator::spring(stiffness, 2.0 * ratio * critical);
            spring.stiffness_n_m_rad += stiffness_n_m_rad;
            spring.damping_n_m_s_rad += damping_n_m_s_rad;
            return Ok(spring);
        }
        Law::Electrohydraulic(law) => electrohydraulic(law, draw)?.state_space(),
        Law::TransferFunction(law) => TransferActuator {
            gain: draw(Quantity::ActuatorGain, law.gain)?,
            time_scale: draw(Quantity::ActuatorTimeScale, law.time_scale)?,
            ..law.clone()
        }
        .state_space(),
        Law::StateSpace(law) => StateSpaceActuator {
            gain: draw(Quantity::ActuatorGain, law.gain)?,
            time_scale: draw(Quantity::ActuatorTimeScale, law.time_scale)?,
            ..law.clone()
        }
        .state_space(),
    };
    Ok(DrawnActuator { stiffness_n_m_rad, damping_n_m_s_rad, torque })
}

/// The numbers of a torque law that are drawn, with their nominal values.
pub fn numbers(law: &Law) -> Vec<(Quantity, f64)> {
    match law {
        Law::SecondOrder(law) => vec![
            (Quantity::ActuatorStiffness, law.stiffness_n_m_rad),
            (Quantity::ActuatorDamping, law.damping_ratio),
        ],
        Law::Electrohydraulic(law) => {
            let numbers = std::cell::RefCell::new(Vec::new());
            let note = |quantity, nominal| {
                numbers.borrow_mut().push((quantity, nominal));
                Ok(nominal)
            };
            let drawn = electrohydraulic(law, &note);
            debug_assert!(drawn.is_ok());
            numbers.into_inner()
        }
        Law::TransferFunction(TransferActuator { gain, time_scale, .. })
        | Law::StateSpace(StateSpaceActuator { gain, time_scale, .. }) => {
            vec![(Quantity::ActuatorGain, *gain), (Quantity::ActuatorTimeScale, *time_scale)]
        }
    }
}

fn electrohydraulic(
    law: &Electrohydraulic,
    draw: &impl Fn(Quantity, f64) -> Result<f64, Failure>,
) -> Result<Electrohydraulic, Failure> {
    let mut drawn = *law;
    for (quantity, value) in [
        (Quantity::ActuatorArm, &mut drawn.arm_m),
        (Quantity::PistonArea, &mut drawn.piston_area_m2),
        (Quantity::LoadPathStiffness, &mut drawn.load_path_stiffness_n_m),
        (Quantity::OilStiffness, &mut drawn.oil_stiffness_n_m),
        (Quantity::Leakage, &mut drawn.leakage_m3_s_pa),
        (Quantity::ValveFlowGain, &mut drawn.valve_flow_gain_m3_s_a),
        (Quantity::PositionGain, &mut drawn.position_gain_a_m),
        (Quantity::PressureFeedback, &mut drawn.pressure_feedback_a_pa),
    ] {
        *value = draw(quantity, *value)?;
    }
    // An ideal valve and a feedback without a high pass have nothing to draw.
    if law.valve_pressure_gain_pa_a.is_finite() {
        drawn.valve_pressure_gain_pa_a =
            draw(Quantity::ValvePressureGain, law.valve_pressure_gain_pa_a)?;
    }
    if law.pressure_corner_rad_s > 0.0 {
        drawn.pressure_corner_rad_s =
            TAU * draw(Quantity::PressureCorner, law.pressure_corner_rad_s / TAU)?;
    }
    Ok(drawn)
}

/// What of an autopilot is drawn: the loop delay, a sensor's scale or slope gain in mode number …, a
/// path's gain, a number of a filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Loop delay.
    Delay,
    /// Scale of a sensor.
    Scale(usize),
    /// Slope gain of a sensor in a mode of the flight time.
    Slope(usize, usize),
    /// Gain of a path.
    Gain(usize),
    /// Number of a filter of a path.
    Filter(Quantity, usize, usize),
}

/// Draws the autopilot at a flight time with `modes` modes; `draw` draws a target.
pub fn autopilot(
    nominal: &Autopilot,
    modes: usize,
    to: &mut DrawnAutopilot,
    draw: &impl Fn(Target, f64) -> Result<f64, Failure>,
) -> Result<(), Failure> {
    // No delay has no states, and nothing to draw.
    to.delay_s = 0.0;
    if nominal.delay_s > 0.0 {
        to.delay_s = draw(Target::Delay, nominal.delay_s)?;
    }
    to.sensors.resize(nominal.sensors.len(), DrawnSensor::default());
    for (i, (sensor, to)) in nominal.sensors.iter().zip(&mut to.sensors).enumerate() {
        to.scale = draw(Target::Scale(i), sensor.scale)?;
        to.slope_gain.clear();
        for mode in 0..modes {
            to.slope_gain.push(draw(Target::Slope(i, mode), 1.0)?);
        }
    }
    to.paths.resize(nominal.paths.len(), DrawnPath::default());
    for (i, (path, to)) in nominal.paths.iter().zip(&mut to.paths).enumerate() {
        to.gain = draw(Target::Gain(i), path.gain)?;
        to.filters.clear();
        for (j, filter) in path.filters.iter().enumerate() {
            let kind = &filter.kind;
            let FilterDraw { mut gain, mut frequency, mut damping, mut delay_s } = kind.nominal();
            gain = draw(Target::Filter(Quantity::FilterGain, i, j), gain)?;
            if kind.has_frequency() {
                frequency = draw(Target::Filter(Quantity::FilterFrequency, i, j), frequency)?;
            }
            if kind.has_damping() {
                damping = draw(Target::Filter(Quantity::FilterDamping, i, j), damping)?;
            }
            if kind.has_delay() {
                delay_s = draw(Target::Filter(Quantity::FilterDelay, i, j), delay_s)?;
            }
            to.filters.push(FilterDraw { gain, frequency, damping, delay_s });
        }
    }
    Ok(())
}
