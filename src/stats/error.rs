//! Why a statistic cannot be given.
//!
//! Input problems of files are in `problem`; these are about numbers.

use super::drawing::Drawing;

/// Why a statistic cannot be given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// An argument is outside its range.
    #[error("{name} is {found}; allowed: {allowed}")]
    OutOfRange {
        /// The argument.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A value of the sample is not a number, or not finite where that is needed.
    #[error("value {index} of the sample is {found}; allowed: {allowed}")]
    NotFinite {
        /// Position in the sample.
        index: usize,
        /// The value.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The sample is too small for the statement.
    #[error("the sample holds {found} values; at least {needed} are needed")]
    TooFew {
        /// Size of the sample.
        found: u64,
        /// Size needed.
        needed: u64,
    },
    /// The cases were not drawn independently.
    #[error("an exact interval needs independent draws; these cases are {}", .drawing.describe())]
    NotIndependent {
        /// How the cases came about.
        drawing: Drawing,
    },
    /// Two samples that should be paired differ in length.
    #[error("{left} values cannot be paired with {right}")]
    NotPaired {
        /// Length of the first sample.
        left: usize,
        /// Length of the second sample.
        right: usize,
    },
    /// The statistic does not exist for this sample.
    #[error("{0}")]
    Undefined(&'static str),
}
