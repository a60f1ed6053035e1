//! Statistics of one metric of a population, with their intervals: moments and quantiles, the running
//! estimate, paired differences.
//!
//! Works on values by case index, NaN where a case failed; where they are read from is decided in
//! `io`. The intervals of the `summary` table are in `summary`.

use super::sample::{CONFIDENCE, Sample, ends, known};
use super::summary::LEVELS;
use crate::dispersion::keyed::Key;
use crate::stats::{
    BEYOND_EACH, Bootstrap, BootstrapInterval, Confidence, Drawing, Error, Estimate, Independent,
    Moments, Ordered, PairedDifference, Probability, Sides, checkpoints, clopper_pearson,
    of_replicates, of_sections,
};

/// BLAKE3 context of the words that choose resamples.
const BOOTSTRAP: &str = "tvse bootstrap v1";

/// One statistic.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name, `mean`, `p5`, ….
    pub statistic: String,
    /// Cases that it is of.
    pub cases: usize,
    /// Value; none if no case has one.
    pub value: Option<f64>,
    /// Its interval at the confidence of the summary; none where none follows.
    pub interval: Option<[f64; 2]>,
    /// How the interval was made; `none`.
    pub method: &'static str,
}

impl Line {
    fn of(statistic: impl Into<String>, cases: usize, value: Option<f64>) -> Self {
        Self { statistic: statistic.into(), cases, value, interval: None, method: "none" }
    }

    fn with(self, estimate: Result<Estimate, Error>) -> Self {
        match estimate {
            Ok(estimate) => {
                Self { interval: Some(ends(estimate)), method: estimate.method().name(), ..self }
            }
            Err(_) => self,
        }
    }
}

/// Words that choose resamples: a function of seed and name alone.
pub fn words(seed: u64, name: &str) -> impl FnMut() -> u64 + use<> {
    let key = Key::new(BOOTSTRAP, seed, 0, name);
    let mut counter = 0;
    move || {
        counter += 1;
        key.hash(counter)
    }
}

type Statistic = Box<dyn Fn(&mut [f64]) -> f64>;

fn moment(get: fn(&Moments) -> Option<f64>) -> Statistic {
    Box::new(move |values| Moments::of(values).ok().and_then(|m| get(&m)).unwrap_or(f64::NAN))
}

/// Sample quantile of type 7 by selection.
fn quantile(level: f64) -> Statistic {
    Box::new(move |values| {
        let position = (values.len() - 1) as f64 * level;
        let (index, weight) = (position.floor() as usize, position.fract());
        let (_, below, rest) = values.select_nth_unstable_by(index, f64::total_cmp);
        let below = *below;
        if weight == 0.0 {
            return below;
        }
        let above = rest.iter().copied().fold(f64::INFINITY, f64::min);
        below + weight * (above - below)
    })
}

/// Expected number of values beyond a quantile from which its bootstrap is used.
const BEYOND: f64 = 20.0;

/// Moments and quantiles of the cases that have a value. Independent cases: bias-corrected and
/// accelerated bootstrap (quantiles where 20 values are expected beyond them), and for quantiles the
/// exact order statistics too; replicates: Student's t over their results, of other statistics than the mean about that
/// of all cases, quantiles where each has [`BEYOND_EACH`] values beyond them; else no interval.
///
/// # Errors
/// A number of resamples below 200; values that are infinite.
pub fn estimates(
    sample: Sample,
    values: &[f64],
    resamples: usize,
    (seed, name): (u64, &str),
) -> Result<Vec<Line>, Error> {
    let all = known(values);
    Moments::of(&all)?;
    let confidence = Confidence::new(CONFIDENCE)?;
    let bootstrap = Bootstrap::new(resamples, confidence, BootstrapInterval::Bca)?;
    let mut statistics: Vec<(String, Option<f64>, Statistic)> = vec![
        ("mean".into(), None, moment(|m| m.mean())),
        ("sd".into(), None, moment(|m| m.standard_deviation())),
        ("skewness".into(), None, moment(|m| m.skewness())),
        ("kurtosis".into(), None, moment(|m| m.kurtosis())),
    ];
    statistics.extend(LEVELS.map(|(level, word)| (word.to_owned(), Some(level), quantile(level))));
    let cases = all.len();
    let mut lines = Vec::new();
    for (statistic, level, of) in statistics {
        let value = (cases > 0).then(|| of(&mut all.clone())).filter(|value| value.is_finite());
        let line = || Line::of(statistic.clone(), cases, value);
        let Ok(independent) = sample.drawing().independent() else {
            // Quantiles of inner campaigns say nothing of all cases, nor do their spreads.
            let whole = sample.drawing() != Drawing::Nested || statistic == "mean";
            let estimate = || {
                let replicates = sample.replicates(values.len()) as u64;
                let independent = sample.drawing().independent_replicates(replicates)?;
                let mut parts = sample.split(values);
                if !whole || parts.iter().any(Vec::is_empty) {
                    return Err(Error::TooFew { found: 0, needed: 1 });
                }
                let fewest = parts.iter().map(Vec::len).min().unwrap_or(0) as f64;
                if level.is_some_and(|level| !(fewest * level.min(1.0 - level) >= BEYOND_EACH)) {
                    return Err(Error::Undefined(
                        "too few values beyond the quantile in a replicate",
                    ));
                }
                let results: Vec<f64> = parts.iter_mut().map(|part| of(part)).collect();
                match value {
                    Some(whole) if statistic != "mean" => {
                        of_sections(whole, &results, confidence, independent)
                    }
                    _ => of_replicates(&results, confidence, independent),
                }
            };
            lines.push(line().with(estimate()));
            continue;
        };
        let beyond = level.map_or(f64::INFINITY, |level| cases as f64 * level.min(1.0 - level));
        if beyond >= BEYOND {
            let words = words(seed, &format!("{name} {statistic}"));
            lines.push(line().with(bootstrap.estimate(&all, &of, words, independent)));
        }
        if let Some(level) = level
            && let Ok(ordered) = Ordered::new(&all)
        {
            let level = Probability::new(level)?;
            let exact = ordered.quantile_interval(level, confidence, Sides::Two, independent);
            lines.push(line().with(Ok(exact)));
        }
    }
    Ok(lines)
}

/// The running estimate: mean of the first n cases, and share of them that lie below `limit` or
/// failed, for growing n.
///
/// # Errors
/// How the cases came about, where their first ones are no sample.
pub fn running(sample: Sample, values: &[f64], limit: f64) -> Result<Vec<Line>, Drawing> {
    let step = sample.step()?;
    let mut lines = Vec::new();
    let mut last = 0;
    for point in checkpoints(values.len()) {
        let count = point / step * step;
        if count == last {
            continue;
        }
        last = count;
        let values = &values[..count];
        // Written so that NaN, a failed case, is bad.
        let bad: Vec<f64> = values.iter().map(|v| f64::from(u8::from(!(*v >= limit)))).collect();
        for (name, values, share) in [("mean", values, false), ("share", &bad[..], true)] {
            let mean = |values: &[f64]| Moments::of(values).ok()?.mean();
            let method = std::cell::Cell::new("replicates");
            let exact = |independent: Independent| {
                let confidence = Confidence::new(CONFIDENCE).ok()?;
                let estimate = if share {
                    let events = bad.iter().filter(|bad| **bad > 0.0).count() as u64;
                    let cases = count as u64;
                    clopper_pearson(events, cases, confidence, Sides::Two, independent).ok()?
                } else {
                    let moments = Moments::of(&known(values)).ok()?;
                    moments.mean_interval(confidence, Sides::Two, independent).ok()?
                };
                method.set(estimate.method().name());
                Some(ends(estimate))
            };
            let interval = sample.interval(values, exact, mean);
            let line = Line::of(name, count, mean(&known(values)));
            let method = if interval.is_some() { method.get() } else { "none" };
            lines.push(Line { interval, method, ..line });
        }
    }
    Ok(lines)
}

/// Paired differences `first − second` of the cases that have a value on both sides.
///
/// # Errors
/// Samples of different length; values that are infinite; no pair.
pub fn paired(sample: Sample, first: &[f64], second: &[f64]) -> Result<Vec<Line>, Error> {
    if first.len() != second.len() {
        return Err(Error::NotPaired { left: first.len(), right: second.len() });
    }
    let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
    let pairs = known(&differences);
    let moments = Moments::of(&pairs)?;
    let ordered = Ordered::new(&pairs)?;
    let confidence = Confidence::new(CONFIDENCE)?;
    let median = ordered.quantile(Probability::new(0.5)?);
    let line = |name: &str, value| Line::of(name, pairs.len(), value);
    let mut lines = vec![line("mean", moments.mean()), line("median", Some(median))];
    if let Ok(independent) = sample.drawing().independent() {
        let zero = vec![0.0; pairs.len()];
        if let Ok(found) = PairedDifference::of(&pairs, &zero, confidence, independent) {
            lines = vec![
                lines[0].clone().with(Ok(found.mean)),
                lines[1].clone().with(Ok(found.median)),
            ];
        }
    } else {
        let replicates = sample.replicates(differences.len()) as u64;
        let parts = sample.split(&differences);
        let means: Option<Vec<f64>> =
            parts.iter().map(|part| Moments::of(part).ok()?.mean()).collect();
        if let (Ok(independent), Some(means)) =
            (sample.drawing().independent_replicates(replicates), means)
        {
            lines[0] = lines[0].clone().with(of_replicates(&means, confidence, independent));
        }
    }
    lines.push(line("least", Some(ordered.smallest())));
    lines.push(line("greatest", Some(ordered.largest())));
    let better = pairs.iter().filter(|d| **d > 0.0).count() as f64 / pairs.len() as f64;
    lines.push(line("share above zero", Some(better)));
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(count: usize) -> Vec<f64> {
        let mut words = words(1, "values");
        (0..count).map(|_| (words() >> 11) as f64 / (1_u64 << 53) as f64).collect()
    }

    fn find<'a>(lines: &'a [Line], statistic: &str, method: &str) -> Option<&'a Line> {
        lines.iter().find(|l| l.statistic == statistic && l.method == method)
    }

    #[test]
    fn quantiles_beyond_the_reach_of_the_bootstrap_keep_their_order_statistics() {
        let lines = estimates(Sample::INDEPENDENT, &values(500), 400, (3, "m")).unwrap();
        assert!(find(&lines, "p50", "bootstrap_bca").is_some());
        assert!(find(&lines, "p1", "bootstrap_bca").is_none());
        for (level, word) in LEVELS {
            let line = find(&lines, word, "order_statistics").unwrap();
            // Uniform values: the quantile is its level; five deviations √(p(1−p)/n) and half a step.
            let deviation = (level * (1.0 - level) / 500.0).sqrt();
            assert!((line.value.unwrap() - level).abs() < 5.0 * deviation + 0.002, "{word}");
        }
        let mean = find(&lines, "mean", "bootstrap_bca").unwrap().interval.unwrap();
        // Width 2·1.96·√(1/12/500), within a tenth of chance.
        let width = 2.0 * 1.96 * (1.0_f64 / 12.0 / 500.0).sqrt();
        assert!(((mean[1] - mean[0]) / width - 1.0).abs() < 0.15);
        assert_eq!(lines, estimates(Sample::INDEPENDENT, &values(500), 400, (3, "m")).unwrap());
    }

    #[test]
    fn quantiles_over_replicates_are_about_that_of_all_cases_or_have_no_interval() {
        let sample = Sample::turns(Drawing::LatinHypercube, 4);
        let lines = estimates(sample, &values(400), 400, (3, "m")).unwrap();
        for (level, word) in LEVELS {
            let line = find(&lines, word, "replicates");
            // A hundred values in each: five beyond the levels 5 % and 95 %.
            assert_eq!(line.is_some(), (0.05..=0.95).contains(&level), "{word}");
            if let Some(Line { value: Some(value), interval: Some([low, high]), .. }) = line {
                assert!((0.5 * (low + high) - value).abs() < 1e-12 && low < value, "{word}");
            }
        }
        let mean = find(&lines, "mean", "replicates").unwrap().interval.unwrap();
        assert!(mean[0] < 0.5 && 0.5 < mean[1]);
    }

    #[test]
    fn selection_gives_the_quantile_of_the_ordered_sample() {
        let values = values(37);
        let ordered = Ordered::new(&values).unwrap();
        for level in [0.001, 0.25, 0.5, 0.77, 0.999] {
            let found = quantile(level)(&mut values.clone());
            assert_eq!(found, ordered.quantile(Probability::new(level).unwrap()));
        }
    }

    #[test]
    fn the_running_estimate_ends_with_all_cases_and_counts_failed_ones_as_bad() {
        let mut values = values(130);
        values[0] = f64::NAN;
        let lines = running(Sample::INDEPENDENT, &values, 0.25).unwrap();
        let counts: Vec<usize> = lines.iter().map(|l| l.cases).step_by(2).collect();
        assert_eq!(counts, [10, 20, 50, 100, 130]);
        let bad = values.iter().filter(|v| !(**v >= 0.25)).count() as f64 / 130.0;
        assert_eq!(lines[9].value, Some(bad));
        assert_eq!(lines[9].method, "clopper_pearson");
        assert_eq!(lines[8].method, "student_t");
        let hypercube = Sample::turns(Drawing::LatinHypercube, 4);
        assert_eq!(running(hypercube, &values, 0.25), Err(Drawing::LatinHypercube));
        let sobol = running(Sample::turns(Drawing::LowDiscrepancy, 8), &values, 0.25).unwrap();
        assert!(sobol.iter().all(|line| line.cases % 8 == 0));
        // Replicates that are all alike, as shares of two cases may be, give no interval.
        let said = |line: &Line| line.interval.is_some() == (line.method == "replicates");
        assert!(sobol.iter().all(said) && sobol.iter().rev().take(2).all(|l| l.interval.is_some()));
    }

    #[test]
    fn differences_are_paired_case_by_case_and_failed_pairs_left_out() {
        let (mut first, second) = (values(60), values(60));
        first.iter_mut().for_each(|v| *v += 0.5);
        first[7] = f64::NAN;
        let lines = paired(Sample::INDEPENDENT, &first, &second).unwrap();
        assert_eq!((lines[0].cases, lines[0].method), (59, "student_t"));
        // One rounding of the sum and one of the difference, below 2.
        assert!((lines[0].value.unwrap() - 0.5).abs() < 4.0 * f64::EPSILON);
        assert_eq!(lines[4].value, Some(1.0));
        let chosen = paired(Sample::turns(Drawing::Designed, 1), &first, &second).unwrap();
        assert!(chosen.iter().all(|line| line.interval.is_none()));
        assert!(paired(Sample::INDEPENDENT, &first[1..], &second).is_err());
    }
}
