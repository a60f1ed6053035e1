//! A campaign of the planar pair: its parameters scattered evenly between two values each.
//!
//! The draws are those of any campaign: a function of seed, draw key and case. The only named mode
//! is the least damped pole of the pair.

use super::definition::{Definition, Population, Slope, Variant};
use super::outline::{DrawColumn, Input, Outline, StoredPoles};
use super::record::{Branch, Evaluation, Failure, FailureKind, Pole, Record, damping_ratio};
use crate::dispersion::stream::Stream;
use crate::dispersion::{Law, Position, Scheme};
use crate::dynamics::planar::{Parameters, Planar};
use crate::dynamics::servo::Feedback;

/// A parameter that may be scattered: name, unit and where it stands.
type Line = (&'static str, &'static str, fn(&mut Parameters) -> &mut f64);

const LINES: [Line; 11] = [
    ("inertia", "kg m^2", |p| &mut p.inertia_kg_m2),
    ("zeta_n", "1", |p| &mut p.actuator_damping_ratio),
    ("omega_n", "rad/s", |p| &mut p.actuator_omega_rad_s),
    ("zeta_b", "1", |p| &mut p.mode_damping_ratio),
    ("omega_b", "rad/s", |p| &mut p.mode_omega_rad_s),
    ("upsilon", "kg^0.5 m", |p| &mut p.coupling),
    ("phi", "kg^-0.5", |p| &mut p.shape),
    ("psi", "rad/(m kg^0.5)", |p| &mut p.slope),
    ("thrust", "N", |p| &mut p.thrust_n),
    ("mass_flow", "kg/s", |p| &mut p.mass_flow_kg_s),
    ("nozzle_length", "m", |p| &mut p.nozzle_length_m),
];

/// Names of the parameters that may be scattered.
pub fn names() -> impl Iterator<Item = &'static str> {
    LINES.iter().map(|(name, _, _)| *name)
}

/// A parameter scattered evenly between two values.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    line: usize,
    law: Law,
}

impl Scatter {
    /// The parameter called `name` between `low` and `high`.
    ///
    /// # Errors
    /// In words: no such parameter, or no interval.
    pub fn new(name: &str, low: f64, high: f64) -> Result<Self, String> {
        let Some(line) = names().position(|known| known == name) else {
            let known: Vec<&str> = names().collect();
            return Err(format!("found {name:?}; allowed: {}", known.join(", ")));
        };
        let law = Law::uniform(low, high).map_err(|refusal| format!("{name}: {refusal}"))?;
        Ok(Self { line, law })
    }

    /// Name of the parameter.
    pub fn name(&self) -> &'static str {
        LINES[self.line].0
    }

    fn column(&self) -> DrawColumn {
        let (name, unit, _) = LINES[self.line];
        DrawColumn {
            key: key(name),
            column: format!("draw_{name}"),
            unit: unit.to_owned(),
            description: format!("{name} of the planar pair, even between its ends"),
            range: self.law.range(),
            beyond: Vec::new(),
        }
    }
}

fn key(name: &str) -> String {
    format!("planar.{name} @ vehicle")
}

/// Evaluates the cases of a campaign of the planar pair.
#[derive(Debug, Clone)]
pub struct PlanarCampaign {
    nominal: Parameters,
    draws: Vec<(Scatter, Stream)>,
}

impl PlanarCampaign {
    /// A campaign around the `nominal` pair under a seed.
    pub fn new(nominal: Parameters, scatters: &[Scatter], seed: u64) -> Self {
        let stream = |scatter: &Scatter| Stream::new(seed, &key(scatter.name()));
        let draws = scatters.iter().map(|scatter| (scatter.clone(), stream(scatter))).collect();
        Self { nominal, draws }
    }

    /// The outline of a run with so many cases, besides the nominal one.
    pub fn outline(&self, seed: u64, cases: u64, inputs: Vec<Input>) -> Outline {
        let population = |name: &str, cases, drawn| Population {
            name: name.to_owned(),
            cases,
            fixed: Vec::new(),
            drawn,
            scheme: Scheme::MonteCarlo,
        };
        let variant = Variant {
            name: "planar".to_owned(),
            thrust: true,
            case_jet_damping: false,
            nozzle_jet_damping: self.nominal.nozzle_jet,
            follower_thrust: false,
            slope: Slope::SingleGrid,
            rigid_body: false,
            slosh: false,
            aerodynamics: false,
            feedback: Feedback::Open,
            actuators: None,
        };
        let definition = Definition {
            name: "planar".to_owned(),
            seed,
            populations: vec![
                population("nominal", 1, false),
                population("dispersed", cases, true),
            ],
            flight_times_s: vec![0.0],
            variants: vec![variant],
            modes: vec!["least_damped".to_owned()],
            gimballed: vec![true],
            exchange_ratio: 0.5,
            solver: super::definition::Solver::Dense,
            sensitivity: None,
            margins: None,
        };
        let draws = self.draws.iter().map(|(scatter, _)| scatter.column()).collect();
        Outline::new(definition, StoredPoles::Named, draws, inputs)
    }

    /// The record of one case; a function of the population and the index alone.
    pub fn evaluate(&self, population: usize, case: u64) -> Record {
        let mut parameters = self.nominal;
        let (mut values, mut scores) = (Vec::new(), Vec::new());
        for (scatter, stream) in &self.draws {
            let position = (population > 0).then(|| Position::of_uniform(stream.uniform(case)));
            let value = position.as_ref().map(|position| scatter.law.value(position));
            if let Some(value) = value {
                *LINES[scatter.line].2(&mut parameters) = value;
            }
            values.push(value);
            scores.push(position.map(|position| position.score()));
        }
        let outcome = least_damped(parameters).map(|pole| vec![pole]);
        let evaluation = Evaluation {
            variant: 0,
            flight_time: 0,
            null_poles: 0,
            solution: None,
            outcome,
            loops: None,
        };
        Record { population, case, values, scores, evaluations: vec![evaluation] }
    }
}

fn least_damped(parameters: Parameters) -> Result<Pole, Failure> {
    let refused = |refusal: crate::dynamics::planar::Refusal| {
        Failure::new(FailureKind::Draw, refusal.to_string())
    };
    let planar = Planar::new(parameters).map_err(refused)?;
    let poles = planar.poles().ok_or_else(|| {
        Failure::new(FailureKind::NoConvergence, "the poles of the quartic were not found")
    })?;
    let above = poles.into_iter().filter(|pole| pole.im >= 0.0);
    let least = above.min_by(|a, b| damping_ratio(*a).total_cmp(&damping_ratio(*b)));
    Ok(Pole {
        mode: Some(0),
        branch: Branch::Primary,
        label: None,
        value: least.expect("complex poles come in pairs"),
        identity_confidence: None,
        participation: None,
        residual: None,
        error_bound: None,
        sensitivity: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::NozzleJet;
    use crate::dynamics::planar::Verdict;

    fn pair() -> Parameters {
        Parameters {
            inertia_kg_m2: 1.0,
            actuator_damping_ratio: 0.3,
            actuator_omega_rad_s: 1.2,
            mode_damping_ratio: 0.005,
            mode_omega_rad_s: 1.0,
            coupling: 0.2,
            shape: 1.0,
            slope: 0.0,
            thrust_n: 0.2,
            nozzle_jet: NozzleJet::Off,
            mass_flow_kg_s: 0.0,
            nozzle_length_m: 0.0,
        }
    }

    #[test]
    fn a_case_is_unstable_exactly_where_the_routh_array_says_so() {
        let scatters = [Scatter::new("thrust", 0.0, 1.0).unwrap()];
        let campaign = PlanarCampaign::new(pair(), &scatters, 7);
        let mut unstable = 0;
        for case in 0..500 {
            let record = campaign.evaluate(1, case);
            let thrust_n = record.values[0].unwrap();
            assert!((0.0..1.0).contains(&thrust_n));
            let planar = Planar::new(Parameters { thrust_n, ..pair() }).unwrap();
            assert_eq!(record.unstable(), planar.verdict() != Verdict::Stable, "{thrust_n}");
            unstable += u32::from(record.unstable());
        }
        assert!((1..500).contains(&unstable));
    }

    #[test]
    fn the_nominal_case_is_the_pair_itself_and_an_impossible_draw_is_a_failure() {
        let scatters = [Scatter::new("upsilon", 0.5, 1.5).unwrap()];
        let campaign = PlanarCampaign::new(pair(), &scatters, 1);
        let nominal = campaign.evaluate(0, 0);
        assert_eq!(nominal.values, [None]);
        let poles = Planar::new(pair()).unwrap().poles().unwrap();
        let value = nominal.evaluations[0].outcome.as_ref().unwrap()[0].value;
        assert!(poles.contains(&value));
        let failed = (0..100).filter(|case| campaign.evaluate(1, *case).failure().is_some());
        // Where Υ ≥ √J: about half of them.
        assert!((30..70).contains(&failed.count()));
        assert!(Scatter::new("mass", 0.0, 1.0).unwrap_err().contains("thrust"));
        assert!(Scatter::new("thrust", 1.0, 0.0).is_err());
    }
}
