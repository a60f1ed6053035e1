//! What rows mean for a small vehicle, and every way in which they can be wrong.

use super::super::fixture::{engine, vehicle, vehicle_with_descendants};
use super::*;
use crate::vehicle::Bearing;

type Found = Vec<(String, String, String)>;

fn resolved(text: &str, vehicle: &Vehicle) -> (Dispersion, Found) {
    let table: Table = toml::from_str(text).unwrap();
    let mut found = Vec::new();
    let dispersion = resolve(&table, vehicle, &mut |key, what, allowed| {
        found.push((key, what, allowed));
    });
    (dispersion, found)
}

fn good(text: &str, vehicle: &Vehicle) -> Dispersion {
    let (dispersion, found) = resolved(text, vehicle);
    assert_eq!(found, []);
    dispersion
}

/// A row with a scale of one per cent.
fn row(path: &str, level: &str, more: &str) -> String {
    format!(
        "[[row]]\npath = \"{path}\"\nlevel = \"{level}\"\napply = \"scale\"\nsource = \"E\"\n\
         law = {{ kind = \"normal\", mean = 1.0, sigma = 0.01 }}\n{more}\n"
    )
}

fn absolute(path: &str, level: &str, law: &str, more: &str) -> String {
    format!(
        "[[row]]\npath = \"{path}\"\nlevel = \"{level}\"\napply = \"absolute\"\nsource = \"E\"\n\
         law = {law}\n{more}\n"
    )
}

fn keys(dispersion: &Dispersion) -> Vec<&str> {
    dispersion.draws().iter().map(|d| d.key.as_str()).collect()
}

/// Paths on which the draw with this key acts.
fn targets<'a>(dispersion: &'a Dispersion, key: &str) -> Vec<&'a str> {
    let Role::Value { targets, .. } = &dispersion.draws()[dispersion.index(key).unwrap()].role
    else {
        panic!("{key} is a common score")
    };
    targets.iter().map(|&t| dispersion.parameters().all()[t].path.as_str()).collect()
}

#[track_caller]
fn one_problem(text: &str, key: &str, found: &str, allowed: &str) {
    one_problem_of(text, &vehicle(), key, found, allowed);
}

#[track_caller]
fn one_problem_of(text: &str, vehicle: &Vehicle, key: &str, found: &str, allowed: &str) {
    let (_, problems) = resolved(text, vehicle);
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(problems[0].0, key);
    assert!(problems[0].1.contains(found), "{problems:?}");
    assert!(problems[0].2.contains(allowed), "{problems:?}");
}

#[test]
fn a_row_draws_once_per_instance_of_its_level() {
    let vehicle = vehicle();
    let check = |path: &str, level: &str, expected: &[(&str, &[&str])]| {
        let dispersion = good(&row(path, level, ""), &vehicle);
        assert_eq!(keys(&dispersion), expected.iter().map(|e| e.0).collect::<Vec<_>>());
        for (key, paths) in expected {
            assert_eq!(&targets(&dispersion, key), paths, "{key}");
        }
    };
    let both: &[&str] = &["booster.left.thrust", "booster.right.thrust"];
    check("booster.*.thrust", "vehicle", &[("booster.*.thrust @ vehicle", both)]);
    check("*.*.thrust", "vehicle", &[("*.*.thrust @ vehicle", both)]);
    let each: &[(&str, &[&str])] = &[
        ("booster.left.thrust @ engine", &["booster.left.thrust"]),
        ("booster.right.thrust @ engine", &["booster.right.thrust"]),
    ];
    check("booster.*.thrust", "engine", each);
    check("booster.*.thrust", "booster", each);
    check("*.*.thrust", "engine", each);
    check(
        "booster.left.nozzle.mass",
        "engine",
        &[("booster.left.nozzle.mass @ engine", &["booster.left.nozzle.mass"])],
    );
    check(
        "booster.*.actuator.*.stiffness",
        "engine",
        &[
            (
                "booster.left.actuator.*.stiffness @ engine",
                &["booster.left.actuator.rock.stiffness", "booster.left.actuator.tilt.stiffness"],
            ),
            (
                "booster.right.actuator.*.stiffness @ engine",
                &["booster.right.actuator.rock.stiffness", "booster.right.actuator.tilt.stiffness"],
            ),
        ],
    );
    check(
        "booster.left.actuator.*.damping",
        "actuator",
        &[
            (
                "booster.left.actuator.rock.damping @ actuator",
                &["booster.left.actuator.rock.damping"],
            ),
            (
                "booster.left.actuator.tilt.damping @ actuator",
                &["booster.left.actuator.tilt.damping"],
            ),
        ],
    );
    check("modes.m002.damping", "mode", &[("modes.m002.damping @ mode", &["modes.m002.damping"])]);
    check(
        "booster.*.gimbal.m001.shape",
        "mode",
        &[
            ("booster.left.gimbal.m001.shape @ mode", &["booster.left.gimbal.m001.shape"]),
            ("booster.right.gimbal.m001.shape @ mode", &["booster.right.gimbal.m001.shape"]),
        ],
    );
    check(
        "structure.damping",
        "vehicle",
        &[("structure.damping @ vehicle", &["structure.damping"])],
    );
}

#[test]
fn descendants_draw_under_the_label_of_their_ancestor() {
    let dispersion = good(&row("modes.*.frequency", "mode", ""), &vehicle_with_descendants());
    // m004 overlaps m002 by 0.8 and shares; m005 overlaps m003 by exactly 0.5 and does not.
    assert_eq!(
        keys(&dispersion),
        [
            "modes.m001.frequency @ mode",
            "modes.m002.frequency @ mode",
            "modes.m003.frequency @ mode",
            "modes.m005.frequency @ mode",
        ]
    );
    assert_eq!(
        targets(&dispersion, "modes.m002.frequency @ mode"),
        ["modes.m002.frequency", "modes.m004.frequency"]
    );
    let alone = good(&row("modes.m004.frequency", "mode", ""), &vehicle_with_descendants());
    assert_eq!(keys(&alone), ["modes.m002.frequency @ mode"]);
    let gimbals =
        good(&row("booster.left.gimbal.*.slope", "mode", ""), &vehicle_with_descendants());
    assert_eq!(targets(&gimbals, "booster.left.gimbal.m002.slope @ mode").len(), 2);
}

#[test]
fn a_band_contains_its_low_edge_and_not_its_high_one() {
    let band = |low: &str, high: &str| {
        let text = row("modes.*.frequency", "mode", &format!("band_hz = [{low}, {high}]"));
        let dispersion = good(&text, &vehicle());
        keys(&dispersion).iter().map(|k| k[6..10].to_string()).collect::<Vec<_>>()
    };
    // Modes at 4, 5 and 10 Hz.
    assert_eq!(band("0.0", "5.0"), ["m001"]);
    assert_eq!(band("5.0", "10.0"), ["m002"]);
    assert_eq!(band("10.0", "1000.0"), ["m003"]);
    assert_eq!(band("4.0", "10.1"), ["m001", "m002", "m003"]);
    let three = row("modes.*.frequency", "mode", "band_hz = [0, 5]")
        + &row("modes.*.frequency", "mode", "band_hz = [5, 10]")
        + &row("booster.*.gimbal.*.shape", "mode", "band_hz = [10, 1000]");
    assert_eq!(good(&three, &vehicle()).draws().len(), 4);
}

#[test]
fn wrong_bands_are_refused() {
    let band = |path: &str, level: &str, band: &str| row(path, level, &format!("band_hz = {band}"));
    let low = &band("modes.*.frequency", "mode", "[5, 5]");
    one_problem(low, "row[0].band_hz", "[5, 5]", "low < high");
    let empty = &band("modes.*.frequency", "mode", "[6, 9]");
    one_problem(empty, "row[0].band_hz", "no mode", "4 to 10 Hz");
    let nozzle = &band("booster.*.nozzle.mass", "engine", "[0, 5]");
    one_problem(nozzle, "row[0].band_hz", "[0, 5]", "no modal label");
}

#[test]
fn an_id_tells_keys_apart_and_the_same_key_twice_names_both_rows() {
    let same = row("booster.*.thrust", "engine", "") + &row("booster.left.thrust", "booster", "");
    let allowed = "give one of the two rows an `id`";
    one_problem(&same, "row[1].path", "`booster.left.thrust @ engine`, as row[0]", allowed);
    let (_, problems) = resolved(&same, &vehicle());
    assert!(
        problems[0].1.contains("`booster.left.thrust`") && problems[0].1.contains("`booster.*")
    );
    let apart = row("booster.*.thrust", "engine", "")
        + &row("booster.left.thrust", "booster", "id = \"again\"");
    assert_eq!(
        keys(&good(&apart, &vehicle())),
        [
            "booster.left.thrust @ engine",
            "booster.left.thrust @ engine # again",
            "booster.right.thrust @ engine",
        ]
    );
    let many = row("modes.*.damping", "mode", "") + &row("modes.*.damping", "mode", "");
    one_problem(&many, "row[1].path", "and 2 more", allowed);
    // A child under its ancestor's key beside the ancestor's own row.
    let family = row("modes.m002.damping", "mode", "") + &row("modes.m004.damping", "mode", "");
    let vehicle = vehicle_with_descendants();
    one_problem_of(&family, &vehicle, "row[1].path", "`modes.m002.damping @ mode`", allowed);
    let bad = row("booster.*.thrust", "engine", "id = \"a # b\"");
    one_problem(&bad, "row[0].id", "a # b", "letters, digits");
}

#[test]
fn two_absolute_values_for_one_parameter_name_both_rows() {
    let law = "{ kind = \"uniform\", low = 0.001, high = 0.01 }";
    let text = absolute("modes.*.damping", "mode", law, "")
        + &absolute("modes.m002.damping", "vehicle", law, "");
    one_problem(&text, "row[1].apply", "`modes.m002.damping` beside row[0]", "one absolute row");
    let mixed =
        absolute("modes.*.damping", "mode", law, "") + &row("modes.*.damping", "vehicle", "");
    good(&mixed, &vehicle());
}

#[test]
fn a_path_that_matches_nothing_lists_near_misses_and_templates() {
    let check = |path: &str, allowed: &str| {
        one_problem(&row(path, "vehicle", ""), "row[0].path", path, allowed);
        one_problem(&row(path, "vehicle", ""), "row[0].path", path, "<group>.<engine>.nozzle.mass");
    };
    check("booster.left.nozle.mass", "did you mean `booster.left.nozzle.mass`");
    check("boster.*.thrust", "`booster.*.thrust`");
    check("modes.*.freqency", "`modes.*.frequency`");
    check("modes.m009.damping", "`modes.m00");
    check("structure.*", "structure.damping");
    check("*.damping", "structure.damping");
    check("", "structure.damping");
    check("booster.left.nozzle.*", "booster.left.nozzle.mass");
    let long = "x.".repeat(5000);
    one_problem(&row(&long, "vehicle", ""), "row[0].path", "x.x", "structure.damping");
}

#[test]
fn a_level_that_does_not_fit_the_path_is_refused() {
    let check = |path: &str, level: &str, allowed: &str| {
        one_problem(&row(path, level, ""), "row[0].level", level, allowed);
    };
    check("booster.*.nozzle.mass", "actuator", "\"vehicle\", \"engine\", \"booster\" (for");
    check("booster.*.nozzle.mass", "mode", "\"vehicle\", \"engine\"");
    check("modes.*.damping", "engine", "\"vehicle\", \"mode\"");
    check("modes.*.damping", "modes", "\"vehicle\", \"mode\"");
    check("structure.damping", "mode", "\"vehicle\"");
    check("booster.*.thrust", "core", "\"engine\"");
    check("booster.*.thrust", "Engine", "\"engine\"");
    // The name of a group is a level only for paths that name this group.
    check("*.*.thrust", "booster", "\"engine\"");
}

#[test]
fn an_included_bearing_cannot_be_dispersed_but_a_separate_one_can() {
    let text = row("booster.*.bearing.stiffness", "booster", "");
    one_problem(&text, "row[0].path", "booster.left.bearing.stiffness, booster.right", "separate");
    let mut vehicle = vehicle();
    vehicle.engines[0] = engine("booster", "left", Bearing::Separate);
    one_problem_of(
        &text,
        &vehicle,
        "row[0].path",
        "of booster.right.bearing.stiffness",
        "separate",
    );
    // One separate bearing at an engine is enough: the stiffness then acts.
    vehicle.engines[1].actuators[1].bearing = Bearing::Separate;
    good(&text, &vehicle);
    // Its damping is part of an actuator's closed-loop figure as its stiffness is.
    let text = row("booster.*.bearing.damping", "booster", "");
    one_problem(&text, "row[0].path", "booster.left.bearing.damping, booster.right", "separate");
}

#[test]
fn a_nozzle_without_a_liner_has_no_ablation() {
    let mut vehicle = vehicle();
    let text = row("booster.*.nozzle.ablation", "engine", "");
    vehicle.engines[0].nozzle.ablation = None;
    assert_eq!(keys(&good(&text, &vehicle)), ["booster.right.nozzle.ablation @ engine"]);
    vehicle.engines[1].nozzle.ablation = None;
    one_problem_of(&text, &vehicle, "row[0].path", "no part has", "liner ablation");
}

#[test]
fn units_are_those_of_the_registry() {
    let law = "{ kind = \"normal\", mean = 8100.0, sigma = 80.0 }";
    good(&absolute("booster.*.nozzle.mass", "engine", law, "unit = \"kg\""), &vehicle());
    let wrong = absolute("booster.*.nozzle.mass", "engine", law, "unit = \"t\"");
    one_problem(&wrong, "row[0].unit", "\"t\"", "\"kg\"");
    let scale = row("booster.*.nozzle.mass", "engine", "unit = \"kg\"");
    one_problem(&scale, "row[0].unit", "\"kg\"", "\"1\"");
    good(&row("booster.*.nozzle.mass", "engine", "unit = \"1\""), &vehicle());
}

#[test]
fn values_that_cannot_be_are_refused_and_unlikely_ones_are_not() {
    let mass = |law: &str, more: &str| absolute("booster.*.nozzle.mass", "engine", law, more);
    let zero = mass("{ kind = \"fixed\", value = 0.0 }", "");
    one_problem(&zero, "row[0].law", "from 0 to 0", "above zero");
    let negative = mass("{ kind = \"uniform\", low = -1.0, high = 9000.0 }", "");
    one_problem(&negative, "row[0].law", "from -1 to 9000", "above zero");
    // An unbounded law can give a negative mass; such a case is a recorded failure.
    good(&mass("{ kind = \"normal\", mean = 8100.0, sigma = 4000.0 }", ""), &vehicle());
    good(&mass("{ kind = \"uniform\", low = 0.0, high = 9000.0 }", ""), &vehicle());
    good(
        &absolute("booster.*.nozzle.cg", "engine", "{ kind = \"fixed\", value = -0.5 }", ""),
        &vehicle(),
    );
    let worst = row("booster.*.nozzle.mass", "engine", "worst = [-0.1, 1.1]");
    one_problem(&worst, "row[0].worst[0]", "-0.1", "above zero");
    let order = row("booster.*.nozzle.mass", "engine", "worst = [1.1, 0.9]");
    one_problem(&order, "row[0].worst", "[1.1, 0.9]", "in this order");
}

#[test]
fn impossible_laws_are_named_by_their_argument() {
    let check = |law: &str, argument: &str, allowed: &str| {
        let text = absolute("booster.*.nozzle.cg", "engine", law, "");
        one_problem(&text, &format!("row[0].law.{argument}"), "", allowed);
    };
    check("{ kind = \"normal\", mean = 1, sigma = -1 }", "sigma", "above zero");
    check("{ kind = \"normal\", mean = 1 }", "sigma", "exactly one of sigma and three_sigma");
    check("{ kind = \"normal\", mean = 1, sigma = 1, three_sigma = 3 }", "sigma", "exactly one");
    check("{ kind = \"normal\", mean = 1, three_sigma = 0 }", "three_sigma", "above zero");
    check("{ kind = \"uniform\", low = 1, high = 0 }", "high", "above `low`");
    let truncated =
        |more: &str| format!("{{ kind = \"truncated_normal\", mean = 1, sigma = 1{more} }}");
    check(&truncated(""), "low", "kind = \"normal\"");
    check(&truncated(", low = 0, low_sigma = -1"), "low", "one of the two");
    check(&truncated(", low_sigma = 1, high_sigma = -1"), "high", "above the lower one");
    check("{ kind = \"discrete\", values = [] }", "values", "at least one");
    check("{ kind = \"discrete\", values = [1, 2], weights = [1] }", "weights", "as many");
    check("{ kind = \"empirical\", values = [1, 1] }", "values", "the last above the first");
}

#[test]
fn common_scores_are_declared_and_weighed() {
    let common = "[[common]]\nid = \"f\"\nsource = \"R\"\n";
    let with = |more: &str| common.to_string() + &row("modes.*.frequency", "mode", more);
    let dispersion = good(&with("common = \"f\"\ncommon_weight = 0.5"), &vehicle());
    assert_eq!(keys(&dispersion)[0], "common.f @ vehicle");
    for draw in &dispersion.draws()[1..] {
        let Role::Value { common, .. } = draw.role else { panic!() };
        assert_eq!(common, Some(Shared { draw: 0, weight: 0.5 }));
    }
    let check = |more: &str, key: &str, found: &str, allowed: &str| {
        one_problem(&with(more), &format!("row[0].{key}"), found, allowed);
    };
    check("common = \"g\"\ncommon_weight = 0.5", "common", "\"g\"", "f");
    check("common = \"f\"", "common_weight", "nothing", "weight");
    check("common_weight = 0.5", "common", "nothing", "id of the common score");
    check("common = \"f\"\ncommon_weight = 1.5", "common_weight", "1.5", "at most 1");
    check("common = \"f\"\ncommon_weight = 0.0", "common_weight", "0", "above 0");
    one_problem(&common.repeat(2), "common[1].id", "a second time", "of its own");
    one_problem("[[common]]\nid = \"a b\"\nsource = \"R\"\n", "common[0].id", "a b", "letters");
    one_problem("[[common]]\nid = \"a\"\nsource = \" \"\n", "common[0].source", "empty", "why");
}

#[test]
fn every_problem_of_a_table_is_reported_at_once() {
    let text = row("booster.*.thrst", "engine", "")
        + &row("booster.*.thrust", "mode", "unit = \"N\"\nworst = [2, 1]")
        + &absolute(
            "modes.*.damping",
            "mode",
            "{ kind = \"uniform\", low = 1, high = 1 }",
            "id = \"\"",
        );
    let (_, problems) = resolved(
        &text.replace("source = \"E\"\nlaw = { kind = \"u", "source = \"\"\nlaw = { kind = \"u"),
        &vehicle(),
    );
    let keys: Vec<&str> = problems.iter().map(|p| p.0.as_str()).collect();
    assert_eq!(
        keys,
        [
            "row[0].path",
            "row[1].level",
            "row[1].unit",
            "row[1].worst",
            "row[2].law.high",
            "row[2].source",
            "row[2].id",
        ]
    );
}

#[test]
fn columns_say_path_id_and_unit_and_are_unique() {
    let law = "{ kind = \"normal\", mean = 1.0, sigma = 0.1 }";
    let offset = row("booster.*.thrust", "vehicle", "id = \"Lot-2\"").replace("scale", "offset");
    let text = "[[common]]\nid = \"f\"\nsource = \"R\"\n".to_string()
        + &row("booster.*.nozzle.mass", "engine", "")
        + &row("booster.*.thrust", "vehicle", "")
        + &offset
        + &absolute("booster.*.actuator.*.stiffness", "actuator", law, "")
        + &absolute("modes.*.damping", "mode", law, "");
    let dispersion = good(&text, &vehicle());
    let column = |key: &str| dispersion.draws()[dispersion.index(key).unwrap()].column.as_str();
    assert_eq!(column("booster.left.nozzle.mass @ engine"), "draw_booster_left_nozzle_mass_scale");
    assert_eq!(column("booster.*.thrust @ vehicle"), "draw_booster_all_thrust_scale");
    assert_eq!(
        column("booster.*.thrust @ vehicle # Lot-2"),
        "draw_booster_all_thrust_lot_2_offset_n"
    );
    assert_eq!(
        column("booster.left.actuator.rock.stiffness @ actuator"),
        "draw_booster_left_actuator_rock_stiffness_n_m_rad"
    );
    assert_eq!(column("modes.m001.damping @ mode"), "draw_modes_m001_damping");
    assert_eq!(column("common.f @ vehicle"), "draw_common_f_score");
}

#[test]
fn columns_that_would_be_too_long_or_equal_end_in_a_digest_of_the_key() {
    let mut vehicle = vehicle();
    vehicle.engines[0].name = "a_booster_with_an_unusually_long_name".into();
    let text = row("booster.*.actuator.*.stiffness", "actuator", "")
        + &row("booster.right.thrust", "engine", "")
        + &row("booster.right.thrust", "vehicle", "");
    let dispersion = good(&text, &vehicle);
    let columns: BTreeSet<&str> = dispersion.draws().iter().map(|d| d.column.as_str()).collect();
    assert_eq!(columns.len(), dispersion.draws().len());
    for column in &columns {
        assert!(column.len() <= 63 && column.starts_with("draw_"), "{column}");
        assert!(column.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'));
    }
    assert_eq!(
        columns.iter().filter(|c| c.starts_with("draw_booster_right_thrust_scale_")).count(),
        2
    );
}

#[test]
fn the_meaning_of_a_table_does_not_depend_on_the_order_of_its_rows() {
    let rows = [
        row("booster.*.thrust", "vehicle", ""),
        row("booster.*.thrust", "engine", ""),
        row("modes.*.frequency", "mode", "common = \"f\"\ncommon_weight = 0.5"),
        "[[common]]\nid = \"f\"\nsource = \"R\"\n".into(),
    ];
    let vehicle = vehicle();
    let straight = good(&rows.concat(), &vehicle);
    let reversed = good(&rows.iter().rev().cloned().collect::<String>(), &vehicle);
    // But for the dimensions of Sobol sequences, which follow the order of the table.
    let draws = |dispersion: &Dispersion| -> Vec<Draw> {
        dispersion.draws().iter().map(|d| Draw { dimension: 0, ..d.clone() }).collect()
    };
    assert_eq!(draws(&straight), draws(&reversed));
    assert_eq!(straight.combinations(), reversed.combinations());
}
