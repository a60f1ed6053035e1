//! A finished run as gates see it: columns, names, and one value for each case.
//!
//! What gates make of the values is decided in `gate`.

use super::column::{Column, Get};
use super::run::Run;
use super::schema;
use crate::campaign::Failure;
use crate::campaign::row::ModeRow;
use crate::campaign::{Outline, Sample};
use crate::gate::{
    CaseValue, Metric, MissingMeans, Names, NestedPlan, Population, Query, Region, Searched,
    Source, Table, reduce,
};
use crate::problem::Problems;

/// Columns of numbers that say which row it is, not what was found.
const KEYS: [&str; 2] = ["case", "flight_time_s"];

/// The value of a row, `None` where it has none, or why it failed.
pub(super) type Value = Result<Option<f64>, String>;

impl Names for Outline {
    fn metrics(&self) -> Vec<Metric> {
        let mut metrics = of_table(Table::Cases, &schema::cases(self));
        metrics.extend(of_table(Table::Modes, &schema::modes(self)));
        metrics
    }

    fn populations(&self) -> Vec<Population> {
        let population = |p: &crate::campaign::Population| Population {
            name: p.name.clone(),
            planned: p.cases,
            drawing: p.drawing(),
            nested: Sample::of(p).nested().map(|(inner, allowed_share, risk)| NestedPlan {
                inner,
                allowed_share,
                risk,
            }),
        };
        self.definition.populations.iter().map(population).collect()
    }

    fn variants(&self) -> Vec<String> {
        self.definition.variants.iter().map(|v| v.name.clone()).collect()
    }

    fn flight_times_s(&self) -> Vec<f64> {
        self.definition.flight_times_s.clone()
    }

    fn modes(&self) -> Vec<String> {
        self.definition.modes.clone()
    }
}

impl Names for Run {
    fn metrics(&self) -> Vec<Metric> {
        self.outline().metrics()
    }

    fn populations(&self) -> Vec<Population> {
        self.outline().populations()
    }

    fn variants(&self) -> Vec<String> {
        self.outline().variants()
    }

    fn flight_times_s(&self) -> Vec<f64> {
        self.outline().flight_times_s()
    }

    fn modes(&self) -> Vec<String> {
        Names::modes(self.outline())
    }
}

impl Source for Run {
    fn visit(
        &self,
        query: &Query<'_>,
        visit: &mut dyn FnMut(CaseValue) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        let populations = &self.outline().definition.populations;
        let population = populations
            .iter()
            .position(|p| p.name == query.population)
            .expect("gates ask for populations of the run");
        match query.metric.table {
            Table::Cases => of_cases(self, population, query, visit),
            Table::Modes => of_modes(self, population, query, visit),
        }
    }

    fn worst(
        &self,
        query: &Query<'_>,
        region: Region,
        sigma: f64,
    ) -> Result<Option<Searched>, Problems> {
        super::worst::searched(self, query, region, sigma)
    }
}

fn of_table<R>(table: Table, columns: &[Column<R>]) -> Vec<Metric> {
    columns
        .iter()
        .filter(|c| matches!(c.get, Get::Number(_) | Get::Count(_)))
        .filter(|column| !KEYS.contains(&column.name.as_str()))
        .map(|column| Metric {
            name: column.name.clone(),
            unit: column.unit.clone(),
            table,
            missing: if schema::null_is_good(&column.name) {
                MissingMeans::NotApplicableGood
            } else {
                MissingMeans::NoValue
            },
        })
        .collect()
}

type Visit<'a> = &'a mut dyn FnMut(CaseValue) -> Result<(), Problems>;

fn of_cases(
    run: &Run,
    population: usize,
    query: &Query<'_>,
    visit: Visit<'_>,
) -> Result<(), Problems> {
    run.cases(population, &[&query.metric.name], |case, values, failure| {
        let row = case_value(values, failure);
        visit(CaseValue { case, value: reduce([row], query.metric, query.worst) })
    })
}

/// The value of a case in the one column that was asked of its table.
pub(super) fn case_value(values: &[f64], failure: Option<Failure>) -> Value {
    match failure {
        _ if !values[0].is_nan() => Ok(Some(values[0])),
        Some(failure) => Err(failure.to_string()),
        None => Ok(None),
    }
}

/// A row of a case: its damping ratio, by which the less stable pole is told, and its value.
struct Row {
    damping_ratio: f64,
    value: Value,
}

/// The rows of a case at one flight time and mode: of the variant and of its baseline.
#[derive(Default)]
struct Place {
    here: Vec<Row>,
    baseline: Vec<Row>,
}

/// The values of a variant at chosen flight times (s) and named modes for a range of cases: of each case
/// that is present, one a choice, that of the less stable pole.
///
/// # Errors
/// Damage in the table.
pub(super) fn less_stable_values(
    run: &Run,
    (population, cases): (usize, std::ops::Range<u64>),
    metric: &Metric,
    variant: usize,
    chosen: &[(f64, String)],
) -> Result<Vec<(u64, Vec<Value>)>, Problems> {
    let definition = &run.outline().definition;
    let get = getter(run, metric);
    let place = |row: &ModeRow| {
        let time = definition.flight_times_s[row.flight_time];
        let mode = &definition.modes[row.mode?];
        chosen.iter().position(|(at, name)| *at == time && name == mode)
    };
    let mut found: Vec<(u64, Vec<Vec<Row>>)> = Vec::new();
    run.modes(population, cases, |row| {
        if found.last().is_none_or(|(case, _)| *case != row.case) {
            let places = chosen.iter().map(|_| Vec::new()).collect();
            found.push((row.case, places));
        }
        if row.variant == variant
            && let (Some(place), Some((_, places))) = (place(&row), found.last_mut())
        {
            places[place].push(value(&row, &get));
        }
        Ok(())
    })?;
    let values = |(case, places): (u64, Vec<Vec<Row>>)| {
        (case, places.iter().map(|rows| less_stable(rows)).collect())
    };
    Ok(found.into_iter().map(values).collect())
}

fn of_modes(
    run: &Run,
    population: usize,
    query: &Query<'_>,
    visit: Visit<'_>,
) -> Result<(), Problems> {
    let definition = &run.outline().definition;
    let get = getter(run, query.metric);
    let variant =
        |name: Option<&str>| definition.variants.iter().position(|v| Some(v.name.as_str()) == name);
    let (here, baseline) = (variant(query.variant), variant(query.baseline));
    let times: Vec<bool> = definition
        .flight_times_s
        .iter()
        .map(|time| query.flight_times_s.is_none_or(|chosen| chosen.contains(time)))
        .collect();
    let modes: Vec<bool> =
        definition.modes.iter().map(|name| query.mode.is_none_or(|mode| mode == name)).collect();
    let mut places: Vec<Place> = Vec::new();
    let width = modes.len();
    places.resize_with(times.len() * width, Place::default);
    let chosen = |index: usize| times[index / width] && modes[index % width];
    let mut finish = |case: u64, places: &mut [Place]| {
        let chosen = places.iter().enumerate().filter(|(index, _)| chosen(*index));
        let rows = chosen.flat_map(|(_, place)| place.rows(query));
        let value = reduce(rows, query.metric, query.worst);
        for place in places {
            place.here.clear();
            place.baseline.clear();
        }
        visit(CaseValue { case, value })
    };
    let mut last = None;
    run.modes(population, 0..u64::MAX, |row| {
        if let Some(last) = last.filter(|last| *last != row.case) {
            finish(last, &mut places)?;
        }
        last = Some(row.case);
        let Some(mode) = row.mode else { return Ok(()) };
        let place = &mut places[row.flight_time * width + mode];
        if Some(row.variant) == here {
            place.here.push(value(&row, &get));
        }
        if Some(row.variant) == baseline {
            place.baseline.push(value(&row, &get));
        }
        Ok(())
    })?;
    last.map_or(Ok(()), |last| finish(last, &mut places))
}

type Getter = Box<dyn Fn(&ModeRow) -> Option<f64>>;

/// How a metric is taken from a row of the table `modes`.
fn getter(run: &Run, metric: &Metric) -> Getter {
    let columns = schema::modes(run.outline());
    match columns.into_iter().find(|column| column.name == metric.name).map(|column| column.get) {
        Some(Get::Number(get)) => get,
        Some(Get::Count(get)) => Box::new(move |row| get(row).map(|count| count as f64)),
        _ => unreachable!("gates ask for columns of numbers of the run"),
    }
}

fn value(row: &ModeRow, get: impl Fn(&ModeRow) -> Option<f64>) -> Row {
    match &row.outcome {
        Ok(pole) => Row { damping_ratio: pole.damping_ratio(), value: Ok(get(row)) },
        Err(failure) => Row { damping_ratio: f64::NAN, value: Err(failure.to_string()) },
    }
}

impl Place {
    /// The values to be reduced: every row, or the difference of the less stable poles.
    fn rows(&self, query: &Query<'_>) -> Vec<Value> {
        if query.baseline.is_some() {
            let difference = less_stable(&self.here).and_then(|here| {
                let baseline = less_stable(&self.baseline)?;
                match (here, baseline) {
                    (Some(here), Some(baseline)) => Ok(Some(here - baseline)),
                    _ => Err(format!("{} has no value to compare", query.metric.name)),
                }
            });
            return vec![difference];
        }
        if self.here.is_empty() {
            return vec![missing()];
        }
        self.here.iter().map(|row| row.value.clone()).collect()
    }
}

fn less_stable(rows: &[Row]) -> Value {
    if let Some(failed) = rows.iter().find(|row| row.value.is_err()) {
        return failed.value.clone();
    }
    let least = rows.iter().min_by(|a, b| a.damping_ratio.total_cmp(&b.damping_ratio));
    least.map_or_else(missing, |row| row.value.clone())
}

fn missing() -> Value {
    Err("the run holds no row of it".to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::synthetic;
    use super::*;
    use crate::campaign::{Branch, Record, StoredPoles, synthetic as cases};
    use crate::gate::Worst;
    use crate::stats::Drawing;

    const CASES: u64 = 60;

    fn run(folder: &std::path::Path) -> Run {
        let outline = cases::outline(&[1, CASES], StoredPoles::All);
        synthetic::run(&folder.join("run"), outline, 2).unwrap();
        Run::open(&folder.join("run")).unwrap()
    }

    fn metric(run: &Run, table: Table, name: &str) -> Metric {
        let metrics = run.metrics();
        metrics.into_iter().find(|m| m.table == table && m.name == name).unwrap()
    }

    fn query(metric: &Metric) -> Query<'_> {
        Query {
            metric,
            population: "dispersed",
            variant: Some("jet"),
            baseline: None,
            baseline_run: false,
            flight_times_s: None,
            mode: Some("tvse"),
            worst: Worst::Smallest,
        }
    }

    /// The smallest damping ratio of a case's mode 0 at a flight time, from its record.
    fn damping(record: &Record, variant: usize, time: usize) -> Option<f64> {
        let evaluation = &record.evaluations[time * 2 + variant];
        assert_eq!((evaluation.variant, evaluation.flight_time), (variant, time));
        let poles = evaluation.outcome.as_ref().ok()?.iter().filter(|p| p.mode == Some(0));
        poles.map(|pole| pole.damping_ratio()).reduce(f64::min)
    }

    fn expected(value: impl Fn(&Record) -> Option<f64>) -> Vec<Option<f64>> {
        let definition = cases::definition(&[1, CASES]);
        let record =
            |case| (case != 19).then(|| cases::evaluate(&definition, 1, case, StoredPoles::All));
        (0..CASES).map(|case| record(case).as_ref().and_then(&value)).collect()
    }

    fn values(run: &Run, query: &Query<'_>) -> Vec<CaseValue> {
        let mut values = Vec::new();
        run.visit(query, &mut |value| {
            values.push(value);
            Ok(())
        })
        .unwrap();
        values
    }

    fn found(run: &Run, query: &Query<'_>) -> Vec<Option<f64>> {
        let values = values(run, query);
        assert!(values.iter().map(|value| value.case).eq(0..CASES));
        values.into_iter().map(|case| case.value.ok().flatten()).collect()
    }

    #[test]
    fn a_case_is_its_least_stable_pole_over_flight_times_and_branches() {
        let folder = tempfile::tempdir().unwrap();
        let run = run(folder.path());
        let metric = metric(&run, Table::Modes, "damping_ratio");
        let worst = |r: &Record| Some(damping(r, 1, 0)?.min(damping(r, 1, 1)?));
        assert_eq!(found(&run, &query(&metric)), expected(worst));
        let times = [110.0];
        let late = Query { flight_times_s: Some(&times), ..query(&metric) };
        assert_eq!(found(&run, &late), expected(|r| damping(r, 1, 1)));
        let definition = cases::definition(&[1, CASES]);
        let partners = (0..CASES).map(|case| cases::record(&definition, 1, case)).filter(|r| {
            r.evaluations
                .iter()
                .flat_map(|e| e.outcome.iter().flatten())
                .any(|pole| pole.branch == Branch::Partner)
        });
        assert!(partners.count() > 0);
    }

    #[test]
    fn a_baseline_is_subtracted_case_by_case_and_time_by_time() {
        let folder = tempfile::tempdir().unwrap();
        let run = run(folder.path());
        let metric = metric(&run, Table::Modes, "damping_ratio");
        let gain = |r: &Record, time| Some(damping(r, 1, time)? - damping(r, 0, time)?);
        let least = |r: &Record| Some(f64::min(gain(r, 0)?, gain(r, 1)?));
        let paired = Query { baseline: Some("no_jet"), ..query(&metric) };
        assert_eq!(found(&run, &paired), expected(least));
        // The same is stored as a metric of the case.
        let stored = self::metric(&run, Table::Cases, "damping_ratio_gain_min_jet_tvse");
        let stored = Query { variant: None, mode: None, ..query(&stored) };
        assert_eq!(found(&run, &stored), expected(least));
    }

    #[test]
    fn a_failed_case_fails_and_a_stable_one_has_no_time_to_double() {
        let folder = tempfile::tempdir().unwrap();
        let run = run(folder.path());
        for (table, name) in
            [(Table::Modes, "time_to_double_s"), (Table::Cases, "time_to_double_min_no_jet_tvse_s")]
        {
            let metric = metric(&run, table, name);
            let of_cases = table == Table::Cases;
            let query = Query {
                variant: (!of_cases).then_some("no_jet"),
                mode: (!of_cases).then_some("tvse"),
                ..query(&metric)
            };
            let values = values(&run, &query);
            let message = |case: usize| values[case].value.clone().unwrap_err();
            assert_eq!(message(11), "draw: booster.left.nozzle.inertia is -1");
            assert_eq!(message(17), "no_convergence: after 90 iterations");
            assert_eq!(message(19), "panic: case 19 breaks");
            let shortest = expected(|r| {
                let worst = damping(r, 0, 0)?.min(damping(r, 0, 1)?);
                (worst < 0.0).then_some(worst)
            });
            let unstable = values.iter().map(|case| matches!(case.value, Ok(Some(_))));
            assert!(unstable.eq(shortest.iter().map(Option::is_some)));
            assert!(values.iter().any(|case| case.value == Ok(None)));
        }
    }

    #[test]
    fn the_names_are_those_of_the_run_and_only_draws_are_independent() {
        let folder = tempfile::tempdir().unwrap();
        let run = run(folder.path());
        let drawings: Vec<_> =
            run.populations().into_iter().map(|p| (p.planned, p.drawing)).collect();
        assert_eq!(drawings, [(1, Drawing::Designed), (CASES, Drawing::Independent)]);
        assert_eq!(Names::modes(&run), ["tvse", "bending"]);
        assert_eq!(run.variants(), ["no_jet", "jet"]);
        let names: Vec<_> = run.metrics().into_iter().map(|m| m.name).collect();
        assert!(!names.iter().any(|name| KEYS.contains(&name.as_str())));
        assert!(names.iter().any(|name| name == "draw_structure_damping"));
    }
}
