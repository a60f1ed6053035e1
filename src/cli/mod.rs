//! The command line: arguments, progress and exit codes.
//!
//! One file a command: each has its clap `Args` and a `run` that writes to the given output and
//! returns the exit code. Nothing here computes.

pub mod actuator;
pub mod check;
pub mod completions;
pub mod error;
pub mod gate;
pub mod how_many;
pub mod init;
pub mod modes;
pub mod nominal;
pub mod plan;
pub mod planar;
pub mod progress;
pub mod replay;
pub mod run;
pub mod schema;
pub mod summary;

pub use error::Error;

use clap::{Parser, Subcommand};
use std::io::{ErrorKind, Write};
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
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Init(init::Args),
    Check(check::Args),
    Plan(plan::Args),
    Modes(modes::Args),
    Nominal(nominal::Args),
    Run(run::Args),
    Summary(summary::Args),
    Gate(gate::Args),
    Replay(replay::Args),
    HowMany(how_many::Args),
    Planar(planar::Args),
    Actuator(actuator::Args),
    Schema(schema::Args),
    Completions(completions::Args),
}

/// Parses the arguments of the process, runs the command and returns the exit code.
pub fn run() -> ExitCode {
    let arguments = Arguments::parse();
    let mut out = std::io::stdout().lock();
    let result: Result<u8, Error> = match &arguments.command {
        Command::Init(args) => init::run(args, &mut out),
        Command::Check(args) => check::run(args, &mut out),
        Command::Plan(args) => plan::run(args, &mut out),
        Command::Modes(args) => modes::run(args, &mut out),
        Command::Nominal(args) => nominal::run(args, &mut out),
        Command::Run(args) => run::run(args, &mut out),
        Command::Summary(args) => summary::run(args, &mut out),
        Command::Gate(args) => gate::run(args, &mut out),
        Command::Replay(args) => replay::run(args, &mut out),
        Command::HowMany(args) => how_many::run(args, &mut out),
        Command::Planar(args) => planar::run(args, &mut out),
        Command::Actuator(args) => actuator::run(args, &mut out),
        Command::Schema(args) => schema::run(args, &mut out),
        Command::Completions(args) => completions::run(args, &mut out),
    };
    let code = match result.and_then(|code| Ok(out.flush().map(|()| code)?)) {
        Ok(code) => code,
        // A reader that closed the pipe has what it wants.
        Err(Error::Output(error)) if error.kind() == ErrorKind::BrokenPipe => PASS,
        Err(error) => {
            eprintln!("{error}");
            error.code()
        }
    };
    ExitCode::from(code)
}
