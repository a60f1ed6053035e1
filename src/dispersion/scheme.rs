//! A scheme: how the cases of a population are to come about, and whether they can.
//!
//! Carried out by `plan`.

use super::draw::Dispersion;
use super::plan::outside;
use super::sobol;
use super::strata::{LARGEST_BLOCK, SMALLEST_BLOCK, block};
use crate::stats::Drawing;
use serde::{Deserialize, Serialize};

/// Low and high place of a draw in a designed case.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Levels {
    /// Normal scores.
    Scores([f64; 2]),
    /// The `worst` values of the draw's row.
    Worst,
}

/// How the cases of a population come about.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// Independent draws.
    #[default]
    MonteCarlo,
    /// Latin hypercubes, independent of each other.
    LatinHypercube {
        /// Their number.
        replicates: u64,
    },
    /// Sobol sequences, scrambled independently of each other.
    Sobol {
        /// Their number.
        replicates: u64,
    },
    /// Outer draws of what is known, each with an inner campaign over what is not: case c is case
    /// c mod `inner` of outer draw c/`inner`.
    Nested {
        /// Cases of an inner campaign.
        inner: u64,
        /// Whether what is known on the flight day is drawn outside, as what is known per vehicle.
        flight_day_outside: bool,
        /// Share of bad cases that an outer draw may have.
        allowed_share: f64,
        /// Consumer's risk of the statement on an outer draw.
        risk: f64,
    },
    /// Two independent samples and their crossings, d + 2 cases a row for d draws (Saltelli 2010):
    /// the first sample, the second, and the first with one draw after the other from the second.
    Saltelli,
    /// One draw after the other at its low and its high place, all else nominal.
    OneAtATime {
        /// Indices of the draws.
        draws: Vec<usize>,
        /// Where they go.
        at: Levels,
    },
    /// Every draw at its low or its high place: two-level factorial, full or fractional.
    Corners {
        /// Indices of the draws.
        draws: Vec<usize>,
        /// Where they go.
        at: Levels,
        /// For each draw the bits of the case index whose parity says low (even) or high.
        generators: Vec<u64>,
        /// Resolution of the fraction; none for the full factorial.
        resolution: Option<usize>,
    },
    /// Cases read from a file.
    File,
}

/// Why a scheme cannot be carried out.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key}: found {found}; allowed: {allowed}")]
pub struct Refusal {
    /// Key of the run file at fault.
    pub key: &'static str,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
}

pub(super) fn refuse<T>(
    key: &'static str,
    found: String,
    allowed: impl Into<String>,
) -> Result<T, Refusal> {
    Err(Refusal { key, found, allowed: allowed.into() })
}

impl Scheme {
    /// Whether the cases are independent draws.
    pub fn is_monte_carlo(&self) -> bool {
        *self == Self::MonteCarlo
    }

    /// What may be concluded from the cases.
    pub fn drawing(&self) -> Drawing {
        match self {
            Self::MonteCarlo => Drawing::Independent,
            Self::LatinHypercube { .. } => Drawing::LatinHypercube,
            Self::Sobol { .. } => Drawing::LowDiscrepancy,
            Self::Nested { .. } => Drawing::Nested,
            Self::Saltelli => Drawing::Crossed,
            Self::OneAtATime { .. } | Self::Corners { .. } | Self::File => Drawing::Designed,
        }
    }

    /// Independent replicates of the whole design; 1 where there is none.
    pub fn replicates(&self) -> u64 {
        match self {
            Self::LatinHypercube { replicates } | Self::Sobol { replicates } => *replicates,
            _ => 1,
        }
    }

    /// Whether a greater number of cases leaves the first ones as they are, so that a finished run
    /// can be extended.
    pub fn keeps_first_cases(&self) -> bool {
        match self {
            Self::MonteCarlo | Self::Sobol { .. } | Self::Nested { .. } | Self::Saltelli => true,
            Self::LatinHypercube { .. }
            | Self::OneAtATime { .. }
            | Self::Corners { .. }
            | Self::File => false,
        }
    }

    /// The number of cases that the scheme itself has; none where any number can be asked for.
    pub fn own_cases(&self) -> Option<u64> {
        match self {
            Self::OneAtATime { draws, .. } => Some(2 * draws.len() as u64),
            Self::Corners { generators, .. } => {
                Some(1 << generators.iter().fold(0, |all, g| all | g).count_ones())
            }
            _ => None,
        }
    }

    /// Whether a finished run can be extended by `more` cases, with so many draw keys.
    ///
    /// # Errors
    /// A scheme whose first cases would change, or of another number of cases at once.
    pub fn check_extension(&self, more: u64, draws: u64) -> Result<(), Refusal> {
        if !self.keeps_first_cases() {
            let allowed = "a run whose plan keeps its first cases when their number grows: \
                           independent draws, Sobol, nested or Saltelli";
            return refuse("plan", self.describe(), allowed);
        }
        let at_once = match self {
            Self::Nested { inner, .. } => *inner,
            Self::Saltelli => draws + 2,
            _ => self.replicates(),
        };
        if more.is_multiple_of(at_once) {
            return Ok(());
        }
        refuse("cases", format!("{more} more"), format!("a multiple of {at_once}"))
    }

    /// Whether the number of cases is not free.
    pub fn has_own_cases(&self) -> bool {
        matches!(self, Self::OneAtATime { .. } | Self::Corners { .. } | Self::File)
    }

    /// Words for people.
    pub fn describe(&self) -> String {
        let replicates = |what: &str, n: u64| match n {
            1 => format!("{what}, one replicate (no intervals)"),
            n => format!("{what}, {n} independent replicates"),
        };
        match self {
            Self::MonteCarlo => "independent draws (Monte Carlo)".into(),
            Self::LatinHypercube { replicates: n } => replicates("Latin hypercube", *n),
            Self::Sobol { replicates: n } => replicates("scrambled Sobol sequence", *n),
            Self::Nested { inner, flight_day_outside, .. } => {
                let outside =
                    if *flight_day_outside { "vehicle and flight day" } else { "vehicle" };
                format!("nested, outer draws of {outside}, {inner} inner cases each")
            }
            Self::Saltelli => "Saltelli's plan of two crossed samples".into(),
            Self::OneAtATime { draws, .. } => format!("one at a time, {} keys", draws.len()),
            Self::Corners { draws, resolution: None, .. } => {
                format!("full factorial of {} keys at two levels", draws.len())
            }
            Self::Corners { draws, resolution: Some(resolution), .. } => {
                format!("factorial of {} keys at two levels, resolution {resolution}", draws.len())
            }
            Self::File => "cases from a file".into(),
        }
    }

    /// Whether `cases` of `dispersion` can be drawn so.
    ///
    /// # Errors
    /// The key of the run file at fault.
    pub fn check(&self, cases: u64, dispersion: &Dispersion) -> Result<(), Refusal> {
        let multiple = |key, of: u64, what: &str| {
            if of > 0 && cases.is_multiple_of(of) && cases > 0 {
                return Ok(());
            }
            refuse(key, cases.to_string(), format!("a multiple of {of}, {what}"))
        };
        let draws = dispersion.draws().len();
        match self {
            Self::MonteCarlo | Self::OneAtATime { .. } | Self::Corners { .. } | Self::File => {
                Ok(())
            }
            Self::LatinHypercube { replicates } => {
                multiple("cases", *replicates, "the number of replicates")?;
                let points = cases / replicates;
                if dispersion.groups().is_empty() || block(points).is_some() {
                    return Ok(());
                }
                let near = points.div_ceil(LARGEST_BLOCK) * LARGEST_BLOCK * replicates;
                let allowed = format!(
                    "with correlated draws, cases a replicate that have a divisor from \
                     {SMALLEST_BLOCK} to {LARGEST_BLOCK}, for instance cases = {near}"
                );
                refuse("cases", cases.to_string(), allowed)
            }
            Self::Sobol { replicates } => {
                multiple("cases", *replicates, "the number of replicates")?;
                if draws > sobol::MOST_DIMENSIONS {
                    let allowed = format!(
                        "at most {} draw keys, the dimensions of the Sobol sequence",
                        sobol::MOST_DIMENSIONS
                    );
                    return refuse("plan.kind", format!("{draws} draw keys"), allowed);
                }
                Ok(())
            }
            Self::Nested { inner, .. } => {
                multiple("cases", *inner, "the cases of an inner campaign")?;
                let outside = outside(self, dispersion);
                for (wanted, what) in [(true, "outer"), (false, "inner")] {
                    if !outside.contains(&wanted) {
                        let found = format!("no draw key of the {what} classes");
                        let allowed = "rows with `class` on both sides: \"vehicle\" or \
                                       \"flight_day\", and \"unknown\"";
                        return refuse("plan.kind", found, allowed);
                    }
                }
                Ok(())
            }
            Self::Saltelli => {
                multiple("cases", draws as u64 + 2, "the number of draw keys and two")?;
                if dispersion.groups().is_empty() {
                    return Ok(());
                }
                let allowed = "no [[correlation]]: the indices are those of independent draws";
                refuse("plan.kind", "correlated draws".into(), allowed)
            }
        }
    }
}
