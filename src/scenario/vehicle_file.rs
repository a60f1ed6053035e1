//! The vehicle file as it is written, before any check of what its values mean together.
//!
//! Types and ranges of single values live here; the rest is checked in `vehicle`.

use super::autopilot_file::AutopilotFile;
use schemars::JsonSchema;
use serde::Deserialize;

/// A vehicle: engines, nozzles, actuators, motors, and the modal package of its body.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "tvse vehicle")]
pub struct VehicleFile {
    /// Name shown wherever results are shown.
    pub name: String,
    /// Folder of the modal package, relative to this file.
    pub modal_package: String,
    /// Flight times at which the vehicle can be evaluated, s, ascending; the modal package holds
    /// modes at each of them.
    #[schemars(length(min = 1))]
    pub flight_times_s: Vec<f64>,
    /// The elastic structure.
    pub structure: StructureFile,
    /// Modes of interest by name.
    #[serde(default)]
    pub named_mode: Vec<NamedModeFile>,
    /// Motors, to which engines refer by name.
    #[schemars(length(min = 1))]
    pub motor: Vec<MotorFile>,
    /// Engines.
    #[schemars(length(min = 1))]
    pub engine: Vec<EngineFile>,
    /// Tanks whose liquids slosh.
    #[serde(default)]
    pub tank: Vec<TankFile>,
    /// Aerodynamics along the trajectory.
    pub aerodynamics: Option<AerodynamicsFile>,
    /// Autopilot.
    pub autopilot: Option<AutopilotFile>,
}

/// A tank: its slosh mass on a spring, given directly or from its geometry and fill.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TankFile {
    /// Name, the second segment of its parameter paths.
    pub name: String,
    /// Grid at which the slosh mass is attached.
    pub grid: String,
    /// Unit vector of the tank axis (default: along x).
    #[serde(default = "along_x")]
    pub axis: [f64; 3],
    /// Slosh damping ratio.
    #[schemars(range(min = 0.0))]
    pub damping_ratio: f64,
    /// Flight times of the tables, s, ascending.
    #[schemars(length(min = 1))]
    pub time_s: Vec<f64>,
    /// Slosh mass at each time, kg; with `frequency_hz`.
    pub slosh_mass_kg: Option<Vec<f64>>,
    /// Slosh frequency at each time, Hz; with `slosh_mass_kg`.
    pub frequency_hz: Option<Vec<f64>>,
    /// Upright flat-bottomed cylinder; with `liquid_kg`.
    pub cylinder: Option<CylinderFile>,
    /// Mass of the liquid at each time, kg; with `cylinder`.
    pub liquid_kg: Option<Vec<f64>>,
}

fn along_x() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

/// An upright flat-bottomed cylinder.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderFile {
    /// Radius, m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius_m: f64,
    /// Density of the liquid, kg/m³.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density_kg_m3: f64,
}

/// Aerodynamic coefficients at flight conditions, linear between the entries.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AerodynamicsFile {
    /// Reference area, m².
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub area_m2: f64,
    /// Reference length, m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length_m: f64,
    /// Flight times of the tables, s, ascending.
    #[schemars(length(min = 1))]
    pub time_s: Vec<f64>,
    /// Dynamic pressure at each time, Pa.
    pub dynamic_pressure_pa: Vec<f64>,
    /// Speed at each time, m/s.
    pub speed_m_s: Vec<f64>,
    /// Slope of the normal force coefficient at each time, 1/rad.
    pub normal_force_slope_1_rad: Vec<f64>,
    /// Station of the centre of pressure at each time, m: where the normal force of the angle of attack
    /// of the vehicle's cg acts.
    pub center_of_pressure_x_m: Vec<f64>,
    /// Axial force coefficient at each time.
    pub axial_force: Vec<f64>,
    /// Damping coefficient C_mq in pitch and yaw at each time (moment about the cg per q S D and θ̇ D/2V),
    /// negative where it damps: the whole rate derivative; nothing is added for the centre of pressure.
    pub pitch_damping: Vec<f64>,
    /// Damping coefficient in roll at each time, negative where it damps.
    pub roll_damping: Vec<f64>,
    /// Generalised matrices, at most one a flight time.
    #[serde(default)]
    pub matrix: Vec<AerodynamicMatrixFile>,
}

/// Generalised aerodynamic forces at one flight time, per unit dynamic pressure:
/// `Q = q (stiffness · x + damping · ẋ)`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AerodynamicMatrixFile {
    /// Flight time, s.
    pub flight_time_s: f64,
    /// Coordinates of rows and columns: modal labels, or `xi.y`, `theta.z`, ….
    #[schemars(length(min = 1))]
    pub coordinates: Vec<String>,
    /// Force per displacement and dynamic pressure, a row per coordinate.
    pub stiffness: Vec<Vec<f64>>,
    /// Force per rate and dynamic pressure, a row per coordinate.
    pub damping: Vec<Vec<f64>>,
}

/// The elastic structure.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StructureFile {
    /// Damping ratio of every mode.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
    pub damping_ratio: f64,
    /// Flight time whose nominal frequency decides in which frequency band a mode is dispersed, s.
    pub band_time_s: f64,
}

/// A mode of interest by name.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedModeFile {
    /// Name.
    pub name: String,
    /// Labels of the modal package that carry the name; at a flight time the first one present
    /// counts.
    #[schemars(length(min = 1))]
    pub labels: Vec<String>,
}

/// Thrust and mass flow of a motor in time, linear between the entries.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorFile {
    /// Name.
    pub name: String,
    /// Vacuum specific impulse, s.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub specific_impulse_s: f64,
    /// Flight times of the tables, s, ascending.
    #[schemars(length(min = 1))]
    pub time_s: Vec<f64>,
    /// Thrust at each time, N.
    pub thrust_n: Vec<f64>,
    /// Mass flow at each time, kg/s.
    pub mass_flow_kg_s: Vec<f64>,
    /// Burned fraction of the propellant at each time, 0 to 1; needed where a nozzle ablates.
    pub burned_fraction: Option<Vec<f64>>,
}

/// An engine: a vectored nozzle on its gimbal.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EngineFile {
    /// Group, the first segment of its parameter paths.
    pub group: String,
    /// Name inside the group, the second segment.
    pub name: String,
    /// Name of its motor.
    pub motor: String,
    /// Grid of the gimbal point.
    pub gimbal_grid: String,
    /// Unit vector of the thrust force on the vehicle.
    pub thrust_direction: [f64; 3],
    /// The two gimbal axes, orthonormal and normal to the thrust; actuator n drives axis n. Left
    /// out, they are made from the moments of the actuators' action lines about the gimbal.
    pub axes: Option<[[f64; 3]; 2]>,
    /// Case centreline grids from the head end to the throat, by name or with `*`; those that
    /// match a `*` are taken along the flow, as far as the throat.
    #[serde(default)]
    pub case_stations: Vec<String>,
    /// Grid of the throat, the last case station (default: the gimbal).
    pub throat_grid: Option<String>,
    /// The moving part.
    pub nozzle: NozzleFile,
    /// Flex bearing.
    pub bearing: Option<BearingFile>,
    /// The two actuators, one for each axis, and two more for each alternative `set`.
    #[schemars(length(min = 2))]
    pub actuator: Vec<ActuatorFile>,
}

/// The moving part of an engine, rotationally symmetric about its axis.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NozzleFile {
    /// Moving mass, unablated, kg.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub mass_kg: f64,
    /// Distance of the cg from the pivot along the exhaust, m (negative: forward of the pivot).
    pub cg_m: f64,
    /// Transverse inertia about the pivot, unablated, kg·m².
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inertia_kg_m2: f64,
    /// Inertia about the nozzle's own axis, kg·m².
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub axial_inertia_kg_m2: f64,
    /// Length from the pivot to the exit plane, m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length_m: f64,
    /// Ablation of the liner.
    pub ablation: Option<AblationFile>,
}

/// Ablation of the liner: what is lost at unit factor when all propellant is burned.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AblationFile {
    /// Ablation factor.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0))]
    pub factor: f64,
    /// Mass lost, kg.
    #[schemars(range(min = 0.0))]
    pub mass_loss_kg: f64,
    /// Transverse inertia about the pivot lost, kg·m².
    #[schemars(range(min = 0.0))]
    pub inertia_loss_kg_m2: f64,
    /// Change of the cg distance from the pivot, m (negative: towards the pivot).
    pub cg_change_m: f64,
}

fn one() -> f64 {
    1.0
}

/// Flex bearing.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BearingFile {
    /// Stiffness, N·m/rad.
    #[schemars(range(min = 0.0))]
    pub stiffness_n_m_rad: f64,
    /// Damping, N·m·s/rad.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub damping_n_m_s_rad: f64,
}

/// An actuator of one gimbal axis.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActuatorFile {
    /// Name inside its engine, the third segment of its parameter paths.
    pub name: String,
    /// Alternative set of which it is a part: a variant picks it by this name. Its two actuators stand
    /// in the place of the engine's own, in the order of the axes. Left out: the engine's own.
    pub set: Option<String>,
    /// Grid of the backup structure to which it is attached; for the engine's own actuators only.
    pub attach_grid: Option<String>,
    /// Attach point from the gimbal, m (default: from the positions of the two grids).
    pub attach_m: Option<[f64; 3]>,
    /// Unit vector of the action line; for the engine's own actuators only.
    pub action_line: Option<[f64; 3]>,
    /// Torque law.
    pub kind: ActuatorKind,
    /// Second-order: stiffness at the reference inertia, N·m/rad; either this or `frequency_hz`.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness_n_m_rad: Option<f64>,
    /// Second-order: natural frequency at the reference inertia, Hz; either this or
    /// `stiffness_n_m_rad`.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub frequency_hz: Option<f64>,
    /// Second-order: closed-loop damping ratio at the reference inertia, the nominal unablated one about
    /// the pivot.
    #[schemars(range(min = 0.0))]
    pub damping_ratio: Option<f64>,
    /// Numbers of an electrohydraulic actuator.
    pub electrohydraulic: Option<ElectrohydraulicFile>,
    /// Numbers of an actuator given by transfer functions.
    pub transfer_function: Option<TransferFunctionFile>,
    /// Matrices of an actuator in state space.
    pub state_space: Option<StateSpaceFile>,
    /// Whether stiffness and damping of the flex bearing are part of the actuator's (default: included for
    /// second-order, separate for electrohydraulic).
    pub bearing: Option<BearingPart>,
}

/// Torque law of an actuator.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum ActuatorKind {
    /// Spring and damper between command and nozzle.
    SecondOrder,
    /// Servo valve, cylinder and load path, with a position loop.
    Electrohydraulic,
    /// Torque by transfer functions from command and rotation.
    TransferFunction,
    /// Torque by matrices from command, rotation and its rate.
    StateSpace,
}

impl ActuatorKind {
    /// Its word in a vehicle file.
    pub fn name(self) -> &'static str {
        match self {
            Self::SecondOrder => "second-order",
            Self::Electrohydraulic => "electrohydraulic",
            Self::TransferFunction => "transfer-function",
            Self::StateSpace => "state-space",
        }
    }
}

/// An electrohydraulic actuator with a massless piston.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElectrohydraulicFile {
    /// Moment arm about the pivot, m (default: from attach point and action line).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub arm_m: Option<f64>,
    /// Piston area, m².
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub piston_area_m2: f64,
    /// Stiffness of the load path: both attachments and the rod, N/m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub load_path_stiffness_n_m: f64,
    /// Stiffness of the trapped oil on the piston, N/m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub oil_stiffness_n_m: f64,
    /// Leakage past the piston, m³/(s·Pa).
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub leakage_m3_s_pa: f64,
    /// Flow gain of the servo valve without load, m³/(s·A).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub valve_flow_gain_m3_s_a: f64,
    /// Pressure gain of the servo valve with the load blocked, Pa/A (default: infinite).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub valve_pressure_gain_pa_a: Option<f64>,
    /// Gain of the position loop: current per piston position error, A/m.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub position_gain_a_m: f64,
    /// Gain of the dynamic pressure feedback, A/Pa.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub pressure_feedback_a_pa: f64,
    /// Corner of the high pass in the pressure feedback, Hz; 0: the pressure itself is fed back.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub pressure_corner_hz: f64,
}

/// Torque = G(s) δ_c − Z(s) Θ − C Θ̇, N·m.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransferFunctionFile {
    /// Numerator of the dynamic stiffness Z, N·m/rad, falling powers of s.
    #[schemars(length(min = 1))]
    pub numerator: Vec<f64>,
    /// Denominator of Z.
    #[schemars(length(min = 1))]
    pub denominator: Vec<f64>,
    /// Numerator of the torque per command G, N·m/rad (default: G = Z).
    #[schemars(length(min = 1))]
    pub command_numerator: Option<Vec<f64>>,
    /// Denominator of G.
    #[schemars(length(min = 1))]
    pub command_denominator: Option<Vec<f64>>,
    /// Damping C, N·m·s/rad.
    #[serde(default)]
    pub damping_n_m_s_rad: f64,
}

/// ẋ = a x + b [δ_c, Θ, Θ̇], torque = c x + d [δ_c, Θ, Θ̇], N·m.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StateSpaceFile {
    /// a, n rows of n; empty without states.
    pub a: Vec<Vec<f64>>,
    /// b, n rows for [δ_c, Θ, Θ̇].
    pub b: Vec<[f64; 3]>,
    /// c, n entries.
    pub c: Vec<f64>,
    /// d, for [δ_c, Θ, Θ̇].
    pub d: [f64; 3],
}

/// Whether the flex bearing is part of an actuator's stiffness.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum BearingPart {
    /// Inside the actuator's stiffness, not added.
    Included,
    /// Acts on the gimbal rotation besides the actuator.
    Separate,
}
