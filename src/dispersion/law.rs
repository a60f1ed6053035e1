//! Laws: the probability distributions of dispersed values, evaluated through their inverse.
//!
//! What a value is applied to is not known here, nor where the probability comes from.

use super::beta;
use super::normal;

/// Why the arguments of a law are not allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{argument}: found {found}; allowed: {allowed}")]
pub struct Refusal {
    /// The argument at fault, by its key in a dispersion table.
    pub argument: &'static str,
    /// What was given.
    pub found: String,
    /// What is allowed.
    pub allowed: &'static str,
}

/// A place in a distribution: the probability beneath it, above it, and its normal score.
///
/// Both probabilities are kept, since one minus a small one would lose it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    below: f64,
    above: f64,
    score: f64,
}

impl Position {
    /// The place with probability `u` beneath it; `u` in the open interval (0, 1).
    ///
    /// `1 − u` is exact for every uniform of [`super::stream`].
    pub fn of_uniform(u: f64) -> Self {
        Self::of_tails(u, 1.0 - u)
    }

    /// The place whose normal score Φ⁻¹(F) is `score`.
    pub fn of_score(score: f64) -> Self {
        let tail = normal::above(score.abs());
        let (below, above) = if score < 0.0 { (tail, 1.0 - tail) } else { (1.0 - tail, tail) };
        Self { below, above, score }
    }

    fn of_tails(below: f64, above: f64) -> Self {
        Self { below, above, score: normal::score(below, above) }
    }

    /// Normal score z = Φ⁻¹(F).
    pub fn score(&self) -> f64 {
        self.score
    }
}

/// One end of a truncation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// In standard deviations from the mean; may be infinite.
    Sigma(f64),
    /// In the units of the value.
    Value(f64),
}

/// Scores beyond which a truncated normal law is refused: the probability beyond them is no
/// longer a normal double-precision number.
const LARGEST_TRUNCATION: f64 = 37.0;

/// A validated distribution.
#[derive(Debug, Clone, PartialEq)]
pub struct Law(Shape);

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Fixed {
        value: f64,
    },
    Normal {
        mean: f64,
        sigma: f64,
    },
    TruncatedNormal {
        mean: f64,
        sigma: f64,
        law: normal::Truncated,
        range: [f64; 2],
    },
    Uniform {
        low: f64,
        high: f64,
    },
    Triangular {
        low: f64,
        mode: f64,
        high: f64,
    },
    Lognormal {
        median: f64,
        sigma_ln: f64,
    },
    Beta {
        shape: beta::Beta,
        low: f64,
        high: f64,
    },
    /// Ascending values and the probability up to and including each; the last is one.
    Discrete {
        values: Vec<f64>,
        cumulative: Vec<f64>,
    },
    /// Ascending probabilities from zero to one and the non-decreasing values there.
    Empirical {
        probabilities: Vec<f64>,
        values: Vec<f64>,
    },
}

fn require(
    argument: &'static str,
    holds: bool,
    found: impl ToString,
    allowed: &'static str,
) -> Result<(), Refusal> {
    if holds { Ok(()) } else { Err(Refusal { argument, found: found.to_string(), allowed }) }
}

fn finite(argument: &'static str, value: f64) -> Result<(), Refusal> {
    require(argument, value.is_finite(), value, "a finite number")
}

fn positive(argument: &'static str, value: f64) -> Result<(), Refusal> {
    require(argument, value.is_finite() && value > 0.0, value, "a finite number above zero")
}

fn interval(low: f64, high: f64) -> Result<(), Refusal> {
    finite("low", low)?;
    finite("high", high)?;
    let allowed = "a number above `low`, at a finite distance";
    require("high", low < high && (high - low).is_finite(), high, allowed)
}

impl Law {
    /// Always `value`.
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn fixed(value: f64) -> Result<Self, Refusal> {
        finite("value", value)?;
        Ok(Self(Shape::Fixed { value }))
    }

    /// Normal with `mean` and standard deviation `sigma`.
    ///
    /// # Errors
    /// A mean that is not finite, a sigma that is not above zero.
    pub fn normal(mean: f64, sigma: f64) -> Result<Self, Refusal> {
        finite("mean", mean)?;
        positive("sigma", sigma)?;
        Ok(Self(Shape::Normal { mean, sigma }))
    }

    /// Normal with `mean` and standard deviation `sigma` **before** truncation to [low, high];
    /// the probability outside is spread over the inside in proportion (no mass at the bounds).
    ///
    /// # Errors
    /// Arguments that are not finite (a bound may be infinite), a sigma that is not above zero,
    /// an empty interval, or one whose nearest end is more than 37 sigma from the mean.
    pub fn truncated_normal(
        mean: f64,
        sigma: f64,
        low: Bound,
        high: Bound,
    ) -> Result<Self, Refusal> {
        finite("mean", mean)?;
        positive("sigma", sigma)?;
        let score = |bound| match bound {
            Bound::Sigma(score) => score,
            Bound::Value(value) => (value - mean) / sigma,
        };
        let value = |bound| match bound {
            Bound::Sigma(score) => mean + score * sigma,
            Bound::Value(value) => value,
        };
        let scores = [score(low), score(high)];
        let range = [value(low), value(high)];
        require("low", !scores[0].is_nan(), range[0], "a number")?;
        require(
            "high",
            scores[0] < scores[1] && range[0] < range[1],
            range[1],
            "a bound above the lower one",
        )?;
        let within = "a bound within 37 sigma of the mean, so that the law has probability";
        require("low", scores[0] <= LARGEST_TRUNCATION, range[0], within)?;
        require("high", scores[1] >= -LARGEST_TRUNCATION, range[1], within)?;
        Ok(Self(Shape::TruncatedNormal { mean, sigma, law: normal::Truncated::new(scores), range }))
    }

    /// Uniform on [low, high].
    ///
    /// # Errors
    /// Bounds that are not finite or not ascending.
    pub fn uniform(low: f64, high: f64) -> Result<Self, Refusal> {
        interval(low, high)?;
        Ok(Self(Shape::Uniform { low, high }))
    }

    /// Triangular on [low, high] with its peak at `mode`.
    ///
    /// # Errors
    /// Bounds that are not finite or not ascending, a mode outside them.
    pub fn triangular(low: f64, mode: f64, high: f64) -> Result<Self, Refusal> {
        interval(low, high)?;
        require("mode", low <= mode && mode <= high, mode, "a number from `low` to `high`")?;
        Ok(Self(Shape::Triangular { low, mode, high }))
    }

    /// Lognormal: ln x is normal with mean ln `median` and standard deviation `sigma_ln`.
    ///
    /// # Errors
    /// A median or a sigma_ln that is not finite and above zero.
    pub fn lognormal(median: f64, sigma_ln: f64) -> Result<Self, Refusal> {
        positive("median", median)?;
        positive("sigma_ln", sigma_ln)?;
        Ok(Self(Shape::Lognormal { median, sigma_ln }))
    }

    /// Beta with shapes `alpha` and `beta`, stretched to [low, high].
    ///
    /// # Errors
    /// Shapes outside 0.1 to 1000 (beyond them the incomplete beta function loses digits),
    /// bounds that are not finite or not ascending.
    pub fn beta(alpha: f64, beta: f64, low: f64, high: f64) -> Result<Self, Refusal> {
        let allowed = "a number from 0.1 to 1000";
        require("alpha", beta::SHAPES.contains(&alpha), alpha, allowed)?;
        require("beta", beta::SHAPES.contains(&beta), beta, allowed)?;
        interval(low, high)?;
        Ok(Self(Shape::Beta { shape: beta::Beta::new(alpha, beta), low, high }))
    }

    /// One of `values` with probability in proportion to `weights`, whatever their order.
    ///
    /// # Errors
    /// No value, values that are not finite or that repeat, weights of another number or not
    /// above zero.
    pub fn discrete(values: &[f64], weights: &[f64]) -> Result<Self, Refusal> {
        require("values", !values.is_empty(), "an empty list", "at least one value")?;
        let same = "as many weights as values";
        require(
            "weights",
            weights.len() == values.len(),
            format!("{} weights", weights.len()),
            same,
        )?;
        values.iter().try_for_each(|&v| finite("values", v))?;
        weights.iter().try_for_each(|&w| positive("weights", w))?;
        let mut pairs: Vec<(f64, f64)> =
            values.iter().copied().zip(weights.iter().copied()).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let repeated = pairs.windows(2).find(|p| p[0].0 == p[1].0).map(|p| p[0].0);
        if let Some(value) = repeated {
            require("values", false, format!("{value} twice"), "values that do not repeat")?;
        }
        let total: f64 = pairs.iter().map(|p| p.1).sum();
        require("weights", total.is_finite(), total, "weights with a finite sum")?;
        let mut sum = 0.0;
        let mut cumulative: Vec<f64> = pairs
            .iter()
            .map(|p| {
                sum += p.1;
                sum / total
            })
            .collect();
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        Ok(Self(Shape::Discrete { values: pairs.iter().map(|p| p.0).collect(), cumulative }))
    }

    /// A table of quantiles: `values[i]` at probability `probabilities[i]`, linear between them.
    /// Equal neighbouring values carry the probability between them.
    ///
    /// # Errors
    /// Fewer than two entries, probabilities that do not ascend from 0 to 1, values that are not
    /// finite, that descend or are all equal.
    pub fn empirical(probabilities: &[f64], values: &[f64]) -> Result<Self, Refusal> {
        require("values", values.len() >= 2, format!("{} values", values.len()), "two or more")?;
        require(
            "probabilities",
            probabilities.len() == values.len(),
            format!("{} probabilities", probabilities.len()),
            "as many probabilities as values",
        )?;
        let ends = probabilities[0] == 0.0 && probabilities[probabilities.len() - 1] == 1.0;
        require(
            "probabilities",
            ends && probabilities.windows(2).all(|p| p[0] < p[1]),
            format!("{probabilities:?}"),
            "numbers that ascend from 0 to 1",
        )?;
        values.iter().try_for_each(|&v| finite("values", v))?;
        let spread = values[values.len() - 1] - values[0];
        require(
            "values",
            values.windows(2).all(|v| v[0] <= v[1]) && spread > 0.0 && spread.is_finite(),
            format!("{values:?}"),
            "numbers that do not descend, the last above the first",
        )?;
        Ok(Self(Shape::Empirical { probabilities: probabilities.into(), values: values.into() }))
    }

    /// The empirical law of measured `values` in any order: the i-th of n in ascending order at
    /// probability (i − 1)/(n − 1), linear between them.
    ///
    /// # Errors
    /// Fewer than two values, values that are not finite or all equal.
    pub fn sample(values: &[f64]) -> Result<Self, Refusal> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let last = values.len().saturating_sub(1).max(1) as f64;
        let probabilities: Vec<f64> = (0..values.len()).map(|i| i as f64 / last).collect();
        Self::empirical(&probabilities, &sorted)
    }

    /// The standard normal law, which a common score follows.
    pub fn standard_normal() -> Self {
        Self(Shape::Normal { mean: 0.0, sigma: 1.0 })
    }

    /// The value with probability `u` beneath it, the inverse of the distribution function;
    /// `u` in the open interval (0, 1).
    pub fn quantile(&self, u: f64) -> f64 {
        self.value(&Position::of_uniform(u))
    }

    /// The value at a place of the distribution.
    pub fn value(&self, at: &Position) -> f64 {
        let Position { below, above, score } = *at;
        match &self.0 {
            Shape::Fixed { value } => *value,
            Shape::Normal { mean, sigma } => mean + sigma * score,
            Shape::TruncatedNormal { mean, sigma, law, range } => {
                within(mean + sigma * law.score(below, above), range[0], range[1])
            }
            Shape::Uniform { low, high } => within(above * low + below * high, *low, *high),
            Shape::Triangular { low, mode, high } => {
                let width = high - low;
                let x = if below * width <= mode - low {
                    low + (below * width * (mode - low)).sqrt()
                } else {
                    high - (above * width * (high - mode)).sqrt()
                };
                within(x, *low, *high)
            }
            Shape::Lognormal { median, sigma_ln } => median * (sigma_ln * score).exp(),
            Shape::Beta { shape, low, high } => {
                let (t, rest) = shape.quantile(below, above);
                within(rest * low + t * high, *low, *high)
            }
            Shape::Discrete { values, cumulative } => {
                // The last value takes what rounding leaves between the sum and one.
                values[cumulative.partition_point(|&c| c < below).min(values.len() - 1)]
            }
            Shape::Empirical { probabilities, values } => {
                let upper =
                    probabilities.partition_point(|&p| p < below).clamp(1, values.len() - 1);
                let (p, v) = (&probabilities[upper - 1..=upper], &values[upper - 1..=upper]);
                // Shares of the two ends, the one of the nearer tail first.
                let (from, to) = if below <= above {
                    let to = (below - p[0]) / (p[1] - p[0]);
                    (1.0 - to, to)
                } else {
                    let from = (above - (1.0 - p[1])) / (p[1] - p[0]);
                    (from, 1.0 - from)
                };
                within(from * v[0] + to * v[1], v[0], v[1])
            }
        }
    }

    /// How fast the value follows the normal score, dx/dz = φ(z)/f(x) for the density f, at a value
    /// and its score; zero for a fixed law, `None` for a discrete one, which jumps.
    pub fn slope(&self, value: f64, score: f64) -> Option<f64> {
        let phi = || normal::density(score);
        let slope = match &self.0 {
            Shape::Fixed { .. } => 0.0,
            Shape::Normal { sigma, .. } => *sigma,
            Shape::TruncatedNormal { mean, sigma, law, .. } => {
                sigma * law.slope((value - mean) / sigma, score)
            }
            Shape::Uniform { low, high } => (high - low) * phi(),
            Shape::Triangular { low, mode, high } => {
                let width = high - low;
                if value <= *mode && mode > low {
                    phi() * width * (mode - low) / (2.0 * (value - low))
                } else {
                    phi() * width * (high - mode) / (2.0 * (high - value))
                }
            }
            Shape::Lognormal { sigma_ln, .. } => value * sigma_ln,
            Shape::Beta { shape, low, high } => {
                let width = high - low;
                phi() * width / shape.density((value - low) / width, (high - value) / width)
            }
            Shape::Discrete { .. } => return None,
            Shape::Empirical { probabilities, values } => {
                let below = Position::of_score(score).below;
                let upper =
                    probabilities.partition_point(|&p| p < below).clamp(1, values.len() - 1);
                let (p, v) = (&probabilities[upper - 1..=upper], &values[upper - 1..=upper]);
                phi() * (v[1] - v[0]) / (p[1] - p[0])
            }
        };
        Some(slope).filter(|slope| slope.is_finite())
    }

    /// F(x), the probability of a value up to and including `x`.
    pub fn cdf(&self, x: f64) -> f64 {
        self.tails(x).0
    }

    /// The probability up to and including `x` and the probability above `x`, neither as one
    /// minus the other where that would lose digits.
    fn tails(&self, x: f64) -> (f64, f64) {
        if let Some([low, high]) = self.range() {
            if x < low {
                return (0.0, 1.0);
            } else if x >= high {
                return (1.0, 0.0);
            }
        }
        match &self.0 {
            // Values outside the range are dealt with above.
            Shape::Fixed { .. } => (1.0, 0.0),
            Shape::Normal { mean, sigma } => {
                let z = (x - mean) / sigma;
                (normal::below(z), normal::above(z))
            }
            Shape::TruncatedNormal { mean, sigma, law, .. } => law.tails((x - mean) / sigma),
            Shape::Uniform { low, high } => ((x - low) / (high - low), (high - x) / (high - low)),
            Shape::Triangular { low, mode, high } => {
                let width = high - low;
                if x <= *mode {
                    let below = (x - low) * ((x - low) / (width * (mode - low)));
                    // At a mode equal to `low` the quotient is 0/0.
                    if x == *low { (0.0, 1.0) } else { (below, 1.0 - below) }
                } else {
                    let above = (high - x) * ((high - x) / (width * (high - mode)));
                    (1.0 - above, above)
                }
            }
            Shape::Lognormal { median, sigma_ln } => {
                let z = if x > 0.0 { (x / median).ln() / sigma_ln } else { f64::NEG_INFINITY };
                (normal::below(z), normal::above(z))
            }
            Shape::Beta { shape, low, high } => {
                shape.tails((x - low) / (high - low), (high - x) / (high - low))
            }
            Shape::Discrete { values, cumulative } => {
                let count = values.partition_point(|&v| v <= x);
                let below = if count == 0 { 0.0 } else { cumulative[count - 1] };
                (below, 1.0 - below)
            }
            Shape::Empirical { probabilities, values } => {
                // The last entry at or below x, so that equal values count up to the last.
                let i = values.partition_point(|&v| v <= x) - 1;
                let (p, v) = (&probabilities[i..=i + 1], &values[i..=i + 1]);
                let (from, to) = ((v[1] - x) / (v[1] - v[0]), (x - v[0]) / (v[1] - v[0]));
                (from * p[0] + to * p[1], from * (1.0 - p[0]) + to * (1.0 - p[1]))
            }
        }
    }

    /// Normal score z = Φ⁻¹(F(x)); `None` where the law cannot give `x` or z is infinite.
    ///
    /// Where one value carries a probability (fixed and discrete laws, repeated values of an
    /// empirical one) F is the mid-distribution: what lies beneath and half of what lies at `x`.
    pub fn score(&self, x: f64) -> Option<f64> {
        if self.is_outside(x) {
            return None;
        }
        let (below, above) = match &self.0 {
            Shape::Normal { mean, sigma } => return Some((x - mean) / sigma),
            Shape::Fixed { .. } => (0.5, 0.5),
            Shape::Discrete { values, cumulative } => {
                let i = values.partition_point(|&v| v < x);
                let before = if i == 0 { 0.0 } else { cumulative[i - 1] };
                middle(before, cumulative[i])
            }
            Shape::Empirical { probabilities, values } => {
                let first = values.partition_point(|&v| v < x);
                let last = values.partition_point(|&v| v <= x);
                if last > first {
                    middle(probabilities[first], probabilities[last - 1])
                } else {
                    self.tails(x)
                }
            }
            _ => self.tails(x),
        };
        Some(normal::score(below, above)).filter(|z| z.is_finite())
    }

    /// Lowest and highest value of a bounded law; `None` if either end is infinite.
    pub fn range(&self) -> Option<[f64; 2]> {
        match &self.0 {
            Shape::Normal { .. } | Shape::Lognormal { .. } => None,
            Shape::Fixed { value } => Some([*value; 2]),
            Shape::TruncatedNormal { range, .. } => {
                Some(*range).filter(|r| r.iter().all(|x| x.is_finite()))
            }
            Shape::Uniform { low, high }
            | Shape::Triangular { low, high, .. }
            | Shape::Beta { low, high, .. } => Some([*low, *high]),
            Shape::Discrete { values, .. } | Shape::Empirical { values, .. } => {
                Some([values[0], values[values.len() - 1]])
            }
        }
    }

    /// Lowest and highest value the law can give or approach, infinite where it has no end.
    pub fn support(&self) -> [f64; 2] {
        match &self.0 {
            Shape::Normal { .. } => [f64::NEG_INFINITY, f64::INFINITY],
            Shape::Lognormal { .. } => [0.0, f64::INFINITY],
            Shape::TruncatedNormal { range, .. } => *range,
            _ => self.range().unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
        }
    }

    /// Where `x` lies in the range of a bounded law, 0 at its low and 1 at its high end; below 0
    /// or above 1 outside. `None` for an unbounded or fixed law.
    pub fn fraction_of_range(&self, x: f64) -> Option<f64> {
        let [low, high] = self.range()?;
        (low < high).then(|| (x - low) / (high - low))
    }

    /// Whether the law cannot give `x`: outside its support by more than the rounding of a bound
    /// that was computed from sigma, or none of its discrete values.
    pub fn is_outside(&self, x: f64) -> bool {
        let [low, high] = self.support();
        let size = [low, high].map(|end| if end.is_finite() { end.abs() } else { 0.0 });
        let rounding = 4.0 * f64::EPSILON * size[0].max(size[1]);
        let inside = low - rounding <= x && x <= high + rounding;
        match &self.0 {
            Shape::Discrete { values, .. } => !values.contains(&x),
            _ => !inside,
        }
    }

    /// Whether no single value carries a probability, so that F(x) is the uniform drawn.
    pub fn is_continuous(&self) -> bool {
        match &self.0 {
            Shape::Fixed { .. } | Shape::Discrete { .. } => false,
            Shape::Empirical { values, .. } => values.windows(2).all(|v| v[0] < v[1]),
            _ => true,
        }
    }
}

/// `x` but for rounding of its last digits beyond the ends; no probability is moved.
fn within(x: f64, low: f64, high: f64) -> f64 {
    x.clamp(low, high)
}

/// Probability beneath and above the middle of a step of F from `before` to `after`.
fn middle(before: f64, after: f64) -> (f64, f64) {
    (0.5 * (before + after), 0.5 * ((1.0 - before) + (1.0 - after)))
}

#[cfg(test)]
mod tests;
