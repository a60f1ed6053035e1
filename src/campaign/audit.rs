//! The audit: cases solved by both solvers, which must agree within their bounds.
//!
//! Which cases follows from the seed, so that an audit can be repeated; what follows from it is decided in `cli`.

use super::definition::Solver;
use super::evaluator::{Error, Evaluator};
use super::record::Certificate;
use super::{Definition, Pole, Span};
use crate::dispersion::Sampler;
use crate::vehicle::Vehicle;
use nalgebra::Complex;

/// What an audit found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Audit {
    /// Cases solved both ways.
    pub cases: usize,
    /// Evaluations of these that one solver certified by discs and the other solved too.
    pub evaluations: usize,
    /// Evaluations without certificate, which the dense solver answered both ways.
    pub fallbacks: usize,
    /// Poles compared.
    pub poles: usize,
    /// Largest distance of two poles over their modulus.
    pub largest: f64,
    /// Largest bound of a structured pole over its modulus.
    pub largest_bound: f64,
    /// What disagrees.
    pub disagreements: Vec<String>,
}

/// `count` cases of `spans`, one of each of as many parts of about the same size, by the seed.
pub fn choose(spans: &[Span], count: u64, seed: u64) -> Vec<(usize, u64)> {
    let total: u64 = spans.iter().map(|span| span.cases.end - span.cases.start).sum();
    let count = count.min(total);
    let bound =
        |part: u64| (u128::from(part) * u128::from(total) / u128::from(count.max(1))) as u64;
    let place = |part: u64| {
        let mut hasher = blake3::Hasher::new_derive_key("tvse audit v1");
        hasher.update(&seed.to_le_bytes());
        hasher.update(&part.to_le_bytes());
        let mut word = [0; 8];
        hasher.finalize_xof().fill(&mut word);
        let (from, to) = (bound(part), bound(part + 1));
        from + u64::from_le_bytes(word) % (to - from)
    };
    let find = |mut place: u64| {
        for span in spans {
            let cases = span.cases.end - span.cases.start;
            if place < cases {
                return (span.population, span.cases.start + place);
            }
            place -= cases;
        }
        unreachable!("a place is below the number of cases")
    };
    (0..count).map(|part| find(place(part))).collect()
}

/// Solves `cases` both ways and compares every pole.
///
/// # Errors
/// The nominal vehicle cannot be prepared.
pub fn audit(
    vehicle: &Vehicle,
    sampler: &Sampler<'_>,
    definition: &Definition,
    cases: &[(usize, u64)],
) -> Result<Audit, Error> {
    let with =
        |solver| Definition { solver, sensitivity: None, margins: None, ..definition.clone() };
    let definitions = [with(Solver::Structured), with(Solver::Dense)];
    let [structured, dense] =
        definitions.each_ref().map(|definition| Evaluator::new(vehicle, sampler, definition, true));
    let (structured, dense) = (structured?, dense?);
    // What a run does that stores no other poles: of a model with a full part it finds only some.
    let near = Evaluator::new(vehicle, sampler, &definitions[0], false)?;
    let mut audit = Audit { cases: cases.len(), ..Audit::default() };
    for &(population, case) in cases {
        let records =
            [&structured, &dense, &near].map(|evaluator| evaluator.evaluate(population, case));
        let [ours, theirs, near] = records.map(|record| record.evaluations);
        for ((ours, theirs), near) in ours.iter().zip(&theirs).zip(&near) {
            let place = || {
                let variant = &definition.variants[ours.variant].name;
                let time = definition.flight_times_s[ours.flight_time];
                let population = &definition.populations[population].name;
                format!("case {case} of {population}, {variant}, {time} s")
            };
            match (&ours.outcome, &theirs.outcome) {
                (Ok(poles), Ok(others)) => {
                    let solver = ours.solution.map(|solution| solution.solver);
                    if solver == Some(Solver::Structured) {
                        audit.evaluations += 1;
                        audit.compare(poles, others, place);
                        if near.solution.map(|s| s.certificate) == Some(Certificate::Near) {
                            let named = |poles: &[Pole]| -> Vec<Pole> {
                                poles.iter().filter(|p| p.mode.is_some()).cloned().collect()
                            };
                            let near = near.outcome.as_deref().unwrap_or_default();
                            audit.compare(near, &named(others), place);
                        }
                    } else {
                        audit.fallbacks += 1;
                    }
                }
                (Err(_), Err(_)) => {}
                (Ok(_), Err(failure)) | (Err(failure), Ok(_)) => {
                    audit.disagreements.push(format!("{}: only one: {failure}", place()));
                }
            }
        }
    }
    Ok(audit)
}

impl Audit {
    /// Every pole has one of the others within the sum of their bounds, and no other has it as well.
    fn compare(&mut self, poles: &[Pole], others: &[Pole], place: impl Fn() -> String) {
        if poles.len() != others.len() {
            let found = format!("{} and {} poles", poles.len(), others.len());
            self.disagreements.push(format!("{}: {found}", place()));
        }
        let mut left: Vec<(Complex<f64>, f64)> =
            others.iter().map(|pole| (pole.value, pole.error_bound.unwrap_or(0.0))).collect();
        // A dense pole is off by a modest multiple of n ε times the greatest at the best; that of a repeated pole
        // has no bound by its own vectors.
        let greatest = others.iter().map(|pole| pole.value.norm()).fold(0.0, f64::max);
        let floor = 20.0 * others.len() as f64 * f64::EPSILON * greatest;
        for pole in poles {
            let distance = |other: &(Complex<f64>, f64)| (other.0 - pole.value).norm();
            let nearest =
                (0..left.len()).min_by(|a, b| distance(&left[*a]).total_cmp(&distance(&left[*b])));
            let Some(nearest) = nearest else { break };
            let other = left.swap_remove(nearest);
            let (bound, size) = (pole.error_bound.unwrap_or(0.0), pole.value.norm());
            self.poles += 1;
            self.largest = self.largest.max(distance(&other) / size);
            self.largest_bound = self.largest_bound.max(bound / size);
            // The bound of a dense pole holds to first order only: twice as much is allowed.
            let allowed = bound + 2.0 * other.1 + floor;
            if !(distance(&other) <= allowed) {
                let (a, b, off) = (pole.value, other.0, distance(&other));
                let found = format!("{a} and {b} are {off:.2e} apart, allowed {allowed:.2e} rad/s");
                self.disagreements.push(format!("{}: {found}", place()));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_of_an_audit_are_different_ones_of_the_run_and_follow_from_the_seed() {
        let span = |population, cases| Span { population, cases };
        let spans = [span(0, 0..1), span(1, 5..105), span(3, 0..7)];
        let chosen = choose(&spans, 20, 7);
        assert_eq!(chosen, choose(&spans, 20, 7));
        assert_ne!(chosen, choose(&spans, 20, 8));
        assert!(chosen.is_sorted() && chosen.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(chosen.iter().all(|(population, case)| {
            spans.iter().any(|s| s.population == *population && s.cases.contains(case))
        }));
        assert_eq!(choose(&spans, 1000, 7).len(), 108);
        assert_eq!(choose(&[], 5, 7), []);
    }
}
