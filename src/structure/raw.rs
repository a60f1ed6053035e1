//! The stick model as it is written in `stick.toml`, before any check of its values.
//!
//! Only names and types live here; what is allowed is decided in `stick`.

use schemars::JsonSchema;
use serde::Deserialize;

/// The whole of `stick.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stick {
    /// Version of this format: 1.
    pub format: u32,
    /// Name of the model, shown wherever its modes are shown.
    pub name: String,
    /// Flight times at which modes are made unless others are asked for, s, increasing.
    pub flight_times_s: Vec<f64>,
    /// Whether the slosh shares `slosh_kg` of the liquids stay in the body (default true).
    #[serde(default = "yes")]
    pub slosh_in_body: bool,
    /// Materials by name.
    #[serde(default)]
    pub material: Vec<Material>,
    /// Beams.
    #[serde(default)]
    pub beam: Vec<Beam>,
    /// Point masses rigidly attached to a grid.
    #[serde(default)]
    pub point_mass: Vec<PointMass>,
    /// Springs between two grids.
    #[serde(default)]
    pub spring: Vec<Spring>,
    /// Further grids rigidly attached to a grid.
    #[serde(default)]
    pub point: Vec<Point>,
}

/// An isotropic material.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name.
    pub name: String,
    /// Young's modulus E, Pa.
    pub youngs_modulus_pa: f64,
    /// Shear modulus G, Pa.
    pub shear_modulus_pa: f64,
}

/// A straight beam of consecutive pieces.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Beam {
    /// Name.
    pub name: String,
    /// Position of the first grid, m.
    pub start_m: [f64; 3],
    /// Position of the last grid, m.
    pub end_m: [f64; 3],
    /// Station of the first grid, m (default 0); stations count along the beam from there.
    #[serde(default)]
    pub first_station_m: f64,
    /// A direction in the local x-z plane (default +z, or +y for a beam along z).
    pub up: Option<[f64; 3]>,
    /// Consecutive pieces from start to end.
    pub piece: Vec<Piece>,
    /// Masses spread along the beam.
    #[serde(default)]
    pub mass: Vec<LineMass>,
}

/// A piece of a beam, divided into equal elements.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Piece {
    /// Prefix of its grids: `grids.01`, `grids.02`, …; the grid between two pieces belongs to the
    /// one that follows, the last grid of the beam to the last piece.
    pub grids: String,
    /// Station at which the piece ends, m.
    pub to_station_m: f64,
    /// Number of equal elements.
    pub elements: usize,
    /// Name of its material.
    pub material: String,
    /// Cross section at the start of the piece.
    pub section: Section,
    /// Cross section at the end, linear in between (default: as at the start).
    pub end_section: Option<Section>,
}

/// A cross section: either a thin tube (radius and thickness) or its four properties.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Mean radius of a tube, m.
    pub radius_m: Option<f64>,
    /// Wall thickness of a tube, m.
    pub thickness_m: Option<f64>,
    /// Area, m².
    pub area_m2: Option<f64>,
    /// Second moment of area about the local y axis (bending in the local x-z plane), m⁴.
    pub inertia_y_m4: Option<f64>,
    /// Second moment of area about the local z axis (bending in the local x-y plane), m⁴.
    pub inertia_z_m4: Option<f64>,
    /// Torsion constant, m⁴.
    pub torsion_m4: Option<f64>,
}

/// A mass spread along a beam.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineMass {
    /// Name.
    pub name: String,
    /// Station at which it begins, m (default: start of the beam).
    pub from_station_m: Option<f64>,
    /// Station at which it ends, m (default: end of the beam).
    pub to_station_m: Option<f64>,
    /// Flight times of `mass_kg`, s, increasing; left out for a constant mass.
    #[serde(default)]
    pub time_s: Vec<f64>,
    /// Mass, kg: one value, or one at each of `time_s` (linear in between).
    pub mass_kg: Vec<f64>,
    /// For a settled liquid: the mass that would fill the whole range, kg. The liquid then stands
    /// against the end of the range and its surface falls; otherwise the mass is spread evenly.
    pub full_kg: Option<f64>,
    /// Whether it takes part in axial motion (default true).
    #[serde(default = "yes")]
    pub axial: bool,
    /// Whether it takes part in torsion (default true).
    #[serde(default = "yes")]
    pub torsion: bool,
    /// Radius of gyration about the beam's axis, m (default: that of the cross section).
    pub gyration_m: Option<f64>,
    /// Part of the mass that sloshes, kg (default 0); see `slosh_in_body`.
    #[serde(default)]
    pub slosh_kg: f64,
}

/// A point mass.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointMass {
    /// Name, also the name of the grid made for it.
    pub name: String,
    /// Beam grid to which it is rigidly attached.
    pub grid: String,
    /// Position of its centre of mass, m (default: that of the grid).
    pub position_m: Option<[f64; 3]>,
    /// Flight times of `mass_kg`, s, increasing; left out for a constant mass.
    #[serde(default)]
    pub time_s: Vec<f64>,
    /// Mass, kg: one value, or one at each of `time_s`.
    pub mass_kg: Vec<f64>,
    /// Inertias about x, y, z through its centre of mass, kg·m² (default 0).
    #[serde(default)]
    pub inertia_kg_m2: [f64; 3],
}

/// A spring at one point, with rigid links from that point to its two grids.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Name.
    pub name: String,
    /// The two beam grids it connects.
    pub grids: [String; 2],
    /// The point where it acts, m.
    pub position_m: [f64; 3],
    /// Stiffness along x, y, z, N/m (default 0).
    #[serde(default)]
    pub translation_n_m: [f64; 3],
    /// Stiffness about x, y, z, N·m/rad (default 0).
    #[serde(default)]
    pub rotation_n_m_rad: [f64; 3],
}

/// A massless grid rigidly attached to a beam grid.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Name of the grid.
    pub name: String,
    /// Beam grid to which it is rigidly attached.
    pub grid: String,
    /// Its position, m (default: that of the grid).
    pub position_m: Option<[f64; 3]>,
}

fn yes() -> bool {
    true
}
