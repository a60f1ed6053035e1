//! Cases that fail are rows with a reason; the run goes on, and no table holds NaN.

use crate::answers::integrated_study;
use crate::study::{Study, TABLES, columns};
use tvse::io::Run;

/// Kind and message of the failures of the dispersed population.
fn failures(study: &Study) -> Vec<Option<(&'static str, String)>> {
    let run = Run::open(&study.path("result")).unwrap();
    let mut failures = Vec::new();
    run.cases(1, &[], |_, _, failure| {
        failures.push(failure.map(|f| (f.kind.name(), f.message)));
        Ok(())
    })
    .unwrap();
    failures
}

fn nothing_is_nan(study: &Study) {
    for table in TABLES {
        let table = columns(&study.path(&format!("result/tables/{table}.parquet")));
        for (name, values) in table.numbers {
            assert!(values.iter().flatten().all(|value| value.is_finite()), "{name}");
        }
    }
}

#[test]
fn impossible_draws_are_rows_with_their_reason_and_the_run_succeeds() {
    let study = Study::new();
    let table = study.text("dispersions/reference.toml");
    let at = table.find("path = \"booster.*.nozzle.inertia\"").unwrap();
    let law = "law = { kind = \"truncated_normal\", mean = 1.0, three_sigma = 0.06, low_sigma = -3.0, high_sigma = 3.0 }";
    let wild = "law = { kind = \"normal\", mean = 1.0, sigma = 1.0 }";
    let text = table[..at].to_owned() + &table[at..].replacen(law, wild, 1);
    std::fs::write(study.path("dispersions/reference.toml"), text).unwrap();
    let story = study.run("result", &["--cases", "20"]);
    let failures = failures(&study);
    let failed: Vec<_> = failures.iter().flatten().collect();
    // J_c = J − m r² is negative where the inertia is drawn below some fifth of its nominal, with
    // two boosters in about two cases of five.
    assert!((3..=15).contains(&failed.len()), "{failed:?}");
    for (kind, message) in &failed {
        assert_eq!(*kind, "draw");
        assert!(message.contains("booster.") && message.contains("nozzle"), "{message}");
    }
    assert!(story.contains(&format!("20 cases, {} failed", failed.len())), "{story}");
    let modes = columns(&study.path("result/tables/modes.parquet"));
    let status = &modes.texts["status"];
    for (row, status) in status.iter().enumerate() {
        let ok = status.as_deref() == Some("ok");
        assert_eq!(modes.numbers["pole_re_rad_s"][row].is_some(), ok);
    }
    // Two variants at one flight time.
    assert_eq!(status.iter().filter(|s| s.as_deref() == Some("draw")).count(), 2 * failed.len());
    let summary = columns(&study.path("result/tables/summary.parquet"));
    let population = summary.texts["population"].iter().map(|p| p.as_deref() == Some("dispersed"));
    for (_, counts) in population.zip(summary.numbers["failures"].iter()).filter(|(d, _)| *d) {
        assert_eq!(counts.unwrap() as usize, failed.len());
    }
    nothing_is_nan(&study);
    let case = failures.iter().position(Option::is_some).unwrap().to_string();
    let said = study.said(&["replay", "result", "--case", &case]);
    assert!(said.code == 0 && said.out.contains("bit for bit"), "{said:?}");
}

#[test]
fn a_mass_matrix_that_is_not_positive_definite_is_a_row_with_its_reason() {
    let study = integrated_study();
    // Modes that hold the engines keep their unit mass while the drawn shape of the gimbal, and
    // with it the coupling to the nozzle, is far beyond what the modes can carry.
    let law = "[[row]]\npath = \"booster.*.gimbal.*.shape\"\nlevel = \"vehicle\"\napply = \"absolute\"\n\
               unit = \"1\"\nsource = \"E\"\n\
               law = { kind = \"discrete\", values = [1.0, 60.0], weights = [0.5, 0.5] }\n";
    std::fs::write(study.path("dispersions/reference.toml"), law).unwrap();
    let story = study.run("result", &["--cases", "12"]);
    let failures = failures(&study);
    let failed: Vec<_> = failures.iter().flatten().collect();
    assert!((1..12).contains(&failed.len()), "{failed:?}");
    for (kind, message) in &failed {
        assert_eq!(*kind, "singular_mass");
        assert!(message.contains("not positive definite"), "{message}");
    }
    assert!(story.contains(&format!("12 cases, {} failed", failed.len())), "{story}");
    nothing_is_nan(&study);
}

#[test]
fn numbers_beyond_every_model_are_rows_with_their_reason_and_do_not_hang() {
    for (values, kind) in [("1e300", "non_finite"), ("1e100", "residual")] {
        let study = Study::new();
        let law = format!(
            "[[row]]\npath = \"booster.left.actuator.rock.stiffness\"\nlevel = \"actuator\"\n\
             apply = \"scale\"\nsource = \"E\"\n\
             law = {{ kind = \"discrete\", values = [1.0, {values}], weights = [0.5, 0.5] }}\n"
        );
        std::fs::write(study.path("dispersions/reference.toml"), law).unwrap();
        study.run("result", &["--cases", "12"]);
        let failures = failures(&study);
        let kinds: Vec<_> = failures.iter().flatten().map(|(kind, _)| *kind).collect();
        assert!(!kinds.is_empty() && kinds.len() < 12, "{kinds:?}");
        assert!(kinds.iter().all(|found| *found == kind), "{failures:?}");
        nothing_is_nan(&study);
    }
}

#[test]
fn a_nominal_vehicle_that_cannot_be_solved_is_wrong_input_and_leaves_nothing() {
    let study = Study::new();
    let stiff = "stiffness_n_m_rad = 3.76e7";
    study.edit("vehicles/sls-like/vehicle.toml", stiff, "stiffness_n_m_rad = 1e300");
    let before = study.everything();
    for command in ["nominal", "run"] {
        let said = study.said(&[command, "runs/smoke.toml"]);
        assert_eq!(said.code, 2, "{said:?}");
        assert!(said.err.starts_with("runs/smoke.toml: found ") && said.err.contains("not finite"));
        assert_eq!(study.everything(), before);
    }
}
