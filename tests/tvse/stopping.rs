//! Runs that are stopped or run out of disk: nothing is left behind and the exit code tells why.
#![cfg(unix)]

use crate::study::{Study, tvse};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn a_signal_stops_a_run_which_says_how_far_it_came_and_leaves_nothing() {
    let study = Study::new();
    study.edit("runs/smoke.toml", "cases = 6", "cases = 1000000");
    let before = study.everything();
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let mut command = tvse(&study.path(""), &["run", "runs/smoke.toml", "-o", "out/result"]);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let begun = Instant::now();
        while !study.path("out/result/inputs/modes/tables/shapes.parquet").exists() {
            assert!(begun.elapsed() < Duration::from_secs(60), "the run does not begin");
            std::thread::sleep(Duration::from_millis(10));
        }
        let id = child.id().to_string();
        assert!(
            Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success()
        );
        let output = child.wait_with_output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{told}");
        assert!(told.contains("of 1000001 cases; nothing is kept"), "{told}");
        assert!(!study.path("out/result").exists());
        std::fs::remove_dir(study.path("out")).unwrap();
        assert_eq!(study.everything(), before);
    }
}

/// A small file system of its own; none where this user may not mount.
struct Small<'a>(&'a std::path::Path);

impl<'a> Small<'a> {
    fn mount(place: &'a std::path::Path, size: &str) -> Option<Self> {
        std::fs::create_dir(place).unwrap();
        let options = format!("size={size}");
        let words = ["-t", "tmpfs", "-o", &options, "tmpfs"];
        let mounted = Command::new("mount").args(words).arg(place).stderr(Stdio::null()).status();
        mounted.is_ok_and(|status| status.success()).then_some(Self(place))
    }
}

impl Drop for Small<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

#[test]
fn a_full_disk_ends_a_run_with_the_name_of_the_file_and_leaves_nothing() {
    let study = Study::new();
    let place = study.path("small");
    // Room for nothing, for the outputs as they are opened, and for the inputs but not the tables.
    for size in ["64k", "512k", "2m"] {
        let Some(small) = Small::mount(&place, size) else {
            assert!(std::env::var_os("CI").is_none(), "no full disk tested: mounting failed");
            eprintln!("skipped: no full disk tested, this user may not mount");
            return;
        };
        let said = study.said(&["run", "runs/smoke.toml", "-o", "small/result", "--cases", "200"]);
        assert_eq!(said.code, 2, "{size}: {said:?}");
        assert!(said.err.contains("small/result") && said.err.contains("free space"), "{said:?}");
        assert!(said.err.contains("No space left"), "{said:?}");
        let left: Vec<_> = std::fs::read_dir(small.0).unwrap().collect();
        assert!(left.is_empty(), "{size}: {left:?}");
        let said = study.said(&["plan", "runs/smoke.toml", "-o", "small/plan.parquet"]);
        if said.code != 0 {
            assert!(said.code == 2 && said.err.contains("plan.parquet"), "{said:?}");
            assert_eq!(std::fs::read_dir(small.0).unwrap().count(), 0);
        }
        drop(small);
        std::fs::remove_dir(&place).unwrap();
    }
}
