//! The dispersion table as it stands in a TOML file, one raw type a table of the file.
//!
//! Only shapes and types of values are known here; what rows mean for a vehicle is decided in
//! `resolve`, and how text is read in `scenario`.

use super::correlation::Kind;
use super::law::{Bound, Law, Refusal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A dispersion table: what is uncertain about a vehicle, by how much, and who says so.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Dispersion table")]
pub struct Table {
    /// Common scores: standard normal numbers, one per case, that rows may share.
    #[serde(default)]
    pub common: Vec<Common>,
    /// Dispersed parameters.
    #[serde(default)]
    pub row: Vec<Row>,
    /// Correlations between the values of draw keys.
    #[serde(default)]
    pub correlation: Vec<Correlation>,
}

/// A matrix of correlations between draw keys (a Gaussian copula; margins stay as they are).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Correlation {
    /// What the numbers are: `rank` (Spearman) or `normal_score`.
    pub kind: Kind,
    /// Whole draw keys, for instance `booster.left.nozzle.mass @ engine`; each in one matrix only.
    #[schemars(length(min = 2))]
    pub keys: Vec<String>,
    /// Symmetric, ones on the diagonal, positive definite; a row for each key.
    #[schemars(length(min = 2))]
    pub matrix: Vec<Vec<f64>>,
    /// Source of the numbers.
    pub source: String,
}

/// When the value of a draw is known (the classes of uncertainty of NASA/TP-2010-216447).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// Known for each vehicle before its flight day.
    Vehicle,
    /// Known on the flight day.
    FlightDay,
    /// Never known.
    #[default]
    Unknown,
}

/// A standard normal number drawn once per case, in which several rows may take part.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Common {
    /// Name by which rows refer to it: letters, digits, `_` and `-`.
    pub id: String,
    /// Why these rows are correlated, and who says so.
    pub source: String,
    /// When its value is known; `unknown` unless given. Rows that share it have the same class.
    #[serde(default)]
    pub class: Class,
}

/// One dispersed parameter, or with `*` segments many.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Parameter path, for instance `booster.left.nozzle.mass`; `*` stands for any group, engine,
    /// actuator, modal label, sensor, path or filter.
    pub path: String,
    /// Law of the drawn value.
    pub law: LawText,
    /// How the drawn value acts on the nominal one.
    pub apply: Apply,
    /// Level at which one value is drawn: `vehicle`, `engine` (or the name of the engine group),
    /// `actuator`, `mode`, `sensor`, `path` or `filter`.
    pub level: String,
    /// Tells rows apart that would otherwise draw under the same key: letters, digits, `_`, `-`.
    pub id: Option<String>,
    /// Source of the numbers.
    pub source: String,
    /// Unit of the law's numbers; if given it must be that of the parameter (`1` for a scale).
    pub unit: Option<String>,
    /// Only modes whose nominal frequency at the vehicle's band time lies in [low, high), Hz.
    pub band_hz: Option<[f64; 2]>,
    /// The common score in which this row takes part.
    pub common: Option<String>,
    /// Weight w of the common score: z = w·z_common + √(1 − w²)·z_individual.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub common_weight: Option<f64>,
    /// Adverse low and high value for worst-on-worst cases, in the units of the law; may lie
    /// outside the law.
    pub worst: Option<[f64; 2]>,
    /// When the value is known; `unknown` unless given. A nested plan tells them apart.
    #[serde(default)]
    pub class: Class,
}

/// How a drawn value x acts on a nominal value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Apply {
    /// x replaces it.
    Absolute,
    /// It is multiplied by x.
    Scale,
    /// x is added.
    Offset,
}

/// A law as text; which arguments are allowed is decided by [`Law`].
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum LawText {
    /// Always one value.
    Fixed {
        /// The value.
        value: f64,
    },
    /// Normal; give either `sigma` or `three_sigma`.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sigma: Option<f64>,
        /// Three standard deviations.
        three_sigma: Option<f64>,
    },
    /// Normal, truncated exactly: nothing is clamped to the bounds. One or two bounds.
    TruncatedNormal {
        /// Mean before truncation.
        mean: f64,
        /// Standard deviation before truncation.
        sigma: Option<f64>,
        /// Three standard deviations before truncation.
        three_sigma: Option<f64>,
        /// Lower bound.
        low: Option<f64>,
        /// Upper bound.
        high: Option<f64>,
        /// Lower bound in standard deviations from the mean, negative below it.
        low_sigma: Option<f64>,
        /// Upper bound in standard deviations from the mean.
        high_sigma: Option<f64>,
    },
    /// Uniform.
    Uniform {
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Triangular.
    Triangular {
        /// Lower bound.
        low: f64,
        /// Most likely value.
        mode: f64,
        /// Upper bound.
        high: f64,
    },
    /// Lognormal: the logarithm is normal with mean ln `median`.
    Lognormal {
        /// Median.
        median: f64,
        /// Standard deviation of the natural logarithm.
        sigma_ln: f64,
    },
    /// Beta, stretched to [low, high].
    Beta {
        /// Shape at the low end.
        alpha: f64,
        /// Shape at the high end.
        beta: f64,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// One of a list of values.
    Discrete {
        /// The values.
        values: Vec<f64>,
        /// Their weights, in proportion to the probabilities; equal if left out.
        weights: Option<Vec<f64>>,
    },
    /// A table of quantiles or a measured sample, linear in between.
    Empirical {
        /// Values at `probabilities`, ascending; or a sample in any order.
        values: Vec<f64>,
        /// Probabilities from 0 to 1, ascending; if left out, `values` is a sample.
        probabilities: Option<Vec<f64>>,
    },
}

impl LawText {
    /// The validated law.
    ///
    /// # Errors
    /// An argument that the law does not allow, or two that contradict each other.
    pub fn law(&self) -> Result<Law, Refusal> {
        match self {
            Self::Fixed { value } => Law::fixed(*value),
            Self::Normal { mean, sigma, three_sigma } => {
                Law::normal(*mean, deviation(*sigma, *three_sigma)?)
            }
            Self::TruncatedNormal {
                mean,
                sigma,
                three_sigma,
                low,
                high,
                low_sigma,
                high_sigma,
            } => {
                if [low, high, low_sigma, high_sigma].iter().all(|bound| bound.is_none()) {
                    return Err(Refusal {
                        argument: "low",
                        found: "no bound at all".into(),
                        allowed: "one of low, low_sigma, high, high_sigma; or kind = \"normal\"",
                    });
                }
                let low = bound("low", *low, *low_sigma)?;
                let high = bound("high", *high, *high_sigma)?;
                Law::truncated_normal(
                    *mean,
                    deviation(*sigma, *three_sigma)?,
                    low.unwrap_or(Bound::Sigma(f64::NEG_INFINITY)),
                    high.unwrap_or(Bound::Sigma(f64::INFINITY)),
                )
            }
            Self::Uniform { low, high } => Law::uniform(*low, *high),
            Self::Triangular { low, mode, high } => Law::triangular(*low, *mode, *high),
            Self::Lognormal { median, sigma_ln } => Law::lognormal(*median, *sigma_ln),
            Self::Beta { alpha, beta, low, high } => Law::beta(*alpha, *beta, *low, *high),
            Self::Discrete { values, weights: Some(weights) } => Law::discrete(values, weights),
            Self::Discrete { values, weights: None } => {
                Law::discrete(values, &vec![1.0; values.len()])
            }
            Self::Empirical { values, probabilities: Some(p) } => Law::empirical(p, values),
            Self::Empirical { values, probabilities: None } => Law::sample(values),
        }
    }
}

fn deviation(sigma: Option<f64>, three_sigma: Option<f64>) -> Result<f64, Refusal> {
    let allowed = "exactly one of sigma and three_sigma, above zero";
    let refuse = |argument, found: String| Err(Refusal { argument, found, allowed });
    match (sigma, three_sigma) {
        (Some(sigma), None) => Ok(sigma),
        (None, Some(three)) if three > 0.0 => Ok(three / 3.0),
        (None, Some(three)) => refuse("three_sigma", three.to_string()),
        (None, None) => refuse("sigma", "neither".into()),
        (Some(_), Some(_)) => refuse("sigma", "both".into()),
    }
}

fn bound(
    argument: &'static str,
    value: Option<f64>,
    sigma: Option<f64>,
) -> Result<Option<Bound>, Refusal> {
    match (value, sigma) {
        (Some(_), Some(_)) => Err(Refusal {
            argument,
            found: "the bound twice, as a value and in sigma".into(),
            allowed: "one of the two",
        }),
        (value, sigma) => Ok(value.map(Bound::Value).or(sigma.map(Bound::Sigma))),
    }
}
