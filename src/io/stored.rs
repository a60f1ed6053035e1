//! Batches of a stored table decoded to rows again.
//!
//! The inverse of `schema`; which batches are read is decided in `run`.

use super::run::Run;
use super::schema::{self, TableName};
use crate::campaign::Sensitivity;
use crate::campaign::definition::Solver;
use crate::campaign::record::{Branch, Certificate, Failure, FailureKind, Pole, Solution};
use crate::campaign::row::ModeRow;
use crate::dynamics::Part;
use crate::problem::Problems;
use arrow::array::{Array, AsArray};
use arrow::datatypes::{Float64Type, Int32Type, Int64Type};
use arrow::record_batch::RecordBatch;
use nalgebra::Complex;

/// The pole of a named mode in a row of the `modes` table; none if the evaluation failed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PoleRow {
    /// Case index.
    pub case: u64,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the flight time.
    pub flight_time: usize,
    /// Index of the named mode.
    pub mode: usize,
    /// The pole, rad/s.
    pub pole: Option<Complex<f64>>,
}

/// Columns that [`Run::pole_rows`] reads.
pub(super) const POLE_COLUMNS: [&str; 6] =
    ["case", "variant", "flight_time_s", "mode", "pole_re_rad_s", "pole_im_rad_s"];

impl Run {
    /// A column of words by their indices.
    pub(super) fn words(
        &self,
        table: TableName,
        batch: &RecordBatch,
        name: &str,
        words: &[&str],
    ) -> Result<Vec<Option<usize>>, Problems> {
        let column = batch.column_by_name(name).expect("a column of the registry");
        let array = column.as_dictionary::<Int32Type>();
        let known: Vec<Option<usize>> = array
            .values()
            .as_string::<i32>()
            .iter()
            .map(|word| words.iter().position(|known| Some(*known) == word))
            .collect();
        let index = |row: usize| match array.key(row) {
            None => Ok(None),
            Some(key) => known.get(key).copied().flatten().map(Some).ok_or_else(|| {
                let allowed = format!("one of {} in {name}", words.join(", "));
                self.damage(table, "a word that the run does not know", allowed)
            }),
        };
        (0..batch.num_rows()).map(index).collect()
    }

    /// The poles of a batch of the `modes` table that belong to named modes.
    pub(super) fn pole_rows(&self, batch: &RecordBatch) -> Result<Vec<PoleRow>, Problems> {
        let definition = &self.outline().definition;
        let column = |name: &str| batch.column_by_name(name).expect("a column of the registry");
        let words = |name: &str, words: &[&str]| self.words(TableName::Modes, batch, name, words);
        let number = |name: &str| column(name).as_primitive::<Float64Type>();
        let variants: Vec<&str> = definition.variants.iter().map(|v| v.name.as_str()).collect();
        let modes: Vec<&str> = definition.modes.iter().map(String::as_str).collect();
        let (variant, mode) = (words("variant", &variants)?, words("mode", &modes)?);
        let case = column("case").as_primitive::<Int64Type>();
        let (re, im) = (number("pole_re_rad_s"), number("pole_im_rad_s"));
        let time = number("flight_time_s");
        let times = &definition.flight_times_s;
        let mut rows = Vec::with_capacity(batch.num_rows());
        for row in 0..batch.num_rows() {
            let flight_time = times
                .iter()
                .position(|t| time.is_valid(row) && t.to_bits() == time.value(row).to_bits());
            let (Some(variant), Some(flight_time), true) =
                (variant[row], flight_time, case.is_valid(row))
            else {
                let allowed = "case, variant and time";
                return Err(self.damage(TableName::Modes, "a row of no evaluation", allowed));
            };
            if let Some(mode) = mode[row] {
                let whole = re.is_valid(row) && im.is_valid(row);
                let pole = whole.then(|| Complex::new(re.value(row), im.value(row)));
                let case = case.value(row) as u64;
                rows.push(PoleRow { case, variant, flight_time, mode, pole });
            }
        }
        Ok(rows)
    }

    /// The rows of a batch of the `modes` table, every column read.
    pub(super) fn mode_rows(&self, batch: &RecordBatch) -> Result<Vec<ModeRow>, Problems> {
        let definition = &self.outline().definition;
        let column = |name: &str| batch.column_by_name(name).expect("a column of the registry");
        let words = |name: &str, words: &[&str]| self.words(TableName::Modes, batch, name, words);
        let populations: Vec<&str> =
            definition.populations.iter().map(|p| p.name.as_str()).collect();
        let variants: Vec<&str> = definition.variants.iter().map(|v| v.name.as_str()).collect();
        let modes: Vec<&str> = definition.modes.iter().map(String::as_str).collect();
        let population = words("population", &populations)?;
        let variant = words("variant", &variants)?;
        let mode = words("mode", &modes)?;
        let branch = words("branch", &schema::BRANCHES.map(Branch::name))?;
        let solver = words("solver", &Solver::ALL.map(Solver::name))?;
        let certificate = words("certificate", &Certificate::ALL.map(Certificate::name))?;
        let determinants = column("determinants").as_primitive::<Int64Type>();
        let status = words("status", &schema::statuses().collect::<Vec<_>>())?;
        let case = column("case").as_primitive::<Int64Type>();
        let time = column("flight_time_s").as_primitive::<Float64Type>();
        let null_poles = column("null_poles").as_primitive::<Int64Type>();
        let (label, message) = (column("label"), column("failure_message"));
        let text = |array: &dyn Array, row: usize| {
            let array = array.as_string::<i32>();
            array.is_valid(row).then(|| array.value(row).to_owned())
        };
        let number = |name: &str, row: usize| {
            let array = column(name).as_primitive::<Float64Type>();
            array.is_valid(row).then(|| array.value(row))
        };
        let participation = |row: usize| {
            let mut shares = [0.0; Part::ALL.len()];
            for (share, part) in shares.iter_mut().zip(Part::ALL) {
                *share = number(schema::participation_name(part), row)?;
            }
            Some(shares)
        };
        let stored = definition.sensitivity.is_some();
        let flags = if stored { words("sensitivity", &schema::SENSITIVITIES)? } else { Vec::new() };
        let draws = &self.outline().draws;
        let sensitivity = |row: usize| {
            flags.get(row).copied().flatten()?;
            let read = |name: String| number(&name, row);
            Some(Box::new(Sensitivity {
                damping_ratio: draws.iter().map(|draw| read(draw.damping_column())).collect(),
                real_part_rad_s: draws.iter().map(|draw| read(draw.real_column())).collect(),
                curvature: number("sensitivity_curvature", row),
            }))
        };
        let mut rows = Vec::with_capacity(batch.num_rows());
        for row in 0..batch.num_rows() {
            let damage = |found: &str, allowed: &str| self.damage(TableName::Modes, found, allowed);
            let flight_time = definition
                .flight_times_s
                .iter()
                .position(|t| time.is_valid(row) && t.to_bits() == time.value(row).to_bits());
            let (Some(population), Some(variant), Some(flight_time), true) =
                (population[row], variant[row], flight_time, case.is_valid(row))
            else {
                return Err(damage("a row of no evaluation", "population, case, variant and time"));
            };
            let outcome = match status[row] {
                Some(0) => {
                    let (Some(re), Some(im), Some(branch)) =
                        (number("pole_re_rad_s", row), number("pole_im_rad_s", row), branch[row])
                    else {
                        return Err(damage("a row without its pole", "a pole where status is ok"));
                    };
                    Ok(Pole {
                        mode: mode[row],
                        branch: schema::BRANCHES[branch],
                        label: text(label, row),
                        value: Complex::new(re, im),
                        identity_confidence: number("identity_confidence", row),
                        participation: participation(row),
                        residual: number("residual", row),
                        error_bound: number("pole_error_bound_rad_s", row),
                        sensitivity: sensitivity(row),
                    })
                }
                Some(failed) => Err(Failure::new(
                    FailureKind::ALL[failed - 1],
                    text(message, row).unwrap_or_default(),
                )),
                None => return Err(damage("a row without a status", "ok or a failure")),
            };
            let case = case.value(row) as u64;
            let (mode, null_poles) = (mode[row], null_poles.value(row) as usize);
            let solution =
                solver[row].zip(certificate[row]).map(|(solver, certificate)| Solution {
                    solver: Solver::ALL[solver],
                    certificate: Certificate::ALL[certificate],
                    determinants: determinants.value(row) as usize,
                });
            rows.push(ModeRow {
                population,
                case,
                variant,
                flight_time,
                null_poles,
                solution,
                mode,
                outcome,
            });
        }
        Ok(rows)
    }
}
