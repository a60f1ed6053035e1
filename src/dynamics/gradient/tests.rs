//! The form against the matrices, and its gradient against differences of them.

use super::*;
use crate::dynamics::aerodynamics::{AerodynamicPlant, Entry};
use crate::dynamics::attached::rigid_motion;
use crate::dynamics::{
    Attachment, DrawnAerodynamics, DrawnBody, DrawnEngine, DrawnTank, Layout, Model, NozzleJet,
    TankAttachment,
};
use crate::vehicle::MassProperties;
use nalgebra::{Matrix3, Matrix3x2};

const MODES: usize = 3;

/// A number that looks random, between −1 and 1.
fn odd(seed: usize) -> f64 {
    (12.9898 * seed as f64 + 0.7).sin()
}

fn odd_vector(seed: usize) -> Vector3<f64> {
    Vector3::new(odd(seed), odd(seed + 1000), odd(seed + 2000))
}

/// Shapes or slopes of a point: rigid columns if free, then the modes.
fn motion(rigid: bool, at: Vector3<f64>, seed: usize) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let rigid = rigid_motion(&at).into_iter().filter(|_| rigid);
    let modes = (0..MODES).map(|k| (odd_vector(seed + k) * 2e-3, odd_vector(seed + 50 + k) * 3e-4));
    rigid.chain(modes).unzip()
}

/// Two canted engines, the second locked, two tanks, and air; nothing is symmetric.
fn plant(rigid: bool, in_modes: bool) -> Plant {
    let engines =
        [("a.1".to_owned(), ["rock", "tilt"], true), ("a.2".to_owned(), ["rock", "tilt"], false)];
    let mut layout =
        Layout::new(["m1", "m2", "m3"], engines).with_tanks([("lox", true), ("lh2", false)]);
    if rigid {
        layout = layout.with_rigid_body();
    }
    let body = layout.body().end;
    let attachment = |number: usize| {
        let axis = Vector3::new(0.97, 0.1 * odd(number), 0.2 * odd(number + 3)).normalize();
        let first = axis.cross(&odd_vector(number + 7)).normalize();
        let at = Vector3::new(30.0, 6.0 * odd(number + 11), 3.0 * odd(number + 12));
        let (shape, slope) = motion(rigid, at, 100 * (number + 1));
        Attachment {
            thrust_direction: -axis,
            axes: Matrix3x2::from_columns(&[first, axis.cross(&first)]),
            shape,
            slope,
            case_per_flow: (0..body * body).map(|i| 1e-5 * odd(i + 31 * number)).collect(),
            in_modes: in_modes && number == 0,
            actuators: 0,
        }
    };
    let tank = |number: usize| {
        let at = Vector3::new(-12.0, 0.4 * odd(number + 21), 0.3 * odd(number + 22));
        let (shape, slope) = motion(rigid, at, 700 + 100 * number);
        let axes = Matrix3x2::from_columns(&[Vector3::y(), Vector3::z()]);
        TankAttachment { axes, shape, slope, in_modes: in_modes && number == 0 }
    };
    let entry = |i: usize| Entry {
        row: (3 * i) % body,
        column: (5 * i + 1) % body,
        stiffness: 1e-4 * odd(i),
        damping: 1e-5 * odd(i + 9),
    };
    Plant {
        body: MassProperties {
            mass_kg: 4.0e5,
            cg_m: Vector3::new(60.0, 0.1, -0.2),
            inertia_kg_m2: Matrix3::new(2e7, 1e6, -2e6, 1e6, 3e8, 3e6, -2e6, 3e6, 3.1e8),
        },
        attachments: vec![attachment(0), attachment(1)],
        tanks: vec![tank(0), tank(1)],
        aerodynamics: Some(AerodynamicPlant {
            reference_m: Vector3::new(60.0, 0.1, -0.2),
            area_m2: 50.0,
            length_m: 8.0,
            speed_m_s: 900.0,
            entries: (0..4).map(entry).collect(),
        }),
        layout,
        servo: None,
    }
}

fn drawn() -> DrawnVehicle {
    let engine = |number: usize| DrawnEngine {
        thrust_n: 1.2e7,
        mass_flow_kg_s: 4700.0,
        mass_kg: 7500.0,
        cg_m: 0.68,
        inertia_kg_m2: 2.2e4,
        axial_inertia_kg_m2: 1.5e4,
        length_m: 4.0,
        actuators: vec![[DrawnActuator::spring(3.7e7, 5.6e5), DrawnActuator::spring(3.9e7, 5.1e5)]],
        shape_gain: (0..MODES).map(|k| 1.0 + 0.2 * odd(k + number)).collect(),
        slope_gain: (0..MODES).map(|k| 1.0 + 0.2 * odd(k + number + 5)).collect(),
    };
    let tank = DrawnTank { mass_kg: 3.0e4, frequency_rad_s: 3.1, damping_ratio: 0.02 };
    DrawnVehicle {
        body: DrawnBody {
            frequency_rad_s: vec![11.0, 32.0, 39.0],
            damping_ratio: vec![0.05, 0.04, 0.06],
            inertia_gain: [0.9, 1.1, 1.05],
        },
        engines: vec![engine(0), engine(1)],
        tanks: vec![tank, tank],
        aerodynamics: Some(DrawnAerodynamics {
            dynamic_pressure_pa: 2.0e4,
            normal_force_slope_1_rad: 4.0,
            center_of_pressure_x_m: 40.0,
            axial_force: 0.6,
            pitch_damping: -30.0,
            roll_damping: -0.5,
        }),
        ..DrawnVehicle::default()
    }
}

fn effects(follower_thrust: bool, nozzle_jet_damping: NozzleJet) -> Effects {
    Effects {
        thrust: 0.9,
        case_jet_damping: true,
        nozzle_jet_damping,
        follower_thrust,
        aerodynamics: 0.8,
        feedback: 1.0,
    }
}

const S: C = C::new(-1.3, 33.0);

/// Two vectors scaled so that every coordinate has an equal say.
fn vectors(model: &Model) -> [Vec<C>; 2] {
    let scale = |i: usize| {
        let diagonal = S * S * model.mass[(i, i)] + S * model.damping[(i, i)];
        (diagonal + model.stiffness[(i, i)]).norm().sqrt().recip()
    };
    let vector = |seed: usize| {
        let entry = |i: usize| C::new(odd(i + seed), odd(i + seed + 40)) * scale(i);
        (0..model.coordinates()).map(entry).collect()
    };
    [vector(300), vector(400)]
}

/// ȳᵀ L x from the matrices.
fn form(plant: &Plant, drawn: &DrawnVehicle, effects: &Effects, [left, right]: &[Vec<C>; 2]) -> C {
    let mut model = Model::zeros(plant.layout.coordinates());
    plant.assemble(drawn, effects, &mut model);
    let mut sum = C::ZERO;
    for (column, x) in right.iter().enumerate() {
        for (row, y) in left.iter().enumerate() {
            let at = (row, column);
            let entry = S * S * model.mass[at] + S * model.damping[at] + model.stiffness[at];
            sum += y * entry * x;
        }
    }
    sum
}

type Number = fn(&mut DrawnVehicle) -> &mut f64;
type Entry3 = (&'static str, Number, fn(&Gradient) -> C);

/// Every drawn number that is no actuator's, with its gradient.
const NUMBERS: &[Entry3] = &[
    ("frequency", |d| &mut d.body.frequency_rad_s[1], |g| g.frequency_rad_s[1]),
    ("damping", |d| &mut d.body.damping_ratio[2], |g| g.damping_ratio[2]),
    ("thrust", |d| &mut d.engines[0].thrust_n, |g| g.engines[0].thrust_n),
    ("thrust, locked", |d| &mut d.engines[1].thrust_n, |g| g.engines[1].thrust_n),
    ("flow", |d| &mut d.engines[0].mass_flow_kg_s, |g| g.engines[0].mass_flow_kg_s),
    ("mass", |d| &mut d.engines[0].mass_kg, |g| g.engines[0].mass_kg),
    ("mass, locked", |d| &mut d.engines[1].mass_kg, |g| g.engines[1].mass_kg),
    ("cg", |d| &mut d.engines[0].cg_m, |g| g.engines[0].cg_m),
    ("cg, locked", |d| &mut d.engines[1].cg_m, |g| g.engines[1].cg_m),
    ("inertia", |d| &mut d.engines[0].inertia_kg_m2, |g| g.engines[0].inertia_kg_m2),
    ("axial", |d| &mut d.engines[0].axial_inertia_kg_m2, |g| g.engines[0].axial_inertia_kg_m2),
    ("length", |d| &mut d.engines[0].length_m, |g| g.engines[0].length_m),
    ("shape", |d| &mut d.engines[0].shape_gain[1], |g| g.engines[0].shape_gain[1]),
    ("slope", |d| &mut d.engines[0].slope_gain[2], |g| g.engines[0].slope_gain[2]),
    ("shape, locked", |d| &mut d.engines[1].shape_gain[0], |g| g.engines[1].shape_gain[0]),
    ("slope, locked", |d| &mut d.engines[1].slope_gain[0], |g| g.engines[1].slope_gain[0]),
    ("slosh mass", |d| &mut d.tanks[0].mass_kg, |g| g.tanks[0].mass_kg),
    ("slosh mass, locked", |d| &mut d.tanks[1].mass_kg, |g| g.tanks[1].mass_kg),
    ("slosh frequency", |d| &mut d.tanks[0].frequency_rad_s, |g| g.tanks[0].frequency_rad_s),
    ("slosh damping", |d| &mut d.tanks[0].damping_ratio, |g| g.tanks[0].damping_ratio),
];

/// Those that are felt with a free rigid body.
const RIGID_NUMBERS: &[Entry3] = &[
    ("roll inertia", |d| &mut d.body.inertia_gain[0], |g| g.inertia_gain[0]),
    ("pitch inertia", |d| &mut d.body.inertia_gain[1], |g| g.inertia_gain[1]),
    ("yaw inertia", |d| &mut d.body.inertia_gain[2], |g| g.inertia_gain[2]),
    ("pressure", |d| &mut air(d).dynamic_pressure_pa, |g| air_of(g).dynamic_pressure_pa),
    ("slope", |d| &mut air(d).normal_force_slope_1_rad, |g| air_of(g).normal_force_slope_1_rad),
    ("station", |d| &mut air(d).center_of_pressure_x_m, |g| air_of(g).center_of_pressure_x_m),
    ("axial force", |d| &mut air(d).axial_force, |g| air_of(g).axial_force),
    ("pitch damping", |d| &mut air(d).pitch_damping, |g| air_of(g).pitch_damping),
    ("roll damping", |d| &mut air(d).roll_damping, |g| air_of(g).roll_damping),
];

fn air(drawn: &mut DrawnVehicle) -> &mut DrawnAerodynamics {
    drawn.aerodynamics.as_mut().unwrap()
}

fn air_of(gradient: &Gradient) -> &AerodynamicGradient {
    gradient.aerodynamics.as_ref().unwrap()
}

/// Every combination of a free rigid body, integrated masses, follower thrust and jet damping.
fn variants() -> impl Iterator<Item = (Plant, Effects)> {
    let jets = [NozzleJet::Off, NozzleJet::Linear, NozzleJet::RigidNozzle];
    (0..24).map(move |i| {
        let plant = plant(i % 2 == 1, i / 2 % 2 == 1);
        (plant, effects(i / 4 % 2 == 1, jets[i / 8]))
    })
}

fn at(plant: &Plant, drawn: &DrawnVehicle, effects: &Effects) -> [Vec<C>; 2] {
    let mut model = Model::zeros(plant.layout.coordinates());
    plant.assemble(drawn, effects, &mut model);
    vectors(&model)
}

/// Every engine is asked for.
const ALL: [bool; 8] = [true; 8];

#[test]
fn the_parts_of_all_effects_add_up_to_the_form_of_the_matrices() {
    let drawn = drawn();
    for (plant, effects) in variants() {
        let pair = at(&plant, &drawn, &effects);
        let vectors = Vectors { s: S, left: &pair[0], right: &pair[1] };
        let value =
            plant.gradient(&drawn, &effects, &vectors, &ALL[..plant.attachments.len()]).value;
        let expected = form(&plant, &drawn, &effects, &pair);
        // Every coordinate contributes of the order of one.
        assert!((value - expected).norm() < 1e-12 * pair[0].len() as f64, "{value} {expected}");
    }
}

#[test]
fn the_gradient_by_every_number_is_what_differences_of_the_matrices_say() {
    for (plant, effects) in variants() {
        let drawn = drawn();
        let pair = at(&plant, &drawn, &effects);
        let vectors = Vectors { s: S, left: &pair[0], right: &pair[1] };
        let gradient = plant.gradient(&drawn, &effects, &vectors, &ALL[..plant.attachments.len()]);
        let rigid = !plant.layout.rotation().is_empty();
        let numbers = NUMBERS.iter().chain(RIGID_NUMBERS.iter().filter(|_| rigid));
        let mut felt = 0;
        for (name, number, by) in numbers {
            let value = *number(&mut drawn.clone());
            // The form is of the second degree, but for the mean acceleration F/M: the error of the
            // difference is of the order of the square of the step there, and ε over the step.
            let step = 1e-4 * value;
            let shifted = |step: f64| {
                let mut drawn = drawn.clone();
                *number(&mut drawn) += step;
                form(&plant, &drawn, &effects, &pair)
            };
            let expected = (shifted(step) - shifted(-step)) * (value / (2.0 * step));
            let found = by(&gradient) * value;
            assert!((found - expected).norm() < 2e-9, "{name}: {found} is not {expected}");
            felt += usize::from(found.norm() > 1e-7);
        }
        // A tolerance of two parts in 1e9 would pass what is not felt: nearly all are.
        let all = NUMBERS.len() + if rigid { RIGID_NUMBERS.len() } else { 0 };
        assert!(felt + 5 >= all, "{felt} of {all}");
    }
}

#[test]
fn an_actuator_has_its_spring_and_damper_in_the_form() {
    let (plant, effects) = (plant(true, false), effects(false, NozzleJet::Linear));
    let drawn = drawn();
    let pair = at(&plant, &drawn, &effects);
    let vectors = Vectors { s: S, left: &pair[0], right: &pair[1] };
    let gradient = plant.gradient(&drawn, &effects, &vectors, &ALL[..plant.attachments.len()]);
    let other = DrawnActuator::spring(3.0e7, 7.0e5);
    let mut changed = drawn.clone();
    changed.engines[0].actuators[0][1] = other.clone();
    let expected = form(&plant, &changed, &effects, &pair) - form(&plant, &drawn, &effects, &pair);
    let found = gradient.actuator(0, 1, &other)
        - gradient.actuator(0, 1, &drawn.engines[0].actuators[0][1]);
    assert!((found - expected).norm() < 1e-11, "{found} is not {expected}");
    assert_eq!(gradient.actuator(1, 0, &other), C::ZERO, "a locked engine feels none");
}
