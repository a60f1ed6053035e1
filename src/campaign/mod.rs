//! A campaign: cases evaluated in a parallel pool, their records and what they sum up to.

pub mod audit;
pub mod corner;
pub mod definition;
pub mod derivative;
pub mod draw;
mod draw_servo;
pub mod evaluator;
pub mod feedback;
pub mod influence;
pub mod loop_metric;
pub mod loops;
pub mod metric;
pub mod nested;
pub mod outline;
pub mod planar;
pub mod plant;
pub mod pool;
pub mod record;
pub mod row;
pub mod sample;
pub mod sensitivity;
pub mod statistics;
pub mod summary;
#[cfg(test)]
pub mod synthetic;
pub mod worst;

pub use definition::{
    Definition, LoopPlan, NozzleJet, Population, SensitivityRule, Slope, Variant,
};
pub use derivative::Sensitivity;
pub use evaluator::Evaluator;
pub use outline::{DrawColumn, Input, Outline, StoredPoles};
pub use pool::{Pool, Progress, Span};
pub use record::{Branch, Evaluation, Failure, FailureKind, Pole, Record};
pub use sample::{Intervals, Sample};
