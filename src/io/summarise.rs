//! Summing up a run from its finished tables, within a stated memory.
//!
//! What a row of the summary is, is decided in `campaign::summary`; here its series are gathered,
//! in several passes over the table where they do not fit at once.

use super::run::Run;
use super::schema::TableName;
use crate::campaign::metric::{self, Metric, Quantity, metrics};
use crate::campaign::summary::{Group, Series, SummaryRow, WorstRow, groups, smallest, summarise};
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
        let mut done: BTreeMap<(Option<usize>, usize), Vec<SummaryRow>> = BTreeMap::new();
        let modes = 0..definition.modes.len();
        let times = 0..definition.flight_times_s.len();
        let pairs: Vec<_> =
            times.flat_map(|time| modes.clone().map(move |mode| (time, mode))).collect();
        let bytes = p.cases as usize * definition.variants.len() * Series::BYTES_PER_CASE;
        let at_once = (memory / bytes.max(1)).max(1);
        for pairs in pairs.chunks(at_once) {
            for ((time, mode), variants) in at_times(run, population, pairs)? {
                let group = |variant| Group { population, variant, mode, flight_time: Some(time) };
                done.insert((Some(time), mode), sum_up(run, group, variants)?);
            }
        }
        for mode in modes {
            let group = |variant| Group { population, variant, mode, flight_time: None };
            done.insert((None, mode), sum_up(run, group, reduced(run, population, mode)?)?);
        }
        rows.extend(groups(definition, population).iter().map(|group| {
            let variants = &done[&(group.flight_time, group.mode)];
            variants[group.variant].clone()
        }));
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

/// The series of every variant with each case reduced to its worst flight time, from `cases`.
fn reduced(run: &Run, population: usize, mode: usize) -> Result<Vec<Series>, Problems> {
    let definition = &run.outline().definition;
    let metrics = metrics(definition);
    let mut variants = Vec::new();
    for variant in 0..definition.variants.len() {
        let column = |quantity| column(run, &metrics, population, quantity, variant, mode);
        variants.push(Series {
            damping_ratio: column(Quantity::DampingRatioMin)?,
            frequency_hz: column(Quantity::FrequencyOfMin)?,
            pole_re_rad_s: column(Quantity::PoleRealMax)?,
            damping_ratio_gain: if variant == 0 {
                Vec::new()
            } else {
                column(Quantity::DampingRatioGainMin)?
            },
        });
    }
    Ok(variants)
}

/// The values of a metric for every case of a population; NaN for NULL.
fn column(
    run: &Run,
    metrics: &[Metric],
    population: usize,
    quantity: Quantity,
    variant: usize,
    mode: usize,
) -> Result<Vec<f64>, Problems> {
    let metric = metric::find(metrics, quantity, variant, mode).expect("the registry has it");
    let mut columns = run.numbers(population, &[&metric.name])?;
    Ok(columns.swap_remove(0))
}

fn sum_up(
    run: &Run,
    group: impl Fn(usize) -> Group,
    variants: Vec<Series>,
) -> Result<Vec<SummaryRow>, Problems> {
    let mut rows = Vec::new();
    for (variant, series) in variants.into_iter().enumerate() {
        let group = group(variant);
        let drawn = run.outline().definition.populations[group.population].drawn;
        let row = summarise(group, drawn, &series)
            .map_err(|error| run.damage(TableName::Modes, error.to_string(), "finite numbers"))?;
        rows.push(row);
    }
    Ok(rows)
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
                let column = |quantity| column(run, &metrics, population, quantity, variant, mode);
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
            let distance = |draw: &usize| stored.scores[*draw].map_or(f64::INFINITY, f64::abs);
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
