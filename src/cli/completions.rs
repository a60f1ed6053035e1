//! `tvse completions`: completions for a shell.

use super::{Error, PASS};
use clap::CommandFactory;
use std::io::Write;

/// Completions for a shell, on the standard output.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse completions bash > ~/.local/share/bash-completion/completions/tvse")]
pub struct Args {
    /// The shell
    shell: clap_complete::Shell,
}

/// Runs the command.
///
/// # Errors
/// Output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    // The generator panics on a closed pipe, so it writes into memory.
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut super::Arguments::command(), "tvse", &mut text);
    out.write_all(&text)?;
    Ok(PASS)
}
