//! Actuators: from their tables in the vehicle file to torque laws, and the alternative sets.
//!
//! Where an actuator is attached is checked in `vehicle`.

use super::table::Findings;
use super::vehicle_file::{
    ActuatorFile, ActuatorKind, BearingPart, ElectrohydraulicFile, EngineFile, StateSpaceFile,
    TransferFunctionFile,
};
use crate::vehicle::{
    Bearing, Electrohydraulic, Law, SecondOrder, StateSpace, StateSpaceActuator, TransferActuator,
    TransferFunction,
};
use nalgebra::{Complex, DMatrix};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Bearing and torque law of an actuator with the moment arm `arm_m` of its action line.
pub fn drive(
    key: &str,
    file: &ActuatorFile,
    engine: &EngineFile,
    arm_m: Option<f64>,
    findings: &mut Findings,
) -> Option<(Bearing, Law)> {
    foreign_keys(key, file, findings);
    let mut missing = |name: &str, allowed: &str| {
        findings.push(format!("{key}.{name}"), "nothing", allowed);
    };
    let law = match file.kind {
        ActuatorKind::SecondOrder => {
            if file.damping_ratio.is_none() {
                missing("damping_ratio", "a finite number ≥ 0");
            }
            second_order(key, file, engine, findings)
        }
        ActuatorKind::Electrohydraulic => match &file.electrohydraulic {
            Some(table) => Some(electrohydraulic(table, table.arm_m.or(arm_m)?)),
            None => {
                missing("electrohydraulic", "a table with the numbers of the actuator");
                None
            }
        },
        ActuatorKind::TransferFunction => match &file.transfer_function {
            Some(table) => transfer_function(key, table, findings),
            None => {
                missing("transfer_function", "a table with numerator and denominator");
                None
            }
        },
        ActuatorKind::StateSpace => match &file.state_space {
            Some(table) => state_space(key, table, findings),
            None => {
                missing("state_space", "a table with a, b, c and d");
                None
            }
        },
    };
    let bearing = bearing(key, file, engine, law.as_ref(), findings);
    Some((bearing?, law?))
}

/// Keys of another kind than the actuator's.
fn foreign_keys(key: &str, file: &ActuatorFile, findings: &mut Findings) {
    use ActuatorKind::{Electrohydraulic, SecondOrder, StateSpace, TransferFunction};
    let keys = [
        ("stiffness_n_m_rad", SecondOrder, file.stiffness_n_m_rad.is_some()),
        ("frequency_hz", SecondOrder, file.frequency_hz.is_some()),
        ("damping_ratio", SecondOrder, file.damping_ratio.is_some()),
        ("electrohydraulic", Electrohydraulic, file.electrohydraulic.is_some()),
        ("transfer_function", TransferFunction, file.transfer_function.is_some()),
        ("state_space", StateSpace, file.state_space.is_some()),
    ];
    for (name, kind, given) in keys {
        if given && kind != file.kind {
            let found = format!("a value, with kind = \"{}\"", file.kind.name());
            let allowed = format!("nothing, or kind = \"{}\"", kind.name());
            findings.push(format!("{key}.{name}"), found, allowed);
        }
    }
}

fn second_order(
    key: &str,
    file: &ActuatorFile,
    engine: &EngineFile,
    findings: &mut Findings,
) -> Option<Law> {
    let inertia = engine.nozzle.inertia_kg_m2;
    let stiffness = match (file.stiffness_n_m_rad, file.frequency_hz) {
        (Some(stiffness), None) => Some(stiffness),
        (None, Some(hertz)) => Some(inertia * (hertz * TAU).powi(2)),
        (given, _) => {
            let found = if given.is_some() { "both" } else { "neither" };
            let allowed = "exactly one of `stiffness_n_m_rad` and `frequency_hz`";
            findings.push(key, found, allowed);
            None
        }
    };
    Some(Law::SecondOrder(SecondOrder {
        stiffness_n_m_rad: stiffness?,
        damping_ratio: file.damping_ratio?,
        reference_inertia_kg_m2: inertia,
    }))
}

fn electrohydraulic(file: &ElectrohydraulicFile, arm_m: f64) -> Law {
    Law::Electrohydraulic(Electrohydraulic {
        arm_m,
        piston_area_m2: file.piston_area_m2,
        load_path_stiffness_n_m: file.load_path_stiffness_n_m,
        oil_stiffness_n_m: file.oil_stiffness_n_m,
        leakage_m3_s_pa: file.leakage_m3_s_pa,
        valve_flow_gain_m3_s_a: file.valve_flow_gain_m3_s_a,
        valve_pressure_gain_pa_a: file.valve_pressure_gain_pa_a.unwrap_or(f64::INFINITY),
        position_gain_a_m: file.position_gain_a_m,
        pressure_feedback_a_pa: file.pressure_feedback_a_pa,
        pressure_corner_rad_s: TAU * file.pressure_corner_hz,
    })
}

fn transfer_function(
    key: &str,
    file: &TransferFunctionFile,
    findings: &mut Findings,
) -> Option<Law> {
    let key = format!("{key}.transfer_function");
    let mut function = |name: &str, numerator: &[f64], denominator: &[f64]| {
        TransferFunction::new(numerator, denominator).map(Arc::new).map_err(|refusal| {
            let allowed = "a proper transfer function: no more zeros than poles";
            findings.push(format!("{key}.{name}"), refusal.to_string(), allowed);
        })
    };
    let stiffness = function("numerator", &file.numerator, &file.denominator);
    let command = match (&file.command_numerator, &file.command_denominator) {
        (Some(n), Some(d)) => function("command_numerator", n, d).map(Some),
        (None, None) => Ok(None),
        (numerator, _) => {
            let absent = if numerator.is_some() { "denominator" } else { "numerator" };
            let allowed = "both command_numerator and command_denominator, or neither";
            findings.push(format!("{key}.command_{absent}"), "nothing", allowed);
            Err(())
        }
    };
    let (command, stiffness) = (command.ok()?, stiffness.ok()?);
    let stable = held(&format!("{key}.denominator"), &stiffness.state_space(), findings)
        & command.as_ref().is_none_or(|command| {
            held(&format!("{key}.command_denominator"), &command.state_space(), findings)
        });
    if !stable {
        return None;
    }
    Some(Law::TransferFunction(TransferActuator {
        command,
        stiffness,
        damping_n_m_s_rad: file.damping_n_m_s_rad,
        gain: 1.0,
        time_scale: 1.0,
    }))
}

/// Whether an actuator is stable with its nozzle held: poles left of the imaginary axis, or at zero.
fn held(key: &str, system: &StateSpace, findings: &mut Findings) -> bool {
    let poles = system.poles();
    let unstable = poles.iter().flatten().find(|pole| pole.norm() != 0.0 && !(pole.re < 0.0));
    // Numbers so large that a response overflows are no actuator's.
    let response = system.response(Complex::new(0.0, 1.0));
    let finite =
        response.is_some_and(|all| all.iter().all(|x| x.re.is_finite() && x.im.is_finite()));
    let found = match (&poles, unstable) {
        (None, _) => "poles that cannot be found".to_owned(),
        (_, Some(pole)) => format!("a pole at {pole} rad/s"),
        _ if !finite => "a response at 1 rad/s that is not finite".to_owned(),
        _ => return true,
    };
    findings.push(key, found, "poles in the open left half plane or at zero, the nozzle held");
    false
}

fn state_space(key: &str, file: &StateSpaceFile, findings: &mut Findings) -> Option<Law> {
    let n = file.a.len();
    let mut good = true;
    let mut size = |name: String, found: usize, what: &str| {
        if found != n {
            let allowed = format!("{n}, as many as `a` has rows");
            findings.push(format!("{key}.state_space.{name}"), format!("{found} {what}"), allowed);
            good = false;
        }
    };
    for (i, row) in file.a.iter().enumerate() {
        size(format!("a[{i}]"), row.len(), "entries");
    }
    size("b".into(), file.b.len(), "rows");
    size("c".into(), file.c.len(), "entries");
    if !good {
        return None;
    }
    let system = StateSpace {
        a: DMatrix::from_fn(n, n, |i, j| file.a[i][j]),
        b: DMatrix::from_fn(n, 3, |i, j| file.b[i][j]),
        c: DMatrix::from_fn(1, n, |_, j| file.c[j]),
        d: DMatrix::from_row_slice(1, 3, &file.d),
    };
    held(&format!("{key}.state_space.a"), &system, findings).then(|| {
        let system = Arc::new(system);
        Law::StateSpace(StateSpaceActuator { system, gain: 1.0, time_scale: 1.0 })
    })
}

fn bearing(
    key: &str,
    file: &ActuatorFile,
    engine: &EngineFile,
    law: Option<&Law>,
    findings: &mut Findings,
) -> Option<Bearing> {
    let key = format!("{key}.bearing");
    let part = match (file.bearing, file.kind) {
        (Some(part), _) => part,
        (None, ActuatorKind::SecondOrder) => BearingPart::Included,
        (None, ActuatorKind::Electrohydraulic) => return Some(Bearing::Separate),
        (None, _) => {
            findings.push(key, "nothing", "\"included\" or \"separate\" for this kind of actuator");
            return None;
        }
    };
    match (part, &engine.bearing) {
        (BearingPart::Separate, None) => {
            let allowed = "`[engine.bearing]` with a stiffness, or bearing = \"included\"";
            findings.push(key, "\"separate\" without a bearing", allowed);
            None
        }
        (BearingPart::Separate, Some(_)) => Some(Bearing::Separate),
        (BearingPart::Included, flex) => {
            let flex = flex.as_ref().map_or(0.0, |b| b.stiffness_n_m_rad);
            let stiffness = match law {
                Some(Law::SecondOrder(law)) => Some(law.stiffness_n_m_rad),
                _ => None,
            };
            if let Some(stiffness) = stiffness.filter(|k| !(*k >= flex)) {
                let found = format!(
                    "an actuator stiffness of {stiffness} N·m/rad that includes a bearing of {flex} N·m/rad"
                );
                let allowed = "at least the bearing's stiffness, or bearing = \"separate\"";
                findings.push(key, found, allowed);
            }
            Some(Bearing::Included)
        }
    }
}
