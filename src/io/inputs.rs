//! The inputs of a run, copied into its folder so that it can be replayed from there.
//!
//! A copy is called by what it is, not by where the original lies: absolute paths, links and
//! folders of the originals do not matter. How copies are read is decided in `scenario`.

use super::listed::Format;
use super::scenario::{self, Loaded};
use super::{files, package};
use crate::campaign::outline::Input;
use crate::problem::{Kind, Problems};
use std::path::{Path, PathBuf};

/// Folder of the copies inside a run's folder.
pub const FOLDER: &str = "inputs";
/// Copy of the run file.
pub const RUN: &str = "run.toml";
/// Copy of the vehicle file.
pub const VEHICLE: &str = "vehicle.toml";
/// Copy of the dispersion table.
pub const DISPERSION: &str = "dispersion.toml";
/// Copies of the plan file, by its kind.
pub const PLANS: [(&str, Format); 2] =
    [("plan.csv", Format::Csv), ("plan.parquet", Format::Parquet)];
/// Copy of the modal package's folder.
pub const MODES: &str = "modes";

/// The bytes of every input of a run, by the name of its copy; the run file first.
#[derive(Debug, Clone)]
pub struct Inputs(Vec<(String, Vec<u8>)>);

impl Inputs {
    /// The inputs from which `loaded` was read.
    ///
    /// # Errors
    /// A table that can no longer be read.
    pub fn of(loaded: &Loaded) -> Result<Self, Problems> {
        let texts = [(RUN, &loaded.run), (VEHICLE, &loaded.vehicle_file)];
        let texts = texts.into_iter().chain([(DISPERSION, &loaded.dispersion_file)]);
        let mut inputs: Vec<(String, Vec<u8>)> =
            texts.map(|(name, (_, text))| (name.into(), text.clone().into_bytes())).collect();
        if let Some((format, bytes, _)) = &loaded.plan_file {
            let name = PLANS.iter().find(|(_, known)| known == format);
            inputs.extend(name.map(|(name, _)| ((*name).to_owned(), bytes.clone())));
        }
        let folder = &loaded.modal_package;
        for path in package::files(folder) {
            let inside = path.strip_prefix(folder).unwrap_or(&path);
            inputs.push((format!("{MODES}/{}", slashed(inside)), files::read_bytes(&path)?));
        }
        Ok(Self(inputs))
    }

    /// A single text.
    pub fn of_text(name: &str, text: &str) -> Self {
        Self(vec![(name.to_owned(), text.as_bytes().to_vec())])
    }

    /// Name and digest of every input.
    pub fn digests(&self) -> Vec<Input> {
        let digest = |(name, bytes): &(String, Vec<u8>)| Input {
            name: name.clone(),
            blake3: files::digest_of(bytes),
        };
        self.0.iter().map(digest).collect()
    }

    /// Writes the copies into the run's folder.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, run_folder: &Path) -> Result<(), Problems> {
        for (name, bytes) in &self.0 {
            let target = run_folder.join(FOLDER).join(name);
            files::create_parents(&target)?;
            files::write(&target, bytes)?;
        }
        Ok(())
    }
}

/// Copies the inputs of a run under way into the folder of another.
///
/// # Errors
/// A file that cannot be read or written.
pub fn copy(from: &Path, to: &Path) -> Result<(), Problems> {
    let mut folders = vec![PathBuf::from(FOLDER)];
    while let Some(folder) = folders.pop() {
        for name in files::names(&from.join(&folder))? {
            let inside = folder.join(name);
            if from.join(&inside).is_dir() {
                folders.push(inside);
                continue;
            }
            let target = to.join(&inside);
            files::create_parents(&target)?;
            files::write(&target, &files::read_bytes(&from.join(&inside))?)?;
        }
    }
    Ok(())
}

/// Reads what a run was made from: the copies in its folder, once all are found to be whole.
///
/// # Errors
/// As [`check`].
pub fn read(run_folder: &Path, inputs: &[Input]) -> Result<Loaded, Problems> {
    check(run_folder, inputs)?;
    scenario::load_copies(&run_folder.join(FOLDER))
}

/// Checks the copies of a run's inputs.
///
/// # Errors
/// Damage: every copy that is missing or has other bytes than `inputs` says.
pub fn check(run_folder: &Path, inputs: &[Input]) -> Result<(), Problems> {
    let folder = run_folder.join(FOLDER);
    let mut problems = Problems::default();
    for Input { name, blake3 } in inputs {
        let path = folder.join(name);
        let found = match files::digest(&path) {
            Ok(found) if found == *blake3 => continue,
            Ok(found) => format!("other bytes than at the run (BLAKE3 {found})"),
            Err(unread) => unread.0.into_iter().map(|p| p.found).collect::<Vec<_>>().join(", "),
        };
        problems.push(Kind::Damage, files::name(&path), "", found, format!("BLAKE3 {blake3}"));
    }
    problems.into_result(())
}

/// A path inside a folder, the same text on every system.
fn slashed(path: &Path) -> String {
    let parts: Vec<_> = path.components().map(|c| c.as_os_str().to_string_lossy()).collect();
    parts.join("/")
}

/// Where the copy of what a file names at `key` lies.
pub fn copy_of(folder: &Path, key: &str) -> PathBuf {
    folder.join(match key {
        "vehicle" => VEHICLE,
        "dispersion" => DISPERSION,
        name if PLANS.iter().any(|(plan, _)| *plan == name) => name,
        _ => MODES,
    })
}
