//! Envelopes of the loops over a campaign, reduced from the stored curves.
//!
//! What an envelope is, is decided in `margins::envelope`; here its values are gathered, in several
//! passes over the table where they do not fit at once.

use super::run::Run;
use super::schema::TableName;
use crate::campaign::LoopPlan;
use crate::margins::AXES;
use crate::margins::envelope::{EnvelopeRow, nearest_phase_deg, spread};
use crate::problem::Problems;
use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;
use arrow::record_batch::RecordBatch;
use std::collections::BTreeMap;

const TABLE: TableName = TableName::LoopCurves;

/// Magnitudes, dB, and phases, degrees, of every case with a curve, by axis and frequency.
type Gathered = Vec<Vec<[f64; 2]>>;

/// Every row of the envelopes, in order; the values held at once take about `memory` bytes.
///
/// # Errors
/// Damage in the table.
pub(super) fn envelopes(run: &Run, memory: usize) -> Result<Vec<EnvelopeRow>, Problems> {
    let definition = &run.outline().definition;
    let Some(plan) = &definition.margins else { return Ok(Vec::new()) };
    let times = 0..definition.flight_times_s.len();
    let pairs: Vec<(usize, usize)> = (plan.variants.iter())
        .flat_map(|&variant| times.clone().map(move |time| (variant, time)))
        .collect();
    // The first case of the first population is the nominal one.
    let nominal = gather(run, plan, 0, &pairs)?;
    let mut rows = Vec::new();
    for (population, p) in definition.populations.iter().enumerate() {
        let bytes = p.cases as usize * AXES.len() * plan.envelope_hz.len() * size_of::<[f64; 2]>();
        for pairs in pairs.chunks((memory / bytes.max(1)).max(1)) {
            for ((variant, flight_time), gathered) in gather(run, plan, population, pairs)? {
                for (slot, values) in gathered.iter().enumerate() {
                    let (axis, index) =
                        (slot / plan.envelope_hz.len(), slot % plan.envelope_hz.len());
                    let reference = nominal[&(variant, flight_time)][slot].first().map(|v| v[1]);
                    let magnitudes: Vec<f64> =
                        values.iter().map(|v| v[0]).filter(|v| v.is_finite()).collect();
                    let phases: Vec<f64> = (values.iter())
                        .map(|v| reference.map_or(v[1], |nominal| nearest_phase_deg(v[1], nominal)))
                        .collect();
                    let summed = |values: &[f64]| {
                        spread(values)
                            .map_err(|error| run.damage(TABLE, error.to_string(), "finite numbers"))
                    };
                    rows.push(EnvelopeRow {
                        population,
                        variant,
                        flight_time,
                        axis,
                        frequency_hz: plan.envelope_hz[index],
                        cases: values.len() as u64,
                        magnitude_db: summed(&magnitudes)?,
                        phase_deg: summed(&phases)?,
                    });
                }
            }
        }
    }
    Ok(rows)
}

/// The curves of some variants and flight times in a population; magnitudes of nothing are −∞.
fn gather(
    run: &Run,
    plan: &LoopPlan,
    population: usize,
    pairs: &[(usize, usize)],
) -> Result<BTreeMap<(usize, usize), Gathered>, Problems> {
    let definition = &run.outline().definition;
    let variants: Vec<&str> = definition.variants.iter().map(|v| v.name.as_str()).collect();
    let empty = || vec![Vec::new(); AXES.len() * plan.envelope_hz.len()];
    let mut gathered: BTreeMap<_, Gathered> = pairs.iter().map(|pair| (*pair, empty())).collect();
    let cases = 0..definition.populations[population].cases;
    run.batches(
        TABLE,
        |_| true,
        population,
        &cases,
        |batch: &RecordBatch| {
            let column = |name: &str| batch.column_by_name(name).expect("a column of the registry");
            let numbers = |name: &str| column(name).as_primitive::<Float64Type>();
            let variant = run.words(TABLE, batch, "variant", &variants)?;
            let axis = run.words(TABLE, batch, "axis", &AXES)?;
            let (time, hertz) = (numbers("flight_time_s"), numbers("frequency_hz"));
            let (magnitude, phase) = (numbers("magnitude_db"), numbers("phase_deg"));
            for row in 0..batch.num_rows() {
                if !hertz.is_valid(row) {
                    continue;
                }
                let equal = |a: &f64, b: f64| a.to_bits() == b.to_bits();
                let times = &definition.flight_times_s;
                let flight_time = times.iter().position(|t| equal(t, time.value(row)));
                let hertz = hertz.value(row);
                let index = (plan.envelope_hz.binary_search_by(|f| f.total_cmp(&hertz))).ok();
                let (Some(variant), Some(axis), Some(flight_time), Some(index), true) =
                    (variant[row], axis[row], flight_time, index, phase.is_valid(row))
                else {
                    return Err(run.damage(
                        TABLE,
                        "a row of no curve",
                        "an evaluation and a frequency",
                    ));
                };
                if let Some(gathered) = gathered.get_mut(&(variant, flight_time)) {
                    let size = if magnitude.is_valid(row) {
                        magnitude.value(row)
                    } else {
                        f64::NEG_INFINITY
                    };
                    let slot = axis * plan.envelope_hz.len() + index;
                    gathered[slot].push([size, phase.value(row)]);
                }
            }
            Ok(())
        },
    )?;
    Ok(gathered)
}
