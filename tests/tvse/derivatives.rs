//! Eigenvalue derivatives and worst cases on the whole reference vehicle, against differences of solved poles
//! and an exhaustive grid.

use crate::study::{Study, columns};
use nalgebra::Complex;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tvse::campaign::derivative::LARGEST_CURVATURE;
use tvse::campaign::worst::{self, Aim, Method, Objective, Quantity};
use tvse::campaign::{Definition, Evaluator, Population, SensitivityRule, Variant};
use tvse::dispersion::{Dispersion, Quantity as Number, Sampler};
use tvse::dynamics::{Feedback, NozzleJet};
use tvse::io::scenario::{self, Loaded};
use tvse::scenario::dispersion;
use tvse::vehicle::NamedMode;

/// Every kind of parameter, each key with one per cent of its value for σ; modes and shapes of a few labels.
const EVERY_KIND: &str = r#"
[[common]]
id = "model"
source = "test"
"#;

/// A row that scales what `path` names.
fn row(path: &str, level: &str, more: &str) -> String {
    format!(
        "[[row]]\npath = \"{path}\"\nlaw = {{ kind = \"normal\", mean = 1.0, sigma = 0.01 }}\n\
         apply = \"scale\"\nlevel = \"{level}\"\nsource = \"test\"\n{more}\n"
    )
}

/// Rows for every quantity of the registry that the vehicle has.
fn every_kind() -> String {
    let mut text = EVERY_KIND.to_owned();
    text += &row("structure.damping", "vehicle", "");
    for label in ["m005", "m006", "m007"] {
        text += &row(&format!("modes.{label}.damping"), "mode", "");
        let common = "common = \"model\"\ncommon_weight = 0.5";
        text += &row(&format!("modes.{label}.frequency"), "mode", common);
        for gain in ["shape", "slope"] {
            text += &row(&format!("booster.left.gimbal.{label}.{gain}"), "mode", "");
            text += &row(&format!("core.1.gimbal.{label}.{gain}"), "mode", "");
        }
        text += &row(&format!("autopilot.sensor.aft.{label}.slope"), "mode", "");
    }
    for number in [
        "thrust",
        "specific_impulse",
        "flow_profile",
        "mass_flow",
        "nozzle.mass",
        "nozzle.cg",
        "nozzle.inertia",
        "nozzle.axial_inertia",
        "nozzle.length",
    ] {
        text += &row(&format!("booster.left.{number}"), "engine", "");
        text += &row(&format!("core.2.{number}"), "engine", "");
    }
    text += &row("booster.left.nozzle.ablation", "engine", "");
    text += &row("booster.left.bearing.stiffness", "engine", "");
    // The vehicle's bearing has no damping that could be scaled.
    text += &row("booster.left.bearing.damping", "engine", "")
        .replace("mean = 1.0, sigma = 0.01", "mean = 1e5, sigma = 1e3")
        .replace("scale", "offset");
    for number in [
        "stiffness",
        "damping",
        "arm",
        "piston_area",
        "load_path_stiffness",
        "oil_stiffness",
        "leakage",
        "valve_flow_gain",
        "valve_pressure_gain",
        "position_gain",
        "pressure_feedback",
        "pressure_corner",
    ] {
        text += &row(&format!("booster.left.actuator.*.{number}"), "actuator", "");
    }
    text += &row("autopilot.delay", "vehicle", "");
    text += &row("autopilot.sensor.*.scale", "sensor", "");
    text += &row("autopilot.path.*.gain", "path", "");
    for number in ["gain", "frequency", "damping"] {
        text += &row(&format!("autopilot.path.*.filter.*.{number}"), "filter", "");
    }
    for number in ["mass", "frequency", "damping"] {
        text += &row(&format!("tank.lox.slosh.{number}"), "tank", "");
    }
    for number in ["roll_inertia", "pitch_inertia", "yaw_inertia"] {
        text += &row(&format!("body.{number}"), "vehicle", "");
    }
    for number in [
        "dynamic_pressure",
        "normal_force_slope",
        "center_of_pressure",
        "axial_force",
        "pitch_damping",
        "roll_damping",
    ] {
        text += &row(&format!("aerodynamics.{number}"), "vehicle", "");
    }
    text
}

fn loaded() -> Loaded {
    let run = concat!(env!("CARGO_MANIFEST_DIR"), "/runs/closed-loop.toml");
    scenario::load(Path::new(run), scenario::Reach::Study).unwrap()
}

fn population(name: &str) -> Population {
    Population {
        name: name.into(),
        cases: 1,
        fixed: vec![],
        drawn: false,
        scheme: Default::default(),
    }
}

/// The definition with these variants at 105 s alone.
fn at_105(loaded: &Loaded, variants: Vec<Variant>) -> Definition {
    Definition {
        populations: vec![population("nominal")],
        flight_times_s: vec![105.0],
        variants,
        margins: None,
        ..loaded.definition.clone()
    }
}

/// Open elastic, rigid with slosh and air, closed, and closed on electrohydraulic actuators.
fn variants(loaded: &Loaded) -> Vec<Variant> {
    let closed = loaded.definition.variants.iter().find(|v| v.name == "closed").unwrap();
    let elastic = Variant {
        name: "elastic".into(),
        rigid_body: false,
        slosh: false,
        aerodynamics: false,
        feedback: Feedback::Open,
        follower_thrust: true,
        nozzle_jet_damping: NozzleJet::RigidNozzle,
        ..closed.clone()
    };
    let slosh = Variant { name: "slosh".into(), slosh: true, ..elastic.clone() };
    let air = Variant { name: "air".into(), feedback: Feedback::Open, ..closed.clone() };
    let hydraulic = Variant {
        name: "hydraulic".into(),
        actuators: Some("electrohydraulic".into()),
        ..closed.clone()
    };
    vec![elastic, slosh, air, closed.clone(), hydraulic]
}

/// The pole nearest to `near` among those that may be the mode.
fn pole(
    evaluator: &Evaluator<'_>,
    dispersion: &Dispersion,
    z: &[Option<f64>],
    at: [usize; 3],
    near: Complex<f64>,
) -> Complex<f64> {
    let found = evaluator.follow(&dispersion.values_at(z), at, false).unwrap();
    let values = found.iter().map(|followed| followed.pole.value);
    values.min_by(|a, b| (a - near).norm().total_cmp(&(b - near).norm())).unwrap()
}

/// Central difference of the fourth order by the score of a draw.
fn difference(
    evaluator: &Evaluator<'_>,
    dispersion: &Dispersion,
    z: &[Option<f64>],
    (draw, place): (usize, [usize; 3]),
    step: f64,
    near: Complex<f64>,
) -> Complex<f64> {
    let at = |shift: f64| {
        let mut z = z.to_vec();
        z[draw] = Some(z[draw].unwrap_or(0.0) + shift);
        pole(evaluator, dispersion, &z, place, near)
    };
    let slope = |h: f64| (at(h) - at(-h)) / (2.0 * h);
    (slope(step) * 4.0 - slope(2.0 * step)) / 3.0
}

/// Modes beside the TVSE mode, of both bending planes and of torsion, so that every number is felt by one.
const OTHERS: [&str; 3] = ["m001", "m002", "m010"];

#[test]
fn every_derivative_is_what_central_differences_of_the_solved_pole_say() {
    let loaded = loaded();
    let mut vehicle = loaded.vehicle.vehicle.clone();
    let other = |label: &str| NamedMode { name: label.into(), labels: vec![label.into()] };
    vehicle.named_modes.extend(OTHERS.map(other));
    let dispersion = dispersion::read("test", &every_kind(), &vehicle).unwrap();
    let mut definition = at_105(&loaded, variants(&loaded));
    definition.modes.extend(OTHERS.map(str::to_owned));
    let sampler = Sampler::new(&dispersion, 1);
    let evaluator = Evaluator::new(&vehicle, &sampler, &definition, false).unwrap();
    // Away from the nominal, so that no factor is one.
    let draws = dispersion.draws().len();
    let z: Vec<Option<f64>> = (0..draws).map(|i| Some(1.5 * (1.7 * i as f64).sin())).collect();
    let mut felt = vec![false; draws];
    let closed = definition.variants.iter().position(|v| v.name == "closed").unwrap();
    let all = (0..definition.variants.len()).map(|variant| [0, variant, 0]);
    let all: Vec<_> = all.chain((1..=OTHERS.len()).map(|mode| [0, closed, mode])).collect();
    for at in all {
        let found = evaluator.follow(&dispersion.values_at(&z), at, true).unwrap();
        let centre = &found[0];
        let by: Vec<Complex<f64>> = centre.by_score.iter().map(|by| by.unwrap()).collect();
        let largest = by.iter().map(|by| by.norm()).fold(0.0, f64::max);
        for draw in 0..draws {
            let near = centre.pole.value;
            let expected = difference(&evaluator, &dispersion, &z, (draw, at), 0.2, near);
            // Rounding of the poles (1e-10 rad/s of the greatest ones) over the step, and the fifth
            // derivative.
            let allowed = 1e-5 * by[draw].norm() + 1e-7 * largest;
            let error = (by[draw] - expected).norm();
            let (name, key) = (&definition.variants[at[1]].name, &dispersion.draws()[draw].key);
            assert!(error <= allowed, "{name}, {key}: {} is not {expected}", by[draw]);
            felt[draw] |= by[draw].norm() > 10.0 * allowed;
        }
    }
    // No kind of parameter is tested by a derivative that is lost in the tolerance alone.
    let parameters = dispersion.parameters().all();
    let unfelt = Number::ALL.iter().filter(|quantity| {
        let of = |draw: usize| {
            let path = dispersion.draws()[draw].key.split(" @ ").next().unwrap();
            parameters.iter().any(|p| p.quantity == **quantity && names(path, &p.path))
        };
        let drawn = (0..draws).any(of);
        drawn && !(0..draws).any(|draw| felt[draw] && of(draw))
    });
    // Damping of the rigid roll: elastic modes hardly see it; `dynamics::gradient` tests its part.
    assert_eq!(unfelt.collect::<Vec<_>>(), [&Number::RollDamping]);
    // What the vehicle has and no row draws.
    let undrawn = Number::ALL.iter().filter(|quantity| {
        let mut of = parameters.iter().filter(|p| p.quantity == **quantity && p.exists).peekable();
        let drawn = |path: &str| {
            let keys = dispersion.draws().iter();
            keys.clone().any(|draw| names(draw.key.split(" @ ").next().unwrap(), path))
        };
        of.peek().is_some() && !of.any(|p| drawn(&p.path))
    });
    assert_eq!(undrawn.collect::<Vec<_>>(), Vec::<&Number>::new());
}

/// Whether a path with `*` names a parameter.
fn names(pattern: &str, path: &str) -> bool {
    let (a, b): (Vec<&str>, Vec<&str>) = (pattern.split('.').collect(), path.split('.').collect());
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| *a == "*" || a == b)
}

#[test]
fn near_veering_the_derivative_is_right_and_flagged() {
    let loaded = loaded();
    let vehicle = &loaded.vehicle.vehicle;
    // The TVSE mode drawn up to half above its frequency, to the next antisymmetric mode, from which it
    // veers away; those between are symmetric and only crossed.
    let law = "law = { kind = \"normal\", mean = 1.0, sigma = 0.01 }";
    let wide = "law = { kind = \"normal\", mean = 1.0, sigma = 0.02 }";
    let text = row("modes.m006.frequency", "mode", "").replace(law, wide)
        + &row("booster.left.nozzle.cg", "engine", "");
    let dispersion = dispersion::read("test", &text, vehicle).unwrap();
    let draw = dispersion.draws().iter().position(|d| d.key.contains("m006")).unwrap();
    let elastic = variants(&loaded).swap_remove(0);
    let rule = SensitivityRule { variants: vec![0], flight_times: vec![0], cases: None };
    let scales = (0..=24).map(|i| 1.40 + 0.01 * f64::from(i));
    let fixed = |scale: f64| Population { fixed: vec![(draw, scale)], ..population("at") };
    let definition = Definition {
        populations: scales.clone().map(fixed).collect(),
        sensitivity: Some(rule),
        ..at_105(&loaded, vec![elastic])
    };
    let sampler = Sampler::new(&dispersion, 1);
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false).unwrap();
    let mut flagged = 0;
    let mut plain = 0;
    for (index, scale) in scales.enumerate() {
        let record = evaluator.evaluate(index, 0);
        for found in record.evaluations[0].outcome.as_ref().unwrap() {
            let sensitivity = found.sensitivity.as_ref().unwrap();
            let of = |i: usize| if i == draw { (scale - 1.0) / 0.02 } else { 0.0 };
            let z: Vec<Option<f64>> = (0..2).map(|i| Some(of(i))).collect();
            for other in 0..2 {
                let at = (other, [0, 0, 0]);
                let expected = difference(&evaluator, &dispersion, &z, at, 1e-2, found.value);
                let by = sensitivity.real_part_rad_s[other].unwrap();
                // Rounding of poles (1e-10 rad/s of the greatest ones) over a step of a hundredth of
                // a σ, and the fifth derivative of a veering a σ wide.
                let allowed = 1e-6 * expected.norm() + 1e-7;
                assert!((by - expected.re).abs() < allowed, "{scale}: {by} is not {expected}");
            }
            // The curvature is that of the pole itself, where the neighbours make it.
            let at = |shift: f64| {
                let mut z = z.clone();
                z[draw] = Some(of(draw) + shift);
                pole(&evaluator, &dispersion, &z, [0, 0, 0], found.value)
            };
            let (below, above) = (at(-0.05), at(0.05));
            let second = (above + below - found.value * 2.0) / (2.0 * 0.05 * 0.05);
            let measured = (second / (above - below) * 0.1).norm();
            let curvature = sensitivity.curvature.unwrap();
            if sensitivity.is_veering() {
                flagged += 1;
                assert!((curvature / measured - 1.0).abs() < 0.1, "{curvature} {measured}");
            } else {
                plain += 1;
                assert!(measured < 1.1 * LARGEST_CURVATURE, "{curvature} {measured}");
            }
        }
    }
    assert!(flagged > 3 && plain > 3, "{flagged} flagged, {plain} not");
}

/// Three keys on the elastic vehicle: two with a known adverse side, one with a best value inside.
fn small() -> String {
    let row = |path: &str, law: &str, apply: &str, level: &str| {
        format!(
            "[[row]]\npath = \"{path}\"\nlaw = {law}\napply = \"{apply}\"\nlevel = \"{level}\"\n\
             source = \"test\"\n"
        )
    };
    row(
        "structure.damping",
        "{ kind = \"uniform\", low = 0.0035, high = 0.0075 }",
        "absolute",
        "vehicle",
    ) + &row(
        "booster.*.thrust",
        "{ kind = \"normal\", mean = 1.0, sigma = 0.02 }",
        "scale",
        "vehicle",
    ) + &row(
        "booster.*.actuator.*.stiffness",
        "{ kind = \"normal\", mean = 1.0, sigma = 0.12 }",
        "scale",
        "vehicle",
    )
}

#[test]
fn on_a_small_vehicle_the_search_equals_an_exhaustive_grid_and_the_planted_corner_is_found() {
    let loaded = loaded();
    let vehicle = &loaded.vehicle.vehicle;
    let dispersion = dispersion::read("test", &small(), vehicle).unwrap();
    let jet = Variant {
        follower_thrust: false,
        nozzle_jet_damping: NozzleJet::Linear,
        ..variants(&loaded).swap_remove(0)
    };
    let definition = at_105(&loaded, vec![jet]);
    let sampler = Sampler::new(&dispersion, 1);
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false).unwrap();
    let aim = Aim { variant: 0, baseline: None, mode: 0, quantity: Quantity::DampingRatio };
    let plan = worst::Plan {
        aim,
        flight_times: vec![0],
        box_sigma: 2.5,
        radius_sigma: 2.5,
        corner_keys: 3,
        starts: Vec::new(),
    };
    let go = AtomicBool::new(false);
    let (cases, work) = worst::search(&evaluator, &dispersion, &definition, &plan, &go).unwrap();
    let of = |method: Method| cases.iter().find(|case| case.method == method).unwrap();
    assert_eq!(work.corners, 8);
    assert_eq!(work.converged, work.descents);

    let objective =
        Objective { evaluator: &evaluator, dispersion: &dispersion, aim, flight_time: 0 };
    let steps = 10_usize;
    let score = |i: usize| -2.5 + 5.0 * i as f64 / steps as f64;
    let side = steps + 1;
    let mut grid = Vec::new();
    for i in 0..side.pow(3) {
        let z = [score(i % side), score(i / side % side), score(i / side / side)];
        grid.push((objective.value(&z.map(Some)).unwrap(), z));
    }
    let range = {
        let ends = grid.iter().map(|(value, _)| *value);
        let (low, high) = (ends.clone().fold(f64::MAX, f64::min), ends.fold(f64::MIN, f64::max));
        high - low
    };
    let least = |inside: &dyn Fn(&[f64; 3]) -> bool| {
        let inside = grid.iter().filter(|(_, z)| inside(z));
        *inside.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    // The search is no worse than any point of the grid, and no better than a step of it explains.
    let (value, z) = least(&|_| true);
    let found = of(Method::Box);
    assert!(found.objective <= value + 1e-9, "{} {value}", found.objective);
    assert!(value - found.objective < 0.02 * range);
    for (found, z) in found.scores.iter().zip(z) {
        assert!((found.unwrap() - z).abs() <= 0.5 + 1e-9, "{:?} {z:?}", found);
    }
    let (value, _) = least(&|z| z.iter().map(|z| z * z).sum::<f64>() <= 2.5 * 2.5 + 1e-9);
    let found = of(Method::Ellipsoid);
    assert!(found.objective <= value + 1e-9 && value - found.objective < 0.1 * range);
    assert!(found.distance() <= 2.5 + 1e-9);

    // The planted corner: least structural damping. All corners are evaluated, the vertex is one of them.
    let damping = dispersion.draws().iter().position(|d| d.key.contains("damping")).unwrap();
    for method in [Method::Vertex, Method::Corners, Method::Box] {
        assert_eq!(of(method).scores[damping], Some(-2.5), "{method:?}");
    }
    assert!(of(Method::Corners).objective <= of(Method::Vertex).objective);
    // What was looked for is no draw.
    assert!(Method::Box.drawing().independent().is_err());
    // A case is the same when its values are fixed.
    let found = of(Method::Box);
    let fixed = Population { fixed: found.values.clone(), ..population("worst") };
    let again = Definition { populations: vec![fixed], ..definition.clone() };
    let evaluator = Evaluator::new(vehicle, &sampler, &again, false).unwrap();
    let record = evaluator.evaluate(0, 0);
    let poles = record.evaluations[0].outcome.as_ref().unwrap();
    assert!(poles.iter().any(|pole| [pole.value.re, pole.value.im] == found.pole));
}

#[test]
fn a_search_follows_its_mode_across_others_and_through_a_veering() {
    let loaded = loaded();
    let vehicle = &loaded.vehicle.vehicle;
    // The TVSE mode from 0.43 to 1.57 of its frequency: two symmetric modes below the nominal and one above
    // are crossed, at the upper end it veers away from an antisymmetric one.
    let text = row("modes.m006.frequency", "mode", "").replace("sigma = 0.01", "sigma = 0.19")
        + &row("booster.*.nozzle.cg", "vehicle", "").replace("sigma = 0.01", "sigma = 0.03");
    let dispersion = dispersion::read("test", &text, vehicle).unwrap();
    let elastic = variants(&loaded).swap_remove(0);
    let definition = at_105(&loaded, vec![elastic]);
    let sampler = Sampler::new(&dispersion, 1);
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false).unwrap();
    let aim = Aim { variant: 0, baseline: None, mode: 0, quantity: Quantity::DampingRatio };
    let starts = [-2.9, -1.5, 1.5, 2.9].map(|z| (0, vec![Some(z), Some(0.0)])).to_vec();
    let plan = worst::Plan {
        aim,
        flight_times: vec![0],
        box_sigma: 3.0,
        radius_sigma: 3.0,
        corner_keys: 2,
        starts,
    };
    let go = AtomicBool::new(false);
    let (cases, work) = worst::search(&evaluator, &dispersion, &definition, &plan, &go).unwrap();
    assert!(work.descents >= 10, "{work:?}");
    let objective =
        Objective { evaluator: &evaluator, dispersion: &dispersion, aim, flight_time: 0 };
    let score = |i: usize, steps: usize| -3.0 + 6.0 * i as f64 / steps as f64;
    let grid = (0..=120).flat_map(|i| (0..=4).map(move |j| [score(i, 120), score(j, 4)]));
    let values = grid.filter_map(|z| objective.value(&z.map(Some)).ok());
    let least = values.fold(f64::INFINITY, f64::min);
    let found = cases.iter().find(|case| case.method == Method::Box).unwrap();
    assert!(found.objective <= least + 1e-7, "{} {least}", found.objective);
    // What was followed is what the campaign's own rule finds there.
    for case in &cases {
        assert_eq!(objective.value(&case.scores).unwrap(), case.objective, "{case:?}");
    }
}

/// Two modes veer inside the box: from 1.567 to 1.61 times its frequency the TVSE mode exchanges its character with an
/// antisymmetric one, and both poles may be the mode. From the median, above that range, the descent follows the
/// upper branch, whose damping falls towards the lower end of the box; there the lower branch is the worse, and the
/// search must begin anew with it. Farther up the lower branch is the other mode, with less damping than the
/// mode has anywhere.
#[test]
fn a_search_begins_anew_at_a_mode_switch_and_does_not_report_the_other_mode() {
    let loaded = loaded();
    let vehicle = &loaded.vehicle.vehicle;
    let law = |mean: f64, sigma: f64| format!("mean = {mean:?}, sigma = {sigma:?}");
    let text = row("modes.m006.damping", "mode", "").replace(&law(1.0, 0.01), &law(1.0, 0.2))
        + &row("modes.m006.frequency", "mode", "").replace(&law(1.0, 0.01), &law(1.6135, 0.0155));
    let dispersion = dispersion::read("test", &text, vehicle).unwrap();
    let [damping, frequency] = ["damping", "frequency"]
        .map(|word| dispersion.draws().iter().position(|draw| draw.key.contains(word)).unwrap());
    let elastic = Variant {
        follower_thrust: false,
        case_jet_damping: false,
        nozzle_jet_damping: NozzleJet::Off,
        ..variants(&loaded).swap_remove(0)
    };
    let definition = at_105(&loaded, vec![elastic]);
    let sampler = Sampler::new(&dispersion, 1);
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false).unwrap();
    let aim = Aim { variant: 0, baseline: None, mode: 0, quantity: Quantity::DampingRatio };
    let plan = worst::Plan {
        aim,
        flight_times: vec![0],
        box_sigma: 3.0,
        radius_sigma: 3.0,
        corner_keys: 0,
        starts: Vec::new(),
    };
    let go = AtomicBool::new(false);
    let (cases, _) = worst::search(&evaluator, &dispersion, &definition, &plan, &go).unwrap();
    let found = cases.iter().find(|case| case.method == Method::Box).unwrap();
    assert_eq!(found.switches, 1, "{found:?}");

    // The grid, by the rule of the campaign: steps of 0.02 σ in frequency, over which the branch falls by less than
    // 3e-5, and the exchange ends between two of them.
    let objective =
        Objective { evaluator: &evaluator, dispersion: &dispersion, aim, flight_time: 0 };
    let at = |of_damping: f64, of_frequency: f64| {
        let mut z = [None; 2];
        (z[damping], z[frequency]) = (Some(of_damping), Some(of_frequency));
        z
    };
    let steps = (0..=300).map(|i| -3.0 + 0.02 * f64::from(i));
    let grid = steps.flat_map(|of_frequency| [-3.0, 0.0, 3.0].map(|z| at(z, of_frequency)));
    let values = grid.map(|z| objective.value(&z).unwrap());
    let least = values.fold(f64::INFINITY, f64::min);
    assert!(found.objective <= least + 1e-7, "{} {least}", found.objective);
    assert!(least - found.objective < 3e-5, "{} {least}", found.objective);
    assert_eq!(found.scores[damping], Some(-3.0));
    for case in &cases {
        assert_eq!(objective.value(&case.scores).unwrap(), case.objective, "{case:?}");
    }

    // The other mode: the branch found, followed on through the poles of the model to the upper end of the box.
    let places = || (0..=60).map(|i| f64::from(i) / 60.0);
    let from = found.scores[frequency].unwrap();
    let place = |share: f64| Population {
        fixed: dispersion.values_at(&at(-3.0, from + share * (3.0 - from))),
        ..population("beyond")
    };
    let beyond = Definition { populations: places().map(place).collect(), ..definition.clone() };
    let evaluator = Evaluator::new(vehicle, &sampler, &beyond, true).unwrap();
    let mut pole = Complex::new(found.pole[0], found.pole[1]);
    let mut named = pole;
    for index in 0..beyond.populations.len() {
        let record = evaluator.evaluate(index, 0);
        let poles = record.evaluations[0].outcome.as_ref().unwrap();
        let all = poles.iter().map(|found| found.value);
        let distance = |of: &Complex<f64>| (of - pole).norm();
        pole = all.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        named = poles.iter().find(|pole| pole.mode == Some(0)).unwrap().value;
    }
    let ratio = |pole: Complex<f64>| -pole.re / pole.norm();
    assert!(ratio(pole) < found.objective - 1e-4, "{} {}", ratio(pole), found.objective);
    assert!(ratio(named) > found.objective + 1e-3, "{} {}", ratio(named), found.objective);
}

#[test]
fn the_search_of_the_damping_that_feedback_adds_is_no_worse_than_a_grid() {
    let loaded = loaded();
    let vehicle = &loaded.vehicle.vehicle;
    let normal = |path: &str, level: &str, sigma: f64| {
        let sigma = format!("sigma = {sigma}");
        row(path, level, "").replace("sigma = 0.01", &sigma)
    };
    let text = normal("autopilot.path.*.gain", "vehicle", 0.1)
        + &normal("booster.*.actuator.*.stiffness", "vehicle", 0.1)
        + &normal("modes.*.frequency", "vehicle", 0.03);
    let dispersion = dispersion::read("test", &text, vehicle).unwrap();
    let named = |name: &str| {
        loaded.definition.variants.iter().find(|variant| variant.name == name).unwrap().clone()
    };
    let definition = at_105(&loaded, vec![named("open"), named("closed")]);
    let sampler = Sampler::new(&dispersion, 1);
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false).unwrap();
    let aim = Aim { variant: 1, baseline: Some(0), mode: 0, quantity: Quantity::DampingRatio };
    let plan = worst::Plan {
        aim,
        flight_times: vec![0],
        box_sigma: 2.0,
        radius_sigma: 2.0,
        corner_keys: 3,
        starts: Vec::new(),
    };
    let go = AtomicBool::new(false);
    let (cases, _) = worst::search(&evaluator, &dispersion, &definition, &plan, &go).unwrap();
    let objective =
        Objective { evaluator: &evaluator, dispersion: &dispersion, aim, flight_time: 0 };
    let score = |i: usize| -2.0 + i as f64;
    let mut least = f64::INFINITY;
    for i in 0..125 {
        let z = [score(i % 5), score(i / 5 % 5), score(i / 25)];
        // What feedback adds is the difference of the two variants on the same draws.
        let value = objective.value(&z.map(Some)).unwrap();
        let alone = |variant: usize| {
            let aim = Aim { variant, baseline: None, ..aim };
            let of =
                Objective { evaluator: &evaluator, dispersion: &dispersion, aim, flight_time: 0 };
            of.value(&z.map(Some)).unwrap()
        };
        if i % 31 == 0 {
            assert_eq!(value, alone(1) - alone(0));
        }
        least = least.min(value);
    }
    let found = cases.iter().find(|case| case.method == Method::Box).unwrap();
    assert!(found.objective <= least + 1e-9, "{} {least}", found.objective);
}

#[test]
fn a_run_stores_derivatives_and_its_worst_cases_are_found_replayed_and_added_to_another_run() {
    let study = Study::new();
    let sensitivity = "[sensitivity]\nvariants = [\"jet_damping\"]\ncases = 4\n";
    study.append("runs/smoke.toml", sensitivity);
    study.run("run", &[]);
    let modes = columns(&study.path("run/tables/modes.parquet"));
    let stored = modes.numbers.iter().find(|(name, _)| name.starts_with("ddr_")).unwrap().1;
    let texts = |name: &str| modes.texts[name].iter().map(|t| t.as_deref().unwrap());
    let covered = texts("variant").zip(&modes.numbers["case"]);
    for ((variant, case), by) in covered.zip(stored) {
        assert_eq!(by.is_some(), variant == "jet_damping" && case.unwrap() < 4.0);
    }
    // Replays compare the derivatives too.
    assert_eq!(study.said(&["replay", "run", "--case", "2"]).code, 0);

    let said = study.said(&["influence", "run", "--top", "3"]);
    assert_eq!(said.code, 0, "{said:?}");
    assert!(said.out.contains("jet_damping at 110 s, mode tvse: 4 cases"), "{}", said.out);

    let worst = ["worst", "run", "--variant", "jet_damping", "--corners", "3", "--starts", "1"];
    let said = study
        .said(&[&worst[..], &["--output", "fixed.toml", "--around", "3", "--hold", "2"]].concat());
    assert_eq!(said.code, 0, "{said:?}");
    assert!(said.out.contains("selected by their result"), "{}", said.out);
    for file in ["worst.csv", "parameters.csv", "fixed.toml", "worst.json"] {
        assert!(study.path(&format!("run/worst/jet_damping_tvse/{file}")).is_file(), "{file}");
    }
    let said = study.said(&["replay", "run", "--worst", "jet_damping_tvse_box"]);
    assert_eq!(said.code, 0, "{said:?}");
    assert!(said.out.contains("bit for bit"), "{}", said.out);
    let said = study.said(&["replay", "run", "--worst", "jet_damping_tvse_bax"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("did you mean `jet_damping_tvse_box`"), "{}", said.err);

    // A gate holds the worst case found against a limit; a search of another size was not made.
    let json = study.text("run/worst/jet_damping_tvse/worst.json");
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    let cases = found["cases"].as_array().unwrap();
    let of = |method: &str| cases.iter().find(|case| case["method"] == method).unwrap();
    let least = |methods: &[&str]| {
        let all = methods.iter().map(|method| of(method)["objective"].as_f64().unwrap());
        all.fold(f64::INFINITY, f64::min)
    };
    let in_box = least(&["vertex", "corners", "box"]);
    for (region, sigma, limit, code) in [
        ("box", 3.0, in_box - 1e-4, 0),
        ("box", 3.0, in_box + 1e-9, 1),
        ("ellipsoid", 3.0, least(&["ellipsoid"]) - 1e-4, 0),
        ("box", 4.0, -1.0, 3),
    ] {
        let gate = format!(
            "[[gate]]\nid = \"worst\"\nmetric = \"damping_ratio\"\nvariant = \"jet_damping\"\n\
             statistic = \"worst_on_worst\"\nregion = \"{region}\"\nsigma = {sigma}\n\
             at_least_1 = {limit:?}\nrationale = \"test\"\n"
        );
        std::fs::write(study.path("worst.gates.toml"), gate).unwrap();
        let said = study.said(&["gate", "run", "--gates", "worst.gates.toml"]);
        assert_eq!(said.code, code, "{region} {sigma} {limit}: {said:?}");
    }

    // The cases join another run, with Monte Carlo around one of them.
    let fixed = study.text("fixed.toml");
    let text = study.text("runs/smoke.toml").replacen(sensitivity, "", 1);
    std::fs::write(study.path("runs/next.toml"), text + &fixed).unwrap();
    let said = study.said(&["run", "runs/next.toml", "-o", "next"]);
    assert_eq!(said.code, 0, "{said:?}");
    let modes = columns(&study.path("next/tables/modes.parquet"));
    let of_box = of("box");
    let texts = |name: &str| modes.texts[name].iter().map(|t| t.as_deref().unwrap());
    let rows = texts("population").zip(texts("variant")).zip(&modes.numbers["pole_re_rad_s"]);
    let mut same = 0;
    for ((population, variant), re) in rows {
        let wanted = population == "jet_damping_tvse_box" && variant == "jet_damping";
        // Around the nominal vehicle of another run: the same to rounding, of 31 rad/s.
        let distance = re.unwrap() - of_box["pole"][0].as_f64().unwrap();
        same += usize::from(wanted && distance.abs() < 1e-9);
    }
    assert_eq!(same, 1, "the case of the other run is the one found");
    let around = texts("population").filter(|p| *p == "jet_damping_tvse_box_dispersed").count();
    assert_eq!(around, 3 * 2);
}
