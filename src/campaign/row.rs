//! The flat rows of a record: one per stored pole, or per named mode of a failed evaluation.
//!
//! How rows become columns is decided in `io`.

use super::definition::Definition;
use super::metric::ReducedCase;
use super::record::{Failure, Pole, Record};

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
    /// Index of the named mode; none for a pole that belongs to no named mode.
    pub mode: Option<usize>,
    /// The pole, or why there is none.
    pub outcome: Result<Pole, Failure>,
}

/// The rows of a record.
pub fn rows(definition: &Definition, record: Record) -> (CaseRow, Vec<ModeRow>) {
    let (population, case) = (record.population, record.case);
    let reduced = ReducedCase::new(definition, &record);
    let failure = record.failure().cloned();
    let mut modes = Vec::new();
    for evaluation in record.evaluations {
        let (variant, flight_time) = (evaluation.variant, evaluation.flight_time);
        let null_poles = evaluation.null_poles;
        let row = |mode, outcome| ModeRow {
            population,
            case,
            variant,
            flight_time,
            null_poles,
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
    (CaseRow { population, case, values, scores, reduced, failure }, modes)
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
