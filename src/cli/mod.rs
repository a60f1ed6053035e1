//! The command line: arguments, progress and exit codes.
//!
//! One file a command: each has its clap `Args` and a `run` that writes to the given output and
//! returns the exit code. Nothing here computes.

pub mod actuator;
pub mod campaign;
pub mod check;
pub mod compare;
pub mod completions;
pub mod error;
pub mod gate;
pub mod how_many;
pub mod import;
pub mod influence;
pub mod init;
pub mod interrupt;
pub mod margins;
pub mod merge;
pub mod model;
pub mod modes;
pub mod nominal;
pub mod outside;
pub mod part;
pub mod plan;
pub mod planar;
pub mod progress;
pub mod reference;
pub mod replay;
pub mod report;
pub mod response;
pub mod retry;
pub mod run;
pub mod schema;
pub mod selection;
pub mod sensitivity;
pub mod statistics;
pub mod status;
pub mod submit;
pub mod summary;
pub mod worst;

pub use error::Error;

use crate::campaign::pool;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::borrow::Cow;
use std::io::{self, ErrorKind, StdoutLock, Write};
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
    Model(model::Args),
    Import(import::Args),
    Nominal(nominal::Args),
    Run(run::Args),
    Merge(merge::Args),
    Status(status::Args),
    Submit(submit::Args),
    Retry(retry::Args),
    Summary(summary::Args),
    Statistics(statistics::Args),
    Sensitivity(sensitivity::Args),
    Compare(compare::Args),
    Gate(gate::Args),
    Report(report::Args),
    Replay(replay::Args),
    Worst(worst::Args),
    Influence(influence::Args),
    Response(response::Args),
    HowMany(how_many::Args),
    Planar(planar::Args),
    Margins(margins::Args),
    Actuator(actuator::Args),
    Schema(schema::Args),
    Reference(reference::Args),
    Completions(completions::Args),
}

/// The standard output. A reader that closed the pipe has what it wants: the command goes on, and
/// its exit code stays its own.
struct Output(StdoutLock<'static>);

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = match harmless(bytes) {
            Cow::Borrowed(bytes) => self.0.write(bytes),
            Cow::Owned(instead) => self.0.write_all(&instead).map(|()| bytes.len()),
        };
        unless_closed(written, bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        unless_closed(self.0.flush(), ())
    }
}

/// Names and messages come from files of others, too: what would steer a terminal is shown as `?`.
fn harmless(bytes: &[u8]) -> Cow<'_, [u8]> {
    let steers = |byte: &u8| byte.is_ascii_control() && !b"\n\t".contains(byte);
    if !bytes.iter().any(steers) {
        return Cow::Borrowed(bytes);
    }
    bytes.iter().map(|byte| if steers(byte) { b'?' } else { *byte }).collect()
}

fn unless_closed<T>(result: io::Result<T>, closed: T) -> io::Result<T> {
    match result {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(closed),
        other => other,
    }
}

/// A case that panics is a row of its run, message and all; only other panics are printed.
fn silence_panics_of_cases() {
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let thread = std::thread::current();
        if !thread.name().is_some_and(|name| name.starts_with(pool::THREAD)) {
            print(panic);
        }
    }));
}

/// Parses the arguments of the process, runs the command and returns the exit code.
pub fn run() -> ExitCode {
    silence_panics_of_cases();
    let arguments = arguments();
    let mut out = Output(io::stdout().lock());
    let result: Result<u8, Error> = match &arguments.command {
        Command::Init(args) => init::run(args, &mut out),
        Command::Check(args) => check::run(args, &mut out),
        Command::Plan(args) => plan::run(args, &mut out),
        Command::Modes(args) => modes::run(args, &mut out),
        Command::Model(args) => model::run(args, &mut out),
        Command::Import(args) => import::run(args, &mut out),
        Command::Nominal(args) => nominal::run(args, &mut out),
        Command::Run(args) => run::run(args, &mut out),
        Command::Merge(args) => merge::run(args, &mut out),
        Command::Status(args) => status::run(args, &mut out),
        Command::Submit(args) => submit::run(args, &mut out),
        Command::Retry(args) => retry::run(args, &mut out),
        Command::Summary(args) => summary::run(args, &mut out),
        Command::Statistics(args) => statistics::run(args, &mut out),
        Command::Sensitivity(args) => sensitivity::run(args, &mut out),
        Command::Compare(args) => compare::run(args, &mut out),
        Command::Gate(args) => gate::run(args, &mut out),
        Command::Report(args) => report::run(args, &mut out),
        Command::Replay(args) => replay::run(args, &mut out),
        Command::Worst(args) => worst::run(args, &mut out),
        Command::Influence(args) => influence::run(args, &mut out),
        Command::Response(args) => response::run(args, &mut out),
        Command::HowMany(args) => how_many::run(args, &mut out),
        Command::Planar(args) => planar::run(args, &mut out),
        Command::Margins(args) => margins::run(args, &mut out),
        Command::Actuator(args) => actuator::run(args, &mut out),
        Command::Schema(args) => schema::run(args, &mut out),
        Command::Reference(args) => reference::run(args, &mut out),
        Command::Completions(args) => completions::run(args, &mut out),
    };
    let code = match result.and_then(|code| Ok(out.flush().map(|()| code)?)) {
        Ok(code) => code,
        Err(error) => {
            say(&error);
            error.code()
        }
    };
    ExitCode::from(code)
}

/// The arguments of the process, or the end of it with what is wrong with them.
fn arguments() -> Arguments {
    let mut command = with_negative_numbers(Arguments::command());
    let matches = command.get_matches_mut();
    Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command).exit())
}

/// A number below zero after an option is its value, for which the option may have a better word
/// than that there is no option of this name.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let number = |arg: clap::Arg| {
        let value = arg.get_action().takes_values() && !arg.is_positional();
        if value { arg.allow_negative_numbers(true) } else { arg }
    };
    command.mut_args(number).mut_subcommands(with_negative_numbers)
}

/// Says a line on the standard error; that nobody can read it stops no campaign.
fn say(line: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_below_zero_is_the_value_of_its_option() {
        let command = with_negative_numbers(Arguments::command());
        command.clone().debug_assert();
        for sub in command.get_subcommands() {
            for arg in sub.get_arguments().filter(|arg| arg.get_action().takes_values()) {
                assert!(arg.is_positional() || arg.is_allow_negative_numbers_set(), "{arg}");
            }
            // What clap checks in debug builds alone.
            let groups: Vec<_> = sub.get_groups().map(|group| group.get_id()).collect();
            let twice = (1..groups.len()).find(|at| groups[..*at].contains(&groups[*at]));
            assert_eq!(twice, None, "{}: {groups:?}", sub.get_name());
        }
        let line = ["tvse", "margins", "--numerator", "1", "--denominator", "1,1", "--delay", "-1"];
        assert!(command.try_get_matches_from(line).is_ok());
    }

    #[test]
    fn what_would_steer_a_terminal_is_shown_instead_of_obeyed() {
        let text = "a\tb | ζ\n";
        assert!(matches!(harmless(text.as_bytes()), Cow::Borrowed(_)));
        assert_eq!(&*harmless(b"red \x1b[31m\r\x07"), b"red ?[31m??");
    }
}
