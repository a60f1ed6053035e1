//! The scaffold: a folder of commented scenario files and the reference vehicle, to start from.
//!
//! The files are those of this repository, built into the program.

use super::{files, folder};
use crate::problem::Problems;
use std::path::{Path, PathBuf};

/// One file: its path in the scaffold, which is that in the repository, and its bytes.
macro_rules! embedded {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_bytes!(concat!("../../", $path)))),*]
    };
}

/// Every file of the scaffold.
const FILES: &[(&str, &[u8])] = embedded![
    "vehicles/sls-like/vehicle.toml",
    "vehicles/sls-like/stick.toml",
    "dispersions/reference.toml",
    "runs/reference.toml",
    "runs/all-engines.toml",
    "runs/smoke.toml",
];

/// Writes the scaffold as the new folder `target` and returns the paths written, inside it.
///
/// # Errors
/// One problem if `target` exists or cannot be written; then nothing is left behind.
pub fn write(target: &Path) -> Result<Vec<&'static str>, Problems> {
    if target.exists() {
        let found = "something that exists";
        return Err(Problems::input(files::name(target), "", found, "the name of a new folder"));
    }
    let contents: Vec<(PathBuf, Vec<u8>)> =
        FILES.iter().map(|(path, bytes)| (path.into(), bytes.to_vec())).collect();
    folder::write(target, &contents, None)?;
    Ok(FILES.iter().map(|(path, _)| *path).collect())
}
