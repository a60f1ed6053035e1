//! The registry of scalar metrics: each reduces a case to one number per variant and named mode.
//!
//! A metric is one line of `QUANTITIES`; its column, unit and description derive from it. How
//! cases are summed up is decided in `summary`.

use super::definition::Definition;
use super::record::{Branch, Evaluation, Pole, Record};
use std::collections::BTreeSet;

/// Longest column name that every reader of the tables accepts.
pub const LONGEST_NAME: usize = 63;

/// What a metric measures; the index of its line in the registry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Smallest damping ratio over the flight times, −.
    DampingRatioMin,
    /// Flight time of the smallest damping ratio, s.
    FlightTimeOfMin,
    /// Frequency at the smallest damping ratio, Hz.
    FrequencyOfMin,
    /// Shortest time to double over the flight times, s; none if stable.
    TimeToDoubleMin,
    /// Largest real part over the flight times, rad/s.
    PoleRealMax,
    /// Number of flight times at which the mode is unstable.
    UnstableTimes,
    /// Smallest paired gain of damping ratio over the first variant, −; none for that variant.
    DampingRatioGainMin,
}

/// One line of the registry.
struct Line {
    quantity: Quantity,
    stem: &'static str,
    suffix: &'static str,
    unit: &'static str,
    description: &'static str,
    value: fn(&Reduced) -> Option<f64>,
}

const QUANTITIES: [Line; 7] = [
    Line {
        quantity: Quantity::DampingRatioMin,
        stem: "damping_ratio_min",
        suffix: "",
        unit: "1",
        description: "Smallest damping ratio over the flight times",
        value: |r| Some(r.damping_ratio),
    },
    Line {
        quantity: Quantity::FlightTimeOfMin,
        stem: "flight_time_of_min",
        suffix: "_s",
        unit: "s",
        description: "Flight time of the smallest damping ratio",
        value: |r| Some(r.flight_time_s),
    },
    Line {
        quantity: Quantity::FrequencyOfMin,
        stem: "frequency_of_min",
        suffix: "_hz",
        unit: "Hz",
        description: "Frequency at the smallest damping ratio",
        value: |r| Some(r.frequency_hz),
    },
    Line {
        quantity: Quantity::TimeToDoubleMin,
        stem: "time_to_double_min",
        suffix: "_s",
        unit: "s",
        description: "Shortest time to double over the flight times, NULL if stable at all of them",
        value: |r| r.time_to_double_s,
    },
    Line {
        quantity: Quantity::PoleRealMax,
        stem: "pole_re_max",
        suffix: "_rad_s",
        unit: "rad/s",
        description: "Largest real part of the pole over the flight times",
        value: |r| Some(r.pole_re_rad_s),
    },
    Line {
        quantity: Quantity::UnstableTimes,
        stem: "unstable_times",
        suffix: "",
        unit: "1",
        description: "Number of flight times at which the mode is unstable",
        value: |r| Some(f64::from(r.unstable_times)),
    },
    Line {
        quantity: Quantity::DampingRatioGainMin,
        stem: "damping_ratio_gain_min",
        suffix: "",
        unit: "1",
        description: "Smallest gain of damping ratio over the first variant, same draws and flight time",
        value: |r| r.damping_ratio_gain,
    },
];

/// A metric of one variant and named mode.
#[derive(Debug, Clone)]
pub struct Metric {
    /// What it measures.
    pub quantity: Quantity,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the named mode.
    pub mode: usize,
    /// Column name in the `cases` table.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Description.
    pub description: String,
    value: fn(&Reduced) -> Option<f64>,
    slot: usize,
}

impl Metric {
    /// Whether the metric counts, so that its column holds whole numbers.
    pub fn counts(&self) -> bool {
        self.quantity == Quantity::UnstableTimes
    }

    /// The value in a reduced case; none where an evaluation of the variant failed.
    pub fn value(&self, case: &ReducedCase) -> Option<f64> {
        case.0.get(self.slot)?.as_ref().and_then(self.value)
    }
}

/// Every metric of a run, by variant, mode and quantity; the gain only from the second variant on.
pub fn metrics(definition: &Definition) -> Vec<Metric> {
    let named = build(definition, &|line, variant, mode| {
        let (variant, mode) = (&definition.variants[variant].name, &definition.modes[mode]);
        format!("{}_{}_{}{}", line.stem, word(variant), word(mode), line.suffix)
    });
    let names: BTreeSet<&str> = named.iter().map(|m| m.name.as_str()).collect();
    if names.len() == named.len() && names.iter().all(|name| name.len() <= LONGEST_NAME) {
        return named;
    }
    build(definition, &|line, variant, mode| {
        format!("{}_variant_{variant}_mode_{mode}{}", line.stem, line.suffix)
    })
}

/// The metric of a quantity, variant and mode.
pub fn find(
    metrics: &[Metric],
    quantity: Quantity,
    variant: usize,
    mode: usize,
) -> Option<&Metric> {
    metrics.iter().find(|m| m.quantity == quantity && m.variant == variant && m.mode == mode)
}

fn build(definition: &Definition, name: &dyn Fn(&Line, usize, usize) -> String) -> Vec<Metric> {
    let modes = definition.modes.len();
    let mut metrics = Vec::new();
    for (variant, v) in definition.variants.iter().enumerate() {
        for (mode, m) in definition.modes.iter().enumerate() {
            for line in &QUANTITIES {
                if variant == 0 && line.quantity == Quantity::DampingRatioGainMin {
                    continue;
                }
                metrics.push(Metric {
                    quantity: line.quantity,
                    variant,
                    mode,
                    name: name(line, variant, mode),
                    unit: line.unit,
                    description: format!(
                        "{}; variant {}, mode {}, the less stable pole where two are stored",
                        line.description, v.name, m
                    ),
                    value: line.value,
                    slot: variant * modes + mode,
                });
            }
        }
    }
    metrics
}

/// A name as part of a column name, `[a-z0-9_]`.
pub(super) fn word(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    name.chars().map(plain).collect()
}

/// A case reduced over its flight times, by variant and named mode; `None` where one of the
/// evaluations failed, so that the worst is unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedCase(Vec<Option<Reduced>>);

#[derive(Debug, Clone, PartialEq)]
struct Reduced {
    damping_ratio: f64,
    flight_time_s: f64,
    frequency_hz: f64,
    time_to_double_s: Option<f64>,
    pole_re_rad_s: f64,
    unstable_times: u32,
    damping_ratio_gain: Option<f64>,
}

impl ReducedCase {
    /// Reduces a record over the flight times.
    pub fn new(definition: &Definition, record: &Record) -> Self {
        let (variants, modes) = (definition.variants.len(), definition.modes.len());
        let slots = (0..variants).flat_map(|v| (0..modes).map(move |m| (v, m)));
        Self(slots.map(|(variant, mode)| reduce(definition, record, variant, mode)).collect())
    }
}

fn reduce(
    definition: &Definition,
    record: &Record,
    variant: usize,
    mode: usize,
) -> Option<Reduced> {
    let mut reduced: Option<Reduced> = None;
    let mut flight_times = 0;
    let mut gain = Some(f64::INFINITY);
    for evaluation in record.evaluations.iter().filter(|e| e.variant == variant) {
        let least = least_stable(evaluation, mode)?;
        let damping_ratio = least.damping_ratio();
        let re = of_mode(evaluation, mode).map(|p| p.value.re).fold(f64::NEG_INFINITY, f64::max);
        let first = record
            .evaluations
            .iter()
            .find(|e| e.variant == 0 && e.flight_time == evaluation.flight_time)
            .and_then(|e| least_stable(e, mode));
        gain = gain.zip(first).map(|(gain, first)| gain.min(damping_ratio - first.damping_ratio()));
        let here = Reduced {
            damping_ratio,
            flight_time_s: definition.flight_times_s[evaluation.flight_time],
            frequency_hz: least.frequency_hz(),
            time_to_double_s: None,
            pole_re_rad_s: re,
            unstable_times: u32::from(re > 0.0),
            damping_ratio_gain: None,
        };
        flight_times += 1;
        reduced = Some(match reduced {
            None => here,
            Some(so_far) => {
                let pole_re_rad_s = so_far.pole_re_rad_s.max(re);
                let unstable_times = so_far.unstable_times + here.unstable_times;
                let worst = if damping_ratio < so_far.damping_ratio { here } else { so_far };
                Reduced { pole_re_rad_s, unstable_times, ..worst }
            }
        });
    }
    let reduced = reduced.filter(|_| flight_times == definition.flight_times_s.len())?;
    // ln 2/Re s falls with Re s: the shortest time to double is that of the largest real part.
    let time_to_double_s =
        (reduced.pole_re_rad_s > 0.0).then(|| std::f64::consts::LN_2 / reduced.pole_re_rad_s);
    Some(Reduced { time_to_double_s, damping_ratio_gain: gain.filter(|_| variant > 0), ..reduced })
}

/// Every pole stored for a named mode.
fn of_mode(evaluation: &Evaluation, mode: usize) -> impl Iterator<Item = &Pole> + Clone {
    let poles = evaluation.outcome.iter().flatten();
    poles.filter(move |pole| pole.mode == Some(mode))
}

/// The pole of a named mode with the smallest damping ratio; none if the evaluation failed, gave
/// no primary pole or a pole without a damping ratio.
fn least_stable(evaluation: &Evaluation, mode: usize) -> Option<&Pole> {
    let poles = of_mode(evaluation, mode);
    let whole = poles.clone().any(|pole| pole.branch == Branch::Primary)
        && poles.clone().all(|pole| pole.damping_ratio().is_finite());
    poles.min_by(|a, b| a.damping_ratio().total_cmp(&b.damping_ratio())).filter(|_| whole)
}

#[cfg(test)]
mod tests {
    use super::super::record::{Failure, FailureKind};
    use super::super::synthetic;
    use super::*;
    use nalgebra::Complex;

    fn pole(branch: Branch, re: f64, im: f64) -> Pole {
        Pole {
            mode: Some(0),
            branch,
            label: None,
            value: Complex::new(re, im),
            identity_confidence: None,
            participation: None,
            residual: None,
            error_bound: None,
            sensitivity: None,
        }
    }

    fn record(evaluations: Vec<(usize, usize, Result<Vec<Pole>, Failure>)>) -> Record {
        let evaluations = evaluations
            .into_iter()
            .map(|(variant, flight_time, outcome)| Evaluation {
                solution: None,
                variant,
                flight_time,
                null_poles: 0,
                outcome,
                loops: None,
            })
            .collect();
        Record { population: 0, case: 0, values: vec![], scores: vec![], evaluations }
    }

    fn value(record: &Record, quantity: Quantity, variant: usize) -> Option<f64> {
        let definition = synthetic::definition(&[1]);
        let metrics = metrics(&definition);
        let metric = find(&metrics, quantity, variant, 0).unwrap();
        metric.value(&ReducedCase::new(&definition, record))
    }

    #[test]
    fn the_less_stable_of_two_poles_counts_and_the_worst_flight_time() {
        let stable = pole(Branch::Primary, -3.0, 4.0);
        let record = record(vec![
            (0, 0, Ok(vec![stable.clone()])),
            (1, 0, Ok(vec![stable.clone(), pole(Branch::Partner, 0.6, 0.8)])),
            (0, 1, Ok(vec![pole(Branch::Primary, -4.0, 3.0)])),
            (1, 1, Ok(vec![stable])),
        ]);
        let times = synthetic::definition(&[1]).flight_times_s;
        assert_eq!(value(&record, Quantity::DampingRatioMin, 0), Some(0.6));
        assert_eq!(value(&record, Quantity::DampingRatioMin, 1), Some(-0.6));
        assert_eq!(value(&record, Quantity::FlightTimeOfMin, 1), Some(times[0]));
        assert_eq!(value(&record, Quantity::FrequencyOfMin, 1), Some(0.8 / std::f64::consts::TAU));
        assert_eq!(value(&record, Quantity::PoleRealMax, 1), Some(0.6));
        assert_eq!(value(&record, Quantity::UnstableTimes, 1), Some(1.0));
        let expected = std::f64::consts::LN_2 / 0.6;
        assert_eq!(value(&record, Quantity::TimeToDoubleMin, 1), Some(expected));
        assert_eq!(value(&record, Quantity::TimeToDoubleMin, 0), None);
        // −0.6 − 0.6 at the first time, 0.6 − 0.8 at the second.
        assert_eq!(value(&record, Quantity::DampingRatioGainMin, 1), Some(-1.2));
    }

    #[test]
    fn a_failed_flight_time_leaves_the_worst_unknown() {
        let stable = || Ok(vec![pole(Branch::Primary, -3.0, 4.0)]);
        let failed = || Err(Failure::new(FailureKind::Residual, "1e-3"));
        let record =
            record(vec![(0, 0, stable()), (1, 0, stable()), (0, 1, failed()), (1, 1, stable())]);
        for quantity in QUANTITIES.iter().map(|line| line.quantity).take(6) {
            assert_eq!(value(&record, quantity, 0), None);
        }
        assert_eq!(value(&record, Quantity::DampingRatioMin, 1), Some(0.6));
        // The pair is incomplete.
        assert_eq!(value(&record, Quantity::DampingRatioGainMin, 1), None);
    }

    #[test]
    fn a_pole_that_is_not_finite_or_without_a_primary_is_no_result() {
        let stable = || Ok(vec![pole(Branch::Primary, -3.0, 4.0)]);
        let record = record(vec![
            (0, 0, Ok(vec![pole(Branch::Primary, f64::NAN, 1.0)])),
            (1, 0, Ok(vec![pole(Branch::Partner, -3.0, 4.0)])),
            (0, 1, stable()),
            (1, 1, stable()),
        ]);
        assert_eq!(value(&record, Quantity::DampingRatioMin, 0), None);
        assert_eq!(value(&record, Quantity::DampingRatioMin, 1), None);
    }

    #[test]
    fn names_are_short_distinct_and_plain() {
        let mut definition = synthetic::definition(&[1]);
        definition.modes = vec!["TVSE mode".to_owned()];
        let plain = metrics(&definition);
        assert_eq!(plain[0].name, "damping_ratio_min_no_jet_tvse_mode");
        definition.modes = vec!["m".repeat(40), "n".repeat(60)];
        let long = metrics(&definition);
        let distinct: BTreeSet<_> = long.iter().map(|m| &m.name).collect();
        assert_eq!(distinct.len(), long.len());
        assert!(long.iter().all(|m| m.name.len() <= LONGEST_NAME));
        definition.modes = vec!["a".to_owned(), "jet_a".to_owned()];
        definition.variants[1].name = "no".to_owned();
        let ambiguous = metrics(&definition);
        let distinct: BTreeSet<_> = ambiguous.iter().map(|m| &m.name).collect();
        assert_eq!(distinct.len(), ambiguous.len());
    }
}
