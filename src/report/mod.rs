//! Reports: values become text for people: terminal tables, charts, and the page of a run.

pub mod actuator;
pub mod annotations;
pub mod audit;
pub mod chart;
pub mod feedback;
pub mod figure;
pub mod gates;
pub mod how_many;
pub mod html;
pub mod import;
pub mod influence;
pub mod junit;
pub mod markdown;
pub mod modes;
pub mod nominal;
mod number;
pub mod plan;
pub mod reference;
pub mod scenario;
pub mod statistics;
pub mod story;
pub mod worst;

pub use number::{percent, significant};
