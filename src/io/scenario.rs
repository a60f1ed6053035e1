//! Scenarios on disk: the files that a vehicle or a run names, read and resolved together.
//!
//! What the files say is understood in `scenario`; paths in a file are relative to that file.

use super::{files, package};
use crate::campaign::Definition;
use crate::dispersion::Dispersion;
use crate::problem::Problems;
use crate::scenario::run_file::RunFile;
use crate::scenario::vehicle_file::VehicleFile;
use crate::scenario::{self, Corner, Resolved, Run, table};
use std::path::{Path, PathBuf};

/// Everything a run names.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The vehicle and its flight times.
    pub vehicle: Resolved,
    /// The dispersion.
    pub dispersion: Dispersion,
    /// What is asked for.
    pub definition: Definition,
    /// Corners whose signs are still to be evaluated.
    pub corners: Vec<Corner>,
    /// The gate file, if the run names one.
    pub gates: Option<PathBuf>,
    /// The files that were read: their names as a user would name them, and their texts.
    pub texts: Vec<(String, String)>,
    /// The folder of the modal package.
    pub modal_package: PathBuf,
}

/// A vehicle with the texts of its file and the folder of its modal package.
#[derive(Debug, Clone)]
pub struct LoadedVehicle {
    /// The vehicle and its flight times.
    pub resolved: Resolved,
    /// Name and text of its file.
    pub text: (String, String),
    /// The folder of the modal package.
    pub modal_package: PathBuf,
}

/// Name of the vehicle file inside a vehicle's folder.
const VEHICLE_FILE: &str = "vehicle.toml";

/// Reads a vehicle: its file, or the folder that holds it, and its modal package.
///
/// # Errors
/// All problems of the file and of the package.
pub fn vehicle(path: &Path) -> Result<LoadedVehicle, Problems> {
    let path = if path.is_dir() { path.join(VEHICLE_FILE) } else { path.to_owned() };
    let name = files::name(&path);
    let text = files::read_text(&path)?;
    let (raw, mut findings) = table::read::<VehicleFile>(&name, &text)?;
    let modal_package = beside(&path, &raw.modal_package);
    let modal = named(&path, &raw.modal_package, "modal_package", &mut findings, package::read);
    let resolved = scenario::vehicle::resolve(&raw, modal, findings)?;
    Ok(LoadedVehicle { resolved, text: (name, text), modal_package })
}

/// Reads a run and everything it names.
///
/// # Errors
/// All problems of the run file, the vehicle, the modal package and the dispersion table.
pub fn load(path: &Path) -> Result<Loaded, Problems> {
    let name = files::name(path);
    let text = files::read_text(path)?;
    let (raw, mut findings) = table::read::<RunFile>(&name, &text)?;

    let vehicle = named(path, &raw.vehicle, "vehicle", &mut findings, vehicle);
    let dispersion = named(path, &raw.dispersion, "dispersion", &mut findings, |file| {
        let name = files::name(file);
        let text = files::read_text(file)?;
        // Rows are only understood against the vehicle.
        let dispersion = match &vehicle {
            Some(v) => Some(scenario::dispersion::read(&name, &text, &v.resolved.vehicle)?),
            None => {
                let (raw, findings) = table::read::<crate::dispersion::Table>(&name, &text)?;
                findings.finish(Some(raw))?;
                None
            }
        };
        Ok((dispersion, (name, text)))
    });
    let gates = raw.gates.as_ref().map(|gates| beside(path, gates));
    if let Some(gates) = gates.as_ref().filter(|gates| !gates.is_file()) {
        findings.push("gates", format!("{}, which is no file", gates.display()), "a gate file");
    }
    let (dispersion, dispersion_text) = dispersion.unzip();
    let dispersion = dispersion.flatten();
    let stem = path.file_stem().map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
    let resolved = vehicle.as_ref().map(|v| &v.resolved);
    let Run { definition, corners } =
        scenario::run::resolve(&raw, &stem, resolved, dispersion.as_ref(), findings)?;
    let mut texts = vec![(name, text)];
    // What could not be read is among the problems already returned.
    let missing = || Problems::input(&texts[0].0, "", "an incomplete scenario", "all its files");
    let (vehicle, dispersion) = (vehicle.ok_or_else(missing)?, dispersion.ok_or_else(missing)?);
    texts.push(vehicle.text);
    texts.extend(dispersion_text);
    Ok(Loaded {
        vehicle: vehicle.resolved,
        dispersion,
        definition,
        corners,
        gates,
        texts,
        modal_package: vehicle.modal_package,
    })
}

/// Reads what `file` names at `key`; its problems go to `findings`.
fn named<T>(
    file: &Path,
    path: &str,
    key: &str,
    findings: &mut table::Findings,
    read: impl FnOnce(&Path) -> Result<T, Problems>,
) -> Option<T> {
    if path.is_empty() {
        findings.push(key, "an empty text", "a path relative to this file");
        return None;
    }
    let path = beside(file, path);
    if !path.exists() {
        let found = format!("\"{}\", which does not exist", path.display());
        findings.push(key, found, "a path relative to this file");
        return None;
    }
    read(&path).map_err(|problems| findings.extend(problems)).ok()
}

/// `path` relative to the folder of `file`; an absolute path as it is.
fn beside(file: &Path, path: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path)
}
