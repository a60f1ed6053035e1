//! From gates and the values of a run to outcomes.
//!
//! Every gate but the extreme comes down to one question: is the share of the population that
//! breaks a limit at most an allowed share, at the confidence? Of N cases k break it (failed cases
//! do). It is shown where P(X ≤ k | N, allowed) ≤ risk, its contrary where
//! P(X ≥ k | N, allowed) ≤ risk, X binomial: the two Clopper–Pearson bounds, and at the same time
//! the order statistics of Wilks.

use super::outcome::{Offender, Outcome};
use super::resolve::{Claim, Outer, Plan, Run, column_unit, resolve};
use super::rule::{Gate, Sense, Statistic};
use super::source::{CaseValue, MissingMeans, Names, Query, Searched, Source, Worst};
use super::verdict::Verdict;
use crate::problem::Problems;
use crate::stats::{self, Confidence, Probability, Selection, Sides, Tails};

/// Checks gates read from `file` against what a run has, finished or planned.
///
/// # Errors
/// As [`evaluate`].
pub fn check(gates: &[Gate], names: &impl Names, file: &str) -> Result<(), Problems> {
    resolve(gates, &Run::of(names), file).map(|_| ())
}

/// Evaluates gates read from `file`.
///
/// What a run does not have (metric, variant, …), and an exact bound asked of cases that are not
/// independent draws, are problems of the gate file: all of them are returned, and no outcome.
pub fn evaluate(
    gates: &[Gate],
    source: &impl Source,
    file: &str,
) -> Result<Vec<Outcome>, Problems> {
    let run = Run::of(source);
    let plans = resolve(gates, &run, file)?;
    gates.iter().zip(&plans).map(|(gate, plan)| outcome(gate, plan, source)).collect()
}

/// Side of the metric on which it is bad.
fn worst(gate: &Gate) -> Worst {
    match (&gate.statistic, gate.limit.sense) {
        (Statistic::ShareBelow { .. }, Sense::AtMost)
        | (Statistic::ShareAbove { .. }, Sense::AtLeast) => Worst::Smallest,
        (Statistic::ShareBelow { .. }, Sense::AtLeast)
        | (Statistic::ShareAbove { .. }, Sense::AtMost) => Worst::Largest,
        // A share of the inner cases.
        (Statistic::NestedStatement { .. }, _) => Worst::Largest,
        (_, Sense::AtLeast) => Worst::Smallest,
        (_, Sense::AtMost) => Worst::Largest,
    }
}

/// Hands the cases of a gate to `visit`; of a nested plan one for each outer draw that is whole, called by
/// its first case, with the share of its cases that are bad: below the threshold, failed or without a value.
fn values(
    gate: &Gate,
    plan: &Plan<'_>,
    source: &impl Source,
    query: &Query<'_>,
    visit: &mut dyn FnMut(CaseValue) -> Result<(), Problems>,
) -> Result<(), Problems> {
    let (
        Statistic::NestedStatement { threshold, .. },
        Claim::Share { outer: Some(Outer { inner, .. }), .. },
    ) = (&gate.statistic, &plan.claim)
    else {
        return source.visit(query, visit);
    };
    let good = |value: &Result<Option<f64>, String>| match value {
        Ok(Some(value)) => *value >= threshold.base(),
        Ok(None) => plan.metric.missing == MissingMeans::NotApplicableGood,
        Err(_) => false,
    };
    let (mut first, mut present, mut bad) = (0, 0, 0_u64);
    source.visit(query, &mut |case| {
        if case.case / inner != first / inner {
            (first, present, bad) = (case.case / inner * inner, 0, 0);
        }
        present += 1;
        bad += u64::from(!good(&case.value));
        if present < *inner {
            return Ok(());
        }
        visit(CaseValue { case: first, value: Ok(Some(bad as f64 / *inner as f64)) })
    })
}

/// Whether a value counts against the gate; written so that NaN does.
fn violates(gate: &Gate, value: f64) -> bool {
    let good = match (&gate.statistic, gate.limit.sense) {
        (Statistic::ShareBelow { threshold, .. }, Sense::AtMost) => value >= threshold.base(),
        (Statistic::ShareBelow { threshold, .. }, Sense::AtLeast) => value < threshold.base(),
        (Statistic::ShareAbove { threshold, .. }, Sense::AtMost) => value <= threshold.base(),
        (Statistic::ShareAbove { threshold, .. }, Sense::AtLeast) => value > threshold.base(),
        (_, Sense::AtLeast) => value >= gate.limit.quantity.base(),
        (_, Sense::AtMost) => value <= gate.limit.quantity.base(),
    };
    !good
}

/// The cases of a gate, ranked from the worst: failed ones, then by value, then those where none
/// applies. Memory does not grow with their number.
struct Cases {
    count: u64,
    failures: u64,
    violations: u64,
    /// The worst with a value.
    worst: Option<CaseValue>,
    /// The worst of those that count against the gate, the worst first.
    offenders: Vec<CaseValue>,
    /// Badness of every case: the smaller, the worse.
    order: Selection,
    sign: f64,
}

/// Values held at once while a gate is evaluated.
const HELD: usize = 256 << 10;

impl Cases {
    fn of(
        gate: &Gate,
        plan: &Plan<'_>,
        source: &impl Source,
        query: &Query<'_>,
    ) -> Result<Self, Problems> {
        let metric = plan.metric;
        let sign = if worst(gate) == Worst::Smallest { 1.0 } else { -1.0 };
        let badness = |case: &CaseValue| match case.value {
            Err(_) => f64::NEG_INFINITY,
            Ok(Some(value)) => sign * value,
            Ok(None) => f64::INFINITY,
        };
        let checked = |mut case: CaseValue| {
            match case.value {
                Ok(Some(value)) if !value.is_finite() => {
                    case.value = Err(format!("{} is {value}", metric.name));
                }
                Ok(None) if metric.missing == MissingMeans::NoValue => {
                    case.value = Err(format!("{} has no value", metric.name));
                }
                _ => {}
            }
            case
        };
        let order = Selection::new(HELD);
        let (worst, offenders) = (None, Vec::new());
        let mut cases =
            Self { count: 0, failures: 0, violations: 0, worst, offenders, order, sign };
        let mut last = None;
        let mut sound = true;
        values(gate, plan, source, query, &mut |case| {
            sound &= last < Some(case.case) && case.case < plan.population.planned;
            last = Some(case.case);
            let case = checked(case);
            let bad = badness(&case);
            cases.count += 1;
            cases.failures += u64::from(case.value.is_err());
            cases.order.push(bad);
            if matches!(case.value, Ok(Some(_)))
                && cases.worst.as_ref().is_none_or(|worst| bad < badness(worst))
            {
                cases.worst = Some(case.clone());
            }
            if offends(gate, plan, &case) {
                cases.violations += 1;
                // Equal values stay in the order of their cases.
                let at = cases.offenders.partition_point(|other| badness(other) <= bad);
                if at < Outcome::OFFENDERS {
                    cases.offenders.insert(at, case);
                    cases.offenders.truncate(Outcome::OFFENDERS);
                }
            }
            Ok(())
        })?;
        if !sound {
            return Err(Problems::damage(
                "cases",
                &gate.selection.population,
                "cases out of order, twice, or beyond those planned",
                format!("each of {} cases once, in order", plan.population.planned),
            ));
        }
        let asked = ranks(plan, cases.count);
        let ranks: Vec<u64> = asked.into_iter().filter(|rank| *rank < cases.count).collect();
        while !cases.order.end_pass(&ranks) {
            values(gate, plan, source, query, &mut |case| {
                cases.order.push(badness(&checked(case)));
                Ok(())
            })?;
        }
        Ok(cases)
    }

    fn len(&self) -> u64 {
        self.count
    }

    /// The value that `skip` cases are worse than; `None` beyond the last and where none stands.
    /// Only ranks of [`ranks`] may be asked for.
    fn value_after(&self, skip: u64) -> Option<f64> {
        let badness = (skip < self.count).then(|| self.order.value(skip))?;
        badness.is_finite().then_some(self.sign * badness)
    }
}

/// Ranks that the value and the bound of a gate lie at in `n` cases, from the worst, 0.
fn ranks(plan: &Plan<'_>, n: u64) -> Vec<u64> {
    match plan.claim {
        Claim::Every | Claim::Searched | Claim::Share { outer: Some(_), .. } => vec![0],
        Claim::Share { allowed, confidence, outer: None, .. } => {
            let most = most_violations(n, allowed, confidence);
            most.into_iter().chain([own_rank(n, allowed)]).collect()
        }
    }
}

/// The rank that the allowed share of the cases is worse than.
fn own_rank(n: u64, allowed: Probability) -> u64 {
    (allowed.get() * n as f64).floor() as u64
}

/// The most violations that would pass in `n` cases.
fn most_violations(n: u64, allowed: Probability, confidence: Confidence) -> Option<u64> {
    let coverage = Probability::new(1.0 - allowed.get()).ok()?;
    stats::most_exceedances(n, coverage, confidence, Tails::One)
}

fn offends(gate: &Gate, plan: &Plan<'_>, case: &CaseValue) -> bool {
    match (&case.value, &plan.claim) {
        (Ok(Some(share)), Claim::Share { outer: Some(Outer { inner, most }), .. }) => {
            // Shares of a whole number of cases, told apart in the middle between two.
            !most.is_some_and(|most| *share < (most as f64 + 0.5) / *inner as f64)
        }
        (value, _) => breaks(gate, value),
    }
}

fn breaks(gate: &Gate, value: &Result<Option<f64>, String>) -> bool {
    match *value {
        Err(_) => true,
        Ok(Some(value)) => violates(gate, value),
        Ok(None) => false,
    }
}

/// What a gate asks of a run.
fn query<'a>(gate: &'a Gate, plan: &Plan<'a>) -> Query<'a> {
    let selection = &gate.selection;
    Query {
        metric: plan.metric,
        population: &selection.population,
        variant: selection.variant.as_deref(),
        baseline: selection.baseline.as_deref(),
        baseline_run: selection.baseline_run,
        flight_times_s: selection.flight_times_s.as_deref(),
        mode: selection.mode.as_deref(),
        worst: match gate.statistic {
            Statistic::NestedStatement { .. } => Worst::Smallest,
            _ => worst(gate),
        },
    }
}

/// Hands the value of every case that a gate read from `file` looks at to `visit`.
///
/// # Errors
/// As [`evaluate`], and what `visit` returns.
pub fn visit(
    gate: &Gate,
    source: &impl Source,
    file: &str,
    visit: &mut dyn FnMut(CaseValue) -> Result<(), Problems>,
) -> Result<(), Problems> {
    let run = Run::of(source);
    let plans = resolve(std::slice::from_ref(gate), &run, file)?;
    plans.iter().try_for_each(|plan| values(gate, plan, source, &query(gate, plan), visit))
}

fn outcome(gate: &Gate, plan: &Plan<'_>, source: &impl Source) -> Result<Outcome, Problems> {
    let query = query(gate, plan);
    if let Statistic::WorstOnWorst { region, sigma } = gate.statistic {
        return Ok(searched(gate, plan, source.worst(&query, region, sigma)?));
    }
    let cases = Cases::of(gate, plan, source, &query)?;
    let planned = match plan.claim {
        Claim::Share { outer: Some(Outer { inner, .. }), .. } => plan.population.planned / inner,
        _ => plan.population.planned,
    };
    let missing = planned.saturating_sub(cases.len());
    let verdict = verdict(gate, plan, &cases, missing);
    Ok(describe(gate, plan, &cases, missing, verdict))
}

fn verdict(gate: &Gate, plan: &Plan<'_>, cases: &Cases, missing: u64) -> Verdict {
    // A run in which every case failed shows nothing, good or bad.
    if cases.failures == cases.len() {
        return Verdict::Incomplete;
    }
    let (passes, fails) = match plan.claim {
        Claim::Every | Claim::Searched => (cases.violations == 0, cases.violations > 0),
        Claim::Share { allowed, confidence, independent, .. } => {
            let (k, n) = (cases.violations, cases.len());
            let shown = |test: Result<bool, stats::Error>| test.unwrap_or(false);
            (
                shown(stats::rejects_at_least(k, n, allowed, confidence, independent)),
                shown(stats::rejects_at_most(k, n, allowed, confidence, independent)),
            )
        }
    };
    if fails {
        Verdict::Fail
    } else if missing > 0 {
        Verdict::Incomplete
    } else if passes && cases.len() >= gate.min_cases {
        Verdict::Pass
    } else {
        Verdict::Inconclusive
    }
}

/// Value and bound in the unit of the limit, and the most violations that would pass.
fn value_and_bound(
    gate: &Gate,
    plan: &Plan<'_>,
    cases: &Cases,
) -> (Option<f64>, Option<f64>, Option<u64>) {
    let scale = gate.limit.quantity.scale();
    let n = cases.len();
    let Claim::Share { allowed, confidence, independent, outer } = plan.claim else {
        let worst = cases.value_after(0).map(|value| value / scale);
        return (worst, worst, Some(0));
    };
    let most = most_violations(n, allowed, confidence);
    let share =
        matches!(gate.statistic, Statistic::ShareBelow { .. } | Statistic::ShareAbove { .. });
    if share || outer.is_some() {
        let share =
            stats::clopper_pearson(cases.violations, n, confidence, Sides::Upper, independent).ok();
        let shown = |share: f64| match gate.limit.sense {
            Sense::AtMost => share / scale,
            Sense::AtLeast => (1.0 - share) / scale,
        };
        (share.map(|share| shown(share.point())), share.map(|share| shown(share.upper())), most)
    } else {
        // The sample's own order statistic, that the allowed share of the cases is worse than.
        let value = cases.value_after(own_rank(n, allowed)).map(|value| value / scale);
        let bound = most.and_then(|most| cases.value_after(most)).map(|value| value / scale);
        (value, bound, most)
    }
}

fn describe(
    gate: &Gate,
    plan: &Plan<'_>,
    cases: &Cases,
    missing: u64,
    verdict: Verdict,
) -> Outcome {
    let (value, bound, most_violations) = value_and_bound(gate, plan, cases);
    let needed = Needed::of(gate, plan, cases);
    let worst = cases.worst.as_ref();
    let offenders = cases
        .offenders
        .iter()
        .map(|case| Offender {
            case: case.case,
            value: case.value.as_ref().ok().copied().flatten(),
            failure: case.value.as_ref().err().cloned(),
        })
        .collect();
    let inconclusive = verdict == Verdict::Inconclusive;
    let confidence = match plan.claim {
        Claim::Every | Claim::Searched => None,
        Claim::Share { confidence, .. } => Some(confidence.get()),
    };
    let metric_unit = match gate.statistic {
        Statistic::NestedStatement { .. } => "1".to_owned(),
        _ => column_unit(&plan.metric.unit),
    };
    Outcome {
        id: gate.id.clone(),
        population: gate.selection.population.clone(),
        verdict,
        severity: gate.severity,
        statistic: statistic_in_words(gate),
        value,
        bound,
        sense: match gate.limit.sense {
            Sense::AtLeast => "at_least",
            Sense::AtMost => "at_most",
        },
        limit: gate.limit.quantity.value,
        unit: gate.limit.quantity.unit.clone(),
        confidence,
        cases: cases.len(),
        failures: cases.failures,
        missing,
        violations: cases.violations,
        most_violations,
        worst_case: worst.map(|case| case.case),
        worst_value: worst.and_then(|case| case.value.as_ref().ok().copied().flatten()),
        metric_unit,
        cases_needed: needed.if_good.filter(|_| inconclusive),
        cases_needed_at_observed_rate: needed.at_rate.filter(|_| inconclusive),
        offenders,
        message: message(gate, cases, missing, verdict, &needed),
        rationale: gate.rationale.clone(),
    }
}

/// What a search shows: it fails by the worst case found, and passes where neither that nor what the search
/// may have left undone breaks the limit.
fn searched(gate: &Gate, plan: &Plan<'_>, found: Option<Searched>) -> Outcome {
    let against = |value: Option<f64>| breaks(gate, &Ok(value));
    let verdict = match &found {
        None => Verdict::Incomplete,
        Some(found) if against(found.value) => Verdict::Fail,
        Some(found) if against(found.at_worst) => Verdict::Inconclusive,
        Some(_) => Verdict::Pass,
    };
    let scale = gate.limit.quantity.scale();
    let scaled = |value: Option<f64>| value.map(|value| value / scale);
    let message = match &found {
        None => {
            "no such search: tvse worst, with this variant, mode, baseline, size and these flight \
                 times, makes one"
                .to_owned()
        }
        Some(found) => {
            let left = match verdict {
                Verdict::Inconclusive => {
                    "; the search ended before a stationary point, and what it may \
                                          have left breaks the limit"
                }
                _ => "",
            };
            format!("worst case found: {} (tvse replay RUN --worst {0}){left}", found.name)
        }
    };
    Outcome {
        id: gate.id.clone(),
        population: gate.selection.population.clone(),
        verdict,
        severity: gate.severity,
        statistic: statistic_in_words(gate),
        value: scaled(found.as_ref().and_then(|found| found.value)),
        bound: scaled(found.as_ref().and_then(|found| found.at_worst)),
        sense: "at_least",
        limit: gate.limit.quantity.value,
        unit: gate.limit.quantity.unit.clone(),
        confidence: None,
        cases: found.as_ref().map_or(0, |found| found.cases),
        failures: 0,
        missing: 0,
        violations: u64::from(verdict == Verdict::Fail),
        most_violations: Some(0),
        worst_case: None,
        worst_value: found.as_ref().and_then(|found| found.value),
        metric_unit: column_unit(&plan.metric.unit),
        cases_needed: None,
        cases_needed_at_observed_rate: None,
        offenders: Vec::new(),
        message,
        rationale: gate.rationale.clone(),
    }
}

/// Further cases needed for a pass.
struct Needed {
    /// If none of them is a violation.
    if_good: Option<u64>,
    /// If violations go on at the observed rate.
    at_rate: Option<u64>,
}

impl Needed {
    fn of(gate: &Gate, plan: &Plan<'_>, cases: &Cases) -> Self {
        let (k, n) = (cases.violations, cases.len());
        let further = |total: u64| total.max(gate.min_cases).saturating_sub(n);
        let Claim::Share { allowed, confidence, .. } = plan.claim else {
            let needed = (k == 0).then(|| further(n));
            return Self { if_good: needed, at_rate: needed };
        };
        let Ok(coverage) = Probability::new(1.0 - allowed.get()) else {
            return Self { if_good: None, at_rate: None };
        };
        let least = |k: u64| stats::least_cases(k, coverage, confidence, Tails::One).ok();
        Self { if_good: least(k).map(further), at_rate: at_observed_rate(k, n, least).map(further) }
    }
}

/// Violations looked at before a pass at the observed rate counts as out of reach.
const MOST_VIOLATIONS: u64 = 1 << 24;

/// Total cases at which the violations expected at the observed rate are few enough.
fn at_observed_rate(k: u64, n: u64, least: impl Fn(u64) -> Option<u64>) -> Option<u64> {
    let rate = k as f64 / n as f64;
    // With v violations allowed from `least(v)` cases on, that many cases show `rate · least(v)`.
    let enough = |v: u64| least(v).is_some_and(|cases| rate * cases as f64 <= v as f64);
    let mut low = k;
    if enough(low) {
        return least(low);
    }
    let mut high = low.max(1);
    while !enough(high) {
        low = high;
        high *= 2;
        if high > MOST_VIOLATIONS {
            return None;
        }
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if enough(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    least(high)
}

/// "minimum of time_to_double_s [jet_damping]", "share of … below 0", with the flight times chosen.
fn statistic_in_words(gate: &Gate) -> String {
    let selection = &gate.selection;
    let mut of = gate.metric.clone();
    if let Some(variant) = &selection.variant {
        let baseline = selection.baseline.as_ref().map(|name| format!(" − {name}"));
        of += &format!(" [{variant}{}]", baseline.unwrap_or_default());
    }
    let words = match &gate.statistic {
        Statistic::Extreme if gate.limit.sense == Sense::AtLeast => format!("minimum of {of}"),
        Statistic::Extreme => format!("maximum of {of}"),
        Statistic::ShareBelow { threshold, .. } => format!("share of {of} below {threshold}"),
        Statistic::ShareAbove { threshold, .. } => format!("share of {of} above {threshold}"),
        Statistic::Quantile { level, .. } => format!("{} quantile of {of}", level.get()),
        Statistic::ToleranceBound { coverage, .. } => {
            format!("bound of {of} kept by {} of the population", coverage.get())
        }
        Statistic::NestedStatement { threshold, .. } => {
            format!("share of outer draws with few enough {of} below {threshold}")
        }
        Statistic::WorstOnWorst { region, sigma } => {
            format!("worst on worst of {of} in the {} of {sigma} σ", region.name())
        }
    };
    let words = if selection.baseline_run { words + ", less the baseline run" } else { words };
    match &selection.flight_times_s {
        None => words,
        Some(times) => {
            let times = times.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
            format!("{words} at {times} s")
        }
    }
}

fn message(gate: &Gate, cases: &Cases, missing: u64, verdict: Verdict, needed: &Needed) -> String {
    let what = match gate.statistic {
        Statistic::NestedStatement { .. } => "outer draws",
        _ => "cases",
    };
    let mut text = format!("{} of {} {what} count against the gate", cases.violations, cases.len());
    if cases.failures > 0 {
        text += &format!(", {} of them because they failed", cases.failures);
    }
    match verdict {
        Verdict::Pass | Verdict::Fail => {}
        Verdict::Incomplete if cases.len() == 0 => text = "no case is present".into(),
        Verdict::Incomplete if cases.failures == cases.len() => {
            text = format!("every one of {} cases failed", cases.len());
        }
        Verdict::Incomplete => {}
        Verdict::Inconclusive => {
            let count = |number: Option<u64>| {
                number.map_or("no number of".to_string(), |number| number.to_string())
            };
            text += &format!("; a pass needs {} more {what}", count(needed.if_good));
            if cases.violations > 0 {
                text += &format!(
                    " if all of them are good, {} at the observed rate",
                    count(needed.at_rate)
                );
            }
            if cases.len() < gate.min_cases {
                text += &format!(" (at least {} in all)", gate.min_cases);
            }
        }
    }
    if missing > 0 {
        text += &format!("; {missing} planned {what} are missing");
    }
    text
}

#[cfg(test)]
mod tests;
