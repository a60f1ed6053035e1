//! The summary of a run: one row per population, variant, flight time and named mode, and one of
//! the cases reduced to their worst flight time; the worst cases.
//!
//! Works on series with one number per case; where they are read from is decided in `io`.

use super::definition::Definition;
use crate::stats::{
    Confidence, Drawing, Error, Estimate, Moments, Ordered, Probability, Sides, clopper_pearson,
};
use std::f64::consts::LN_2;

/// Confidence of the intervals of the summary.
pub const CONFIDENCE: f64 = 0.95;

/// Levels of the quantiles of the damping ratio and the words for them in column names, in percent;
/// 0.135 % and 99.865 % lie three standard deviations from the mean of a normal law.
pub const LEVELS: [(f64, &str); 7] = [
    (0.001_35, "p0_135"),
    (0.01, "p1"),
    (0.05, "p5"),
    (0.5, "p50"),
    (0.95, "p95"),
    (0.99, "p99"),
    (0.998_65, "p99_865"),
];

/// Which cases and poles a row of the summary is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Group {
    /// Index of the population.
    pub population: usize,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the named mode.
    pub mode: usize,
    /// Index of the flight time; none if each case is reduced to its worst over the flight times.
    pub flight_time: Option<usize>,
}

/// What was found for each case of a group, by case index; NaN where the evaluation failed.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Damping ratio of the less stable pole, −.
    pub damping_ratio: Vec<f64>,
    /// Frequency of that pole, Hz.
    pub frequency_hz: Vec<f64>,
    /// Largest real part of the poles, rad/s.
    pub pole_re_rad_s: Vec<f64>,
    /// Gain of damping ratio over the first variant, −; empty for that variant.
    pub damping_ratio_gain: Vec<f64>,
}

impl Series {
    /// A series in which nothing has been evaluated yet.
    pub fn unknown(cases: usize) -> Self {
        Self {
            damping_ratio: vec![f64::NAN; cases],
            frequency_hz: vec![f64::NAN; cases],
            pole_re_rad_s: vec![f64::NAN; cases],
            damping_ratio_gain: Vec::new(),
        }
    }

    /// Bytes per case while a group is summed up, the sorted copy included.
    pub const BYTES_PER_CASE: usize = 5 * size_of::<f64>();

    /// Takes in a pole of a case; of several, the less stable one stays.
    pub fn add(&mut self, case: usize, damping_ratio: f64, frequency_hz: f64, pole_re_rad_s: f64) {
        let known = self.damping_ratio[case];
        if known.is_nan() || damping_ratio < known {
            self.damping_ratio[case] = damping_ratio;
            self.frequency_hz[case] = frequency_hz;
        }
        // Of NaN and a number, the number.
        self.pole_re_rad_s[case] = self.pole_re_rad_s[case].max(pole_re_rad_s);
    }

    /// Sets the gain of damping ratio over the first variant, case by case.
    pub fn compare(&mut self, first: &[f64]) {
        self.damping_ratio_gain =
            self.damping_ratio.iter().zip(first).map(|(here, first)| here - first).collect();
    }
}

/// Location and spread of a sample of damping ratios, −.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Sample standard deviation; none for a single case.
    pub standard_deviation: Option<f64>,
    /// Least value.
    pub smallest: f64,
    /// Quantiles at [`LEVELS`], linear between order statistics (type 7 of Hyndman and Fan).
    pub quantiles: [f64; LEVELS.len()],
    /// Greatest value.
    pub largest: f64,
}

/// One row of the summary.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryRow {
    /// What the row is about.
    pub group: Group,
    /// Cases of the population.
    pub cases: u64,
    /// Cases without a result.
    pub failures: u64,
    /// Cases with a pole in the right half plane.
    pub unstable: u64,
    /// Share of unstable cases among those with a result; none if there are none.
    pub share_unstable: Option<f64>,
    /// Its exact binomial interval; none for cases that are not independent draws.
    pub share_unstable_interval: Option<[f64; 2]>,
    /// Damping ratios; none if no case has a result.
    pub damping_ratio: Option<Spread>,
    /// Mean frequency, Hz.
    pub frequency_hz_mean: Option<f64>,
    /// Shortest time to double, s; none if no case is unstable.
    pub time_to_double_min_s: Option<f64>,
    /// Least and mean gain of damping ratio over the first variant on the same draws.
    pub damping_ratio_gain: Option<[f64; 2]>,
}

/// Sums up one group; `drawn` says whether its cases are independent draws.
///
/// # Errors
/// None for a series whose numbers are finite or NaN; else what `stats` says of them.
pub fn summarise(group: Group, drawn: bool, series: &Series) -> Result<SummaryRow, Error> {
    let damping: Vec<f64> = known(&series.damping_ratio);
    let frequency: Vec<f64> = known(&series.frequency_hz);
    let gain: Vec<f64> = known(&series.damping_ratio_gain);
    let (cases, evaluated) = (series.damping_ratio.len() as u64, damping.len() as u64);
    let re_max = series.pole_re_rad_s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let unstable = series.pole_re_rad_s.iter().filter(|re| **re > 0.0).count() as u64;
    let drawing = if drawn { Drawing::Independent } else { Drawing::Designed };
    let interval = match drawing.independent() {
        Ok(independent) if evaluated > 0 => {
            let confidence = Confidence::new(CONFIDENCE)?;
            let share = clopper_pearson(unstable, evaluated, confidence, Sides::Two, independent)?;
            Some([Estimate::lower(&share), Estimate::upper(&share)])
        }
        _ => None,
    };
    Ok(SummaryRow {
        group,
        cases,
        failures: cases - evaluated,
        unstable,
        share_unstable: (evaluated > 0).then(|| unstable as f64 / evaluated as f64),
        share_unstable_interval: interval,
        damping_ratio: spread(damping)?,
        frequency_hz_mean: Moments::of(&frequency)?.mean(),
        time_to_double_min_s: (re_max > 0.0).then(|| LN_2 / re_max),
        damping_ratio_gain: Moments::of(&gain)?
            .mean()
            .map(|mean| [gain.iter().copied().fold(f64::INFINITY, f64::min), mean]),
    })
}

fn known(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|value| !value.is_nan()).collect()
}

fn spread(values: Vec<f64>) -> Result<Option<Spread>, Error> {
    let moments = Moments::of(&values)?;
    let Some(mean) = moments.mean() else { return Ok(None) };
    let ordered = Ordered::new(&values)?;
    let mut quantiles = [0.0; LEVELS.len()];
    for (quantile, (level, _)) in quantiles.iter_mut().zip(LEVELS) {
        *quantile = ordered.quantile(Probability::new(level)?);
    }
    Ok(Some(Spread {
        mean,
        standard_deviation: moments.standard_deviation(),
        smallest: ordered.smallest(),
        quantiles,
        largest: ordered.largest(),
    }))
}

/// Every group of a population in the order of the summary: by variant, flight time (the worst
/// over them last) and named mode.
pub fn groups(definition: &Definition, population: usize) -> Vec<Group> {
    let times = definition.flight_times_s.len();
    let mut groups = Vec::new();
    for variant in 0..definition.variants.len() {
        for flight_time in (0..times).map(Some).chain([None]) {
            for mode in 0..definition.modes.len() {
                groups.push(Group { population, variant, mode, flight_time });
            }
        }
    }
    groups
}

/// One of the worst cases of a variant and named mode, with the draw of one key.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstRow {
    /// Index of the population.
    pub population: usize,
    /// Index of the variant.
    pub variant: usize,
    /// Index of the named mode.
    pub mode: usize,
    /// 1 for the worst case.
    pub rank: usize,
    /// Case index.
    pub case: u64,
    /// Flight time of the smallest damping ratio, s.
    pub flight_time_s: Option<f64>,
    /// Smallest damping ratio over the flight times, −.
    pub damping_ratio: f64,
    /// Shortest time to double over the flight times, s.
    pub time_to_double_s: Option<f64>,
    /// Index of the draw key; none if the run draws nothing.
    pub draw: Option<usize>,
    /// Drawn value.
    pub value: Option<f64>,
    /// Normal score of the value.
    pub score: Option<f64>,
}

/// Indices of the `most` smallest values, the smallest first, equal ones by index; NaN is no value.
pub fn smallest(values: &[f64], most: usize) -> Vec<usize> {
    let mut found: Vec<usize> = Vec::with_capacity(most.saturating_add(1).min(values.len()));
    for (index, value) in values.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
        if found.len() < most || found.last().is_some_and(|last| *value < values[*last]) {
            found.insert(found.partition_point(|other| values[*other] <= *value), index);
            found.truncate(most);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUP: Group = Group { population: 0, variant: 1, mode: 0, flight_time: Some(0) };

    fn series(damping: &[f64]) -> Series {
        let mut series = Series::unknown(damping.len());
        for (case, damping) in damping.iter().enumerate().filter(|(_, d)| !d.is_nan()) {
            series.add(case, *damping, 5.0, -damping * 31.0);
        }
        series
    }

    #[test]
    fn failures_are_counted_and_leave_the_shares_to_the_rest() {
        let series = series(&[0.01, f64::NAN, -0.02, 0.03, -0.01]);
        let row = summarise(GROUP, true, &series).unwrap();
        assert_eq!((row.cases, row.failures, row.unstable), (5, 1, 2));
        assert_eq!(row.share_unstable, Some(0.5));
        // R: binom.test(2, 4)$conf.int
        let [low, high] = row.share_unstable_interval.unwrap();
        assert!((low - 0.067_585_99).abs() < 5e-9 && (high - 0.932_414_01).abs() < 5e-9);
        let spread = row.damping_ratio.unwrap();
        assert!((spread.mean - 0.0025).abs() < 1e-17);
        assert_eq!((spread.smallest, spread.largest), (-0.02, 0.03));
        assert_eq!(spread.quantiles[3], 0.0);
        assert_eq!(row.time_to_double_min_s, Some(LN_2 / 0.62));
        assert_eq!(row.damping_ratio_gain, None);
    }

    #[test]
    fn a_chosen_case_has_no_interval() {
        let row = summarise(GROUP, false, &series(&[0.01])).unwrap();
        assert_eq!((row.share_unstable, row.share_unstable_interval), (Some(0.0), None));
        assert_eq!(row.damping_ratio.unwrap().standard_deviation, None);
    }

    #[test]
    fn a_group_without_a_result_has_counts_and_nothing_else() {
        let row = summarise(GROUP, true, &series(&[f64::NAN; 3])).unwrap();
        assert_eq!((row.cases, row.failures, row.unstable), (3, 3, 0));
        assert_eq!((row.share_unstable, row.share_unstable_interval), (None, None));
        assert_eq!((row.damping_ratio, row.frequency_hz_mean), (None, None));
    }

    #[test]
    fn the_gain_is_paired_case_by_case() {
        let mut with = series(&[0.03, 0.02, f64::NAN]);
        with.compare(&[0.01, f64::NAN, 0.01]);
        let [least, mean] = summarise(GROUP, true, &with).unwrap().damping_ratio_gain.unwrap();
        assert_eq!((least, mean), (0.03 - 0.01, 0.03 - 0.01));
    }

    #[test]
    fn of_several_poles_the_less_stable_one_stays() {
        let mut series = Series::unknown(1);
        series.add(0, 0.02, 5.0, -0.6);
        series.add(0, -0.01, 5.5, 0.3);
        series.add(0, 0.05, 4.0, -1.0);
        assert_eq!(series.damping_ratio, [-0.01]);
        assert_eq!(series.frequency_hz, [5.5]);
        assert_eq!(series.pole_re_rad_s, [0.3]);
    }

    #[test]
    fn the_smallest_values_come_in_order_with_ties_by_index() {
        let values = [3.0, f64::NAN, 1.0, 2.0, 1.0, 5.0, -1.0];
        assert_eq!(smallest(&values, 4), [6, 2, 4, 3]);
        assert_eq!(smallest(&values, 100), [6, 2, 4, 3, 0, 5]);
        assert_eq!(smallest(&values, 0), [0; 0]);
        assert_eq!(smallest(&[f64::NAN], 3), [0; 0]);
    }
}
