//! Gates against what a run has: its metrics, populations, variants, flight times and modes.
//!
//! Only names, units and the way the cases came about; values are looked at in `evaluate`.

use super::rule::{Gate, Quantity, Sense, Statistic};
use super::source::{Metric, MissingMeans, Names, Population, Table};
use crate::problem::Problems;
use crate::spelling::allowed_instead;
use crate::stats::{self, Confidence, Independent, Probability, Tails};

/// What a run has.
pub(super) struct Run {
    metrics: Vec<Metric>,
    populations: Vec<Population>,
    variants: Vec<String>,
    flight_times_s: Vec<f64>,
    modes: Vec<String>,
    baseline: Option<Box<Run>>,
}

impl Run {
    pub(super) fn of(source: &(impl Names + ?Sized)) -> Self {
        Self {
            metrics: source.metrics(),
            populations: source.populations(),
            variants: source.variants(),
            flight_times_s: source.flight_times_s(),
            modes: source.modes(),
            baseline: source.baseline().map(|other| Box::new(Self::of(other))),
        }
    }
}

/// A gate with what it needs of the run.
pub(super) struct Plan<'a> {
    pub metric: &'a Metric,
    pub population: &'a Population,
    pub claim: Claim,
}

/// What is asked of the cases.
pub(super) enum Claim {
    /// No case breaks the limit.
    Every,
    /// No case that a search found breaks it.
    Searched,
    /// At most `allowed` of the population breaks it; `outer`: of the outer draws.
    Share {
        allowed: Probability,
        confidence: Confidence,
        independent: Independent,
        outer: Option<Outer>,
    },
}

/// What is asked of each outer draw of a nested plan.
#[derive(Clone, Copy)]
pub(super) struct Outer {
    /// Its cases.
    pub inner: u64,
    /// The most of them that may be bad; none where even none would show nothing.
    pub most: Option<u64>,
}

/// A plan for each gate, or everything that the run does not have.
pub(super) fn resolve<'a>(
    gates: &[Gate],
    run: &'a Run,
    file: &str,
) -> Result<Vec<Plan<'a>>, Problems> {
    let mut problems = Problems::default();
    let mut plans = Vec::new();
    for (index, gate) in gates.iter().enumerate() {
        let mut check = Check { file, index, problems: Problems::default() };
        plans.extend(check.resolve(gate, run));
        problems.extend(check.problems);
    }
    problems.into_result(plans)
}

struct Check<'a> {
    file: &'a str,
    index: usize,
    problems: Problems,
}

impl Check<'_> {
    fn problem(&mut self, key: &str, found: impl Into<String>, allowed: impl Into<String>) {
        let path = format!("gate[{}].{key}", self.index);
        self.problems.extend(Problems::input(self.file, path, found, allowed));
    }

    fn known(&mut self, key: &str, name: Option<&String>, names: &[String]) {
        if let Some(name) = name
            && !names.contains(name)
        {
            self.problem(
                key,
                format!("{name:?}"),
                allowed_instead(name, names.iter().map(|n| n.as_ref())),
            );
        }
    }

    fn unit(&mut self, key: &str, quantity: &Quantity, metric: &Metric) {
        let unit = column_unit(&metric.unit);
        let allowed =
            if unit == "1" { vec!["1".to_string(), "percent".into()] } else { vec![unit] };
        if !allowed.contains(&quantity.unit) {
            let allowed = format!("{}, the unit of {}", allowed.join(" or "), metric.name);
            self.problem(key, format!("unit {}", quantity.unit), allowed);
        }
    }

    fn resolve<'a>(&mut self, gate: &Gate, run: &'a Run) -> Option<Plan<'a>> {
        let (metric, population) = self.names(gate, run);
        if gate.selection.baseline_run {
            self.baseline_run(gate, run);
        }
        let claim = population.and_then(|population| self.claim(gate, population));
        let plan = Plan { metric: metric?, population: population?, claim: claim? };
        self.problems.0.is_empty().then_some(plan)
    }

    /// What a gate on the difference to the baseline run needs of that run.
    fn baseline_run(&mut self, gate: &Gate, run: &Run) {
        let Some(baseline) = &run.baseline else {
            let allowed = "a baseline run, which `tvse gate RUN --baseline OTHER` and `tvse compare RUN \
                           OTHER --gates FILE` name";
            self.problem("baseline_run", "no baseline run", allowed);
            return;
        };
        let before = self.problems.0.len();
        self.names(gate, baseline);
        for problem in &mut self.problems.0[before..] {
            problem.found += " for the baseline run";
        }
    }

    /// The metric and the population of a gate, and everything it names that the run does not have.
    fn names<'a>(
        &mut self,
        gate: &Gate,
        run: &'a Run,
    ) -> (Option<&'a Metric>, Option<&'a Population>) {
        let selection = &gate.selection;
        let populations: Vec<String> = run.populations.iter().map(|p| p.name.clone()).collect();
        self.known("population", Some(&selection.population), &populations);
        self.known("variant", selection.variant.as_ref(), &run.variants);
        self.known("baseline", selection.baseline.as_ref(), &run.variants);
        self.known("mode", selection.mode.as_ref(), &run.modes);
        for time in selection.flight_times_s.iter().flatten() {
            if !run.flight_times_s.contains(time) {
                let times = run.flight_times_s.iter().map(f64::to_string).collect::<Vec<_>>();
                let allowed = format!("one of {}", times.join(", "));
                self.problem("flight_times_s", time.to_string(), allowed);
            }
        }
        let metric = run.metrics.iter().find(|metric| metric.name == gate.metric);
        let population = run.populations.iter().find(|p| p.name == selection.population);
        if let Some(metric) = metric {
            self.rows(gate, metric);
            match &gate.statistic {
                Statistic::ShareBelow { threshold, .. }
                | Statistic::ShareAbove { threshold, .. }
                | Statistic::NestedStatement { threshold, .. } => {
                    self.unit("threshold", threshold, metric);
                }
                _ => self.unit("limit", &gate.limit.quantity, metric),
            }
        } else {
            let names: Vec<String> = run.metrics.iter().map(|m| m.name.clone()).collect();
            self.problem(
                "metric",
                format!("{:?}", gate.metric),
                allowed_instead(&gate.metric, names.iter().map(|n| n.as_ref())),
            );
        }
        (metric, population)
    }

    /// Selections that the table of the metric needs or does not have.
    fn rows(&mut self, gate: &Gate, metric: &Metric) {
        let selection = &gate.selection;
        match metric.table {
            Table::Modes if selection.variant.is_none() => {
                self.problem(
                    "variant",
                    "nothing",
                    format!("a variant: {} is one of each", metric.name),
                );
            }
            Table::Modes => {}
            Table::Cases => {
                for (key, given) in [
                    ("variant", selection.variant.is_some()),
                    ("baseline", selection.baseline.is_some()),
                    ("flight_times_s", selection.flight_times_s.is_some()),
                    ("mode", selection.mode.is_some()),
                ] {
                    if given {
                        let allowed = format!("nothing: a case has one {}", metric.name);
                        self.problem(key, "a value", allowed);
                    }
                }
            }
        }
        if matches!(gate.statistic, Statistic::WorstOnWorst { .. }) {
            let searched = ["damping_ratio", "time_to_double_s"];
            if metric.table != Table::Modes || !searched.contains(&metric.name.as_str()) {
                let allowed = format!("{}: what tvse worst searches", searched.join(" or "));
                self.problem("metric", &metric.name, allowed);
            }
        }
        let paired = selection.baseline.is_some() || selection.baseline_run;
        if paired && metric.missing == MissingMeans::NotApplicableGood {
            let found = format!("a difference of {}", metric.name);
            self.problem("baseline", found, "a metric that every evaluation has");
        }
    }

    fn claim(&mut self, gate: &Gate, population: &Population) -> Option<Claim> {
        let (allowed, confidence) = match gate.statistic {
            Statistic::Extreme => return Some(Claim::Every),
            Statistic::WorstOnWorst { .. } => return Some(Claim::Searched),
            Statistic::ShareBelow { confidence, .. }
            | Statistic::ShareAbove { confidence, .. }
            | Statistic::NestedStatement { confidence, .. } => {
                let limit = gate.limit.quantity.base();
                let allowed = match gate.limit.sense {
                    Sense::AtMost => limit,
                    Sense::AtLeast => 1.0 - limit,
                };
                (allowed, confidence)
            }
            Statistic::Quantile { level, confidence } => match gate.limit.sense {
                Sense::AtLeast => (level.get(), confidence),
                Sense::AtMost => (1.0 - level.get(), confidence),
            },
            Statistic::ToleranceBound { coverage, confidence } => {
                (1.0 - coverage.get(), confidence)
            }
        };
        let Ok(allowed) = Probability::new(allowed) else {
            self.problem(
                "limit",
                gate.limit.quantity.value.to_string(),
                "a share above 0 and below 100 %",
            );
            return None;
        };
        if let Statistic::NestedStatement { .. } = gate.statistic {
            return self.outer(population, allowed, confidence);
        }
        match population.drawing.independent() {
            Ok(independent) => Some(Claim::Share { allowed, confidence, independent, outer: None }),
            Err(error) => {
                self.problem(
                    "statistic",
                    error.to_string(),
                    "minimum or maximum, or a population of independent draws",
                );
                None
            }
        }
    }
}

impl Check<'_> {
    /// The claim on the outer draws of a nested plan, which are independent.
    fn outer(
        &mut self,
        population: &Population,
        allowed: Probability,
        confidence: Confidence,
    ) -> Option<Claim> {
        let Some(plan) = population.nested else {
            let found = format!("a population of {}", population.drawing.describe());
            self.problem("statistic", found, "a population with a nested plan");
            return None;
        };
        let coverage = Probability::new(1.0 - plan.allowed_share).ok()?;
        let risk = Confidence::from_risk(plan.risk).ok()?;
        let most = stats::most_exceedances(plan.inner, coverage, risk, Tails::One);
        let outer = Some(Outer { inner: plan.inner, most });
        match population.drawing.independent_replicates(population.planned / plan.inner.max(1)) {
            Ok(independent) => Some(Claim::Share { allowed, confidence, independent, outer }),
            Err(error) => {
                self.problem("statistic", error.to_string(), "two outer draws or more");
                None
            }
        }
    }
}

/// A unit as column names write it: `rad/s` → `rad_s`; no unit is `1`.
pub(super) fn column_unit(unit: &str) -> String {
    match unit {
        "" | "-" | "−" | "1" => "1".into(),
        unit => unit
            .chars()
            .flat_map(char::to_lowercase)
            .filter_map(|c| match c {
                '²' => Some('2'),
                '³' => Some('3'),
                '^' => None,
                c if c.is_ascii_alphanumeric() => Some(c),
                _ => Some('_'),
            })
            .collect(),
    }
}
