//! The import description as it is written, before any check of what its values mean together.
//!
//! Types and ranges of single values live here; the rest is checked in `import`.

use crate::import::UnitSystem;
use crate::import::normalise::Normalisation;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// What `tvse import` is to make of the results of a finite element program.
///
/// Points and lengths whose key ends with `_m` are in the vehicle's frame, in metres.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "tvse import")]
pub struct ImportFile {
    /// Version of this format: 1.
    #[schemars(range(min = 1, max = 1))]
    pub format: u32,
    /// Where the modes come from, shown wherever they are shown.
    pub source: String,
    /// Units of the files.
    pub units: UnitSystem,
    /// `PARAM,WTMASS` of the deck, with units `in-lbm` alone.
    pub wtmass: Option<f64>,
    /// The vehicle's frame.
    pub frame: FrameFile,
    /// What the modes contain.
    pub body: BodyFile,
    /// Which modes, and how they are normalised.
    pub modes: ModesFile,
    /// Flight times with their results, ascending.
    #[schemars(length(min = 1))]
    pub flight_time: Vec<FlightTimeFile>,
    /// Sets of node ids by name, beside those in the files.
    #[serde(default)]
    pub set: BTreeMap<String, Vec<i64>>,
    /// Grids of the package, one by one.
    #[serde(default)]
    pub grid: Vec<GridFile>,
    /// Rows of grids along a line, each from the motion of a slice of the model.
    #[serde(default)]
    pub centreline: Vec<CentrelineFile>,
}

/// The vehicle's frame in the basic frame of the files: x along the centreline, positive aft.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrameFile {
    /// The vehicle's origin in the basic frame, in the files' unit of length (default: the same
    /// origin).
    #[serde(default)]
    pub origin: [f64; 3],
    /// Direction of the vehicle's +x, aft, in the basic frame.
    pub aft: [f64; 3],
    /// Direction of the vehicle's +y in the basic frame, perpendicular to `aft`.
    pub y: [f64; 3],
}

/// What the modes contain.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyFile {
    /// Whether the masses of the engines below are in the modes.
    pub kind: BodyKind,
    /// All engines of the vehicle; of a reduced body they may be left out, but then nothing checks
    /// that they are not in it.
    #[serde(default)]
    pub engine: Vec<BodyEngineFile>,
    /// Tanks of the vehicle file whose slosh masses the modes contain, locked (default: none).
    #[serde(default)]
    pub contains_tanks: Vec<String>,
}

/// Whether the engines are in the modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum BodyKind {
    /// The moving masses of the engines are not in the modes; the program adds them.
    Reduced,
    /// The engines are in the modes; the program adds their relative motion alone.
    Integrated,
}

/// An engine of the vehicle.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyEngineFile {
    /// Its path, `group.name` of the vehicle file.
    pub name: String,
    /// Its moving mass, kg, by which the declaration is checked against the mass of the model.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub mass_kg: Option<f64>,
}

/// Which modes, and how they are normalised.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModesFile {
    /// Normalisation in the files.
    pub normalisation: Normalisation,
    /// Elastic modes up to this frequency, Hz (default: all).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub max_hz: Option<f64>,
    /// This many of the lowest elastic modes (default: all).
    #[schemars(range(min = 1))]
    pub count: Option<usize>,
    /// Squared overlap above which a mode keeps its label from one flight time to the next.
    #[serde(default = "keep_overlap")]
    #[schemars(range(min = 0.5, max = 1.0))]
    pub keep_overlap: f64,
    /// Relative difference of frequencies under which modes count as repeated (default: a millionth,
    /// or what the digits of the files allow).
    #[schemars(range(min = 0.0, max = 0.01))]
    pub repeated: Option<f64>,
    /// Residual of a section (misfit to a rigid motion over the motion) above which it is reported.
    #[serde(default = "residual_bound")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub residual_bound: f64,
}

fn keep_overlap() -> f64 {
    crate::structure::Thresholds::default().keep
}

fn residual_bound() -> f64 {
    0.1
}

/// A flight time and its results.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlightTimeFile {
    /// Flight time, s.
    pub time_s: f64,
    /// Result files, and the deck where they hold no grids, relative to this file.
    #[schemars(length(min = 1))]
    pub results: Vec<String>,
    /// A mass matrix as a table (CSV: node, freedom 1 to 6, node, freedom, value), along the
    /// displacement axes of the nodes, from which generalised masses are made.
    pub mass_matrix: Option<String>,
    /// Mass properties of the body.
    pub mass: MassFile,
}

/// Mass properties of the body that the modes contain.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "from", rename_all = "kebab-case", deny_unknown_fields)]
pub enum MassFile {
    /// As declared here.
    Declared {
        /// Mass, kg.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        mass_kg: f64,
        /// Centre of gravity in the vehicle's frame, m.
        cg_m: [f64; 3],
        /// Inertia tensor about the cg, kg·m²: rows of xx, xy, xz; yx, yy, yz; zx, zy, zz, off the
        /// diagonal −∫ x y dm.
        inertia_kg_m2: [[f64; 3]; 3],
    },
    /// By the mass matrix of the six rigid-body modes.
    RigidBodyModes,
    /// By the lumped masses in the files.
    LumpedMasses,
}

/// What a grid is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Role {
    /// Gimbal of an engine.
    Gimbal,
    /// Attach point of an actuator; only its translation is used.
    Actuator,
    /// Case centreline, for jet damping of the case.
    Centreline,
    /// Rate gyro or attitude sensor.
    Sensor,
    /// Slosh mass of a tank.
    Tank,
}

impl Role {
    /// The word of the description.
    pub fn word(self) -> &'static str {
        match self {
            Self::Gimbal => "gimbal",
            Self::Actuator => "actuator",
            Self::Centreline => "centreline",
            Self::Sensor => "sensor",
            Self::Tank => "tank",
        }
    }
}

/// A grid of the package: a node of the model, or the motion of a section of it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridFile {
    /// Name of the grid in the package.
    pub name: String,
    /// What it is for.
    pub role: Option<Role>,
    /// The node of this id,
    pub node: Option<i64>,
    /// or the only node of this named set (a label),
    pub set: Option<String>,
    /// or the node nearest to this point, m, with `within_m`.
    pub nearest_m: Option<[f64; 3]>,
    /// Distance beyond which the nearest node is refused, m.
    #[schemars(range(min = 0.0))]
    pub within_m: Option<f64>,
    /// Nodes whose common motion gives the rotation, and the translation too where no node is named
    /// above.
    pub section: Option<SectionFile>,
}

/// Nodes of the model that should move as one.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SectionFile {
    /// These ids,
    pub nodes: Option<Vec<i64>>,
    /// or a named set,
    pub set: Option<String>,
    /// or all nodes near a point, m, with `radius_m`.
    pub near_m: Option<[f64; 3]>,
    /// Distance up to which nodes count, m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius_m: Option<f64>,
    /// Weight of each node of `nodes` (default: the same).
    #[serde(default)]
    pub weights: Vec<f64>,
    /// Point of which the translation is taken, m, where the grid names no node (default: the
    /// weighted centroid).
    pub at_m: Option<[f64; 3]>,
}

/// A row of grids along a line: at each station the motion of a slice of the model.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CentrelineFile {
    /// Prefix of the grids, `name.01`, `name.02`, … from `from_m` on.
    pub name: String,
    /// What they are for (default: centreline).
    pub role: Option<Role>,
    /// Start of the line, m.
    pub from_m: [f64; 3],
    /// End of the line, m.
    pub to_m: [f64; 3],
    /// Number of equally spaced stations, both ends among them; either this or `stations_m`.
    #[schemars(range(min = 2, max = 10_000))]
    pub stations: Option<usize>,
    /// Distances of the stations from `from_m`, m, ascending.
    pub stations_m: Option<Vec<f64>>,
    /// Thickness of the slice at each station, m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub slice_m: f64,
    /// Least and greatest distance of the nodes from the line, m.
    pub radius_m: [f64; 2],
    /// Only nodes of this named set.
    pub set: Option<String>,
}
