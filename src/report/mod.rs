//! Reports: from values to text for people.

pub mod actuator;
pub mod modes;
pub mod scenario;
