//! Reports: from values to text for people.

pub mod actuator;
pub mod nominal;
pub mod plan;
pub mod scenario;
pub mod story;
pub mod modes;
