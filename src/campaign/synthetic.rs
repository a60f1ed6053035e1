//! A synthetic evaluator for tests: records of every kind, a pure function of population and case.
//!
//! No physics: the numbers only have to be unlike each other and to include failures, unstable
//! poles and pairs of poles that exchange character.

use super::definition::{Definition, Feedback, NozzleJet, Population, Slope, Solver, Variant};
use super::outline::{DrawColumn, Input, Outline, StoredPoles};
use super::record::{
    Branch, Certificate, Evaluation, Failure, FailureKind, Pole, Record, Solution,
};
use crate::dispersion::Scheme;
use nalgebra::Complex;

/// A definition with two variants, two flight times, two modes and the given numbers of cases.
pub fn definition(cases: &[u64]) -> Definition {
    let variant = |name: &str, jet: bool| Variant {
        name: name.to_owned(),
        thrust: true,
        case_jet_damping: jet,
        nozzle_jet_damping: if jet { NozzleJet::Linear } else { NozzleJet::Off },
        follower_thrust: false,
        slope: Slope::VirtualGrid,
        rigid_body: false,
        slosh: false,
        aerodynamics: false,
        feedback: Feedback::Open,
        actuators: None,
    };
    let names = ["nominal", "dispersed", "corner_dispersed"];
    let population = |(index, &cases): (usize, &u64)| Population {
        name: names[index % names.len()].to_owned(),
        cases,
        fixed: if index == 2 { vec![(1, 0.0025)] } else { Vec::new() },
        drawn: index > 0,
        scheme: Scheme::MonteCarlo,
    };
    Definition {
        name: "synthetic".to_owned(),
        seed: 7,
        populations: cases.iter().enumerate().map(population).collect(),
        flight_times_s: vec![0.1 + 0.2, 110.0],
        variants: vec![variant("no_jet", false), variant("jet", true)],
        modes: vec!["tvse".to_owned(), "bending".to_owned()],
        gimballed: vec![true, true],
        exchange_ratio: 0.5,
        solver: Solver::Structured,
        sensitivity: None,
        margins: None,
    }
}

/// The outline of a synthetic run.
pub fn outline(cases: &[u64], poles: StoredPoles) -> Outline {
    let draw = |key: &str, column: &str, unit: &str, range: Option<[f64; 2]>| DrawColumn {
        key: key.to_owned(),
        column: column.to_owned(),
        unit: unit.to_owned(),
        description: format!("Draw of {key}"),
        beyond: if range.is_some() { vec![0.0025] } else { Vec::new() },
        range,
    };
    let draws = vec![
        draw("booster.left.thrust @ engine", "draw_booster_left_thrust", "1", None),
        draw("structure.damping @ mode", "draw_structure_damping", "1", Some([0.0035, 0.0075])),
    ];
    let inputs = vec![Input { name: "dispersion".to_owned(), blake3: "00".repeat(32) }];
    Outline::new(definition(cases), poles, draws, inputs)
}

/// The record of a case, named poles only.
pub fn record(definition: &Definition, population: usize, case: u64) -> Record {
    evaluate(definition, population, case, StoredPoles::Named)
}

/// The record of a case.
pub fn evaluate(
    definition: &Definition,
    population: usize,
    case: u64,
    stored: StoredPoles,
) -> Record {
    let mut random = Sequence(case.wrapping_mul(8).wrapping_add(population as u64) + 1);
    let fixed = |key: usize| {
        let fixed = &definition.populations[population].fixed;
        fixed.iter().find(|(index, _)| *index == key).map(|(_, value)| *value)
    };
    let score = 6.0 * random.next() - 3.0;
    let damping = fixed(1).unwrap_or(0.0035 + 0.004 * random.next());
    let mut evaluations = Vec::new();
    for flight_time in 0..definition.flight_times_s.len() {
        for variant in 0..definition.variants.len() {
            let outcome = match case % 23 {
                11 => Err(Failure::new(FailureKind::Draw, "booster.left.nozzle.inertia is -1")),
                17 if flight_time == 1 && variant == 0 => {
                    Err(Failure::new(FailureKind::NoConvergence, "after 90 iterations"))
                }
                _ => Ok(poles(definition, variant, case, stored, &mut random)),
            };
            evaluations.push(Evaluation {
                variant,
                flight_time,
                null_poles: 0,
                solution: outcome.is_ok().then_some(Solution {
                    solver: Solver::Structured,
                    certificate: Certificate::Discs,
                    determinants: 32,
                }),
                outcome,
                loops: None,
            });
        }
    }
    Record {
        population,
        case,
        values: vec![Some(1.0 + 0.01 * score), Some(damping)],
        // A value beyond its law has no score.
        scores: vec![Some(score), fixed(1).is_none().then_some(0.5 * score)],
        evaluations,
    }
}

fn poles(
    definition: &Definition,
    variant: usize,
    case: u64,
    stored: StoredPoles,
    random: &mut Sequence,
) -> Vec<Pole> {
    let mut poles = Vec::new();
    let mut push = |mode: Option<usize>, branch: Branch, random: &mut Sequence| {
        poles.push(Pole {
            mode,
            branch,
            label: mode.map(|m| format!("m{:02}", m + 7)),
            value: Complex::new(
                0.2 * random.next() - 0.15 - 0.05 * variant as f64,
                30.0 + random.next(),
            ),
            identity_confidence: mode.map(|_| random.next()),
            participation: Some(std::array::from_fn(|_| random.next())),
            residual: mode.map(|_| 1e-15 * random.next()),
            error_bound: Some(1e-12),
            sensitivity: None,
        });
    };
    for mode in 0..definition.modes.len() {
        push(Some(mode), Branch::Primary, random);
        if case % 5 == 2 && mode == 0 {
            push(Some(mode), Branch::Partner, random);
        }
    }
    if stored == StoredPoles::All {
        for _ in 0..3 {
            push(None, Branch::Other, random);
        }
    }
    poles
}

/// Numbers in [0, 1) that look random (SplitMix64, Steele, Lea and Flood 2014).
struct Sequence(u64);

impl Sequence {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * f64::EPSILON / 2.0
    }
}
