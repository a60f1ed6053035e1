//! Fixed cases of a run and where derivatives are stored: what the run file says, against its vehicle,
//! dispersion and variants.
//!
//! Types and ranges of single values are checked before, by `table`.

use super::run_file::{FixedFile, RunFile};
use super::table::Findings;
use super::{names, pattern};
use crate::campaign::{Population, SensitivityRule, Variant};
use crate::dispersion::{Dispersion, Scheme};
use crate::spelling::allowed_instead;

/// The populations of the fixed cases, each followed by the Monte Carlo around it if there is one; `known`
/// are the populations before them.
pub fn populations(
    file: &RunFile,
    known: &[Population],
    dispersion: Option<&Dispersion>,
    f: &mut Findings,
) -> Vec<Population> {
    let mut found: Vec<Population> = Vec::new();
    for (i, case) in file.fixed.iter().enumerate() {
        let key = format!("fixed[{i}]");
        names::word(f, &format!("{key}.name"), &case.name);
        let cloud = format!("{}_dispersed", case.name);
        let taken = |name: &str| known.iter().chain(&found).any(|p| p.name == name);
        if taken(&case.name) || (case.cases > 0 && taken(&cloud)) {
            let name = format!("\"{}\"", case.name);
            f.push(format!("{key}.name"), name, "a name that no other population has");
        }
        let values = values(case, &key, dispersion, f);
        let free = free(case, &key, dispersion, f);
        let population = |name: String, cases, drawn, fixed| Population {
            name,
            cases,
            fixed,
            drawn,
            scheme: Scheme::MonteCarlo,
        };
        if case.cases > 0 {
            let held: Vec<_> = values.iter().copied().filter(|(i, _)| !free.contains(i)).collect();
            if dispersion.is_some_and(|d| held.len() == d.draws().len()) {
                let allowed = "keys in `free`, so that the cases around it differ";
                f.push(format!("{key}.free"), "no key that could be drawn", allowed);
            }
            found.push(population(case.name.clone(), 1, false, values));
            found.push(population(cloud, case.cases, true, held));
        } else {
            found.push(population(case.name.clone(), 1, false, values));
        }
    }
    found
}

/// Values by index of the draw, in order.
fn values(
    case: &FixedFile,
    key: &str,
    dispersion: Option<&Dispersion>,
    f: &mut Findings,
) -> Vec<(usize, f64)> {
    let Some(dispersion) = dispersion else { return Vec::new() };
    let mut values = Vec::new();
    for (name, value) in &case.values {
        let place = || format!("{key}.values.\"{name}\"");
        if !value.is_finite() {
            f.push(place(), value.to_string(), "a finite number");
        }
        match dispersion.index(name) {
            Some(index) => values.push((index, *value)),
            None => {
                let known = dispersion.draws().iter().map(|draw| draw.key.as_str());
                f.push(place(), format!("\"{name}\""), allowed_instead(name, known));
            }
        }
    }
    values.sort_by_key(|(index, _)| *index);
    values
}

fn free(
    case: &FixedFile,
    key: &str,
    dispersion: Option<&Dispersion>,
    f: &mut Findings,
) -> Vec<usize> {
    let Some(dispersion) = dispersion else { return Vec::new() };
    let mut all = Vec::new();
    for (i, entry) in case.free.iter().enumerate() {
        let named = |name: &str| {
            name == entry || pattern::matches(entry, name.split(" @ ").next().unwrap_or(name))
        };
        let draws = dispersion.draws().iter().enumerate();
        let before = all.len();
        all.extend(draws.filter(|(_, draw)| named(&draw.key)).map(|(index, _)| index));
        if all.len() == before {
            let known = dispersion.draws().iter().map(|draw| draw.key.as_str());
            let found = format!("\"{entry}\", which matches no draw key");
            f.push(format!("{key}.free[{i}]"), found, allowed_instead(entry, known));
        }
    }
    all
}

/// Where derivatives are stored.
pub fn sensitivity(
    file: &RunFile,
    variants: &[Variant],
    times: &[f64],
    f: &mut Findings,
) -> Option<SensitivityRule> {
    let rule = file.sensitivity.as_ref()?;
    let mut chosen = Vec::new();
    match &rule.variants {
        None => chosen.extend(0..variants.len()),
        Some(asked) => {
            for (i, name) in asked.iter().enumerate() {
                match variants.iter().position(|variant| variant.name == *name) {
                    Some(index) => chosen.push(index),
                    None => {
                        let known = variants.iter().map(|variant| variant.name.as_str());
                        let place = format!("sensitivity.variants[{i}]");
                        f.push(place, format!("\"{name}\""), allowed_instead(name, known));
                    }
                }
            }
        }
    }
    let mut at = Vec::new();
    match &rule.flight_times_s {
        None => at.extend(0..times.len()),
        Some(asked) => {
            for (i, time) in asked.iter().enumerate() {
                match times.iter().position(|known| known == time) {
                    Some(index) => at.push(index),
                    None => {
                        let allowed = format!("a flight time of the run, one of {times:?} s");
                        let place = format!("sensitivity.flight_times_s[{i}]");
                        f.push(place, format!("{time} s"), allowed);
                    }
                }
            }
        }
    }
    Some(SensitivityRule { variants: chosen, flight_times: at, cases: rule.cases })
}
