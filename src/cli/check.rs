//! `tvse check`: reads everything a run names and says what it found.

use super::{Error, PASS, gate};
use crate::campaign::{DrawColumn, Outline, StoredPoles};
use crate::io;
use crate::report::scenario;
use std::io::Write;
use std::path::PathBuf;

/// Reads everything a run names and reports what it found, or every problem at once.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse check runs/reference.toml")]
pub struct Args {
    /// The run definition
    run: PathBuf,
    #[command(flatten)]
    outside: super::outside::Args,
}

/// Runs the command.
///
/// # Errors
/// All problems of the run file and of what it names.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let loaded = io::scenario::load(&args.run, args.outside.reach())?;
    if let Some(gates) = &loaded.gates {
        let draws = loaded.dispersion.draws().iter().map(DrawColumn::of).collect();
        let definition = loaded.definition.clone();
        gate::rules(gates, &Outline::new(definition, StoredPoles::Named, draws, Vec::new()))?;
    }
    let corners: Vec<usize> =
        loaded.corners.iter().flat_map(|c| c.populations(&loaded.definition.populations)).collect();
    write!(
        out,
        "{}",
        scenario::overview(
            &loaded.vehicle.vehicle,
            &loaded.dispersion,
            &loaded.definition,
            &corners
        )
    )?;
    Ok(PASS)
}
