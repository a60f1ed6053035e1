//! Scenario: from the text of the input files to validated values, with all problems at once.

pub mod actuator;
pub mod aerodynamics;
pub mod autopilot;
pub mod autopilot_file;
pub mod dispersion;
mod fixed;
#[cfg(test)]
mod fixture;
pub mod gimbal;
pub mod import;
pub mod import_file;
pub mod names;
pub mod pattern;
pub mod plan;
pub mod run;
pub mod run_file;
pub mod schema;
pub mod table;
pub mod tank;
pub mod vehicle;
pub mod vehicle_file;

pub use run::{Corner, Run};
pub use vehicle::Resolved;
