//! `tvse summary`: sums up a finished run from its tables and prints the story.

use super::{Error, PASS};
use crate::io::{Run, summarise};
use crate::report::story;
use std::path::PathBuf;

/// Statistics of a finished run, computed again from its tables.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  tvse summary runs/reference")]
pub struct Args {
    /// Folder of the run.
    run: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// No such run, or damaged tables.
pub fn run(args: &Args, out: &mut dyn std::io::Write) -> Result<u8, Error> {
    let run = Run::open(&args.run)?;
    let summary = summarise::summary(&run, summarise::MEMORY)?;
    let worst = summarise::worst(&run, 1)?;
    write!(out, "{}", story::story(run.outline(), &summary, &worst))?;
    write!(out, "{}", super::campaign::feedback(&run)?)?;
    for (table, content) in run.contents() {
        writeln!(out, "{}: {} rows", run.path(table).display(), content.rows)?;
    }
    Ok(PASS)
}
