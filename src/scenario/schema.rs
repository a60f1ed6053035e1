//! JSON Schemas of the TOML files: what `table` checks each file against.
//!
//! The raw types belong to those who read them.

use super::run_file::RunFile;
use super::vehicle_file::VehicleFile;
use schemars::Schema;

/// A kind of TOML file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A vehicle.
    Vehicle,
    /// A run definition.
    Run,
    /// A dispersion table.
    Dispersion,
    /// A stick model.
    Stick,
}

/// The JSON Schema of a kind of file.
pub fn schema(kind: FileKind) -> Schema {
    match kind {
        FileKind::Vehicle => schemars::schema_for!(VehicleFile),
        FileKind::Run => schemars::schema_for!(RunFile),
        FileKind::Dispersion => schemars::schema_for!(crate::dispersion::Table),
        FileKind::Stick => schemars::schema_for!(crate::structure::raw::Stick),
    }
}
