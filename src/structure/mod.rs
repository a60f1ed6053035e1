//! Structure: from a stick model of beams, masses and springs to free-free modes with labels.
//!
//! It parses text and computes; it touches no disk and knows no engine, thrust or sample.

pub mod assignment;
pub mod beam;
pub mod character;
#[cfg(test)]
mod closed_forms;
pub mod effective;
pub mod free_free;
pub mod label;
pub mod orientation;
pub mod raw;
mod reading;
pub mod solve;
pub mod stick;
pub mod weigh;

pub use character::{Character, Direction};
pub use free_free::{FreeFree, Rigid};
pub use label::Thresholds;
pub use solve::{Error, Selection, mode_set, solve};
pub use stick::Stick;
