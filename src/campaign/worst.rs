//! Worst on worst: the draws that make an objective worst, by vertices, by enumeration of corners and by
//! bounded descent with analytic derivatives.
//!
//! What is found was looked for: it is [`Drawing::Selected`], from which no share of a population
//! follows. How a search is carried out is in [`mod@search`], the descent itself in [`descent`].

pub mod descent;
pub mod objective;
pub mod search;

pub use objective::{Aim, Objective, Quantity, Spot};
pub use search::{Error, Plan, Work, search};

use crate::stats::Drawing;
use descent::Region;
use serde::{Deserialize, Serialize};

/// How a worst case was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The worst case of the campaign's sample, for comparison.
    Sample,
    /// Every key at its adverse side, by the signs of the derivatives.
    Vertex,
    /// The worst of all corners of the most influential keys, the others at the vertex.
    Corners,
    /// Descent inside the box of n σ for every key.
    Box,
    /// Descent inside the ellipsoid of equal joint likelihood.
    Ellipsoid,
}

impl Method {
    /// The word in names and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sample => "sample",
            Self::Vertex => "vertex",
            Self::Corners => "corners",
            Self::Box => "box",
            Self::Ellipsoid => "ellipsoid",
        }
    }

    /// What may be concluded from cases found so: nothing about a population.
    pub fn drawing(self) -> Drawing {
        Drawing::Selected
    }

    /// The method that searches a region by descent.
    pub fn of(region: Region) -> Self {
        match region {
            Region::Box(_) => Self::Box,
            Region::Ball(_) => Self::Ellipsoid,
        }
    }
}

/// One worst case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorstCase {
    /// Name, `[a-z0-9_]+`, unique in a search.
    pub name: String,
    /// How it was found.
    pub method: Method,
    /// Index of the flight time at which it is worst.
    pub flight_time: usize,
    /// Every draw that has a value: index and value.
    pub values: Vec<(usize, f64)>,
    /// Independent normal score of every draw, σ; `None` where it has none.
    pub scores: Vec<Option<f64>>,
    /// Change of the objective per σ of every draw there; empty for a case of the sample.
    pub by_score: Vec<f64>,
    /// The objective; less is worse.
    pub objective: f64,
    /// The less stable pole of the mode, rad/s: real and imaginary part.
    pub pole: [f64; 2],
    /// Linear prediction of what the region still holds below the objective; `None` where nothing was
    /// descended.
    pub gap: Option<f64>,
    /// Times a search began anew because the pole that it followed was no longer the mode's worst.
    pub switches: usize,
}

impl WorstCase {
    /// Distance from the median vehicle in independent normal scores, √Σz².
    pub fn distance(&self) -> f64 {
        self.scores.iter().flatten().map(|z| z * z).sum::<f64>().sqrt()
    }

    /// Greatest score of a key, σ.
    pub fn farthest(&self) -> f64 {
        self.scores.iter().flatten().fold(0.0, |most, z| most.max(z.abs()))
    }

    /// Decimal logarithm of its joint density over that of the median vehicle, −Σz²/2.
    pub fn log10_likelihood(&self) -> f64 {
        -0.5 * self.distance().powi(2) / std::f64::consts::LN_10
    }

    /// Damping ratio of the less stable pole, −.
    pub fn damping_ratio(&self) -> f64 {
        -self.pole[0] / self.pole[0].hypot(self.pole[1])
    }

    /// Time to double, s, where unstable.
    pub fn time_to_double_s(&self) -> Option<f64> {
        (self.pole[0] > 0.0).then(|| std::f64::consts::LN_2 / self.pole[0])
    }
}

/// How a case stands to a sample of the same objective.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Cases of the sample that are as bad or worse.
    pub worse: usize,
    /// Cases of the sample with a result.
    pub cases: usize,
    /// How far it lies below the worst of the sample, in ranges (best less worst) of the sample;
    /// negative where the sample holds a worse one.
    pub ranges_below: f64,
}

impl Standing {
    /// Of `objective` in the objectives of a sample; `None` for fewer than two different ones.
    pub fn of(objective: f64, sample: &[f64]) -> Option<Self> {
        let ends = sample.iter().filter(|value| value.is_finite());
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        });
        (low < high).then(|| Self {
            worse: sample.iter().filter(|value| **value <= objective).count(),
            cases: sample.iter().filter(|value| value.is_finite()).count(),
            ranges_below: (low - objective) / (high - low),
        })
    }
}

#[cfg(test)]
mod tests;
