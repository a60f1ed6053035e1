//! What a report draws, gathered from the tables of a finished run.
//!
//! Clouds of poles and loops are thinned as they are read, so that they take the same memory for any
//! number of cases; one value a case is held for distributions. How they look is decided in `report`.

use super::envelope;
use super::manifest::Manifest;
use super::run::Run;
use super::schema::TableName;
use super::stored::{POLE_COLUMNS, PoleRow};
use crate::campaign::feedback;
use crate::campaign::metric::{self, Quantity, metrics};
use crate::campaign::record::damping_ratio;
use crate::campaign::{LoopPlan, Population};
use crate::gate::{CaseValue, Gate, Source, visit};
use crate::margins::AXES;
use crate::margins::envelope::{LEVELS, nearest_phase_deg};
use crate::problem::Problems;
use crate::report::chart::{Cells, Dot};
use crate::report::html::contents::{
    Bound, Cloud, CloudVariant, Distribution, Failures, Gain, Least, LoopCharts,
};
use crate::report::html::loops::NICHOLS_FLOOR_DB;
use crate::stats::{Confidence, Ordered, Probability, Sides, tolerance_bound};
use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;
use std::collections::BTreeMap;
use std::path::Path;

/// Cells of the large cloud of poles and of the small ones, across and up.
const LARGE: [u32; 2] = [240, 150];
const SMALL: [u32; 2] = [100, 66];
/// Statements on the share of a population, the widest first: share and consumer's risk.
const STATEMENTS: [(f64, f64); 4] = [(0.9973, 0.1), (0.99, 0.1), (0.95, 0.1), (0.9, 0.1)];
/// Failed cases told with their message.
const TOLD: usize = 25;
/// Memory for the envelopes, bytes.
const MEMORY: usize = 256 << 20;

/// The poles of a population by named mode and flight time; `focus` are the flight times, by mode,
/// that are drawn large.
///
/// # Errors
/// Damage in the table.
pub fn clouds(run: &Run, population: usize, focus: &[usize]) -> Result<Vec<Cloud>, Problems> {
    let definition = &run.outline().definition;
    let (times, variants) = (definition.flight_times_s.len(), definition.variants.len());
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let mut clouds: Vec<Cloud> = (0..definition.modes.len())
        .flat_map(|mode| (0..times).map(move |flight_time| (mode, flight_time)))
        .map(|(mode, flight_time)| Cloud {
            mode,
            flight_time,
            re_rad_s: none,
            im_rad_s: none,
            variants: (0..variants)
                .map(|_| CloudVariant {
                    nominal: Vec::new(),
                    dots: Vec::new(),
                    seen: 0,
                    least: None,
                })
                .collect(),
        })
        .collect();
    let all = |population: usize, visit: &mut dyn FnMut(PoleRow, Dot, f64)| {
        let cases = 0..definition.populations[population].cases;
        let chosen = |name: &str| POLE_COLUMNS.contains(&name);
        run.batches(TableName::Modes, chosen, population, &cases, |batch| {
            for row in run.pole_rows(batch)? {
                if let Some(pole) = row.pole {
                    let dot = Dot { x: pole.re, y: pole.im, case: row.case };
                    visit(row, dot, damping_ratio(pole));
                }
            }
            Ok(())
        })
    };
    let mut populations = vec![population];
    if nominal(&definition.populations) && population != 0 {
        populations.insert(0, 0);
    }
    let widen = |[low, high]: &mut [f64; 2], value: f64| {
        (*low, *high) = (low.min(value), high.max(value));
    };
    for &of in &populations {
        all(of, &mut |row, dot, ratio| {
            let cloud = &mut clouds[row.mode * times + row.flight_time];
            widen(&mut cloud.re_rad_s, dot.x);
            widen(&mut cloud.im_rad_s, dot.y);
            let here = &mut cloud.variants[row.variant];
            if of != population {
                here.nominal.push(dot);
            } else if here.least.is_none_or(|(least, _)| ratio < least) {
                here.least = Some((ratio, dot.case));
            }
        })?;
    }
    let mut cells: Vec<Vec<Cells>> = (clouds.iter())
        .map(|cloud| {
            let large = focus.get(cloud.mode) == Some(&cloud.flight_time);
            let count = if large { LARGE } else { SMALL };
            vec![Cells::new(cloud.re_rad_s, cloud.im_rad_s, count); variants]
        })
        .collect();
    all(population, &mut |row, dot, ratio| {
        cells[row.mode * times + row.flight_time][row.variant].push(dot, ratio);
    })?;
    for (cloud, cells) in clouds.iter_mut().zip(cells) {
        for (variant, cells) in cloud.variants.iter_mut().zip(cells) {
            (variant.dots, variant.seen) = (cells.dots(), cells.seen());
        }
    }
    clouds.retain(|cloud| cloud.re_rad_s[0] <= cloud.re_rad_s[1]);
    Ok(clouds)
}

/// Whether the first population is the nominal vehicle.
fn nominal(populations: &[Population]) -> bool {
    populations.first().is_some_and(|p| !p.drawn && p.cases == 1)
}

/// Columns of the table `cases`, by case; NaN where a case failed.
///
/// # Errors
/// Damage in the table.
pub fn columns(run: &Run, population: usize, names: &[&str]) -> Result<Vec<Vec<f64>>, Problems> {
    let mut columns = vec![Vec::new(); names.len()];
    run.cases(population, names, |_, values, _| {
        columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
        Ok(())
    })?;
    Ok(columns)
}

fn by_case(values: &[f64]) -> impl Iterator<Item = (u64, f64)> + '_ {
    values.iter().enumerate().map(|(case, value)| (case as u64, *value))
}

/// Smallest damping ratios by variant and mode, with the strongest order-statistic bound that so many
/// independent cases allow.
///
/// # Errors
/// Damage in the table.
pub fn least(run: &Run, population: usize) -> Result<Vec<Least>, Problems> {
    let definition = &run.outline().definition;
    let mut all = Vec::new();
    for metric in metrics(definition).iter().filter(|m| m.quantity == Quantity::DampingRatioMin) {
        let values = columns(run, population, &[&metric.name])?.remove(0);
        let bound = bound(&definition.populations[population], &values);
        let (variant, mode) = (metric.variant, metric.mode);
        all.push(Least { variant, mode, values: Distribution::of(by_case(&values)), bound });
    }
    Ok(all)
}

/// The strongest statement of a population: failed cases lie below every value.
fn bound(population: &Population, values: &[f64]) -> Option<Bound> {
    let independent = population.drawing().independent().ok()?;
    // A failed case takes the place of the worst value there could be.
    let ranked: Vec<f64> = values.iter().map(|v| if v.is_nan() { f64::MIN } else { *v }).collect();
    let ordered = Ordered::new(&ranked).ok()?;
    STATEMENTS.into_iter().find_map(|(coverage, risk)| {
        let (share, confidence) =
            (Probability::new(coverage).ok()?, Confidence::from_risk(risk).ok()?);
        let found = tolerance_bound(&ordered, share, confidence, Sides::Lower, independent).ok()?;
        let value = found.estimate.lower();
        let exceedances = found.exceedances;
        (value > f64::MIN).then_some(Bound { coverage, risk, exceedances, value })
    })
}

/// Values of a gate, one a case.
///
/// # Errors
/// What the run does not have, damage in its tables.
pub fn gate_values(
    source: &impl Source,
    gate: &Gate,
    file: &str,
) -> Result<Distribution, Problems> {
    let mut values = Vec::new();
    visit(gate, source, file, &mut |CaseValue { case, value }| {
        // A value that does not arise is no failure and no point.
        match value {
            Ok(Some(value)) => values.push((case, value)),
            Ok(None) => {}
            Err(_) => values.push((case, f64::NAN)),
        }
        Ok(())
    })?;
    Ok(Distribution::of(values))
}

/// Damping gained over the first variant by case.
///
/// # Errors
/// Damage in the table.
pub fn gains(run: &Run, population: usize) -> Result<Vec<Gain>, Problems> {
    let definition = &run.outline().definition;
    let metrics = metrics(definition);
    let fed_back = feedback::variants(definition);
    let mut gains = Vec::new();
    for gain in metrics.iter().filter(|m| m.quantity == Quantity::DampingRatioGainMin) {
        let Some(first) = metric::find(&metrics, Quantity::DampingRatioMin, 0, gain.mode) else {
            continue;
        };
        let values = columns(run, population, &[&first.name, &gain.name])?;
        let (dots, seen) = thinned(&values[0], &values[1]);
        let (variant, mode) = (gain.variant, gain.mode);
        gains.push(Gain { variant, mode, feedback: fed_back.contains(&variant), dots, seen });
    }
    Ok(gains)
}

/// Points by case, one for each cell, the lowest; and how many there were.
pub fn thinned(x: &[f64], y: &[f64]) -> (Vec<Dot>, u64) {
    let range = |values: &[f64]| {
        let finite = values.iter().filter(|value| value.is_finite());
        finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)])
    };
    let mut cells = Cells::new(range(x), range(y), LARGE);
    for (case, (&x, &y)) in x.iter().zip(y).enumerate() {
        cells.push(Dot { x, y, case: case as u64 }, y);
    }
    (cells.dots(), cells.seen())
}

/// The flight control loops, where the run has curves.
///
/// # Errors
/// Damage in the table.
pub fn loops(run: &Run, population: usize) -> Result<Option<LoopCharts>, Problems> {
    let definition = &run.outline().definition;
    let Some(plan) = definition.margins.as_ref().filter(|plan| !plan.envelope_hz.is_empty()) else {
        return Ok(None);
    };
    let mut envelopes = envelope::envelopes(run, MEMORY)?;
    envelopes.retain(|row| row.population == 0 || row.population == population);
    let median = LEVELS.iter().position(|level| *level == 0.5).expect("the median is a level");
    let mut reference = BTreeMap::new();
    let mut ranges = BTreeMap::new();
    for row in &envelopes {
        let (Some(phase), Some(magnitude)) = (row.phase_deg, row.magnitude_db) else { continue };
        let at = (row.variant, row.axis, row.flight_time, row.frequency_hz.to_bits());
        if row.population == 0 {
            reference.insert(at, phase.quantiles[median]);
        }
        if magnitude.largest > NICHOLS_FLOOR_DB {
            let [x, y] = ranges
                .entry((row.variant, row.axis))
                .or_insert([[f64::INFINITY, f64::NEG_INFINITY]; 2]);
            *x = [x[0].min(phase.smallest), x[1].max(phase.largest)];
            *y = [y[0].min(magnitude.smallest.max(NICHOLS_FLOOR_DB)), y[1].max(magnitude.largest)];
        }
    }
    let nothing = || Cells::new([0.0, 1.0], [0.0, 1.0], [1, 1]);
    let mut cells: Vec<Vec<Cells>> = (plan.variants.iter())
        .map(|&variant| {
            let of = |axis| ranges.get(&(variant, axis)).map(|[x, y]| Cells::new(*x, *y, LARGE));
            (0..AXES.len()).map(|axis| of(axis).unwrap_or_else(nothing)).collect()
        })
        .collect();
    curves(run, plan, population, |[variant, axis, time], hertz, case, [phase, magnitude]| {
        let place = plan.variants.iter().position(|v| *v == variant);
        if let Some(place) = place.filter(|_| magnitude > NICHOLS_FLOOR_DB) {
            let nominal = reference.get(&(variant, axis, time, hertz.to_bits()));
            let phase = nominal.map_or(phase, |nominal| nearest_phase_deg(phase, *nominal));
            // Of a cell the case nearest to a critical point.
            let score = nearest_phase_deg(phase + 180.0, 0.0).hypot(5.0 * magnitude);
            cells[place][axis].push(Dot { x: phase, y: magnitude, case }, score);
        }
    })?;
    let nichols = cells.into_iter().map(|of| of.iter().map(Cells::dots).collect()).collect();
    Ok(Some(LoopCharts { plan: plan.clone(), envelopes, nichols }))
}

/// Hands every stored point of the loops to `visit`: variant, axis and flight time, frequency, case, phase
/// and magnitude.
fn curves(
    run: &Run,
    plan: &LoopPlan,
    population: usize,
    mut visit: impl FnMut([usize; 3], f64, u64, [f64; 2]),
) -> Result<(), Problems> {
    const TABLE: TableName = TableName::LoopCurves;
    let definition = &run.outline().definition;
    let variants: Vec<&str> = definition.variants.iter().map(|v| v.name.as_str()).collect();
    let cases = 0..definition.populations[population].cases;
    debug_assert!(!plan.envelope_hz.is_empty());
    run.batches(
        TABLE,
        |_| true,
        population,
        &cases,
        |batch| {
            let column = |name: &str| batch.column_by_name(name).expect("a column of the registry");
            let numbers = |name: &str| column(name).as_primitive::<Float64Type>();
            let variant = run.words(TABLE, batch, "variant", &variants)?;
            let axis = run.words(TABLE, batch, "axis", &AXES)?;
            let case = column("case").as_primitive::<arrow::datatypes::Int64Type>();
            let (time, hertz) = (numbers("flight_time_s"), numbers("frequency_hz"));
            let (magnitude, phase) = (numbers("magnitude_db"), numbers("phase_deg"));
            for row in 0..batch.num_rows() {
                let times = &definition.flight_times_s;
                let at = times.iter().position(|t| t.to_bits() == time.value(row).to_bits());
                let whole = hertz.is_valid(row) && magnitude.is_valid(row) && phase.is_valid(row);
                if let (Some(variant), Some(axis), Some(time), true) =
                    (variant[row], axis[row], at, whole)
                {
                    let point = [phase.value(row), magnitude.value(row)];
                    visit([variant, axis, time], hertz.value(row), case.value(row) as u64, point);
                }
            }
            Ok(())
        },
    )
}

/// Failed cases of a population, by kind.
///
/// # Errors
/// Damage in the table.
pub fn failures(run: &Run, population: usize) -> Result<Failures, Problems> {
    let mut kinds: BTreeMap<_, u64> = BTreeMap::new();
    let mut failures = Failures::default();
    run.failures(population, |case, failure| {
        *kinds.entry(failure.kind).or_default() += 1;
        failures.count += 1;
        if failures.first.len() < TOLD {
            failures.first.push((case, failure.to_string()));
        }
        Ok(())
    })?;
    failures.kinds =
        kinds.into_iter().map(|(kind, count)| (kind.name().to_owned(), count)).collect();
    Ok(failures)
}

/// Where the numbers of a run come from: name and value.
///
/// # Errors
/// No manifest, or a damaged one.
pub fn provenance(folder: &Path) -> Result<Vec<(String, String)>, Problems> {
    let manifest = Manifest::read(folder)?;
    let (run, execution) = (&manifest.run, &manifest.execution);
    let definition = &run.definition;
    let mut rows: Vec<(String, String)> = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
    row("run", definition.name.clone());
    row("seed", definition.seed.to_string());
    for population in &definition.populations {
        let cases = format!("{} cases, {}", population.cases, population.scheme.describe());
        row(&format!("population {}", population.name), cases);
    }
    row(
        "command",
        format!("tvse run inputs/{} (the copy in the run's folder)", super::inputs::RUN),
    );
    row("program", format!("tvse {}, build {}", execution.maker.program, execution.maker.build));
    row("instruction set", execution.maker.isa.clone());
    row("built for", execution.target.clone());
    row("threads", execution.jobs.to_string());
    row("started", execution.started.clone());
    row("finished", format!("{}, after {:.1} s", execution.finished, execution.duration_s));
    row("schema version", manifest.schema_version.to_string());
    row("identity", run.identity());
    for input in &run.inputs {
        row(&format!("input {}", input.name), format!("BLAKE3 {}", input.blake3));
    }
    for (name, content) in &manifest.tables {
        let value =
            format!("{} rows, {} bytes, BLAKE3 {}", content.rows, content.bytes, content.blake3);
        row(&format!("table {name}"), value);
    }
    Ok(rows)
}
