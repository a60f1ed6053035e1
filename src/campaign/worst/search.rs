//! A search for the worst cases: vertices, corners of the most influential keys, and descents from many
//! starts, at every flight time, in parallel.

use super::descent::{At, Region, descend};
use super::objective::{Aim, Objective, Quantity, Spot};
use super::{Method, WorstCase};
use crate::campaign::definition::Definition;
use crate::campaign::evaluator::Evaluator;
use crate::campaign::record::Failure;
use crate::dispersion::{Dispersion, Law, Position};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most keys whose corners are enumerated: a million solves.
pub const MOST_CORNER_KEYS: usize = 20;
/// Rounds in which sides of a vertex are changed as the derivatives there say.
const MOST_ROUNDS: usize = 12;
/// Most times a search begins anew where another pole has become the worst.
const MOST_SWITCHES: usize = 4;
/// A descent ends where the linear prediction of what is left to gain is below this damping ratio …
const GAP: f64 = 1e-6;
/// … or this part of the rate of decay, rad/s, of an oscillation at 1 rad/s.
const GAP_RAD_S: f64 = 1e-5;
/// Corners that are kept as starts of descents.
const CORNER_STARTS: usize = 3;

/// Why there is no worst case.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The median vehicle cannot be evaluated.
    #[error("the median vehicle at {time_s} s: {failure}")]
    Median {
        /// Flight time, s.
        time_s: f64,
        /// Why.
        failure: Failure,
    },
    /// Too many keys for an enumeration.
    #[error("{found} keys have too many corners; allowed: up to {MOST_CORNER_KEYS}")]
    TooMany {
        /// Number of keys.
        found: usize,
    },
    /// It was stopped before its end.
    #[error("stopped")]
    Stopped,
}

/// What is searched, and how widely.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// What is made least.
    pub aim: Aim,
    /// Indices of the flight times.
    pub flight_times: Vec<usize>,
    /// Half width of the box of every key, σ; also of the corners.
    pub box_sigma: f64,
    /// Radius of the ellipsoid, σ.
    pub radius_sigma: f64,
    /// Number of the most influential keys whose corners are enumerated; 0 for none.
    pub corner_keys: usize,
    /// Starts beside the median and what vertices and corners find: index of the flight time and
    /// independent scores, for instance of the worst cases of a sample.
    pub starts: Vec<(usize, Vec<Option<f64>>)>,
}

/// What a search took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Evaluations of corners.
    pub corners: u64,
    /// Descents carried out.
    pub descents: usize,
    /// Descents that ended at a stationary point.
    pub converged: usize,
    /// Evaluations of descents, each with derivatives.
    pub evaluations: usize,
}

/// A case found at a flight time.
#[derive(Clone)]
struct Found {
    flight_time: usize,
    z: Vec<f64>,
    value: f64,
    gradient: Vec<f64>,
    pole: nalgebra::Complex<f64>,
    gap: Option<f64>,
    switches: usize,
}

/// What a search has at one flight time.
struct Searcher<'a, 'e> {
    objective: Objective<'a, 'e>,
    /// Which draws are moved: those with a score and a slope.
    free: &'a [bool],
    stop: &'a AtomicBool,
}

/// Searches for the worst cases of `plan`, one for each method, the worst over its flight times.
///
/// Every key has its independent score; those whose law jumps stay nominal. The objective is smooth at one
/// flight time, so that each is searched on its own. Once `stop` is set nothing is begun.
///
/// # Errors
/// See [`Error`].
pub fn search(
    evaluator: &Evaluator<'_>,
    dispersion: &Dispersion,
    definition: &Definition,
    plan: &Plan,
    stop: &AtomicBool,
) -> Result<(Vec<WorstCase>, Work), Error> {
    if plan.corner_keys > MOST_CORNER_KEYS {
        return Err(Error::TooMany { found: plan.corner_keys });
    }
    let smooth = |law: &Law| {
        let median = law.value(&Position::of_score(0.0));
        law.slope(median, 0.0).is_some_and(|slope| slope > 0.0)
    };
    let free: Vec<bool> = dispersion.draws().iter().map(|draw| smooth(&draw.law)).collect();
    let searcher = |flight_time: usize| Searcher {
        objective: Objective { evaluator, dispersion, aim: plan.aim, flight_time },
        free: &free,
        stop,
    };
    let mut work = Work::default();

    // Vertices, of every flight time.
    let medians = plan.flight_times.par_iter().map(|&time| {
        let searcher = searcher(time);
        let zero = vec![0.0; free.len()];
        searcher.objective.fresh(&searcher.scores(&zero)).map_err(|failure| {
            let time_s = definition.flight_times_s[time];
            Error::Median { time_s, failure }
        })
    });
    let medians: Vec<At<Spot>> = medians.collect::<Result<_, _>>()?;
    let at_times = || plan.flight_times.par_iter().zip(&medians);
    let vertices: Vec<Found> = at_times()
        .filter_map(|(&time, median)| searcher(time).vertex(median, Region::Box(plan.box_sigma)))
        .collect();
    searcher(0).stopped()?;

    // Corners, at the flight time with the worst vertex.
    let mut corners = Vec::new();
    if let Some(vertex) = worst(&vertices).filter(|_| plan.corner_keys > 0) {
        let searcher = searcher(vertex.flight_time);
        (corners, work.corners) = searcher.corners(vertex, plan.box_sigma, plan.corner_keys);
        searcher.stopped()?;
    }

    // Descents, of every flight time and from every start.
    let regions = [Region::Box(plan.box_sigma), Region::Ball(plan.radius_sigma)];
    let mut jobs: Vec<(Region, usize, Vec<f64>)> = Vec::new();
    for region in regions {
        for &time in &plan.flight_times {
            let found = vertices.iter().chain(&corners).filter(|found| found.flight_time == time);
            let given = plan.starts.iter().filter(|(at, _)| *at == time);
            let given = given.map(|(_, z)| z.iter().map(|z| z.unwrap_or(0.0)).collect());
            jobs.push((region, time, vec![0.0; free.len()]));
            jobs.extend(found.map(|found| (region, time, found.z.clone())));
            jobs.extend(given.map(|z| (region, time, z)));
        }
    }
    let ends: Vec<(Region, Option<(Found, usize)>)> = jobs
        .into_par_iter()
        .map(|(region, time, start)| (region, searcher(time).descent(region, start)))
        .collect();
    searcher(0).stopped()?;
    let mut by_region: [Vec<Found>; 2] = Default::default();
    for (region, end) in ends {
        let Some((found, evaluations)) = end else { continue };
        work.descents += 1;
        work.evaluations += evaluations;
        work.converged +=
            usize::from(found.gap.is_some_and(|gap| gap <= searcher(0).allowed(&found)));
        by_region[usize::from(region != regions[0])].push(found);
    }
    let mut cases = Vec::new();
    let lists = [
        (Method::Vertex, &vertices),
        (Method::Corners, &corners),
        (Method::Box, &by_region[0]),
        (Method::Ellipsoid, &by_region[1]),
    ];
    for (method, found) in lists {
        let Some(found) = worst(found) else { continue };
        let searcher = searcher(found.flight_time);
        let scores = searcher.scores(&found.z);
        cases.push(WorstCase {
            name: method.name().to_owned(),
            method,
            flight_time: found.flight_time,
            values: dispersion.values_at(&scores),
            scores,
            by_score: found.gradient.clone(),
            objective: found.value,
            pole: [found.pole.re, found.pole.im],
            gap: found.gap,
            switches: found.switches,
        });
    }
    Ok((cases, work))
}

fn worst(all: &[Found]) -> Option<&Found> {
    all.iter().min_by(|a, b| a.value.total_cmp(&b.value))
}

impl Searcher<'_, '_> {
    fn stopped(&self) -> Result<(), Error> {
        if self.stop.load(Ordering::Relaxed) { Err(Error::Stopped) } else { Ok(()) }
    }

    /// Scores of all draws; those that do not move have none.
    fn scores(&self, z: &[f64]) -> Vec<Option<f64>> {
        z.iter().zip(self.free).map(|(z, free)| free.then_some(*z)).collect()
    }

    fn allowed(&self, found: &Found) -> f64 {
        match self.objective.aim.quantity {
            Quantity::DampingRatio => GAP,
            Quantity::Decay => GAP_RAD_S * found.pole.norm(),
        }
    }

    fn at(&self, z: &[f64]) -> Option<At<Spot>> {
        if self.stop.load(Ordering::Relaxed) {
            return None;
        }
        self.objective.fresh(&self.scores(z)).ok()
    }

    fn found(&self, z: Vec<f64>, at: &At<Spot>) -> Found {
        let (flight_time, pole) = (self.objective.flight_time, at.point.pole);
        let gradient = self.masked(&at.gradient);
        Found { flight_time, z, value: at.value, gradient, pole, gap: None, switches: 0 }
    }

    /// Every key at the side that its derivative calls adverse, first that at the median, then those at the
    /// vertex itself, as long as that makes it worse.
    fn vertex(&self, median: &At<Spot>, region: Region) -> Option<Found> {
        let mut z = region.worst(&self.masked(&median.gradient));
        let mut at = self.at(&z)?;
        for _ in 0..MOST_ROUNDS {
            let wrong = |i: usize| z[i] * at.gradient[i] > 0.0;
            let turned: Vec<f64> =
                (0..z.len()).map(|i| if wrong(i) { -z[i] } else { z[i] }).collect();
            if turned == z {
                break;
            }
            let Some(next) = self.at(&turned).filter(|next| next.value < at.value) else { break };
            (z, at) = (turned, next);
        }
        Some(self.found(z, &at))
    }

    fn masked(&self, gradient: &[f64]) -> Vec<f64> {
        gradient.iter().zip(self.free).map(|(g, free)| if *free { *g } else { 0.0 }).collect()
    }

    /// All corners of the `count` keys with the greatest derivatives at `vertex`, the others there: the
    /// worst ones and the number evaluated.
    fn corners(&self, vertex: &Found, sigma: f64, count: usize) -> (Vec<Found>, u64) {
        let Some(at) = self.at(&vertex.z) else { return (Vec::new(), 0) };
        let gradient = self.masked(&at.gradient);
        let mut order: Vec<usize> = (0..gradient.len()).filter(|i| gradient[*i] != 0.0).collect();
        order.sort_by(|a, b| gradient[*b].abs().total_cmp(&gradient[*a].abs()));
        order.truncate(count);
        let corner = |code: u64| {
            let mut z = vertex.z.clone();
            for (bit, &key) in order.iter().enumerate() {
                z[key] = if code >> bit & 1 == 1 { sigma } else { -sigma };
            }
            z
        };
        let total = 1_u64 << order.len();
        let mut values: Vec<(f64, u64)> = (0..total)
            .into_par_iter()
            .filter_map(|code| {
                if self.stop.load(Ordering::Relaxed) {
                    return None;
                }
                Some((self.objective.value(&self.scores(&corner(code))).ok()?, code))
            })
            .collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let worst = values.iter().take(CORNER_STARTS).filter_map(|(_, code)| {
            let z = corner(*code);
            let at = self.at(&z)?;
            Some(self.found(z, &at))
        });
        (worst.collect(), total)
    }

    /// A descent from `start`, and its evaluations. Where it ends, the rule of the campaign is asked again;
    /// if another pole is worse there, the search begins anew with that.
    fn descent(&self, region: Region, start: Vec<f64>) -> Option<(Found, usize)> {
        let mut z = self.masked(&start);
        region.project(&mut z);
        let mut at = self.at(&z)?;
        let mut evaluations = 0;
        let mut switches = 0;
        loop {
            let mut masked = at.clone();
            masked.gradient = self.masked(&at.gradient);
            let found = self.found(z.clone(), &at);
            let end = descend(region, z, masked, self.allowed(&found), |z, from| {
                if self.stop.load(Ordering::Relaxed) {
                    return None;
                }
                let mut at = self.objective.followed(&self.scores(z), &from.point)?;
                at.gradient = self.masked(&at.gradient);
                Some(at)
            });
            evaluations += end.evaluations;
            let now = self.at(&end.z)?;
            let other = now.point.pole != end.at.point.pole && now.value < end.at.value;
            if other && switches < MOST_SWITCHES {
                switches += 1;
                (z, at) = (end.z, now);
                continue;
            }
            let mut found = self.found(end.z, &now);
            (found.gap, found.switches) = (Some(end.gap), switches);
            return Some((found, evaluations));
        }
    }
}
