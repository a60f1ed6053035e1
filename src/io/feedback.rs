//! What feedback adds to the damping of the named modes, from the `cases` table of a run.
//!
//! What counts as added is decided in `campaign::feedback`.

use super::Run;
use crate::campaign::feedback::{Added, variants};
use crate::campaign::metric::{self, Quantity};
use crate::problem::Problems;

/// What feedback adds in every drawn or fixed population of a run, by population, variant and mode.
///
/// # Errors
/// Damage in the table.
pub fn added(run: &Run) -> Result<Vec<Added>, Problems> {
    let definition = &run.outline().definition;
    let metrics = metric::metrics(definition);
    let mut all = Vec::new();
    for (population, rule) in definition.populations.iter().enumerate() {
        for variant in variants(definition) {
            for mode in 0..definition.modes.len() {
                let quantity = Quantity::DampingRatioGainMin;
                let Some(gain) = metric::find(&metrics, quantity, variant, mode) else { continue };
                let mut found = Added::new([population, variant, mode], rule.cases);
                run.cases(population, &[&gain.name], |case, values, _| {
                    found.add(case, values[0]);
                    Ok(())
                })?;
                all.push(found);
            }
        }
    }
    Ok(all)
}
