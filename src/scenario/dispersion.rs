//! A dispersion table from its text.
//!
//! What rows mean for a vehicle is decided in `dispersion::resolve`.

use super::table;
use crate::dispersion::{Dispersion, Table, resolve};
use crate::problem::Problems;
use crate::vehicle::Vehicle;

/// Reads the dispersion table `text` of the file called `file` for `vehicle`.
///
/// # Errors
/// All problems of the file at once, each with its key path.
pub fn read(file: &str, text: &str, vehicle: &Vehicle) -> Result<Dispersion, Problems> {
    let (raw, mut findings) = table::read::<Table>(file, text)?;
    let dispersion =
        resolve(&raw, vehicle, &mut |key, found, allowed| findings.push(key, found, allowed));
    findings.finish(Some(dispersion))
}
