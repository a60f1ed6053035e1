//! The replay of a case on disk: matrices, poles and eigenvectors as flat Parquet.
//!
//! What a case is evaluates `campaign`; whether it agrees with the stored rows is decided in `cli`.

use super::flat::{Column, Holds, Layout, Table};
use super::folder;
use crate::campaign::evaluator::View;
use crate::campaign::{Definition, Failure, FailureKind};
use crate::modal::{Reference, Solver, eigen};
use crate::problem::Problems;
use std::path::{Path, PathBuf};

const TIME: Column = Column("flight_time_s", Holds::Number("s"), "Flight time");
const VARIANT: Column = Column("variant", Holds::Text, "Way of evaluating the draws");
const POLE: Column =
    Column("pole", Holds::Number("1"), "Number of the pole in its evaluation, from 0");

/// Nonzero entries of the matrices.
const MATRICES: Layout = Layout {
    name: "matrices",
    columns: &[
        TIME,
        VARIANT,
        Column(
            "matrix",
            Holds::Text,
            "M, D, K of M q'' + D q' + K q = 0, or A of x' = A x with x = [q, q']",
        ),
        Column("row_name", Holds::Text, "Coordinate or state of the row"),
        Column("column_name", Holds::Text, "Coordinate or state of the column"),
        Column("row", Holds::Number("1"), "Row, from 0"),
        Column("column", Holds::Number("1"), "Column, from 0"),
        Column("value", Holds::Number("SI"), "Entry, SI units; entries that are zero are left out"),
    ],
};

/// Poles, each complex pair by its member in the upper half plane.
const POLES: Layout = Layout {
    name: "poles",
    columns: &[
        TIME,
        VARIANT,
        POLE,
        Column("pole_re_rad_s", Holds::Number("rad/s"), "Real part"),
        Column("pole_im_rad_s", Holds::Number("rad/s"), "Imaginary part"),
        Column("residual", Holds::Number("1"), "Relative residual of the eigenpair"),
    ],
};

/// Eigenvectors of A.
const VECTORS: Layout = Layout {
    name: "vectors",
    columns: &[
        TIME,
        VARIANT,
        Column("state", Holds::Text, "State: a coordinate, or its rate with the prefix `d.`"),
        POLE,
        Column("right_re", Holds::Number("1"), "Right eigenvector v, A v = s v: real part"),
        Column("right_im", Holds::Number("1"), "Right eigenvector: imaginary part"),
        Column(
            "left_re",
            Holds::Number("1"),
            "Left eigenvector w, w^H A = s w^H, w^H v = 1: real part",
        ),
        Column("left_im", Holds::Number("1"), "Left eigenvector: imaginary part"),
    ],
};

/// The tables of a replay, filled one evaluation after the other.
pub struct Replay {
    matrices: Table,
    poles: Table,
    vectors: Table,
}

impl Default for Replay {
    fn default() -> Self {
        Self {
            matrices: Table::new(&MATRICES),
            poles: Table::new(&POLES),
            vectors: Table::new(&VECTORS),
        }
    }
}

impl Replay {
    /// Adds an evaluation; one whose vehicle could not be drawn has nothing to add.
    ///
    /// # Errors
    /// Why its eigenproblem has no solution.
    pub fn add(&mut self, definition: &Definition, view: &View<'_>) -> Result<(), Failure> {
        let failed = view.evaluation.outcome.as_ref().err().map(|failure| failure.kind);
        if matches!(failed, Some(FailureKind::Draw | FailureKind::Build)) {
            return Ok(());
        }
        let variant = definition.variants[view.evaluation.variant].name.as_str();
        let time = definition.flight_times_s[view.evaluation.flight_time];
        let layout = &view.plant.layout;
        let names = layout.state_names(&view.model.null_states);
        let coordinates: Vec<String> = (0..layout.coordinates()).map(|c| layout.name(c)).collect();
        let size = layout.coordinates();
        let mut solver = Solver::new(size);
        let model = view.model;
        let failure = |error: eigen::Error| Failure::from(&error);
        let state = solver.state_matrix(model).map_err(failure)?.clone();
        let mut matrix = |name: &str, names: &[String], entry: &dyn Fn(usize, usize) -> f64| {
            for row in 0..names.len() {
                for column in 0..names.len() {
                    let value = entry(row, column);
                    if value != 0.0 {
                        let texts = [variant, name, &names[row], &names[column]];
                        let numbers = [time, row as f64, column as f64, value];
                        self.matrices.push(&texts, &numbers);
                    }
                }
            }
        };
        matrix("M", &coordinates, &|i, j| model.mass[(i, j)]);
        matrix("D", &coordinates, &|i, j| model.damping[(i, j)]);
        matrix("K", &coordinates, &|i, j| model.stiffness[(i, j)]);
        matrix("A", &names, &|i, j| state[(i, j)]);
        let mut poles = Vec::new();
        solver.poles(model, &mut poles).map_err(failure)?;
        for (number, &pole) in poles.iter().enumerate() {
            let reference = Reference::new(model, solver.pair(model, pole));
            let number = number as f64;
            self.poles.push(&[variant], &[time, number, pole.re, pole.im, reference.pair.residual]);
            let (right, left) = reference.state_vectors(model);
            for ((name, v), w) in names.iter().zip(right).zip(left) {
                self.vectors.push(&[variant, name], &[time, number, v.re, v.im, w.re, w.im]);
            }
        }
        Ok(())
    }

    /// Writes the tables into the folder `target`; with `force` an older replay there is replaced.
    ///
    /// # Errors
    /// An input problem if it cannot be written.
    pub fn write(&self, target: &Path, force: bool) -> Result<Vec<PathBuf>, Problems> {
        let tables =
            [(&MATRICES, &self.matrices), (&POLES, &self.poles), (&VECTORS, &self.vectors)];
        let mut files = Vec::new();
        for (layout, table) in tables {
            let name = format!("{}.parquet", layout.name);
            let bytes = table
                .to_bytes(layout)
                .map_err(|error| super::table::problem(&target.join(&name), &error))?;
            files.push((PathBuf::from(name), bytes));
        }
        folder::write(target, &files, force.then_some("matrices.parquet"), &[])?;
        Ok(files.into_iter().map(|(name, _)| target.join(name)).collect())
    }
}
