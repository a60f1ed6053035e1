//! What a campaign is asked to do: cases, seed, flight times, variants and modes of interest.

use crate::dispersion::Scheme;
pub use crate::dynamics::{Feedback, NozzleJet};
use crate::stats::Drawing;

use crate::margins::Settings;
use serde::{Deserialize, Serialize};

/// Most cases of a population: beyond any campaign, and small enough for every count and column.
pub const MOST_CASES: u64 = 1_000_000_000;

/// Where the gimbal slope comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slope {
    /// Improved Virtual Grid, equations (15) to (22).
    VirtualGrid,
    /// Rotation of the gimbal grid alone (the classical method).
    SingleGrid,
}

/// How the poles of cases are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// Every case by itself: mass matrix, balancing, QR iteration.
    #[default]
    Dense,
    /// From the nominal poles by determinants, with a certificate; dense where there is none.
    Structured,
}

impl Solver {
    /// Both, in the order of declaration.
    pub const ALL: [Self; 2] = [Self::Dense, Self::Structured];

    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dense => "dense",
            Self::Structured => "structured",
        }
    }
}

/// One way to evaluate a draw; all variants of a run share the draws, so that differences are paired.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Variant {
    /// Name, `[a-z0-9_]+`.
    pub name: String,
    /// Thrust on; off sets R, g0 and the mass flow to zero.
    pub thrust: bool,
    /// Case jet damping (14) on.
    pub case_jet_damping: bool,
    /// Nozzle jet damping.
    pub nozzle_jet_damping: NozzleJet,
    /// Follower thrust on elastic rotation (−Φ_gᵀ R u× Ψ_g η).
    pub follower_thrust: bool,
    /// Gimbal slope.
    pub slope: Slope,
    /// Rigid translation and rotation free; off holds them at zero.
    #[serde(default)]
    pub rigid_body: bool,
    /// Slosh masses free; off locks them to their tanks.
    #[serde(default)]
    pub slosh: bool,
    /// Aerodynamic forces on.
    #[serde(default)]
    pub aerodynamics: bool,
    /// What the autopilot does.
    #[serde(default)]
    pub feedback: Feedback,
    /// Set of actuators in the place of the engines' own; engines without it keep theirs.
    #[serde(default)]
    pub actuators: Option<String>,
}

/// Which flight control loops are assessed, and where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoopPlan {
    /// What is asked of the loops and where they are looked at.
    pub settings: Settings,
    /// Variants whose loops are assessed (indices), ascending.
    pub variants: Vec<usize>,
    /// Frequencies of the envelopes, Hz, ascending; empty for none.
    pub envelope_hz: Vec<f64>,
}

impl LoopPlan {
    /// Whether the loops of a variant are assessed.
    pub fn holds(&self, variant: usize) -> bool {
        self.variants.contains(&variant)
    }
}

/// A set of cases evaluated in one run; tables hold populations in this order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Population {
    /// Name, `[a-z0-9_]+`: `nominal`, `dispersed`, a corner's name, or that name and `_dispersed`.
    pub name: String,
    /// Number of cases.
    pub cases: u64,
    /// Draw keys held at a fixed value: index of the key and value.
    pub fixed: Vec<(usize, f64)>,
    /// Whether the keys that are not fixed are drawn; if not they stay nominal.
    pub drawn: bool,
    /// How its cases come about, where they are drawn: independently unless said otherwise.
    #[serde(default, skip_serializing_if = "Scheme::is_monte_carlo")]
    pub scheme: Scheme,
}

impl Population {
    /// The outer draw to which a case of a nested plan belongs.
    pub fn outer(&self, case: u64) -> Option<u64> {
        match self.scheme {
            Scheme::Nested { inner, .. } => case.checked_div(inner),
            _ => None,
        }
    }

    /// The replicate to which a case belongs, where the plan has several.
    pub fn replicate(&self, case: u64) -> Option<u64> {
        let replicates = self.scheme.replicates();
        (self.drawn && replicates > 1).then(|| case % replicates)
    }

    /// What may be concluded from its cases.
    pub fn drawing(&self) -> Drawing {
        if self.drawn { self.scheme.drawing() } else { Drawing::Designed }
    }
}

/// A run definition, validated against its vehicle and dispersion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Definition {
    /// Name of the run; default folder of the results.
    pub name: String,
    /// Seed of every draw.
    pub seed: u64,
    /// Populations, `nominal` first, then `dispersed`, then the corners.
    pub populations: Vec<Population>,
    /// Flight times, s, ascending.
    pub flight_times_s: Vec<f64>,
    /// Variants, in file order.
    pub variants: Vec<Variant>,
    /// Names of the modes of interest.
    pub modes: Vec<String>,
    /// Per engine of the vehicle, whether it is gimballed (else locked).
    pub gimballed: Vec<bool>,
    /// Second-best to best overlap above which a case is followed by homotopy and both poles are stored.
    pub exchange_ratio: f64,
    /// How poles are found; runs that do not say it are of a time when all were solved densely.
    #[serde(default)]
    pub solver: Solver,
    /// Where derivatives are stored, if anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<SensitivityRule>,
    /// Loops to be assessed, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margins: Option<LoopPlan>,
}

/// The evaluations whose poles are stored with their derivatives.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensitivityRule {
    /// Indices of the variants.
    pub variants: Vec<usize>,
    /// Indices of the flight times.
    pub flight_times: Vec<usize>,
    /// Only the first cases of each population; all if not given.
    pub cases: Option<u64>,
}

impl SensitivityRule {
    /// Whether an evaluation is among them.
    pub fn covers(&self, variant: usize, flight_time: usize, case: u64) -> bool {
        self.cases.is_none_or(|cases| case < cases)
            && self.variants.contains(&variant)
            && self.flight_times.contains(&flight_time)
    }
}

impl Definition {
    /// Adds cases to the dispersed population and to every corner's Monte Carlo, whose plans have
    /// been asked whether they can be extended.
    pub fn add_cases(&mut self, more: u64) {
        for population in self.populations.iter_mut().filter(|p| p.drawn) {
            population.cases = population.cases.saturating_add(more).min(MOST_CASES);
        }
    }

    /// Takes away the number of drawn cases, where it does not change a case: what is left is common to
    /// all parts and lengths of a campaign.
    pub fn leave_cases_open(&mut self) {
        for p in self.populations.iter_mut().filter(|p| p.drawn && p.scheme.keeps_first_cases()) {
            p.cases = 0;
        }
    }

    /// Sets the number of cases of the dispersed population and of every corner's Monte Carlo;
    /// designs keep their own number.
    pub fn set_cases(&mut self, cases: u64) {
        let free = |p: &&mut Population| p.drawn && !p.scheme.has_own_cases();
        for population in self.populations.iter_mut().filter(free) {
            population.cases = cases;
        }
    }
}
