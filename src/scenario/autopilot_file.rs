//! The autopilot as it is written in a vehicle file, before any check of what its values mean together.
//!
//! Types and ranges of single values live here; the rest is checked in `autopilot`.

use crate::vehicle::delay::HIGHEST_ORDER;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The autopilot: sensors, paths from their signals to axis commands, allocation to gimbals.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AutopilotFile {
    /// Loop delay at the end of each axis, s.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub delay_s: f64,
    /// Order n of the Padé approximation [n/n] of delays in models with states; frequency responses are
    /// exact.
    #[serde(default = "four")]
    #[schemars(range(min = 1, max = HIGHEST_ORDER))]
    pub delay_order: u64,
    /// Sensors, each about all three axes.
    #[schemars(length(min = 1))]
    pub sensor: Vec<SensorFile>,
    /// Paths.
    #[schemars(length(min = 1))]
    pub path: Vec<PathFile>,
    /// From axis commands to gimbal commands.
    pub allocation: AllocationFile,
}

fn four() -> u64 {
    4
}

fn one() -> f64 {
    1.0
}

/// A sensor at a grid.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorFile {
    /// Name; a–z, 0–9 and _.
    pub name: String,
    /// What it measures.
    pub kind: SensorKindFile,
    /// Its grid.
    pub grid: String,
    /// Scale factor.
    #[serde(default = "one")]
    pub scale: f64,
}

/// What a sensor measures.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKindFile {
    /// Rotation rate: signals `gyro.<name>.<axis>`, rad/s.
    RateGyro,
    /// Rotation: signals `attitude.<name>.<axis>`, rad.
    Attitude,
}

/// A weighted sum of signals, times a gain, through filters in series.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathFile {
    /// Name; its output is the signal `path.<name>`.
    pub name: String,
    /// Signals and their weights: `gyro.<sensor>.<axis>`, `attitude.<sensor>.<axis>` or `path.<path>`.
    pub input: BTreeMap<String, f64>,
    /// Gain.
    #[serde(default = "one")]
    pub gain: f64,
    /// Axis of whose feedback its output is a part.
    pub axis: Option<AxisFile>,
    /// Filters, in series.
    #[serde(default)]
    pub filter: Vec<FilterFile>,
}

/// A rotation about an axis of the structural frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum AxisFile {
    /// About x.
    Roll,
    /// About y.
    Pitch,
    /// About z.
    Yaw,
}

/// A filter.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum FilterFile {
    /// A factor.
    Gain {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// The factor.
        value: f64,
    },
    /// First-order lag 1/(1 + s/ω).
    Lag {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Corner, Hz.
        #[schemars(extend("minimum" = 1e-6, "maximum" = 1e6))]
        frequency_hz: f64,
    },
    /// Lead-lag (1 + s/ω_z)/(1 + s/ω_p).
    LeadLag {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Zero, Hz.
        #[schemars(extend("minimum" = 1e-6, "maximum" = 1e6))]
        zero_hz: f64,
        /// Pole, Hz.
        #[schemars(extend("minimum" = 1e-6, "maximum" = 1e6))]
        pole_hz: f64,
    },
    /// Notch (s² + 2ζ_z ω s + ω²)/(s² + 2ζ_p ω s + ω²).
    Notch {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Frequency, Hz.
        #[schemars(extend("minimum" = 1e-6, "maximum" = 1e6))]
        frequency_hz: f64,
        /// Damping ratio of the zeros.
        zero_damping: f64,
        /// Damping ratio of the poles.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pole_damping: f64,
    },
    /// Bending filter (s²/ω_z² + 2ζ_z s/ω_z + 1)/(s²/ω_p² + 2ζ_p s/ω_p + 1).
    Bending {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Frequency of the zeros, Hz.
        #[schemars(extend("minimum" = 1e-6, "maximum" = 1e6))]
        zero_hz: f64,
        /// Damping ratio of the zeros.
        zero_damping: f64,
        /// Frequency of the poles, Hz.
        #[schemars(extend("minimum" = 1e-6, "maximum" = 1e6))]
        pole_hz: f64,
        /// Damping ratio of the poles.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        pole_damping: f64,
    },
    /// Second-order low pass 1/(s²/ω² + 2ζ s/ω + 1).
    LowPass {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Frequency, Hz.
        #[schemars(extend("minimum" = 1e-6, "maximum" = 1e6))]
        frequency_hz: f64,
        /// Damping ratio.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        damping: f64,
    },
    /// Second-order section.
    Section {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Coefficients of s², s and 1 above.
        numerator: [f64; 3],
        /// Coefficients of s², s and 1 below.
        denominator: [f64; 3],
    },
    /// Ratio of polynomials in s.
    TransferFunction {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Coefficients above, falling powers of s.
        #[schemars(length(min = 1))]
        numerator: Vec<f64>,
        /// Coefficients below, falling powers of s.
        #[schemars(length(min = 1))]
        denominator: Vec<f64>,
    },
    /// Integrator 1/s.
    Integrator {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
    },
    /// Delay.
    Delay {
        /// Name inside its path (default: its number, from 1).
        name: Option<String>,
        /// Delay, s.
        #[schemars(range(min = 0.0))]
        delay_s: f64,
        /// Order of its Padé approximation (default: `delay_order`).
        #[schemars(range(min = 1, max = HIGHEST_ORDER))]
        order: Option<u64>,
    },
}

/// From axis commands to gimbal commands.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AllocationFile {
    /// Gimbals commanded, `<group>.<engine>.<actuator>`, with `*` for any part.
    #[schemars(length(min = 1))]
    pub gimbals: Vec<String>,
    /// A row per gimbal, in the order of the vehicle file: rotation per unit roll, pitch and yaw command.
    /// Left out, it is made by least squares from the positions of the engines.
    pub matrix: Option<Vec<[f64; 3]>>,
    /// Without `matrix`: flight time of masses and thrust, s (default: the first of the vehicle).
    pub time_s: Option<f64>,
}
