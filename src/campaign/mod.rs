//! A campaign: cases evaluated in a parallel pool, their records and what they sum up to.

pub mod definition;
pub mod plant;
pub mod record;

pub use definition::{Definition, NozzleJet, Population, Slope, Variant};
pub use record::{Branch, Evaluation, Failure, FailureKind, Pole, Record};
