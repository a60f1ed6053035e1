//! The manifest of a finished run: what its tables must hold, and how they came about.
//!
//! The only file of a run that knows clock, machine and thread count; it is written last, so that
//! a run without a manifest is unfinished.

#![expect(clippy::disallowed_methods, reason = "the manifest states when a run was made")]

use super::files;
use super::maker::Maker;
use super::schema;
use super::table::Content;
use crate::campaign::Outline;
use crate::problem::Problems;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// File of the manifest in a run's folder.
pub const FILE: &str = "manifest.json";

/// How a run was carried out; nothing of it changes a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Execution {
    /// Program, build and instruction set.
    pub maker: Maker,
    /// Threads.
    pub jobs: usize,
    /// When the outputs were opened, UTC.
    pub started: String,
    /// When the tables were finished, UTC.
    pub finished: String,
    /// Seconds between the two.
    pub duration_s: f64,
    /// Processor and system the program was built for.
    pub target: String,
    /// Instruction sets found on the machine.
    pub instruction_set: Vec<String>,
}

impl Execution {
    /// An execution with this number of threads that began at `started` and ends now.
    pub fn since(started: SystemTime, jobs: usize) -> Self {
        let now = SystemTime::now();
        Self {
            maker: Maker::here(),
            jobs,
            started: utc(started),
            finished: utc(now),
            duration_s: now.duration_since(started).unwrap_or(Duration::ZERO).as_secs_f64(),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            instruction_set: instruction_set().into_iter().map(str::to_owned).collect(),
        }
    }
}

/// What `manifest.json` holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the tables' columns and metadata.
    pub schema_version: u32,
    /// The outline of the run, as in the metadata of every table.
    pub run: Outline,
    /// What each table holds, by its name.
    pub tables: BTreeMap<String, Content>,
    /// How the run was carried out.
    pub execution: Execution,
}

/// The part of a manifest that every version has.
#[derive(Deserialize)]
struct Versioned {
    schema_version: u32,
}

impl Manifest {
    /// The text of the file.
    pub fn to_text(&self) -> String {
        let text = serde_json::to_string_pretty(self).expect("a manifest has text keys only");
        text + "\n"
    }

    /// Reads the manifest of a run's folder.
    ///
    /// # Errors
    /// Input: no such folder. Damage: no manifest (the run is unfinished), a manifest that cannot
    /// be understood, another schema version.
    pub fn read(folder: &Path) -> Result<Self, Problems> {
        let path = folder.join(FILE);
        let name = files::name(&path);
        if !folder.is_dir() {
            let found = "no such folder";
            return Err(Problems::input(files::name(folder), "", found, "the folder of a run"));
        }
        if !path.is_file() {
            let found = "no manifest: the run is unfinished, or this is no run";
            return Err(Problems::damage(name, "", found, "a finished run"));
        }
        // Not text any more: damaged, like what follows.
        let damaged = |found: String| Problems::damage(&name, "", found, "the manifest of a run");
        let text = files::read_text(&path).map_err(|problems| damaged(problems.to_string()))?;
        let version: Versioned =
            serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        if version.schema_version != schema::VERSION {
            let found = version.schema_version.to_string();
            let allowed = schema::VERSION.to_string();
            return Err(Problems::damage(name, "schema_version", found, allowed));
        }
        serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))
    }
}

/// Date and time in UTC, to the second.
pub(super) fn utc(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs();
    let (mut days, second) = (seconds / 86_400, seconds % 86_400);
    let leap = |year: u64| {
        year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
    };
    let mut year = 1970;
    while days >= 365 + u64::from(leap(year)) {
        days -= 365 + u64::from(leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= lengths[month] {
        days -= lengths[month];
        month += 1;
    }
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year}-{:02}-{:02}T{hour:02}:{minute:02}:{second:02}Z", month + 1, days + 1)
}

/// Instruction sets of this machine that numerical code may choose by.
pub fn instruction_set() -> Vec<&'static str> {
    #[cfg(target_arch = "x86_64")]
    {
        let found = [
            ("sse4.2", std::arch::is_x86_feature_detected!("sse4.2")),
            ("avx", std::arch::is_x86_feature_detected!("avx")),
            ("avx2", std::arch::is_x86_feature_detected!("avx2")),
            ("fma", std::arch::is_x86_feature_detected!("fma")),
            ("avx512f", std::arch::is_x86_feature_detected!("avx512f")),
        ];
        found.into_iter().filter(|(_, there)| *there).map(|(name, _)| name).collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (1_709_251_199, "2024-02-29T23:59:59Z"),
            (1_735_689_600, "2025-01-01T00:00:00Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(utc(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }
}
