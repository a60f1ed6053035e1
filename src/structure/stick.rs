//! A validated stick model: beams, masses and springs whose values are allowed.
//!
//! It holds the nominal description over all flight times; texts are read in `reading`, matrices
//! are made in `weigh`.

use crate::vehicle::motor::interpolate;
use nalgebra::{Matrix3, Vector3};

/// Most elements of a model; beyond it the dense solution would take minutes and gigabytes.
pub const MAX_ELEMENTS: usize = 1000;

/// A validated stick model.
#[derive(Debug, Clone)]
pub struct Stick {
    /// Name of the model.
    pub name: String,
    /// Flight times at which modes are made by default, s, increasing.
    pub flight_times_s: Vec<f64>,
    /// Whether the slosh shares stay in the body.
    pub slosh_in_body: bool,
    /// Nodes with six degrees of freedom each.
    pub nodes: Vec<Node>,
    /// Beam elements.
    pub elements: Vec<Element>,
    /// Masses spread along elements.
    pub line_masses: Vec<LineMass>,
    /// Point masses.
    pub point_masses: Vec<PointMass>,
    /// Springs.
    pub springs: Vec<Spring>,
    /// Massless grids.
    pub points: Vec<Point>,
}

/// A node: a named point with three translations and three rotations.
#[derive(Debug, Clone)]
pub struct Node {
    /// Name of its grid.
    pub name: String,
    /// Position, m.
    pub position_m: Vector3<f64>,
}

/// A beam element between two nodes.
#[derive(Debug, Clone)]
pub struct Element {
    /// Nodes at its start and end.
    pub nodes: [usize; 2],
    /// Stations of its start and end on its beam, m.
    pub stations_m: [f64; 2],
    /// Local axes as rows: along the beam, local y, local z.
    pub axes: Matrix3<f64>,
    /// Cross section at its start and end.
    pub sections: [Section; 2],
    /// Young's modulus, Pa.
    pub youngs_modulus_pa: f64,
    /// Shear modulus, Pa.
    pub shear_modulus_pa: f64,
}

/// A cross section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Section {
    /// A circular tube.
    Tube {
        /// Mean radius, m.
        radius_m: f64,
        /// Wall thickness, m.
        thickness_m: f64,
    },
    /// Any section by its properties.
    General(Properties),
}

/// Properties of a cross section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Properties {
    /// Area, m².
    pub area_m2: f64,
    /// Second moment of area about local y, m⁴.
    pub inertia_y_m4: f64,
    /// Second moment of area about local z, m⁴.
    pub inertia_z_m4: f64,
    /// Torsion constant, m⁴.
    pub torsion_m4: f64,
}

impl Section {
    /// Properties a fraction `w` of the way from `self` to `end`: linear in radius and thickness
    /// for two tubes, in the properties otherwise.
    pub fn toward(&self, end: &Section, w: f64) -> Properties {
        let mix = |a: f64, b: f64| a + w * (b - a);
        match (self, end) {
            (
                Section::Tube { radius_m: r0, thickness_m: t0 },
                Section::Tube { radius_m: r1, thickness_m: t1 },
            ) => tube(mix(*r0, *r1), mix(*t0, *t1)),
            _ => {
                let (a, b) = (self.properties(), end.properties());
                Properties {
                    area_m2: mix(a.area_m2, b.area_m2),
                    inertia_y_m4: mix(a.inertia_y_m4, b.inertia_y_m4),
                    inertia_z_m4: mix(a.inertia_z_m4, b.inertia_z_m4),
                    torsion_m4: mix(a.torsion_m4, b.torsion_m4),
                }
            }
        }
    }

    fn properties(&self) -> Properties {
        match *self {
            Section::Tube { radius_m, thickness_m } => tube(radius_m, thickness_m),
            Section::General(properties) => properties,
        }
    }
}

/// Exact properties of an annulus of mean radius r and thickness t:
/// A = 2πrt, I = πrt(r² + t²/4), J = 2I.
fn tube(r: f64, t: f64) -> Properties {
    use std::f64::consts::PI;
    let inertia = PI * r * t * (r * r + t * t / 4.0);
    Properties {
        area_m2: 2.0 * PI * r * t,
        inertia_y_m4: inertia,
        inertia_z_m4: inertia,
        torsion_m4: 2.0 * inertia,
    }
}

/// A value in flight time: constant, or linear between the entries of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    pub(super) time_s: Vec<f64>,
    pub(super) value: Vec<f64>,
}

impl History {
    /// The value at `time_s`; `None` outside the table.
    pub fn at(&self, time_s: f64) -> Option<f64> {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(&first), Some(&last)) => (first <= time_s && time_s <= last)
                .then(|| interpolate(&self.time_s, &self.value, time_s)),
            _ => self.value.first().copied(),
        }
    }
}

/// A mass spread along the elements of one beam.
#[derive(Debug, Clone)]
pub struct LineMass {
    /// Name.
    pub name: String,
    /// Elements of its beam, as a range of `Stick::elements`.
    pub elements: std::ops::Range<usize>,
    /// Stations between which it lies, m.
    pub stations_m: [f64; 2],
    /// Mass in time, kg.
    pub mass_kg: History,
    /// Mass that fills the whole range, kg, for a settled liquid.
    pub full_kg: Option<f64>,
    /// Whether it moves axially with the beam.
    pub axial: bool,
    /// Whether it turns with the beam.
    pub torsion: bool,
    /// Radius of gyration about the axis, m; that of the section if `None`.
    pub gyration_m: Option<f64>,
    /// Sloshing part, kg.
    pub slosh_kg: f64,
}

/// A point mass on a rigid link.
#[derive(Debug, Clone)]
pub struct PointMass {
    /// Name of its grid.
    pub name: String,
    /// Node to which it is attached.
    pub node: usize,
    /// Position, m.
    pub position_m: Vector3<f64>,
    /// Mass in time, kg.
    pub mass_kg: History,
    /// Principal inertias about x, y, z, kg·m².
    pub inertia_kg_m2: Vector3<f64>,
}

/// A spring at a point between two nodes on rigid links.
#[derive(Debug, Clone)]
pub struct Spring {
    /// Nodes.
    pub nodes: [usize; 2],
    /// Point where it acts, m.
    pub position_m: Vector3<f64>,
    /// Stiffnesses along x, y, z, N/m.
    pub translation_n_m: Vector3<f64>,
    /// Stiffnesses about x, y, z, N·m/rad.
    pub rotation_n_m_rad: Vector3<f64>,
}

/// A massless grid on a rigid link.
#[derive(Debug, Clone)]
pub struct Point {
    /// Name of the grid.
    pub name: String,
    /// Node to which it is attached.
    pub node: usize,
    /// Position, m.
    pub position_m: Vector3<f64>,
}
