//! Statistics of a sample: values go in, estimates with their intervals come out; knows no rocket.
//!
//! Nothing here draws, reads or prints. Exact intervals take an [`Independent`] witness, so that
//! they cannot be asked of cases that were not drawn independently.

mod binomial;
mod bootstrap;
mod convergence;
mod drawing;
mod error;
mod estimate;
mod moments;
mod normal;
mod paired;
mod probability;
mod proportion;
mod quantile;
mod replicates;
mod root;
mod selection;
pub mod sensitivity;
mod student;
mod tolerance;

pub use bootstrap::{Bootstrap, BootstrapInterval};
pub use convergence::{checkpoints, running};
pub use drawing::{Drawing, Independent};
pub use error::Error;
pub use estimate::{Estimate, Method, Sides};
pub use moments::{Moments, RunningMoments};
pub use paired::PairedDifference;
pub use probability::{Confidence, Probability};
pub use proportion::{clopper_pearson, rejects_at_least, rejects_at_most};
pub use quantile::{Ordered, interval_ranks, quantile_of};
pub use replicates::{BEYOND_EACH, of_replicates, of_sections};
pub use selection::Selection;
pub use tolerance::{
    Tails, ToleranceBound, ToleranceInterval, consumers_risk, least_cases, most_exceedances,
    tolerance_bound, tolerance_interval,
};

#[cfg(test)]
mod coverage;
