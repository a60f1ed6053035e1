//! A plan: the uniform number of every draw in every case.
//!
//! Laws are not known here. Another plan is another variant.

use super::draw::Dispersion;
use super::stream::Stream;

/// Where the uniforms of a campaign come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Plan {
    /// Independent draws: one stream per draw key.
    MonteCarlo(Vec<Stream>),
}

impl Plan {
    /// Independent draws of every key of `dispersion` under `seed`.
    pub fn monte_carlo(dispersion: &Dispersion, seed: u64) -> Self {
        Self::MonteCarlo(dispersion.draws().iter().map(|d| Stream::new(seed, &d.key)).collect())
    }

    /// The uniforms of draw number `draw` in the consecutive cases from `first_case`.
    pub fn fill(&self, draw: usize, first_case: u64, uniforms: &mut [f64]) {
        match self {
            Self::MonteCarlo(streams) => streams[draw].fill(first_case, uniforms),
        }
    }
}
