//! The import: from its description and the results of each flight time to the modal data.
//!
//! Types and ranges of single values are checked before, by `table`; which nodes a grid is made
//! from is found in `grids`.

mod grids;
#[cfg(test)]
mod tests;

use super::import_file::{BodyKind, FlightTimeFile, ImportFile, MassFile};
use super::names;
use super::table::Findings;
use crate::fem::Results;
use crate::import::made::{Made, MadeTime, Moved};
use crate::import::normalise::{self, Entry};
use crate::import::plausible::Look;
use crate::import::rigid::{self, RigidBody};
use crate::import::{Chosen, Frame, Model, Units};
use crate::problem::Problems;
use crate::structure::orientation::{self, Mass};
use crate::structure::{Thresholds, label};
use crate::vehicle::{Grid, MassProperties, Modal, Mode, ModeSet};
use faer::Mat;
use grids::Choice;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

/// Cosine of the angle between the given `aft` and `y` above which they are refused.
const SKEW: f64 = 1e-4;
/// Ratio of a declared mass to that of the files beyond which it is a slip of units.
const MASS_SLIP: f64 = 10.0;
/// Departure of a declared mass from that of the files above which it is reported.
const MASS_APART: f64 = 0.02;
/// Agreement of the grids' masses with the body's above which they must weigh the modes too.
const WHOLE_MASS: f64 = 0.02;
/// Departure of a generalised mass on the grids from 1 that lumping explains.
const LUMPING: f64 = 0.15;
/// Least relative difference of frequencies under which modes count as repeated.
const REPEATED: f64 = 1e-6;
/// Modes beyond those asked for that may be repetitions of the last: those of a body of revolution
/// come in pairs.
const PAIR: usize = 1;
/// Rounding of a slope over the greatest of its mode above which it is reported.
const COARSE: f64 = 0.01;
/// Misfit of a section over the greatest motion of its mode below which it tells nothing.
const QUIET: f64 = 0.01;

/// What was read of one flight time; nothing where it could not be read, which the findings know.
#[derive(Debug)]
pub struct Read {
    /// Results of the finite element program.
    pub results: Results,
    /// Entries of the mass matrix, where one is named.
    pub matrix: Option<Vec<Entry>>,
}

/// Makes modal data of what `file` asks for; `read` reads one of its flight times, of which one at a
/// time is held in memory, and tells the findings why it could not.
///
/// # Errors
/// All problems of the description, of the results, and of both together.
pub fn resolve(
    file: &ImportFile,
    mut read: impl FnMut(usize, &mut Findings) -> Option<Read>,
    mut findings: Findings,
) -> Result<Made, Problems> {
    let mut resolver = Resolver {
        file,
        findings: &mut findings,
        said: BTreeSet::new(),
        warnings: Vec::new(),
        sections: Vec::new(),
    };
    let made = resolver.resolve(&mut read);
    findings.finish(made)
}

struct Resolver<'a> {
    file: &'a ImportFile,
    findings: &'a mut Findings,
    /// Problems already found, so that each is said of its first flight time alone.
    said: BTreeSet<(String, String)>,
    warnings: Vec<String>,
    sections: Vec<(usize, Vec<Moved>)>,
}

impl Resolver<'_> {
    fn resolve(
        &mut self,
        read: &mut dyn FnMut(usize, &mut Findings) -> Option<Read>,
    ) -> Option<Made> {
        let file = self.file;
        let source = file.source.trim();
        if source.is_empty() || source.contains(char::is_control) {
            let found = format!("{:?}", file.source);
            self.findings.push("source", found, "a text on one line");
        }
        for (i, pair) in file.flight_time.windows(2).enumerate() {
            if !(pair[0].time_s < pair[1].time_s) {
                let found = format!("{} s after {} s", pair[1].time_s, pair[0].time_s);
                let key = format!("flight_time[{}].time_s", i + 1);
                self.findings.push(key, found, "ascending flight times");
            }
        }
        self.body();
        let names_hold = grids::check(file, self.findings);
        let units = file.units.units(file.wtmass).map_err(|(found, allowed)| {
            self.findings.push("wtmass", found, allowed);
        });
        let frame = self.frame(units.as_ref().ok());
        let (Ok(units), Some(frame)) = (units, frame) else {
            // What is wrong with the files is told all the same.
            (0..file.flight_time.len()).for_each(|i| drop(read(i, self.findings)));
            return None;
        };
        let mut made = Vec::new();
        for i in 0..file.flight_time.len() {
            let time = read(i, self.findings)
                .and_then(|read| self.time(i, read, &units, &frame, names_hold));
            made.push(time);
        }
        let (mut sets, times): (Vec<ModeSet>, Vec<MadeTime>) =
            made.into_iter().collect::<Option<Vec<_>>>()?.into_iter().unzip();
        self.same_grids(&sets);
        let thresholds = Thresholds { keep: file.modes.keep_overlap, ..Thresholds::default() };
        let parents = label::label(&mut sets, &thresholds);
        let sections = self.label_sections(&sets);
        let contains_engines = match file.body.kind {
            BodyKind::Reduced => Vec::new(),
            BodyKind::Integrated => file.body.engine.iter().map(|e| e.name.clone()).collect(),
        };
        Some(Made {
            modal: Modal {
                source: source.to_owned(),
                contains_engines,
                contains_tanks: file.body.contains_tanks.clone(),
                sets,
                parents,
            },
            thresholds,
            times,
            roles: grids::roles(file),
            sections,
            warnings: std::mem::take(&mut self.warnings),
        })
    }

    /// Adds a problem, unless an earlier flight time had the same.
    fn push(&mut self, key: &str, found: String, allowed: &str) {
        if self.said.insert((key.to_owned(), found.clone())) {
            self.findings.push(key, found, allowed);
        }
    }

    /// Adds a warning of a flight time, unless an earlier one had the same.
    fn warn(&mut self, time_s: f64, warning: String) {
        if self.said.insert((String::new(), warning.clone())) {
            self.warnings.push(format!("at {time_s} s: {warning}"));
        }
    }

    fn body(&mut self) {
        let body = &self.file.body;
        if body.kind == BodyKind::Integrated && body.engine.is_empty() {
            let allowed = "[[body.engine]] for each engine that the modes contain";
            self.findings.push("body.engine", "none, with kind = \"integrated\"", allowed);
        }
        names::unique(self.findings, "body.engine", body.engine.iter().map(|e| e.name.as_str()));
        let tanks = body.contains_tanks.iter().map(String::as_str);
        names::unique(self.findings, "body.contains_tanks", tanks);
        for (i, engine) in body.engine.iter().enumerate() {
            let parts = engine.name.split_once('.');
            if !parts.is_some_and(|(group, name)| names::is_word(group) && names::is_word(name)) {
                let found = format!("\"{}\"", engine.name);
                let key = format!("body.engine[{i}].name");
                self.findings.push(key, found, "`group.name` of an engine of the vehicle file");
            }
        }
    }

    fn frame(&mut self, units: Option<&Units>) -> Option<Frame> {
        let raw = &self.file.frame;
        let (aft, y) = (Vector3::from(raw.aft), Vector3::from(raw.y));
        let length_m = units.map_or(1.0, |u| u.length_m);
        let frame = Frame::new(Vector3::from(raw.origin) * length_m, aft, y, SKEW);
        if frame.is_none() {
            let found = format!("aft {:?} and y {:?}", raw.aft, raw.y);
            self.findings.push("frame", found, "two directions perpendicular to each other");
        }
        frame
    }

    /// One flight time; whatever can be found wrong with it is found at once.
    fn time(
        &mut self,
        i: usize,
        read: Read,
        units: &Units,
        frame: &Frame,
        names_hold: bool,
    ) -> Option<(ModeSet, MadeTime)> {
        let time = &self.file.flight_time[i];
        let key = format!("flight_time[{i}].results");
        let Read { mut results, matrix } = read;
        if let Some(matrix) = matrix {
            normalise::by_matrix(&mut results, &matrix)
                .map_err(|found| {
                    let allowed = "a symmetric matrix on freedoms with results";
                    self.push(&format!("flight_time[{i}].mass_matrix"), found, allowed);
                })
                .ok()?;
        }
        for (name, nodes) in &self.file.set {
            let mut nodes = nodes.clone();
            nodes.sort_unstable();
            nodes.dedup();
            let known = results.sets.insert(name.clone(), nodes.clone());
            if known.is_some_and(|known| known != nodes) {
                let found = "other nodes than the set of this name in the files".to_owned();
                self.push(&format!("set.{name}"), found, "another name");
            }
        }
        let (program, modes) = (results.program.clone(), results.modes.len());
        let mut model = Model::new(results, units, frame)
            .map_err(|faults| {
                for found in faults {
                    self.push(&key, found, "modes on grids whose positions and systems are known");
                }
            })
            .ok()?;
        let choices = if names_hold {
            grids::choose(self.file, &model, |key, found, allowed| self.push(&key, found, allowed))
        } else {
            None
        };
        let normalisation = self.file.modes.normalisation;
        let generalised = normalise::generalised(&mut model, normalisation, units.mass_kg);
        let generalised = generalised.map_err(|faults| {
            for found in faults {
                let allowed = "masses that agree with the normalisation, or another normalisation";
                self.push("modes.normalisation", found, allowed);
            }
        });
        let rigid = rigid::recognise(&model).map_err(|faults| {
            for found in faults {
                self.push(&key, found, "six rigid-body modes and elastic ones");
            }
        });
        let (generalised, rigid) = (generalised.ok()?, rigid.ok()?);
        let first_elastic_hz = model.modes[rigid.elastic[0]].frequency_hz;

        let by_modes = rigid::mass_properties(&model, &rigid, &generalised);
        let estimates: Vec<(&'static str, MassProperties)> =
            (by_modes.as_ref().ok().map(|(body, _)| ("rigid-body modes", *body)).into_iter())
                .chain(rigid::lumped(&model).map(|body| ("lumped masses", body)))
                .collect();
        let look = Look {
            extent_m: model.extent_m(),
            first_hz: first_elastic_hz,
            mass_kg: estimates.first().map(|(_, body)| body.mass_kg),
        };
        let judgement = look.judge(self.file.units, self.file.wtmass);
        for found in judgement.refused {
            self.push("units", found, "units in which the model is the size of a vehicle");
        }
        let doubts = judgement.doubtful.into_iter().chain(rigid.warnings.iter().cloned());
        for warning in std::mem::take(&mut model.warnings).into_iter().chain(doubts) {
            self.warn(time.time_s, warning);
        }
        let body = self.mass(i, time, &estimates, by_modes.err());
        let (mut kept, asked) = self.keep(time.time_s, &model, &rigid)?;
        let (choices, body) = (choices?, body?);
        let mut grids: Vec<_> = grids::package_grids(&choices, &model);
        let mut shapes: Vec<Mode> = (kept.iter())
            .map(|&place| {
                let mode = &model.modes[place];
                let scale = 1.0 / generalised[place].sqrt();
                let (shape, slope) = choices
                    .iter()
                    .map(|choice| {
                        let (shape, slope) = choice.motion(mode, model.rounding);
                        (shape * scale, slope * scale)
                    })
                    .unzip();
                let frequency_hz = mode.frequency_hz;
                Mode { label: String::new(), frequency_hz, shape, slope }
            })
            .collect();
        let positions: Vec<_> = grids.iter().map(|g| g.position_m).collect();
        let apart = self.file.modes.repeated.unwrap_or(REPEATED.max(8.0 * model.rounding));
        orient(&mut shapes, &positions, apart);
        shapes.truncate(asked);
        kept.truncate(asked);
        if !shapes.iter().all(is_finite) {
            let found = "modes that are not finite once normalised".to_owned();
            self.push(&key, found, "numbers of the size of a vehicle");
            return None;
        }
        if masses_contradict(&grids, &body, &shapes) {
            self.warn(
                time.time_s,
                "the lumped masses of the chosen nodes are the whole mass, and yet give some modes a \
                 generalised mass far from 1: they are left out of the package"
                    .to_owned(),
            );
            for grid in &mut grids {
                (grid.mass_kg, grid.inertia_kg_m2) = (Vector3::zeros(), Vector3::zeros());
            }
        }
        self.quality(time.time_s, &model, &generalised, &kept, &choices, &shapes);
        let chosen = choices.iter().map(|c| Chosen { grid: c.name.clone(), from: c.from.clone() });
        let made = MadeTime {
            flight_time_s: time.time_s,
            program,
            grids: model.ids.len(),
            modes,
            first_elastic_hz,
            estimates,
            chosen: chosen.collect(),
            rigid,
        };
        let modes = shapes;
        Some((ModeSet { flight_time_s: time.time_s, body, grids, modes }, made))
    }

    /// Mass properties as the description asks for them, compared with what the files hold.
    fn mass(
        &mut self,
        i: usize,
        time: &FlightTimeFile,
        estimates: &[(&'static str, MassProperties)],
        no_modes: Option<String>,
    ) -> Option<MassProperties> {
        let key = format!("flight_time[{i}].mass");
        let by = |name: &str| estimates.iter().find(|(by, _)| *by == name).map(|(_, body)| *body);
        let body = match &time.mass {
            MassFile::Declared { mass_kg, cg_m, inertia_kg_m2 } => {
                let rows = inertia_kg_m2;
                let inertia = Matrix3::from_fn(|r, c| rows[r][c]);
                let size = inertia.norm();
                if !((inertia - inertia.transpose()).norm() <= 1e-9 * size)
                    || inertia.cholesky().is_none()
                {
                    let found = format!("{rows:?}");
                    let key = format!("{key}.inertia_kg_m2");
                    self.push(&key, found, "a symmetric, positive definite tensor");
                    return None;
                }
                let cg_m = Vector3::from(*cg_m);
                MassProperties { mass_kg: *mass_kg, cg_m, inertia_kg_m2: inertia }
            }
            MassFile::RigidBodyModes => match by("rigid-body modes") {
                Some(body) => body,
                None => {
                    let found = no_modes.unwrap_or_default();
                    let allowed = "six rigid-body modes of a body, or a declared mass";
                    self.push(&format!("{key}.from"), found, allowed);
                    return None;
                }
            },
            MassFile::LumpedMasses => match by("lumped masses") {
                Some(body) => body,
                None => {
                    let allowed = "files that list the masses of all grids, or a declared mass";
                    self.push(&format!("{key}.from"), "no lumped masses".to_owned(), allowed);
                    return None;
                }
            },
        };
        let engines = self.engine_mass_kg();
        if self.file.body.kind == BodyKind::Integrated && !(engines < body.mass_kg) {
            let found = format!("{engines} kg of engines in {:.5e} kg", body.mass_kg);
            self.push("body.engine", found, "engines lighter than the body that contains them");
        }
        for (by, found) in estimates {
            self.compare(&key, time.time_s, &body, by, found);
        }
        Some(body)
    }

    /// Mass of the engines declared with theirs, kg.
    fn engine_mass_kg(&self) -> f64 {
        self.file.body.engine.iter().filter_map(|e| e.mass_kg).sum()
    }

    /// Compares the mass properties of the package with those that the files hold, and tells a
    /// reduced body from an integrated one by the engines' masses.
    fn compare(
        &mut self,
        key: &str,
        time_s: f64,
        body: &MassProperties,
        by: &str,
        found: &MassProperties,
    ) {
        let declared = &self.file.body;
        let engines = self.engine_mass_kg();
        let (other, word) = match declared.kind {
            BodyKind::Reduced => (body.mass_kg + engines, "with the engines"),
            BodyKind::Integrated => (body.mass_kg - engines, "without the engines"),
        };
        let apart = |mass: f64| (found.mass_kg - mass).abs();
        if engines > 0.0 && apart(other) < apart(body.mass_kg) {
            let said = format!(
                "{:.5e} kg by the {by}, nearer to the {other:.5e} kg of a body {word} than to the \
                 declared {:.5e} kg",
                found.mass_kg, body.mass_kg
            );
            let allowed = match declared.kind {
                BodyKind::Reduced => "modes without the engines, or body.kind = \"integrated\"",
                BodyKind::Integrated => "modes with the engines, or body.kind = \"reduced\"",
            };
            self.push(key, said, allowed);
        } else if !(apart(body.mass_kg) <= MASS_APART * body.mass_kg) {
            let said = format!(
                "the {by} give {:.5e} kg, the package says {:.5e} kg",
                found.mass_kg, body.mass_kg
            );
            let ratio = found.mass_kg / body.mass_kg;
            if (1.0 / MASS_SLIP..=MASS_SLIP).contains(&ratio) {
                self.warn(time_s, said);
            } else {
                self.push(key, said, "masses of one model in the units declared");
            }
        }
        let radius = (body.inertia_kg_m2.trace() / body.mass_kg).sqrt();
        let moved = (found.cg_m - body.cg_m).norm();
        if !(moved <= MASS_APART * radius) {
            self.warn(
                time_s,
                format!("by the {by} the cg is {moved:.3} m from that of the package"),
            );
        }
        let inertia = (found.inertia_kg_m2 - body.inertia_kg_m2).norm();
        if !(inertia <= 2.0 * MASS_APART * body.inertia_kg_m2.norm()) {
            let share = 100.0 * inertia / body.inertia_kg_m2.norm();
            self.warn(
                time_s,
                format!("by the {by} the inertia is {share:.1} % from that of the package"),
            );
        }
    }

    /// Places of the elastic modes, and how many of them the description asks for.
    fn keep(
        &mut self,
        time_s: f64,
        model: &Model,
        rigid: &RigidBody,
    ) -> Option<(Vec<usize>, usize)> {
        let asked = &self.file.modes;
        let hz = |&place: &usize| model.modes[place].frequency_hz;
        let asked = (rigid.elastic.iter())
            .take_while(|place| asked.max_hz.is_none_or(|most| hz(place) <= most))
            .take(asked.count.unwrap_or(usize::MAX))
            .count();
        if asked == 0 {
            let found = format!(
                "no elastic mode up to {} Hz at {time_s} s, the first at {} Hz",
                self.file.modes.max_hz.unwrap_or(f64::INFINITY),
                hz(&rigid.elastic[0])
            );
            self.push("modes.max_hz", found, "a frequency above the first elastic mode");
            return None;
        }
        // A pair of repeated modes is oriented as a pair, even where the count cuts through it.
        let some = rigid.elastic.len().min(asked + PAIR);
        Some((rigid.elastic[..some].to_vec(), asked))
    }

    /// Quality of the sections' rotations, kept and, beyond the bound, told.
    fn quality(
        &mut self,
        time_s: f64,
        model: &Model,
        generalised: &[f64],
        kept: &[usize],
        choices: &[Choice],
        modes: &[Mode],
    ) {
        let bound = self.file.modes.residual_bound;
        let greatest =
            |vectors: &[Vector3<f64>]| vectors.iter().map(Vector3::norm).fold(0.0, f64::max);
        let scales: Vec<(f64, f64)> =
            modes.iter().map(|m| (greatest(&m.shape), greatest(&m.slope))).collect();
        let mut all = Vec::new();
        let mut coarse: Option<(f64, f64, String, f64)> = None;
        for choice in choices {
            let Some(section) = &choice.section else { continue };
            let mut beyond: Vec<(f64, f64)> = Vec::new();
            for (j, &place) in kept.iter().enumerate() {
                let mode = &model.modes[place];
                let scale = 1.0 / generalised[place].sqrt();
                let fit = section.fit(&mode.shape, model.rounding);
                if fit.residual > bound && fit.misfit * scale > QUIET * scales[j].0 {
                    beyond.push((fit.residual, mode.frequency_hz));
                }
                let rounding = fit.rounding * scale;
                let share = if scales[j].1 > 0.0 { rounding / scales[j].1 } else { 0.0 };
                if coarse.as_ref().is_none_or(|(worst, ..)| share > *worst) {
                    coarse = Some((share, rounding, choice.name.clone(), mode.frequency_hz));
                }
                all.push(Moved {
                    flight_time_s: time_s,
                    grid: choice.name.clone(),
                    // The place of the mode until it has its label.
                    label: j.to_string(),
                    nodes: section.nodes.len(),
                    residual: fit.residual,
                    scatter: fit.scatter * scale,
                    rounding,
                });
            }
            let worst = beyond.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((residual, hz)) = worst {
                self.warn(
                    time_s,
                    format!(
                        "the {} nodes of `{}` do not move as one in {} of {} modes: residual up to \
                         {residual:.2} at {hz:.3} Hz, above the bound {bound}",
                        section.nodes.len(),
                        choice.name,
                        beyond.len(),
                        kept.len()
                    ),
                );
            }
        }
        if model.rounding > f64::EPSILON {
            let stored = if model.rounding == f64::from(f32::EPSILON) / 2.0 {
                "single precision (32 bits)".to_owned()
            } else {
                format!("text of {} digits", (1.0 - (2.0 * model.rounding).log10()).round())
            };
            let effect = match coarse {
                None => "no slope is made from translations, so that it does no harm".to_owned(),
                Some((share, rounding, grid, hz)) => format!(
                    "the rounding of translations is at most {rounding:.1e} rad/m kg^-1/2 in a slope, \
                     {:.2} % of the greatest slope of that mode (`{grid}`, {hz:.3} Hz){}",
                    100.0 * share,
                    if share > COARSE { ": use double precision or wider sections" } else { "" }
                ),
            };
            self.warn(time_s, format!("shapes are stored in {stored}: {effect}"));
        }
        self.sections.push((self.sections.len(), all));
    }

    /// Gives the sections' rows the labels of their modes.
    fn label_sections(&mut self, sets: &[ModeSet]) -> Vec<Moved> {
        let mut rows = Vec::new();
        for (at, moved) in std::mem::take(&mut self.sections) {
            rows.extend(moved.into_iter().map(|mut row| {
                let place: usize = row.label.parse().unwrap_or_default();
                row.label.clone_from(&sets[at].modes[place].label);
                row
            }));
        }
        rows
    }

    /// Grids are the same at every flight time by construction; where they moved, say how far.
    fn same_grids(&mut self, sets: &[ModeSet]) {
        let Some(first) = sets.first() else { return };
        for set in &sets[1..] {
            let moved = (first.grids.iter().zip(&set.grids))
                .map(|(a, b)| ((a.position_m - b.position_m).norm(), &a.name))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((distance, name)) = moved.filter(|(d, _)| *d > 1e-6) {
                let said = format!(
                    "grid `{name}` lies {distance:.4} m from where it is at {} s",
                    first.flight_time_s
                );
                self.warn(set.flight_time_s, said);
            }
        }
    }
}

fn is_finite(mode: &Mode) -> bool {
    mode.shape.iter().chain(&mode.slope).flat_map(|v| v.iter()).all(|x| x.is_finite())
}

/// Whether the masses of the grids are those of the whole body and still do not give every mode its
/// unit generalised mass, as where sections of many nodes do not move as one. A package of such
/// masses is refused by its reader, whose bounds these are.
fn masses_contradict(grids: &[Grid], body: &MassProperties, modes: &[Mode]) -> bool {
    let total: f64 = grids.iter().map(|g| g.mass_kg.x).sum();
    let generalised = |mode: &Mode| -> f64 {
        (grids.iter().zip(mode.shape.iter().zip(&mode.slope)))
            .map(|(g, (phi, psi))| {
                g.mass_kg.dot(&phi.component_mul(phi))
                    + g.inertia_kg_m2.dot(&psi.component_mul(psi))
            })
            .sum()
    };
    (total / body.mass_kg - 1.0).abs() <= WHOLE_MASS
        && !modes.iter().all(|mode| (generalised(mode) - 1.0).abs() <= LUMPING)
}

/// Orients repeated modes and fixes signs on the grids of the package, each weighing the same.
/// Consecutive frequencies within the relative distance `apart` are repeated.
fn orient(modes: &mut [Mode], positions_m: &[Vector3<f64>], apart: f64) {
    let n = 6 * positions_m.len();
    let mut shapes = Mat::from_fn(n, modes.len(), |i, j| {
        let (grid, k) = (i / 6, i % 6);
        if k < 3 { modes[j].shape[grid][k] } else { modes[j].slope[grid][k - 3] }
    });
    let mut mu: Vec<f64> = modes.iter().map(|m| m.frequency_hz.powi(-2)).collect();
    for j in 1..mu.len() {
        if (modes[j].frequency_hz / modes[j - 1].frequency_hz - 1.0).abs() <= apart {
            mu[j] = mu[j - 1];
        }
    }
    orientation::orient(&mu, &mut shapes, Mass::Diagonal(&vec![1.0; n]), positions_m);
    for (j, mode) in modes.iter_mut().enumerate() {
        for grid in 0..positions_m.len() {
            mode.shape[grid] = Vector3::from_fn(|k, _| shapes[(6 * grid + k, j)]);
            mode.slope[grid] = Vector3::from_fn(|k, _| shapes[(6 * grid + 3 + k, j)]);
        }
    }
}
