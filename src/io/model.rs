//! The state space of a case on disk: matrices and names as flat tables.
//!
//! What the matrices are is decided in `modal::realisation`.

use super::flat::{Column, Holds, Layout, Table};
use super::folder;
use crate::modal::realisation::Realisation;
use crate::problem::Problems;
use std::path::{Path, PathBuf};

/// Nonzero entries of A, B, C, D.
const MATRICES: Layout = Layout {
    name: "state_space",
    columns: &[
        Column("matrix", Holds::Text, "A, B, C, D of x' = A x + B w, y = C x + D w"),
        Column("row_name", Holds::Text, "State or output of the row"),
        Column("column_name", Holds::Text, "State or input of the column"),
        Column("row", Holds::Number("1"), "Row, from 0"),
        Column("column", Holds::Number("1"), "Column, from 0"),
        Column("value", Holds::Number("SI"), "Entry, SI units; entries that are zero are left out"),
    ],
};

/// Names of states, inputs and outputs.
const NAMES: Layout = Layout {
    name: "names",
    columns: &[
        Column("kind", Holds::Text, "state, input or output"),
        Column("name", Holds::Text, "Its name"),
        Column("number", Holds::Number("1"), "Its row or column in the matrices, from 0"),
    ],
};

/// The format of the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Parquet.
    Parquet,
    /// Comma-separated values with a header.
    Csv,
}

impl Format {
    /// Its extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Csv => "csv",
        }
    }

    /// The bytes of a table; `target` is the file for messages.
    ///
    /// # Errors
    /// What the Parquet writer says.
    pub fn bytes(self, layout: &Layout, table: &Table, target: &Path) -> Result<Vec<u8>, Problems> {
        match self {
            Self::Csv => Ok(table.to_csv(layout).into_bytes()),
            Self::Parquet => {
                table.to_bytes(layout).map_err(|error| super::table::problem(target, &error))
            }
        }
    }
}

/// Writes the tables `state_space` and `names` into the folder `target`; with `force` older ones there
/// are replaced.
///
/// # Errors
/// An input problem if it cannot be written.
pub fn write(
    target: &Path,
    realisation: &Realisation,
    format: Format,
    force: bool,
) -> Result<Vec<PathBuf>, Problems> {
    let Realisation { system, states, inputs, outputs } = realisation;
    let mut matrices = Table::new(&MATRICES);
    for (name, matrix, rows, columns) in [
        ("A", &system.a, states, states),
        ("B", &system.b, states, inputs),
        ("C", &system.c, outputs, states),
        ("D", &system.d, outputs, inputs),
    ] {
        for row in 0..matrix.nrows() {
            for column in 0..matrix.ncols() {
                let value = matrix[(row, column)];
                if value != 0.0 {
                    let texts = [name, &rows[row], &columns[column]];
                    matrices.push(&texts, &[row as f64, column as f64, value]);
                }
            }
        }
    }
    let mut names = Table::new(&NAMES);
    for (kind, list) in [("state", states), ("input", inputs), ("output", outputs)] {
        for (number, name) in list.iter().enumerate() {
            names.push(&[kind, name], &[number as f64]);
        }
    }
    let mut files = Vec::new();
    for (layout, table) in [(&MATRICES, &matrices), (&NAMES, &names)] {
        let name = format!("{}.{}", layout.name, format.extension());
        files.push((PathBuf::from(&name), format.bytes(layout, table, &target.join(name))?));
    }
    let mark = format!("{}.{}", MATRICES.name, format.extension());
    folder::write(target, &files, force.then_some(mark.as_str()), &[])?;
    Ok(files.into_iter().map(|(name, _)| target.join(name)).collect())
}
