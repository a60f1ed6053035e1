//! `tvse merge`: the tables of a run whose cases were evaluated in parts.

use super::{Error, INCOMPLETE, campaign};
use crate::io::store::Store;
use crate::io::{Results, inputs, maker};
use std::io::Write;
use std::path::PathBuf;

/// Makes the tables of a run from its shards, with the bytes that one local run gives.
///
/// Checks that every case is there once, that the shards are whole and of the same scenario, seed,
/// program and instruction set, and names what is not so. Memory does not grow with the cases.
/// Exit code 3 if cases are missing: the shards stay, and what is missing is listed.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse merge runs/reference                    # parts that were written to one folder
  tvse merge runs/reference /scratch/a /scratch/b   # parts that were written to several")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Further folders with parts of the same run; they stay as they are
    from: Vec<PathBuf>,
    /// Gates to hold the results against; the exit code is theirs (see `tvse gate`)
    #[arg(long, value_name = "FILE")]
    gates: Option<PathBuf>,
    #[command(flatten)]
    outputs: super::gate::Outputs,
}

/// Runs the command.
///
/// # Errors
/// No such run, another process at work, shards that are damaged or do not belong together, missing
/// cases, output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let store = Store::gather(&args.run, &args.from)?;
    campaign::check_gates(args.gates.as_deref(), store.outline())?;
    let missing = store.missing();
    if !missing.is_empty() {
        let populations = &store.outline().definition.populations;
        let name = |index: usize| populations[index].name.as_str();
        for span in &missing {
            let (first, last) = (span.cases.start, span.cases.end - 1);
            writeln!(out, "missing: {} cases {first} to {last}", name(span.population))?;
        }
        let cases: u64 = missing.iter().map(|span| span.cases.end - span.cases.start).sum();
        super::say(format_args!(
            "{cases} cases are missing: evaluate them with the shards or --resume"
        ));
        return Ok(INCOMPLETE);
    }
    inputs::check(&args.run, &store.outline().inputs)?;
    let title = format!("merged on {}", maker::instruction_set());
    let gates = args.gates.as_deref().map(|gates| (gates, &args.outputs));
    campaign::finish(Results::of(store), 1, &title, gates, out)
}
