//! Damaged runs: every command that reads one ends with exit code 3 and names the file.

use crate::study::{Study, TABLES};
use std::fs;

/// Both readers of a run refuse it as damaged, naming all of `names`.
fn refused(study: &Study, names: &[&str]) {
    for words in [&["summary", "result"][..], &["replay", "result", "--case", "0"]] {
        let said = study.said(words);
        assert_eq!(said.code, 3, "{words:?}: {said:?}");
        assert_eq!(said.out, "");
        assert!(names.iter().all(|name| said.err.contains(name)), "{names:?}: {}", said.err);
        assert!(!said.err.contains("panicked"), "{}", said.err);
    }
}

#[test]
fn tables_that_are_cut_short_missing_or_swapped_are_named() {
    let study = Study::new();
    study.run("result", &[]);
    for table in TABLES {
        let file = study.path(&format!("result/tables/{table}.parquet"));
        let name = format!("result/tables/{table}.parquet: found ");
        let whole = fs::read(&file).unwrap();
        for length in [0, 3, 8, whole.len() / 2, whole.len() - 1] {
            fs::write(&file, &whole[..length]).unwrap();
            refused(&study, &[&name, &format!("allowed: {} bytes", whole.len())]);
        }
        let mut changed = whole.clone();
        changed[whole.len() / 3] ^= 4;
        fs::write(&file, &changed).unwrap();
        refused(&study, &[&name, "BLAKE3"]);
        fs::remove_file(&file).unwrap();
        refused(&study, &[&name]);
        fs::write(&file, &whole).unwrap();
    }
    for table in ["cases", "worst"] {
        fs::remove_file(study.path(&format!("result/tables/{table}.parquet"))).unwrap();
    }
    refused(&study, &["cases.parquet", "worst.parquet"]);
}

#[test]
fn a_manifest_that_is_missing_cut_short_old_or_altered_is_named() {
    let study = Study::new().with_corner();
    study.run("result", &[]);
    let file = study.path("result/manifest.json");
    let text = fs::read_to_string(&file).unwrap();
    for altered in [
        "",
        "{}",
        "[]",
        "null",
        &text[..text.len() / 2],
        &text.replacen("\"schema_version\": 2", "\"schema_version\": 0", 1),
        &text.replacen("\"schema_version\": 2", "\"schema_version\": \"2\"", 1),
    ] {
        fs::write(&file, altered).unwrap();
        refused(&study, &["result/manifest.json: "]);
    }
    // The first draw that the corner holds.
    let held = "\"fixed\": [\n            [\n              ";
    let start = text.find(held).expect("a corner") + held.len();
    let end = start + text[start..].find(',').expect("index and value");
    let held = format!("\n              {},\n", &text[start..end]);
    // Altered so that it still reads: the tables know better.
    for (from, to) in [
        ("\"seed\": 1", "\"seed\": 2"),
        ("\"exchange_ratio\": 0.5", "\"exchange_ratio\": 0.0"),
        ("110.0", "95.0"),
        ("\"poles\": \"named\"", "\"poles\": \"all\""),
        ("\"inputs\": [", "\"inputs\": [], \"unknown\": ["),
        ("\"gimballed\": [\n", "\"gimballed\": [ true ], \"unknown\": [\n"),
        (held.as_str(), "\n              9999,\n"),
        ("\"run.toml\"", "\"../../../etc/passwd\""),
    ] {
        assert!(text.contains(from), "{from} is not in\n{}", &text[..2000]);
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        refused(&study, &["result/tables/cases.parquet: found another `tvse.run`"]);
    }
    fs::remove_file(&file).unwrap();
    refused(&study, &["result/manifest.json: found no manifest"]);
}

#[test]
fn altered_copies_of_the_inputs_are_named_all_at_once() {
    let study = Study::new();
    study.run("result", &[]);
    let replay = || study.said(&["replay", "result", "--case", "0"]);
    let shapes = study.path("result/inputs/modes/tables/shapes.parquet");
    let whole = fs::read(&shapes).unwrap();
    fs::write(&shapes, &whole[..whole.len() / 2]).unwrap();
    study.append("result/inputs/vehicle.toml", "# edited\n");
    fs::remove_file(study.path("result/inputs/run.toml")).unwrap();
    let said = replay();
    assert_eq!(said.code, 3, "{said:?}");
    let files: Vec<&str> =
        said.err.lines().map(|line| line.split(": found").next().unwrap()).collect();
    let names = ["run.toml", "vehicle.toml", "modes/tables/shapes.parquet"];
    assert_eq!(files, names.map(|name| format!("result/inputs/{name}")));
    fs::remove_dir_all(study.path("result/inputs")).unwrap();
    assert_eq!(replay().code, 3);
    // The tables are whole: the story can still be told.
    assert_eq!(study.said(&["summary", "result"]).code, 0);
}

#[test]
fn a_run_that_is_none_and_a_case_that_is_none_are_wrong_usage() {
    let study = Study::new();
    study.run("result", &[]);
    for (words, told) in [
        (&["summary", "nowhere"][..], "nowhere: found no such folder"),
        (&["summary", "runs/smoke.toml"], "runs/smoke.toml: found no such folder"),
        (&["replay", "result", "--case", "6"], "--case: found 6; allowed: below 6"),
        (&["replay", "result", "--case", "-1"], "invalid value '-1' for '--case"),
        (
            &["replay", "result", "--case", "0", "--population", "dispresed"],
            "--population: found \"dispresed\"; allowed: did you mean `dispersed`?",
        ),
        (&["replay", "result", "--case", "0", "-o", "runs"], "runs: found something that exists"),
        (&["gate", "result", "--gates", "nowhere.toml"], "nowhere.toml"),
    ] {
        let said = study.said(words);
        assert_eq!(said.code, 2, "{said:?}");
        assert!(said.err.contains(told), "{}", said.err);
    }
    // A folder that is no run holds no manifest.
    let said = study.said(&["summary", "runs"]);
    assert!(said.code == 3 && said.err.contains("manifest.json"), "{said:?}");
}
