//! Summing up a run from its finished tables, within a memory that does not grow with its cases.
//!
//! What a row of the summary is, is decided in `campaign::summary`; here its cases are read, in
//! several passes over the tables where they do not fit at once.

use super::run::Run;
use super::schema::TableName;
use super::stored::{POLE_COLUMNS, PoleRow};
use crate::campaign::Sample;
use crate::campaign::metric::{self, Quantity, metrics};
use crate::campaign::record::{damping_ratio, frequency_hz};
use crate::campaign::summary::{Found, Smallest, SummaryRow, Tally, WorstRow, groups};
use crate::problem::Problems;
use crate::stats;

/// Memory for values held at once, bytes.
pub const MEMORY: usize = 2 << 20;

/// Every row of the summary, in order; the values held at once take about `memory` bytes.
///
/// # Errors
/// Damage in the tables.
pub fn summary(run: &Run, memory: usize) -> Result<Vec<SummaryRow>, Problems> {
    let definition = &run.outline().definition;
    let failed =
        |error: stats::Error| run.damage(TableName::Modes, error.to_string(), "finite numbers");
    let mut rows = Vec::new();
    for (population, p) in definition.populations.iter().enumerate() {
        let groups = groups(definition, population);
        let most = memory / size_of::<u64>() / groups.len().max(1);
        let mut timed = Vec::new();
        let mut reduced = Vec::new();
        for group in groups {
            let tallies = if group.flight_time.is_some() { &mut timed } else { &mut reduced };
            tallies.push(Tally::new(group, Sample::of(p), most));
        }
        let passes: [(&mut Vec<Tally>, Pass); 2] =
            [(&mut timed, pass_over_modes), (&mut reduced, pass_over_cases)];
        for (tallies, pass) in passes {
            loop {
                pass(run, population, tallies)?;
                let ends = tallies.iter_mut().map(Tally::end_pass);
                if ends.collect::<Result<Vec<_>, _>>().map_err(failed)?.into_iter().all(|end| end) {
                    break;
                }
            }
        }
        let mut outer: Vec<_> = reduced.iter().flat_map(Tally::outer_rows).cloned().collect();
        outer.sort_by_key(|row| row.group);
        // By variant; its flight times, then the worst of them.
        let modes = definition.modes.len();
        let at = definition.flight_times_s.len() * modes;
        let (mut timed, mut reduced) = (timed.chunks(at.max(1)), reduced.chunks(modes.max(1)));
        for _ in &definition.variants {
            for tally in timed.next().into_iter().chain(reduced.next()).flatten() {
                rows.push(tally.row().map_err(failed)?);
            }
        }
        rows.extend(outer);
    }
    Ok(rows)
}

type Pass = fn(&Run, usize, &mut [Tally]) -> Result<(), Problems>;

/// Shows every case at every flight time, from `modes`, to the tallies of a population, which come
/// by variant, flight time and mode.
fn pass_over_modes(run: &Run, population: usize, tallies: &mut [Tally]) -> Result<(), Problems> {
    let definition = &run.outline().definition;
    let (times, modes) = (definition.flight_times_s.len(), definition.modes.len());
    let cases = definition.populations[population].cases;
    let failed =
        |error: stats::Error| run.damage(TableName::Modes, error.to_string(), "finite numbers");
    let mut places = vec![Found::NOTHING; tallies.len()];
    let mut flush = |places: &mut [Found]| {
        for index in 0..places.len() {
            let first = places[index % (times * modes)].damping_ratio;
            let mut found = places[index];
            if index >= times * modes {
                found.damping_ratio_gain = found.damping_ratio - first;
            }
            tallies[index].add(&found).map_err(failed)?;
        }
        places.fill(Found::NOTHING);
        Ok(())
    };
    let mut next = 0;
    let chosen = |name: &str| POLE_COLUMNS.contains(&name);
    run.batches(TableName::Modes, chosen, population, &(0..cases), |batch| {
        for PoleRow { case, variant, flight_time, mode, pole } in run.pole_rows(batch)? {
            if case < next || case >= cases {
                let found = format!("case {case} after case {next}");
                return Err(run.damage(TableName::Modes, found, "cases in order"));
            }
            while next < case {
                flush(&mut places)?;
                next += 1;
            }
            if let Some(pole) = pole {
                let place = &mut places[(variant * times + flight_time) * modes + mode];
                place.add(damping_ratio(pole), frequency_hz(pole), pole.re);
            }
        }
        Ok(())
    })?;
    while next < cases {
        flush(&mut places)?;
        next += 1;
    }
    Ok(())
}

/// Shows every case reduced to its worst flight time, from `cases`, to the tallies of a population,
/// which come by variant and mode.
fn pass_over_cases(run: &Run, population: usize, tallies: &mut [Tally]) -> Result<(), Problems> {
    const QUANTITIES: [Quantity; 4] = [
        Quantity::DampingRatioMin,
        Quantity::FrequencyOfMin,
        Quantity::PoleRealMax,
        Quantity::DampingRatioGainMin,
    ];
    let columns = Columns::of(run, &QUANTITIES);
    run.cases(population, &columns.names(), |_, values, _| {
        for (tally, places) in tallies.iter_mut().zip(&columns.places) {
            let value = |quantity: usize| places[quantity].map_or(f64::NAN, |at| values[at]);
            let found = Found {
                damping_ratio: value(0),
                frequency_hz: value(1),
                pole_re_rad_s: value(2),
                damping_ratio_gain: value(3),
            };
            tally
                .add(&found)
                .map_err(|e| run.damage(TableName::Cases, e.to_string(), "finite numbers"))?;
        }
        Ok(())
    })
}

/// Columns of some metrics in the `cases` table, for every variant and mode.
struct Columns {
    names: Vec<String>,
    /// By variant and mode, then by quantity: the place in `names`; none where the metric is not.
    places: Vec<Vec<Option<usize>>>,
}

impl Columns {
    fn of(run: &Run, quantities: &[Quantity]) -> Self {
        let definition = &run.outline().definition;
        let metrics = metrics(definition);
        let mut columns = Self { names: Vec::new(), places: Vec::new() };
        for variant in 0..definition.variants.len() {
            for mode in 0..definition.modes.len() {
                let place = |quantity: &Quantity| {
                    let metric = metric::find(&metrics, *quantity, variant, mode)?;
                    columns.names.push(metric.name.clone());
                    Some(columns.names.len() - 1)
                };
                let places = quantities.iter().map(place).collect();
                columns.places.push(places);
            }
        }
        columns
    }

    fn names(&self) -> Vec<&str> {
        self.names.iter().map(String::as_str).collect()
    }
}

/// The The `most` worst cases of every population, variant and named mode, each with all its draws,
/// the farthest from nominal first.
///
/// # Errors
/// Damage in the tables.
pub fn worst(run: &Run, most: usize) -> Result<Vec<WorstRow>, Problems> {
    const QUANTITIES: [Quantity; 3] =
        [Quantity::DampingRatioMin, Quantity::FlightTimeOfMin, Quantity::TimeToDoubleMin];
    let definition = &run.outline().definition;
    let modes = definition.modes.len();
    let columns = Columns::of(run, &QUANTITIES);
    let mut rows = Vec::new();
    for population in 0..definition.populations.len() {
        let mut smallest: Vec<_> = columns.places.iter().map(|_| Smallest::new(most)).collect();
        run.cases(population, &columns.names(), |case, values, _| {
            for (smallest, places) in smallest.iter_mut().zip(&columns.places) {
                let value = |quantity: usize| places[quantity].map_or(f64::NAN, |at| values[at]);
                smallest.push(value(0), || (case, value(1), value(2)));
            }
            Ok(())
        })?;
        let known = |value: f64| (!value.is_nan()).then_some(value);
        let mut cases = Vec::new();
        for (index, smallest) in smallest.into_iter().enumerate() {
            for (rank, (damping_ratio, (case, time, doubling))) in (1..).zip(smallest.into_found())
            {
                cases.push(WorstRow {
                    population,
                    variant: index / modes,
                    mode: index % modes,
                    rank,
                    case,
                    flight_time_s: known(time),
                    damping_ratio,
                    time_to_double_s: known(doubling),
                    draw: None,
                    value: None,
                    score: None,
                });
            }
        }
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
