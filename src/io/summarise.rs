//! Summing up a run from its finished tables, within a stated memory.
//!
//! What a row of the summary is, is decided in `campaign::summary`; here its series are gathered,
//! in several passes over the table where they do not fit at once.

use super::run::Run;
use super::schema::TableName;
use crate::campaign::Sample;
use crate::campaign::metric::{self, Metric, Quantity, metrics};
use crate::campaign::summary::{
    Group, Series, SummaryRow, WorstRow, groups, smallest, summarise, summarise_nested,
};
use crate::problem::Problems;
use std::collections::BTreeMap;

/// Memory for the series held at once, bytes; one flight time and mode is held at the least.
pub const MEMORY: usize = 256 << 20;

/// Every row of the summary, in order; the series held at once take about `memory` bytes.
///
/// # Errors
/// Damage in the tables.
pub fn summary(run: &Run, memory: usize) -> Result<Vec<SummaryRow>, Problems> {
    let definition = &run.outline().definition;
    let mut rows = Vec::new();
    for (population, p) in definition.populations.iter().enumerate() {
        let mut outer = Vec::new();
        let mut done: BTreeMap<(Option<usize>, usize), Vec<SummaryRow>> = BTreeMap::new();
        let modes = 0..definition.modes.len();
        let times = 0..definition.flight_times_s.len();
        let pairs: Vec<_> =
            times.flat_map(|time| modes.clone().map(move |mode| (time, mode))).collect();
        let bytes = p.cases as usize * definition.variants.len() * Series::BYTES_PER_CASE;
        let at_once = (memory / bytes.max(1)).max(1);
        for pairs in pairs.chunks(at_once) {
            for ((time, mode), variants) in at_times(run, population, pairs)? {
                let rows = variants.iter().enumerate().map(|(variant, series)| {
                    let group =
                        Group { population, variant, mode, flight_time: Some(time), outer: None };
                    sum_up(run, group, series)
                });
                done.insert((Some(time), mode), rows.collect::<Result<_, _>>()?);
            }
        }
        for mode in modes {
            // One variant at a time: the gains are stored.
            let mut variants = Vec::new();
            for variant in 0..definition.variants.len() {
                let group = Group { population, variant, mode, flight_time: None, outer: None };
                let mut of_group = summarise_nested(group, p, &reduced(run, group)?)
                    .map_err(|error| damaged(run, &error))?;
                outer.extend(of_group.drain(1..));
                variants.extend(of_group);
            }
            done.insert((None, mode), variants);
        }
        rows.extend(groups(definition, population).iter().map(|group| {
            let variants = &done[&(group.flight_time, group.mode)];
            variants[group.variant].clone()
        }));
        outer.sort_by_key(|row: &SummaryRow| row.group);
        rows.extend(outer);
    }
    Ok(rows)
}

/// The series of every variant at some flight times and modes, in one pass over `modes`.
fn at_times(
    run: &Run,
    population: usize,
    pairs: &[(usize, usize)],
) -> Result<BTreeMap<(usize, usize), Vec<Series>>, Problems> {
    let definition = &run.outline().definition;
    let cases = definition.populations[population].cases;
    let unknown = || vec![Series::unknown(cases as usize); definition.variants.len()];
    let mut series: BTreeMap<_, _> = pairs.iter().map(|pair| (*pair, unknown())).collect();
    run.modes(population, 0..cases, |row| {
        if let (Some(mode), Ok(pole)) = (row.mode, &row.outcome)
            && let Some(variants) = series.get_mut(&(row.flight_time, mode))
        {
            let series = &mut variants[row.variant];
            let (damping, frequency) = (pole.damping_ratio(), pole.frequency_hz());
            series.add(row.case as usize, damping, frequency, pole.value.re);
        }
        Ok(())
    })?;
    for variants in series.values_mut() {
        let (first, others) = variants.split_at_mut(1);
        others.iter_mut().for_each(|other| other.compare(&first[0].damping_ratio));
    }
    Ok(series)
}

/// The series of a group with each case reduced to its worst flight time, from `cases`.
fn reduced(run: &Run, group: Group) -> Result<Series, Problems> {
    let metrics = metrics(&run.outline().definition);
    let column = |quantity| column(run, &metrics, group, quantity);
    Ok(Series {
        damping_ratio: column(Quantity::DampingRatioMin)?,
        frequency_hz: column(Quantity::FrequencyOfMin)?,
        pole_re_rad_s: column(Quantity::PoleRealMax)?,
        damping_ratio_gain: match group.variant {
            0 => Vec::new(),
            _ => column(Quantity::DampingRatioGainMin)?,
        },
    })
}

/// The values of a metric for every case of a group; NaN for NULL.
fn column(
    run: &Run,
    metrics: &[Metric],
    group: Group,
    quantity: Quantity,
) -> Result<Vec<f64>, Problems> {
    let metric = metric::find(metrics, quantity, group.variant, group.mode);
    let name = &metric.expect("the registry has it").name;
    Ok(run.numbers(group.population, &[name])?.swap_remove(0))
}

fn sum_up(run: &Run, group: Group, series: &Series) -> Result<SummaryRow, Problems> {
    let sample = Sample::of(&run.outline().definition.populations[group.population]);
    summarise(group, sample, series).map_err(|error| damaged(run, &error))
}

fn damaged(run: &Run, error: &crate::stats::Error) -> Problems {
    run.damage(TableName::Modes, error.to_string(), "finite numbers")
}

/// The `most` worst cases of every population, variant and named mode, each with all its draws,
/// the farthest from nominal first.
///
/// # Errors
/// Damage in the tables.
pub fn worst(run: &Run, most: usize) -> Result<Vec<WorstRow>, Problems> {
    let definition = &run.outline().definition;
    let metrics = metrics(definition);
    let mut rows = Vec::new();
    for population in 0..definition.populations.len() {
        let first = rows.len();
        for variant in 0..definition.variants.len() {
            for mode in 0..definition.modes.len() {
                let group = Group { population, variant, mode, flight_time: None, outer: None };
                let column = |quantity| column(run, &metrics, group, quantity);
                let damping = column(Quantity::DampingRatioMin)?;
                let cases = smallest(&damping, most);
                let time = column(Quantity::FlightTimeOfMin)?;
                let doubling = column(Quantity::TimeToDoubleMin)?;
                let known = |value: f64| (!value.is_nan()).then_some(value);
                rows.extend(cases.into_iter().enumerate().map(|(rank, case)| WorstRow {
                    population,
                    variant,
                    mode,
                    rank: rank + 1,
                    case: case as u64,
                    flight_time_s: known(time[case]),
                    damping_ratio: damping[case],
                    time_to_double_s: known(doubling[case]),
                    draw: None,
                    value: None,
                    score: None,
                }));
            }
        }
        let cases: Vec<WorstRow> = rows.drain(first..).collect();
        let draws = run.draws(population, cases.iter().map(|row| row.case))?;
        for row in cases {
            let stored = &draws[&row.case];
            let mut order: Vec<usize> = (0..run.outline().draws.len()).collect();
            let distance = |draw: &usize| match (stored.values[*draw], stored.scores[*draw]) {
                (None, _) => 0.0,
                (Some(_), None) => f64::INFINITY,
                (Some(_), Some(score)) => score.abs(),
            };
            order.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
            if order.is_empty() {
                rows.push(row);
                continue;
            }
            rows.extend(order.into_iter().map(|draw| WorstRow {
                draw: Some(draw),
                value: stored.values[draw],
                score: stored.scores[draw],
                ..row.clone()
            }));
        }
    }
    Ok(rows)
}
