//! The ranking of draws by what they do to a metric, and the data of a tornado chart.
//!
//! Works on columns by case index; where they are read from is decided in `io`.

use super::sample::{CONFIDENCE, Sample};
use super::statistics::words;
use crate::dispersion::Scheme;
use crate::stats::sensitivity::{Crossed, crossed, given_data, partial_ranks, regression, tornado};
use crate::stats::{Confidence, Drawing, Error, Estimate};

/// One draw and its values by case.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Draw key.
    pub key: String,
    /// Drawn values.
    pub values: Vec<f64>,
}

/// What one draw does to the metric.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Effect {
    /// Draw key.
    pub key: String,
    /// Standardised regression coefficient.
    pub regression: Option<Estimate>,
    /// Partial rank correlation.
    pub partial_rank: Option<Estimate>,
    /// First-order index: from given data, or of a Saltelli plan.
    pub first_order: Option<Estimate>,
    /// Total index, of a Saltelli plan.
    pub total: Option<Estimate>,
    /// Metric at the low and at the high side of the draw: means over its lowest and highest tenth, or
    /// the two cases of a one-at-a-time plan.
    pub tornado: Option<[f64; 2]>,
}

/// The ranking.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ranking {
    /// Draws, the most important first.
    pub effects: Vec<Effect>,
    /// Share of the variance that the linear model explains.
    pub explained: Option<f64>,
    /// Cases left out because they failed.
    pub left_out: usize,
    /// What is missing, and why.
    pub notes: Vec<String>,
}

/// The ranking of `inputs` by what they do to `results` (NaN where a case failed).
///
/// Independent draws: regression, partial ranks, given-data indices. Saltelli's plan: first-order and
/// total indices. One at a time: the two cases of each draw.
///
/// # Errors
/// Cases that came about in another way; too few of them; results that are all equal.
pub fn rank(
    sample: Sample,
    scheme: &Scheme,
    inputs: &[Input],
    results: &[f64],
    resamples: usize,
    seed: u64,
) -> Result<Ranking, Error> {
    let mut ranking = match (sample.drawing(), scheme) {
        (Drawing::Crossed, _) => of_crossed(inputs, results, resamples, seed)?,
        (_, Scheme::OneAtATime { draws, .. }) => {
            let effect = |(place, draw): (usize, &usize)| Effect {
                key: inputs[*draw].key.clone(),
                tornado: Some([results[2 * place], results[2 * place + 1]])
                    .filter(|pair| pair.iter().all(|value| value.is_finite())),
                ..Effect::default()
            };
            Ranking {
                effects: draws.iter().enumerate().map(effect).collect(),
                left_out: results.iter().filter(|value| value.is_nan()).count(),
                ..Ranking::default()
            }
        }
        _ => of_independent(sample, inputs, results, resamples, seed)?,
    };
    ranking.effects.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    Ok(ranking)
}

/// By what effects are ranked: total index, else regression, else first order, else swing.
fn weight(effect: &Effect) -> f64 {
    let point = |estimate: Option<Estimate>| estimate.map(|e| e.point().abs());
    point(effect.total)
        .or(point(effect.regression))
        .or(point(effect.first_order))
        .or(effect.tornado.map(|[low, high]| (high - low).abs()))
        .unwrap_or(-1.0)
}

fn of_independent(
    sample: Sample,
    inputs: &[Input],
    results: &[f64],
    resamples: usize,
    seed: u64,
) -> Result<Ranking, Error> {
    let independent = sample.drawing().independent()?;
    let confidence = Confidence::new(CONFIDENCE)?;
    let rows: Vec<usize> = (0..results.len())
        .filter(|i| !results[*i].is_nan() && inputs.iter().all(|x| !x.values[*i].is_nan()))
        .collect();
    let y: Vec<f64> = rows.iter().map(|i| results[*i]).collect();
    let mut notes = Vec::new();
    let mut varying = Vec::new();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for input in inputs {
        let values: Vec<f64> = rows.iter().map(|i| input.values[*i]).collect();
        if values.iter().all(|value| Some(value) == values.first()) {
            notes.push(format!("{} has one value in all cases", input.key));
            continue;
        }
        varying.push(input);
        columns.push(values);
    }
    let mut note = |what: &str, error: &Error| notes.push(format!("{what}: {error}"));
    let linear = regression(&columns, &y, confidence, independent)
        .inspect_err(|error| note("no regression", error))
        .ok();
    let ranked = partial_ranks(&columns, &y, confidence, independent)
        .inspect_err(|error| note("no partial rank correlation", error))
        .ok();
    let words = words(seed, "given data");
    let given = given_data(&columns, &y, (resamples, confidence), words, independent)
        .inspect_err(|error| note("no given-data indices", error))
        .ok();
    let effect = |(i, input): (usize, &&Input)| Effect {
        key: input.key.clone(),
        regression: linear.as_ref().map(|(indices, _)| indices[i]),
        partial_rank: ranked.as_ref().map(|indices| indices[i]),
        first_order: given.as_ref().map(|indices| indices[i]),
        total: None,
        tornado: tornado(&columns[i], &y).ok(),
    };
    Ok(Ranking {
        effects: varying.iter().enumerate().map(effect).collect(),
        explained: linear.as_ref().map(|(_, explained)| *explained),
        left_out: results.len() - rows.len(),
        notes,
    })
}

fn of_crossed(
    inputs: &[Input],
    results: &[f64],
    resamples: usize,
    seed: u64,
) -> Result<Ranking, Error> {
    let width = inputs.len() + 2;
    // A row with a failed case gives nothing.
    let rows: Vec<&[f64]> =
        results.chunks_exact(width).filter(|row| row.iter().all(|value| !value.is_nan())).collect();
    let column = |place: usize| rows.iter().map(|row| row[place]).collect::<Vec<f64>>();
    let samples =
        Crossed { first: column(0), second: column(1), crossed: (2..width).map(column).collect() };
    let confidence = Confidence::new(CONFIDENCE)?;
    // The rows are independent draws of the two samples.
    let independent = Drawing::Independent.independent()?;
    let words = words(seed, "crossed");
    let found = crossed(&samples, (resamples, confidence), words, independent)?;
    let effect = |(input, [first, total]): (&Input, &[Estimate; 2])| Effect {
        key: input.key.clone(),
        first_order: Some(*first),
        total: Some(*total),
        ..Effect::default()
    };
    Ok(Ranking {
        effects: inputs.iter().zip(&found).map(effect).collect(),
        left_out: results.len() - rows.len() * width,
        ..Ranking::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inputs(cases: usize) -> Vec<Input> {
        let mut words = words(4, "inputs");
        let mut uniform = || (words() >> 11) as f64 / (1_u64 << 53) as f64;
        let mut input =
            |key: &str| Input { key: key.into(), values: (0..cases).map(|_| uniform()).collect() };
        vec![input("weak"), input("none"), input("strong")]
    }

    #[test]
    fn the_strongest_draw_comes_first_and_constant_ones_are_named() {
        let mut inputs = inputs(300);
        let mut results: Vec<f64> =
            (0..300).map(|i| inputs[0].values[i] - 4.0 * inputs[2].values[i]).collect();
        results[5] = f64::NAN;
        inputs.push(Input { key: "fixed".into(), values: vec![2.0; 300] });
        let scheme = Scheme::MonteCarlo;
        let found = rank(Sample::INDEPENDENT, &scheme, &inputs, &results, 400, 1).unwrap();
        let keys: Vec<&str> = found.effects.iter().map(|e| e.key.as_str()).collect();
        assert_eq!(keys, ["strong", "weak", "none"]);
        assert_eq!((found.left_out, found.notes.len()), (1, 1));
        assert!(found.notes[0].contains("fixed") && found.explained.unwrap() > 0.999);
        let [low, high] = found.effects[0].tornado.unwrap();
        assert!(low > high + 3.0, "{low} {high}");
        assert!(found.effects[0].first_order.unwrap().point() > 0.85);
    }

    #[test]
    fn a_one_at_a_time_plan_is_a_tornado_of_its_own_cases() {
        use crate::dispersion::Levels;
        let scheme = Scheme::OneAtATime { draws: vec![0, 2], at: Levels::Scores([-1.0, 1.0]) };
        let sample = Sample::turns(Drawing::Designed, 1);
        let results = [0.1, 0.2, 0.5, -0.5];
        let found = rank(sample, &scheme, &inputs(4), &results, 400, 1).unwrap();
        assert_eq!(found.effects[0].key, "strong");
        assert_eq!(found.effects[0].tornado, Some([0.5, -0.5]));
        assert_eq!(found.effects[1].tornado, Some([0.1, 0.2]));
    }

    #[test]
    fn other_plans_have_no_indices() {
        let sample = Sample::turns(Drawing::LatinHypercube, 2);
        let scheme = Scheme::LatinHypercube { replicates: 2 };
        let found = rank(sample, &scheme, &inputs(200), &[0.0; 200], 400, 1);
        assert!(matches!(found, Err(Error::NotIndependent { .. })), "{found:?}");
    }
}
