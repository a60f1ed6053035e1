//! How the tables of a modal package are put together to mode sets, and every way they may fail to.
//!
//! Bytes, columns and the header are checked before, in `package` and `flat`.

use super::{GRIDS, MASS, MODES, PARENTS, SHAPES, table_path};
use crate::io::files;
use crate::io::flat::{Layout, Table};
use crate::problem::{Kind, Problems};
use crate::vehicle::{Grid, MassProperties, Mode, ModeSet, Parent};
use nalgebra::{Matrix3, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Departure of a generalised mass from 1 that single precision in a source can explain.
const NORMALISATION: f64 = 1e-5;
/// Agreement of the grids' masses with the body's, above which they must weigh the modes too.
const WHOLE_MASS: f64 = 0.02;
/// Departure of `Σ m φ² + J ψ²` from 1 that lumping explains.
const LUMPING: f64 = 0.15;
/// Modes from the lowest whose waves are long beside the distance of grids: of the stick model of the reference vehicle
/// their sums are 1.00 to 1.04, of the first hundred up to 1.9, of 236 up to 2.9.
const LONG_WAVES: usize = 30;
/// Sum of a mode that changes sign from grid to grid: an element of a rod weighs m lumped, `m/6 (2 − 1 − 1 + 2) = m/3` by
/// linear shapes.
const SHORT_WAVE: f64 = 3.0;
/// Problems of one table that are reported one by one.
pub(super) const REPORTED: usize = 20;
/// A check of the tables in progress.
pub(super) struct Check<'a> {
    pub(super) dir: &'a Path,
    pub(super) problems: Problems,
    pub(super) counts: BTreeMap<(&'static str, &'static str), usize>,
}

impl Check<'_> {
    /// Notes a problem of a table, unless many of its kind are noted already.
    fn note(
        &mut self,
        kind: Kind,
        layout: &Layout,
        key: &'static str,
        found: String,
        allowed: &str,
    ) {
        let file = files::name(&self.dir.join(table_path(layout)));
        let count = self.counts.entry((layout.name, key)).or_default();
        *count += 1;
        match (*count).cmp(&(REPORTED + 1)) {
            std::cmp::Ordering::Less => self.problems.push(kind, file, key, found, allowed),
            std::cmp::Ordering::Equal => {
                self.problems.push(kind, file, key, "more of the same", allowed);
            }
            std::cmp::Ordering::Greater => {}
        }
    }

    /// Empty mode sets at the flight times of the mass table.
    pub(super) fn sets(&mut self, table: &Table) -> Option<Vec<ModeSet>> {
        let times = table.numbers(0);
        if times.is_empty() || !times.windows(2).all(|w| w[0] < w[1]) {
            let found = format!("{times:?}");
            let allowed = "one row for each flight time, increasing";
            self.note(Kind::Input, &MASS, "flight_time_s", found, allowed);
            return None;
        }
        let sets = (0..table.rows()).map(|row| {
            let n = |column: usize| table.numbers(column)[row];
            let inertia = Matrix3::new(n(5), n(8), n(9), n(8), n(6), n(10), n(9), n(10), n(7));
            if !(n(1) > 0.0) {
                self.note(Kind::Input, &MASS, "mass_kg", n(1).to_string(), "above 0");
            }
            if inertia.cholesky().is_none() {
                let found = format!("{:?} at {} s", inertia.as_slice(), times[row]);
                self.note(Kind::Input, &MASS, "ixx_kg_m2", found, "a positive definite tensor");
            }
            ModeSet {
                flight_time_s: times[row],
                body: MassProperties {
                    mass_kg: n(1),
                    cg_m: Vector3::new(n(2), n(3), n(4)),
                    inertia_kg_m2: inertia,
                },
                grids: Vec::new(),
                modes: Vec::new(),
            }
        });
        Some(sets.collect())
    }

    /// Place of the flight time of a row, in tables that are sorted by it.
    fn place(&mut self, sets: &[ModeSet], layout: &'static Layout, time: f64) -> Option<usize> {
        let place = sets.binary_search_by(|set| set.flight_time_s.total_cmp(&time)).ok();
        if place.is_none() {
            let found = format!("{time}");
            let allowed = "a flight time of the mass table";
            self.note(Kind::Damage, layout, "flight_time_s", found, allowed);
        }
        place
    }

    fn sorted(&mut self, layout: &'static Layout, table: &Table) {
        if let Some(at) = table.numbers(0).windows(2).position(|w| !(w[0] <= w[1])) {
            let found = format!("an earlier time in row {}", at + 1);
            self.note(Kind::Input, layout, "flight_time_s", found, "rows sorted by flight time");
        }
    }

    pub(super) fn grids(&mut self, sets: &mut [ModeSet], table: &Table) {
        self.sorted(&GRIDS, table);
        let mut seen = BTreeSet::new();
        for (row, name) in table.texts(1).enumerate() {
            let Some(at) = self.place(sets, &GRIDS, table.numbers(0)[row]) else { continue };
            let time = sets[at].flight_time_s;
            if name.is_empty() || !seen.insert((at, name.to_owned())) {
                let found = format!("`{name}` again at {time} s");
                self.note(Kind::Damage, &GRIDS, "grid", found, "each grid once a time");
                continue;
            }
            let vector = |first: usize| Vector3::from_fn(|i, _| table.numbers(first + i)[row]);
            let (mass_kg, inertia_kg_m2) = (vector(5), vector(8));
            if !(mass_kg.min() >= 0.0 && inertia_kg_m2.min() >= 0.0) {
                let found = format!("a negative mass or inertia at `{name}`, {time} s");
                self.note(Kind::Input, &GRIDS, "mass_x_kg", found, "0 or above");
            }
            let grid =
                Grid { name: name.to_owned(), position_m: vector(2), mass_kg, inertia_kg_m2 };
            sets[at].grids.push(grid);
        }
    }

    pub(super) fn modes(&mut self, sets: &mut [ModeSet], table: &Table) {
        self.sorted(&MODES, table);
        let mut seen = BTreeSet::new();
        for (row, label) in table.texts(1).enumerate() {
            let n = |column: usize| table.numbers(column)[row];
            let Some(at) = self.place(sets, &MODES, n(0)) else { continue };
            let set = &mut sets[at];
            let what = format!("mode `{label}` at {} s", set.flight_time_s);
            if label.is_empty() || !seen.insert((at, label.to_owned())) {
                let found = format!("{what} again");
                self.note(Kind::Damage, &MODES, "label", found, "each label once a time");
                continue;
            }
            if !((n(3) - 1.0).abs() <= NORMALISATION) {
                let found = format!("{} for {what}", n(3));
                let allowed = "1: modes normalised to unit generalised mass";
                self.note(Kind::Input, &MODES, "generalised_mass_kg", found, allowed);
            }
            let before = set.modes.last().map_or(0.0, |mode| mode.frequency_hz);
            if !(n(2) > 0.0 && n(2) >= before) {
                let found = format!("{} for {what}", n(2));
                let allowed = "above 0, ascending: elastic modes only";
                self.note(Kind::Input, &MODES, "frequency_hz", found, allowed);
            }
            let zeros = vec![Vector3::zeros(); set.grids.len()];
            set.modes.push(Mode {
                label: label.to_owned(),
                frequency_hz: n(2),
                shape: zeros.clone(),
                slope: zeros,
            });
        }
        for set in &*sets {
            if set.modes.is_empty() || set.grids.is_empty() {
                let found = format!("nothing at {} s", set.flight_time_s);
                let allowed = "modes and grids at each flight time of the mass table";
                self.note(Kind::Damage, &MODES, "flight_time_s", found, allowed);
            }
        }
    }

    pub(super) fn shapes(&mut self, sets: &mut [ModeSet], table: &Table) {
        self.sorted(&SHAPES, table);
        // Places by name, as owned keys, since the sets change below.
        let places = |names: Vec<&str>| -> BTreeMap<String, usize> {
            names.into_iter().enumerate().map(|(i, name)| (name.to_owned(), i)).collect()
        };
        let places: Vec<_> = (sets.iter())
            .map(|set| {
                let modes = places(set.modes.iter().map(|m| m.label.as_str()).collect());
                let grids = places(set.grids.iter().map(|g| g.name.as_str()).collect());
                let filled = vec![false; modes.len() * grids.len()];
                (modes, grids, filled)
            })
            .collect();
        let mut places = places;
        for (row, (label, grid)) in table.texts(1).zip(table.texts(2)).enumerate() {
            let n = |column: usize| table.numbers(column)[row];
            let Some(at) = self.place(sets, &SHAPES, n(0)) else { continue };
            let (modes, grids, filled) = &mut places[at];
            let what = || format!("mode `{label}` at grid `{grid}`, {} s", n(0));
            let (Some(&mode), Some(&place)) = (modes.get(label), grids.get(grid)) else {
                let allowed = "a mode of the modes table and a grid of the grids table";
                self.note(Kind::Damage, &SHAPES, "grid", what(), allowed);
                continue;
            };
            if std::mem::replace(&mut filled[mode * grids.len() + place], true) {
                let found = format!("{} again", what());
                self.note(Kind::Damage, &SHAPES, "grid", found, "one row a mode and grid");
                continue;
            }
            let mode = &mut sets[at].modes[mode];
            mode.shape[place] = Vector3::new(n(3), n(4), n(5));
            mode.slope[place] = Vector3::new(n(6), n(7), n(8));
        }
        for (set, (_, grids, filled)) in sets.iter().zip(&places) {
            for at in filled.iter().enumerate().filter(|(_, filled)| !**filled).map(|(at, _)| at) {
                let (mode, grid) = (&set.modes[at / grids.len()], &set.grids[at % grids.len()]);
                let found = format!(
                    "no row for mode `{}` at grid `{}`, {} s",
                    mode.label, grid.name, set.flight_time_s
                );
                self.note(Kind::Damage, &SHAPES, "label", found, "a row for each mode and grid");
            }
        }
    }

    pub(super) fn parents(&mut self, sets: &[ModeSet], table: &Table) -> Vec<Parent> {
        let mut parents = Vec::new();
        let mut seen = BTreeSet::new();
        for (row, (label, parent)) in table.texts(1).zip(table.texts(2)).enumerate() {
            let (time, overlap) = (table.numbers(0)[row], table.numbers(3)[row]);
            let Some(at) = self.place(sets, &PARENTS, time) else { continue };
            let what = format!("`{label}` at {time} s with the parent `{parent}`");
            let born_here = sets[at].mode(label).is_some()
                && sets[..at].iter().all(|set| set.mode(label).is_none());
            if !born_here {
                let allowed = "a label that first appears at this flight time";
                self.note(Kind::Damage, &PARENTS, "label", what.clone(), allowed);
            }
            if at == 0 || sets[at - 1].mode(parent).is_none() {
                let allowed = "a label of the flight time before";
                self.note(Kind::Damage, &PARENTS, "parent", what.clone(), allowed);
            }
            if !seen.insert((label.to_owned(), parent.to_owned())) {
                let found = format!("{what} again");
                self.note(Kind::Damage, &PARENTS, "parent", found, "each parent once");
            }
            // Round-off may leave the overlap of a shape with itself a little above 1.
            if !(0.0..=1.0 + 1e-9).contains(&overlap) {
                let found = format!("{overlap} for {what}");
                self.note(Kind::Input, &PARENTS, "overlap", found, "0 to 1");
            }
            parents.push(Parent {
                flight_time_s: time,
                label: label.to_owned(),
                parent: parent.to_owned(),
                overlap,
            });
        }
        parents
    }

    /// Where the grids carry the whole mass, they must give each mode its unit generalised mass.
    pub(super) fn normalisation(&mut self, sets: &[ModeSet]) {
        for set in sets {
            let lumped: Vector3<f64> = set.grids.iter().map(|grid| grid.mass_kg).sum();
            if !((lumped.max() / set.body.mass_kg - 1.0).abs() <= WHOLE_MASS) {
                continue;
            }
            // Lumped masses see short waves badly.
            let mut order: Vec<f64> = set.modes.iter().map(|mode| mode.frequency_hz).collect();
            order.sort_by(f64::total_cmp);
            let long = order.get(LONG_WAVES).copied().unwrap_or(f64::INFINITY);
            for mode in &set.modes {
                let sum: f64 = (set.grids.iter().zip(mode.shape.iter().zip(&mode.slope)))
                    .map(|(grid, (phi, psi))| {
                        grid.mass_kg.dot(&phi.component_mul(phi))
                            + grid.inertia_kg_m2.dot(&psi.component_mul(psi))
                    })
                    .sum();
                let coarse = mode.frequency_hz >= long && (0.5..=SHORT_WAVE).contains(&sum);
                if !(coarse || (sum - 1.0).abs() <= LUMPING) {
                    let found = format!(
                        "{sum:.4} kg on the masses of the grids for mode `{}` at {} s",
                        mode.label, set.flight_time_s
                    );
                    let allowed = "1 within 15 %: shapes normalised to unit generalised mass";
                    self.note(Kind::Input, &SHAPES, "phi_x_per_sqrt_kg", found, allowed);
                }
            }
        }
    }
}
