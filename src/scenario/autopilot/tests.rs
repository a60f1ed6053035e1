//! Tests of the autopilot in a vehicle file: a good one, and everything that can be wrong with it.

use super::super::fixture::{VEHICLE, modal};
use super::super::{table, vehicle, vehicle_file::VehicleFile};
use super::*;
use crate::problem::Problems;
use crate::vehicle::Vehicle;

const AUTOPILOT: &str = r#"
[autopilot]
delay_s = 0.06
delay_order = 3

[[autopilot.sensor]]
name = "imu"
kind = "attitude"
grid = "core.1.gimbal"

[[autopilot.sensor]]
name = "aft"
kind = "rate-gyro"
grid = "core.2.gimbal"
scale = 1.01

[[autopilot.path]]
name = "roll_attitude"
input = { "attitude.imu.roll" = 1.0 }
gain = 0.4
filter = [{ kind = "lag", frequency_hz = 2.0 }]

[[autopilot.path]]
name = "roll_rate"
input = { "gyro.aft.roll" = 1.0 }
filter = [
    { kind = "notch", name = "tvse", frequency_hz = 5.2, zero_damping = 0.1, pole_damping = 0.6 },
    { kind = "transfer-function", numerator = [1.0, 1.0], denominator = [0.01, 0.3, 1.0] },
]

[[autopilot.path]]
name = "roll"
input = { "path.roll_attitude" = 1.0, "path.roll_rate" = 0.8 }
axis = "roll"
filter = [{ kind = "section", numerator = [0.0, 0.0, 1.0], denominator = [0.001, 0.05, 1.0] }]

[autopilot.allocation]
gimbals = ["booster.*.*"]
"#;

/// The reference vehicle with the autopilot above in the place of its own.
fn text() -> String {
    format!("{}\n{AUTOPILOT}", VEHICLE.split("\n[autopilot]").next().unwrap())
}

fn read(text: &str) -> Result<Vehicle, Problems> {
    let (file, findings) = table::read::<VehicleFile>("vehicle.toml", text)?;
    vehicle::resolve(&file, Some(modal()), findings).map(|resolved| resolved.vehicle)
}

/// The one problem after an edit: its key, and what is found and allowed.
fn problem(from: &str, to: &str) -> (String, String) {
    assert!(text().contains(from), "{from}");
    let list = read(&text().replacen(from, to, 1)).expect_err("a problem").0;
    assert_eq!(list.len(), 1, "{list:?}");
    (list[0].key.clone(), format!("{} | {}", list[0].found, list[0].allowed))
}

#[test]
fn an_autopilot_is_read_as_it_stands() {
    let autopilot = read(&text()).unwrap().autopilot.unwrap();
    assert_eq!((autopilot.delay_s, autopilot.delay_order), (0.06, 3));
    assert_eq!(autopilot.sensors[1].signal(Axis::Yaw), "gyro.aft.yaw");
    assert_eq!(autopilot.sensors[1].scale, 1.01);
    let [attitude, rate, roll] = autopilot.paths.as_slice() else { panic!("three paths") };
    assert_eq!((attitude.axis, roll.axis), (None, Some(Axis::Roll)));
    assert_eq!(attitude.gain, 0.4);
    let names: Vec<&str> = rate.filters.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["tvse", "2"]);
    assert_eq!(rate.filters.iter().map(|f| f.kind.order()).sum::<usize>(), 4);
    // Roll by least squares: each booster turns so that its exhaust moves along ∓z.
    let allocation = &autopilot.allocation;
    assert_eq!(allocation.gimbals, [(0, 0), (0, 1), (1, 0), (1, 1)]);
    let greatest =
        |axis: usize| allocation.matrix.iter().map(|r| r[axis].abs()).fold(0.0, f64::max);
    assert!((0..3).all(|axis| (greatest(axis) - 1.0).abs() < 1e-15));
}

#[test]
fn a_given_matrix_is_taken_and_one_of_the_wrong_size_refused() {
    let with = |rows: usize| {
        let rows = vec!["[0.1, 0.2, 0.3]"; rows].join(", ");
        let new = format!("gimbals = [\"booster.*.*\"]\nmatrix = [{rows}]");
        text().replacen("gimbals = [\"booster.*.*\"]", &new, 1)
    };
    let vehicle = read(&with(4)).unwrap();
    assert_eq!(vehicle.autopilot.unwrap().allocation.matrix, vec![[0.1, 0.2, 0.3]; 4]);
    let list = read(&with(3)).unwrap_err().0;
    assert_eq!((list.len(), list[0].key.as_str()), (1, "autopilot.allocation.matrix"));
    assert!(list[0].allowed.contains("booster.right.tilt"), "{}", list[0].allowed);
    let wide = with(4).replacen("[0.1, 0.2, 0.3]", "[0.1, 0.2]", 1);
    let list = read(&wide).unwrap_err().0;
    assert_eq!(list[0].key, "autopilot.allocation.matrix[0]");
}

#[test]
fn what_is_wrong_with_an_autopilot_is_said_with_its_key() {
    for (from, to, key, told) in [
        ("delay_s = 0.06", "delay_s = -0.06", "autopilot.delay_s", "≥ 0"),
        ("delay_order = 3", "delay_order = 0", "autopilot.delay_order", "≥ 1"),
        (
            "grid = \"core.1.gimbal\"\n\n[[autopilot.sensor]]",
            "grid = \"core.1.gimball\"\n\n[[autopilot.sensor]]",
            "autopilot.sensor[0].grid",
            "did you mean `core.1.gimbal`",
        ),
        (
            "[[autopilot.path]]",
            "[[autopilot.sensor]]\nname = \"aft\"\nkind = \"attitude\"\ngrid = \"core.1.rock\"\n\n[[autopilot.path]]",
            "autopilot.sensor[2].name",
            "again",
        ),
        (
            "\"gyro.aft.roll\" = 1.0",
            "\"gyro.aft.rol\" = 1.0",
            "autopilot.path[1].input",
            "did you mean `gyro.aft.roll`",
        ),
        ("{ \"attitude.imu.roll\" = 1.0 }", "{}", "autopilot.path[0].input", "at least one signal"),
        (
            "numerator = [1.0, 1.0]",
            "numerator = [1.0, 0.0, 1.0, 1.0]",
            "autopilot.path[1].filter[1]",
            "degree 3 over a denominator of degree 2",
        ),
        (
            "denominator = [0.01, 0.3, 1.0]",
            "denominator = [0.01, -0.3, 1.0]",
            "autopilot.path[1].filter[1].denominator",
            "a pole at",
        ),
        (
            "denominator = [0.01, 0.3, 1.0]",
            "denominator = [1.0, 0.0, 0.0]",
            "autopilot.path[1].filter[1].denominator",
            "2 poles at zero",
        ),
        (
            "pole_damping = 0.6",
            "pole_damping = 0.0",
            "autopilot.path[1].filter[0].pole_damping",
            "> 0",
        ),
        (
            "kind = \"lag\"",
            "kind = \"lagg\"",
            "autopilot.path[0].filter[0].kind",
            "did you mean `lag`",
        ),
        (
            "kind = \"notch\", name = \"tvse\"",
            "kind = \"notch\", name = \"2\"",
            "autopilot.path[1].filter[1].name",
            "again",
        ),
        ("axis = \"roll\"", "axis = \"rol\"", "autopilot.path[2].axis", "did you mean `roll`"),
        ("axis = \"roll\"\n", "", "autopilot.path[2].axis", "which no path reads"),
        ("\"path.roll_rate\" = 0.8", "\"path.roll_rate\" = 0.8, \"path.roll\" = 0.1", "", ""),
        (
            "gimbals = [\"booster.*.*\"]",
            "gimbals = [\"booster.left.rok\"]",
            "autopilot.allocation.gimbals[0]",
            "did you mean `booster.left.rock`",
        ),
        (
            "gimbals = [\"booster.*.*\"]",
            "gimbals = [\"booster.left.*\"]",
            "autopilot.allocation.gimbals",
            "authority in roll, pitch and yaw",
        ),
        (
            "gimbals = [\"booster.*.*\"]",
            "gimbals = [\"booster.*.*\"]\ntime_s = 81.0",
            "autopilot.allocation.time_s",
            "80.0",
        ),
        (
            "gimbals = [\"booster.*.*\"]",
            "gimbals = [\"booster.*.*\"]\ntime_s = 80.0\nmatrix = [[1.0, 0.0, 0.0]]",
            "autopilot.allocation.time_s",
            "one of both",
        ),
        ("kind = \"notch\"", "kind = \"nothc\"", "autopilot.path[1].filter[0].kind", "`notch`"),
        ("kind = \"notch\", ", "", "autopilot.path[1].filter[0].kind", "one of gain, lag,"),
    ] {
        if key.is_empty() {
            // A low pass in the loop: nothing is passed on at once.
            assert!(read(&text().replacen(from, to, 1)).is_ok());
            continue;
        }
        let (found, words) = problem(from, to);
        assert_eq!(found, key, "{words}");
        assert!(words.contains(told), "{words}");
    }
}

#[test]
fn an_integrator_is_allowed() {
    let from = "{ kind = \"lag\", frequency_hz = 2.0 }";
    assert!(read(&text().replacen(from, "{ kind = \"integrator\" }", 1)).is_ok());
}

#[test]
fn paths_that_read_each_other_at_once_are_an_algebraic_loop() {
    let loops = text()
        .replacen("input = { \"gyro.aft.roll\" = 1.0 }", "input = { \"gyro.aft.roll\" = 1.0, \"path.other\" = 0.1 }", 1)
        .replacen(
            "[[autopilot.path]]\nname = \"roll\"\n",
            "[[autopilot.path]]\nname = \"other\"\ninput = { \"path.roll_rate\" = 1.0 }\n\n[[autopilot.path]]\nname = \"roll\"\n",
            1,
        );
    // The transfer function of the rate path has no direct feedthrough: no loop.
    assert!(read(&loops).is_ok());
    // With 0.5 s more on the right, 0.01 s² + 0.3 s + 1 is no stable denominator: the loop runs away.
    let away = loops.replacen("\"path.other\" = 0.1", "\"path.other\" = 0.5", 1);
    let list = read(&away).unwrap_err().0;
    assert_eq!((list.len(), list[0].key.as_str()), (1, "autopilot.path[1].input"));
    let told = "a loop through path.roll_rate, path.other with a pole at ";
    assert!(list[0].found.starts_with(told), "{}", list[0].found);
    let direct = loops.replacen("denominator = [0.01, 0.3, 1.0]", "denominator = [0.3, 1.0]", 1);
    let list = read(&direct).unwrap_err().0;
    assert_eq!((list.len(), list[0].key.as_str()), (1, "autopilot.path[1].input"));
    assert!(list[0].found.contains("through path.roll_rate, path.other"), "{}", list[0].found);
}
