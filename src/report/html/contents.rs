//! What a report is made of: values gathered from a run, not yet drawn.
//!
//! They are read in `io::report`; nothing here is text.

use crate::campaign::feedback::Added;
use crate::campaign::influence::Influence;
use crate::campaign::sensitivity::Ranking;
use crate::campaign::statistics::Line;
use crate::campaign::summary::{SummaryRow, WorstRow};
use crate::campaign::worst::{Aim, WorstCase};
use crate::campaign::{LoopPlan, Outline};
use crate::gate::{Gate, Outcome};
use crate::margins::envelope::EnvelopeRow;
use crate::report::chart::Dot;
use nalgebra::Vector3;

/// Poles of a named mode at a flight time, by variant.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    /// Index of the mode.
    pub mode: usize,
    /// Index of the flight time.
    pub flight_time: usize,
    /// Least and greatest real part over all variants, rad/s.
    pub re_rad_s: [f64; 2],
    /// Least and greatest imaginary part, rad/s.
    pub im_rad_s: [f64; 2],
    /// By variant.
    pub variants: Vec<CloudVariant>,
}

/// Poles of a variant: one for each small cell of the plane that holds one, the least damped.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudVariant {
    /// Poles of the nominal case.
    pub nominal: Vec<Dot>,
    /// Poles of the cases.
    pub dots: Vec<Dot>,
    /// Poles that these stand for.
    pub seen: u64,
    /// The least damping ratio, −, and its case.
    pub least: Option<(f64, u64)>,
}

/// A value for each case, ascending; thinned between its tails.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Distribution {
    /// Value, rank from 0, case.
    pub points: Vec<(f64, u64, u64)>,
    /// Cases with a value.
    pub known: u64,
    /// Cases without one, which failed.
    pub failed: u64,
}

impl Distribution {
    /// Points kept at either end, and between them.
    const TAIL: usize = 100;
    const MIDDLE: usize = 300;

    /// Of values by case index; NaN for a case without one.
    pub fn of(values: impl IntoIterator<Item = (u64, f64)>) -> Self {
        let (mut known, mut failed) = (Vec::new(), 0);
        for (case, value) in values {
            if value.is_finite() {
                known.push((value, case));
            } else {
                failed += 1;
            }
        }
        known.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let count = known.len();
        let step = (count / Self::MIDDLE).max(1);
        let kept = |rank: &usize| {
            *rank < Self::TAIL || *rank + Self::TAIL >= count || rank.is_multiple_of(step)
        };
        let points =
            (0..count).filter(kept).map(|rank| (known[rank].0, rank as u64, known[rank].1));
        Self { points: points.collect(), known: count as u64, failed }
    }
}

/// Smallest damping ratio over the flight times, by case.
#[derive(Debug, Clone, PartialEq)]
pub struct Least {
    /// Index of the variant.
    pub variant: usize,
    /// Index of the mode.
    pub mode: usize,
    /// The distribution, −.
    pub values: Distribution,
    /// Order-statistic bound: coverage, consumer's risk asked for, exceedances allowed, bound; none where
    /// the cases are no independent draws, too few, or so many failed that it lies among them.
    pub bound: Option<Bound>,
}

/// An order-statistic bound from below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Share of the population that lies above.
    pub coverage: f64,
    /// Consumer's risk of the statement, at most.
    pub risk: f64,
    /// Cases that may lie below.
    pub exceedances: u64,
    /// The bound, −.
    pub value: f64,
}

/// A gate, what it found, and the values it looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Gated {
    /// The gate.
    pub gate: Gate,
    /// What it found.
    pub outcome: Outcome,
    /// Its values.
    pub values: Distribution,
}

/// Damping that a variant adds to that of the first on the same draws.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Index of the variant.
    pub variant: usize,
    /// Index of the mode.
    pub mode: usize,
    /// Whether the variant differs from the first in its feedback alone.
    pub feedback: bool,
    /// Smallest damping ratio of the first variant and smallest gain of each case, −; thinned to cells.
    pub dots: Vec<Dot>,
    /// Cases that these stand for.
    pub seen: u64,
}

/// The flight control loops of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopCharts {
    /// What was assessed.
    pub plan: LoopPlan,
    /// Rows of the envelopes, of the nominal and of the chosen population.
    pub envelopes: Vec<EnvelopeRow>,
    /// By position in `plan.variants` and axis: phase, degrees, and magnitude, dB, of the cases.
    pub nichols: Vec<Vec<Vec<Dot>>>,
}

/// Motion of a mode of the nominal vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Index of the mode.
    pub mode: usize,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the flight time.
    pub flight_time: usize,
    /// The pole, rad/s: real and imaginary part.
    pub pole_rad_s: [f64; 2],
    /// Lines of grids, as places in `rest_m`.
    pub lines: Vec<Vec<usize>>,
    /// Grids at rest, m.
    pub rest_m: Vec<Vector3<f64>>,
    /// Real and imaginary part of their displacement, greatest modulus one.
    pub motion: Vec<[Vector3<f64>; 2]>,
    /// Grids at which the rotation is shown, with its real and imaginary part, rad per unit of the greatest
    /// displacement in m.
    pub ribs: Vec<(usize, [Vector3<f64>; 2])>,
    /// Gimballed nozzles.
    pub nozzles: Vec<Swing>,
}

/// A nozzle in the motion of a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Swing {
    /// Name of the engine.
    pub engine: String,
    /// Place of its gimbal in `rest_m`.
    pub grid: usize,
    /// From the pivot to the exit at rest, m.
    pub axis_m: Vector3<f64>,
    /// Real and imaginary part of its rotation relative to the structure, rad per unit of the greatest
    /// displacement in m.
    pub angle_rad_m: [Vector3<f64>; 2],
    /// Real and imaginary part of the rotation of the structure there, likewise.
    pub structure_rad_m: [Vector3<f64>; 2],
}

/// What one σ of each draw does to the damping ratio of a mode, from the derivatives of the cases.
#[derive(Debug, Clone, PartialEq)]
pub struct Influenced {
    /// Index of the variant.
    pub variant: usize,
    /// Index of the flight time.
    pub flight_time: usize,
    /// Index of the mode.
    pub mode: usize,
    /// Cases, and those of them near veering.
    pub cases: [u64; 2],
    /// The draws, the most influential first.
    pub ranking: Vec<Influence>,
}

/// Failed cases of a population.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Failures {
    /// Number of each kind.
    pub kinds: Vec<(String, u64)>,
    /// The first ones: case and message.
    pub first: Vec<(u64, String)>,
    /// All of them.
    pub count: u64,
}

/// A metric of two runs on the same draws.
#[derive(Debug, Clone, PartialEq)]
pub struct PairedMetric {
    /// Column.
    pub name: String,
    /// Values of the second run and differences, thinned to cells.
    pub dots: Vec<Dot>,
    /// Pairs that these stand for.
    pub seen: u64,
    /// The differences.
    pub differences: Distribution,
    /// Their statistics.
    pub lines: Vec<Line>,
}

/// Another run on the same draws.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Folder of the other run.
    pub folder: String,
    /// Its outline.
    pub outline: Outline,
    /// Its summary.
    pub summary: Vec<SummaryRow>,
    /// Cases and draw keys in common.
    pub common: (usize, usize),
    /// Metrics of both.
    pub metrics: Vec<PairedMetric>,
    /// Its provenance.
    pub provenance: Vec<(String, String)>,
}

/// All that a report shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// Folder of the run, as the user named it.
    pub folder: String,
    /// Whether the report lies in that folder, so that it can link to what lies there.
    pub beside: bool,
    /// Name of the vehicle, as its file has it.
    pub vehicle: Option<String>,
    /// Structural damping ratio of the nominal vehicle, −.
    pub structural_damping: Option<f64>,
    /// The run.
    pub outline: Outline,
    /// Index of the population that is shown.
    pub population: usize,
    /// Rows of the summary.
    pub summary: Vec<SummaryRow>,
    /// The worst cases.
    pub worst: Vec<WorstRow>,
    /// Poles by mode and flight time.
    pub clouds: Vec<Cloud>,
    /// Smallest damping ratios by variant and mode.
    pub least: Vec<Least>,
    /// Gates, where they were given.
    pub gates: Vec<Gated>,
    /// Rankings of the draws by metric, with the number of cases they were made from; or why there are none.
    pub rankings: Result<Vec<(String, usize, Ranking)>, String>,
    /// Influences of the draws, where the run stores derivatives.
    pub influences: Vec<Influenced>,
    /// Worst-on-worst cases that were searched for.
    pub searched: Vec<(Aim, Vec<WorstCase>)>,
    /// Damping gained over the first variant.
    pub gains: Vec<Gain>,
    /// What feedback adds, in words.
    pub feedback: Vec<Added>,
    /// Loops.
    pub loops: Option<LoopCharts>,
    /// Modes on the vehicle.
    pub shapes: Vec<Shape>,
    /// Failed cases.
    pub failures: Failures,
    /// Seed, digests, program, …: name and value.
    pub provenance: Vec<(String, String)>,
    /// Another run.
    pub comparison: Option<Comparison>,
}

impl Contents {
    /// Rows of the summary of the shown population at a place.
    pub fn row(
        &self,
        variant: usize,
        mode: usize,
        flight_time: Option<usize>,
    ) -> Option<&SummaryRow> {
        row(&self.summary, [self.population, variant, mode], flight_time)
    }

    /// The nominal row at a place.
    pub fn nominal(
        &self,
        variant: usize,
        mode: usize,
        flight_time: Option<usize>,
    ) -> Option<&SummaryRow> {
        row(&self.summary, [0, variant, mode], flight_time).filter(|row| row.cases == 1)
    }

    /// The flight time that shows most: the least damped nominal or median vehicle of a mode.
    pub fn focus(&self, mode: usize) -> (usize, usize) {
        focus(&self.outline, &self.summary, self.population, mode)
    }
}

fn row(
    rows: &[SummaryRow],
    [population, variant, mode]: [usize; 3],
    flight_time: Option<usize>,
) -> Option<&SummaryRow> {
    rows.iter().find(|row| {
        let group = &row.group;
        (group.population, group.variant, group.mode, group.flight_time, group.outer)
            == (population, variant, mode, flight_time, None)
    })
}

/// Variant and flight time of the least mean damping ratio of a mode.
pub fn focus(
    outline: &Outline,
    summary: &[SummaryRow],
    population: usize,
    mode: usize,
) -> (usize, usize) {
    let definition = &outline.definition;
    let mut best = (f64::INFINITY, (0, 0));
    for variant in 0..definition.variants.len() {
        for time in 0..definition.flight_times_s.len() {
            let found = row(summary, [population, variant, mode], Some(time));
            if let Some(spread) = found.and_then(|row| row.damping_ratio.as_ref())
                && spread.mean < best.0
            {
                best = (spread.mean, (variant, time));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_keeps_its_tails_and_counts_its_failures() {
        let values =
            (0..100_000).map(|case| (case, if case == 7 { f64::NAN } else { -(case as f64) }));
        let found = Distribution::of(values);
        assert_eq!((found.known, found.failed), (99_999, 1));
        assert!(found.points.len() < 700, "{}", found.points.len());
        assert_eq!(found.points[0], (-99_999.0, 0, 99_999));
        assert_eq!(found.points[99].1, 99);
        assert_eq!(found.points.last(), Some(&(0.0, 99_998, 0)));
    }
}
