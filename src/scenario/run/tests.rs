//! Tests of the run: the reference runs, and everything that can be wrong with one.

use super::super::fixture::{VEHICLE, modal};
use super::super::vehicle_file::VehicleFile;
use super::super::{dispersion, table, vehicle};
use super::*;
use proptest::prelude::*;

const REFERENCE: &str = include_str!("../../../runs/reference.toml");
const DISPERSION: &str = include_str!("../../../dispersions/reference.toml");

fn vehicle() -> Resolved {
    let (file, findings) = table::read::<VehicleFile>("vehicle.toml", VEHICLE).unwrap();
    vehicle::resolve(&file, Some(modal()), findings).unwrap()
}

fn read(text: &str) -> Result<(Run, Dispersion), Problems> {
    let vehicle = vehicle();
    let dispersion = dispersion::read("d.toml", DISPERSION, &vehicle.vehicle)?;
    let (file, findings) = table::read::<RunFile>("run.toml", text)?;
    let run = resolve(&file, "reference", Some(&vehicle), Some(&dispersion), None, findings)?;
    Ok((run, dispersion))
}

/// The reference run with the first `from` replaced by `to`.
fn edited(from: &str, to: &str) -> String {
    assert!(REFERENCE.contains(from), "{from}");
    REFERENCE.replacen(from, to, 1)
}

fn keys(text: &str) -> Vec<String> {
    read(text).expect_err("a problem").0.into_iter().map(|p| p.key).collect()
}

/// The reference run with a corner of given signs instead of its own.
fn with_given(lists: &str) -> String {
    let cut = REFERENCE.find("[[corner]]").unwrap();
    format!("{}[[corner]]\nname = \"soft\"\nsigns = \"given\"\n{lists}\n", &REFERENCE[..cut])
}

#[test]
fn the_reference_run_holds_what_the_reference_vehicle_page_asks_for() {
    let (Run { definition, corners }, dispersion) = read(REFERENCE).unwrap();
    assert_eq!(definition.flight_times_s, [80.0, 95.0, 100.0, 105.0, 110.0, 112.0, 114.0]);
    assert_eq!(definition.gimballed, [true, true, false, false, false, false]);
    let names: Vec<&str> = definition.variants.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["no_jet_damping", "case_only", "nozzle_only", "jet_damping", "thrust_off"]);
    assert!(!definition.variants[4].thrust && definition.variants[3].thrust);
    assert_eq!(definition.variants[3].nozzle_jet_damping, NozzleJet::Linear);
    let populations: Vec<(&str, u64, bool)> =
        definition.populations.iter().map(|p| (p.name.as_str(), p.cases, p.drawn)).collect();
    let expected = [
        ("nominal", 1, false),
        ("dispersed", 2000, true),
        ("adverse", 1, false),
        ("adverse_dispersed", 500, true),
    ];
    assert_eq!(populations, expected);
    assert_eq!((corners[0].population, corners[0].mode, corners[0].variant), (2, 0, 3));
    assert!(corners[0].populations(&definition.populations).eq([2, 3]));
    let fixed =
        |part: &str| corners[0].draws.iter().any(|i| dispersion.draws()[*i].key.contains(part));
    assert!(fixed(".damping") && fixed("nozzle.ablation") && fixed("booster.*.thrust @ vehicle"));
    assert!(!fixed("frequency") && !fixed(".stiffness") && !fixed("slope"));
}

#[test]
fn what_a_run_leaves_out_has_stated_defaults() {
    let text = "vehicle = \"v\"\ndispersion = \"d\"\ncases = 3\nseed = 0\nmodes = [\"tvse\"]\n\
        [[variant]]\nname = \"a\"\ncase_jet_damping = true\nnozzle_jet_damping = \"rigid-nozzle\"\n";
    let (Run { definition, corners }, _) = read(text).unwrap();
    assert_eq!(definition.flight_times_s, vehicle().flight_times_s);
    assert_eq!(definition.gimballed, [true; 6]);
    assert_eq!(definition.exchange_ratio, 0.5);
    let variant = &definition.variants[0];
    assert!(variant.thrust && !variant.follower_thrust && variant.slope == Slope::VirtualGrid);
    assert_eq!(variant.nozzle_jet_damping, NozzleJet::RigidNozzle);
    assert!(corners.is_empty() && definition.populations.len() == 2);
}

#[test]
fn a_corner_of_given_signs_holds_the_worst_values_of_its_keys() {
    let text = with_given(
        "cases = 10\nlow = [\"modes.*.damping\"]\nhigh = [\"booster.*.thrust @ vehicle\"]",
    );
    let (Run { definition, corners }, dispersion) = read(&text).unwrap();
    assert!(corners.is_empty());
    let [_, _, corner, around] = definition.populations.as_slice() else { panic!() };
    assert_eq!(corner.fixed, around.fixed);
    let values: Vec<(&str, f64)> =
        corner.fixed.iter().map(|(i, v)| (dispersion.draws()[*i].key.as_str(), *v)).collect();
    let expected = [
        ("booster.*.thrust @ vehicle", 1.05),
        ("modes.above.damping @ mode", 0.0025),
        ("modes.below.damping @ mode", 0.0025),
        ("modes.m006.damping @ mode", 0.0025),
    ];
    assert_eq!(values, expected);
}

#[test]
fn single_wrong_entries_are_named() {
    for (from, to, key) in [
        ("cases = 2000", "cases = 0", "cases"),
        ("cases = 2000", "cases = 2.5", "cases"),
        ("seed = 2013", "seed = -2013", "seed"),
        ("flight_times_s = [80.0,", "flight_times_s = [81.0,", "flight_times_s[0]"),
        ("flight_times_s = [80.0,", "flight_times_s = [120.0,", "flight_times_s[1]"),
        ("modes = [\"tvse\"]", "modes = [\"tvs\"]", "modes[0]"),
        ("modes = [\"tvse\"]", "modes = []", "modes"),
        ("modes = [\"tvse\"]", "modes = [\"tvse\", \"tvse\"]", "modes[1]"),
        ("gimballed = [\"booster.*\"]", "gimballed = [\"boosters.*\"]", "gimballed[0]"),
        ("exchange_ratio = 0.5", "exchange_ratio = 1.5", "identity.exchange_ratio"),
        ("name = \"case_only\"", "name = \"case only\"", "variant[1].name"),
        ("name = \"case_only\"", "name = \"nozzle_only\"", "variant[2].name"),
        (
            "nozzle_jet_damping = \"off\"",
            "nozzle_jet_damping = \"equation-12\"",
            "variant[0].nozzle_jet_damping",
        ),
        (
            "nozzle_jet_damping = \"off\"",
            "nozle_jet_damping = \"off\"",
            "variant[0].nozle_jet_damping",
        ),
        ("name = \"adverse\"", "name = \"dispersed\"", "corner[0].name"),
        ("mode = \"tvse\"", "mode = \"bending\"", "corner[0].mode"),
        ("variant = \"jet_damping\"", "variant = \"jets\"", "corner[0].variant"),
        ("variant = \"jet_damping\"", "", "corner[0].variant"),
        ("\"modes.*.damping\"", "\"modes.*.dumping\"", "corner[0].keys[0]"),
        (
            "signs = \"evaluated\"",
            "signs = \"evaluated\"\nlow = [\"modes.*.damping\"]",
            "corner[0].low",
        ),
        ("signs = \"evaluated\"", "signs = \"guessed\"", "corner[0].signs"),
    ] {
        let found = keys(&edited(from, to));
        // A time that is not ascending is also no time of the vehicle.
        assert!(found.contains(&key.to_string()) && found.len() <= 2, "{to}: {found:?}");
    }
}

#[test]
fn a_corner_of_given_signs_is_checked_entry_by_entry() {
    for (lists, key) in [
        ("low = [\"modes.*.dumping\"]", "corner[0].low[0]"),
        ("low = [\"modes.*.damping\"]\nhigh = [\"modes.*.*\"]", "corner[0].high"),
        ("low = []", "corner[0]"),
        ("low = [\"modes.*.damping\"]\nmode = \"tvse\"", "corner[0].mode"),
        ("low = [\"modes.*.damping\"]\nkeys = [\"modes.*.damping\"]", "corner[0].keys"),
    ] {
        assert_eq!(keys(&with_given(lists)), [key], "{lists}");
    }
}

#[test]
fn a_mode_without_a_label_at_a_flight_time_is_refused() {
    let mut vehicle = vehicle();
    for set in vehicle.vehicle.modal.sets.iter_mut().filter(|s| s.flight_time_s == 112.0) {
        set.modes[1].label = "m099".into();
    }
    let (file, findings) = table::read::<RunFile>("run.toml", REFERENCE).unwrap();
    let problems =
        resolve(&file, "r", Some(&vehicle), None, None, findings).expect_err("a problem").0;
    assert_eq!((problems.len(), problems[0].key.as_str()), (1, "modes[0]"));
    assert!(problems[0].found.contains("112 s"), "{problems:?}");
}

#[test]
fn a_corner_shares_no_name_with_the_cases_around_another() {
    for (first, second) in [("a", "a_dispersed"), ("a_dispersed", "a")] {
        let corner = |name: &str| {
            format!(
                "[[corner]]\nname = \"{name}\"\nsigns = \"given\"\nlow = [\"booster.*.thrust\"]\n"
            )
        };
        let text = format!("{REFERENCE}{}{}", corner(first), corner(second));
        let problems = read(&text).expect_err("a problem").0;
        assert!(problems.iter().any(|p| p.key == "corner[2].name"), "{problems:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn no_damage_to_the_text_makes_the_reader_panic(
        edits in proptest::collection::vec((0.0..1.0_f64, 0_usize..40, "[a-z0-9.\\[\\]=\"\n -]{0,6}"), 1..4)
    ) {
        let mut text: Vec<char> = REFERENCE.chars().collect();
        for (place, length, put) in edits {
            let from = (place * text.len() as f64) as usize;
            let to = (from + length).min(text.len());
            text.splice(from..to, put.chars());
        }
        let text: String = text.into_iter().collect();
        // Only that it returns counts here; what it finds is tested above.
        let _ = read(&text);
    }
}

/// The reference run with this plan instead of its number of cases.
fn planned(plan: &str) -> String {
    format!("{}\n[plan]\n{plan}\n", edited("cases = 2000", ""))
}

fn scheme(text: &str) -> (crate::dispersion::Scheme, u64) {
    let (run, _) = read(text).unwrap_or_else(|problems| panic!("{problems}"));
    let population = &run.definition.populations[1];
    (population.scheme.clone(), population.cases)
}

#[test]
fn every_plan_reads_with_its_number_of_cases() {
    use crate::dispersion::Scheme;
    let free = |plan: &str| scheme(&format!("{REFERENCE}\n[plan]\n{plan}\n"));
    assert_eq!(free("kind = \"monte_carlo\""), (Scheme::MonteCarlo, 2000));
    assert_eq!(
        free("kind = \"latin_hypercube\""),
        (Scheme::LatinHypercube { replicates: 1 }, 2000)
    );
    assert_eq!(free("kind = \"sobol\"\nreplicates = 8"), (Scheme::Sobol { replicates: 8 }, 2000));
    let one =
        "kind = \"one_at_a_time\"\nat = [-3, 3]\nkeys = [\"structure.*\", \"booster.*.thrust\"]";
    let (_, dispersion) = read(REFERENCE).unwrap();
    let thrusts = |d: &Dispersion| {
        d.draws()
            .iter()
            .filter(|d| d.key.starts_with("booster") && d.key.contains("thrust"))
            .count()
    };
    let problems = keys(&planned(one));
    assert_eq!(problems, ["plan.keys[0]"]);
    let (_, cases) = scheme(&planned(&one.replace("\"structure.*\", ", "")));
    assert_eq!(cases, 2 * thrusts(&dispersion) as u64);
    let (corners, cases) = scheme(&planned("kind = \"corners\"\nresolution = 4"));
    let Scheme::Corners { draws, resolution: Some(4), .. } = corners else { panic!("{corners:?}") };
    // Resolution IV takes as many runs as the power of two at or above twice the factors.
    assert_eq!(cases, 2 * (draws.len() as u64).next_power_of_two());
    let (_, cases) = scheme(&planned("kind = \"saltelli\"\nrows = 3"));
    assert_eq!(cases, 3 * (dispersion.draws().len() as u64 + 2));
}

#[test]
fn plans_that_cannot_be_are_refused_with_their_keys() {
    let with = |plan: &str| keys(&format!("{REFERENCE}\n[plan]\n{plan}\n"));
    assert_eq!(with("kind = \"sobol\"\nreplicates = 7"), ["cases"]);
    assert_eq!(with("kind = \"sobol\"\nreplicates = 0"), ["plan.replicates"]);
    assert_eq!(with("kind = \"corners\"\nresolution = 3"), ["cases"]);
    assert_eq!(with("kind = \"lhs\""), ["plan.kind"]);
    assert_eq!(keys(&edited("cases = 2000", "")), ["cases"]);
    assert_eq!(keys(&planned("kind = \"corners\"")), ["plan.keys"]);
    assert_eq!(keys(&planned("kind = \"one_at_a_time\"\nat = [1, 1]")), ["plan.at"]);
    let nested =
        "kind = \"nested\"\nouter = 5\ninner = 20\nallowed_share_unstable = 0.1\nrisk = 0.1";
    // 22 good cases are needed, and the reference dispersion has no classes.
    assert_eq!(keys(&planned(nested)), ["plan.inner", "plan.kind"]);
}

#[test]
fn fixed_cases_hold_their_keys_and_free_some_in_the_cases_around_them() {
    let thrust = "booster.*.thrust @ vehicle";
    let more = format!(
        "\n[[fixed]]\nname = \"found\"\ncases = 7\nfree = [\"modes.m006.*\"]\n[fixed.values]\n\
         \"{thrust}\" = 1.02\n\"modes.m006.damping @ mode\" = 0.004\n"
    );
    let (Run { definition, .. }, dispersion) = read(&(REFERENCE.to_owned() + &more)).unwrap();
    let [case, cloud] = &definition.populations[4..] else { panic!("two more populations") };
    assert_eq!((case.name.as_str(), case.cases, case.drawn), ("found", 1, false));
    assert_eq!((cloud.name.as_str(), cloud.cases, cloud.drawn), ("found_dispersed", 7, true));
    let index = |key: &str| dispersion.index(key).unwrap();
    assert_eq!(cloud.fixed, [(index(thrust), 1.02)]);
    assert_eq!(case.fixed.len(), 2);
    assert!(case.fixed.contains(&(index("modes.m006.damping @ mode"), 0.004)));
    for (from, to, key) in [
        ("\"found\"", "\"adverse\"", "fixed[0].name"),
        ("\"found\"", "\"Found\"", "fixed[0].name"),
        (
            "booster.*.thrust @",
            "booster.*.trust @",
            "fixed[0].values.\"booster.*.trust @ vehicle\"",
        ),
        ("= 1.02", "= nan", "fixed[0].values.booster.*.thrust @ vehicle"),
        ("modes.m006.*", "modes.m0066.*", "fixed[0].free[0]"),
    ] {
        assert_eq!(keys(&(REFERENCE.to_owned() + &more.replacen(from, to, 1))), [key]);
    }
}

#[test]
fn derivatives_are_stored_where_the_run_asks_for_them() {
    let cut = REFERENCE.find("[[corner]]").unwrap();
    let with = |more: &str| format!("{}[sensitivity]\n{more}\n", &REFERENCE[..cut]);
    let rule = |more: &str| read(&with(more)).unwrap().0.definition.sensitivity.unwrap();
    let all = rule("");
    assert_eq!((all.variants.len(), all.flight_times.len(), all.cases), (5, 7, None));
    assert!(all.covers(4, 6, 1999));
    let some = rule("variants = [\"jet_damping\"]\nflight_times_s = [110.0]\ncases = 10");
    assert!(some.covers(3, 4, 9));
    assert!(!some.covers(3, 4, 10) && !some.covers(2, 4, 0) && !some.covers(3, 3, 0));
    assert_eq!(keys(&with("variants = [\"jet\"]")), ["sensitivity.variants[0]"]);
    assert_eq!(keys(&with("flight_times_s = [111.0]")), ["sensitivity.flight_times_s[0]"]);
}
