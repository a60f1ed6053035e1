//! Latin hypercubes with random access: the uniform of a draw in any case.
//!
//! How many there are and what they are for is said by the plan.
//!
//! A replicate of n points has n equal strata for every draw; point i of a draw lies in stratum π(i), π
//! the keyed permutation of `keyed`, at a place within it that the draw's independent uniform of
//! the case decides. Draws that are correlated keep their strata: points come in blocks of m (all n up
//! to 1024 points, else the greatest divisor of n up to 1024). In each block the ranks of m
//! independent draws from the Gaussian copula say which of m coarse strata a point takes, and a keyed
//! permutation for every coarse stratum which of its n/m fine strata each block takes: every one
//! of the n strata holds one point, and the rank correlation expected is that of m correlated normal pairs,
//! 6/(π(m+1)) (asin ρ + (m−2) asin(ρ/2)), which falls short of the stated one by less than 0.6/m.

use super::correlation::Group;
use super::draw::Dispersion;
use super::keyed::{Key, Permutation};
use super::law::Position;
use super::plan::turn;
use super::stream::{self, Stream};

/// BLAKE3 context of the strata of Latin hypercubes.
const STRATA: &str = "tvse strata v1";
/// Blocks of points in which correlated ranks are taken.
pub(super) const LARGEST_BLOCK: u64 = 1024;
pub(super) const SMALLEST_BLOCK: u64 = 128;

/// Points in a block of a hypercube of `points`.
pub(super) fn block(points: u64) -> Option<u64> {
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
    /// `replicates` hypercubes of `points` points for every draw of `dispersion`.
    pub(super) fn new(dispersion: &Dispersion, seed: u64, replicates: u64, points: u64) -> Self {
        let key = |name: &str| (0..replicates).map(|r| Key::new(STRATA, seed, r, name)).collect();
        Self {
            streams: dispersion.draws().iter().map(|d| Stream::new(seed, &d.key)).collect(),
            keys: dispersion.draws().iter().map(|d| key(&d.key)).collect(),
            replicates,
            points,
            block: block(points).unwrap_or(points),
        }
    }

    /// The uniforms of every draw, as [`super::Plan::fill`] has them.
    pub(super) fn fill(
        &self,
        dispersion: &Dispersion,
        first_case: u64,
        uniforms: &mut [f64],
        window: usize,
    ) {
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
                if known.as_ref().is_none_or(|(r, n, _)| (*r, *n) != (replicate, number)) {
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
    fn ranks(&self, group: &Group, replicate: u64, number: u64) -> Vec<Vec<u64>> {
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
pub(super) fn inside(stratum: u64, count: u64, word: u64) -> f64 {
    // Least j with (2j + 1)/2⁵³ ≥ s/count.
    let first = |s: u64| {
        let (s, n) = (u128::from(s) << 53, u128::from(count));
        s.saturating_sub(n).div_ceil(2 * n) as u64
    };
    let (low, high) = (first(stratum), first(stratum + 1));
    let place = (u128::from(word) * u128::from(high - low)) >> 64;
    stream::open_uniform((low + place as u64) << 12)
}
