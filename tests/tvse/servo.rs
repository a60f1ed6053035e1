//! Actuators and autopilot on the whole reference vehicle: the closed model against the open one with
//! the exact feedback around it, and special cases that must agree.

use crate::study::{Said, Study};
use nalgebra::{Complex, DMatrix};
use tvse::campaign::Evaluator;
use tvse::dispersion::Sampler;
use tvse::dynamics::{Model, Plant};
use tvse::io::scenario::{self, Reach};
use tvse::modal::realisation::Realisation;

/// Attitude and rate in three axes, a path behind others, a loop of paths, notches and a lag.
const AUTOPILOT: &str = r#"
[autopilot]
delay_s = 0.06
delay_order = 12

[[autopilot.sensor]]
name = "imu"
kind = "attitude"
grid = "gyro.intertank"

[[autopilot.sensor]]
name = "aft"
kind = "rate-gyro"
grid = "gyro.core.aft"
scale = 1.02

[[autopilot.path]]
name = "roll_rate"
input = { "gyro.aft.roll" = 0.7, "gyro.aft.pitch" = 0.01 }
gain = 0.8
filter = [{ kind = "notch", frequency_hz = 9.0, zero_damping = 0.1, pole_damping = 0.6 }]

[[autopilot.path]]
name = "roll"
input = { "path.roll_rate" = 1.0, "attitude.imu.roll" = 0.4, "path.roll_back" = 0.2 }
axis = "roll"
filter = [{ kind = "lag", frequency_hz = 8.0 }]

[[autopilot.path]]
name = "roll_back"
input = { "path.roll" = 1.0 }

[[autopilot.path]]
name = "pitch"
input = { "attitude.imu.pitch" = 0.5, "gyro.aft.pitch" = 0.6 }
axis = "pitch"
filter = [
    { kind = "bending", zero_hz = 1.9, zero_damping = 0.05, pole_hz = 2.5, pole_damping = 0.7 },
    { kind = "lead-lag", zero_hz = 1.0, pole_hz = 4.0 },
]

[[autopilot.path]]
name = "yaw"
input = { "attitude.imu.yaw" = 0.5, "gyro.aft.yaw" = 0.6 }
axis = "yaw"
filter = [{ kind = "delay", delay_s = 0.01 }]

[autopilot.allocation]
gimbals = ["booster.*.*"]
"#;

/// The study with this autopilot and these variants; thrust, slope and jets are the same in all.
fn study(variants: &[(&str, &str)]) -> Study {
    let study = Study::new();
    let vehicle = study.text("vehicles/sls-like/vehicle.toml");
    let vehicle = vehicle.split("\n[autopilot]").next().unwrap();
    write(&study, "vehicles/sls-like/vehicle.toml", &format!("{vehicle}\n{AUTOPILOT}"));
    let run = study.text("runs/smoke.toml");
    let head = run.split("[[variant]]").next().unwrap();
    let head: Vec<&str> = head.lines().filter(|l| !l.starts_with("gates")).collect();
    let of = |(name, keys): &(&str, &str)| {
        format!(
            "\n[[variant]]\nname = \"{name}\"\ncase_jet_damping = true\nnozzle_jet_damping = \"equation-13\"\n{keys}\n"
        )
    };
    let variants: String = variants.iter().map(of).collect();
    write(&study, "runs/smoke.toml", &format!("{}\n{variants}", head.join("\n")));
    study
}

fn write(study: &Study, name: &str, text: &str) {
    std::fs::write(study.path(name), text).unwrap();
}

/// Plant, model and realisation of case 1 in each variant at the first flight time.
struct Seen {
    plant: Plant,
    model: Model,
    realisation: Realisation,
    drawn: tvse::dynamics::DrawnVehicle,
}

fn seen(study: &Study) -> Vec<Seen> {
    let loaded = scenario::load(&study.path("runs/smoke.toml"), Reach::Study).unwrap();
    let mut definition = loaded.definition.clone();
    definition.modes.clear();
    definition.flight_times_s.truncate(1);
    let sampler = Sampler::new(&loaded.dispersion, definition.seed);
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false).unwrap();
    let mut all = Vec::new();
    evaluator.visit(1, 1, |view| {
        assert!(view.evaluation.outcome.is_ok(), "{:?}", view.evaluation.outcome);
        all.push(Seen {
            plant: view.plant.clone(),
            model: view.model.clone(),
            realisation: Realisation::of(view.plant, view.drawn, view.model).unwrap(),
            drawn: view.drawn.clone(),
        });
    });
    all
}

/// Rows (or columns) of these names.
fn index(names: &[String], wanted: &[String]) -> Vec<usize> {
    wanted.iter().map(|w| names.iter().position(|n| n == w).unwrap()).collect()
}

fn part(
    seen: &Seen,
    outputs: &[String],
    inputs: &[String],
    s: Complex<f64>,
) -> DMatrix<Complex<f64>> {
    let response = seen.realisation.system.response(s).unwrap();
    let rows = index(&seen.realisation.outputs, outputs);
    let columns = index(&seen.realisation.inputs, inputs);
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| response[(rows[i], columns[j])])
}

#[test]
fn closing_the_model_is_closing_the_loop_around_the_open_one() {
    let more =
        "rigid_body = true\nslosh = true\naerodynamics = true\nactuators = \"electrohydraulic\"";
    let closed = format!("{more}\nfeedback = \"closed\"");
    let inverted = format!("{more}\nfeedback = \"inverted\"");
    let all = seen(&study(&[("open", more), ("closed", &closed), ("inverted", &inverted)]));
    let servo = all[0].plant.servo.as_ref().unwrap();
    let (autopilot, law) = servo.autopilot().unwrap();
    let signals: Vec<String> =
        law.signals().iter().map(|&(i, axis)| autopilot.sensors[i].signal(axis)).collect();
    let commands = ["roll", "pitch", "yaw"].map(|a| format!("command.{a}"));
    let feedbacks = ["roll", "pitch", "yaw"].map(|a| format!("feedback.{a}"));
    assert_eq!(signals.len(), 6);
    let states = |seen: &Seen| seen.model.coordinates() - seen.model.second_order;
    // Two booster nozzles with two actuators of two states; filters and delays besides.
    assert_eq!((states(&all[0]), states(&all[1])), (8, 8 + 2 + 1 + 2 + 1 + 12 + 3 * 12));
    for omega in [0.5, 2.0, 7.0, 33.0] {
        let s = Complex::new(0.01, omega);
        let p = part(&all[0], &signals, &commands, s);
        let f = law.response(autopilot, &all[0].drawn.autopilot, s).unwrap();
        for (seen, sign) in [(&all[1], 1.0), (&all[2], -1.0)] {
            let whole = DMatrix::identity(6, 6) + &p * &f * Complex::from(sign);
            let expected = whole.lu().solve(&p).unwrap();
            let found = part(seen, &signals, &commands, s);
            let error = (&found - &expected).norm() / expected.norm();
            assert!(error < 1e-7, "{omega} rad/s: {error}");
            let feedback = part(seen, &feedbacks, &commands, s);
            assert!((feedback - &f * expected).norm() < 1e-7 * (f.norm() * p.norm()));
        }
    }
}

#[test]
fn the_response_of_the_realisation_is_that_of_the_model() {
    let closed = "rigid_body = true\naerodynamics = true\nfeedback = \"closed\"";
    let all = seen(&study(&[("closed", closed)]));
    let Seen { plant, model, realisation, drawn } = &all[0];
    let servo = plant.servo.as_ref().unwrap();
    let composite = servo.compose(drawn);
    let force = servo.inputs(&composite, &plant.layout).map(|x| Complex::new(x, 0.0));
    let s = Complex::new(-0.1, 12.0);
    let size = model.coordinates();
    let pencil = DMatrix::from_fn(size, size, |i, j| {
        s * s * model.mass[(i, j)] + s * model.damping[(i, j)] + model.stiffness[(i, j)]
    });
    let x = pencil.lu().solve(&force).unwrap();
    let theta = plant.layout.find("theta.booster.left.rock").unwrap();
    let found = part(&all[0], &["theta.booster.left.rock".into()], &realisation.inputs[..3], s);
    for axis in 0..3 {
        assert!((x[(theta, axis)] - found[(0, axis)]).norm() < 1e-8 * found.norm());
    }
}

#[test]
fn a_spring_in_a_state_space_actuator_is_the_second_order_actuator() {
    let study = study(&[("own", ""), ("same", "actuators = \"matrices\"")]);
    let inertia: f64 = 24_000.0;
    let (stiffness, ratio) = (3.76e7, 0.30);
    let damping = 2.0 * ratio * (inertia * stiffness).sqrt();
    let mut vehicle = study.text("vehicles/sls-like/vehicle.toml");
    for side in ["left", "right"] {
        let marker = format!("attach_grid = \"booster.{side}.tilt\"");
        let at = vehicle.find(&marker).unwrap();
        let end = at + vehicle[at..].find("\n\n").unwrap();
        let pair: String = ["one", "two"]
            .iter()
            .map(|name| {
                format!(
                    "\n[[engine.actuator]]\nname = \"{name}\"\nset = \"matrices\"\nkind = \"state-space\"\nbearing = \"included\"\n\
                     state_space = {{ a = [], b = [], c = [], d = [{stiffness:?}, -{stiffness:?}, -{damping:?}] }}\n"
                )
            })
            .collect();
        vehicle.insert_str(end + 1, &pair);
    }
    write(&study, "vehicles/sls-like/vehicle.toml", &vehicle);
    // The own actuators are dispersed, the matrices are not.
    let dispersion = study.text("dispersions/reference.toml");
    let rows: Vec<&str> = dispersion.split("[[row]]").collect();
    let kept: Vec<&str> = rows.into_iter().filter(|row| !row.contains(".actuator.")).collect();
    write(&study, "dispersions/reference.toml", &kept.join("[[row]]"));
    let all = seen(&study);
    let difference = (0..all[0].model.coordinates())
        .flat_map(|i| (0..all[0].model.coordinates()).map(move |j| (i, j)))
        .map(|at| {
            let (a, b) = (&all[0].model, &all[1].model);
            ((a.stiffness[at] - b.stiffness[at]) / stiffness)
                .abs()
                .max((a.damping[at] - b.damping[at]).abs() / damping)
        })
        .fold(0.0, f64::max);
    assert!(difference < 4.0 * f64::EPSILON, "{difference}");
}

#[test]
fn a_model_is_written_with_its_names_and_wrong_requests_are_refused() {
    let study = study(&[("closed", "feedback = \"closed\"")]);
    let model = |more: &[&str]| -> Said {
        let mut words = vec!["model", "runs/smoke.toml", "--variant", "closed", "-o", "out"];
        words.extend(more);
        study.said(&words)
    };
    let done = model(&["--time", "110", "--case", "2", "--format", "csv"]);
    assert_eq!(done.code, 0, "{}", done.err);
    let names = study.text("out/names.csv");
    for line in ["input,command.roll,0", "input,load.booster.left.rock,", "output,gyro.aft.roll,"] {
        assert!(names.contains(line), "{line} in {names}");
    }
    assert!(names.contains("state,feedback.yaw.delay.12,"), "{names}");
    assert!(study.text("out/state_space.csv").starts_with("matrix,row_name,column_name,row"));
    for (more, told) in [
        (vec!["--time", "110"], "out: found something that exists"),
        (vec!["--time", "109"], "--time: found 109"),
        (vec!["--time", "110", "--case", "99"], "--case: found 99"),
        (vec!["--time", "110", "--population", "nomial"], "did you mean `nominal`"),
    ] {
        let refused = model(&more);
        assert_eq!(refused.code, 2);
        assert!(refused.err.contains(told), "{}", refused.err);
    }
}

#[test]
fn variants_name_sets_and_loops_that_exist() {
    let study = study(&[("a", "actuators = \"electrohydaulic\"")]);
    let refused = study.said(&["check", "runs/smoke.toml"]);
    assert_eq!(refused.code, 2);
    let told =
        "variant[0].actuators: found \"electrohydaulic\"; allowed: did you mean `electrohydraulic`";
    assert!(refused.err.contains(told), "{}", refused.err);
    study.edit("runs/smoke.toml", "actuators = \"electrohydaulic\"", "feedback = \"closed\"");
    study.edit("runs/smoke.toml", "gimballed = [\"booster.*\"]", "gimballed = [\"core.*\"]");
    let refused = study.said(&["check", "runs/smoke.toml"]);
    assert!(refused.err.contains("variant[0].feedback: found a loop through the locked engine"));
}
