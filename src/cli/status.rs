//! `tvse status`: how far a run has come, seen from another shell.

use super::progress::duration;
use super::{Error, INCOMPLETE, PASS};
use crate::io::store::{self, Status};
use std::io::Write;
use std::path::PathBuf;

/// How far a run has come, who works on it, and what is missing or damaged.
///
/// Touches nothing. Cases are counted once they are on the disk; processes at work say themselves
/// how far they are. Names, sizes and first lines of shards and tables are looked at; with --verify
/// every byte is read and held against its digest, as resuming, merging and every reading command
/// do. Exit code 0 if the run is finished or at work, 3 if it was stopped or holds something damaged.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse status runs/reference
  tvse status runs/reference --verify        # a single changed bit is found
  tvse status runs/reference --missing 8     # parts of 8 that have cases left, for --array=…")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Prints only the numbers of the parts out of N that have cases left, with commas
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    missing: Option<u64>,
    /// Reads all shards and tables and holds them against their digests; what is damaged is missing
    #[arg(long)]
    verify: bool,
}

/// Runs the command.
///
/// # Errors
/// No such run; output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let status = store::status(&args.run, args.verify)?;
    if let Some(of) = args.missing {
        let numbers: Vec<String> = status.parts_left(of).iter().map(u64::to_string).collect();
        writeln!(out, "{}", numbers.join(","))?;
        return Ok(PASS);
    }
    let Status { finished, populations, done, failed, unstable, missing, owners, damaged } =
        &status;
    let total: u64 = populations.iter().map(|p| p.cases).sum();
    let state = match (finished, owners.is_empty(), missing.is_empty()) {
        (true, ..) => "finished",
        (false, false, _) => "at work",
        (false, true, false) => "stopped",
        (false, true, true) => "evaluated, tables not made",
    };
    let share = 100.0 * *done as f64 / total.max(1) as f64;
    write!(out, "{state}: {done} of {total} cases on the disk ({share:.1} %)")?;
    if !finished {
        write!(out, ", {unstable} unstable, {failed} failed")?;
    }
    writeln!(out)?;
    for (lock, owner) in owners {
        write!(out, "{lock}: {}", owner.name())?;
        if let Some(told) = owner.progress {
            let left = told.left_s.map_or("unknown".to_owned(), duration);
            write!(
                out,
                ": {} of {} cases, {:.1} a second, {left} left, {} unstable, {} failed",
                told.done, told.total, told.cases_per_s, told.unstable, told.failed
            )?;
        }
        writeln!(out)?;
    }
    const SHOWN: usize = 10;
    for span in missing.iter().take(SHOWN) {
        let name = &populations[span.population].name;
        let (first, last) = (span.cases.start, span.cases.end - 1);
        writeln!(out, "missing: {name} cases {first} to {last}")?;
    }
    if missing.len() > SHOWN {
        writeln!(out, "missing: {} more ranges", missing.len() - SHOWN)?;
    }
    for problem in &damaged.0 {
        writeln!(out, "damaged: {problem}")?;
    }
    let well = *finished || !owners.is_empty();
    Ok(if well && damaged.0.is_empty() { PASS } else { INCOMPLETE })
}
