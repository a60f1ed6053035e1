//! A plan: the uniform number of every draw in every case, or the cases themselves.
//!
//! What a plan is asked to be is a [`Scheme`]; laws are not known here. Cases of replicates take turns:
//! case c is point c/R of replicate c mod R, so that more cases never move the first ones.

use super::draw::{Dispersion, Role};
use super::keyed::Key;
use super::law::Position;
use super::scheme::{Levels, Refusal, Scheme, refuse};
use super::sobol::{self, Directions};
use super::strata::Strata;
use super::stream::Stream;
use super::table::Class;

/// Key of the second sample of a Saltelli plan: no draw key ends so.
const SECOND: &str = " # second sample of saltelli";

/// Which draws are drawn once for an inner campaign.
pub(super) fn outside(scheme: &Scheme, dispersion: &Dispersion) -> Vec<bool> {
    let Scheme::Nested { flight_day_outside, .. } = scheme else { return Vec::new() };
    let outside = |class| match class {
        Class::Vehicle => true,
        Class::FlightDay => *flight_day_outside,
        Class::Unknown => false,
    };
    dispersion.draws().iter().map(|draw| outside(draw.class)).collect()
}

/// Cases of a plan file: for each draw that acts its values in the order of the cases.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Listed {
    /// Index of the draw and its value in every case, in the unit of its law.
    pub columns: Vec<(usize, Vec<f64>)>,
}

impl Listed {
    /// Number of cases.
    pub fn cases(&self) -> u64 {
        self.columns.first().map_or(0, |(_, values)| values.len() as u64)
    }
}

/// Where the cases of a campaign come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Plan {
    /// Independent draws: one stream per draw key.
    MonteCarlo(Vec<Stream>),
    /// Latin hypercubes.
    LatinHypercube(Strata),
    /// Scrambled Sobol sequences: directions per draw, keys per draw and replicate.
    Sobol {
        /// Directions of the dimension of each draw.
        directions: Vec<Directions>,
        /// Key of each draw, replicate by replicate.
        keys: Vec<Vec<Key>>,
    },
    /// Outer draws with inner campaigns.
    Nested {
        /// One stream per draw key.
        streams: Vec<Stream>,
        /// Whether the draw belongs to the outer draw.
        outside: Vec<bool>,
        /// Cases of an inner campaign.
        inner: u64,
    },
    /// Two samples and their crossings.
    Saltelli([Vec<Stream>; 2]),
    /// Chosen cases.
    Designed(Design),
}

impl Plan {
    /// Independent draws of every key of `dispersion` under `seed`.
    pub fn monte_carlo(dispersion: &Dispersion, seed: u64) -> Self {
        Self::MonteCarlo(streams(dispersion, seed, ""))
    }

    /// The plan of `scheme` for `cases` cases; `listed` are those of its file.
    ///
    /// # Errors
    /// As [`Scheme::check`]; a scheme of cases from a file without them.
    pub fn new(
        scheme: &Scheme,
        cases: u64,
        dispersion: &Dispersion,
        seed: u64,
        listed: Option<&Listed>,
    ) -> Result<Self, Refusal> {
        scheme.check(cases, dispersion)?;
        let all = dispersion.draws();
        Ok(match scheme {
            Scheme::MonteCarlo => Self::monte_carlo(dispersion, seed),
            Scheme::LatinHypercube { replicates } => {
                Self::LatinHypercube(Strata::new(dispersion, seed, *replicates, cases / replicates))
            }
            Scheme::Sobol { replicates } => {
                let directions = Directions::first(all.len());
                let key = |name: &str| {
                    (0..*replicates).map(|r| Key::new(sobol::CONTEXT, seed, r, name)).collect()
                };
                Self::Sobol {
                    directions: all.iter().map(|d| directions[d.dimension].clone()).collect(),
                    keys: all.iter().map(|d| key(&d.key)).collect(),
                }
            }
            Scheme::Nested { inner, .. } => Self::Nested {
                streams: streams(dispersion, seed, ""),
                outside: outside(scheme, dispersion),
                inner: *inner,
            },
            Scheme::Saltelli => {
                Self::Saltelli(["", SECOND].map(|more| streams(dispersion, seed, more)))
            }
            Scheme::OneAtATime { draws, at } => Self::Designed(Design::OneAtATime(
                draws.iter().map(|&d| (d, levels(dispersion, d, *at))).collect(),
            )),
            Scheme::Corners { draws, at, generators, .. } => {
                let place = |(&d, &g): (&usize, &u64)| (d, levels(dispersion, d, *at), g);
                Self::Designed(Design::Corners(draws.iter().zip(generators).map(place).collect()))
            }
            Scheme::File => match listed {
                Some(listed) if listed.cases() == cases => {
                    Self::Designed(Design::Listed(listed.clone()))
                }
                found => {
                    let found = found.map_or(0, Listed::cases);
                    return refuse("plan.path", format!("{found} cases"), format!("{cases} cases"));
                }
            },
        })
    }

    /// The uniforms of every draw in the consecutive cases from `first_case`, as many as each of
    /// the equal parts of `uniforms`, one for each draw, holds. A design has none.
    pub fn fill(&self, dispersion: &Dispersion, first_case: u64, uniforms: &mut [f64]) {
        let count = dispersion.draws().len();
        if count == 0 {
            return;
        }
        let window = uniforms.len() / count;
        let parts = uniforms.chunks_exact_mut(window).enumerate();
        match self {
            Self::MonteCarlo(streams) => {
                parts.for_each(|(draw, part)| streams[draw].fill(first_case, part));
            }
            Self::LatinHypercube(strata) => strata.fill(dispersion, first_case, uniforms, window),
            Self::Sobol { directions, keys } => {
                for (draw, part) in parts {
                    let keys = &keys[draw];
                    for (u, case) in part.iter_mut().zip(first_case..) {
                        let (replicate, point) = turn(case, keys.len() as u64);
                        *u = directions[draw].uniform(point, &keys[replicate]);
                    }
                }
            }
            Self::Nested { streams, outside, inner } => {
                for (draw, part) in parts {
                    if outside[draw] {
                        for (u, case) in part.iter_mut().zip(first_case..) {
                            *u = streams[draw].uniform(case / inner);
                        }
                    } else {
                        streams[draw].fill(first_case, part);
                    }
                }
            }
            Self::Saltelli([first, second]) => {
                let width = count as u64 + 2;
                for (draw, part) in parts {
                    for (u, case) in part.iter_mut().zip(first_case..) {
                        let (row, place) = (case / width, case % width);
                        let crossed = place == 1 || place == draw as u64 + 2;
                        let stream = if crossed { &second[draw] } else { &first[draw] };
                        *u = stream.uniform(row);
                    }
                }
            }
            Self::Designed(_) => uniforms.fill(0.5),
        }
    }

    /// Whether the uniforms of correlated draws are correlated already.
    pub fn correlates(&self) -> bool {
        matches!(self, Self::LatinHypercube(_))
    }
}

/// Replicate and point of a case.
pub(super) fn turn(case: u64, replicates: u64) -> (usize, u64) {
    ((case % replicates) as usize, case / replicates)
}

fn streams(dispersion: &Dispersion, seed: u64, more: &str) -> Vec<Stream> {
    dispersion.draws().iter().map(|d| Stream::new(seed, &format!("{}{more}", d.key))).collect()
}

/// Low and high value of a draw.
fn levels(dispersion: &Dispersion, draw: usize, at: Levels) -> [f64; 2] {
    let draw = &dispersion.draws()[draw];
    match at {
        Levels::Worst => draw.worst.unwrap_or([f64::NAN; 2]),
        Levels::Scores(scores) => scores.map(|z| draw.law.value(&Position::of_score(z))),
    }
}

/// Chosen cases: which draws stand where.
#[derive(Debug, Clone, PartialEq)]
pub enum Design {
    /// Draw and its two values.
    OneAtATime(Vec<(usize, [f64; 2])>),
    /// Draw, its two values, and its generator.
    Corners(Vec<(usize, [f64; 2], u64)>),
    /// From a file.
    Listed(Listed),
}

impl Design {
    /// The draws that are not nominal in `case`, with their values.
    pub fn fixed(&self, case: u64, fixed: &mut Vec<(usize, f64)>) {
        fixed.clear();
        match self {
            Self::OneAtATime(draws) => {
                let (draw, values) = draws[(case / 2) as usize];
                fixed.push((draw, values[(case % 2) as usize]));
            }
            Self::Corners(draws) => fixed.extend(draws.iter().map(|(draw, values, generator)| {
                (*draw, values[((case & generator).count_ones() % 2) as usize])
            })),
            Self::Listed(listed) => {
                let column = |(draw, values): &(usize, Vec<f64>)| (*draw, values[case as usize]);
                fixed.extend(listed.columns.iter().map(column));
            }
        }
    }
}

/// The draws that act on the vehicle: those whose place a design or a file says.
pub fn acting(dispersion: &Dispersion) -> Vec<usize> {
    let all = dispersion.draws().iter().enumerate();
    all.filter(|(_, draw)| draw.role != Role::Common).map(|(index, _)| index).collect()
}

#[cfg(test)]
mod tests;
