//! The summary of a run: one row per population, variant, flight time and named mode, and one of
//! the cases reduced to their worst flight time; the worst cases.
//!
//! Works on series with one number per case; where they are read from is decided in `io`.

use super::definition::{Definition, Population};
use super::sample::{CONFIDENCE, Intervals, Sample, ends, known};
use crate::dispersion::Scheme;
use crate::stats::{
    Confidence, Drawing, Error, Moments, Ordered, Probability, Sides, clopper_pearson,
    of_replicates, rejects_at_least, rejects_at_most,
};
use std::f64::consts::LN_2;
use std::ops::Range;

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

    /// The cases in `range`.
    pub fn part(&self, range: Range<usize>) -> Self {
        let part = |values: &[f64]| values.get(range.clone()).unwrap_or_default().to_vec();
        Self {
            damping_ratio: part(&self.damping_ratio),
            frequency_hz: part(&self.frequency_hz),
            pole_re_rad_s: part(&self.pole_re_rad_s),
            damping_ratio_gain: part(&self.damping_ratio_gain),
        }
    }

    /// Bytes per case while a group is summed up, the sorted copies included.
    pub const BYTES_PER_CASE: usize = 8 * size_of::<f64>();

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
    /// What the outer draws show, of a nested plan's cases reduced over the flight times.
    pub outer: Option<OuterDraws>,
    /// The statement on this outer draw.
    pub statement: Option<Statement>,
}

/// Whether an outer draw meets the statement of its plan: that the share of unstable or failed
/// inner cases is at most the allowed one, at the consumer's risk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statement {
    /// Shown.
    Met,
    /// The contrary is shown.
    NotMet,
    /// Neither.
    Undecided,
}

impl Statement {
    /// Every one, in the order of declaration.
    pub const ALL: [Self; 3] = [Self::Met, Self::NotMet, Self::Undecided];

    /// The word stored in the `statement` column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::NotMet => "not_met",
            Self::Undecided => "undecided",
        }
    }
}

/// What the outer draws of a nested plan show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OuterDraws {
    /// Outer draws that meet the statement.
    pub met: u64,
    /// Outer draws that do not.
    pub not_met: u64,
    /// Share of all outer draws that meet it.
    pub share_met: f64,
    /// Its exact binomial interval: outer draws are independent.
    pub share_met_interval: [f64; 2],
}

/// Sums up one group of cases that came about as `sample` says.
///
/// # Errors
/// None for a series whose numbers are finite or NaN; else what `stats` says of them.
pub fn summarise(group: Group, sample: Sample, series: &Series) -> Result<SummaryRow, Error> {
    let frequency: Vec<f64> = known(&series.frequency_hz);
    let gain: Vec<f64> = known(&series.damping_ratio_gain);
    let cases = series.damping_ratio.len() as u64;
    let evaluated = series.damping_ratio.iter().filter(|value| !value.is_nan()).count() as u64;
    let re_max = series.pole_re_rad_s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let unstable = series.pole_re_rad_s.iter().filter(|re| **re > 0.0).count() as u64;
    let failures = cases - evaluated;
    let confidence = Confidence::new(CONFIDENCE)?;
    // A failed case counts as a bad one.
    let bad: Vec<f64> = (series.damping_ratio.iter().zip(&series.pole_re_rad_s))
        .map(|(damping, re)| f64::from(u8::from(damping.is_nan() || *re > 0.0)))
        .collect();
    let share = |independent| {
        let bad = unstable + failures;
        clopper_pearson(bad, cases, confidence, Sides::Two, independent).ok().map(ends)
    };
    let shown = evaluated > 0;
    let interval = sample.interval(&bad, share, mean_of).filter(|_| shown);
    Ok(SummaryRow {
        group,
        cases,
        failures,
        unstable,
        share_unstable: shown.then(|| (unstable + failures) as f64 / cases as f64),
        share_unstable_interval: interval.map(|ends| ends.map(|end| end.clamp(0.0, 1.0))),
        intervals: sample.intervals(series.damping_ratio.len()),
        damping_ratio: spread(&sample, &series.damping_ratio)?,
        frequency_hz_mean: Moments::of(&frequency)?.mean(),
        time_to_double_min_s: (re_max > 0.0).then(|| LN_2 / re_max),
        damping_ratio_gain: Moments::of(&gain)?
            .mean()
            .map(|mean| [gain.iter().copied().fold(f64::INFINITY, f64::min), mean]),
        gain_mean_interval: mean_interval(&sample, &series.damping_ratio_gain),
        outer: None,
        statement: None,
    })
}

/// Sums up the cases of a nested plan: a row for all of them with what the outer draws show, and a row
/// for each outer draw. `allowed_share` and `risk` are those of the plan.
///
/// # Errors
/// As [`summarise`].
pub fn summarise_nested(
    group: Group,
    population: &Population,
    series: &Series,
) -> Result<Vec<SummaryRow>, Error> {
    let mut all = summarise(group, Sample::of(population), series)?;
    let Scheme::Nested { inner, allowed_share, risk, .. } = population.scheme else {
        return Ok(vec![all]);
    };
    let (allowed, risk) = (Probability::new(allowed_share)?, Confidence::from_risk(risk)?);
    let independent = Drawing::Independent.independent()?;
    let mut rows = Vec::new();
    for (outer, first) in (0..).zip((0..series.damping_ratio.len()).step_by(inner as usize)) {
        let part = series.part(first..first + inner as usize);
        let mut row = summarise(Group { outer: Some(outer), ..group }, Sample::INDEPENDENT, &part)?;
        let (bad, cases) = (row.unstable + row.failures, row.cases);
        row.statement = Some(if rejects_at_least(bad, cases, allowed, risk, independent)? {
            Statement::Met
        } else if rejects_at_most(bad, cases, allowed, risk, independent)? {
            Statement::NotMet
        } else {
            Statement::Undecided
        });
        rows.push(row);
    }
    let count = |statement| rows.iter().filter(|r| r.statement == Some(statement)).count() as u64;
    let (met, outer_draws) = (count(Statement::Met), rows.len() as u64);
    let confidence = Confidence::new(CONFIDENCE)?;
    let share = clopper_pearson(met, outer_draws, confidence, Sides::Two, independent)?;
    all.outer = Some(OuterDraws {
        met,
        not_met: count(Statement::NotMet),
        share_met: share.point(),
        share_met_interval: ends(share),
    });
    rows.insert(0, all);
    Ok(rows)
}

fn mean_of(values: &[f64]) -> Option<f64> {
    Moments::of(values).ok()?.mean()
}

/// Interval of the mean of the values that are known.
fn mean_interval(sample: &Sample, values: &[f64]) -> Option<[f64; 2]> {
    let exact = |independent| {
        let moments = Moments::of(&known(values)).ok()?;
        let confidence = Confidence::new(CONFIDENCE).ok()?;
        moments.mean_interval(confidence, Sides::Two, independent).ok().map(ends)
    };
    sample.interval(values, exact, mean_of)
}

/// Intervals of the quantiles at [`LEVELS`]; `ordered` holds the known ones among `values`.
fn quantile_intervals(
    sample: &Sample,
    values: &[f64],
    ordered: &Ordered,
) -> Result<[Option<[f64; 2]>; LEVELS.len()], Error> {
    let mut intervals = [None; LEVELS.len()];
    let confidence = Confidence::new(CONFIDENCE)?;
    if let Ok(independent) = sample.drawing().independent() {
        // Failed cases may lie anywhere: beyond every value for the end on either side.
        let failed = values.len() - ordered.len();
        let with = |value: f64| {
            let failed = std::iter::repeat_n(value, failed);
            Ordered::new(&ordered.values().iter().copied().chain(failed).collect::<Vec<_>>())
        };
        let (low, high) = (with(f64::NEG_INFINITY)?, with(f64::INFINITY)?);
        for (interval, (level, _)) in intervals.iter_mut().zip(LEVELS) {
            let level = Probability::new(level)?;
            let of = |sample: &Ordered| {
                sample.quantile_interval(level, confidence, Sides::Two, independent)
            };
            *interval = Some([of(&low).lower(), of(&high).upper()]);
        }
    } else if sample.drawing() != Drawing::Nested
        && let Ok(independent) =
            sample.drawing().independent_replicates(sample.replicates(values.len()) as u64)
        && let Ok(each) =
            sample.split(values).iter().map(|v| Ordered::new(v)).collect::<Result<Vec<_>, _>>()
    {
        // Not for a nested plan: quantiles of inner campaigns say nothing of all cases.
        for (interval, (level, _)) in intervals.iter_mut().zip(LEVELS) {
            let level = Probability::new(level)?;
            let quantiles: Vec<f64> = each.iter().map(|sample| sample.quantile(level)).collect();
            *interval = of_replicates(&quantiles, confidence, independent).ok().map(ends);
        }
    }
    Ok(intervals)
}

fn spread(sample: &Sample, series: &[f64]) -> Result<Option<Spread>, Error> {
    let values = known(series);
    let moments = Moments::of(&values)?;
    let Some(mean) = moments.mean() else { return Ok(None) };
    let ordered = Ordered::new(&values)?;
    let mut quantiles = [0.0; LEVELS.len()];
    for (quantile, (level, _)) in quantiles.iter_mut().zip(LEVELS) {
        *quantile = ordered.quantile(Probability::new(level)?);
    }
    Ok(Some(Spread {
        mean,
        mean_interval: mean_interval(sample, series),
        standard_deviation: moments.standard_deviation(),
        smallest: ordered.smallest(),
        quantiles,
        quantile_intervals: quantile_intervals(sample, series, &ordered)?,
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

    const GROUP: Group =
        Group { population: 0, variant: 1, mode: 0, flight_time: Some(0), outer: None };

    const CHOSEN: Sample = Sample::turns(Drawing::Designed, 1);

    fn series(damping: &[f64]) -> Series {
        let mut series = Series::unknown(damping.len());
        for (case, damping) in damping.iter().enumerate().filter(|(_, d)| !d.is_nan()) {
            series.add(case, *damping, 5.0, -damping * 31.0);
        }
        series
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
        let row = summarise(GROUP, CHOSEN, &series(&[0.01])).unwrap();
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
        with.compare(&[0.01, f64::NAN, 0.01]);
        let [least, mean] =
            summarise(GROUP, Sample::INDEPENDENT, &with).unwrap().damping_ratio_gain.unwrap();
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
        let rows = summarise_nested(group, &population, &series(&damping)).unwrap();
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
        assert_eq!(smallest(&values, 4), [6, 2, 4, 3]);
        assert_eq!(smallest(&values, 100), [6, 2, 4, 3, 0, 5]);
        assert_eq!(smallest(&values, 0), [0; 0]);
        assert_eq!(smallest(&[f64::NAN], 3), [0; 0]);
    }
}
