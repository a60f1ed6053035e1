//! Tests of runs that are interrupted, shared out, damaged and gone on with.

#![expect(clippy::disallowed_methods, reason = "tests damage files on purpose")]

use super::super::fault::{self, Fault};
use super::super::results::{Opening, Results};
use super::super::synthetic;
use super::*;
use crate::campaign::{StoredPoles, synthetic as cases};
use crate::dispersion::Scheme;
use std::fs;
use tempfile::TempDir;

const CASES: [u64; 3] = [1, 300, 70];

fn outline() -> Outline {
    cases::outline(&CASES, StoredPoles::All)
}

/// A folder and the tables of an uninterrupted run on one thread.
fn plain() -> (TempDir, Vec<Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("plain");
    synthetic::run(&run, outline(), 1).unwrap();
    let tables = tables(&run);
    (folder, tables)
}

/// A folder on a file system that syncs at once, where there is one.
fn in_memory() -> TempDir {
    let memory = tempfile::tempdir_in("/dev/shm");
    memory.unwrap_or_else(|_| tempfile::tempdir().unwrap())
}

fn tables(run: &Path) -> Vec<Vec<u8>> {
    let tables = TableName::of_run(&outline());
    tables.iter().map(|table| fs::read(run.join(table.file())).unwrap()).collect()
}

fn shards(run: &Path) -> Vec<PathBuf> {
    let place = run.join(shard::FOLDER);
    files::names(&place).unwrap().into_iter().map(|name| place.join(name)).collect()
}

/// Stops a new run after so many cases; what it has is on the disk.
fn stopped(run: &Path, after: u64) {
    let results = Results::create(run, outline()).unwrap();
    synthetic::evaluate(results, 2, after).unwrap();
}

#[test]
fn a_run_that_was_stopped_goes_on_and_has_the_bytes_of_one_that_was_not() {
    let (folder, expected) = plain();
    for (index, jobs) in [(0, 1), (1, 2), (2, 7)] {
        let run = folder.path().join(format!("run-{index}"));
        stopped(&run, 30 + 100 * index);
        assert!(Run::open(&run).unwrap_err().to_string().contains("unfinished"));
        let before: u64 = status(&run, false).unwrap().done;
        assert!(before > 30 && before < 371);
        // Stopped again, and nothing that is finished is evaluated again.
        let again = Opening::Resume { cases: true };
        let results = Results::open(&run, outline(), None, again, Access::Whole).unwrap();
        let missing: u64 =
            results.store().missing().iter().map(|s| s.cases.end - s.cases.start).sum();
        assert_eq!(missing, 371 - before);
        drop(synthetic::evaluate(results, jobs, 50).unwrap());
        synthetic::resume(&run, outline(), jobs).unwrap();
        assert_eq!(tables(&run), expected);
        // A finished run holds nothing else.
        assert_eq!(files::names(&run).unwrap(), ["manifest.json", "tables"]);
    }
}

#[test]
fn any_fault_at_any_step_leaves_a_run_that_goes_on_to_the_same_bytes() {
    let folder = in_memory();
    let outline = || cases::outline(&[1, 70, 20], StoredPoles::All);
    let counted = folder.path().join("counted");
    fault::inject(None);
    synthetic::run(&counted, outline(), 1).unwrap();
    let steps = fault::taken();
    let expected = tables(&counted);
    assert!(steps > 100, "{steps}");
    for fault in [Fault::Full, Fault::Power] {
        for step in 0..steps {
            let run = folder.path().join("run");
            fault::inject(Some((step, fault)));
            let failed = synthetic::run(&run, outline(), 1).is_err();
            fault::inject(None);
            // Text of the lock is all that may be lost without a word.
            assert!(failed || fault == Fault::Full, "{step}");
            if failed && fault == Fault::Full {
                let asides = |folder: &Path| -> usize {
                    let names = files::names(folder).unwrap();
                    names.iter().filter(|name| name.starts_with(files::ASIDE)).count()
                };
                assert_eq!(asides(&run), 0, "step {step}");
            }
            synthetic::resume(&run, outline(), 2)
                .unwrap_or_else(|problems| panic!("{fault:?} at step {step}: {problems}"));
            assert_eq!(tables(&run), expected, "{fault:?} at step {step}");
            let names = files::names(&run).unwrap();
            assert_eq!(names, ["manifest.json", "tables"], "{fault:?} at step {step}");
            fs::remove_dir_all(&run).unwrap();
        }
    }
}

#[test]
fn parts_in_any_order_and_number_give_the_same_bytes_and_repeat_without_work() {
    let (folder, expected) = plain();
    for of in [1, 2, 3, 8, 400] {
        let run = folder.path().join(format!("run-{of}"));
        let numbers = (1..=of).rev().step_by(2).chain((1..=of).step_by(2));
        for number in numbers {
            synthetic::part(&run, outline(), Part { number, of }).unwrap();
        }
        let left = Store::gather(&run, &[]).unwrap().missing();
        for number in status(&run, false).unwrap().parts_left(of) {
            synthetic::part(&run, outline(), Part { number, of }).unwrap();
        }
        assert_eq!(left.is_empty(), of % 2 == 0 || of == 1, "{left:?}");
        let before = shards(&run);
        synthetic::part(&run, outline(), Part { number: 1, of }).unwrap();
        assert_eq!(shards(&run), before);
        synthetic::merge(&run, &[]).unwrap();
        assert_eq!(tables(&run), expected, "{of} parts");
        assert_eq!(files::names(&run).unwrap(), ["manifest.json", "tables"]);
    }
}

#[test]
fn parts_of_several_folders_are_merged_and_foreign_or_doubled_ones_are_named() {
    let (folder, expected) = plain();
    let place = |number: u64| folder.path().join(format!("part-{number}"));
    for number in 1..=3 {
        synthetic::part(&place(number), outline(), Part { number, of: 3 }).unwrap();
    }
    let merged = folder.path().join("merged");
    let twice = [place(1), place(2), place(1)];
    let problems = Store::gather(&merged, &twice).unwrap_err();
    assert!(problems.to_string().contains("disjoint"), "{problems}");
    let two = Store::gather(&merged, &[place(1), place(2)]).unwrap();
    assert_eq!(two.missing().iter().map(|s| s.cases.end - s.cases.start).sum::<u64>(), 124);
    drop(two);
    let mut other = outline();
    other.definition.seed += 1;
    let foreign = folder.path().join("foreign");
    synthetic::part(&foreign, other, Part { number: 3, of: 3 }).unwrap();
    let problems = Store::gather(&merged, &[place(1), place(2), foreign]).unwrap_err();
    assert!(problems.to_string().contains("seed: found 8; allowed: 7"), "{problems}");
    synthetic::merge(&merged, &[place(1), place(2), place(3)]).unwrap();
    assert_eq!(tables(&merged), expected);
    // The parts stay as they are.
    assert!((1..=3).all(|number| !shards(&place(number)).is_empty()));
}

#[test]
fn corrupted_truncated_swapped_and_renamed_shards_are_found_by_name_and_evaluated_again() {
    let (folder, expected) = plain();
    let kept = folder.path().join("kept");
    stopped(&kept, u64::MAX);
    let mut foreign = outline();
    foreign.definition.seed += 1;
    let other = folder.path().join("other");
    synthetic::evaluate(Results::create(&other, foreign).unwrap(), 1, u64::MAX).unwrap();
    type Damage = fn(&Path, &Path, &Path);
    let damages: [(&str, Damage); 7] = [
        ("cut", |shard, _, _| {
            let bytes = fs::read(shard).unwrap();
            fs::write(shard, &bytes[..bytes.len() / 2]).unwrap();
        }),
        ("emptied", |shard, _, _| fs::write(shard, "").unwrap()),
        ("longer", |shard, _, _| {
            fs::write(shard, [fs::read(shard).unwrap(), vec![0]].concat()).unwrap();
        }),
        ("header", |shard, _, _| {
            let mut bytes = fs::read(shard).unwrap();
            bytes[120] ^= 1;
            fs::write(shard, bytes).unwrap();
        }),
        ("bytes", |shard, _, _| {
            let mut bytes = fs::read(shard).unwrap();
            let at = bytes.len() * 2 / 3;
            bytes[at] ^= 1;
            fs::write(shard, bytes).unwrap();
        }),
        ("swapped", |shard, neighbour, _| {
            fs::copy(neighbour, shard).unwrap();
        }),
        ("of another run", |shard, _, foreign| {
            fs::copy(foreign, shard).unwrap();
        }),
    ];
    for (what, damage) in damages {
        let run = folder.path().join("run");
        copy(&kept, &run);
        let all = shards(&run);
        let foreign = other.join(all[3].strip_prefix(&run).unwrap());
        damage(&all[3], &all[4], &foreign);
        let name = files::name(&all[3]);
        let damaged = status(&run, false).unwrap().damaged.to_string();
        // Bytes behind the header are read where it is asked for.
        assert_eq!(damaged.contains(&name), what != "bytes", "{what}: {damaged}");
        let verified = status(&run, true).unwrap();
        assert!(verified.damaged.to_string().starts_with(&name), "{what}: {}", verified.damaged);
        assert_eq!(verified.missing.len(), 1, "{what}");
        let problems = Store::gather(&run, &[]).unwrap_err();
        assert_eq!((problems.kind(), problems.0.len()), (Kind::Damage, 1), "{what}: {problems}");
        assert!(problems.to_string().starts_with(&name), "{what}: {problems}");
        let again = Opening::Resume { cases: true };
        let results = Results::open(&run, outline(), None, again, Access::Whole).unwrap();
        let mended = results.store().mended.join("\n");
        assert!(mended.starts_with(&name) && mended.contains("again"), "{what}: {mended}");
        assert_eq!(results.store().missing().len(), 1);
        synthetic::evaluate(results, 2, u64::MAX).unwrap().finish(2, 3).unwrap();
        assert_eq!(tables(&run), expected, "{what}");
        fs::remove_dir_all(&run).unwrap();
    }
}

#[test]
fn a_damaged_table_of_a_finished_run_is_seen_from_outside() {
    let (folder, _) = plain();
    let run = folder.path().join("plain");
    assert!(status(&run, true).unwrap().damaged.0.is_empty());
    let table = run.join(TableName::Modes.file());
    let mut bytes = fs::read(&table).unwrap();
    bytes[1000] ^= 1;
    fs::write(&table, &bytes).unwrap();
    assert!(status(&run, false).unwrap().damaged.0.is_empty());
    let found = status(&run, true).unwrap().damaged;
    assert!(found.to_string().contains("modes.parquet: found BLAKE3"), "{found}");
    fs::write(&table, &bytes[1..]).unwrap();
    fs::remove_file(run.join(TableName::Worst.file())).unwrap();
    let found = status(&run, false).unwrap().damaged;
    assert_eq!((found.kind(), found.0.len()), (Kind::Damage, 2), "{found}");
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

#[test]
fn lost_shards_are_evaluated_again_whichever_they_are() {
    let (folder, expected) = plain();
    let kept = folder.path().join("kept");
    stopped(&kept, u64::MAX);
    let count = shards(&kept).len();
    for lost in 0..count {
        let run = folder.path().join("run");
        copy(&kept, &run);
        fs::remove_file(&shards(&run)[lost]).unwrap();
        synthetic::resume(&run, outline(), 2).unwrap();
        assert_eq!(tables(&run), expected);
        fs::remove_dir_all(&run).unwrap();
    }
}

#[test]
fn a_changed_scenario_is_refused_by_the_name_of_what_changed() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    stopped(&run, 50);
    type Change = fn(&mut Outline);
    let changes: [(&str, Change); 6] = [
        ("seed", |o| o.definition.seed = 8),
        ("flight_times_s", |o| o.definition.flight_times_s[1] = 111.0),
        ("dispersion", |o| o.inputs[0].blake3 = "11".repeat(32)),
        ("poles", |o| o.poles = StoredPoles::Named),
        ("program", |o| o.program = "9.9.9".to_owned()),
        ("cases", |o| o.definition.set_cases(301)),
    ];
    let again = Opening::Resume { cases: true };
    for (name, change) in changes {
        let mut changed = outline();
        change(&mut changed);
        let refused = Results::open(&run, changed, None, again, Access::Whole);
        let problems = refused.err().expect(name);
        assert_eq!((problems.kind(), problems.0.len()), (Kind::Input, 1), "{problems}");
        assert_eq!(problems.0[0].key, name);
    }
    // Unless it was asked for, the number of cases is that of the run.
    let mut changed = outline();
    changed.definition.set_cases(5);
    let again = Opening::Resume { cases: false };
    let results = Results::open(&run, changed, None, again, Access::Whole).unwrap();
    assert_eq!(*results.store().outline(), outline());
}

#[test]
fn another_program_or_instruction_set_never_mixes_with_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    stopped(&run, 50);
    let here = Maker::here();
    for (name, from, to) in [
        ("instruction set", here.isa.as_str(), "x86-64-v9"),
        ("program build", here.build.as_str(), "0123456789abcdef"),
    ] {
        let path = run.join(STARTED);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace(from, to)).unwrap();
        let problems = Store::gather(&run, &[]).unwrap_err().to_string();
        assert!(problems.contains(name) && problems.contains(to), "{problems}");
        assert!(synthetic::resume(&run, outline(), 1).is_err());
        fs::write(&path, text).unwrap();
        // The same of a single shard, whose header is altered with its digest.
        let shard = shards(&run).remove(1);
        let whole = fs::read(&shard).unwrap();
        let end = whole.iter().position(|byte| *byte == b'\n').unwrap();
        let line = String::from_utf8(whole[..end].to_vec()).unwrap();
        let header = line.splitn(4, ' ').nth(3).unwrap().replace(from, to);
        let digest = files::digest_of(header.as_bytes());
        let line = format!("tvse shard {digest} {header}");
        fs::write(&shard, [line.as_bytes(), &whole[end..]].concat()).unwrap();
        let problems = Store::gather(&run, &[]).unwrap_err().to_string();
        assert!(
            problems.starts_with(&files::name(&shard)) && problems.contains(name),
            "{problems}"
        );
        fs::write(&shard, whole).unwrap();
    }
    assert!(synthetic::resume(&run, outline(), 1).is_ok());
}

#[test]
fn an_extended_run_has_the_bytes_of_one_that_was_longer_from_the_start() {
    let (folder, expected) = plain();
    let more = |opening, run: &Path, most| {
        let results = Results::open(run, short(), None, opening, Access::Whole).unwrap();
        synthetic::evaluate(results, 2, most).unwrap()
    };
    fn short() -> Outline {
        cases::outline(&[1, 237, 7], StoredPoles::All)
    }
    for finished in [true, false] {
        let run = folder.path().join(format!("run-{finished}"));
        let results = Results::create(&run, short()).unwrap();
        let results =
            synthetic::evaluate(results, 2, if finished { u64::MAX } else { 90 }).unwrap();
        if finished {
            results.finish(2, 3).unwrap();
        } else {
            drop(results);
        }
        // Interrupted, the old tables still stand.
        drop(more(Opening::Extend(63), &run, 20));
        assert_eq!(Run::open(&run).is_ok(), finished);
        let results = more(Opening::Resume { cases: false }, &run, u64::MAX);
        results.finish(2, 3).unwrap();
        assert_eq!(tables(&run), expected);
        assert_eq!(files::names(&run).unwrap(), ["manifest.json", "tables"]);
    }
}

#[test]
fn a_plan_whose_first_cases_would_change_is_not_extended() {
    let folder = tempfile::tempdir().unwrap();
    for (scheme, more, told) in [
        (Scheme::LatinHypercube { replicates: 1 }, 10, "dispersed.plan: found Latin"),
        (Scheme::Sobol { replicates: 4 }, 10, "dispersed.cases: found 10 more"),
        (Scheme::Sobol { replicates: 4 }, 12, ""),
    ] {
        let run = folder.path().join("run");
        let mut outline = outline();
        outline.definition.populations[1].scheme = scheme;
        synthetic::run(&run, outline.clone(), 2).unwrap();
        let opening = Opening::Extend(more);
        let opened = Results::open(&run, outline, None, opening, Access::Whole);
        let text = opened.map_or_else(|problems| problems.to_string(), |_| String::new());
        assert!(text.contains(told) && text.is_empty() == told.is_empty(), "{text}");
        fs::remove_dir_all(&run).unwrap();
    }
}

#[test]
fn any_fault_while_a_run_is_extended_leaves_one_that_goes_on() {
    let folder = in_memory();
    let long = folder.path().join("long");
    synthetic::run(&long, cases::outline(&[1, 90, 60], StoredPoles::All), 2).unwrap();
    let expected = tables(&long);
    let kept = folder.path().join("kept");
    synthetic::run(&kept, cases::outline(&[1, 50, 20], StoredPoles::All), 2).unwrap();
    let extend = |run: &Path| -> Result<(), Problems> {
        let short = cases::outline(&[1, 50, 20], StoredPoles::All);
        let results = Results::open(run, short, None, Opening::Extend(40), Access::Whole)?;
        synthetic::evaluate(results, 1, u64::MAX)?.finish(1, 3).map(|_| ())
    };
    let run = folder.path().join("run");
    copy(&kept, &run);
    fault::inject(None);
    extend(&run).unwrap();
    let steps = fault::taken();
    for (step, fault) in (0..steps).flat_map(|s| [(s, Fault::Full), (s, Fault::Power)]) {
        fs::remove_dir_all(&run).unwrap();
        copy(&kept, &run);
        fault::inject(Some((step, fault)));
        let failed = extend(&run).is_err();
        fault::inject(None);
        assert!(failed || fault == Fault::Full);
        // Before the extension is written down it is asked for again.
        let again = Opening::Resume { cases: false };
        let short = cases::outline(&[1, 50, 20], StoredPoles::All);
        let results = Results::open(&run, short, None, again, Access::Whole).unwrap();
        let extended = results.store().outline().cases() == 151;
        synthetic::evaluate(results, 1, u64::MAX).unwrap().finish(1, 3).unwrap();
        if !extended {
            extend(&run).unwrap();
        }
        assert_eq!(tables(&run), expected, "{fault:?} at step {step}");
    }
}

#[test]
fn cases_that_are_evaluated_again_replace_their_rows_and_no_others() {
    let (folder, expected) = plain();
    let run = folder.path().join("plain");
    let again = Opening::Resume { cases: true };
    let mut results = Results::open(&run, outline(), None, again, Access::Whole).unwrap();
    let definition = outline().definition;
    // Case 19 does not break this time.
    for case in [19, 42, 43] {
        results.push(cases::evaluate(&definition, 1, case, StoredPoles::All)).unwrap();
    }
    assert!(results.store().missing().is_empty());
    results.finish(1, 3).unwrap();
    assert_ne!(tables(&run), expected);
    let stored = Run::open(&run).unwrap();
    let mut failed = Vec::new();
    let visit = |case, failure: crate::campaign::Failure| {
        failed.push((case, failure.kind.name()));
        Ok(())
    };
    stored.failures(1, visit).unwrap();
    assert!(failed.contains(&(11, "draw")) && !failed.iter().any(|(case, _)| *case == 19));
    // With the failure back, all bytes are.
    let mut results = Results::open(&run, outline(), None, again, Access::Whole).unwrap();
    let mut broken = None;
    pool::Pool::new(1)
        .unwrap()
        .run(
            &definition,
            &[Span { population: 1, cases: 19..20 }],
            |_, _| panic!("case 19 breaks"),
            |record| {
                broken = Some(record);
                Ok::<(), ()>(())
            },
            |_| (),
            &std::sync::atomic::AtomicBool::new(false),
        )
        .unwrap();
    results.push(broken.unwrap()).unwrap();
    results.finish(1, 3).unwrap();
    assert_eq!(tables(&run), expected);
}

#[test]
fn one_process_at_a_time_works_on_a_run_and_parts_only_on_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let part = |number| synthetic::part(&run, outline(), Part { number, of: 3 });
    let (first, second) = (part(1).unwrap(), part(2).unwrap());
    for refused in [part(1).map(|_| ()), Store::gather(&run, &[]).map(|_| ())] {
        let text = refused.unwrap_err().to_string();
        assert!(text.contains("held by"), "{text}");
    }
    let at_work: Vec<String> =
        status(&run, false).unwrap().owners.into_iter().map(|(name, _)| name).collect();
    assert_eq!(at_work, ["lock-1-of-3", "lock-2-of-3"]);
    drop((first, second));
    let whole = Store::gather(&run, &[]).unwrap();
    assert!(
        part(3).err().unwrap().to_string().contains(&format!("process {}", std::process::id()))
    );
    drop(whole);
    part(3).unwrap();
    synthetic::merge(&run, &[]).unwrap();
}

#[test]
fn a_clock_that_jumps_changes_no_byte() {
    // Time stands in the manifest and the locks alone: shards of another day are as good.
    let (folder, expected) = plain();
    let run = folder.path().join("run");
    stopped(&run, 100);
    for path in shards(&run) {
        let file = fs::File::options().write(true).open(path).unwrap();
        let past = std::time::SystemTime::UNIX_EPOCH;
        file.set_times(fs::FileTimes::new().set_modified(past).set_accessed(past)).unwrap();
    }
    synthetic::resume(&run, outline(), 2).unwrap();
    assert_eq!(tables(&run), expected);
}
