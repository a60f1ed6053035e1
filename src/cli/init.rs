//! `tvse init`: a folder to start from.

use super::{Error, PASS};
use crate::io::scaffold;
use std::io::Write;
use std::path::PathBuf;

/// A new folder with commented scenario files and a copy of the reference vehicle.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse init study && cd study && tvse run runs/smoke.toml")]
pub struct Args {
    /// The folder; it must not exist
    folder: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A folder that exists or cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let folder = args.folder.display();
    for path in scaffold::write(&args.folder)? {
        writeln!(out, "{folder}/{path}")?;
    }
    writeln!(
        out,
        "\nThe vehicle is SLS-like and synthetic. Next: cd {folder} && tvse check runs/smoke.toml"
    )?;
    Ok(PASS)
}
