//! Persistent labels: which mode of one flight time is which mode of the one before.
//!
//! It works on any mode sets, from a stick model or imported; frequencies play no part but to
//! order modes that are born together.

use super::assignment::assign;
use crate::vehicle::{Mode, ModeSet, Parent};
use nalgebra::Vector3;

/// Overlaps from which labels are kept and parents listed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// A label is kept where the overlap exceeds this, −.
    pub keep: f64,
    /// A mode of the previous flight time is a parent where the overlap exceeds this, −.
    pub parent: f64,
}

impl Default for Thresholds {
    /// 0.8 and 0.1. A label kept above one half leaves no other mode an overlap above one half
    /// with the same predecessor.
    fn default() -> Self {
        Self { keep: 0.8, parent: 0.1 }
    }
}

/// Labels all modes of `sets` (by ascending flight time) as `m001`, `m002`, … in order of birth,
/// then of frequency, and lets the sign of each shape continue that of the time before.
///
/// A label is kept where the overlap ([`overlaps`]) with its mode at the previous time exceeds
/// `keep`, in the one-to-one assignment with the greatest sum of such overlaps; every other mode
/// gets a new label, and its parents are the modes of the previous time with an overlap above
/// `parent`. A label that ended is not used again. Returns the parents, by label, greatest overlap
/// first.
pub fn label(sets: &mut [ModeSet], thresholds: &Thresholds) -> Vec<Parent> {
    let mut born = 0;
    let mut parents = Vec::new();
    for at in 0..sets.len() {
        let (before, rest) = sets.split_at_mut(at);
        let set = &mut rest[0];
        let Some(previous) = before.last() else {
            for mode in &mut set.modes {
                mode.label = next(&mut born);
            }
            continue;
        };
        let overlap = overlaps(previous, set);
        let worth = |o: &Overlap| if o.squared > thresholds.keep { o.squared } else { 0.0 };
        let partner =
            assign(set.modes.len(), previous.modes.len(), |new, old| worth(&overlap[new][old]));
        for (new, mode) in set.modes.iter_mut().enumerate() {
            let continued = partner[new].filter(|&old| worth(&overlap[new][old]) > 0.0);
            if let Some(old) = continued {
                mode.label.clone_from(&previous.modes[old].label);
                if overlap[new][old].negative {
                    flip(mode);
                }
                continue;
            }
            mode.label = next(&mut born);
            let mut found: Vec<Parent> = (previous.modes.iter().zip(&overlap[new]))
                .filter(|(_, o)| o.squared > thresholds.parent)
                .map(|(old, o)| Parent {
                    flight_time_s: set.flight_time_s,
                    label: mode.label.clone(),
                    parent: old.label.clone(),
                    overlap: o.squared,
                })
                .collect();
            found.sort_by(|a, b| b.overlap.total_cmp(&a.overlap));
            // The sign of a mode that split off continues that of its nearest parent.
            let nearest = (overlap[new].iter())
                .filter(|o| o.squared > thresholds.parent)
                .max_by(|a, b| a.squared.total_cmp(&b.squared));
            if nearest.is_some_and(|o| o.negative) {
                flip(mode);
            }
            parents.extend(found);
        }
    }
    parents
}

/// Overlap of two shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Modal assurance criterion, 0 to 1.
    pub squared: f64,
    /// Whether the shapes are of opposite sign.
    pub negative: bool,
}

/// Squared mass-weighted overlap of each mode of `new` (rows) with each of `old` (columns):
/// `(aᵀWb)² / (aᵀWa · bᵀWb)`, W the mean of the lumped masses and inertias of both times, on the
/// grids that both have by name. Where nothing weighs there, each translation weighs the same and
/// rotations nothing.
pub fn overlaps(old: &ModeSet, new: &ModeSet) -> Vec<Vec<Overlap>> {
    let places: std::collections::BTreeMap<&str, usize> =
        old.grids.iter().enumerate().map(|(i, g)| (g.name.as_str(), i)).collect();
    let mut common: Vec<(usize, usize, [Vector3<f64>; 2])> = (new.grids.iter().enumerate())
        .filter_map(|(i, g)| {
            let &j = places.get(g.name.as_str())?;
            let h = &old.grids[j];
            let mass = (g.mass_kg + h.mass_kg) / 2.0;
            Some((i, j, [mass, (g.inertia_kg_m2 + h.inertia_kg_m2) / 2.0]))
        })
        .collect();
    if common.iter().all(|(_, _, [m, j])| m.max() <= 0.0 && j.max() <= 0.0) {
        for (_, _, weight) in &mut common {
            *weight = [Vector3::repeat(1.0), Vector3::zeros()];
        }
    }
    let weighted = |mode: &Mode, from_new: bool| -> Vec<f64> {
        (common.iter())
            .flat_map(|&(i, j, [mass, inertia])| {
                let grid = if from_new { i } else { j };
                let shape = mode.shape[grid].component_mul(&mass.map(f64::sqrt));
                let slope = mode.slope[grid].component_mul(&inertia.map(f64::sqrt));
                [shape.x, shape.y, shape.z, slope.x, slope.y, slope.z]
            })
            .collect()
    };
    let old: Vec<_> = old.modes.iter().map(|mode| weighted(mode, false)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    (new.modes.iter())
        .map(|mode| {
            let a = weighted(mode, true);
            (old.iter())
                .map(|b| {
                    let product = dot(&a, b);
                    let norms = dot(&a, &a) * dot(b, b);
                    let squared = if norms > 0.0 { product * product / norms } else { 0.0 };
                    Overlap { squared, negative: product < 0.0 }
                })
                .collect()
        })
        .collect()
}

fn next(born: &mut usize) -> String {
    *born += 1;
    format!("m{born:03}")
}

fn flip(mode: &mut Mode) {
    for v in mode.shape.iter_mut().chain(&mut mode.slope) {
        *v = -*v;
    }
}
