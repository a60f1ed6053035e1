//! The run: from the run file to a validated definition, given its vehicle and dispersion.
//!
//! Types and ranges of single values are checked before, by `table`.

use super::run_file::{
    CornerFile, EnvelopeFile, FeedbackFile, MarginsFile, NozzleJetFile, RunFile, SignsFile,
    SlopeFile, VariantFile,
};
use super::table::Findings;
use super::vehicle::Resolved;
use super::{fixed, names, pattern, plan};
use crate::campaign::definition::{Feedback, Solver};
use crate::campaign::{Definition, LoopPlan, NozzleJet, Population, Slope, Variant};
use crate::dispersion::{Dispersion, Draw, Listed, Scheme};
use crate::margins::Settings;
use crate::problem::Problems;
use crate::spelling::allowed_instead;

/// An adverse corner whose signs the campaign has to evaluate before its populations are run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Corner {
    /// Index of the fixed case among the populations; the Monte Carlo around it, if any, follows.
    pub population: usize,
    /// Name, for messages.
    pub name: String,
    /// Indices of the draws that stand at one of their `worst` values, ascending.
    pub draws: Vec<usize>,
    /// Index of the mode whose damping is made least.
    pub mode: usize,
    /// Index of the variant in which it is made least.
    pub variant: usize,
}

impl Corner {
    /// Indices of the populations whose fixed values are still to be evaluated: the fixed case, and
    /// the Monte Carlo around it if there is one.
    pub fn populations<'a>(&'a self, all: &'a [Population]) -> impl Iterator<Item = usize> + 'a {
        let around = around(&self.name);
        let follows = move |i: &usize| all.get(*i).is_some_and(|p| p.name == around);
        std::iter::once(self.population).chain(Some(self.population + 1).filter(follows))
    }
}

/// A validated run: its definition, and the corners whose signs are still to be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The definition; populations of the corners below have no fixed values yet.
    pub definition: Definition,
    /// Corners with evaluated signs.
    pub corners: Vec<Corner>,
}

/// Populations that every run has.
const STANDARD: [&str; 2] = ["nominal", "dispersed"];

/// Checks what the values of `file` mean together and with its vehicle and dispersion. Without
/// those (where they could not be read, which `findings` knows) the rest is still checked. `listed`
/// are the cases of its plan file.
///
/// # Errors
/// All problems of the file.
pub fn resolve(
    file: &RunFile,
    name: &str,
    vehicle: Option<&Resolved>,
    dispersion: Option<&Dispersion>,
    listed: Option<&Listed>,
    mut findings: Findings,
) -> Result<Run, Problems> {
    let f = &mut findings;
    let variants: Vec<Variant> = file.variant.iter().map(variant).collect();
    for (i, variant) in variants.iter().enumerate() {
        names::word(f, &format!("variant[{i}].name"), &variant.name);
    }
    names::unique(f, "variant", variants.iter().map(|v| v.name.as_str()));
    let flight_times_s = flight_times(file, vehicle, f);
    modes(file, vehicle, &flight_times_s, f);
    let gimballed = gimballed(file, vehicle, f);
    servo(&variants, vehicle, &gimballed, f);
    let margins = file.margins.as_ref().map(|margins| loops(margins, &variants, vehicle, f));

    let standard = |name: &str, cases, drawn, scheme| Population {
        name: name.into(),
        cases,
        fixed: Vec::new(),
        drawn,
        scheme,
    };
    let (scheme, cases) = plan::scheme(file, dispersion, listed, f);
    let mut populations = vec![
        standard(STANDARD[0], 1, false, Scheme::MonteCarlo),
        standard(STANDARD[1], cases, true, scheme),
    ];
    let mut corners = Vec::new();
    for (i, corner) in file.corner.iter().enumerate() {
        let key = format!("corner[{i}]");
        names::word(f, &format!("{key}.name"), &corner.name);
        let same = |a: &str, b: &str| a == b || a == around(b) || around(a) == b;
        if populations.iter().any(|p| same(&p.name, &corner.name)) {
            let found = format!("\"{}\"", corner.name);
            f.push(format!("{key}.name"), found, "a name that no other population has");
        }
        let fixed = match corner.signs {
            SignsFile::Given => given(corner, &key, dispersion, f),
            SignsFile::Evaluated => {
                corners.extend(evaluated(file, corner, &key, populations.len(), dispersion, f));
                Vec::new()
            }
        };
        let fixed_case =
            Population { fixed, ..standard(&corner.name, 1, false, Scheme::MonteCarlo) };
        if corner.cases > 0 {
            let name = around(&corner.name);
            let cloud = Population { name, cases: corner.cases, drawn: true, ..fixed_case.clone() };
            populations.extend([fixed_case, cloud]);
        } else {
            populations.push(fixed_case);
        }
    }
    let fixed = fixed::populations(file, &populations, dispersion, f);
    populations.extend(fixed);
    let sensitivity = fixed::sensitivity(file, &variants, &flight_times_s, f);
    findings.finish(Some(Run {
        definition: Definition {
            name: name.into(),
            seed: file.seed,
            populations,
            flight_times_s,
            variants,
            modes: file.modes.clone(),
            gimballed,
            exchange_ratio: file.identity.exchange_ratio,
            solver: Solver::Structured,
            sensitivity,
            margins,
        },
        corners,
    }))
}

/// Name of the Monte Carlo population around a corner.
fn around(corner: &str) -> String {
    format!("{corner}_dispersed")
}

fn variant(file: &VariantFile) -> Variant {
    Variant {
        name: file.name.clone(),
        thrust: file.thrust,
        case_jet_damping: file.case_jet_damping,
        nozzle_jet_damping: match file.nozzle_jet_damping {
            NozzleJetFile::Off => NozzleJet::Off,
            NozzleJetFile::Equation13 => NozzleJet::Linear,
            NozzleJetFile::RigidNozzle => NozzleJet::RigidNozzle,
        },
        follower_thrust: file.follower_thrust,
        slope: match file.slope {
            SlopeFile::VirtualGrid => Slope::VirtualGrid,
            SlopeFile::SingleGrid => Slope::SingleGrid,
        },
        rigid_body: file.rigid_body,
        slosh: file.slosh,
        aerodynamics: file.aerodynamics,
        feedback: match file.feedback {
            FeedbackFile::Open => Feedback::Open,
            FeedbackFile::Closed => Feedback::Closed,
            FeedbackFile::Inverted => Feedback::Inverted,
        },
        actuators: file.actuators.clone(),
    }
}

fn flight_times(file: &RunFile, vehicle: Option<&Resolved>, f: &mut Findings) -> Vec<f64> {
    let known = vehicle.map(|v| v.flight_times_s.as_slice());
    let Some(times) = &file.flight_times_s else { return known.unwrap_or_default().to_vec() };
    names::ascending(f, "flight_times_s", times);
    if let Some(known) = known {
        for (i, time) in times.iter().enumerate().filter(|(_, t)| !known.contains(t)) {
            let allowed = format!("a flight time of the vehicle, one of {known:?} s");
            f.push(format!("flight_times_s[{i}]"), format!("{time} s"), allowed);
        }
    }
    times.clone()
}

/// Every mode of interest is named by the vehicle and has a label at every flight time.
fn modes(file: &RunFile, vehicle: Option<&Resolved>, times: &[f64], f: &mut Findings) {
    let Some(vehicle) = vehicle.map(|v| &v.vehicle) else { return };
    for (i, name) in file.modes.iter().enumerate() {
        let key = format!("modes[{i}]");
        if file.modes[..i].contains(name) {
            f.push(&key, format!("\"{name}\" again"), "each mode once");
        }
        let Some(mode) = vehicle.named_modes.iter().find(|m| m.name == *name) else {
            let known = vehicle.named_modes.iter().map(|m| m.name.as_str());
            f.push(&key, format!("\"{name}\""), allowed_instead(name, known));
            continue;
        };
        let sets = times.iter().filter_map(|t| vehicle.modal.at(*t));
        for set in sets.filter(|set| mode.labels.iter().all(|label| set.mode(label).is_none())) {
            let found = format!("\"{name}\", without a label at {} s", set.flight_time_s);
            let allowed =
                "a mode with a label of the modal package at every flight time of the run";
            f.push(&key, found, allowed);
        }
    }
}

fn gimballed(file: &RunFile, vehicle: Option<&Resolved>, f: &mut Findings) -> Vec<bool> {
    let Some(vehicle) = vehicle.map(|v| &v.vehicle) else { return Vec::new() };
    let paths: Vec<String> = vehicle.engines.iter().map(|e| e.path()).collect();
    for (i, entry) in file.gimballed.iter().enumerate() {
        if !paths.iter().any(|path| pattern::matches(entry, path)) {
            let allowed = allowed_instead(entry, paths.iter().map(String::as_str));
            f.push(
                format!("gimballed[{i}]"),
                format!("\"{entry}\", which matches no engine"),
                allowed,
            );
        }
    }
    let chosen = |path: &String| file.gimballed.iter().any(|entry| pattern::matches(entry, path));
    paths.iter().map(chosen).collect()
}

/// Variants name sets of actuators that exist, and close loops that the vehicle has.
fn servo(variants: &[Variant], vehicle: Option<&Resolved>, gimballed: &[bool], f: &mut Findings) {
    let Some(vehicle) = vehicle.map(|v| &v.vehicle) else { return };
    let sets = vehicle.actuator_sets();
    for (i, variant) in variants.iter().enumerate() {
        if let Some(set) = variant.actuators.as_deref().filter(|set| !sets.contains(set)) {
            let allowed = allowed_instead(set, sets.iter().copied());
            f.push(format!("variant[{i}].actuators"), format!("\"{set}\""), allowed);
        }
        if variant.feedback == Feedback::Open {
            continue;
        }
        let key = format!("variant[{i}].feedback");
        let Some(autopilot) = &vehicle.autopilot else {
            f.push(key, "a closed loop on a vehicle without an autopilot", "open");
            continue;
        };
        let mut gimbals = autopilot.allocation.gimbals.iter();
        if let Some((engine, _)) = gimbals.find(|(engine, _)| !gimballed[*engine]) {
            let path = vehicle.engines[*engine].path();
            let found = format!("a loop through the locked engine \"{path}\"");
            let allowed = "open, or a run that gimbals every engine of the allocation";
            f.push(key, found, allowed);
        }
    }
}

/// Which loops are assessed, and where.
fn loops(
    file: &MarginsFile,
    variants: &[Variant],
    vehicle: Option<&Resolved>,
    f: &mut Findings,
) -> LoopPlan {
    if vehicle.is_some_and(|v| v.vehicle.autopilot.is_none()) {
        f.push("margins", "loops of a vehicle without an autopilot", "a vehicle with an autopilot");
    }
    let index = |name: &String| variants.iter().position(|variant| variant.name == *name);
    let mut chosen: Vec<usize> = match &file.variants {
        None => (0..variants.len()).filter(|&v| variants[v].feedback != Feedback::Open).collect(),
        Some(names) => {
            for (i, name) in names.iter().enumerate().filter(|(_, name)| index(name).is_none()) {
                let known = variants.iter().map(|variant| variant.name.as_str());
                let allowed = allowed_instead(name, known);
                f.push(format!("margins.variants[{i}]"), format!("\"{name}\""), allowed);
            }
            names.iter().filter_map(index).collect()
        }
    };
    chosen.sort_unstable();
    chosen.dedup();
    if chosen.is_empty() {
        let allowed = "a variant with feedback, or `variants`";
        f.push("margins", "no variant whose loops are assessed", allowed);
    }
    if !(file.highest_hz > file.lowest_hz) {
        f.push("margins.highest_hz", file.highest_hz.to_string(), "above `lowest_hz`");
    }
    let envelope_hz = file.envelope.as_ref().map_or(Vec::new(), |envelope| {
        let EnvelopeFile { from_hz, to_hz, count } = *envelope;
        if !(from_hz >= file.lowest_hz && to_hz > from_hz && to_hz <= file.highest_hz) {
            let found = format!("{from_hz} to {to_hz} Hz");
            f.push("margins.envelope", found, "an interval from `lowest_hz` to `highest_hz`");
            return Vec::new();
        }
        let step = (to_hz / from_hz).ln() / f64::from(count - 1);
        (0..count).map(|i| from_hz * (step * f64::from(i)).exp()).collect()
    });
    LoopPlan {
        settings: Settings {
            gain_margin_db: file.gain_margin_db,
            phase_margin_deg: file.phase_margin_deg,
            lowest_hz: file.lowest_hz,
            highest_hz: file.highest_hz,
            points_per_decade: file.points_per_decade,
            light_damping_ratio: file.light_damping_ratio,
        },
        variants: chosen,
        envelope_hz,
    }
}

/// Fixed values of a corner whose signs the file gives, in the order of the draw keys.
fn given(
    corner: &CornerFile,
    key: &str,
    dispersion: Option<&Dispersion>,
    f: &mut Findings,
) -> Vec<(usize, f64)> {
    for (name, value) in [("mode", &corner.mode), ("variant", &corner.variant)] {
        if let Some(value) = value {
            let allowed = "nothing, or signs = \"evaluated\"";
            f.push(format!("{key}.{name}"), format!("\"{value}\""), allowed);
        }
    }
    if let Some(keys) = &corner.keys {
        let found = format!("{} entries", keys.len());
        f.push(format!("{key}.keys"), found, "nothing, or signs = \"evaluated\"");
    }
    if corner.low.is_empty() && corner.high.is_empty() {
        f.push(key, "neither `low` nor `high`", "at least one entry in `low` or `high`");
    }
    let Some(dispersion) = dispersion else { return Vec::new() };
    let low = matching(dispersion, &corner.low, has_worst, &format!("{key}.low"), f);
    let high = matching(dispersion, &corner.high, has_worst, &format!("{key}.high"), f);
    let both: Vec<usize> = low.iter().copied().filter(|i| high.contains(i)).collect();
    if let Some(&first) = both.first() {
        let key_of = &dispersion.draws()[first].key;
        let found = format!("{} keys that are in `low` as well, first \"{key_of}\"", both.len());
        f.push(format!("{key}.high"), found, "each key on one side");
    }
    let side = |side: usize| move |i: usize| Some((i, dispersion.draws()[i].worst?[side]));
    let mut fixed: Vec<(usize, f64)> = low.into_iter().filter_map(side(0)).collect();
    fixed.extend(high.into_iter().filter_map(side(1)));
    fixed.sort_by_key(|(index, _)| *index);
    fixed
}

/// Whether a draw has `worst` values.
pub(super) fn has_worst(draw: &Draw) -> bool {
    draw.worst.is_some()
}

/// Indices of the draws for which `fits` that `entries` name, ascending; an entry is a whole
/// key or a pattern of its parameter path.
pub(super) fn matching(
    dispersion: &Dispersion,
    entries: &[String],
    fits: fn(&Draw) -> bool,
    place: &str,
    f: &mut Findings,
) -> Vec<usize> {
    let names = |entry: &str, key: &str| {
        key == entry || pattern::matches(entry, key.split(" @ ").next().unwrap_or(key))
    };
    let adverse = || dispersion.draws().iter().enumerate().filter(|(_, d)| fits(d));
    for (i, entry) in entries.iter().enumerate() {
        if !adverse().any(|(_, draw)| names(entry, &draw.key)) {
            let allowed = allowed_instead(entry, adverse().map(|(_, d)| d.key.as_str()));
            let found = format!("\"{entry}\", which matches no draw key that can stand there");
            f.push(format!("{place}[{i}]"), found, allowed);
        }
    }
    let chosen = adverse().filter(|(_, draw)| entries.iter().any(|e| names(e, &draw.key)));
    chosen.map(|(i, _)| i).collect()
}

/// A corner whose signs are evaluated.
fn evaluated(
    file: &RunFile,
    corner: &CornerFile,
    key: &str,
    population: usize,
    dispersion: Option<&Dispersion>,
    f: &mut Findings,
) -> Option<Corner> {
    for (list, entries) in [("low", &corner.low), ("high", &corner.high)] {
        if !entries.is_empty() {
            let found = format!("{} entries", entries.len());
            f.push(format!("{key}.{list}"), found, "nothing, or signs = \"given\"");
        }
    }
    let mut index = |name: &str, value: &Option<String>, known: Vec<&str>| {
        let found = value.as_deref().map_or("nothing".into(), |v| format!("\"{v}\""));
        let at = known.iter().position(|k| Some(*k) == value.as_deref());
        if at.is_none() {
            let allowed = allowed_instead(value.as_deref().unwrap_or(""), known);
            f.push(format!("{key}.{name}"), found, allowed);
        }
        at
    };
    let modes = file.modes.iter().map(String::as_str).collect();
    let mode = index("mode", &corner.mode, modes);
    let variants = file.variant.iter().map(|v| v.name.as_str()).collect();
    let variant = index("variant", &corner.variant, variants);
    let dispersion = dispersion?;
    let draws = match &corner.keys {
        Some(entries) => matching(dispersion, entries, has_worst, &format!("{key}.keys"), f),
        None => {
            let all = dispersion.draws().iter().enumerate();
            all.filter(|(_, d)| d.worst.is_some()).map(|(i, _)| i).collect()
        }
    };
    if draws.is_empty() {
        f.push(key, "no draw key with `worst` values", "at least one");
    }
    Some(Corner { population, name: corner.name.clone(), draws, mode: mode?, variant: variant? })
}

#[cfg(test)]
mod tests;
