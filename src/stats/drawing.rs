//! How the cases of a sample came about, and the witness that they are independent.
//!
//! Which plan draws in which way is said by the plan; here is only what may be concluded.

use super::Error;

/// How the cases of a sample came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Drawing {
    /// Every case drawn independently from the same law.
    Independent,
    /// Latin hypercube: stratified, hence negatively dependent cases.
    LatinHypercube,
    /// A low-discrepancy sequence.
    LowDiscrepancy,
    /// Inner campaigns that share their outer draws.
    Nested,
    /// Crossings of two samples, for sensitivity indices.
    Crossed,
    /// Chosen points: a nominal, corners, one at a time, a list from a file.
    Designed,
    /// Kept or found because of their result: search results, cases added because they were bad.
    Selected,
}

impl Drawing {
    /// The witness that exact intervals ask for; an error for any plan but independent draws.
    pub fn independent(self) -> Result<Independent, Error> {
        match self {
            Self::Independent => Ok(Independent(())),
            drawing => Err(Error::NotIndependent { drawing }),
        }
    }

    /// The witness that `replicates` replicates of the design, or outer draws, are independent of each
    /// other; an error where there are not two or the design has none.
    pub fn independent_replicates(self, replicates: u64) -> Result<Independent, Error> {
        match self {
            Self::LatinHypercube | Self::LowDiscrepancy | Self::Nested if replicates < 2 => {
                Err(Error::TooFew { found: replicates, needed: 2 })
            }
            Self::Independent | Self::LatinHypercube | Self::LowDiscrepancy | Self::Nested => {
                Ok(Independent(()))
            }
            drawing => Err(Error::NotIndependent { drawing }),
        }
    }

    /// The words that complete "these cases are …".
    pub fn describe(self) -> &'static str {
        match self {
            Self::Independent => "independent draws",
            Self::LatinHypercube => "a Latin hypercube",
            Self::LowDiscrepancy => "a low-discrepancy sequence",
            Self::Nested => "inner campaigns that share their outer draws",
            Self::Crossed => "crossings of two samples, which share their draws",
            Self::Designed => "chosen points, not draws",
            Self::Selected => "selected by their result",
        }
    }
}

/// Witness that the cases of a sample are independent draws; made by [`Drawing`] only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Independent(());

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_independent_draws_give_the_witness() {
        assert!(Drawing::Independent.independent().is_ok());
        for drawing in
            [Drawing::LatinHypercube, Drawing::LowDiscrepancy, Drawing::Designed, Drawing::Selected]
        {
            let error = drawing.independent().unwrap_err();
            assert_eq!(error, Error::NotIndependent { drawing });
            assert!(error.to_string().contains(drawing.describe()));
        }
    }
}
