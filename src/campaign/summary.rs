//! The summary of a run: one row per population, variant, flight time and named mode, and one of
//! the cases reduced to their worst flight time; the worst cases.
//!
//! Works on cases that pass by one after the other, so that its memory does not grow with their
//! number; where they are read from is decided in `io`.

use super::definition::Definition;
use crate::stats::{
    Confidence, Drawing, Error, Estimate, Probability, RunningMoments, Selection, Sides,
    clopper_pearson, quantile_of,
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

/// What was found for a case of a group; NaN where there is nothing, as after a failure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Damping ratio of the less stable pole, −.
    pub damping_ratio: f64,
    /// Frequency of that pole, Hz.
    pub frequency_hz: f64,
    /// Largest real part of the poles, rad/s.
    pub pole_re_rad_s: f64,
    /// Gain of damping ratio over the first variant, −; NaN for that variant.
    pub damping_ratio_gain: f64,
}

impl Found {
    /// Nothing yet.
    pub const NOTHING: Self = Self {
        damping_ratio: f64::NAN,
        frequency_hz: f64::NAN,
        pole_re_rad_s: f64::NAN,
        damping_ratio_gain: f64::NAN,
    };

    /// Takes in a pole of the case; of several, the less stable one stays.
    pub fn add(&mut self, damping_ratio: f64, frequency_hz: f64, pole_re_rad_s: f64) {
        if self.damping_ratio.is_nan() || damping_ratio < self.damping_ratio {
            self.damping_ratio = damping_ratio;
            self.frequency_hz = frequency_hz;
        }
        // Of NaN and a number, the number.
        self.pole_re_rad_s = self.pole_re_rad_s.max(pole_re_rad_s);
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

/// Sums up one group from its cases, which pass by in the order of their index, several times if
/// there are too many to hold: all statistics are exact.
#[derive(Debug, Clone)]
pub struct Tally {
    group: Group,
    drawn: bool,
    first_pass: bool,
    cases: u64,
    unstable: u64,
    pole_re_max: f64,
    damping: RunningMoments,
    frequency: RunningMoments,
    gain: RunningMoments,
    gain_min: f64,
    order: Selection,
}

impl Tally {
    /// A tally of no cases that holds about `most` values; `drawn` says whether the cases of the
    /// group are independent draws.
    pub fn new(group: Group, drawn: bool, most: usize) -> Self {
        Self {
            group,
            drawn,
            first_pass: true,
            cases: 0,
            unstable: 0,
            pole_re_max: f64::NEG_INFINITY,
            damping: RunningMoments::default(),
            frequency: RunningMoments::default(),
            gain: RunningMoments::default(),
            gain_min: f64::INFINITY,
            order: Selection::new(most),
        }
    }

    /// Takes the next case.
    ///
    /// # Errors
    /// None for numbers that are finite or NaN; else what `stats` says of them.
    pub fn add(&mut self, found: &Found) -> Result<(), Error> {
        if self.first_pass {
            self.cases += 1;
            self.unstable += u64::from(found.pole_re_rad_s > 0.0);
            self.pole_re_max = self.pole_re_max.max(found.pole_re_rad_s);
            let known = |value: f64, moments: &mut RunningMoments| {
                if value.is_nan() { Ok(()) } else { moments.push(value) }
            };
            known(found.damping_ratio, &mut self.damping)?;
            known(found.frequency_hz, &mut self.frequency)?;
            known(found.damping_ratio_gain, &mut self.gain)?;
            self.gain_min = self.gain_min.min(found.damping_ratio_gain);
        }
        if !found.damping_ratio.is_nan() {
            self.order.push(found.damping_ratio);
        }
        Ok(())
    }

    /// Ends a pass over all cases; whether it was the last.
    ///
    /// # Errors
    /// None: the levels are levels.
    pub fn end_pass(&mut self) -> Result<bool, Error> {
        self.first_pass = false;
        let count = self.order.count();
        let mut ranks = vec![0, count.saturating_sub(1)];
        if count > 0 {
            for (level, _) in LEVELS {
                quantile_of(count, Probability::new(level)?, |rank| {
                    ranks.push(rank);
                    0.0
                });
            }
        }
        Ok(self.order.end_pass(&ranks))
    }

    /// The row of the summary, once the last pass has ended.
    ///
    /// # Errors
    /// What `stats` says.
    pub fn row(&self) -> Result<SummaryRow, Error> {
        let evaluated = self.order.count();
        let drawing = if self.drawn { Drawing::Independent } else { Drawing::Designed };
        let interval = match drawing.independent() {
            Ok(independent) if evaluated > 0 => {
                let confidence = Confidence::new(CONFIDENCE)?;
                let unstable = self.unstable;
                let share =
                    clopper_pearson(unstable, evaluated, confidence, Sides::Two, independent)?;
                Some([Estimate::lower(&share), Estimate::upper(&share)])
            }
            _ => None,
        };
        Ok(SummaryRow {
            group: self.group,
            cases: self.cases,
            failures: self.cases - evaluated,
            unstable: self.unstable,
            share_unstable: (evaluated > 0).then(|| self.unstable as f64 / evaluated as f64),
            share_unstable_interval: interval,
            damping_ratio: self.spread()?,
            frequency_hz_mean: self.frequency.moments().mean(),
            time_to_double_min_s: (self.pole_re_max > 0.0).then(|| LN_2 / self.pole_re_max),
            damping_ratio_gain: self.gain.moments().mean().map(|mean| [self.gain_min, mean]),
        })
    }

    fn spread(&self) -> Result<Option<Spread>, Error> {
        let (moments, count) = (self.damping.moments(), self.order.count());
        let Some(mean) = moments.mean() else { return Ok(None) };
        let mut quantiles = [0.0; LEVELS.len()];
        for (quantile, (level, _)) in quantiles.iter_mut().zip(LEVELS) {
            let level = Probability::new(level)?;
            *quantile = quantile_of(count, level, |rank| self.order.value(rank));
        }
        Ok(Some(Spread {
            mean,
            standard_deviation: moments.standard_deviation(),
            smallest: self.order.value(0),
            quantiles,
            largest: self.order.value(count - 1),
        }))
    }
}

/// Sums up one group whose cases are at hand; `drawn` says whether they are independent draws.
///
/// # Errors
/// None for numbers that are finite or NaN; else what `stats` says of them.
pub fn summarise(group: Group, drawn: bool, cases: &[Found]) -> Result<SummaryRow, Error> {
    let mut tally = Tally::new(group, drawn, usize::MAX);
    cases.iter().try_for_each(|found| tally.add(found))?;
    tally.end_pass()?;
    tally.row()
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

/// The smallest of many values, each with what belongs to it; of equal ones the earlier.
#[derive(Debug, Clone)]
pub struct Smallest<T> {
    most: usize,
    found: Vec<(f64, T)>,
}

impl<T> Smallest<T> {
    /// None yet, and at most `most`.
    pub fn new(most: usize) -> Self {
        Self { most, found: Vec::new() }
    }

    /// Takes a value; NaN is none.
    pub fn push(&mut self, value: f64, item: impl FnOnce() -> T) {
        let full = self.found.len() >= self.most;
        let better = !full || self.found.last().is_some_and(|(last, _)| value < *last);
        if better && !value.is_nan() && self.most > 0 {
            let at = self.found.partition_point(|(other, _)| *other <= value);
            self.found.insert(at, (value, item()));
            self.found.truncate(self.most);
        }
    }

    /// The values and what belongs to them, the smallest first.
    pub fn into_found(self) -> Vec<(f64, T)> {
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUP: Group = Group { population: 0, variant: 1, mode: 0, flight_time: Some(0) };

    fn series(damping: &[f64]) -> Vec<Found> {
        let found = |damping: &f64| {
            let mut found = Found::NOTHING;
            if !damping.is_nan() {
                found.add(*damping, 5.0, -damping * 31.0);
            }
            found
        };
        damping.iter().map(found).collect()
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
        for (found, first) in with.iter_mut().zip([0.01, f64::NAN, 0.01]) {
            found.damping_ratio_gain = found.damping_ratio - first;
        }
        let [least, mean] = summarise(GROUP, true, &with).unwrap().damping_ratio_gain.unwrap();
        assert_eq!((least, mean), (0.03 - 0.01, 0.03 - 0.01));
    }

    #[test]
    fn of_several_poles_the_less_stable_one_stays() {
        let mut found = Found::NOTHING;
        found.add(0.02, 5.0, -0.6);
        found.add(-0.01, 5.5, 0.3);
        found.add(0.05, 4.0, -1.0);
        assert_eq!((found.damping_ratio, found.frequency_hz), (-0.01, 5.5));
        assert_eq!(found.pole_re_rad_s, 0.3);
    }

    #[test]
    fn a_row_is_the_same_to_the_last_bit_however_few_values_are_held() {
        let damping: Vec<f64> = (0..5000)
            .map(|i| if i % 50 == 3 { f64::NAN } else { (f64::from(i) * 0.7).sin() * 0.02 })
            .collect();
        let cases = series(&damping);
        let whole = summarise(GROUP, true, &cases).unwrap();
        for most in [0, 10, 1000] {
            let mut tally = Tally::new(GROUP, true, most);
            let mut passes = 0;
            loop {
                cases.iter().for_each(|found| tally.add(found).unwrap());
                passes += 1;
                if tally.end_pass().unwrap() {
                    break;
                }
            }
            assert!(passes > 1);
            assert_eq!(tally.row().unwrap(), whole);
        }
    }

    #[test]
    fn the_smallest_values_come_in_order_with_ties_by_index() {
        let values = [3.0, f64::NAN, 1.0, 2.0, 1.0, 5.0, -1.0];
        let smallest = |values: &[f64], most: usize| -> Vec<usize> {
            let mut smallest = Smallest::new(most);
            values.iter().enumerate().for_each(|(index, value)| smallest.push(*value, || index));
            smallest.into_found().into_iter().map(|(_, index)| index).collect()
        };
        assert_eq!(smallest(&values, 4), [6, 2, 4, 3]);
        assert_eq!(smallest(&values, 100), [6, 2, 4, 3, 0, 5]);
        assert_eq!(smallest(&values, 0), [0; 0]);
        assert_eq!(smallest(&[f64::NAN], 3), [0; 0]);
    }
}
