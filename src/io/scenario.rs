//! Scenarios on disk: the files that a vehicle or a run names, read and resolved together.
//!
//! What the files say is understood in `scenario`; paths in a file are relative to that file.

use super::listed::{self, Format};
use super::{files, inputs, package};
use crate::campaign::Definition;
use crate::dispersion::{Dispersion, Listed, Sampler};
use crate::gate;
use crate::problem::Problems;
use crate::scenario::run_file::{ColumnsFile, PlanFile, RunFile};
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
    /// Name of the run file as a user would name it, and its text.
    pub run: (String, String),
    /// Name and text of the vehicle file.
    pub vehicle_file: (String, String),
    /// Name and text of the dispersion table.
    pub dispersion_file: (String, String),
    /// The folder of the modal package.
    pub modal_package: PathBuf,
    /// Kind, bytes and cases of the plan file, if the run has one.
    pub plan_file: Option<(Format, Vec<u8>, Listed)>,
}

impl Loaded {
    /// The sampler for `definition`, which is that of the run or one with another seed or number of
    /// cases.
    ///
    /// # Errors
    /// A plan that does not fit its number of cases.
    pub fn sampler(&self, definition: &Definition) -> Result<Sampler<'_>, Problems> {
        let mut sampler = Sampler::new(&self.dispersion, definition.seed);
        let listed = self.plan_file.as_ref().map(|(_, _, listed)| listed);
        for population in definition.populations.iter().filter(|p| !p.scheme.is_monte_carlo()) {
            sampler = sampler
                .with_plan(&population.scheme, population.cases, listed)
                .map_err(|r| Problems::input(&self.run.0, r.key, r.found, r.allowed))?;
        }
        Ok(sampler)
    }
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

/// How far the paths in scenario files may reach: they come from colleagues, too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Not out of the study: the folder of the first file, or the one above it if that is called
    /// `runs`. Links are followed before it is judged.
    Study,
    /// Anywhere.
    Anywhere,
}

/// Where the files lie that a file names.
#[derive(Clone, Copy)]
enum Place<'a> {
    /// Where it says, relative to itself; with a folder, not outside of it.
    Named(Option<&'a Path>),
    /// Among the copies of a run's inputs in this folder, whatever it says.
    Copies(&'a Path),
}

impl Place<'_> {
    /// What `file` names `path` at `key`.
    fn find(self, file: &Path, path: &str, key: &str) -> PathBuf {
        match self {
            Self::Named(_) => file.parent().unwrap_or(Path::new("")).join(path),
            Self::Copies(folder) => inputs::copy_of(folder, key),
        }
    }
}

impl Place<'_> {
    /// What is allowed instead of `path`, if that lies outside of the study.
    fn refusal(self, path: &Path) -> Option<String> {
        let Self::Named(Some(study)) = self else { return None };
        let outside = !files::resolved(path).starts_with(study);
        outside.then(|| format!("a path inside {}, or --allow-outside", files::name(study)))
    }
}

/// The study of a file.
fn study(path: &Path) -> PathBuf {
    let folder = files::resolved(path.parent().unwrap_or(Path::new("")));
    let above = folder.parent().filter(|_| folder.file_name().is_some_and(|n| n == "runs"));
    above.unwrap_or(&folder).to_owned()
}

/// Reads a vehicle: its file, or the folder that holds it, and its modal package.
///
/// # Errors
/// All problems of the file and of the package.
pub fn vehicle(path: &Path, reach: Reach) -> Result<LoadedVehicle, Problems> {
    let file = if path.is_dir() { path.join(VEHICLE_FILE) } else { path.to_owned() };
    match reach {
        Reach::Anywhere => vehicle_from(&file, Place::Named(None)),
        Reach::Study => vehicle_from(&file, Place::Named(Some(&study(&file)))),
    }
}

fn vehicle_from(path: &Path, place: Place<'_>) -> Result<LoadedVehicle, Problems> {
    let path = if path.is_dir() { path.join(VEHICLE_FILE) } else { path.to_owned() };
    let name = files::name(&path);
    let text = files::read_text(&path)?;
    let (raw, mut findings) = table::read::<VehicleFile>(&name, &text)?;
    let modal_package = place.find(&path, &raw.modal_package, "modal_package");
    let at = (raw.modal_package.as_str(), modal_package.as_path());
    let modal = named(at, "modal_package", place, &mut findings, package::read);
    let resolved = scenario::vehicle::resolve(&raw, modal, findings)?;
    Ok(LoadedVehicle { resolved, text: (name, text), modal_package })
}

/// Reads a run and everything it names.
///
/// # Errors
/// All problems of the run file, the vehicle, the modal package, the dispersion table and the gates.
pub fn load(path: &Path, reach: Reach) -> Result<Loaded, Problems> {
    match reach {
        Reach::Anywhere => load_from(path, Place::Named(None)),
        Reach::Study => load_from(path, Place::Named(Some(&study(path)))),
    }
}

/// Reads the copies of a run's inputs in `folder`; gates are none of them.
///
/// # Errors
/// As for [`load`].
pub(super) fn load_copies(folder: &Path) -> Result<Loaded, Problems> {
    load_from(&folder.join(inputs::RUN), Place::Copies(folder))
}

fn load_from(path: &Path, place: Place<'_>) -> Result<Loaded, Problems> {
    let name = files::name(path);
    let text = files::read_text(path)?;
    let (raw, mut findings) = table::read::<RunFile>(&name, &text)?;

    let found = place.find(path, &raw.vehicle, "vehicle");
    let at = (raw.vehicle.as_str(), found.as_path());
    let vehicle = named(at, "vehicle", place, &mut findings, |file| vehicle_from(file, place));
    let found = place.find(path, &raw.dispersion, "dispersion");
    let at = (raw.dispersion.as_str(), found.as_path());
    let dispersion = named(at, "dispersion", place, &mut findings, |file| {
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
    let gates = raw.gates.as_ref().filter(|_| matches!(place, Place::Named(_)));
    let gates = gates.and_then(|gates| {
        let found = place.find(path, gates, "gates");
        named((gates, &found), "gates", place, &mut findings, |file| {
            gate::parse(&files::read_text(file)?, &files::name(file))?;
            Ok(file.to_owned())
        })
    });
    let (dispersion, dispersion_file) = dispersion.unzip();
    let dispersion = dispersion.flatten();
    let plan_file = plan_file(path, &raw.plan, place, dispersion.as_ref(), &mut findings);
    let stem = path.file_stem().map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
    let resolved = vehicle.as_ref().map(|v| &v.resolved);
    let listed = plan_file.as_ref().map(|(_, _, listed)| listed);
    let Run { definition, corners } =
        scenario::run::resolve(&raw, &stem, resolved, dispersion.as_ref(), listed, findings)?;
    // What could not be read is among the problems already returned.
    let missing = || Problems::input(&name, "", "an incomplete scenario", "all its files");
    let (vehicle, dispersion) = (vehicle.ok_or_else(missing)?, dispersion.ok_or_else(missing)?);
    let dispersion_file = dispersion_file.ok_or_else(missing)?;
    Ok(Loaded {
        vehicle: vehicle.resolved,
        dispersion,
        definition,
        corners,
        gates,
        run: (name, text),
        vehicle_file: vehicle.text,
        dispersion_file,
        modal_package: vehicle.modal_package,
        plan_file,
    })
}

/// The plan file of a run, where its plan has one and it can be understood.
fn plan_file(
    run: &Path,
    plan: &PlanFile,
    place: Place<'_>,
    dispersion: Option<&Dispersion>,
    findings: &mut table::Findings,
) -> Option<(Format, Vec<u8>, Listed)> {
    let PlanFile::File { path, columns } = plan else { return None };
    let copy = inputs::PLANS.iter().find(|(_, format)| Format::of(path) == Some(*format));
    let Some((copy, _)) = copy else {
        findings.push("plan.path", format!("\"{path}\""), "a name in `.csv` or `.parquet`");
        return None;
    };
    let found = place.find(run, path, copy);
    let scores = *columns == Some(ColumnsFile::NormalScore);
    // Its columns are only understood against the dispersion.
    let dispersion = dispersion?;
    named((path, &found), "plan.path", place, findings, |file| {
        listed::load(file, scores, dispersion)
    })
}

/// Reads what a file names at `key`, given what stands there and the path that is meant; its
/// problems go to `findings`.
fn named<T>(
    (text, path): (&str, &Path),
    key: &str,
    place: Place<'_>,
    findings: &mut table::Findings,
    read: impl FnOnce(&Path) -> Result<T, Problems>,
) -> Option<T> {
    if text.is_empty() {
        findings.push(key, "an empty text", "a path relative to this file");
        return None;
    }
    if let Some(allowed) = place.refusal(path) {
        findings.push(key, format!("\"{text}\""), allowed);
        return None;
    }
    if !path.exists() {
        let found = format!("\"{}\", which does not exist", path.display());
        findings.push(key, found, "a path relative to this file");
        return None;
    }
    read(path).map_err(|problems| findings.extend(problems)).ok()
}

#[cfg(test)]
mod tests {
    use super::super::{files, scaffold};
    use super::*;
    use crate::problem::Kind;

    /// A scaffold whose file `name` has the first `from` replaced by `to`.
    fn edited(name: &str, from: &str, to: &str) -> (tempfile::TempDir, PathBuf) {
        let place = tempfile::tempdir().unwrap();
        let study = place.path().join("study");
        scaffold::write(&study).unwrap();
        edit(&study.join(name), from, to);
        (place, study)
    }

    fn edit(path: &Path, from: &str, to: &str) {
        let text = files::read_text(path).unwrap();
        assert!(text.contains(from), "{from}");
        files::write(path, text.replacen(from, to, 1).as_bytes()).unwrap();
    }

    fn problems(study: &Path) -> Problems {
        load(&study.join("runs/reference.toml"), Reach::Study).expect_err("a problem")
    }

    #[test]
    fn a_run_loads_with_the_texts_of_its_files_and_a_vehicle_by_folder_or_file() {
        let (_place, study) = edited("runs/smoke.toml", "sls-like\"", "sls-like/vehicle.toml\"");
        let loaded = load(&study.join("runs/smoke.toml"), Reach::Study).unwrap();
        assert_eq!(loaded.definition.name, "smoke");
        for (name, text) in [&loaded.run, &loaded.vehicle_file, &loaded.dispersion_file] {
            assert_eq!(&files::read_text(Path::new(name)).unwrap(), text);
        }
        let by_folder = vehicle(&study.join("vehicles/sls-like"), Reach::Study).unwrap();
        assert!(by_folder.text.1 == loaded.vehicle_file.1);
        let reference = load(&study.join("runs/reference.toml"), Reach::Study).unwrap();
        assert!(reference.gates.unwrap().ends_with("reference.gates.toml"));
    }

    #[test]
    fn problems_of_all_files_of_a_run_are_reported_at_once() {
        let (_place, study) = edited("runs/reference.toml", "cases = 2000", "cases = -1");
        edit(&study.join("vehicles/sls-like/vehicle.toml"), "mass_kg = 8100.0", "mass_kg = -1.0");
        edit(&study.join("dispersions/reference.toml"), "apply = ", "aply = ");
        edit(&study.join("runs/reference.gates.toml"), "statistic = ", "statistik = ");
        let problems = problems(&study);
        let places: Vec<(bool, &str)> = problems
            .0
            .iter()
            .map(|p| (p.file.ends_with("reference.toml"), p.key.as_str()))
            .collect();
        assert!(places.contains(&(true, "cases")), "{places:?}");
        assert!(places.contains(&(false, "engine[0].nozzle.mass_kg")), "{places:?}");
        assert!(places.contains(&(true, "row[0].aply")), "{places:?}");
        assert!(problems.0.iter().any(|p| p.file.ends_with("gates.toml")), "{problems}");
        assert_eq!(problems.kind(), Kind::Input);
    }

    #[test]
    fn a_file_that_does_not_exist_is_named_where_it_is_asked_for() {
        for (key, from) in [
            ("vehicle", "../vehicles/sls-like"),
            ("dispersion", "../dispersions/reference.toml"),
            ("gates", "reference.gates.toml"),
        ] {
            let (_place, study) = edited("runs/reference.toml", from, "nowhere.toml");
            let problems = problems(&study);
            assert_eq!((problems.0.len(), problems.0[0].key.as_str()), (1, key), "{problems}");
        }
        assert!(load(Path::new("no/such/run.toml"), Reach::Study).is_err());
    }

    #[test]
    fn a_damaged_package_is_damage_and_an_absent_one_is_input() {
        let (_place, study) = edited("runs/smoke.toml", "seed = 1", "seed = 2");
        let shapes = study.join("vehicles/sls-like/modes/tables/shapes.parquet");
        files::write(&shapes, b"PAR1 cut short").unwrap();
        assert_eq!(problems(&study).kind(), Kind::Damage);
        let (_place, study) = edited("vehicles/sls-like/vehicle.toml", "\"modes\"", "\"moods\"");
        let problems = problems(&study);
        assert_eq!((problems.kind(), problems.0[0].key.as_str()), (Kind::Input, "modal_package"));
    }
}
