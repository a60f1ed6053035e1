//! Tests of runs that are read back.

#![expect(clippy::disallowed_methods, reason = "tests damage files on purpose")]

use super::super::{manifest, summarise, synthetic};
use super::*;
use crate::campaign::pool::{Pool, spans};
use crate::campaign::row::rows;
use crate::campaign::{StoredPoles, synthetic as cases};
use std::fs;
use std::sync::atomic::AtomicBool;

fn finished(folder: &Path, populations: &[u64], poles: StoredPoles) -> PathBuf {
    let run = folder.join("run");
    synthetic::run(&run, cases::outline(populations, poles), 2).unwrap();
    run
}

#[test]
fn every_row_comes_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    for (name, poles) in [("named", StoredPoles::Named), ("all", StoredPoles::All)] {
        let path = finished(&folder.path().join(name), &[1, 1100, 40], poles);
        let run = Run::open(&path).unwrap();
        assert_eq!(*run.outline(), cases::outline(&[1, 1100, 40], poles));
        let definition = run.outline().definition.clone();
        let mut expected: Vec<Vec<ModeRow>> = vec![Vec::new(); 3];
        let mut draws: Vec<BTreeMap<u64, StoredDraws>> = vec![BTreeMap::new(); 3];
        Pool::new(2)
            .unwrap()
            .run(
                &definition,
                &spans(&definition.populations),
                |population, case| {
                    assert!(case != 19, "case 19 breaks");
                    cases::evaluate(&definition, population, case, poles)
                },
                |record| {
                    let (case, modes) = rows(&definition, record);
                    expected[case.population].extend(modes);
                    // A case that panicked has no draws.
                    let known = |values: &[Option<f64>]| -> Vec<Option<f64>> {
                        (0..2).map(|i| values.get(i).copied().flatten()).collect()
                    };
                    let stored =
                        StoredDraws { values: known(&case.values), scores: known(&case.scores) };
                    draws[case.population].insert(case.case, stored);
                    Ok::<(), ()>(())
                },
                |_| (),
                &AtomicBool::new(false),
            )
            .unwrap();
        for (population, expected) in expected.iter().enumerate() {
            let mut found = Vec::new();
            run.modes(population, 0..u64::MAX, |row| {
                found.push(row);
                Ok(())
            })
            .unwrap();
            assert_eq!(found, *expected);
            let all = draws[population].keys().copied();
            assert_eq!(run.draws(population, all).unwrap(), draws[population]);
        }
        let mut one = Vec::new();
        run.modes(1, 1030..1031, |row| {
            one.push(row);
            Ok(())
        })
        .unwrap();
        let of_case = expected[1].iter().filter(|row| row.case == 1030);
        assert!(one.iter().eq(of_case) && !one.is_empty());
    }
}

#[test]
fn the_summary_is_the_same_when_computed_again_within_any_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let outline = cases::outline(&[1, 1100, 40], StoredPoles::All);
    let stored = synthetic::run(&path, outline, 2).unwrap();
    let run = Run::open(&path).unwrap();
    for memory in [0, 200_000, summarise::MEMORY] {
        assert_eq!(summarise::summary(&run, memory).unwrap(), stored.summary);
    }
    assert_eq!(summarise::worst(&run, 3).unwrap(), stored.worst);
}

#[test]
fn a_table_cut_short_anywhere_is_damage_of_that_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = finished(folder.path(), &[1, 30], StoredPoles::Named);
    let run = Run::open(&path).unwrap();
    for table in TableName::of_run(run.outline()) {
        let file = path.join(table.file());
        let whole = fs::read(&file).unwrap();
        let last = (whole.len() - 20..whole.len()).rev();
        for length in (0..whole.len()).step_by(whole.len() / 40).chain(last) {
            fs::write(&file, &whole[..length]).unwrap();
            let problems = Run::open(&path).unwrap_err();
            assert_eq!(problems.kind(), Kind::Damage);
            assert!(problems.to_string().contains(&table.file()), "{problems}");
            // Nor does the Parquet reader go along with it where the size is not looked at.
            let problems = run.checked(table).err().unwrap();
            assert_eq!(problems.kind(), Kind::Damage);
        }
        fs::write(&file, &whole).unwrap();
    }
    Run::open(&path).unwrap();
}

#[test]
fn a_changed_byte_is_found_by_its_digest() {
    let folder = tempfile::tempdir().unwrap();
    let path = finished(folder.path(), &[1, 30], StoredPoles::Named);
    let file = path.join(TableName::Modes.file());
    let mut bytes = fs::read(&file).unwrap();
    bytes[1000] ^= 1;
    fs::write(&file, bytes).unwrap();
    let problems = Run::open(&path).unwrap_err();
    assert_eq!((problems.kind(), problems.0.len()), (Kind::Damage, 1));
    assert!(problems.to_string().contains("modes.parquet"));
}

#[test]
fn damaged_bytes_end_in_a_problem_or_in_rows_and_never_in_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = finished(folder.path(), &[1, 30], StoredPoles::Named);
    let run = Run::open(&path).unwrap();
    let file = path.join(TableName::Modes.file());
    let whole = fs::read(&file).unwrap();
    let mut found = 0;
    for index in (0..whole.len()).step_by(whole.len() / 300) {
        let mut bytes = whole.clone();
        bytes[index] = bytes[index].wrapping_add(0x55);
        fs::write(&file, bytes).unwrap();
        if let Err(problems) = run.modes(1, 0..30, |_| Ok(())) {
            assert_eq!(problems.kind(), Kind::Damage);
            found += 1;
        }
    }
    assert!(found > 0);
}

#[test]
fn missing_tables_are_named_all_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = finished(folder.path(), &[1], StoredPoles::Named);
    for table in [TableName::Cases, TableName::Worst] {
        fs::remove_file(path.join(table.file())).unwrap();
    }
    let problems = Run::open(&path).unwrap_err();
    assert_eq!((problems.kind(), problems.0.len()), (Kind::Damage, 2));
}

#[test]
fn tables_of_another_run_are_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = finished(folder.path(), &[1, 30], StoredPoles::Named);
    let other = finished(&folder.path().join("other"), &[1, 31], StoredPoles::Named);
    fs::copy(other.join(TableName::Cases.file()), path.join(TableName::Cases.file())).unwrap();
    assert_eq!(Run::open(&path).unwrap_err().kind(), Kind::Damage);
}

#[test]
fn an_unfinished_run_another_version_and_a_cut_manifest_are_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = finished(folder.path(), &[1, 5], StoredPoles::Named);
    assert_eq!(Run::open(&path.join("none")).unwrap_err().kind(), Kind::Input);
    let file = path.join(manifest::FILE);
    let text = fs::read_to_string(&file).unwrap();
    for length in (0..text.len() - 2).step_by(7) {
        fs::write(&file, &text[..length]).unwrap();
        let problems = Run::open(&path).unwrap_err();
        assert_eq!(problems.kind(), Kind::Damage);
        assert!(problems.to_string().contains(manifest::FILE));
    }
    fs::write(&file, text.replace("\"schema_version\": 2", "\"schema_version\": 99")).unwrap();
    let problems = Run::open(&path).unwrap_err().to_string();
    assert!(problems.contains("schema_version: found 99; allowed: 2"), "{problems}");
    let greedy = text.replace("\"cases\": 5", "\"cases\": 9007199254740991");
    assert_ne!(greedy, text);
    fs::write(&file, greedy).unwrap();
    assert_eq!(Run::open(&path).unwrap_err().kind(), Kind::Damage);
    fs::remove_file(&file).unwrap();
    assert!(Run::open(&path).unwrap_err().to_string().contains("unfinished"));
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(64))]
    #[test]
    fn an_altered_manifest_is_refused_or_tells_the_same_run(
        edits in proptest::collection::vec((0.0..1.0_f64, 0_usize..20, "[a-z0-9.,\\[\\]{}\":\n -]{0,6}"), 1..4)
    ) {
        static MADE: OnceLock<(tempfile::TempDir, PathBuf, String)> = OnceLock::new();
        let (place, path, text) = MADE.get_or_init(|| {
            let place = tempfile::tempdir().unwrap();
            let path = finished(place.path(), &[1, 5], StoredPoles::Named);
            let text = fs::read_to_string(path.join(manifest::FILE)).unwrap();
            (place, path, text)
        });
        let whole: Manifest = serde_json::from_str(text).unwrap();
        let mut letters: Vec<char> = text.chars().collect();
        for (at, length, put) in edits {
            let from = (at * letters.len() as f64) as usize;
            let to = (from + length).min(letters.len());
            letters.splice(from..to, put.chars());
        }
        let folder = tempfile::tempdir_in(place.path()).unwrap();
        fs::create_dir(folder.path().join("tables")).unwrap();
        for table in TableName::of_run(&whole.run) {
            fs::hard_link(path.join(table.file()), folder.path().join(table.file())).unwrap();
        }
        let altered: String = letters.into_iter().collect();
        fs::write(folder.path().join(manifest::FILE), altered).unwrap();
        match Run::open(folder.path()) {
            Ok(run) => proptest::prop_assert_eq!(run.outline(), &whole.run),
            Err(problems) => proptest::prop_assert_eq!(problems.kind(), Kind::Damage),
        }
    }
}
