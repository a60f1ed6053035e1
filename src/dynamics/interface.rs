//! How the elastic coordinates are coupled: their own equations stand on the diagonal, and what is attached to the
//! body acts on them by a few motions alone.
//!
//! The matrices of a `Model` hold all of it; this says what of them has structure. It is filled in `assemble`; what
//! the structure saves is decided in `modal::spectrum`.

use super::{Layout, Model};
use nalgebra::Vector3;
use std::ops::Range;

/// The elastic block of mass, damping and stiffness is `diag(own) + Wᵀ Z W + full`: W the motions, Z unknown here.
/// Empty where nothing is known.
#[derive(Debug, Clone, Default)]
pub struct Interface {
    /// The elastic coordinates.
    pub elastic: Range<usize>,
    /// Mass, damping and stiffness of each elastic coordinate by itself.
    pub own: Vec<[f64; 3]>,
    /// Mass, damping and stiffness that `Wᵀ Z W` has on the diagonal.
    pub attached: Vec<[f64; 3]>,
    /// The motions W per elastic coordinate, row by row: translations (kg^-1/2) and rotations (rad/m per kg^1/2).
    pub motions: Vec<f64>,
    /// Damping and stiffness between elastic coordinates that no few motions give, square, row by row; empty where
    /// there is none.
    pub full: [Vec<f64>; 2],
}

impl Interface {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.elastic = 0..0;
        self.own.clear();
        self.attached.clear();
        self.motions.clear();
        self.full.iter_mut().for_each(Vec::clear);
    }

    /// Adds three motions by their columns.
    pub fn add_motion(&mut self, columns: &[Vector3<f64>]) {
        for axis in 0..3 {
            self.motions.extend(columns.iter().map(|column| column[axis]));
        }
    }

    /// Adds to the damping (0) or stiffness (1) that is of no few motions; places outside the elastic
    /// coordinates do not count.
    pub fn add_full(&mut self, kind: usize, [row, column]: [usize; 2], value: f64) {
        let (count, first) = (self.elastic.len(), self.elastic.start);
        if value == 0.0 || !self.elastic.contains(&row) || !self.elastic.contains(&column) {
            return;
        }
        self.full[kind].resize(count * count, 0.0);
        self.full[kind][(row - first) * count + column - first] += value;
    }
}

/// Adds the elastic coordinates' own equations `[1, 2ζω, ω²]` to a model that holds what is attached to them.
pub fn add_own(layout: &Layout, equations: impl IntoIterator<Item = [f64; 3]>, model: &mut Model) {
    let Model { mass, damping, stiffness, interface, .. } = model;
    interface.elastic = layout.elastic();
    for (at, own) in layout.elastic().zip(equations) {
        let diagonal = [&mut *mass, &mut *damping, &mut *stiffness];
        interface.attached.push(diagonal.each_ref().map(|matrix| matrix[(at, at)]));
        for (matrix, value) in diagonal.into_iter().zip(own) {
            matrix[(at, at)] += value;
        }
        interface.own.push(own);
    }
}
