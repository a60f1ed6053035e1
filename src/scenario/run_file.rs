//! The run definition as it is written, before any check of what its values mean together.
//!
//! Types and ranges of single values live here; the rest is checked in `run`.

use crate::campaign::definition::MOST_CASES;
use crate::margins::Settings;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A campaign: which vehicle and dispersion, how many cases, evaluated where and how.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "tvse run definition")]
pub struct RunFile {
    /// The vehicle: its folder or its file, relative to this file.
    pub vehicle: String,
    /// The dispersion table, relative to this file.
    pub dispersion: String,
    /// Gates for the run, relative to this file; `tvse check` holds them against the run definition.
    /// They are applied where `--gates` names them.
    pub gates: Option<String>,
    /// Number of dispersed cases; left out where the plan has its own.
    #[schemars(range(min = 1, max = MOST_CASES))]
    pub cases: Option<u64>,
    /// How the dispersed cases come about; `monte_carlo` unless given.
    #[serde(default)]
    pub plan: PlanFile,
    /// Seed of every draw.
    pub seed: u64,
    /// Flight times, s, ascending (default: all of the vehicle).
    #[schemars(length(min = 1))]
    pub flight_times_s: Option<Vec<f64>>,
    /// Named modes of interest.
    #[schemars(length(min = 1))]
    pub modes: Vec<String>,
    /// Engines that are gimballed, by path or with `*`; the others are locked.
    #[serde(default = "every_engine")]
    pub gimballed: Vec<String>,
    /// How poles are followed from the nominal to a case.
    #[serde(default)]
    pub identity: IdentityFile,
    /// Margins of the flight control loops, if they are asked for.
    pub margins: Option<MarginsFile>,
    /// Ways to evaluate each draw.
    #[schemars(length(min = 1))]
    pub variant: Vec<VariantFile>,
    /// Adverse corners: fixed cases with Monte Carlo around them.
    #[serde(default)]
    pub corner: Vec<CornerFile>,
    /// Where the poles are stored with their derivatives by every draw (default: nowhere).
    pub sensitivity: Option<SensitivityFile>,
    /// Fixed cases, for instance those that `tvse worst` found and wrote.
    #[serde(default)]
    pub fixed: Vec<FixedFile>,
}

/// Evaluations whose poles are stored with the change of damping ratio and real part per σ of every
/// draw key: two more columns of the table `modes` a key.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensitivityFile {
    /// Names of variants (default: all).
    pub variants: Option<Vec<String>>,
    /// Flight times of the run, s (default: all).
    pub flight_times_s: Option<Vec<f64>>,
    /// Only the first cases of each population (default: all).
    #[schemars(range(min = 1, max = MOST_CASES))]
    pub cases: Option<u64>,
}

/// A fixed case: draw keys at given values, the others nominal; and Monte Carlo around it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedFile {
    /// Name, a–z, 0–9 and _.
    pub name: String,
    /// Whole draw keys and their values, in the unit of the law.
    pub values: BTreeMap<String, f64>,
    /// Number of cases around it: keys without a value, and those in `free`, are drawn.
    #[serde(default)]
    #[schemars(range(max = MOST_CASES))]
    pub cases: u64,
    /// Keys with a value that are drawn all the same in the cases around it, by parameter path, with `*`,
    /// or whole key.
    #[serde(default)]
    pub free: Vec<String>,
}

fn every_engine() -> Vec<String> {
    vec!["*.*".into()]
}

/// How the dispersed cases come about.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum PlanFile {
    /// Independent draws; the only plan from whose cases exact intervals and tolerance bounds follow.
    MonteCarlo {},
    /// Latin hypercube: every key is stratified. More cases change the first ones: such a run cannot be
    /// extended.
    LatinHypercube {
        /// Independent hypercubes of cases/replicates points (default 1); two or more give intervals.
        #[schemars(range(min = 1, max = MOST_REPLICATES))]
        replicates: Option<u64>,
    },
    /// Sobol sequence with Owen's scrambling; best with a power of two of cases a replicate.
    Sobol {
        /// Independent scramblings (default 1); two or more give intervals.
        #[schemars(range(min = 1, max = MOST_REPLICATES))]
        replicates: Option<u64>,
    },
    /// Outer draws of what is known, each with an inner Monte Carlo over what is not (`class` of the
    /// dispersion's rows). `cases` is left out.
    Nested {
        /// Number of outer draws.
        #[schemars(range(min = 1, max = MOST_CASES))]
        outer: u64,
        /// Cases for each outer draw.
        #[schemars(range(min = 1, max = MOST_CASES))]
        inner: u64,
        /// What outer draws hold: what is known by then (default `flight_day`: vehicle and flight day).
        known: Option<KnownFile>,
        /// The statement about each outer draw: the share of unstable cases that it may have …
        #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
        allowed_share_unstable: f64,
        /// … with this consumer's risk.
        #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
        risk: f64,
    },
    /// Two samples and their crossings for first-order and total sensitivity indices: d + 2 cases a
    /// row for d draw keys. `cases` is left out.
    Saltelli {
        /// Number of rows.
        #[schemars(range(min = 2, max = MOST_CASES))]
        rows: u64,
    },
    /// One key after the other at a low and a high place, all else nominal. `cases` is left out.
    OneAtATime {
        /// Keys, by parameter path, with `*`, or whole key (default: every key that can be).
        keys: Option<Vec<String>>,
        /// Low and high normal score (default: the `worst` values).
        at: Option<[f64; 2]>,
    },
    /// Every key at a low or a high place: two-level factorial. `cases` is left out.
    Corners {
        /// Keys, by parameter path, with `*`, or whole key (default: every key that can be).
        keys: Option<Vec<String>>,
        /// Low and high normal score (default: the `worst` values).
        at: Option<[f64; 2]>,
        /// A fraction of this resolution instead of all corners: 3, 4 or 5.
        #[schemars(range(min = 3, max = 5))]
        resolution: Option<u64>,
    },
    /// Cases from a CSV or Parquet file with a column for every draw key. `cases` is left out.
    File {
        /// The file, relative to this one; a name that ends in `.csv` or `.parquet`.
        path: String,
        /// What columns called by a draw key hold (default `value`). A column called `draw_…`, as in
        /// the table `cases`, holds values, one called `z_…` normal scores, whatever is said here.
        columns: Option<ColumnsFile>,
    },
}

/// Most independent replicates of a plan.
const MOST_REPLICATES: u64 = 1000;

impl Default for PlanFile {
    fn default() -> Self {
        Self::MonteCarlo {}
    }
}

/// What outer draws hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KnownFile {
    /// What is known per vehicle.
    Vehicle,
    /// What is known per vehicle and on the flight day.
    FlightDay,
}

/// What the columns of a plan file hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColumnsFile {
    /// Values, in the unit of the law.
    Value,
    /// Normal scores z = Φ⁻¹(F(x)).
    NormalScore,
}

/// How poles are followed from the nominal to a case.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdentityFile {
    /// Second-best over best overlap above which a case is followed by homotopy and both poles
    /// are stored.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub exchange_ratio: f64,
}

impl Default for IdentityFile {
    fn default() -> Self {
        Self { exchange_ratio: 0.5 }
    }
}

/// Margins of the flight control loops, each broken at its axis command with the others closed.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarginsFile {
    /// Variants whose loops are assessed (default: those with feedback closed or inverted).
    pub variants: Option<Vec<String>>,
    /// Gain margin asked for and height of the Nichols ellipse, dB.
    #[serde(default = "six")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 40.0))]
    pub gain_margin_db: f64,
    /// Phase margin asked for and half width of the Nichols ellipse, degrees.
    #[serde(default = "thirty")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 180.0))]
    pub phase_margin_deg: f64,
    /// Lowest frequency, Hz.
    #[serde(default = "lowest_hz")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub lowest_hz: f64,
    /// Highest frequency, Hz; the grid goes on to twice the highest resonance and to where the loops
    /// have died out.
    #[serde(default = "highest_hz")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub highest_hz: f64,
    /// Frequencies a decade before refinement.
    #[serde(default = "points_per_decade")]
    #[schemars(range(min = 10, max = 1000))]
    pub points_per_decade: u32,
    /// Damping ratio below which a pole is a resonance.
    #[serde(default = "light_damping_ratio")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub light_damping_ratio: f64,
    /// Frequencies of the envelopes over the campaign, if they are asked for.
    pub envelope: Option<EnvelopeFile>,
}

fn six() -> f64 {
    Settings::default().gain_margin_db
}

fn thirty() -> f64 {
    Settings::default().phase_margin_deg
}

fn lowest_hz() -> f64 {
    Settings::default().lowest_hz
}

fn highest_hz() -> f64 {
    Settings::default().highest_hz
}

fn points_per_decade() -> u32 {
    Settings::default().points_per_decade
}

fn light_damping_ratio() -> f64 {
    Settings::default().light_damping_ratio
}

/// A logarithmic grid of frequencies.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnvelopeFile {
    /// First frequency, Hz.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub from_hz: f64,
    /// Last frequency, Hz.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub to_hz: f64,
    /// Number of frequencies.
    #[schemars(range(min = 2, max = 10_000))]
    pub count: u32,
}

/// One way to evaluate a draw.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariantFile {
    /// Name, a–z, 0–9 and _.
    pub name: String,
    /// Thrust; off sets thrust, acceleration and mass flow to zero.
    #[serde(default = "yes")]
    pub thrust: bool,
    /// Jet damping of the case.
    pub case_jet_damping: bool,
    /// Jet damping of the nozzle.
    pub nozzle_jet_damping: NozzleJetFile,
    /// Thrust that follows elastic rotation; only for modes with axial-load stiffening.
    #[serde(default)]
    pub follower_thrust: bool,
    /// Gimbal slope.
    #[serde(default)]
    pub slope: SlopeFile,
    /// Rigid translation and rotation of the vehicle; off holds them at zero.
    #[serde(default)]
    pub rigid_body: bool,
    /// Slosh masses; off locks them to their tanks.
    #[serde(default)]
    pub slosh: bool,
    /// Aerodynamic forces of the vehicle file.
    #[serde(default)]
    pub aerodynamics: bool,
    /// What the autopilot does.
    #[serde(default)]
    pub feedback: FeedbackFile,
    /// Alternative set of actuators; engines without it keep their own.
    pub actuators: Option<String>,
}

fn yes() -> bool {
    true
}

/// What the autopilot does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum FeedbackFile {
    /// Nothing: servo loops closed, autopilot off.
    #[default]
    Open,
    /// It acts.
    Closed,
    /// It acts with the sign of every axis loop changed.
    Inverted,
}

/// Jet damping of the nozzle.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NozzleJetFile {
    /// None.
    Off,
    /// Equation (13), linear in the nozzle length.
    #[serde(rename = "equation-13")]
    Equation13,
    /// Exact for a rigid nozzle with straight flow.
    RigidNozzle,
}

/// Gimbal slope.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum SlopeFile {
    /// Improved Virtual Grid, equations (15) to (22).
    #[default]
    VirtualGrid,
    /// Rotation of the gimbal grid alone.
    SingleGrid,
}

/// An adverse corner: draw keys at their `worst` values, and Monte Carlo around it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CornerFile {
    /// Name, a–z, 0–9 and _.
    pub name: String,
    /// Number of cases around it: keys without `worst` values are drawn.
    #[serde(default)]
    #[schemars(range(max = MOST_CASES))]
    pub cases: u64,
    /// Who chooses between the low and the high `worst` value of each key.
    pub signs: SignsFile,
    /// With signs = "given": keys at their low value, by parameter path, with `*`, or whole key.
    #[serde(default)]
    pub low: Vec<String>,
    /// With signs = "given": keys at their high value.
    #[serde(default)]
    pub high: Vec<String>,
    /// With signs = "evaluated": keys that stand at a `worst` value, by parameter path, with `*`,
    /// or whole key (default: every key that has `worst` values). The others are drawn.
    pub keys: Option<Vec<String>>,
    /// With signs = "evaluated": the mode whose damping is made least.
    pub mode: Option<String>,
    /// With signs = "evaluated": the variant in which it is made least.
    pub variant: Option<String>,
}

/// Who chooses between low and high.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SignsFile {
    /// The lists `low` and `high`.
    Given,
    /// The program: the value of each key that lowers the damping of `mode` in `variant`.
    Evaluated,
}
