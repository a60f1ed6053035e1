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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::{Grid, MassProperties, Modal};
    use nalgebra::Matrix3;

    /// Modes on four grids of the given masses, each given by its translations along y.
    fn set(time: f64, masses: [f64; 4], modes: &[(f64, [f64; 4])]) -> ModeSet {
        let grid = |(i, &m): (usize, &f64)| Grid {
            name: format!("g{i}"),
            position_m: Vector3::x() * i as f64,
            mass_kg: Vector3::repeat(m),
            inertia_kg_m2: Vector3::zeros(),
        };
        let mode = |&(frequency_hz, y): &(f64, [f64; 4])| Mode {
            label: String::new(),
            frequency_hz,
            shape: y.iter().map(|&y| Vector3::y() * y).collect(),
            slope: vec![Vector3::zeros(); 4],
        };
        ModeSet {
            flight_time_s: time,
            body: MassProperties {
                mass_kg: masses.iter().sum(),
                cg_m: Vector3::zeros(),
                inertia_kg_m2: Matrix3::identity(),
            },
            grids: masses.iter().enumerate().map(grid).collect(),
            modes: modes.iter().map(mode).collect(),
        }
    }

    const ONES: [f64; 4] = [1.0; 4];
    const A: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
    const B: [f64; 4] = [0.0, 1.0, 0.0, 0.0];
    const C: [f64; 4] = [0.0, 0.0, 1.0, 0.0];

    fn labels(set: &ModeSet) -> Vec<&str> {
        set.modes.iter().map(|m| m.label.as_str()).collect()
    }

    /// A turned by `angle` towards B.
    fn between(angle: f64) -> [f64; 4] {
        [angle.cos(), angle.sin(), 0.0, 0.0]
    }

    #[test]
    fn labels_follow_shapes_through_a_crossing_of_frequencies() {
        let mut sets = [
            set(0.0, ONES, &[(1.0, A), (2.0, B), (3.0, C)]),
            set(1.0, ONES, &[(1.6, A), (1.7, B), (3.0, C)]),
            set(2.0, ONES, &[(1.5, B), (1.8, A), (3.0, C)]),
        ];
        assert!(label(&mut sets, &Thresholds::default()).is_empty());
        assert_eq!(labels(&sets[1]), ["m001", "m002", "m003"]);
        assert_eq!(labels(&sets[2]), ["m002", "m001", "m003"]);
    }

    #[test]
    fn two_modes_that_veer_get_new_labels_whose_parents_are_both_with_their_overlaps() {
        let angle = 0.8_f64;
        let mut sets = [
            set(0.0, ONES, &[(1.0, A), (2.0, B), (3.0, C)]),
            set(
                1.0,
                ONES,
                &[
                    (1.0, between(angle)),
                    (2.0, between(angle + std::f64::consts::FRAC_PI_2)),
                    (3.0, C),
                ],
            ),
        ];
        let parents = label(&mut sets, &Thresholds::default());
        assert_eq!(labels(&sets[1]), ["m004", "m005", "m003"]);
        let found: Vec<_> = parents.iter().map(|p| (&*p.label, &*p.parent)).collect();
        assert_eq!(found, [("m004", "m002"), ("m004", "m001"), ("m005", "m001"), ("m005", "m002")]);
        assert!((parents[0].overlap - angle.sin().powi(2)).abs() < 1e-15);
        assert!((parents[1].overlap - angle.cos().powi(2)).abs() < 1e-15);
        // Each shares the draws of the parent from which it has more than half.
        let modal = Modal {
            source: String::new(),
            contains_engines: Vec::new(),
            contains_tanks: Vec::new(),
            sets: sets.to_vec(),
            parents,
        };
        assert_eq!(modal.draw_label("m004"), "m002");
        assert_eq!(modal.draw_label("m005"), "m001");
        assert_eq!(modal.draw_label("m003"), "m003");
    }

    #[test]
    fn a_label_that_ended_is_not_used_again() {
        let mut sets = [
            set(0.0, ONES, &[(1.0, A), (2.0, B)]),
            set(1.0, ONES, &[(1.0, A)]),
            set(2.0, ONES, &[(1.0, A), (2.0, B)]),
        ];
        let parents = label(&mut sets, &Thresholds::default());
        assert_eq!(labels(&sets[2]), ["m001", "m003"]);
        assert!(parents.is_empty());
    }

    #[test]
    fn the_sign_of_a_shape_continues_for_a_kept_label_and_for_a_child() {
        let turned = between(0.9).map(|v| -v);
        let mut sets = [
            set(0.0, ONES, &[(1.0, A), (3.0, C)]),
            set(1.0, ONES, &[(1.0, A.map(|v| -v)), (3.0, C)]),
            set(2.0, ONES, &[(1.0, turned), (3.0, C.map(|v| -v))]),
        ];
        label(&mut sets, &Thresholds::default());
        assert_eq!(sets[1].modes[0].shape[0].y, 1.0);
        assert_eq!(labels(&sets[2]), ["m003", "m002"]);
        assert!(sets[2].modes[0].shape[0].y > 0.0);
        assert_eq!(sets[2].modes[1].shape[2].y, 1.0);
    }

    #[test]
    fn the_overlap_is_weighed_by_mass_and_by_grids_of_the_same_name_in_any_order() {
        let old = set(0.0, [1.0, 3.0, 0.0, 0.0], &[(1.0, [1.0, 1.0, 9.0, 0.0])]);
        let mut new = set(1.0, [1.0, 1.0, 0.0, 0.0], &[(1.0, [1.0, -1.0, 0.0, 5.0])]);
        // Mean weights 1 and 2: (1 − 2)²/(3 · 3).
        let squared = overlaps(&old, &new)[0][0];
        assert!((squared.squared - 1.0 / 9.0).abs() < 1e-15 && squared.negative);
        new.grids.reverse();
        new.modes[0].shape.reverse();
        assert_eq!(overlaps(&old, &new)[0][0].squared, squared.squared);
        new.grids.retain(|g| g.name != "g1");
        new.modes[0].shape.remove(2);
        new.modes[0].slope.pop();
        assert_eq!(overlaps(&old, &new)[0][0], Overlap { squared: 1.0, negative: false });
    }

    #[test]
    fn without_any_mass_every_translation_weighs_the_same() {
        let old = set(0.0, [0.0; 4], &[(1.0, [1.0, 1.0, 0.0, 0.0])]);
        let new = set(1.0, [0.0; 4], &[(1.0, A)]);
        assert!((overlaps(&old, &new)[0][0].squared - 0.5).abs() < 1e-15);
    }

    #[test]
    fn the_assignment_is_optimal_as_a_whole_where_two_modes_claim_one() {
        // Both new modes resemble the first old one; the nearer keeps the label.
        let thresholds = Thresholds { keep: 0.5, parent: 0.1 };
        let mut sets = [
            set(0.0, ONES, &[(1.0, A), (2.0, C)]),
            set(1.0, ONES, &[(1.0, between(0.7)), (1.1, between(0.3)), (2.0, C)]),
        ];
        let parents = label(&mut sets, &thresholds);
        assert_eq!(labels(&sets[1]), ["m003", "m001", "m002"]);
        assert_eq!(parents.len(), 1);
        assert_eq!((&*parents[0].label, &*parents[0].parent), ("m003", "m001"));
    }
}
