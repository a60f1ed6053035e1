//! Two finished runs on common draws: whether they are, and their difference as gates see it.
//!
//! A pair stands for its first run; the second, the baseline, is what is subtracted.
//! What differences are worth is decided in `campaign::statistics` and `gate`.

use super::run::Run;
use super::source::{Value, case_value, less_stable_values};
use crate::gate::{CaseValue, Names, Query, Region, Searched, Source, Table, reduce};
use crate::problem::Problems;
use std::ops::Range;

/// A run and the baseline it is compared with.
pub struct Pair<'a> {
    /// The run.
    pub run: &'a Run,
    /// The baseline.
    pub baseline: &'a Run,
}

/// What two runs have in common in a population.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Common {
    /// Cases.
    pub cases: u64,
    /// Draw keys, with equal values in every one of the cases.
    pub keys: usize,
    /// Draw keys that only one of them has.
    pub only: usize,
}

/// Draw columns read at once.
const AT_ONCE: usize = 4;
/// Cases read at once.
const CHUNK: u64 = 4096;

impl Pair<'_> {
    /// What the runs have in common in the population `name`; `names` are the runs as the user named
    /// them.
    ///
    /// # Errors
    /// Input: a population that one of them does not have, other plans, or a draw that differs, with
    /// its key and the first case. Damage in the tables.
    pub fn common(&self, name: &str, names: [&str; 2]) -> Result<Common, Problems> {
        let file = names.join(" and ");
        let find = |run: &Run| {
            let populations = &run.outline().definition.populations;
            populations.iter().position(|p| p.name == name)
        };
        let (Some(first), Some(second)) = (find(self.run), find(self.baseline)) else {
            return Err(Problems::input(file, name, "in one run only", "a population of both"));
        };
        let a = &self.run.outline().definition.populations[first];
        let b = &self.baseline.outline().definition.populations[second];
        if a.scheme != b.scheme || a.drawn != b.drawn {
            let found = format!("{}, and {}", a.scheme.describe(), b.scheme.describe());
            return Err(Problems::input(file, name, found, "the same plan"));
        }
        if a.cases != b.cases && !a.scheme.keeps_first_cases() {
            let found = format!("{} and {} cases", a.cases, b.cases);
            let allowed = "the same number: more cases change the first ones of this plan";
            return Err(Problems::input(file, name, found, allowed));
        }
        let cases = a.cases.min(b.cases);
        let mut pairs = Vec::new();
        for draw in &self.run.outline().draws {
            let others = &self.baseline.outline().draws;
            if let Some(other) = others.iter().find(|other| other.key == draw.key) {
                pairs.push((draw, other));
            }
        }
        for pairs in pairs.chunks(AT_ONCE) {
            let columns: Vec<&str> = pairs.iter().map(|(a, _)| a.column.as_str()).collect();
            let others: Vec<&str> = pairs.iter().map(|(_, b)| b.column.as_str()).collect();
            let mut known = Vec::new();
            self.run.cases(first, &columns, |case, values, _| {
                if case < cases {
                    known.extend_from_slice(values);
                }
                Ok(())
            })?;
            self.baseline.cases(second, &others, |case, values, _| {
                let from = case as usize * pairs.len();
                let here = known.get(from..from + pairs.len()).unwrap_or_default();
                for ((here, there), (draw, _)) in here.iter().zip(values).zip(pairs) {
                    if here.to_bits() != there.to_bits() {
                        let found = format!("{here} and {there} in case {case}");
                        let allowed = "the same draws: one seed, one plan, one law for each key";
                        return Err(Problems::input(file.clone(), &draw.key, found, allowed));
                    }
                }
                Ok(())
            })?;
        }
        let all = self.run.outline().draws.len() + self.baseline.outline().draws.len();
        Ok(Common { cases, keys: pairs.len(), only: all - 2 * pairs.len() })
    }

    /// The values of both runs, row by row, for a range of cases.
    fn rows(&self, query: &Query<'_>, cases: Range<u64>) -> Result<[Cases; 2], Problems> {
        let definition = &self.run.outline().definition;
        let mut chosen = Vec::new();
        for time in &definition.flight_times_s {
            for mode in &definition.modes {
                if query.flight_times_s.is_none_or(|times| times.contains(time))
                    && query.mode.is_none_or(|name| name == mode)
                {
                    chosen.push((*time, mode.clone()));
                }
            }
        }
        let of = |run: &Run| {
            let definition = &run.outline().definition;
            let variant = definition.variants.iter().position(|v| Some(&*v.name) == query.variant);
            let variant = variant.expect("gates ask for variants that both runs have");
            let rows = (population(run, query), cases.clone());
            less_stable_values(run, rows, query.metric, variant, &chosen)
        };
        Ok([of(self.run)?, of(self.baseline)?])
    }

    /// Values of the table of cases: one a case.
    fn numbers(&self, query: &Query<'_>) -> Result<[Cases; 2], Problems> {
        let of = |run: &Run| {
            let mut found = Vec::new();
            run.cases(population(run, query), &[&query.metric.name], |case, values, failure| {
                found.push((case, vec![case_value(values, failure)]));
                Ok(())
            })?;
            Ok::<_, Problems>(found)
        };
        Ok([of(self.run)?, of(self.baseline)?])
    }
}

/// The values of cases that are present, in their order.
type Cases = Vec<(u64, Vec<Value>)>;

fn population(run: &Run, query: &Query<'_>) -> usize {
    let populations = &run.outline().definition.populations;
    let found = populations.iter().position(|p| p.name == query.population);
    found.expect("gates ask for populations that both runs have")
}

/// Hands the reduced differences of the cases that both have to `visit`.
fn subtract(
    [here, there]: [Cases; 2],
    query: &Query<'_>,
    visit: &mut dyn FnMut(CaseValue) -> Result<(), Problems>,
) -> Result<(), Problems> {
    let mut there = there.into_iter().peekable();
    for (case, here) in here {
        while there.next_if(|(other, _)| *other < case).is_some() {}
        let Some((_, baseline)) = there.next_if(|(other, _)| *other == case) else { continue };
        let differences = here.into_iter().zip(baseline).map(|(here, baseline)| {
            let baseline = baseline.map_err(|failure| format!("baseline run: {failure}"));
            match (here?, baseline?) {
                (Some(here), Some(baseline)) => Ok(Some(here - baseline)),
                _ => Err(format!("{} has no value to compare", query.metric.name)),
            }
        });
        visit(CaseValue { case, value: reduce(differences, query.metric, query.worst) })?;
    }
    Ok(())
}

impl Names for Pair<'_> {
    fn metrics(&self) -> Vec<crate::gate::Metric> {
        self.run.metrics()
    }

    fn populations(&self) -> Vec<crate::gate::Population> {
        self.run.populations()
    }

    fn variants(&self) -> Vec<String> {
        self.run.variants()
    }

    fn flight_times_s(&self) -> Vec<f64> {
        self.run.flight_times_s()
    }

    fn modes(&self) -> Vec<String> {
        Names::modes(self.run)
    }

    fn baseline(&self) -> Option<&dyn Names> {
        Some(self.baseline)
    }
}

impl Source for Pair<'_> {
    fn worst(
        &self,
        query: &Query<'_>,
        region: Region,
        sigma: f64,
    ) -> Result<Option<Searched>, Problems> {
        self.run.worst(query, region, sigma)
    }

    fn visit(
        &self,
        query: &Query<'_>,
        visit: &mut dyn FnMut(CaseValue) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        if !query.baseline_run {
            return self.run.visit(query, visit);
        }
        if query.metric.table == Table::Cases {
            return subtract(self.numbers(query)?, query, visit);
        }
        let planned = self.run.outline().definition.populations[population(self.run, query)].cases;
        for from in (0..planned).step_by(CHUNK as usize) {
            subtract(self.rows(query, from..planned.min(from + CHUNK))?, query, visit)?;
        }
        Ok(())
    }
}
