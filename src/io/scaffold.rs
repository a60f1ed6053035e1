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
    "vehicles/sls-like/modes/package.toml",
    "vehicles/sls-like/modes/tables/grids.parquet",
    "vehicles/sls-like/modes/tables/mass.parquet",
    "vehicles/sls-like/modes/tables/modes.parquet",
    "vehicles/sls-like/modes/tables/parents.parquet",
    "vehicles/sls-like/modes/tables/shapes.parquet",
    "dispersions/reference.toml",
    "dispersions/closed-loop.toml",
    "runs/reference.toml",
    "runs/reference.gates.toml",
    "runs/all-engines.toml",
    "runs/closed-loop.toml",
    "runs/closed-loop.gates.toml",
    "runs/plant.toml",
    "runs/regression.gates.toml",
    "runs/smoke.toml",
];

/// Writes the scaffold as the new folder `target` and returns the paths written, inside it.
///
/// # Errors
/// One problem if `target` exists or cannot be written; then nothing is left behind.
pub fn write(target: &Path) -> Result<Vec<&'static str>, Problems> {
    files::refuse_existing(target)?;
    let contents: Vec<(PathBuf, Vec<u8>)> =
        FILES.iter().map(|(path, bytes)| (path.into(), bytes.to_vec())).collect();
    folder::write(target, &contents, None, &[])?;
    Ok(FILES.iter().map(|(path, _)| *path).collect())
}

#[cfg(test)]
mod tests {
    use super::super::scenario;
    use super::*;

    #[test]
    fn every_run_of_the_scaffold_loads_and_a_folder_that_exists_is_refused() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("study");
        let paths = write(&target).unwrap();
        for run in ["reference", "all-engines", "closed-loop", "plant", "smoke"] {
            let run = &*format!("runs/{run}.toml");
            assert!(paths.contains(&run));
            let loaded = scenario::load(&target.join(run), scenario::Reach::Study).unwrap();
            assert_eq!(loaded.vehicle.vehicle.name, "SLS-like, synthetic");
        }
        let problems = write(&target).unwrap_err();
        assert!(problems.0[0].found.contains("exists"), "{problems}");
        assert!(scenario::load(&target.join("runs/smoke.toml"), scenario::Reach::Study).is_ok());
    }

    #[test]
    fn the_scaffold_is_the_repository() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for (path, bytes) in FILES {
            let mut file = files::open(&root.join(path)).unwrap();
            let mut stored = Vec::new();
            std::io::Read::read_to_end(&mut file, &mut stored).unwrap();
            assert!(stored == *bytes, "{path}");
        }
    }
}
