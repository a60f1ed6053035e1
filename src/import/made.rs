//! What an import made: the modal data, and how good they are.
//!
//! `io` stores it, `report` shows it.

use super::rigid::RigidBody;
use crate::structure::Thresholds;
use crate::vehicle::{MassProperties, Modal};
use std::collections::BTreeMap;

/// Modal data made from results, with their quality.
#[derive(Debug, Clone)]
pub struct Made {
    /// The modal data.
    pub modal: Modal,
    /// Overlaps by which labels were given.
    pub thresholds: Thresholds,
    /// Each flight time.
    pub times: Vec<MadeTime>,
    /// Role of each grid that has one, by name.
    pub roles: BTreeMap<String, &'static str>,
    /// Motion of every section in every mode.
    pub sections: Vec<Moved>,
    /// What is doubtful, one sentence each.
    pub warnings: Vec<String>,
}

/// One flight time of an import.
#[derive(Debug, Clone)]
pub struct MadeTime {
    /// Flight time, s.
    pub flight_time_s: f64,
    /// Program that wrote the results.
    pub program: String,
    /// Grids with results in the files.
    pub grids: usize,
    /// Modes in the files.
    pub modes: usize,
    /// Rigid-body modes.
    pub rigid: RigidBody,
    /// Frequency of the first elastic mode, Hz.
    pub first_elastic_hz: f64,
    /// Mass properties that the files hold, and by what, beside those of the package.
    pub estimates: Vec<(&'static str, MassProperties)>,
    /// Grids of the package.
    pub chosen: Vec<Chosen>,
}

/// A grid of the package and what it was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// Its name.
    pub grid: String,
    /// What it was made from, for people.
    pub from: String,
}

/// Quality of a section's rotation in a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// Flight time, s.
    pub flight_time_s: f64,
    /// Grid of the package.
    pub grid: String,
    /// Label of the mode.
    pub label: String,
    /// Nodes of the section.
    pub nodes: usize,
    /// Misfit to a rigid motion over the motion, root mean squares, 0 to 1.
    pub residual: f64,
    /// Deviation of the rotation if the misfit is scatter, rad/m kg^-1/2.
    pub scatter: f64,
    /// Deviation of the rotation by the rounding of the stored translations, rad/m kg^-1/2.
    pub rounding: f64,
}
