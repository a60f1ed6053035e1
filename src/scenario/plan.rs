//! The plan of a run: from the run file to a scheme and its number of cases.
//!
//! How a scheme draws is decided in `dispersion::plan`.

use super::run::{has_worst, matching};
use super::run_file::{KnownFile, PlanFile, RunFile};
use super::table::Findings;
use crate::campaign::definition::MOST_CASES;
use crate::dispersion::factorial::generators;
use crate::dispersion::{Dispersion, Draw, Levels, Listed, Role, Scheme};
use crate::stats::{self, Confidence, Probability, Tails};

/// The scheme of the dispersed cases and their number; checked against the dispersion if there is
/// one (problems go to `f`).
pub fn scheme(
    file: &RunFile,
    dispersion: Option<&Dispersion>,
    listed: Option<&Listed>,
    f: &mut Findings,
) -> (Scheme, u64) {
    let free = |scheme| (scheme, None);
    let (scheme, own) = match &file.plan {
        PlanFile::MonteCarlo {} => free(Scheme::MonteCarlo),
        PlanFile::LatinHypercube { replicates } => {
            free(Scheme::LatinHypercube { replicates: replicates.unwrap_or(1) })
        }
        PlanFile::Sobol { replicates } => {
            free(Scheme::Sobol { replicates: replicates.unwrap_or(1) })
        }
        PlanFile::Nested { outer, inner, known, allowed_share_unstable, risk } => {
            statement(*inner, *allowed_share_unstable, *risk, f);
            let scheme = Scheme::Nested {
                inner: *inner,
                flight_day_outside: *known != Some(KnownFile::Vehicle),
                allowed_share: *allowed_share_unstable,
                risk: *risk,
            };
            (scheme, Some(outer.saturating_mul(*inner)))
        }
        PlanFile::Saltelli { rows } => {
            let width = dispersion.map_or(2, |d| d.draws().len() as u64 + 2);
            (Scheme::Saltelli, Some(rows.saturating_mul(width)))
        }
        PlanFile::OneAtATime { keys, at } => {
            let (draws, at) = places(dispersion, keys.as_deref(), *at, f);
            designed(Scheme::OneAtATime { draws, at })
        }
        PlanFile::Corners { keys, at, resolution } => {
            let (draws, at) = places(dispersion, keys.as_deref(), *at, f);
            let resolution = resolution.map(|resolution| resolution as usize);
            if resolution.is_none() && draws.len() as u32 > MOST_CASES.ilog2() {
                let found = format!("{} keys", draws.len());
                let allowed = format!("at most {} keys, or a `resolution`", MOST_CASES.ilog2());
                f.push("plan.keys", found, allowed);
                (Scheme::MonteCarlo, Some(1))
            } else {
                let generators = generators(draws.len(), resolution);
                designed(Scheme::Corners { draws, at, generators, resolution })
            }
        }
        PlanFile::File { .. } => (Scheme::File, Some(listed.map_or(1, Listed::cases))),
    };
    let cases = match (file.cases, own) {
        (Some(cases), None) => cases,
        (None, Some(own)) => own,
        (None, None) => {
            f.push("cases", "nothing", "the number of dispersed cases");
            return (Scheme::MonteCarlo, 1);
        }
        (Some(cases), Some(own)) => {
            f.push("cases", cases.to_string(), format!("nothing: the plan has {own} cases"));
            own
        }
    };
    if !(1..=MOST_CASES).contains(&cases) {
        f.push("plan", format!("{cases} cases"), format!("1 to {MOST_CASES} cases"));
    } else if let Some(Err(refusal)) = dispersion.map(|d| scheme.check(cases, d)) {
        f.push(refusal.key, refusal.found, refusal.allowed);
    }
    (scheme, cases)
}

fn designed(scheme: Scheme) -> (Scheme, Option<u64>) {
    let cases = scheme.own_cases();
    (scheme, cases)
}

/// The statement about an outer draw can be made with as many inner cases.
fn statement(inner: u64, allowed_share: f64, risk: f64, f: &mut Findings) {
    // Values out of range are reported by the reader of the file.
    let needed = || {
        let coverage = Probability::new(1.0 - allowed_share)?;
        stats::least_cases(0, coverage, Confidence::from_risk(risk)?, Tails::One)
    };
    if let Ok(needed) = needed()
        && inner < needed
    {
        let allowed = format!("{needed} or more: fewer cannot show the statement, all being good");
        f.push("plan.inner", inner.to_string(), allowed);
    }
}

/// The keys of a design and their places.
fn places(
    dispersion: Option<&Dispersion>,
    keys: Option<&[String]>,
    at: Option<[f64; 2]>,
    f: &mut Findings,
) -> (Vec<usize>, Levels) {
    let fits: fn(&Draw) -> bool = match at {
        None => has_worst,
        Some([low, high]) => {
            if !(low < high) {
                f.push("plan.at", format!("[{low}, {high}]"), "[low, high] in this order");
            }
            |draw| draw.role != Role::Common
        }
    };
    let levels = at.map_or(Levels::Worst, Levels::Scores);
    let Some(dispersion) = dispersion else { return (vec![0], levels) };
    let draws = match keys {
        Some(entries) => matching(dispersion, entries, fits, "plan.keys", f),
        None => {
            let all = dispersion.draws().iter().enumerate();
            all.filter(|(_, draw)| fits(draw)).map(|(index, _)| index).collect()
        }
    };
    if draws.is_empty() {
        f.push("plan.keys", "no draw key", "at least one; with `worst` values, or give `at`");
        return (vec![0], levels);
    }
    (draws, levels)
}
