//! A plan: the uniform number of every draw in every case, or the cases themselves.
//!
//! What a plan is asked to be is a [`Scheme`]; laws are not known here. Cases of replicates take turns:
//! case c is point c/R of replicate c mod R, so that more cases never move the first ones.
//!
//! # Latin hypercubes
//! A replicate of n points has n equal strata for every draw; point i of a draw lies in stratum π(i), π
//! the keyed permutation of `keyed`, at a place within it that the draw's independent uniform of
//! the case decides. Draws that are correlated keep their strata: points come in blocks of m (all n up
//! to 1024 points, else the greatest divisor of n up to 1024). In each block the ranks of m
//! independent draws from the Gaussian copula say which of m coarse strata a point takes, and a keyed
//! permutation for every coarse stratum which of its n/m fine strata each block takes: every one
//! of the n strata holds one point, and the rank correlation expected is that of m correlated normal pairs,
//! 6/(π(m+1)) (asin ρ + (m−2) asin(ρ/2)), which falls short of the stated one by less than 0.6/m.

use super::draw::{Dispersion, Role};
use super::keyed::{Key, Permutation};
use super::law::Position;
use super::sobol::{self, Directions};
use super::stream::{self, Stream};
use super::table::Class;
use crate::stats::Drawing;
use serde::{Deserialize, Serialize};

/// BLAKE3 context of the strata of Latin hypercubes.
const STRATA: &str = "tvse strata v1";
/// Key of the second sample of a Saltelli plan: no draw key ends so.
const SECOND: &str = " # second sample of saltelli";

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

fn refuse<T>(key: &'static str, found: String, allowed: impl Into<String>) -> Result<T, Refusal> {
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

/// Which draws are drawn once for an inner campaign.
fn outside(scheme: &Scheme, dispersion: &Dispersion) -> Vec<bool> {
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
fn turn(case: u64, replicates: u64) -> (usize, u64) {
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

/// Blocks of points in which correlated ranks are taken.
const LARGEST_BLOCK: u64 = 1024;
const SMALLEST_BLOCK: u64 = 128;

/// Points in a block of a hypercube of `points`.
fn block(points: u64) -> Option<u64> {
    let fits = |block: &u64| points.is_multiple_of(*block);
    if points <= LARGEST_BLOCK {
        Some(points)
    } else {
        (SMALLEST_BLOCK..=LARGEST_BLOCK).rev().find(fits)
    }
}

/// The strata of Latin hypercubes.
#[derive(Debug, Clone, PartialEq)]
pub struct Strata {
    /// Place inside the stratum.
    streams: Vec<Stream>,
    /// Key of each draw, replicate by replicate.
    keys: Vec<Vec<Key>>,
    replicates: u64,
    /// Points of a replicate.
    points: u64,
    /// Points of a block of correlated draws.
    block: u64,
}

impl Strata {
    fn new(dispersion: &Dispersion, seed: u64, replicates: u64, points: u64) -> Self {
        let key = |name: &str| (0..replicates).map(|r| Key::new(STRATA, seed, r, name)).collect();
        Self {
            streams: streams(dispersion, seed, ""),
            keys: dispersion.draws().iter().map(|d| key(&d.key)).collect(),
            replicates,
            points,
            block: block(points).unwrap_or(points),
        }
    }

    fn fill(&self, dispersion: &Dispersion, first_case: u64, uniforms: &mut [f64], window: usize) {
        for (draw, part) in uniforms.chunks_exact_mut(window).enumerate() {
            // First the words that decide the places inside the strata.
            let words = self.streams[draw].words(first_case);
            let grouped = dispersion.groups().iter().any(|g| g.draws.contains(&draw));
            for ((u, word), case) in part.iter_mut().zip(words).zip(first_case..) {
                let (replicate, point) = turn(case, self.replicates);
                // A window may reach beyond the last case.
                if point >= self.points || grouped {
                    continue;
                }
                let permutation = Permutation::new(self.keys[draw][replicate], self.points);
                *u = inside(permutation.at(point), self.points, word);
            }
        }
        for group in dispersion.groups() {
            let mut known: Option<(usize, u64, Vec<Vec<u64>>)> = None;
            let mut slots: Vec<usize> = (0..window).collect();
            // Case after case of one replicate, so that each block is ranked once.
            slots.sort_by_key(|slot| (first_case + *slot as u64) % self.replicates);
            for slot in slots {
                let case = first_case + slot as u64;
                let (replicate, point) = turn(case, self.replicates);
                if point >= self.points {
                    continue;
                }
                let number = point / self.block;
                if !known.as_ref().is_some_and(|(r, n, _)| (*r, *n) == (replicate, number)) {
                    let ranks = self.ranks(group, replicate as u64, number);
                    known = Some((replicate, number, ranks));
                }
                let Some((_, _, ranks)) = &known else { continue };
                let fine = self.points / self.block;
                for (place, &draw) in group.draws.iter().enumerate() {
                    let coarse = ranks[place][(point % self.block) as usize];
                    let key = self.keys[draw][replicate].child(coarse);
                    let stratum = coarse * fine + Permutation::new(key, fine).at(number);
                    let word = self.streams[draw].words(case).next().unwrap_or_default();
                    uniforms[draw * window + slot] = inside(stratum, self.points, word);
                }
            }
        }
    }

    /// Ranks among the points of a block, of each draw of a group: those of independent draws from
    /// the Gaussian copula, of a sample that nothing else uses.
    fn ranks(&self, group: &super::Group, replicate: u64, number: u64) -> Vec<Vec<u64>> {
        let size = self.block as usize;
        let mut independent = vec![0.0; group.draws.len()];
        let mut scores = independent.clone();
        let mut columns = vec![vec![0.0; size]; group.draws.len()];
        for point in 0..size {
            let index = number * self.block + point as u64;
            for (w, &draw) in independent.iter_mut().zip(&group.draws) {
                let word = self.keys[draw][replicate as usize].hash(index);
                *w = Position::of_uniform(stream::open_uniform(word)).score();
            }
            group.correlate(&independent, &mut scores);
            columns.iter_mut().zip(&scores).for_each(|(column, score)| column[point] = *score);
        }
        columns
            .iter()
            .map(|column| {
                let mut order: Vec<usize> = (0..size).collect();
                order.sort_by(|a, b| column[*a].total_cmp(&column[*b]));
                let mut ranks = vec![0; size];
                order.iter().zip(0..).for_each(|(point, rank)| ranks[*point] = rank);
                ranks
            })
            .collect()
    }
}

/// The uniform (2j + 1)/2⁵³ in stratum `stratum` of `count` equal ones that `word` decides: every j
/// whose uniform lies in the stratum is as likely as another.
fn inside(stratum: u64, count: u64, word: u64) -> f64 {
    // Least j with (2j + 1)/2⁵³ ≥ s/count.
    let first = |s: u64| {
        let (s, n) = (u128::from(s) << 53, u128::from(count));
        s.saturating_sub(n).div_ceil(2 * n) as u64
    };
    let (low, high) = (first(stratum), first(stratum + 1));
    let place = (u128::from(word) * u128::from(high - low)) >> 64;
    stream::open_uniform((low + place as u64) << 12)
}

/// The bits of the case index whose parity sets each of `count` factors of a two-level factorial, so
/// that no `resolution` − 1 of them or fewer have an even number of every bit: no effect of r factors is
/// confounded with one of fewer than `resolution` − r. Without a resolution the full factorial.
///
/// Each generator is the least number that is no exclusive or of `resolution` − 2 earlier ones or fewer
/// (a lexicode); for resolutions 3 to 5.
pub fn generators(count: usize, resolution: Option<usize>) -> Vec<u64> {
    let Some(resolution) = resolution else { return (0..count).map(|i| 1 << i).collect() };
    // Exclusive ors of exactly 0, 1, … resolution − 2 generators, and which numbers they cover.
    let mut sums: Vec<Vec<u64>> = vec![Vec::new(); resolution - 1];
    sums[0].push(0);
    let mut covered = vec![true];
    let mut generators = Vec::new();
    let mut next = 1_u64;
    while generators.len() < count {
        if covered.get(next as usize).copied().unwrap_or(false) {
            next += 1;
            continue;
        }
        generators.push(next);
        for terms in (1..sums.len()).rev() {
            let more: Vec<u64> = sums[terms - 1].iter().map(|sum| sum ^ next).collect();
            for &sum in &more {
                if covered.len() <= sum as usize {
                    covered.resize(sum as usize + 1, false);
                }
                covered[sum as usize] = true;
            }
            sums[terms].extend(more);
        }
    }
    generators
}

/// The draws that act on the vehicle: those whose place a design or a file says.
pub fn acting(dispersion: &Dispersion) -> Vec<usize> {
    let all = dispersion.draws().iter().enumerate();
    all.filter(|(_, draw)| draw.role != Role::Common).map(|(index, _)| index).collect()
}

#[cfg(test)]
mod tests;
