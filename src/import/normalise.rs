//! Generalised masses of the modes of a model, by which they become modes of unit generalised mass.
//!
//! Where the masses come from is the user's to say; here they are found and compared.

use super::model::Model;
use crate::fem::Results;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Departure of a generalised mass from 1 that the digits of a file explain.
const UNIT: f64 = 1e-3;
/// Departure of lumped from stated generalised masses that lumping explains.
const LUMPING: f64 = 0.15;

/// How the modes in the files are normalised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Normalisation {
    /// To unit generalised mass, in the units of the file.
    Mass,
    /// To a greatest component of 1.
    Maximum,
    /// In some other way, or in none.
    None,
}

/// An entry of a mass matrix: rows and columns are a node and one of its six freedoms (1 to 6)
/// along its displacement axes. One of the two halves, or both, with the diagonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Node and freedom of the row.
    pub row: (i64, u8),
    /// Node and freedom of the column.
    pub column: (i64, u8),
    /// Value, file units.
    pub value: f64,
}

/// Sets the generalised masses of the modes of `results` to `φᵀ M φ`, and says how far those of
/// the file differ.
///
/// # Errors
/// Entries that contradict each other or lie on nodes without results.
pub fn by_matrix(results: &mut Results, entries: &[Entry]) -> Result<(), String> {
    // Either half is mirrored; an entry with its mirror image must agree with it.
    let mut matrix: BTreeMap<_, f64> = BTreeMap::new();
    for entry in entries {
        let key = (entry.row.min(entry.column), entry.row.max(entry.column));
        let known = *matrix.entry(key).or_insert(entry.value);
        if !((known - entry.value).abs() <= 1e-6 * known.abs()) {
            return Err(format!(
                "{} and {} for the same pair of freedoms, {:?} and {:?}",
                known, entry.value, key.0, key.1
            ));
        }
    }
    for mode in &mut results.modes {
        let component = |(node, freedom): (i64, u8)| {
            let at = mode.shape.binary_search_by_key(&node, |s| s.node).ok()?;
            let shape = &mode.shape[at];
            let k = usize::from(freedom);
            match k {
                1..=3 => Some(shape.translation[k - 1]),
                4..=6 => Some(shape.rotation.map_or(0.0, |r| r[k - 4])),
                _ => None,
            }
        };
        let mut sum = 0.0;
        for (&(row, column), &value) in &matrix {
            let (Some(a), Some(b)) = (component(row), component(column)) else {
                return Err(format!("an entry on {row:?} and {column:?}, which carry no results"));
            };
            sum += if row == column { value * a * a } else { 2.0 * value * a * b };
        }
        if let Some(stated) = mode.generalised_mass.filter(|m| !((sum / m - 1.0).abs() <= 0.01)) {
            results.warnings.push(format!(
                "the mass matrix gives mode {} a generalised mass of {sum:.5e}, the file {stated:.5e}",
                mode.number
            ));
        }
        mode.generalised_mass = Some(sum);
    }
    Ok(())
}

/// Generalised mass of each mode of `model`, kg; `unit_kg` is the file's unit of it.
///
/// # Errors
/// Masses that contradict the normalisation, or are missing, one sentence each.
pub fn generalised(
    model: &mut Model,
    normalisation: Normalisation,
    unit_kg: f64,
) -> Result<Vec<f64>, Vec<String>> {
    let lumped = lumped(model);
    let mut faults = Vec::new();
    let mut found = Vec::new();
    let mut apart = Vec::new();
    for (j, mode) in model.modes.iter().enumerate() {
        let stated = mode.generalised_kg;
        let mass = match normalisation {
            Normalisation::Mass => {
                if let Some(kg) = stated.filter(|kg| !((kg / unit_kg - 1.0).abs() <= UNIT)) {
                    faults.push(format!(
                        "a generalised mass of {:.5e} in mode {}, where normalisation = \"mass\" \
                         says 1",
                        kg / unit_kg,
                        mode.number
                    ));
                }
                Some(unit_kg)
            }
            Normalisation::Maximum | Normalisation::None => {
                stated.or_else(|| lumped.as_ref().map(|l| l[j]))
            }
        };
        match mass.filter(|m| *m > 0.0 && m.is_finite()) {
            Some(mass) => found.push(mass),
            None => faults.push(format!(
                "{} for mode {}, which is needed with this normalisation",
                mass.map_or("no generalised mass".into(), |m| format!("a generalised mass of {m}")),
                mode.number
            )),
        }
        let off = |l: &Vec<f64>| mass.is_some_and(|m| !((l[j] / m - 1.0).abs() <= LUMPING));
        if lumped.as_ref().is_some_and(off) {
            apart.push(mode.number);
        }
        let greatest = mode.greatest;
        if normalisation == Normalisation::Maximum && !(greatest <= 1.0 + UNIT) {
            faults.push(format!(
                "a translation of {greatest:.5} in mode {}, where normalisation = \
                 \"maximum\" says at most 1",
                mode.number
            ));
        }
    }
    if faults.len() > 5 {
        let more = faults.len() - 5;
        faults.truncate(5);
        faults.push(format!("the same of {more} more modes"));
    }
    if let (Some(&first), true) = (apart.first(), faults.is_empty()) {
        model.warnings.push(format!(
            "on the lumped masses {} modes, mode {first} first, have a generalised mass more than \
             15 % from the one they are normalised by",
            apart.len()
        ));
    }
    if faults.is_empty() { Ok(found) } else { Err(faults) }
}

/// Generalised masses on the lumped masses, kg.
fn lumped(model: &Model) -> Option<Vec<f64>> {
    let lumps = model.lumps.as_ref()?;
    let of = |mode: &super::model::Mode| {
        (lumps.iter().zip(mode.shape.iter().zip(&mode.slope)))
            .map(|(l, (u, r))| l.mass_kg * u.norm_squared() + (l.inertia_kg_m2 * r).dot(r))
            .sum()
    };
    Some(model.modes.iter().map(of).collect())
}
