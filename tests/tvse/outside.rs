//! What a scenario from somebody else may not do: reach for files outside its study.

use crate::study::Study;

#[test]
fn a_path_that_leaves_the_study_is_refused_unless_it_is_allowed() {
    let (study, other) = (Study::new(), Study::new());
    let vehicle = other.path("vehicles/sls-like").display().to_string();
    let plain = study.text("runs/smoke.toml");
    let far = "../".repeat(40);
    let climbing = format!("{far}{}", vehicle.trim_start_matches('/'));
    for path in [vehicle.as_str(), &climbing, "../../study/../elsewhere", "/etc/passwd"] {
        std::fs::write(study.path("runs/smoke.toml"), &plain).unwrap();
        study.edit("runs/smoke.toml", "../vehicles/sls-like", path);
        for command in ["check", "plan", "nominal", "run"] {
            let said = study.said(&[command, "runs/smoke.toml"]);
            assert_eq!(said.code, 2, "{said:?}");
            assert!(said.err.contains("vehicle: found ") && said.err.contains("--allow-outside"));
        }
    }
    std::fs::write(study.path("runs/smoke.toml"), &plain).unwrap();
    study.edit("runs/smoke.toml", "../vehicles/sls-like", &vehicle);
    assert_eq!(study.said(&["check", "runs/smoke.toml", "--allow-outside"]).code, 0);
    let run = ["run", "runs/smoke.toml", "-o", "result", "--cases", "2", "--allow-outside"];
    assert_eq!(study.said(&run).code, 0);
    // The copies in the run's folder need nothing outside.
    assert_eq!(study.said(&["replay", "result", "--case", "1"]).code, 0);
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_out_of_the_study_is_refused() {
    let (study, other) = (Study::new(), Study::new());
    std::fs::remove_dir_all(study.path("vehicles/sls-like/modes")).unwrap();
    let modes = other.path("vehicles/sls-like/modes");
    std::os::unix::fs::symlink(&modes, study.path("vehicles/sls-like/modes")).unwrap();
    let said = study.said(&["check", "runs/smoke.toml"]);
    assert!(said.code == 2 && said.err.contains("modal_package: found "), "{said:?}");
    assert_eq!(study.said(&["check", "runs/smoke.toml", "--allow-outside"]).code, 0);
}
