//! The layout of a model: which coordinate has which number and name.
//!
//! The only place where a coordinate has a number; it knows no values.

use std::ops::Range;

/// Order of the generalised coordinates q = [η(k), Θ_1(2) … Θ_r(2)], gimballed engines only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    labels: Vec<String>,
    /// Per engine of the vehicle: position among the gimballed ones, or `None` if locked.
    gimbal: Vec<Option<usize>>,
    names: Vec<String>,
}

impl Layout {
    /// A layout for elastic modes `labels` and engines given as (path, axis names, gimballed).
    pub fn new<'a>(
        labels: impl IntoIterator<Item = &'a str>,
        engines: impl IntoIterator<Item = (String, [&'a str; 2], bool)>,
    ) -> Self {
        let labels: Vec<String> = labels.into_iter().map(str::to_owned).collect();
        let mut names: Vec<String> = labels.iter().map(|label| format!("eta.{label}")).collect();
        let mut gimbal = Vec::new();
        let mut free = 0;
        for (path, axes, gimballed) in engines {
            gimbal.push(gimballed.then_some(free));
            if gimballed {
                free += 1;
                names.extend(axes.iter().map(|axis| format!("theta.{path}.{axis}")));
            }
        }
        Self { labels, gimbal, names }
    }

    /// Number of generalised coordinates.
    pub fn coordinates(&self) -> usize {
        self.names.len()
    }

    /// Number of states of the first-order form, q and q̇.
    pub fn states(&self) -> usize {
        2 * self.coordinates()
    }

    /// Elastic coordinates η.
    pub fn elastic(&self) -> Range<usize> {
        0..self.labels.len()
    }

    /// Gimbal rotations Θ of all gimballed engines.
    pub fn gimbals(&self) -> Range<usize> {
        self.labels.len()..self.coordinates()
    }

    /// First of the two gimbal rotations of an engine, `None` if it is locked.
    pub fn gimbal(&self, engine: usize) -> Option<usize> {
        self.gimbal[engine].map(|position| self.labels.len() + 2 * position)
    }

    /// Label of an elastic coordinate.
    pub fn label(&self, elastic: usize) -> &str {
        &self.labels[elastic]
    }

    /// Elastic coordinate of a label.
    pub fn position(&self, label: &str) -> Option<usize> {
        self.labels.iter().position(|l| l == label)
    }

    /// Name of a generalised coordinate, for instance `eta.m012` or `theta.booster.left.rock`.
    pub fn name(&self, coordinate: usize) -> &str {
        &self.names[coordinate]
    }

    /// Names of the states: the coordinates, then their rates with the prefix `d.`.
    pub fn state_names(&self) -> Vec<String> {
        let rates = self.names.iter().map(|name| format!("d.{name}"));
        self.names.iter().cloned().chain(rates).collect()
    }
}
