//! Probabilities and confidences: numbers strictly between 0 and 1, checked once.
//!
//! Estimated shares may be 0 or 1 and are plain numbers inside an `Estimate`.

use super::Error;

fn open_unit(name: &'static str, value: f64) -> Result<f64, Error> {
    if value > 0.0 && value < 1.0 {
        Ok(value)
    } else {
        Err(Error::OutOfRange { name, found: value, allowed: "above 0 and below 1" })
    }
}

/// A level, coverage or risk, strictly between 0 and 1.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Probability(f64);

impl Probability {
    /// A probability strictly between 0 and 1.
    pub fn new(value: f64) -> Result<Self, Error> {
        open_unit("probability", value).map(Self)
    }

    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

/// The confidence of an interval or bound, strictly between 0 and 1.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Confidence {
    // The risk is kept, not the confidence: 1 − 10⁻²⁰ is no double, 10⁻²⁰ is.
    risk: f64,
}

impl Confidence {
    /// A confidence strictly between 0 and 1.
    pub fn new(value: f64) -> Result<Self, Error> {
        open_unit("confidence", value).map(|value| Self { risk: 1.0 - value })
    }

    /// The confidence 1 − risk; the risk strictly between 0 and 1 (consumer's risk).
    pub fn from_risk(risk: f64) -> Result<Self, Error> {
        open_unit("risk", risk).map(|risk| Self { risk })
    }

    /// The confidence.
    pub fn get(self) -> f64 {
        1.0 - self.risk
    }

    /// One minus the confidence.
    pub fn risk(self) -> f64 {
        self.risk
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_outside_the_open_interval_is_a_probability() {
        for value in [0.0, 1.0, -0.1, 1.1, f64::NAN, f64::INFINITY] {
            assert!(Probability::new(value).is_err());
            assert!(Confidence::new(value).is_err());
            assert!(Confidence::from_risk(value).is_err());
        }
        assert_eq!(Confidence::new(0.95).unwrap().get(), 0.95);
        assert_eq!(Confidence::from_risk(1e-20).unwrap().risk(), 1e-20);
    }
}
