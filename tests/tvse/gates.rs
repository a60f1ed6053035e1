//! Gates from outside: what they write for CI systems, and the difference to a baseline run.

use crate::study::{Study, columns, said, tvse};
use std::fs;

/// Damping of a variant in this run less that in the baseline run.
const REGRESSION: &str = r#"
[[gate]]
id = "no-case-loses-damping"
metric = "damping_ratio"
variant = "jet_damping"
mode = "tvse"
baseline_run = true
statistic = "minimum"
at_least_percent = -0.02
rationale = "the change is not meant for this mode <b>"
"#;

/// A study with the run `before`, the same again as `same`, one whose variant `jet_damping` has none as
/// `worse`, and one with other draws as `other`.
fn runs() -> Study {
    let study = Study::new();
    study.run("before", &[]);
    study.run("same", &["--jobs", "2"]);
    study.run("other", &["--seed", "2"]);
    study.edit("runs/smoke.toml", "case_jet_damping = true", "case_jet_damping = false");
    study.run("worse", &[]);
    fs::write(study.path("regression.toml"), REGRESSION).unwrap();
    study
}

#[test]
fn a_regression_gate_holds_a_run_against_another_one_on_the_same_draws() {
    let study = runs();
    let compare = |run: &str| {
        let words = ["compare", run, "before", "--gates", "regression.toml"];
        said(&study.path(""), &words)
    };
    let same = compare("same");
    assert_eq!((same.code, same.err.as_str()), (0, ""), "{same:?}");
    let worse = compare("worse");
    assert_eq!(worse.code, 1, "{worse:?}");
    assert!(worse.out.contains("6 of 6 cases count against the gate"), "{}", worse.out);
    // What the gate says is what the two tables say.
    let least = |run: &str| -> Vec<f64> {
        let table = columns(&study.path(&format!("{run}/tables/cases.parquet")));
        let values = &table.numbers["damping_ratio_min_jet_damping_tvse"];
        values.iter().map(|value| value.unwrap()).collect()
    };
    let cases = least("worse").into_iter().zip(least("before")).skip(1);
    let expected = cases.map(|(worse, before)| worse - before).fold(f64::INFINITY, f64::min);
    let report: serde_json::Value =
        serde_json::from_str(&study.text("worse/baseline_gates.json")).unwrap();
    let found = report["gates"][0]["value"].as_f64().unwrap() / 100.0;
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    // Other draws are no baseline, and a gate that needs one is told where there is none.
    let other = compare("other");
    assert_eq!(other.code, 2);
    assert!(other.err.contains("allowed: the same"), "{}", other.err);
    let alone = said(&study.path(""), &["gate", "worse", "--gates", "regression.toml"]);
    assert_eq!(alone.code, 2);
    assert!(alone.err.contains("gate[0].baseline_run: found no baseline run"), "{}", alone.err);
    let words = ["gate", "worse", "--gates", "regression.toml", "--baseline", "before"];
    assert_eq!(said(&study.path(""), &words).code, 1);
    // Gates of the run alone leave those outcomes, and are left by them.
    let kept = study.text("worse/baseline_gates.json");
    assert!(!study.path("worse/gates.json").exists());
    fs::write(
        study.path("own.toml"),
        "[[gate]]\nid = \"own\"\nmetric = \"damping_ratio\"\nvariant = \"jet_damping\"\nmode = \"tvse\"\n\
         statistic = \"minimum\"\nat_least_percent = -50.0\nrationale = \"of the run alone\"\n",
    )
    .unwrap();
    let own = said(&study.path(""), &["gate", "worse", "--gates", "own.toml"]);
    assert_eq!(own.code, 0, "{own:?}");
    let alone = study.text("worse/gates.json");
    compare("worse");
    assert_eq!(study.text("worse/gates.json"), alone);
    assert_eq!(study.text("worse/baseline_gates.json"), kept);
}

#[test]
fn outcomes_go_where_ci_systems_look() {
    let study = runs();
    fs::write(study.path("summary.md"), "# Job\n").unwrap();
    let words =
        "compare worse before --gates regression.toml --junit gates.xml --markdown gates.md";
    let words: Vec<&str> = words.split(' ').collect();
    let mut command = tvse(&study.path(""), &words);
    command.env("GITHUB_ACTIONS", "true").env("GITHUB_STEP_SUMMARY", study.path("summary.md"));
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let printed = String::from_utf8(output.stdout).unwrap();
    let annotations = printed.lines().filter(|line| line.starts_with("::error "));
    assert_eq!(annotations.count(), 1, "{printed}");
    let xml = study.text("gates.xml");
    assert!(xml.contains("failures=\"1\"") && xml.contains("name=\"no-case-loses-damping\""));
    assert!(xml.contains("limit ≥ -0.02 %") && xml.contains("tvse replay worse"), "{xml}");
    let markdown = study.text("gates.md");
    assert!(markdown.contains("❌ fail") && !markdown.contains("<b>"), "{markdown}");
    assert_eq!(study.text("summary.md"), format!("# Job\n{markdown}"));
    // Every case that counts against the gate is stored, the worst first, and can be replayed.
    let stored = columns(&study.path("worse/baseline_gate_offenders.parquet"));
    let (cases, values) = (&stored.numbers["case"], &stored.numbers["value"]);
    assert_eq!(cases.len(), 6);
    assert!(values.is_sorted_by(|a, b| a <= b) && values[0] < Some(-0.0002), "{values:?}");
    let case = cases[0].unwrap().to_string();
    let replay = said(&study.path(""), &["replay", "worse", "--case", &case]);
    assert!(replay.out.contains("bit for bit"), "{replay:?}");
}
