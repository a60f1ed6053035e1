//! Runs that are stopped, killed, run out of disk or are shared out: they go on, and every table has
//! the bytes of a run that was left alone.
#![cfg(unix)]

use crate::study::{Said, Study, TABLES, tvse};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const RUN: [&str; 2] = ["run", "runs/smoke.toml"];

fn begun(study: &Study, words: &[&str]) -> Child {
    let mut command = tvse(&study.path(""), &[&RUN[..], words].concat());
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn wait_for(what: &str, mut there: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !there() {
        assert!(begun.elapsed() < Duration::from_secs(120), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn send(signal: &str, child: &Child) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success());
}

fn shards(study: &Study, run: &str) -> usize {
    std::fs::read_dir(study.path(run).join("shards")).map_or(0, Iterator::count)
}

/// Goes on with a run until it is finished.
fn resumed(study: &Study, folder: &str, more: &[&str]) -> Said {
    let said = study.said(&[&RUN[..], &["-o", folder, "--resume"], more].concat());
    assert_eq!(said.code, 0, "{said:?}");
    said
}

#[test]
fn a_signal_stops_a_run_which_says_how_to_go_on_and_ends_with_the_same_bytes() {
    let study = Study::new().with_corner();
    let cases = ["--cases", "3000"];
    study.run("plain", &cases);
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let more = ["-o", "result", "--cases", "3000", "--progress", "json"];
        let child = begun(&study, &more);
        wait_for("the first case", || study.path("result/started.json").exists());
        std::thread::sleep(Duration::from_millis(200));
        send(signal, &child);
        let said: Said = child.wait_with_output().unwrap().into();
        assert_eq!(said.code, code, "{said:?}");
        assert!(said.err.contains("go on with: tvse run runs/smoke.toml -o result"), "{said:?}");
        let status = study.said(&["status", "result"]);
        assert!(status.code == 3 && status.out.starts_with("stopped: "), "{status:?}");
        let again = study.said(&[&RUN[..], &["-o", "result"], &cases].concat());
        assert!(again.code == 2 && again.err.contains("--resume"), "{again:?}");
        resumed(&study, "result", &cases);
        assert!(study.tables("result") == study.tables("plain"));
        assert_eq!(study.said(&["status", "result"]).code, 0);
        // Asked again, there is nothing to do.
        let before = study.everything();
        resumed(&study, "result", &cases);
        assert_eq!(study.everything(), before);
        std::fs::remove_dir_all(study.path("result")).unwrap();
    }
}

#[test]
fn a_signal_before_the_first_case_leaves_nothing() {
    let study = Study::new().with_corner();
    let before = study.everything();
    // Signs of a corner over so many keys take a while.
    let child = begun(&study, &["-o", "result"]);
    send("TERM", &child);
    let said: Said = child.wait_with_output().unwrap().into();
    // So early that the program does not listen yet, or has not begun.
    assert!(said.code == 143 || said.code == -1, "{said:?}");
    assert_eq!(study.everything(), before);
}

#[test]
fn a_run_that_is_killed_at_any_moment_goes_on_to_the_same_bytes() {
    let study = Study::new().with_corner();
    let cases = ["--cases", "40", "--save-every", "0.01"];
    let start = Instant::now();
    study.run("plain", &cases);
    let whole = start.elapsed();
    let expected = study.tables("plain");
    let (mut kills, mut finished) = (0, 0);
    // Moments from a fixed sequence (Park and Miller 1988), spread over the whole run.
    let mut state = 20_260_101_u64;
    while kills < 50 || finished < 3 {
        state = state * 16_807 % 2_147_483_647;
        let delay = whole.mul_f64(1.1 * state as f64 / 2_147_483_647.0);
        let words = [&["-o", "result", "--resume"][..], &cases].concat();
        let mut child = begun(&study, &words);
        let start = Instant::now();
        while start.elapsed() < delay && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        // Ended by itself already: the signal finds nobody.
        let _ = child.kill();
        let said: Said = child.wait_with_output().unwrap().into();
        if said.code == 0 {
            assert!(study.tables("result") == expected, "after {kills} kills");
            let left: Vec<_> = std::fs::read_dir(study.path("result")).unwrap().collect();
            assert_eq!(left.len(), 3, "{left:?}");
            std::fs::remove_dir_all(study.path("result")).unwrap();
            finished += 1;
        } else {
            assert_eq!(said.code, -1, "{said:?}");
            kills += 1;
        }
    }
    if study.path("result").exists() {
        resumed(&study, "result", &cases);
        assert!(study.tables("result") == expected);
    }
}

#[test]
fn a_second_process_on_a_run_is_refused_by_the_name_of_the_first() {
    let study = Study::new();
    let child = begun(&study, &["-o", "result", "--cases", "1000000"]);
    wait_for("the run", || study.path("result/started.json").exists());
    let id = child.id().to_string();
    for words in [&["run", "runs/smoke.toml", "-o", "result", "--resume"][..], &["merge", "result"]]
    {
        let said = study.said(words);
        assert!(said.code == 2 && said.err.contains(&format!("process {id} on")), "{said:?}");
    }
    let mut status = study.said(&["status", "result"]);
    assert!(status.out.contains(&format!("process {id} on")), "{status:?}");
    wait_for("its progress", || {
        status = study.said(&["status", "result"]);
        status.out.contains("a second")
    });
    assert!(status.out.contains("of 1000001 cases") && status.code == 0, "{status:?}");
    send("KILL", &child);
    child.wait_with_output().unwrap();
    let said = study.said(&["status", "result"]);
    assert!(!said.out.contains("process"), "{said:?}");
    // Its lock is stale now.
    let words = ["run", "runs/smoke.toml", "-o", "result", "--resume", "--cases", "7"];
    let said = study.said(&words);
    assert!(said.err.contains("found 8 cases") || said.code == 0, "{said:?}");
}

#[test]
fn a_changed_input_is_refused_by_its_name() {
    let study = Study::new();
    let part = ["-o", "result", "--shard", "1/2"];
    assert_eq!(study.said(&[&RUN[..], &part].concat()).code, 0);
    for (file, from, to, name) in [
        ("vehicles/sls-like/vehicle.toml", "mass_kg", "  mass_kg", "vehicle.toml"),
        ("dispersions/reference.toml", "[[row]]", " [[row]]", "dispersion.toml"),
        ("runs/smoke.toml", "cases = 6", "cases = 7", "run.toml"),
    ] {
        let text = study.text(file);
        study.edit(file, from, to);
        let said = study.said(&[&RUN[..], &["-o", "result", "--resume"]].concat());
        let told = format!("started.json: {name}: found BLAKE3");
        assert!(said.code == 2 && said.err.contains(&told), "{said:?}");
        std::fs::write(study.path(file), text).unwrap();
    }
    for (option, value, name) in [("--seed", "5", "seed"), ("--poles", "all", "poles")] {
        let said = study.said(&[&RUN[..], &["-o", "result", "--resume", option, value]].concat());
        assert!(said.code == 2 && said.err.contains(&format!("json: {name}: found")), "{said:?}");
    }
    resumed(&study, "result", &[]);
}

#[test]
fn shards_of_any_number_on_any_number_of_threads_merge_to_the_same_bytes() {
    let study = Study::new().with_corner();
    study.run("plain", &["--poles", "all"]);
    for (of, jobs) in [(2, "1"), (3, "2"), (11, "5")] {
        for number in (1..=of).rev() {
            let shard = format!("{number}/{of}");
            if number == 1 {
                let said = study.said(&["merge", "result"]);
                assert!(said.code == 3 && said.out.contains("missing: nominal"), "{said:?}");
                let status = study.said(&["status", "result", "--missing", &of.to_string()]);
                assert_eq!(status.out, "1\n");
            }
            let words = ["-o", "result", "--poles", "all", "--shard", &shard, "--jobs", jobs];
            for _ in 0..2 {
                let said = study.said(&[&RUN[..], &words].concat());
                assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
            }
        }
        let said = study.said(&["merge", "result"]);
        assert!(said.code == 0 && said.out.contains("tvse, dispersed: 6 cases"), "{said:?}");
        assert!(study.tables("result") == study.tables("plain"));
        assert_eq!(study.said(&["replay", "result", "--case", "3"]).code, 0);
        std::fs::remove_dir_all(study.path("result")).unwrap();
    }
}

#[test]
fn a_task_of_an_array_takes_its_shard_from_the_environment() {
    let study = Study::new();
    study.run("plain", &[]);
    let task = |variables: &[(&str, &str)], more: &[&str]| -> Said {
        let words = [&RUN[..], &["-o", "result", "--shard-from-env"], more].concat();
        let mut command = tvse(&study.path(""), &words);
        command.envs(variables.iter().copied()).output().unwrap().into()
    };
    let said = task(&[], &[]);
    assert!(said.code == 2 && said.err.contains("SLURM_ARRAY_TASK_ID"), "{said:?}");
    let slurm = [
        ("SLURM_ARRAY_TASK_ID", "4"),
        ("SLURM_ARRAY_TASK_MIN", "4"),
        ("SLURM_ARRAY_TASK_MAX", "5"),
        ("SLURM_ARRAY_TASK_COUNT", "2"),
    ];
    assert!(task(&slurm, &[]).out.starts_with("shard 1/2: "));
    assert!(
        task(&[("JOB_COMPLETION_INDEX", "1")], &["--shards", "2"]).out.starts_with("shard 2/2")
    );
    assert_eq!(study.said(&["merge", "result"]).code, 0);
    assert!(study.tables("result") == study.tables("plain"));
}

#[test]
fn an_extended_run_has_the_bytes_of_a_longer_one_and_a_retry_changes_nothing() {
    let study = Study::new().with_corner();
    study.run("plain", &["--cases", "9"]);
    study.run("result", &["--cases", "6"]);
    let extend = ["-o", "result", "--extend", "3"];
    let said = study.said(&[&RUN[..], &extend].concat());
    assert_eq!(said.code, 0, "{said:?}");
    assert!(study.tables("result") == study.tables("plain"));
    assert!(study.said(&["retry", "result", "--failed"]).out.contains("no case failed"));
    // Cases that fail by their draws fail again, and all stays as it was.
    let law = "[[row]]\npath = \"booster.left.actuator.rock.stiffness\"\nlevel = \"actuator\"\n\
               apply = \"scale\"\nsource = \"E\"\n\
               law = { kind = \"discrete\", values = [1.0, 1e300], weights = [0.5, 0.5] }\n";
    std::fs::write(study.path("dispersions/reference.toml"), law).unwrap();
    let study = Study::new();
    std::fs::write(study.path("dispersions/reference.toml"), law).unwrap();
    study.run("failing", &["--cases", "12"]);
    let before = study.tables("failing");
    let said = study.said(&["retry", "failing", "--failed"]);
    assert!(said.code == 0 && said.out.contains("of them fail still"), "{said:?}");
    assert!(study.tables("failing") == before);
}

#[test]
fn progress_is_a_line_of_json_and_silent_where_it_is_not_asked_for() {
    let study = Study::new();
    let words = [&RUN[..], &["-o", "result", "--progress", "json"]].concat();
    let said = study.said(&words);
    let last = said.err.lines().last().unwrap();
    for key in ["\"total\":7,", "\"done\":7,", "\"failed\":0,", "unstable", "cases_per_s", "left_s"]
    {
        assert!(last.starts_with('{') && last.contains(key), "{last}");
    }
    let words = ["run", "runs/smoke.toml", "-o", "other", "--isa", "z80"];
    let said = study.said(&words);
    assert!(said.code == 2 && said.err.contains("--isa: found z80"), "{said:?}");
}

/// A small file system of its own; none where this user may not mount.
struct Small<'a>(&'a Path);

impl<'a> Small<'a> {
    fn mount(place: &'a Path, size: &str) -> Option<Self> {
        std::fs::create_dir(place).unwrap();
        let options = format!("size={size}");
        let words = ["-t", "tmpfs", "-o", &options, "tmpfs"];
        let mounted = Command::new("mount").args(words).arg(place).stderr(Stdio::null()).status();
        if mounted.is_ok_and(|status| status.success()) {
            return Some(Self(place));
        }
        assert!(std::env::var_os("CI").is_none(), "no full disk tested: mounting failed");
        eprintln!("skipped: no full disk tested, this user may not mount");
        None
    }

    fn remount(&self, options: &str) {
        let options = format!("remount,{options}");
        let status = Command::new("mount").args(["-o", &options]).arg(self.0).status().unwrap();
        assert!(status.success());
    }
}

impl Drop for Small<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

#[test]
fn a_full_disk_ends_a_run_with_the_name_of_the_file_and_with_room_it_goes_on() {
    let study = Study::new();
    study.run("plain", &["--cases", "200"]);
    let place = study.path("small");
    let words = ["-o", "small/result", "--cases", "200", "--save-every", "0.1", "--resume"];
    // Room for nothing, for the outputs as they are opened, for the inputs but not the tables, for
    // some of the shards, for the shards but not the tables.
    let mut kept = 0;
    for size in ["64k", "512k", "2m", "3m", "4m", "5m"] {
        let Some(small) = Small::mount(&place, size) else { return };
        let said = study.said(&[&RUN[..], &words].concat());
        if said.code != 0 {
            assert_eq!(said.code, 2, "{size}: {said:?}");
            assert!(
                said.err.contains("small/result") && said.err.contains("free space"),
                "{said:?}"
            );
            assert!(said.err.contains("No space left"), "{said:?}");
            if said.err.contains("cases are kept") {
                kept += 1;
            } else {
                assert!(!study.path("small/result").exists(), "{size}");
            }
            let said = study.said(&["plan", "runs/smoke.toml", "-o", "small/plan.parquet"]);
            if said.code != 0 {
                assert!(said.code == 2 && said.err.contains("plan.parquet"), "{said:?}");
            }
            small.remount("size=64m");
            let said = study.said(&[&RUN[..], &words].concat());
            assert_eq!(said.code, 0, "{size}: {said:?}");
        }
        assert!(study.tables("small/result") == study.tables("plain"), "{size}");
        drop(small);
        std::fs::remove_dir(&place).unwrap();
    }
    assert!(kept > 0, "no size left some of the cases");
}

#[test]
fn a_read_only_and_a_vanished_folder_end_a_run_with_their_name() {
    let study = Study::new();
    let place = study.path("small");
    let Some(small) = Small::mount(&place, "64m") else { return };
    let part = ["-o", "small/result", "--shard", "1/2"];
    assert_eq!(study.said(&[&RUN[..], &part].concat()).code, 0);
    small.remount("ro");
    for words in [&["-o", "small/result", "--resume"][..], &["-o", "small/other"]] {
        let said = study.said(&[&RUN[..], words].concat());
        assert!(said.code == 2 && said.err.contains("small/"), "{said:?}");
        assert!(said.err.contains("Read-only"), "{said:?}");
    }
    small.remount("rw");
    resumed(&study, "small/result", &[]);
    let child = begun(&study, &["-o", "small/gone", "--cases", "100000", "--save-every", "0.1"]);
    wait_for("a shard", || shards(&study, "small/gone") > 1);
    while std::fs::remove_dir_all(study.path("small/gone")).is_err() {}
    let said: Said = child.wait_with_output().unwrap().into();
    assert!(said.code == 2 && said.err.contains("small/gone"), "{said:?}");
    assert!(!said.err.contains("panicked"), "{said:?}");
}

#[test]
fn a_damaged_shard_is_named_and_its_cases_are_evaluated_again() {
    let study = Study::new();
    study.run("plain", &[]);
    for number in ["1/3", "2/3", "3/3"] {
        let said = study.said(&[&RUN[..], &["-o", "result", "--shard", number]].concat());
        assert_eq!(said.code, 0, "{said:?}");
    }
    let folder = study.path("result/shards");
    let mut names: Vec<_> =
        std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    let path = folder.join(&names[1]);
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.len() - 100;
    bytes[at] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let name = names[1].to_str().unwrap();
    let said = study.said(&["merge", "result"]);
    assert!(said.code == 3 && said.err.contains(name), "{said:?}");
    let said = resumed(&study, "result", &[]);
    assert!(said.err.contains(name) && said.err.contains("evaluated again"), "{said:?}");
    assert!(study.tables("result") == study.tables("plain"));
}

#[test]
fn a_campaign_of_the_planar_pair_is_a_run_like_any_other() {
    let study = Study::new();
    let pair = |more: &[&str]| {
        let words = "planar --inertia 1 --zeta-n 0.3 --omega-n 1.2 --zeta-b 0.005 --omega-b 1 \
                     --upsilon 0.2 --phi 1 --scatter thrust=0:0.4 --cases 20000";
        let words: Vec<&str> = words.split_whitespace().chain(more.iter().copied()).collect();
        let said = study.said(&words);
        assert_eq!((said.code, said.err.as_str()), (0, ""), "{said:?}");
        said.out
    };
    let story = pair(&["-o", "plain"]);
    assert!(story.contains("20000 cases"), "{story}");
    for number in ["1/3", "2/3", "3/3"] {
        pair(&["-o", "result", "--shard", number]);
    }
    assert_eq!(study.said(&["merge", "result"]).code, 0);
    assert!(study.tables("result") == study.tables("plain"));
    let gate = "[[gate]]\nid = \"unstable\"\nmetric = \"damping_ratio\"\nvariant = \"planar\"\n\
                mode = \"least_damped\"\nstatistic = \"share_below\"\nthreshold_1 = 0.0\n\
                at_most_percent = 99.0\nconfidence = 0.95\nrationale = \"r\"\n";
    std::fs::write(study.path("pair.gates.toml"), gate).unwrap();
    assert_eq!(study.said(&["gate", "result", "--gates", "pair.gates.toml"]).code, 0);
    assert_eq!(TABLES.len(), study.tables("result").len());
}
