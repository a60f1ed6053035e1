//! The flat rows of a record: one per stored pole, or per named mode of a failed evaluation.
//!
//! How rows become columns is decided in `io`.

use super::definition::Definition;
use super::loop_metric;
use super::loops::{CurvePoint, Loops, NamedPeak};
use super::metric::ReducedCase;
use super::record::{Failure, Pole, Record, Solution};
use crate::margins::{AXES, AxisMargins};

/// One row of the `cases` table.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseRow {
    /// Index of the population.
    pub population: usize,
    /// Case index inside the population.
    pub case: u64,
    /// Drawn value per draw key, NaN where it stays nominal; empty if the case panicked.
    pub values: Vec<Option<f64>>,
    /// Normal score per draw key, NaN where there is none; empty if the case panicked.
    pub scores: Vec<Option<f64>>,
    /// What the scalar metrics are taken from.
    pub reduced: ReducedCase,
    /// Values of the loop metrics, in the order of their registry.
    pub loops: Vec<Option<f64>>,
    /// The first failure of the case.
    pub failure: Option<Failure>,
}

/// One row of the `modes` table.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeRow {
    /// Index of the population.
    pub population: usize,
    /// Case index inside the population.
    pub case: u64,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the flight time.
    pub flight_time: usize,
    /// Number of poles at the origin known by construction, beside those solved for.
    pub null_poles: usize,
    /// How the poles of the evaluation were found; none where they were not.
    pub solution: Option<Solution>,
    /// Index of the named mode; none for a pole that belongs to no named mode.
    pub mode: Option<usize>,
    /// The pole, or why there is none.
    pub outcome: Result<Pole, Failure>,
}

/// One row of a table of loops: a fact about one axis of one evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopRow<T> {
    /// Index of the population.
    pub population: usize,
    /// Case index inside the population.
    pub case: u64,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the flight time.
    pub flight_time: usize,
    /// Index of the axis.
    pub axis: usize,
    /// The fact.
    pub fact: T,
}

/// Margins of an axis and the closed loop's unstable poles, or why there are none.
pub type Margins = Result<(AxisMargins, i64), Failure>;

/// A row of `margins`.
pub type MarginRow = LoopRow<Margins>;
/// A row of `loop_modes`: a resonance, none where the axis has none.
pub type PeakRow = LoopRow<Option<NamedPeak>>;
/// A row of `loop_curves`: index of a frequency and the loop there, none where the evaluation failed.
pub type CurveRow = LoopRow<Option<(usize, CurvePoint)>>;

/// The rows of a record in the tables of loops.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoopRows {
    /// `margins`: every axis of every assessed evaluation.
    pub margins: Vec<MarginRow>,
    /// `loop_modes`: resonances by axis; one row without where there is none.
    pub peaks: Vec<PeakRow>,
    /// `loop_curves`: by axis the index of a frequency and the loop there; one row without where the
    /// evaluation failed.
    pub curves: Vec<CurveRow>,
}

/// Every item, or `None` once where there are none.
fn or_none<T>(items: impl Iterator<Item = T>) -> impl Iterator<Item = Option<T>> {
    let mut items = items.peekable();
    let none = items.peek().is_none().then_some(None);
    items.map(Some).chain(none)
}

/// The rows of a record's loops.
pub fn loop_rows(record: &Record) -> LoopRows {
    let mut rows = LoopRows::default();
    let (population, case) = (record.population, record.case);
    for evaluation in &record.evaluations {
        let Some(loops) = &evaluation.loops else { continue };
        let (variant, flight_time) = (evaluation.variant, evaluation.flight_time);
        fn row<T>(
            [population, variant, flight_time, axis]: [usize; 4],
            case: u64,
            fact: T,
        ) -> LoopRow<T> {
            LoopRow { population, case, variant, flight_time, axis, fact }
        }
        let at = |axis: usize| [population, variant, flight_time, axis];
        for axis in 0..AXES.len() {
            let of_axis = |loops: &Loops| (loops.axes[axis], loops.unstable);
            rows.margins.push(row(
                at(axis),
                case,
                loops.as_ref().map(of_axis).map_err(Failure::clone),
            ));
            let peaks = loops.iter().flat_map(|loops| &loops.peaks);
            let of_axis = peaks.filter(|named| named.peak.axis == axis).cloned();
            rows.peaks.extend(or_none(of_axis).map(|peak| row(at(axis), case, peak)));
            let curve = loops.iter().flat_map(|loops| &loops.curve);
            let of_axis = curve.map(|points| points[axis]).enumerate();
            rows.curves.extend(or_none(of_axis).map(|point| row(at(axis), case, point)));
        }
    }
    rows
}

/// The rows of a record.
pub fn rows(definition: &Definition, record: Record) -> (CaseRow, Vec<ModeRow>) {
    let (population, case) = (record.population, record.case);
    let reduced = ReducedCase::new(definition, &record);
    let loops = loop_metric::values(definition, &record);
    let failure = record.failure().cloned();
    let mut modes = Vec::new();
    for evaluation in record.evaluations {
        let (variant, flight_time) = (evaluation.variant, evaluation.flight_time);
        let (null_poles, solution) = (evaluation.null_poles, evaluation.solution);
        let row = |mode, outcome| ModeRow {
            population,
            case,
            variant,
            flight_time,
            null_poles,
            solution,
            mode,
            outcome,
        };
        match evaluation.outcome {
            Ok(poles) => modes.extend(poles.into_iter().map(|pole| row(pole.mode, Ok(pole)))),
            Err(failure) => modes.extend(
                (0..definition.modes.len()).map(|mode| row(Some(mode), Err(failure.clone()))),
            ),
        }
    }
    let (values, scores) = (record.values, record.scores);
    (CaseRow { population, case, values, scores, reduced, loops, failure }, modes)
}

#[cfg(test)]
mod tests {
    use super::super::synthetic;
    use super::*;

    #[test]
    fn a_failed_evaluation_gives_one_row_for_each_named_mode() {
        let definition = synthetic::definition(&[20]);
        let (case, modes) = rows(&definition, synthetic::record(&definition, 0, 11));
        assert_eq!(case.failure.unwrap().kind.name(), "draw");
        // Two flight times, two variants, two named modes.
        assert_eq!(modes.len(), 8);
        assert!(modes.iter().all(|row| row.outcome.is_err() && row.mode.is_some()));
    }

    #[test]
    fn every_pole_of_an_evaluation_is_a_row() {
        let definition = synthetic::definition(&[20]);
        let record = synthetic::record(&definition, 0, 2);
        let poles: usize = record.evaluations.iter().flat_map(|e| &e.outcome).map(Vec::len).sum();
        assert_eq!(rows(&definition, record).1.len(), poles);
    }
}
