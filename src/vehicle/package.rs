//! Modal data of the body: grids, modes and shapes per flight time, with persistent labels.
//!
//! This is the validated content of a modal package; `io::package` reads and writes the files.

use nalgebra::{Matrix3, Vector3};

/// Mass properties of the body whose modes these are (without the engines it does not contain).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of gravity in the structural frame, m.
    pub cg_m: Vector3<f64>,
    /// Inertia about the cg, kg·m².
    pub inertia_kg_m2: Matrix3<f64>,
}

/// One grid at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Name, unique inside a flight time.
    pub name: String,
    /// Position in the structural frame, m.
    pub position_m: Vector3<f64>,
    /// Lumped mass in x, y, z that weighs the overlap of modes, kg; zero where unknown. It differs
    /// by direction where a liquid moves sideways with its tank, but not along it.
    pub mass_kg: Vector3<f64>,
    /// Lumped rotary inertias (x, y, z) that weigh the overlap, kg·m²; zero where unknown.
    pub inertia_kg_m2: Vector3<f64>,
}

/// One elastic mode, normalised to unit generalised mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Persistent label.
    pub label: String,
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Translation at each grid in the order of `ModeSet::grids`, kg^-1/2.
    pub shape: Vec<Vector3<f64>>,
    /// Rotation at each grid in the order of `ModeSet::grids`, rad/m per kg^1/2.
    pub slope: Vec<Vector3<f64>>,
}

/// The elastic modes of the body at one flight time, by ascending frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeSet {
    /// Flight time, s.
    pub flight_time_s: f64,
    /// Mass properties of the body.
    pub body: MassProperties,
    /// Grids, in file order.
    pub grids: Vec<Grid>,
    /// Elastic modes.
    pub modes: Vec<Mode>,
}

impl ModeSet {
    /// Index of the grid called `name`.
    pub fn grid(&self, name: &str) -> Option<usize> {
        self.grids.iter().position(|g| g.name == name)
    }

    /// Index of the mode called `label`.
    pub fn mode(&self, label: &str) -> Option<usize> {
        self.modes.iter().position(|m| m.label == label)
    }
}

/// A parent of a label: a mode of the previous flight time from which it split or merged.
#[derive(Debug, Clone, PartialEq)]
pub struct Parent {
    /// Flight time at which `label` was born, s.
    pub flight_time_s: f64,
    /// The new label.
    pub label: String,
    /// A label of the previous flight time.
    pub parent: String,
    /// Squared mass-weighted overlap (modal assurance criterion) of the two shapes, 0 to 1.
    pub overlap: f64,
}

/// All modal data of a vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Modal {
    /// Where the data come from, for instance `stick model of the SLS-like synthetic vehicle`.
    pub source: String,
    /// Engines (paths `group.name`) whose mass the modes contain; empty for a reduced body.
    pub contains_engines: Vec<String>,
    /// Tanks whose slosh masses the modes contain, locked; empty for a reduced body.
    pub contains_tanks: Vec<String>,
    /// Mode sets by ascending flight time.
    pub sets: Vec<ModeSet>,
    /// Parents of labels born after the first flight time.
    pub parents: Vec<Parent>,
}

/// Overlap above which a label shares the draw key of its parent.
pub const SHARED_KEY_OVERLAP: f64 = 0.5;

impl Modal {
    /// The mode set at exactly `time_s`.
    pub fn at(&self, time_s: f64) -> Option<&ModeSet> {
        self.sets.iter().find(|s| s.flight_time_s == time_s)
    }

    /// All labels, in order of birth and then of frequency.
    pub fn labels(&self) -> Vec<&str> {
        let mut labels: Vec<&str> = Vec::new();
        for mode in self.sets.iter().flat_map(|s| &s.modes) {
            if !labels.contains(&mode.label.as_str()) {
                labels.push(&mode.label);
            }
        }
        labels
    }

    /// The label under which `label` draws: the earliest ancestor reached through parents whose
    /// overlap exceeds [`SHARED_KEY_OVERLAP`].
    pub fn draw_label<'a>(&'a self, label: &'a str) -> &'a str {
        let mut current = label;
        // A parent is always born earlier, so the walk ends; the bound guards damaged tables.
        for _ in 0..=self.parents.len() {
            let Some(parent) =
                self.parents.iter().find(|p| p.label == current && p.overlap > SHARED_KEY_OVERLAP)
            else {
                break;
            };
            current = &parent.parent;
        }
        current
    }
}
