//! `tvse plan`: the draws of a run, nothing solved.

use super::{Error, PASS};
use crate::campaign::outline::DrawColumn;
use crate::campaign::{Outline, StoredPoles};
use crate::{io, report};
use std::io::Write;
use std::path::PathBuf;

/// Draws of a run: what each draw key yields beside its law, and every draw as Parquet.
///
/// Nothing is solved; corners with signs to be evaluated are left out.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse plan runs/reference.toml
  tvse plan runs/reference.toml --output draws.parquet")]
pub struct Args {
    /// The run definition
    run: PathBuf,
    /// File for the draws of every case; it must not exist
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    outside: super::outside::Args,
}

/// Runs the command.
///
/// # Errors
/// All problems of the run and what it names; an output file that exists or cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let loaded = io::scenario::load(&args.run, args.outside.reach())?;
    let mut definition = loaded.definition.clone();
    let corners = loaded.corners.iter().flat_map(|c| c.populations(&definition.populations));
    let open: Vec<usize> = corners.collect();
    let mut index = 0..;
    definition.populations.retain(|_| index.next().is_none_or(|index| !open.contains(&index)));
    let sampler = loaded.sampler(&definition)?;
    let draws = loaded.dispersion.draws();
    let mut text = report::plan::table(&definition, draws, &sampler);
    if let Some(path) = &args.output {
        let columns = draws.iter().map(DrawColumn::of).collect();
        let outline = Outline::new(definition, StoredPoles::Named, columns, Vec::new());
        let rows = io::plan::write(path, &outline, &sampler)?;
        text += &format!("{}: {rows} rows\n", path.display());
    }
    out.write_all(text.as_bytes())?;
    Ok(PASS)
}
