//! Same scenario and seed, same bytes; and a draw is a function of seed, key and case alone.

use crate::study::{Study, columns};
use std::collections::BTreeMap;

type Draws = BTreeMap<String, Vec<Option<u64>>>;

/// Draws and scores of the dispersed population, bit for bit, as `plan` writes them.
fn planned(study: &Study, run: &str, file: &str) -> Draws {
    let said = study.said(&["plan", run, "-o", file]);
    assert_eq!(said.code, 0, "{said:?}");
    let table = columns(&study.path(file));
    let dispersed: Vec<bool> =
        table.texts["population"].iter().map(|p| p.as_deref() == Some("dispersed")).collect();
    let draws = table.numbers.into_iter().filter(|(name, _)| name != "case");
    draws
        .map(|(name, values)| {
            let values = values.into_iter().zip(&dispersed).filter(|(_, chosen)| **chosen);
            (name, values.map(|(value, _)| value.map(f64::to_bits)).collect())
        })
        .collect()
}

#[test]
fn every_table_has_the_same_bytes_for_any_number_of_jobs_and_when_repeated() {
    let study = Study::new().with_corner();
    for poles in ["named", "all"] {
        let of = |name: &str, jobs: &str| {
            let folder = format!("{name}-{poles}-{jobs}");
            study.run(&folder, &["--jobs", jobs, "--poles", poles]);
            study.tables(&folder)
        };
        let one = of("first", "1");
        assert!(of("first", "2") == one && of("first", "3") == one && of("again", "2") == one);
    }
}

#[test]
fn the_place_of_the_files_changes_no_byte() {
    let (here, there) = (Study::new(), Study::new());
    here.run("result", &[]);
    let vehicle = there.path("vehicles/sls-like").display().to_string();
    there.edit("runs/smoke.toml", "../vehicles/sls-like", &vehicle);
    // The text of the run file is an input of the run, so its digest differs; its draws do not.
    let draws = |study: &Study| planned(study, "runs/smoke.toml", "draws.parquet");
    assert_eq!(draws(&here), draws(&there));
    there.edit("runs/smoke.toml", &vehicle, "../vehicles/sls-like");
    there.run("result", &[]);
    assert!(here.tables("result") == there.tables("result"));
}

#[test]
fn draws_do_not_depend_on_the_order_of_rows_nor_on_the_number_of_cases() {
    let study = Study::new();
    let plan = planned(&study, "runs/smoke.toml", "plain.parquet");
    assert!(plan.len() > 300 && plan.values().all(|values| values.len() == 6));

    let text = study.text("dispersions/reference.toml");
    let (head, rows) = text.split_once("[[row]]").unwrap();
    let mut rows: Vec<&str> = rows.split("[[row]]").collect();
    // A table `[[common]]` that stands between rows stays with the row before it.
    rows.reverse();
    rows.rotate_left(3);
    let shuffled: String = rows.iter().map(|row| format!("[[row]]{row}\n")).collect();
    std::fs::write(study.path("dispersions/reference.toml"), head.to_owned() + &shuffled).unwrap();
    assert_eq!(planned(&study, "runs/smoke.toml", "shuffled.parquet"), plan);

    study.edit("runs/smoke.toml", "cases = 6", "cases = 1100");
    let more = planned(&study, "runs/smoke.toml", "more.parquet");
    assert_eq!(more.len(), plan.len());
    for (name, values) in &more {
        assert_eq!((values.len(), &values[..6]), (1100, &plan[name][..]), "{name}");
    }
}

#[test]
fn another_seed_gives_other_draws_and_one_row_less_changes_no_other() {
    let study = Study::new();
    let plan = planned(&study, "runs/smoke.toml", "plain.parquet");
    let text = study.text("dispersions/reference.toml");
    let rows: Vec<&str> = text.split("[[row]]").collect();
    let kept: Vec<&str> =
        rows.iter().copied().filter(|row| !row.contains("actuator.*.damping")).collect();
    assert_eq!(kept.len() + 1, rows.len());
    std::fs::write(study.path("dispersions/reference.toml"), kept.join("[[row]]")).unwrap();
    let fewer = planned(&study, "runs/smoke.toml", "fewer.parquet");
    // Two boosters with two actuators, a draw and a score each.
    assert_eq!(fewer.len() + 8, plan.len());
    assert!(fewer.iter().all(|(name, values)| plan[name] == *values));
    study.edit("runs/smoke.toml", "seed = 1", "seed = 2");
    let other = planned(&study, "runs/smoke.toml", "other.parquet");
    assert!(fewer.iter().all(|(name, values)| other[name].iter().zip(values).all(|(a, b)| a != b)));
}

#[test]
fn a_replay_says_bit_for_bit_in_every_population_with_named_and_with_all_poles() {
    let study = Study::new().with_corner();
    for poles in ["named", "all"] {
        study.run(poles, &["--poles", poles]);
        for (population, case) in
            [("nominal", "0"), ("dispersed", "5"), ("adverse", "0"), ("adverse_dispersed", "2")]
        {
            let words = ["replay", poles, "--population", population, "--case", case];
            let said = study.said(&words);
            assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
            assert!(said.out.contains("bit for bit as stored"), "{}", said.out);
            let folder = format!("{poles}/replay/{population}-{case}");
            let matrices = columns(&study.path(&format!("{folder}/matrices.parquet")));
            let kinds: std::collections::BTreeSet<_> =
                matrices.texts["matrix"].iter().flatten().map(String::as_str).collect();
            assert_eq!(kinds, ["A", "D", "K", "M"].into());
        }
        // A replay inside the run's folder leaves the run whole, and can be repeated.
        assert_eq!(study.said(&["replay", poles, "--case", "5"]).code, 0);
        assert_eq!(study.said(&["summary", poles]).code, 0);
    }
}

#[test]
fn a_replay_needs_nothing_outside_the_folder_of_its_run() {
    let study = Study::new();
    study.edit("runs/smoke.toml", "cases = 6", "gates = \"reference.gates.toml\"\ncases = 3");
    // An absolute path, and folders reached through a link.
    let vehicle = study.path("vehicles/sls-like").display().to_string();
    study.edit("runs/smoke.toml", "../vehicles/sls-like", &vehicle);
    #[cfg(unix)]
    {
        std::fs::rename(study.path("dispersions"), study.path("elsewhere")).unwrap();
        std::os::unix::fs::symlink(study.path("elsewhere"), study.path("dispersions")).unwrap();
    }
    study.run("result", &[]);
    for folder in ["vehicles", "runs"] {
        std::fs::remove_dir_all(study.path(folder)).unwrap();
    }
    std::fs::rename(study.path("result"), study.path("moved")).unwrap();
    let said = study.said(&["replay", "moved", "--case", "1"]);
    assert!(said.code == 0 && said.out.contains("bit for bit as stored"), "{said:?}");
}
