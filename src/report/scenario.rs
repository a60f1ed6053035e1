//! What a scenario holds, as text: vehicle, engines, modes, draws, populations and variants.
//!
//! It is read elsewhere; nothing here is computed that a run needs.

use crate::campaign::{Definition, NozzleJet, Slope, Variant};
use crate::dispersion::Dispersion;
use crate::dynamics::Feedback;
use crate::vehicle::Vehicle;
use std::fmt::Write;

/// Overview of a run; `evaluated` holds the populations whose corner has signs to be evaluated.
pub fn overview(
    vehicle: &Vehicle,
    dispersion: &Dispersion,
    definition: &Definition,
    evaluated: &[usize],
) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |label: &str, content: String| {
        let _ = writeln!(text, "{label:<14}{content}");
    };
    line("run", format!("{}, seed {}", definition.name, definition.seed));
    line("vehicle", vehicle.name.clone());
    let body = if vehicle.engines.iter().any(|e| e.in_modes) { "integrated" } else { "reduced" };
    line("modes from", format!("{} ({body} body)", vehicle.modal.source));
    for (engine, gimballed) in vehicle.engines.iter().zip(&definition.gimballed) {
        let state = if *gimballed { "gimballed" } else { "locked" };
        let case = match engine.case_stations.len() {
            0 => "no case".into(),
            count => format!("{count} case stations"),
        };
        line("engine", format!("{}, {state}, motor {}, {case}", engine.path(), engine.motor.name));
    }
    for time in &definition.flight_times_s {
        let Some(set) = vehicle.modal.at(*time) else { continue };
        let named = definition.modes.iter().filter_map(|name| {
            let mode = vehicle.named_modes.iter().find(|m| m.name == *name)?;
            let at = mode.labels.iter().find_map(|label| set.mode(label))?;
            Some(format!(
                "{name} is {} at {:.3} Hz",
                set.modes[at].label, set.modes[at].frequency_hz
            ))
        });
        let named: Vec<String> = named.collect();
        line("flight time", format!("{time} s, {} modes, {}", set.modes.len(), named.join(", ")));
    }
    let worst = dispersion.draws().iter().filter(|d| d.worst.is_some()).count();
    line("draw keys", format!("{}, {worst} of them with worst values", dispersion.draws().len()));
    for (index, population) in definition.populations.iter().enumerate() {
        let fixed = match population.fixed.len() {
            _ if evaluated.contains(&index) => ", signs to be evaluated".into(),
            0 => String::new(),
            count => format!(", {count} keys fixed"),
        };
        let drawn =
            if population.drawn { population.scheme.describe() } else { "not drawn".into() };
        line(
            "population",
            format!("{}, cases {}, {drawn}{fixed}", population.name, population.cases),
        );
    }
    for variant in &definition.variants {
        line("variant", format!("{}: {}", variant.name, effects(variant)));
    }
    let evaluations = definition.flight_times_s.len() * definition.variants.len();
    let cases: u64 = definition.populations.iter().map(|p| p.cases).sum();
    line(
        "evaluations",
        format!(
            "{} ({cases} cases at {evaluations} points)",
            cases.saturating_mul(evaluations as u64)
        ),
    );
    text
}

fn effects(variant: &Variant) -> String {
    let nozzle = match variant.nozzle_jet_damping {
        NozzleJet::Off => None,
        NozzleJet::Linear => Some("nozzle jet damping (13)"),
        NozzleJet::RigidNozzle => Some("nozzle jet damping of a rigid nozzle"),
    };
    let parts = [
        Some(if variant.thrust { "thrust" } else { "no thrust" }),
        variant.case_jet_damping.then_some("case jet damping"),
        nozzle,
        variant.follower_thrust.then_some("follower thrust"),
        Some(match variant.slope {
            Slope::VirtualGrid => "virtual grid",
            Slope::SingleGrid => "single grid",
        }),
        variant.rigid_body.then_some("rigid body"),
        variant.slosh.then_some("slosh"),
        variant.aerodynamics.then_some("aerodynamics"),
        match variant.feedback {
            Feedback::Open => None,
            Feedback::Closed => Some("autopilot closed"),
            Feedback::Inverted => Some("autopilot inverted"),
        },
    ];
    let mut text = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
    if let Some(set) = &variant.actuators {
        text += &format!(", {set} actuators");
    }
    text
}
