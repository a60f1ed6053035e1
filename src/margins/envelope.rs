//! Envelopes of the loops over many cases: per frequency the least, percentiles and greatest of
//! magnitude and phase.
//!
//! They are reduced from stored curves on one grid of frequencies, so that shards merge exactly;
//! where curves are stored is decided in `io`.

use crate::stats::{Error, Ordered, Probability};

/// Probabilities of the quantiles of an envelope.
pub const LEVELS: [f64; 5] = [0.01, 0.10, 0.50, 0.90, 0.99];

/// The spread of one quantity at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Least value.
    pub smallest: f64,
    /// Quantiles at [`LEVELS`], linear between order statistics (type 7 of Hyndman and Fan).
    pub quantiles: [f64; LEVELS.len()],
    /// Greatest value.
    pub largest: f64,
}

/// The spread of `values`, in any order; none if there are none.
///
/// # Errors
/// If a value is not finite.
pub fn spread(values: &[f64]) -> Result<Option<Spread>, Error> {
    if values.is_empty() {
        return Ok(None);
    }
    let ordered = Ordered::new(values)?;
    let mut quantiles = [0.0; LEVELS.len()];
    for (quantile, level) in quantiles.iter_mut().zip(LEVELS) {
        *quantile = ordered.quantile(Probability::new(level)?);
    }
    Ok(Some(Spread { smallest: ordered.smallest(), quantiles, largest: ordered.largest() }))
}

/// One row of the `envelopes` table.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvelopeRow {
    /// Index of the population.
    pub population: usize,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the flight time.
    pub flight_time: usize,
    /// Index of the axis.
    pub axis: usize,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Cases with a curve.
    pub cases: u64,
    /// Spread of the magnitude, dB; none without a curve that is not zero.
    pub magnitude_db: Option<Spread>,
    /// Spread of the phase, degrees, each case's next to the nominal one's.
    pub phase_deg: Option<Spread>,
}

/// The phase nearest to `reference`, degrees, among those that differ from `phase` by whole turns.
///
/// Curves unwrapped from low frequency can differ by a turn past a zero near the imaginary axis that
/// lies on its left in one case and on its right in the next; next to the nominal phase
/// at the same frequency the spread of a campaign is that of the loops.
pub fn nearest_phase_deg(phase: f64, reference: f64) -> f64 {
    phase - 360.0 * ((phase - reference) / 360.0).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_does_not_depend_on_the_order() {
        let values = [3.0, -1.0, 2.0, 5.0];
        let found = spread(&values).unwrap().unwrap();
        assert_eq!((found.smallest, found.quantiles[2], found.largest), (-1.0, 2.5, 5.0));
        let mut turned = values;
        turned.reverse();
        assert_eq!(spread(&turned).unwrap().unwrap(), found);
        assert_eq!(spread(&[]).unwrap(), None);
    }

    #[test]
    fn a_phase_is_brought_next_to_its_reference() {
        assert_eq!(nearest_phase_deg(-350.0, 0.0), 10.0);
        assert_eq!(nearest_phase_deg(-530.0, -170.0), -170.0);
        assert_eq!(nearest_phase_deg(100.0, -30.0), 100.0);
    }
}
