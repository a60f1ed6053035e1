//! Scenario: from the text of the input files to validated values, with all problems at once.

#[cfg(test)]
mod fixture;
pub mod gimbal;
pub mod names;
pub mod pattern;
pub mod table;
pub mod vehicle;
pub mod vehicle_file;
