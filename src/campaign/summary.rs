//! The summary of a run: one row per population, variant, flight time and named mode, and one of
//! the cases reduced to their worst flight time; the worst cases.
//!
//! Works on cases that pass by one after the other, so that its memory does not grow with their
//! number; where they are read from is decided in `io`.

use super::definition::Definition;
use super::nested::{Nested, OuterDraws, Statement};
use super::sample::{CONFIDENCE, Intervals, Sample, ends};
use crate::stats::{
    BEYOND_EACH, Confidence, Drawing, Error, Moments, Probability, RunningMoments, Selection,
    Sides, clopper_pearson, interval_ranks, of_replicates, of_sections, quantile_of,
};
use std::f64::consts::LN_2;

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
    /// Index of the outer draw of a nested plan; none for all cases of the population.
    pub outer: Option<u64>,
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
    /// Its interval.
    pub mean_interval: Option<[f64; 2]>,
    /// Sample standard deviation; none for a single case.
    pub standard_deviation: Option<f64>,
    /// Least value.
    pub smallest: f64,
    /// Quantiles at [`LEVELS`], linear between order statistics (type 7 of Hyndman and Fan).
    pub quantiles: [f64; LEVELS.len()],
    /// Their intervals; an infinite end is not known.
    pub quantile_intervals: [Option<[f64; 2]>; LEVELS.len()],
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
    /// Share of the cases that are unstable or failed; none if no case has a result.
    pub share_unstable: Option<f64>,
    /// Its interval; none for cases from which none follows.
    pub share_unstable_interval: Option<[f64; 2]>,
    /// Where the intervals of the row come from.
    pub intervals: Intervals,
    /// Damping ratios; none if no case has a result.
    pub damping_ratio: Option<Spread>,
    /// Mean frequency, Hz.
    pub frequency_hz_mean: Option<f64>,
    /// Shortest time to double, s; none if no case is unstable.
    pub time_to_double_min_s: Option<f64>,
    /// Least and mean gain of damping ratio over the first variant on the same draws.
    pub damping_ratio_gain: Option<[f64; 2]>,
    /// Interval of the mean gain.
    pub gain_mean_interval: Option<[f64; 2]>,
    /// What the outer draws show, of all cases of a nested plan.
    pub outer: Option<OuterDraws>,
    /// The statement on this outer draw.
    pub statement: Option<Statement>,
}

/// Sums up one group from its cases, which pass by in the order of their index, several times if
/// there are too many to hold: all statistics are exact.
#[derive(Debug, Clone)]
pub struct Tally {
    group: Group,
    sample: Sample,
    first_pass: bool,
    /// Cases taken in this pass.
    taken: u64,
    cases: u64,
    unstable: u64,
    pole_re_max: f64,
    damping: RunningMoments,
    frequency: RunningMoments,
    gain: RunningMoments,
    gain_min: f64,
    order: Selection,
    /// The replicates among which cases take turns; none if there is one.
    replicates: Vec<Self>,
    /// The outer draws of a nested plan.
    nested: Option<Nested>,
}

impl Tally {
    /// A tally of no cases, which come about as `sample` says, that holds about `most` values.
    pub fn new(group: Group, sample: Sample, most: usize) -> Self {
        let count = sample.turning();
        let part = || Self::new(group, Sample::turns(Drawing::Designed, 1), most / count);
        let replicates = if count > 1 { (0..count).map(|_| part()).collect() } else { Vec::new() };
        Self {
            group,
            sample,
            replicates,
            nested: sample.nested().map(|nested| Nested::new(group, nested)),
            first_pass: true,
            taken: 0,
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
        if !self.replicates.is_empty() {
            let turn = self.taken % self.replicates.len() as u64;
            self.replicates[turn as usize].add(found)?;
        }
        if let Some(nested) = self.nested.as_mut().filter(|_| self.first_pass) {
            nested.add(found)?;
        }
        self.taken += 1;
        Ok(())
    }

    /// Ends a pass over all cases; whether it was the last.
    ///
    /// # Errors
    /// None: the levels are levels.
    pub fn end_pass(&mut self) -> Result<bool, Error> {
        self.first_pass = false;
        self.taken = 0;
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
        for interval in self.interval_ranks()?.into_iter().flatten().flatten() {
            ranks.extend(interval);
        }
        let mut done = self.order.end_pass(&ranks);
        for replicate in &mut self.replicates {
            done &= replicate.end_pass()?;
        }
        Ok(done)
    }

    /// Ranks among the known values of the ends of the intervals of the quantiles; none for an end
    /// beyond them. Failed cases may lie anywhere: beyond every value for the end on either side.
    fn interval_ranks(&self) -> Result<Option<[[Option<u64>; 2]; LEVELS.len()]>, Error> {
        let Ok(independent) = self.sample.drawing().independent() else { return Ok(None) };
        let (known, failures) = (self.order.count(), self.failures());
        let confidence = Confidence::new(CONFIDENCE)?;
        let mut ranks = [[None; 2]; LEVELS.len()];
        for (ranks, (level, _)) in ranks.iter_mut().zip(LEVELS) {
            let level = Probability::new(level)?;
            let [low, high] = interval_ranks(self.cases, level, confidence, independent);
            *ranks = [
                low.and_then(|rank| rank.checked_sub(failures)),
                high.filter(|rank| *rank < known),
            ];
        }
        Ok((known > 0).then_some(ranks))
    }

    fn failures(&self) -> u64 {
        self.cases - self.order.count()
    }

    /// Cases that are unstable or failed.
    pub(super) fn bad(&self) -> u64 {
        self.unstable + self.failures()
    }

    /// Cases so far.
    pub(super) fn cases(&self) -> u64 {
        self.cases
    }

    /// Means of damping ratio and gain of the cases that have them.
    pub(super) fn means(&self) -> [Option<f64>; 2] {
        [&self.damping, &self.gain].map(|values| values.moments().mean())
    }

    /// The interval over replicates or outer draws of a statistic of each, where it follows.
    fn over_replicates(&self, values: Option<Vec<f64>>) -> Option<[f64; 2]> {
        let values = values?;
        let drawing = self.sample.drawing();
        let independent = drawing.independent_replicates(values.len() as u64).ok()?;
        let confidence = Confidence::new(CONFIDENCE).ok()?;
        of_replicates(&values, confidence, independent).ok().map(ends)
    }

    /// The interval of a quantile over replicates, about that of all cases.
    fn quantile_over_replicates(&self, level: Probability) -> Option<[f64; 2]> {
        let fewest = self.replicates.iter().map(|tally| tally.order.count()).min()? as f64;
        if !(fewest * level.get().min(1.0 - level.get()) >= BEYOND_EACH) {
            return None;
        }
        let each: Option<Vec<f64>> =
            self.replicates.iter().map(|tally| tally.quantile(level)).collect();
        let (each, whole) = (each?, self.quantile(level)?);
        let independent = self.sample.drawing().independent_replicates(each.len() as u64).ok()?;
        let confidence = Confidence::new(CONFIDENCE).ok()?;
        of_sections(whole, &each, confidence, independent).ok().map(ends)
    }

    /// The interval of a mean: `place` is its place in [`Tally::means`].
    fn mean_interval(&self, moments: Moments, place: usize) -> Option<[f64; 2]> {
        if let Ok(independent) = self.sample.drawing().independent() {
            let confidence = Confidence::new(CONFIDENCE).ok()?;
            return moments.mean_interval(confidence, Sides::Two, independent).ok().map(ends);
        }
        self.over_replicates(match &self.nested {
            Some(nested) => nested.means(place),
            None => self.replicates.iter().map(|tally| tally.means()[place]).collect(),
        })
    }

    fn share_interval(&self) -> Result<Option<[f64; 2]>, Error> {
        if let Ok(independent) = self.sample.drawing().independent() {
            let confidence = Confidence::new(CONFIDENCE)?;
            let (bad, cases) = (self.bad(), self.cases);
            let share = clopper_pearson(bad, cases, confidence, Sides::Two, independent)?;
            return Ok(Some(ends(share)));
        }
        let share = |tally: &Self| tally.bad() as f64 / tally.cases as f64;
        let found = self.over_replicates(Some(match &self.nested {
            Some(nested) => nested.shares(),
            None => self.replicates.iter().map(share).collect(),
        }));
        Ok(found.map(|ends| ends.map(|end| end.clamp(0.0, 1.0))))
    }

    /// The rows of the outer draws of a nested plan, whose cases are reduced over the flight times.
    pub fn outer_rows(&self) -> &[SummaryRow] {
        self.nested.as_ref().map_or(&[], |nested| nested.rows())
    }

    /// The row of the summary, once the last pass has ended.
    ///
    /// # Errors
    /// What `stats` says.
    pub fn row(&self) -> Result<SummaryRow, Error> {
        let evaluated = self.order.count();
        let shown = evaluated > 0;
        let drawing = self.sample.drawing();
        let replicates = self.sample.replicates(self.cases as usize) as u64;
        Ok(SummaryRow {
            group: self.group,
            cases: self.cases,
            failures: self.failures(),
            unstable: self.unstable,
            share_unstable: shown.then(|| self.bad() as f64 / self.cases as f64),
            share_unstable_interval: if shown { self.share_interval()? } else { None },
            intervals: if drawing.independent().is_ok() {
                Intervals::Independent
            } else if drawing.independent_replicates(replicates).is_ok() {
                Intervals::Replicates
            } else {
                Intervals::None
            },
            damping_ratio: self.spread()?,
            frequency_hz_mean: self.frequency.moments().mean(),
            time_to_double_min_s: (self.pole_re_max > 0.0).then(|| LN_2 / self.pole_re_max),
            damping_ratio_gain: self.gain.moments().mean().map(|mean| [self.gain_min, mean]),
            gain_mean_interval: self.mean_interval(self.gain.moments(), 1),
            outer: self.nested.as_ref().map(Nested::outer_draws).transpose()?,
            statement: None,
        })
    }

    fn quantile(&self, level: Probability) -> Option<f64> {
        let count = self.order.count();
        (count > 0).then(|| quantile_of(count, level, |rank| self.order.value(rank)))
    }

    fn quantile_intervals(&self) -> Result<[Option<[f64; 2]>; LEVELS.len()], Error> {
        let mut intervals = [None; LEVELS.len()];
        if let Some(ranks) = self.interval_ranks()? {
            for (interval, [low, high]) in intervals.iter_mut().zip(ranks) {
                let end = |rank: Option<u64>, beyond| rank.map_or(beyond, |r| self.order.value(r));
                *interval = Some([end(low, f64::NEG_INFINITY), end(high, f64::INFINITY)]);
            }
        } else if !self.replicates.is_empty() {
            for (interval, (level, _)) in intervals.iter_mut().zip(LEVELS) {
                let level = Probability::new(level)?;
                *interval = self.quantile_over_replicates(level);
            }
        }
        Ok(intervals)
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
            mean_interval: self.mean_interval(moments, 0),
            standard_deviation: moments.standard_deviation(),
            smallest: self.order.value(0),
            quantiles,
            quantile_intervals: self.quantile_intervals()?,
            largest: self.order.value(count - 1),
        }))
    }
}

/// Sums up one group whose cases are at hand.
///
/// # Errors
/// None for numbers that are finite or NaN; else what `stats` says of them.
pub fn summarise(group: Group, sample: Sample, cases: &[Found]) -> Result<SummaryRow, Error> {
    let mut tally = Tally::new(group, sample, usize::MAX);
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
                groups.push(Group { population, variant, mode, flight_time, outer: None });
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
    use super::super::definition::Population;
    use super::*;
    use crate::dispersion::Scheme;

    const GROUP: Group =
        Group { population: 0, variant: 1, mode: 0, flight_time: Some(0), outer: None };

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
    fn failures_are_counted_and_count_as_bad() {
        let series = series(&[0.01, f64::NAN, -0.02, 0.03, -0.01]);
        let row = summarise(GROUP, Sample::INDEPENDENT, &series).unwrap();
        assert_eq!((row.cases, row.failures, row.unstable), (5, 1, 2));
        assert_eq!(row.share_unstable, Some(0.6));
        // R: binom.test(3, 5)$conf.int
        let [low, high] = row.share_unstable_interval.unwrap();
        assert!((low - 0.146_632_8).abs() < 5e-8 && (high - 0.947_255_05).abs() < 5e-8);
        let spread = row.damping_ratio.unwrap();
        assert!((spread.mean - 0.0025).abs() < 1e-17);
        assert_eq!((spread.smallest, spread.largest), (-0.02, 0.03));
        assert_eq!(spread.quantiles[3], 0.0);
        assert_eq!(row.time_to_double_min_s, Some(LN_2 / 0.62));
        assert_eq!(row.damping_ratio_gain, None);
    }

    #[test]
    fn a_chosen_case_has_no_interval() {
        let row = summarise(GROUP, Sample::turns(Drawing::Designed, 1), &series(&[0.01])).unwrap();
        assert_eq!((row.share_unstable, row.share_unstable_interval), (Some(0.0), None));
        assert_eq!(row.damping_ratio.unwrap().standard_deviation, None);
    }

    #[test]
    fn a_group_without_a_result_has_counts_and_nothing_else() {
        let row = summarise(GROUP, Sample::INDEPENDENT, &series(&[f64::NAN; 3])).unwrap();
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
        let [least, mean] =
            summarise(GROUP, Sample::INDEPENDENT, &with).unwrap().damping_ratio_gain.unwrap();
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
        let whole = summarise(GROUP, Sample::INDEPENDENT, &cases).unwrap();
        for most in [0, 10, 1000] {
            let mut tally = Tally::new(GROUP, Sample::INDEPENDENT, most);
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
    fn replicates_take_turns_and_give_the_intervals_of_their_own_results() {
        let sample = Sample::turns(Drawing::LowDiscrepancy, 2);
        let row =
            summarise(GROUP, sample, &series(&[0.01, -0.01, 0.03, -0.03, f64::NAN, 0.03])).unwrap();
        assert_eq!((row.intervals, row.share_unstable), (Intervals::Replicates, Some(0.5)));
        let spread = row.damping_ratio.unwrap();
        // Means 0.02 and −1/300: t(0.975, 1) = 12.7062 times half their difference about their mean.
        let [low, high] = spread.mean_interval.unwrap();
        let (middle, half) = ((0.02 - 0.01 / 3.0) / 2.0, 12.706_204_736 * (0.07 / 3.0) / 2.0);
        assert!((low - (middle - half)).abs() < 1e-10 && (high - (middle + half)).abs() < 1e-10);
        // Shares 1/3 (the failed case) and 2/3, cut off at 0 and 1.
        assert_eq!(row.share_unstable_interval, Some([0.0, 1.0]));
        let single = Sample::turns(Drawing::LowDiscrepancy, 1);
        let row = summarise(GROUP, single, &series(&[0.01, 0.02, 0.03])).unwrap();
        assert_eq!((row.intervals, row.share_unstable_interval), (Intervals::None, None));
        assert_eq!(row.damping_ratio.unwrap().quantile_intervals, [None; 7]);
    }

    #[test]
    fn failed_cases_widen_the_intervals_of_quantiles_on_both_sides() {
        let mut damping: Vec<f64> = (1..=200).map(f64::from).collect();
        let median = |damping: &[f64]| {
            let row = summarise(GROUP, Sample::INDEPENDENT, &series(damping)).unwrap();
            row.damping_ratio.unwrap().quantile_intervals[3].unwrap()
        };
        // R: qbinom(c(0.025, 0.975), 200, 0.5) = 86, 114: order statistics 86 and 115.
        assert_eq!(median(&damping), [86.0, 115.0]);
        damping[99] = f64::NAN;
        assert_eq!(median(&damping), [85.0, 116.0]);
    }

    #[test]
    fn every_outer_draw_has_its_statement_and_all_of_them_their_share() {
        let population = Population {
            name: "dispersed".into(),
            cases: 90,
            fixed: Vec::new(),
            drawn: true,
            scheme: Scheme::Nested {
                inner: 30,
                flight_day_outside: true,
                allowed_share: 0.1,
                risk: 0.1,
            },
        };
        // 30 good inner cases: 0.9^30 = 0.042 ≤ 0.1, met; one bad one: 0.184, undecided; 20 bad: not met.
        let damping: Vec<f64> = (0..90)
            .map(|case| match case {
                35 => f64::NAN,
                60..80 => -0.01,
                _ => 0.01,
            })
            .collect();
        let group = Group { flight_time: None, ..GROUP };
        let cases = series(&damping);
        let mut tally = Tally::new(group, Sample::of(&population), 10);
        loop {
            cases.iter().for_each(|found| tally.add(found).unwrap());
            if tally.end_pass().unwrap() {
                break;
            }
        }
        let mut rows = vec![tally.row().unwrap()];
        rows.extend_from_slice(tally.outer_rows());
        let statements: Vec<_> = rows.iter().map(|r| (r.group.outer, r.statement)).collect();
        let expected = [
            (None, None),
            (Some(0), Some(Statement::Met)),
            (Some(1), Some(Statement::Undecided)),
            (Some(2), Some(Statement::NotMet)),
        ];
        assert_eq!(statements, expected);
        let outer = rows[0].outer.unwrap();
        assert_eq!((outer.met, outer.not_met, outer.share_met), (1, 1, 1.0 / 3.0));
        // R: binom.test(1, 3)$conf.int
        let [low, high] = outer.share_met_interval;
        assert!((low - 0.008_403_76).abs() < 5e-9 && (high - 0.905_700_68).abs() < 5e-9);
        assert_eq!(rows[0].intervals, Intervals::Replicates);
        assert_eq!((rows[2].failures, rows[2].share_unstable), (1, Some(1.0 / 30.0)));
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
