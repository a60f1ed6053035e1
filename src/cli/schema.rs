//! `tvse schema`: the JSON Schema of a TOML file.

use super::{Error, PASS};
use crate::gate;
use crate::io::package;
use crate::scenario::schema::{FileKind, schema};
use std::io::Write;

/// The JSON Schema of a kind of file, for editors and for reading.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse schema vehicle > vehicle.schema.json
then, as the first line of vehicle.toml, for editors with a TOML language server:
  #:schema ./vehicle.schema.json")]
pub struct Args {
    /// The kind of file
    file: File,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum File {
    /// A vehicle: engines, nozzles, actuators, motors
    Vehicle,
    /// A run definition
    Run,
    /// A dispersion table
    Dispersion,
    /// A stick model
    Stick,
    /// An import description
    Import,
    /// Gates
    Gates,
    /// The head of a modal package, package.toml
    Package,
    /// The outcomes of gates, gates.json
    Report,
}

/// Runs the command.
///
/// # Errors
/// Output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let schema = match args.file {
        File::Vehicle => schema(FileKind::Vehicle),
        File::Run => schema(FileKind::Run),
        File::Dispersion => schema(FileKind::Dispersion),
        File::Stick => schema(FileKind::Stick),
        File::Import => schema(FileKind::Import),
        File::Gates => schema(FileKind::Gates),
        File::Package => package::schema(),
        File::Report => gate::report_schema(),
    };
    writeln!(out, "{:#}", schema.as_value())?;
    Ok(PASS)
}
