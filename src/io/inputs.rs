//! The inputs of a run, copied into its folder so that it can be replayed from there.
//!
//! Files keep their places relative to each other.

use super::scenario::{Copies, Loaded};
use super::{files, package};
use crate::campaign::outline::Input;
use crate::problem::Problems;
use std::path::{Path, PathBuf};

/// Folder of the copies inside a run's folder.
pub const FOLDER: &str = "inputs";

/// Every file that a loaded run was read from, the run file first, and their digests.
///
/// # Errors
/// A file that can no longer be read.
pub fn of(loaded: &Loaded) -> Result<(Vec<PathBuf>, Vec<Input>), Problems> {
    let texts = loaded.texts.iter().map(|(name, _)| PathBuf::from(name));
    let package = package::files(&loaded.modal_package);
    let paths =
        texts.chain(package).map(|path| files::absolute(&path)).collect::<Result<Vec<_>, _>>()?;
    let input = |path: &PathBuf| {
        // The name is the same wherever the inputs lie.
        let name = relative(&paths, path).join("/");
        Ok(Input { name, blake3: files::digest(path)? })
    };
    let inputs = paths.iter().map(input).collect::<Result<Vec<_>, Problems>>()?;
    Ok((paths, inputs))
}

/// Copies `paths` into the run's folder.
///
/// # Errors
/// A file that cannot be read or written.
pub fn copy(paths: &[PathBuf], run_folder: &Path) -> Result<(), Problems> {
    for path in paths {
        let target = run_folder.join(FOLDER).join(relative(paths, path).join("/"));
        files::create_parents(&target)?;
        files::write(&target, &files::read_bytes(path)?)?;
    }
    Ok(())
}

/// Where the copies of `inputs`, in the order of [`of`], stand in a run's folder.
///
/// # Errors
/// Damage: fewer inputs than every run has.
pub fn copies(run_folder: &Path, inputs: &[Input]) -> Result<Copies, Problems> {
    let [run, vehicle, dispersion, package_head, ..] = inputs else {
        let found = format!("{} inputs", inputs.len());
        let file = files::name(&run_folder.join(super::manifest::FILE));
        return Err(Problems::damage(file, "run.inputs", found, "the files of a run"));
    };
    let copy = |input: &Input| run_folder.join(FOLDER).join(&input.name);
    let modal_package = copy(package_head).parent().map_or_else(PathBuf::new, Path::to_owned);
    Ok(Copies {
        run: copy(run),
        vehicle: copy(vehicle),
        dispersion: copy(dispersion),
        modal_package,
    })
}

/// `path` below the deepest folder that holds all of `paths`, as its parts.
fn relative(paths: &[PathBuf], path: &Path) -> Vec<String> {
    let parts = |path: &Path| -> Vec<String> {
        path.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect()
    };
    let first = parts(&paths[0]);
    let common = paths.iter().fold(first.len() - 1, |common, other| {
        let other = parts(other);
        let shared = first.iter().zip(&other).take_while(|(a, b)| a == b).count();
        common.min(shared).min(other.len() - 1)
    });
    parts(path).split_off(common)
}
