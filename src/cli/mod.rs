//! The command line: arguments, progress and exit codes.
//!
//! One file a command: each has its clap `Args` and a `run` that writes to the given output and
//! returns the exit code. Nothing here computes.

pub mod error;
pub mod how_many;
pub mod summary;

pub use error::Error;

use clap::{Parser, Subcommand};
use std::io::Write;
use std::process::ExitCode;

/// Exit code: everything asked for holds.
pub const PASS: u8 = 0;
/// Exit code: a gate failed.
pub const FAIL: u8 = 1;
/// Exit code: wrong usage or input.
pub const USAGE: u8 = 2;
/// Exit code: incomplete or damaged data, or nothing evaluated.
pub const INCOMPLETE: u8 = 3;
/// Exit code: inconclusive, more cases are needed.
pub const INCONCLUSIVE: u8 = 4;

/// Monte Carlo dispersion engine for thrust vector servoelastic coupling.
#[derive(Parser)]
#[command(name = "tvse", version, about, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    HowMany(how_many::Args),
    Summary(summary::Args),
}

/// Parses the arguments of the process, runs the command and returns the exit code.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let mut out = std::io::stdout().lock();
    let result: Result<u8, Error> = match arguments.command {
        Command::HowMany(args) => how_many::run(&args, &mut out),
        Command::Summary(args) => summary::run(&args, &mut out),
    };
    let code = result.unwrap_or_else(|error: Error| {
        eprintln!("{error}");
        error.code()
    });
    // A closed pipe is no error of ours.
    let _ = out.flush();
    ExitCode::from(code)
}
