//! Modes of a linear model: poles, vectors and their identity.

pub mod eigen;
pub mod identify;
pub mod realisation;

pub use eigen::{Pair, Solver};
pub use identify::{Candidate, Identity, Reference};
