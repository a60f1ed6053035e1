//! Scenario: from the text of the input files to validated values, with all problems at once.

pub mod gimbal;
pub mod names;
pub mod pattern;
pub mod table;
pub mod vehicle;
pub mod vehicle_file;
