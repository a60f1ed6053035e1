//! Tests of the vehicle: the reference file, and everything that can be wrong with it.

use super::super::fixture::{VEHICLE, modal};
use super::super::table;
use super::*;
use crate::vehicle::{Bearing, Law, Parent, SecondOrder};
use proptest::prelude::*;

fn resolved(text: &str, modal: Modal) -> Result<Resolved, Problems> {
    let (file, findings) = table::read::<VehicleFile>("vehicle.toml", text)?;
    resolve(&file, Some(modal), findings)
}

/// The reference file with the first `from` replaced by `to`.
fn edited(from: &str, to: &str) -> String {
    assert!(VEHICLE.contains(from), "{from}");
    VEHICLE.replacen(from, to, 1)
}

/// Key paths of the problems of a file, with found and allowed for messages.
fn problems(text: &str, modal: Modal) -> Vec<(String, String)> {
    let list = resolved(text, modal).expect_err("a problem").0;
    list.into_iter().map(|p| (p.key, format!("{} | {}", p.found, p.allowed))).collect()
}

/// The one problem of the reference file after an edit.
fn problem(from: &str, to: &str) -> (String, String) {
    let mut list = problems(&edited(from, to), modal());
    assert_eq!(list.len(), 1, "{list:?}");
    list.remove(0)
}

fn second_order(actuator: &Actuator) -> SecondOrder {
    match actuator.law {
        Law::SecondOrder(law) => law,
        _ => panic!("another kind of actuator"),
    }
}

#[test]
fn the_reference_vehicle_is_read_as_it_stands() {
    let Resolved { vehicle, flight_times_s } = resolved(VEHICLE, modal()).unwrap();
    assert_eq!(vehicle.engines.len(), 6);
    assert_eq!(flight_times_s, [80.0, 95.0, 100.0, 105.0, 110.0, 112.0, 114.0]);
    let left = &vehicle.engines[0];
    assert_eq!(left.path(), "booster.left");
    let s = 0.5_f64.sqrt();
    // Moments of axial action lines at 45°: (0, r_z, −r_y).
    assert!((left.axes.column(0) - Vector3::new(0.0, s, s)).amax() < 1e-15);
    assert!((left.axes.column(1) - Vector3::new(0.0, -s, s)).amax() < 1e-15);
    let stations =
        ["case.01", "case.02", "case.03", "case.04", "case.05", "aft.01", "aft.02", "gimbal"];
    assert_eq!(left.case_stations, stations.map(|s| format!("booster.left.{s}")));
    assert_eq!(left.actuators[0].bearing, Bearing::Included);
    assert_eq!(second_order(&left.actuators[1]).reference_inertia_kg_m2, 24_000.0);
    assert!((left.motor.burned_fraction_at(105.0) - (726.0 - 154.2) / 628.0).abs() < 5e-5);
    let core = &vehicle.engines[2];
    let stiffness = 8000.0 * (std::f64::consts::TAU * 5.0).powi(2);
    assert_eq!(second_order(&core.actuators[0]).stiffness_n_m_rad, stiffness);
    assert!(core.case_stations.is_empty() && !core.in_modes);
}

#[test]
fn left_and_right_booster_are_mirror_images() {
    let vehicle = resolved(VEHICLE, modal()).unwrap().vehicle;
    let (left, right) = (&vehicle.engines[0], &vehicle.engines[1]);
    // A rotation mirrored in y keeps its y component and turns the others round.
    let mirrored = Matrix3x2::from_fn(|i, j| left.axes[(i, j)] * if i == 1 { 1.0 } else { -1.0 });
    assert!((mirrored - right.axes).amax() < 1e-15);
    assert_eq!(left.nozzle, right.nozzle);
    assert_eq!(left.actuators[0].law, right.actuators[0].law);
}

#[test]
fn nominal_flow_agrees_with_thrust_and_specific_impulse() {
    let vehicle = resolved(VEHICLE, modal()).unwrap().vehicle;
    for engine in &vehicle.engines {
        for time in [80.0, 95.0, 105.0, 114.0] {
            let profile = engine.motor.flow_profile_at(time);
            // The tables are rounded to 1 kg/s or 0.01 MN: 0.1 % and less.
            assert!((profile - 1.0).abs() < 2e-3, "{} {time}: {profile}", engine.path());
        }
    }
}

#[test]
fn all_problems_of_a_file_are_reported_at_once() {
    let text = VEHICLE
        .replacen("damping_ratio = 0.005", "dampin_ratio = -1.0", 1)
        .replacen("mass_kg = 8100.0", "mass_kg = nan", 1)
        .replacen("gimbal_grid = \"core.2.gimbal\"", "gimbal_grid = \"core.2.gimball\"", 1)
        .replacen("length_m = 4.2", "length_m = \"long\"", 1)
        .replacen("frequency_hz = 5.0", "frequency_hz = 5.0\nstiffness_n_m_rad = 1e6", 1);
    let keys: Vec<String> = problems(&text, modal()).into_iter().map(|p| p.0).collect();
    assert_eq!(
        keys,
        [
            "engine[0].nozzle.mass_kg",
            "engine[2].nozzle.length_m",
            "structure.dampin_ratio",
            "structure.damping_ratio",
            "engine[2].actuator[0]",
            "engine[3].gimbal_grid",
        ]
    );
}

#[test]
fn single_values_out_of_range_are_refused() {
    for (from, to, key) in [
        ("mass_kg = 8100.0", "mass_kg = -8100.0", "engine[0].nozzle.mass_kg"),
        ("mass_kg = 8100.0", "mass_kg = inf", "engine[0].nozzle.mass_kg"),
        ("inertia_kg_m2 = 24000.0", "inertia_kg_m2 = 0", "engine[0].nozzle.inertia_kg_m2"),
        ("damping_ratio = 0.30", "damping_ratio = -0.3", "engine[0].actuator[0].damping_ratio"),
        ("bearing = \"included\"", "bearing = \"inside\"", "engine[0].actuator[0].bearing"),
        (
            "specific_impulse_s = 267.4",
            "specific_impulse_s = \"267\"",
            "motor[0].specific_impulse_s",
        ),
        (
            "thrust_direction = [-1.0, 0.0, 0.0]",
            "thrust_direction = [-1.0, 0.0]",
            "engine[0].thrust_direction",
        ),
    ] {
        assert_eq!(problem(from, to).0, key);
    }
}

#[test]
fn a_missing_grid_names_the_flight_times_and_the_nearest_grid() {
    let mut modal = modal();
    for set in modal.sets.iter_mut().filter(|s| s.flight_time_s > 111.0) {
        set.grids.retain(|g| g.name != "booster.right.rock");
    }
    let list = problems(VEHICLE, modal);
    assert_eq!(list.len(), 1, "{list:?}");
    assert_eq!(list[0].0, "engine[1].actuator[0].attach_grid");
    assert!(list[0].1.contains("missing at 112, 114 s"), "{list:?}");
    let (key, text) = problem("\"booster.left.rock\"", "\"booster.left.rok\"");
    assert_eq!(key, "engine[0].actuator[0].attach_grid");
    assert!(text.contains("did you mean `booster.left.rock`?"), "{text}");
}

#[test]
fn directions_and_axes_must_be_what_they_say() {
    let direction = "thrust_direction = [-1.0, 0.0, 0.0]";
    assert_eq!(
        problem(direction, "thrust_direction = [-2.0, 0.0, 0.0]").0,
        "engine[0].thrust_direction"
    );
    let axes = |axes: &str| format!("{direction}\naxes = {axes}");
    for bad in [
        "[[0.0, 1.0, 0.0], [0.0, 0.9, 0.435889894]]",
        "[[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]",
        "[[0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]",
    ] {
        let (key, text) = problem(direction, &axes(bad));
        assert_eq!(key, "engine[0].axes");
        assert!(text.contains("engine \"booster.left\""), "{text}");
    }
    let text = edited(direction, &axes("[[0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]"));
    let vehicle = resolved(&text, modal()).unwrap().vehicle;
    assert_eq!(vehicle.engines[0].axes, Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, -1.0));
}

#[test]
fn parallel_and_degenerate_action_lines_name_the_engine() {
    for to in ["\"booster.left.rock\"", "\"booster.left.gimbal\""] {
        let (key, text) = problem("\"booster.left.tilt\"", to);
        assert_eq!(key, "engine[0].actuator");
        assert!(text.contains("engine \"booster.left\""), "{text}");
    }
    let skewed = "\"booster.left.tilt\"\nattach_m = [0.0, -1.2657, -1.35]";
    let (key, text) = problem("\"booster.left.tilt\"", skewed);
    assert_eq!(key, "engine[0].actuator");
    assert!(text.contains("90° to within 1°"), "{text}");
}

#[test]
fn an_attach_point_must_not_move_in_time() {
    let mut modal = modal();
    let set = modal.sets.last_mut().unwrap();
    set.grids.iter_mut().find(|g| g.name == "core.1.rock").unwrap().position_m.x += 0.01;
    let list = problems(VEHICLE, modal);
    assert_eq!(list[0].0, "engine[2].actuator[0].attach_grid");
    assert_eq!(list.len(), 1, "{list:?}");
}

#[test]
fn an_inertia_that_no_nozzle_can_have_is_refused() {
    let (key, text) = problem("cg_m = 0.70", "cg_m = 1.8");
    assert_eq!(key, "engine[0].nozzle");
    assert!(text.contains("unablated") && text.contains("J − m r²"), "{text}");
    let (key, text) = problem("inertia_loss_kg_m2 = 2500.0", "inertia_loss_kg_m2 = 24000.0");
    assert_eq!(key, "engine[0].nozzle");
    assert!(text.contains("ablated at 100 s"), "{text}");
}

#[test]
fn an_actuator_has_exactly_one_of_stiffness_and_frequency() {
    let (key, text) = problem("stiffness_n_m_rad = 3.76e7", "");
    assert_eq!((key.as_str(), text.contains("neither")), ("engine[0].actuator[0]", true));
    let (key, text) =
        problem("stiffness_n_m_rad = 3.76e7", "stiffness_n_m_rad = 1e7\nfrequency_hz = 5");
    assert_eq!((key.as_str(), text.contains("both")), ("engine[0].actuator[0]", true));
}

#[test]
fn a_bearing_must_fit_what_the_actuator_says() {
    let (key, _) = problem("stiffness_n_m_rad = 3.76e7", "stiffness_n_m_rad = 1e6");
    assert_eq!(key, "engine[0].actuator[0].bearing");
    let frequency = "frequency_hz = 5.0";
    let (key, _) = problem(frequency, "frequency_hz = 5.0\nbearing = \"separate\"");
    assert_eq!(key, "engine[2].actuator[0].bearing");
    let text = edited("bearing = \"included\"", "bearing = \"separate\"");
    let vehicle = resolved(&text, modal()).unwrap().vehicle;
    assert_eq!(vehicle.engines[0].actuators[0].bearing, Bearing::Separate);
    assert_eq!(vehicle.engines[0].bearing_stiffness_n_m_rad, 2.0e6);
}

#[test]
fn motors_must_cover_the_flight_times_with_whole_tables() {
    let (key, text) = problem("480.0]", "113.0]");
    assert_eq!(key, "motor[1].time_s");
    assert!(text.contains("without [114.0] s"), "{text}");
}

#[test]
fn motor_tables_must_be_whole_and_physical() {
    for (from, to, key) in [
        ("[20.0, 52.0, 70.0", "[20.0, 72.0, 70.0", "motor[0].time_s[2]"),
        ("[16.25e6, 13.00e6,", "[13.00e6,", "motor[0].thrust_n"),
        ("[16.25e6,", "[-1.0,", "motor[0].thrust_n[0]"),
        // Flow without thrust would be an infinite multiple of R/(Isp g).
        ("[16.25e6,", "[0.0,", "motor[0].mass_flow_kg_s[0]"),
        ("[6195.0,", "[-1.0,", "motor[0].mass_flow_kg_s[0]"),
        ("[0.1887,", "[1.1887,", "motor[0].burned_fraction[0]"),
        ("motor = \"booster\"", "motor = \"boster\"", "engine[0].motor"),
    ] {
        assert_eq!(problem(from, to).0, key);
    }
    let (key, _) = problem("burned_fraction = [", "# burned_fraction = [");
    assert_eq!(key, "motor[0].burned_fraction");
}

#[test]
fn a_flight_time_needs_modes() {
    let (key, text) = problem("114.0]", "115.0]");
    assert_eq!(key, "flight_times_s[6]");
    assert!(text.contains("115 s"), "{text}");
    let (key, _) = problem("[80.0, 95.0, 100.0,", "[80.0, 100.0, 95.0,");
    assert_eq!(key, "flight_times_s[2]");
}

#[test]
fn case_stations_follow_the_flow_as_far_as_the_throat() {
    let stations = "[\"booster.left.case.*\", \"booster.left.aft.01\", \"booster.left.aft.02\"]";
    let (key, text) = problem(stations, "[\"booster.left.aft.01\", \"booster.left.case.*\"]");
    assert_eq!(key, "engine[0].case_stations");
    assert!(text.contains("order of the flow"), "{text}");
    let (key, _) = problem(stations, "[\"booster.left.case.*\", \"booster.left.aft.03\"]");
    assert_eq!(key, "engine[0].case_stations");
    let (key, _) = problem(stations, "[\"booster.left.cases.*\", \"booster.left.aft.01\"]");
    assert_eq!(key, "engine[0].case_stations[0]");
    let (key, _) = problem(stations, "[\"booster.left.gimbal\"]");
    assert_eq!(key, "engine[0].case_stations");
    // Grids aft of the throat that match a star are no case stations.
    let throat = format!("{}\nthroat_grid = \"booster.left.aft.01\"", "[\"booster.left.*.*\"]");
    let vehicle = resolved(&edited(stations, &throat), modal()).unwrap().vehicle;
    assert_eq!(vehicle.engines[0].case_stations.len(), 6);
    assert_eq!(vehicle.engines[0].case_stations[5], "booster.left.aft.01");
}

#[test]
fn integrated_and_reduced_modes_are_not_mixed() {
    let engines = ["booster.left", "booster.right", "core.1", "core.2", "core.3", "core.4"];
    let containing = |paths: &[&str]| {
        let mut modal = modal();
        modal.contains_engines = paths.iter().map(|p| (*p).to_string()).collect();
        modal
    };
    let vehicle = resolved(VEHICLE, containing(&engines)).unwrap().vehicle;
    assert!(vehicle.engines.iter().all(|e| e.in_modes));
    let list = problems(VEHICLE, containing(&engines[..2]));
    assert_eq!((list.len(), list[0].0.as_str()), (1, "modal_package"));
    assert!(list[0].1.contains("but not core.1, core.2, core.3, core.4"), "{list:?}");
    let mut unknown = engines.to_vec();
    unknown.push("core.5");
    let list = problems(VEHICLE, containing(&unknown));
    assert_eq!((list.len(), list[0].0.as_str()), (1, "modal_package"));
}

#[test]
fn names_are_words_and_unique() {
    assert_eq!(problem("name = \"right\"", "name = \"left\"").0, "engine[1].name");
    assert_eq!(problem("name = \"right\"", "name = \"Right one\"").0, "engine[1].name");
    assert_eq!(problem("name = \"tilt\"", "name = \"rock\"").0, "engine[0].actuator[1].name");
    // The allocation misses the engine as well.
    let renamed = problems(&edited("group = \"booster\"", "group = \"modes\""), modal());
    assert_eq!(renamed[0].0, "engine[0].group");
    assert_eq!(problem("name = \"tvse\"", "name = \"the mode\"").0, "named_mode[0].name");
}

#[test]
fn a_named_mode_needs_labels_of_the_package() {
    let mut modal = modal();
    for set in &mut modal.sets {
        set.modes[1].label = "other".into();
    }
    modal.parents.push(Parent {
        flight_time_s: 80.0,
        label: "other".into(),
        parent: "none".into(),
        overlap: 0.1,
    });
    assert_eq!(problems(VEHICLE, modal)[0].0, "named_mode[0].labels[0]");
}

#[test]
fn without_modal_data_the_file_itself_is_still_checked() {
    let text = edited("name = \"tvse\"", "name = \"the mode\"");
    let (file, mut findings) = table::read::<VehicleFile>("vehicle.toml", &text).unwrap();
    findings.extend(Problems::damage("modes/shapes.parquet", "", "half a file", "a whole one"));
    let problems = resolve(&file, None, findings).expect_err("a problem");
    let keys: Vec<&str> = problems.0.iter().map(|p| p.key.as_str()).collect();
    assert_eq!(keys, ["", "named_mode[0].name"]);
    assert_eq!(problems.kind(), crate::problem::Kind::Damage);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Cuts, doubles and overwrites pieces of the reference file.
    #[test]
    fn no_damage_to_the_text_makes_the_reader_panic(
        edits in proptest::collection::vec((0.0..1.0_f64, 0_usize..40, "[a-z0-9.\\[\\]=\"\n -]{0,6}"), 1..4)
    ) {
        let mut text: Vec<char> = VEHICLE.chars().collect();
        for (place, length, put) in edits {
            let from = (place * text.len() as f64) as usize;
            let to = (from + length).min(text.len());
            text.splice(from..to, put.chars());
        }
        let text: String = text.into_iter().collect();
        // Only that it returns counts here; what it finds is tested above.
        let _ = resolved(&text, modal());
    }

    #[test]
    fn no_number_in_any_place_makes_the_reader_panic(place in 0_usize..200, number in "(-?inf|nan|-?[0-9]{1,3}(\\.[0-9])?(e-?[0-9]{1,3})?)") {
        let mut seen = 0;
        let mut text = String::new();
        for line in VEHICLE.lines() {
            let split = line.split_once(" = ").filter(|(_, v)| v.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '['));
            match split {
                Some((key, value)) => {
                    let hit = seen == place;
                    seen += 1;
                    let first = value.trim_start_matches('[').split([',', ']', ' ']).next().unwrap_or("");
                    let value = if hit { value.replacen(first, &number, 1) } else { value.into() };
                    text += &format!("{key} = {value}\n");
                }
                None => text += &format!("{line}\n"),
            }
        }
        let _ = resolved(&text, modal());
    }
}

#[test]
fn an_engine_that_is_out_has_neither_thrust_nor_flow() {
    let text = VEHICLE.replacen("[16.25e6,", "[0.0,", 1).replacen(
        "mass_flow_kg_s = [",
        "mass_flow_kg_s = [0.0, ",
        1,
    );
    let first = |key: &str| {
        let at = text.find(key).map(|at| &text[at..]).unwrap();
        at.lines().next().unwrap().to_owned()
    };
    // One entry of flow too many now: the second goes.
    let flow = first("mass_flow_kg_s = [0.0, ");
    let mut entries: Vec<&str> = flow.split(", ").collect();
    entries.remove(1);
    let vehicle = resolved(&text.replacen(&flow, &entries.join(", "), 1), modal()).unwrap().vehicle;
    let motor = &vehicle.engines[0].motor;
    let start = motor.time_s[0];
    assert_eq!((motor.thrust_at(start), motor.mass_flow_at(start)), (0.0, 0.0));
    assert_eq!(motor.flow_profile_at(start), 1.0);
    assert!(motor.flow_profile_at(start + 1.0).is_finite());
}
