//! `tvse import`: a modal package from the results of a finite element program.
//!
//! Files are read and modal data made by `io::import`.

use super::{Error, PASS};
use crate::io::import::{self, Allowed};
use crate::report;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Make a modal package from the results of a finite element program.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  tvse import import.toml -o vehicles/mine/modes
  tvse schema import > import.schema.json     every key of the description with its meaning

Read are: MSC Nastran HDF5, OP2 and punch files with their bulk data deck, universal files,
CalculiX .frd, and plain CSV or Parquet tables. Files named by the description lie in its folder or
below. Warnings do not stop the import; they are printed, and stored in the package.")]
pub struct Args {
    /// Import description (TOML).
    import: PathBuf,
    /// Folder of the package to make [default: `modes` beside the description].
    #[arg(short, long, value_name = "PACKAGE")]
    output: Option<PathBuf>,
    /// Replace an existing package.
    #[arg(long)]
    force: bool,
    /// Read files outside the folder of the description.
    #[arg(long)]
    allow_outside: bool,
    /// Largest result file that is read, GiB.
    #[arg(long, default_value_t = import::LARGEST_RESULT >> 30, value_name = "GIB",
          value_parser = clap::value_parser!(u64).range(1..=1024))]
    max_gib: u64,
}

/// Runs the command.
///
/// # Errors
/// All problems of the description and of the files it names, an output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let allowed = Allowed { outside: args.allow_outside, bytes: args.max_gib << 30 };
    let output = args
        .output
        .clone()
        .unwrap_or_else(|| args.import.parent().unwrap_or(Path::new("")).join("modes"));
    let loaded = import::load(&args.import, allowed)?;
    import::write(&output, &loaded, args.force)?;
    out.write_all(report::modes::modes(&loaded.made.modal).as_bytes())?;
    out.write_all(report::import::findings(&loaded.made).as_bytes())?;
    writeln!(out, "written to {}", output.display())?;
    Ok(PASS)
}
