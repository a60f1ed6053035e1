//! `tvse gate`: holds a finished run against its gates.

use super::Error;
use crate::gate::{self, Gate, Names, Report};
use crate::io::{Run, files};
use crate::report;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Gates on a finished run: a table with a verdict for each, and `gates.json` in the run's folder.
///
/// Exit codes: 0 every gate passes, 1 one fails, 2 wrong usage or input, 3 incomplete data or
/// nothing evaluated, 4 inconclusive: more cases are needed. A gate of severity `warning` is shown
/// but does not change the exit code.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse gate runs/reference --gates runs/reference.gates.toml
  tvse run runs/reference.toml --gates runs/reference.gates.toml")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// The gates
    #[arg(long, value_name = "FILE")]
    gates: PathBuf,
    /// File for the outcomes (default: gates.json in the run's folder)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// No such run, damaged tables, or all problems of the gate file.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let run = Run::open(&args.run)?;
    let json = args.json.clone().unwrap_or_else(|| args.run.join("gates.json"));
    judge(&run, &args.gates, &json, out)
}

/// The gates of a file, checked against what the run has, and the file's name.
///
/// # Errors
/// All problems of the gate file.
pub fn rules(path: &Path, run: &impl Names) -> Result<(Vec<Gate>, String), Error> {
    let name = files::name(path);
    let rules = gate::parse(&files::read_text(path)?, &name)?;
    gate::check(&rules, run, &name)?;
    Ok((rules, name))
}

/// Evaluates the gates of the file `gates` on `run`, prints them and writes `json`; gives the exit
/// code.
///
/// # Errors
/// All problems of the gate file, damaged tables, or a file that cannot be written.
pub fn judge(run: &Run, gates: &Path, json: &Path, out: &mut dyn Write) -> Result<u8, Error> {
    let (rules, name) = rules(gates, run)?;
    let report = Report::new(gate::evaluate(&rules, run, &name)?);
    files::write(json, report.to_json().as_bytes())?;
    writeln!(out, "{}{}", report::gates::gates(&report), json.display())?;
    Ok(report.exit_code)
}
