//! The ranking of draws by what they do to a metric, and the data of a tornado chart.
//!
//! Works on columns by case index; where they are read from is decided in `io`.

use super::sample::{CONFIDENCE, Intervals, Sample};
use super::statistics::words;
use crate::dispersion::Scheme;
use crate::stats::sensitivity::{
    Bins, Crossed, crossed, given_data, given_data_points, partial_rank_points, partial_ranks,
    regression, regression_points, tornado,
};
use crate::stats::{Confidence, Drawing, Error, Estimate, Independent, Moments, of_replicates};

/// One draw and its values by case.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Draw key.
    pub key: String,
    /// Drawn values.
    pub values: Vec<f64>,
}

/// An index with its 95 % interval, where one follows from the cases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Index {
    /// The estimate from all cases.
    pub value: f64,
    /// Its interval.
    pub interval: Option<[f64; 2]>,
}

impl From<Estimate> for Index {
    fn from(found: Estimate) -> Self {
        Self { value: found.point(), interval: Some([found.lower(), found.upper()]) }
    }
}

/// What one draw does to the metric.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Effect {
    /// Draw key.
    pub key: String,
    /// Standardised regression coefficient.
    pub regression: Option<Index>,
    /// Partial rank correlation.
    pub partial_rank: Option<Index>,
    /// First-order index: from given data, or of a Saltelli plan.
    pub first_order: Option<Index>,
    /// Total index, of a Saltelli plan.
    pub total: Option<Index>,
    /// Metric at the low and at the high side of the draw: means over its lowest and highest tenth, or
    /// the two cases of a one-at-a-time plan.
    pub tornado: Option<[f64; 2]>,
}

/// The ranking.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ranking {
    /// Draws, the most important first.
    pub effects: Vec<Effect>,
    /// Where the intervals of indices come from; none for a one-at-a-time plan, which has no index.
    pub intervals: Option<Intervals>,
    /// Standard deviation of the metric: times a regression coefficient its change per σ of a draw.
    pub standard_deviation: Option<f64>,
    /// Share of the variance that the linear model explains.
    pub explained: Option<f64>,
    /// Cases left out because they failed.
    pub left_out: usize,
    /// What is missing, and why.
    pub notes: Vec<String>,
}

/// The ranking of `inputs` by what they do to `results` (NaN where a case failed).
///
/// Independent draws: regression, partial ranks, given-data indices. Latin hypercube and Sobol: the same,
/// with intervals over the indices of replicates where there are two, else none. Saltelli's plan:
/// first-order and total indices. One at a time: the two cases of each draw.
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
        _ => of_sample(sample, inputs, results, resamples, seed)?,
    };
    ranking.effects.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    Ok(ranking)
}

/// By what effects are ranked: total index, else regression, else first order, else swing.
fn weight(effect: &Effect) -> f64 {
    let point = |index: Option<Index>| index.map(|index| index.value.abs());
    point(effect.total)
        .or(point(effect.regression))
        .or(point(effect.first_order))
        .or(effect.tornado.map(|[low, high]| (high - low).abs()))
        .unwrap_or(-1.0)
}

/// Indices of the inputs by one estimator.
type Found = Result<Vec<Index>, Error>;

/// The three estimators, by name.
const ESTIMATORS: [&str; 3] = ["regression", "partial rank correlation", "given-data indices"];

/// Regression, partial ranks and given-data indices of the columns of a design.
fn points(columns: &[Vec<f64>], y: &[f64]) -> [Result<Vec<f64>, Error>; 3] {
    let linear = regression_points(columns, y).map(|(coefficients, _)| coefficients);
    let given = given_data_points(columns, y, Bins::Coarse);
    [linear, partial_rank_points(columns, y), given]
}

fn of_sample(
    sample: Sample,
    inputs: &[Input],
    results: &[f64],
    resamples: usize,
    seed: u64,
) -> Result<Ranking, Error> {
    let drawing = sample.drawing();
    let exact = match (drawing.independent(), drawing) {
        (Ok(independent), _) => Some(independent),
        (Err(_), Drawing::LatinHypercube | Drawing::LowDiscrepancy) => None,
        (Err(refused), _) => return Err(refused),
    };
    let rows: Vec<usize> = (0..results.len())
        .filter(|i| !results[*i].is_nan() && inputs.iter().all(|x| !x.values[*i].is_nan()))
        .collect();
    let mut notes = Vec::new();
    let mut varying: Vec<&Input> = Vec::new();
    for input in inputs {
        let mut values = rows.iter().map(|i| input.values[*i]);
        let first = values.next();
        if values.all(|value| Some(value) == first) {
            notes.push(format!("{} has one value in all cases", input.key));
        } else {
            varying.push(input);
        }
    }
    let chosen = |rows: &[usize]| {
        let columns = varying.iter().map(|x| rows.iter().map(|i| x.values[*i]).collect());
        (columns.collect::<Vec<Vec<f64>>>(), rows.iter().map(|i| results[*i]).collect::<Vec<_>>())
    };
    let (columns, y) = chosen(&rows);
    let words = words(seed, "given data");
    let (found, intervals) = match exact {
        Some(independent) => {
            let found = with_exact(&columns, &y, (resamples, words), independent)?;
            (found, Intervals::Independent)
        }
        None => {
            let mut numbers = vec![f64::NAN; results.len()];
            rows.iter().for_each(|row| numbers[*row] = *row as f64);
            let replicates = sample.split(&numbers).into_iter().map(|replicate| {
                let rows: Vec<usize> = replicate.into_iter().map(|row| row as usize).collect();
                let (columns, y) = chosen(&rows);
                points(&columns, &y)
            });
            let replicates: Vec<_> = replicates.collect();
            let independent = drawing.independent_replicates(replicates.len() as u64);
            let witness = independent.as_ref().ok().copied();
            let found = with_replicates(points(&columns, &y), &replicates, witness, &mut notes)?;
            match independent {
                Ok(_) => (found, Intervals::Replicates),
                Err(_) => {
                    notes.extend(sample.without_intervals(results.len()));
                    (found, Intervals::None)
                }
            }
        }
    };
    for (found, what) in found.iter().zip(ESTIMATORS) {
        if let Err(error) = found {
            notes.push(format!("no {what}: {error}"));
        }
    }
    let of = |which: usize, i: usize| found[which].as_ref().ok().map(|indices| indices[i]);
    let effect = |(i, input): (usize, &&Input)| Effect {
        key: input.key.clone(),
        regression: of(0, i),
        partial_rank: of(1, i),
        first_order: of(2, i),
        total: None,
        tornado: tornado(&columns[i], &y).ok(),
    };
    Ok(Ranking {
        effects: varying.iter().enumerate().map(effect).collect(),
        intervals: Some(intervals),
        standard_deviation: Moments::of(&y)?.standard_deviation(),
        explained: regression_points(&columns, &y).ok().map(|(_, explained)| explained),
        left_out: results.len() - rows.len(),
        notes,
    })
}

/// The estimators of independent cases, with their own intervals.
fn with_exact(
    columns: &[Vec<f64>],
    y: &[f64],
    (resamples, words): (usize, impl FnMut() -> u64),
    independent: Independent,
) -> Result<[Found; 3], Error> {
    let confidence = Confidence::new(CONFIDENCE)?;
    let linear = regression(columns, y, confidence, independent).map(|(indices, _)| indices);
    let ranked = partial_ranks(columns, y, confidence, independent);
    let given = given_data(columns, y, (resamples, confidence), words, independent);
    Ok([linear, ranked, given]
        .map(|found| found.map(|all| all.into_iter().map(Into::into).collect())))
}

/// The estimators of all cases, each with Student's interval over those of the replicates.
fn with_replicates(
    of_all: [Result<Vec<f64>, Error>; 3],
    replicates: &[[Result<Vec<f64>, Error>; 3]],
    independent: Option<Independent>,
    notes: &mut Vec<String>,
) -> Result<[Found; 3], Error> {
    let confidence = Confidence::new(CONFIDENCE)?;
    let mut which = 0..ESTIMATORS.len();
    Ok(of_all.map(|values| {
        let at = which.next().expect("as many as estimators");
        let values = values?;
        let each: Result<Vec<&Vec<f64>>, &Error> =
            replicates.iter().map(|replicate| replicate[at].as_ref()).collect();
        if let (Err(error), Some(_)) = (&each, independent) {
            notes.push(format!("no interval of {}: a replicate: {error}", ESTIMATORS[at]));
        }
        let interval = |input: usize| {
            let values: Vec<f64> = each.as_ref().ok()?.iter().map(|of| of[input]).collect();
            let found = of_replicates(&values, confidence, independent?).ok()?;
            Some([found.lower(), found.upper()])
        };
        let index = |(input, value)| Index { value, interval: interval(input) };
        Ok(values.into_iter().enumerate().map(index).collect())
    }))
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
        first_order: Some((*first).into()),
        total: Some((*total).into()),
        ..Effect::default()
    };
    Ok(Ranking {
        effects: inputs.iter().zip(&found).map(effect).collect(),
        intervals: Some(Intervals::Independent),
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
        assert!(found.effects[0].first_order.unwrap().value > 0.85);
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
    fn designs_have_indices_with_intervals_over_their_replicates_or_without() {
        let inputs = inputs(300);
        let results: Vec<f64> =
            (0..300).map(|i| inputs[0].values[i] - 4.0 * inputs[2].values[i]).collect();
        let scheme = Scheme::LatinHypercube { replicates: 3 };
        let found = |drawing, replicates| {
            let sample = Sample::turns(drawing, replicates);
            rank(sample, &scheme, &inputs, &results, 400, 1)
        };
        let three = found(Drawing::LatinHypercube, 3).unwrap();
        let exact = found(Drawing::Independent, 1).unwrap();
        assert_eq!(three.intervals, Some(Intervals::Replicates));
        assert_eq!(three.effects[0].key, "strong");
        for (replicated, exact) in three.effects.iter().zip(&exact.effects) {
            let (a, b) = (replicated.first_order.unwrap(), exact.first_order.unwrap());
            assert!(a.interval.is_some() && (a.value - b.value).abs() < 0.1, "{a:?} {b:?}");
            for of in [|e: &Effect| e.regression, |e: &Effect| e.partial_rank] {
                let (replicated, exact) = (of(replicated).unwrap(), of(exact).unwrap());
                assert_eq!(replicated.value, exact.value);
                assert!(replicated.interval.is_some() && replicated.interval != exact.interval);
            }
        }
        // Student's interval over the indices of the replicates alone.
        let alone = |turn: usize| {
            let part = |x: &Input| {
                let values = x.values.iter().copied().skip(turn).step_by(3).collect();
                Input { key: x.key.clone(), values }
            };
            let inputs: Vec<Input> = inputs.iter().map(part).collect();
            let results: Vec<f64> = results.iter().copied().skip(turn).step_by(3).collect();
            let found = rank(Sample::INDEPENDENT, &scheme, &inputs, &results, 400, 1).unwrap();
            found.effects[0].partial_rank.unwrap().value
        };
        let [low, high] = three.effects[0].partial_rank.unwrap().interval.unwrap();
        let mean = (0..3).map(alone).sum::<f64>() / 3.0;
        assert!(((low + high) / 2.0 - mean).abs() < 1e-12);

        let one = found(Drawing::LowDiscrepancy, 1).unwrap();
        assert_eq!(one.intervals, Some(Intervals::None));
        assert_eq!(one.effects[0].regression.unwrap().interval, None);
        assert!(one.notes.iter().any(|note| note.contains("no intervals")), "{:?}", one.notes);
        // Replicates of 50 cases are too few for bins; the other intervals stay.
        let six = found(Drawing::LatinHypercube, 6).unwrap();
        assert_eq!(six.effects[0].first_order.unwrap().interval, None);
        assert!(six.effects[0].regression.unwrap().interval.is_some());
        assert!(six.notes.iter().any(|note| note.contains("given-data")), "{:?}", six.notes);
    }

    #[test]
    fn other_plans_have_no_indices() {
        for drawing in [Drawing::Nested, Drawing::Designed, Drawing::Selected] {
            let sample = Sample::turns(drawing, 2);
            let found = rank(sample, &Scheme::MonteCarlo, &inputs(200), &[0.0; 200], 400, 1);
            assert!(matches!(found, Err(Error::NotIndependent { .. })), "{found:?}");
        }
    }
}
