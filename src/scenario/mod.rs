//! Scenario: from the text of the input files to validated values, with all problems at once.

pub mod spelling;
pub mod table;
