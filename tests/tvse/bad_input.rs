//! Bad input: exit code, file, key, what was found and what is allowed; and nothing left behind.

use crate::study::Study;
use std::fs;
use tvse::io::package;
use tvse::structure::Thresholds;

const RUN: &str = "runs/smoke.toml";
const VEHICLE: &str = "vehicles/sls-like/vehicle.toml";
const TABLE: &str = "dispersions/reference.toml";

/// `tvse run` refuses the study with `code`, says each of `told` and leaves nothing behind.
fn refused(study: &Study, code: i32, told: &[&str]) {
    let before = study.everything();
    for command in ["check", "run"] {
        let said = study.said(&[command, RUN]);
        assert_eq!((said.code, said.out.as_str()), (code, ""), "{said:?}");
        for told in told {
            let lines = said.err.lines().filter(|line| line.contains(told)).count();
            assert_eq!(lines, 1, "{told}\n{}", said.err);
        }
        assert_eq!(study.everything(), before, "{told:?}");
    }
}

#[test]
fn wrong_entries_are_told_with_file_key_found_and_allowed() {
    for (file, from, to, told) in [
        (
            RUN,
            "seed = 1",
            "sead = 1",
            "smoke.toml: sead: found unknown key `sead`; allowed: did you mean `seed`?",
        ),
        (
            RUN,
            "seed = 1",
            "seed = \"1\"",
            "smoke.toml: seed: found text \"1\"; allowed: an integer ≥ 0",
        ),
        (
            RUN,
            "seed = 1",
            "seed = -1",
            "smoke.toml: seed: found integer -1; allowed: an integer ≥ 0",
        ),
        (
            RUN,
            "cases = 6",
            "cases = 1_000_000_000_000_000",
            "smoke.toml: cases: found integer 1000000000000000; allowed: an integer ≥ 1 and ≤ 1000000000",
        ),
        (
            RUN,
            "cases = 6",
            "cases = 0",
            "smoke.toml: cases: found integer 0; allowed: an integer ≥ 1",
        ),
        (
            RUN,
            "cases = 6",
            "",
            "smoke.toml: cases: found nothing; allowed: the number of dispersed cases",
        ),
        (
            RUN,
            "[110.0]",
            "[107.0]",
            "smoke.toml: flight_times_s[0]: found 107 s; allowed: a flight time of the vehicle",
        ),
        (
            RUN,
            "[110.0]",
            "[110.0, 110.0]",
            "smoke.toml: flight_times_s[1]: found 110 after 110; allowed: ascending",
        ),
        (
            RUN,
            "[110.0]",
            "[]",
            "smoke.toml: flight_times_s: found 0 entries; allowed: a list of at least 1",
        ),
        (
            RUN,
            "[\"tvse\"]",
            "[\"tvsé\"]",
            "smoke.toml: modes[0]: found \"tvsé\"; allowed: did you mean `tvse`?",
        ),
        (
            RUN,
            "[\"booster.*\"]",
            "[\"boster.*\"]",
            "smoke.toml: gimballed[0]: found \"boster.*\", which matches no engine; allowed: ",
        ),
        (
            RUN,
            "name = \"jet_damping\"",
            "name = \"no_jet_damping\"",
            "smoke.toml: variant[1].name: found \"no_jet_damping\" again; allowed: another name",
        ),
        (
            RUN,
            "name = \"jet_damping\"",
            "name = \"Düse\"",
            "smoke.toml: variant[1].name: found \"Düse\"; allowed: one or more of a–z",
        ),
        (
            RUN,
            "\"off\"",
            "\"of\"",
            "smoke.toml: variant[0].nozzle_jet_damping: found \"of\"; allowed: did you mean `off`?",
        ),
        (
            RUN,
            "../vehicles/sls-like",
            "../vehicles/sls",
            "smoke.toml: vehicle: found \"runs/../vehicles/sls\", which does not exist; allowed: a path",
        ),
        (RUN, "cases = 6", "cases = = 6", "smoke.toml: line 12: found "),
        (
            TABLE,
            "booster.*.nozzle.mass",
            "booster.*.nozzle.mas",
            "reference.toml: row[10].path: found \"booster.*.nozzle.mas\"",
        ),
        (
            TABLE,
            "level = \"booster\"",
            "level = \"boster\"",
            "reference.toml: row[7].level: found \"boster\"; allowed: for this path \"vehicle\", \"engine\", \"booster\"",
        ),
        (
            TABLE,
            "mean = 1.0",
            "mean = nan",
            "reference.toml: row[1].law.mean: found number NaN; allowed: a finite number",
        ),
        (TABLE, "three_sigma = 0.10", "three_sigma = -0.10", "reference.toml: row[1].law"),
        (
            VEHICLE,
            "mass_kg = 8100.0",
            "mass_kg = -8100.0",
            "vehicle.toml: engine[0].nozzle.mass_kg: found number -8100; allowed: a finite number > 0",
        ),
        (
            VEHICLE,
            "mass_kg = 8100.0",
            "mass_kg = inf",
            "vehicle.toml: engine[0].nozzle.mass_kg: found number inf; allowed: a finite number > 0",
        ),
        (
            VEHICLE,
            "mass_kg = 8100.0",
            "mass_kg = 81000.0",
            "vehicle.toml: engine[0].nozzle: found unablated a mass of 81000 kg",
        ),
        (
            VEHICLE,
            "\"booster.left.gimbal\"",
            "\"booster.left.gimbel\"",
            "vehicle.toml: engine[0].gimbal_grid: found ",
        ),
        (
            VEHICLE,
            "booster.left.case.*",
            "booster.left.cases.*",
            "vehicle.toml: engine[0].case_stations[0]: found ",
        ),
        (
            VEHICLE,
            "labels = [\"m006\"]",
            "labels = [\"m999\"]",
            "vehicle.toml: named_mode[0].labels",
        ),
        (
            VEHICLE,
            "name = \"SLS-like, synthetic\"",
            "name = \"\\u001b[31mred\"",
            "vehicle.toml: name: found \"\\u{1b}[31mred\"; allowed: a name on one line",
        ),
        (
            VEHICLE,
            "name = \"right\"",
            "name = \"left\"",
            "vehicle.toml: engine[1].name: found \"booster.left\" again",
        ),
        (
            VEHICLE,
            "thrust_direction = [-1.0, 0.0, 0.0]",
            "thrust_direction = [0.0, 0.0, 0.0]",
            "vehicle.toml: engine[0].thrust_direction: found ",
        ),
    ] {
        let study = Study::new();
        study.edit(file, from, to);
        refused(&study, 2, &[told]);
    }
}

#[test]
fn problems_of_all_files_are_told_at_once() {
    let study = Study::new();
    study.edit(RUN, "seed = 1", "seed = 1.5\ncolour = \"red\"");
    study.edit(RUN, "\"equation-13\"", "\"equation-31\"");
    study.edit(VEHICLE, "mass_kg = 8100.0", "mass_kg = 0.0");
    study.edit(VEHICLE, "burned_fraction = [0.1887,", "burned_fraction = [0.9887,");
    study.edit(TABLE, "source = ", "sauce = ");
    refused(
        &study,
        2,
        &[
            "smoke.toml: seed: found number 1.5",
            "smoke.toml: colour: found unknown key",
            "smoke.toml: variant[1].nozzle_jet_damping",
            "vehicle.toml: engine[0].nozzle.mass_kg",
            "vehicle.toml: motor[0].burned_fraction[1]: found 0.4772 after 0.9887; allowed: numbers that never fall",
            "reference.toml: row[0].sauce",
        ],
    );
}

#[test]
fn a_corner_must_not_share_its_name_with_another_population() {
    let corner = |name: &str, rest: &str| format!("[[corner]]\nname = \"{name}\"\n{rest}\n");
    let given = "signs = \"given\"\nlow = [\"booster.*.thrust\"]";
    let evaluated = "signs = \"evaluated\"\nmode = \"tvse\"\nvariant = \"jet_damping\"";
    for (first, second) in [("a", "a_dispersed"), ("a_dispersed", "a"), ("a", "a")] {
        let study = Study::new();
        study.append(RUN, &(corner(first, evaluated) + &corner(second, given)));
        refused(
            &study,
            2,
            &[&format!("smoke.toml: corner[1].name: found \"{second}\"; allowed: a name")],
        );
    }
    for name in ["nominal", "dispersed"] {
        let study = Study::new();
        study.append(RUN, &corner(name, given));
        refused(&study, 2, &["smoke.toml: corner[0].name"]);
    }
}

#[test]
fn files_that_cannot_be_read_are_told() {
    let study = Study::new();
    for (name, bytes) in
        [("bin.toml", &b"\xff\xfe"[..]), ("nul.toml", b"\0\0"), ("empty.toml", b"")]
    {
        fs::write(study.path(name), bytes).unwrap();
        let said = study.said(&["run", name]);
        assert!(said.code == 2 && said.err.starts_with(name), "{said:?}");
    }
    let deep = "a = ".to_owned() + &"[".repeat(100_000);
    fs::write(study.path("deep.toml"), deep).unwrap();
    let nested = format!("[{}]", vec!["a"; 50_000].join("."));
    fs::write(study.path("nested.toml"), nested).unwrap();
    for name in ["deep.toml", "nested.toml", "nowhere.toml", "runs"] {
        let said = study.said(&["run", name]);
        assert!(said.code == 2 && said.err.starts_with(name), "{said:?}");
        assert!(!said.err.contains("line 0"), "{said:?}");
    }
}

#[test]
fn a_modal_package_that_is_damaged_is_told_and_the_exit_code_is_three() {
    let study = Study::new();
    for table in ["grids", "mass", "modes", "parents", "shapes"] {
        let name = format!("modes/tables/{table}.parquet");
        let file = study.path(&format!("vehicles/sls-like/{name}"));
        let whole = fs::read(&file).unwrap();
        for length in [0, 10, whole.len() / 2, whole.len() - 1] {
            fs::write(&file, &whole[..length]).unwrap();
            refused(&study, 3, &[&name]);
        }
        fs::remove_file(&file).unwrap();
        refused(&study, 3, &[&name]);
        fs::write(&file, &whole).unwrap();
    }
    assert_eq!(study.said(&["check", RUN]).code, 0);
}

/// A study whose modal package is altered and written anew.
fn with_package(alter: impl FnOnce(&mut tvse::vehicle::Modal)) -> Study {
    let study = Study::new();
    let folder = study.path("vehicles/sls-like/modes");
    let mut modal = package::read(&folder).unwrap();
    alter(&mut modal);
    package::write(&folder, &modal, &Thresholds::default(), true).unwrap();
    study
}

#[test]
fn a_modal_package_that_does_not_fit_is_told() {
    // Shapes scaled to another normalisation, at one flight time.
    let study = with_package(|modal| {
        let set = modal.sets.iter_mut().find(|set| set.flight_time_s == 110.0).unwrap();
        for vector in set.modes.iter_mut().flat_map(|m| m.shape.iter_mut().chain(&mut m.slope)) {
            *vector *= 30.0;
        }
    });
    let told = "shapes.parquet: phi_x_per_sqrt_kg: found";
    let said = study.said(&["check", RUN]);
    assert_eq!(said.code, 2, "{said:?}");
    assert!(said.err.contains(told) && said.err.contains("unit generalised mass"), "{said:?}");
    // A header that claims one engine of six, and one that is no engine of the vehicle.
    let study = with_package(|modal| modal.contains_engines = vec!["booster.left".into()]);
    let said = study.said(&["run", RUN]);
    assert_eq!(said.code, 2, "{said:?}");
    assert!(said.err.contains("vehicle.toml: modal_package: found modes that contain"), "{said:?}");
    assert!(said.err.contains("not booster.right, core.1"), "{said:?}");
    let study = with_package(|modal| modal.contains_engines = vec!["booster.middle".into()]);
    let said = study.said(&["run", RUN]);
    assert!(said.code == 2 && said.err.contains("booster.middle"), "{said:?}");
    // Modes without the flight time of the run; the whole of the vehicle's is asked for.
    let study = with_package(|modal| {
        modal.sets.retain(|set| set.flight_time_s != 112.0);
    });
    let said = study.said(&["run", RUN]);
    assert!(said.code == 2 && said.err.contains("112"), "{said:?}");
    // Rows of shapes that the grids do not have.
    let study = Study::new();
    let tables = study.path("vehicles/sls-like/modes/tables");
    let other = with_package(|modal| {
        for set in &mut modal.sets {
            set.grids.pop();
            for mode in &mut set.modes {
                mode.shape.pop();
                mode.slope.pop();
            }
        }
    });
    fs::copy(
        other.path("vehicles/sls-like/modes/tables/grids.parquet"),
        tables.join("grids.parquet"),
    )
    .unwrap();
    let header = study.text("vehicles/sls-like/modes/package.toml");
    let (header, _) = header.split_once("[blake3]").unwrap();
    fs::write(study.path("vehicles/sls-like/modes/package.toml"), header).unwrap();
    refused_once(&study, 3, "shapes.parquet: grid: found ");
}

/// As [`refused`], where many rows may tell the same.
fn refused_once(study: &Study, code: i32, told: &str) {
    let before = study.everything();
    let said = study.said(&["run", RUN]);
    assert!(said.code == code && said.err.contains(told), "{said:?}");
    assert_eq!(study.everything(), before);
}

#[test]
fn outputs_that_exist_or_cannot_be_made_are_told_and_left_alone() {
    let study = Study::new();
    fs::create_dir(study.path("taken")).unwrap();
    fs::write(study.path("taken/mine.txt"), "mine").unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("nowhere", study.path("link")).unwrap();
    let before = study.everything();
    let mut outputs = vec!["taken", "taken/mine.txt", "runs/smoke.toml/below", "."];
    if cfg!(unix) {
        outputs.push("link");
    }
    if cfg!(target_os = "linux") {
        outputs.push("/proc/tvse");
    }
    for output in outputs {
        for words in [
            &["run", RUN, "-o", output][..],
            &["plan", RUN, "-o", output],
            &["modes", "vehicles/sls-like/stick.toml", "-o", output, "--times", "110"],
            &["init", output],
        ] {
            let said = study.said(words);
            assert_eq!((said.code, said.out.as_str()), (2, ""), "{words:?}: {said:?}");
            assert!(said.err.contains("found "), "{said:?}");
            assert_eq!(study.everything(), before, "{words:?}");
        }
    }
    let said = study.said(&["run", RUN, "-o", "taken"]);
    assert!(said.err.contains("taken: found something that exists; allowed: "), "{said:?}");
}

#[test]
fn options_out_of_range_are_told() {
    let study = Study::new();
    let before = study.everything();
    for (option, value) in [
        ("--cases", "0"),
        ("--cases", "-1"),
        ("--cases", "1000000000000000"),
        ("--cases", "18446744073709551615"),
        ("--jobs", "0"),
        ("--jobs", "100000"),
        ("--seed", "-1"),
        ("--seed", "1.5"),
        ("--seed", "18446744073709551616"),
        ("--poles", "some"),
    ] {
        let said = study.said(&["run", RUN, option, value]);
        assert_eq!(said.code, 2, "{said:?}");
        let told = format!("invalid value '{value}' for '{option}");
        assert!(said.err.contains(&told), "{}", said.err);
        assert_eq!(study.everything(), before);
    }
}
