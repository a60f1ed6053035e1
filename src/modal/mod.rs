//! Modes of a linear model: poles, vectors and their identity, and its frequency response.

pub mod eigen;
pub mod factors;
pub mod identify;
pub mod realisation;
pub mod response;
pub mod spectrum;

pub use eigen::{Pair, Solver};
pub use identify::{Candidate, Identity, Reference};
pub use response::Response;
