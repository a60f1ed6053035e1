//! `tvse how-many`: the cases a claim needs, and what a finished campaign can claim.

use crate::cli::Error;
use crate::io::{Run, summarise};
use crate::report::how_many::{Claim, cases_needed, exceedances_allowed, finished};
use crate::stats::{Confidence, Probability, Tails};
use std::io::Write;
use std::path::PathBuf;

/// How many cases a claim needs, or what a number of cases can claim.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  tvse how-many --coverage 0.9973 --risk 0.10                  cases for 0 to 3 exceedances
  tvse how-many --coverage 0.95 --risk 0.05 --two-sided        two bounds that enclose
  tvse how-many --coverage 0.9973 --risk 0.10 --cases 2000     what 2000 cases can claim
  tvse how-many --coverage 0.95 --risk 0.10 --run runs/reference    what a finished run can claim")]
pub struct Args {
    /// Share of the population that the bound keeps, above 0 and below 1.
    #[arg(long)]
    coverage: f64,
    /// Consumer's risk that it keeps less, above 0 and below 1: one minus the confidence.
    #[arg(long)]
    risk: f64,
    /// Exceedances allowed, with two bounds on each side [default: 0 to 3].
    #[arg(long)]
    exceedances: Option<u64>,
    /// Two bounds that enclose the share, instead of one.
    #[arg(long)]
    two_sided: bool,
    /// Cases of a campaign: shows the exceedances it may have.
    #[arg(long)]
    cases: Option<u64>,
    /// Folder of a finished run: what it can claim about unstable poles.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["cases", "exceedances", "two_sided"])]
    run: Option<PathBuf>,
}

/// Prints the table.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let usage = |name: &'static str| move |error| Error::Usage(format!("{name}: {error}"));
    if args.cases == Some(0) {
        return Err(Error::Usage("--cases: found 0; allowed: 1 or more".into()));
    }
    let claim = Claim {
        coverage: Probability::new(args.coverage).map_err(usage("--coverage"))?,
        confidence: Confidence::from_risk(args.risk).map_err(usage("--risk"))?,
        tails: if args.two_sided { Tails::Two } else { Tails::One },
    };
    if let Some(folder) = &args.run {
        let run = Run::open(folder)?;
        let populations = &run.outline().definition.populations;
        let refused: Vec<String> = populations
            .iter()
            .filter_map(|p| Some(format!("{}: {}", p.name, p.drawing().independent().err()?)))
            .collect();
        if refused.len() == populations.len() {
            return Err(Error::Usage(format!("no claim: {}", refused.join("; "))));
        }
        let rows = summarise::summary(&run, summarise::MEMORY)?;
        let text = finished(&claim, run.outline(), &rows);
        write!(out, "{}", text.map_err(|error| Error::Usage(error.to_string()))?)?;
        return Ok(super::PASS);
    }
    let text = match (args.cases, args.exceedances) {
        (Some(cases), asked) => exceedances_allowed(&claim, cases, asked),
        (None, Some(k)) => cases_needed(&claim, [k]),
        (None, None) => cases_needed(&claim, 0..=3),
    };
    write!(out, "{}", text.map_err(|error| Error::Usage(error.to_string()))?)?;
    Ok(super::PASS)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(coverage: f64, risk: f64, cases: Option<u64>) -> Args {
        Args { coverage, risk, exceedances: None, two_sided: false, cases, run: None }
    }

    #[test]
    fn the_answer_is_printed() {
        let mut out = Vec::new();
        assert_eq!(run(&args(0.95, 0.05, None), &mut out).unwrap(), 0);
        assert!(String::from_utf8(out).unwrap().contains("59"));
    }

    #[test]
    fn a_claim_that_is_none_is_wrong_usage() {
        for (coverage, risk, cases) in
            [(1.0, 0.1, None), (0.9, 0.0, None), (f64::NAN, 0.1, None), (0.9, 0.1, Some(0))]
        {
            let error = run(&args(coverage, risk, cases), &mut Vec::new()).unwrap_err();
            assert_eq!(error.code(), crate::cli::USAGE);
        }
    }
}
