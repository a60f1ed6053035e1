//! Scenario: from the text of the input files to validated values, with all problems at once.

pub mod dispersion;
pub use crate::spelling;
pub mod table;
