//! Curves of the loops of one case on disk: flat Parquet or CSV, by the name of the file.
//!
//! What a curve is, is decided in `margins`; which case it is of, in `cli`.

use super::flat::{Column, Holds, Layout, Table};
use super::{files, table};
use crate::margins::{AXES, Curve, loops::decibels};
use crate::problem::Problems;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

const COLUMNS: Layout = Layout {
    name: "response",
    columns: &[
        Column("variant", Holds::Text, "Way of evaluating the draws"),
        Column("flight_time_s", Holds::Number("s"), "Flight time"),
        Column("axis", Holds::Text, "Axis at whose command the loop is broken, the others closed"),
        Column("frequency_hz", Holds::Number("Hz"), "Frequency"),
        Column("re", Holds::Number("1"), "Real part of the loop L; -1 is the critical point"),
        Column("im", Holds::Number("1"), "Imaginary part of L"),
        Column("magnitude_db", Holds::Number("dB"), "Magnitude of L"),
        Column("phase_deg", Holds::Number("deg"), "Phase of L, unwrapped from low frequency"),
    ],
};

/// The curves of evaluations, one after the other.
pub struct Response(Table);

impl Default for Response {
    fn default() -> Self {
        Self(Table::new(&COLUMNS))
    }
}

impl Response {
    /// Adds the curve of an evaluation; an axis without feedback has none.
    pub fn add(&mut self, variant: &str, flight_time_s: f64, curve: &Curve) {
        for (index, axis) in AXES.iter().enumerate() {
            let samples = curve.samples.iter().zip(&curve.phase_deg);
            for (sample, phase) in samples.filter(|(sample, _)| sample.place >= 1.0) {
                let l = sample.broken[index];
                if l.norm_sqr() > 0.0 {
                    let hertz = sample.omega_rad_s() / TAU;
                    let numbers = [flight_time_s, hertz, l.re, l.im, decibels(l), phase[index]];
                    self.0.push(&[variant, axis], &numbers);
                }
            }
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.0.rows()
    }

    /// The rows as comma-separated values, with a line of column names.
    pub fn to_csv(&self) -> String {
        let names: Vec<&str> = COLUMNS.columns.iter().map(|column| column.0).collect();
        let mut csv = names.join(",") + "\n";
        let (variants, axes) = (self.0.texts(0), self.0.texts(2));
        for (row, (variant, axis)) in variants.zip(axes).enumerate() {
            let number = |column: usize| self.0.numbers(column)[row];
            let _ = write!(csv, "{variant},{},{axis}", number(1));
            for column in 3..8 {
                let _ = write!(csv, ",{}", number(column));
            }
            csv.push('\n');
        }
        csv
    }

    /// Writes the rows to `target`, as Parquet where its name ends so, else as comma-separated values.
    ///
    /// # Errors
    /// An input problem if it cannot be written.
    pub fn write(&self, target: &Path) -> Result<(), Problems> {
        if target.extension().is_some_and(|extension| extension == "parquet") {
            let bytes =
                self.0.to_bytes(&COLUMNS).map_err(|error| table::problem(target, &error))?;
            return files::write(target, &bytes);
        }
        files::write(target, self.to_csv().as_bytes())
    }
}
