//! Verdicts of gates on planted cases.

use super::super::outcome::Report;
use super::super::source::{Metric, NestedPlan, Population, Table};
use super::*;
use crate::gate::{Region, parse};
use crate::problem::Kind;
use crate::stats::Drawing;

/// A run with one value a case for `damping_ratio`, `time_to_double_s` and `mass_kg`.
struct Planted {
    values: Vec<Result<Option<f64>, String>>,
    planned: u64,
    drawing: Drawing,
    nested: Option<NestedPlan>,
    searched: Option<Searched>,
}

impl Planted {
    fn new(values: Vec<Result<Option<f64>, String>>) -> Self {
        let planned = values.len() as u64;
        let drawing = Drawing::Independent;
        Self { values, planned, drawing, nested: None, searched: None }
    }

    /// `n` good cases, the first `bad` of them at −0.01 and the others at 0.01.
    fn of(n: usize, bad: usize) -> Self {
        Self::new((0..n).map(|i| Ok(Some(if i < bad { -0.01 } else { 0.01 }))).collect())
    }
}

impl Names for Planted {
    fn metrics(&self) -> Vec<Metric> {
        [
            ("damping_ratio", "1", Table::Modes, MissingMeans::NoValue),
            ("time_to_double_s", "s", Table::Modes, MissingMeans::NotApplicableGood),
            ("pole_re_rad_s", "rad/s", Table::Modes, MissingMeans::NoValue),
            ("mass_kg", "kg", Table::Cases, MissingMeans::NoValue),
        ]
        .into_iter()
        .map(|(name, unit, table, missing)| Metric {
            name: name.into(),
            unit: unit.into(),
            table,
            missing,
        })
        .collect()
    }

    fn populations(&self) -> Vec<Population> {
        vec![
            Population {
                name: "nominal".into(),
                planned: 1,
                drawing: Drawing::Designed,
                nested: None,
            },
            Population {
                name: "dispersed".into(),
                planned: self.planned,
                drawing: self.drawing,
                nested: self.nested,
            },
        ]
    }

    fn variants(&self) -> Vec<String> {
        vec!["no_jet_damping".into(), "jet_damping".into()]
    }

    fn flight_times_s(&self) -> Vec<f64> {
        vec![105.0, 110.0]
    }

    fn modes(&self) -> Vec<String> {
        vec!["tvse".into()]
    }
}

impl Source for Planted {
    fn worst(
        &self,
        query: &Query<'_>,
        region: Region,
        sigma: f64,
    ) -> Result<Option<Searched>, Problems> {
        assert_eq!((query.variant, query.mode), (Some("jet_damping"), Some("tvse")));
        Ok(self.searched.clone().filter(|_| region == Region::Box && sigma == 3.0))
    }

    fn visit(
        &self,
        query: &Query<'_>,
        visit: &mut dyn FnMut(CaseValue) -> Result<(), Problems>,
    ) -> Result<(), Problems> {
        let take = if query.population == "nominal" { 1 } else { self.values.len() };
        let values = self.values.iter().take(take).cloned();
        (0..).zip(values).try_for_each(|(case, value)| visit(CaseValue { case, value }))
    }
}

const HEAD: &str = r#"
[[gate]]
id = "g"
metric = "damping_ratio"
variant = "jet_damping"
mode = "tvse"
rationale = "because"
"#;

fn evaluate_text(text: &str, source: &Planted) -> Vec<Outcome> {
    evaluate(&parse(text, "gates.toml").unwrap(), source, "gates.toml").unwrap()
}

fn one(keys: &str, source: &Planted) -> Outcome {
    evaluate_text(&format!("{HEAD}{keys}"), source).remove(0)
}

const MINIMUM: &str = "statistic = 'minimum'\nat_least_1 = 0.0";
const SHARE: &str =
    "statistic = 'share_below'\nthreshold_1 = 0.0\nat_most_percent = 5\nconfidence = 0.95";
const TOLERANCE: &str =
    "statistic = 'tolerance_bound'\ncoverage = 0.9973\nrisk = 0.10\nat_least_1 = 0.0";

#[test]
fn consumers_risk_allows_two_exceedances_in_two_thousand() {
    for (bad, verdict) in [
        (0, Verdict::Pass),
        (2, Verdict::Pass),
        (3, Verdict::Inconclusive),
        (5, Verdict::Inconclusive),
        // P(X ≥ 8 | 2000, 0.0027) = 0.178, P(X ≥ 9) = 0.0971.
        (8, Verdict::Inconclusive),
        (9, Verdict::Fail),
    ] {
        let outcome = one(TOLERANCE, &Planted::of(2000, bad));
        assert_eq!(outcome.verdict, verdict, "{bad} exceedances");
        assert_eq!(outcome.most_violations, Some(2));
        assert_eq!(outcome.violations, bad as u64);
        assert_eq!(outcome.bound, Some(if bad <= 2 { 0.01 } else { -0.01 }));
        assert_eq!(outcome.confidence, Some(0.9));
    }
}

#[test]
fn an_inconclusive_gate_says_how_many_cases_it_lacks() {
    // verification table: 1970 for 2 exceedances, 2473 for 3, at 99.73 % and 10 %.
    let outcome = one(TOLERANCE, &Planted::of(2000, 3));
    assert_eq!(outcome.cases_needed, Some(473));
    // Rate 3/2000 below 0.0027: enough cases show it.
    let further = outcome.cases_needed_at_observed_rate.unwrap();
    let (total, rate) = (2000 + further, 3.0 / 2000.0);
    let coverage = Probability::new(0.9973).unwrap();
    let risk = crate::stats::Confidence::from_risk(0.1).unwrap();
    let most = stats::most_exceedances(total, coverage, risk, Tails::One).unwrap();
    assert!(rate * total as f64 <= most as f64);
    assert!(outcome.message.contains("473"));
    // Rate above it: never.
    let outcome = one(TOLERANCE, &Planted::of(2000, 6));
    assert_eq!(outcome.cases_needed_at_observed_rate, None);
    // Too few cases for any bound.
    let outcome = one(TOLERANCE, &Planted::of(100, 0));
    assert_eq!(outcome.verdict, Verdict::Inconclusive);
    assert_eq!((outcome.cases_needed, outcome.bound), (Some(752), None));
}

#[test]
fn a_share_is_judged_by_its_exact_bound_not_by_its_point() {
    // At 95 %: 59 cases without a violation show at most 5 %, 58 do not.
    assert_eq!(one(SHARE, &Planted::of(59, 0)).verdict, Verdict::Pass);
    let outcome = one(SHARE, &Planted::of(58, 0));
    assert_eq!((outcome.verdict, outcome.cases_needed), (Verdict::Inconclusive, Some(1)));
    assert_eq!(outcome.value, Some(0.0));
    // Its bound 1 − 0.05^(1/58) in percent.
    assert!((outcome.bound.unwrap() - 100.0 * (1.0 - 0.05_f64.powf(1.0 / 58.0))).abs() < 1e-10);
    // 4 % observed of 100 is under the limit and yet no pass.
    assert_eq!(one(SHARE, &Planted::of(100, 4)).verdict, Verdict::Inconclusive);
    // 69 % of 2000 is a clear fail.
    let outcome = one(SHARE, &Planted::of(2000, 1380));
    assert_eq!((outcome.verdict, outcome.value), (Verdict::Fail, Some(69.0)));
    assert_eq!(outcome.offenders.len(), Outcome::OFFENDERS);
}

#[test]
fn a_share_that_must_be_large_mirrors_one_that_must_be_small() {
    let above = "statistic = 'share_above'\nthreshold_1 = 0.0\nat_least_percent = 95\n\
                 confidence = 0.95";
    for bad in [0, 1, 2, 10, 30] {
        let small = one(SHARE, &Planted::of(93, bad));
        let large = one(above, &Planted::of(93, bad));
        assert_eq!(small.verdict, large.verdict, "{bad}");
        assert!((small.bound.unwrap() + large.bound.unwrap() - 100.0).abs() < 1e-9);
    }
}

#[test]
fn a_quantile_gate_is_the_tolerance_bound_of_the_other_share() {
    let quantile = "statistic = 'quantile'\nquantile = 0.0027\nrisk = 0.10\nat_least_1 = 0.0";
    for bad in [0, 2, 3, 9, 10] {
        let (a, b) =
            (one(quantile, &Planted::of(2000, bad)), one(TOLERANCE, &Planted::of(2000, bad)));
        assert_eq!((a.verdict, a.bound, a.value), (b.verdict, b.bound, b.value));
    }
}

#[test]
fn a_minimum_fails_by_a_single_case_and_names_it() {
    let mut run = Planted::of(50, 0);
    assert_eq!(one(MINIMUM, &run).verdict, Verdict::Pass);
    run.values[31] = Ok(Some(-0.002));
    let outcome = one(MINIMUM, &run);
    assert_eq!(outcome.verdict, Verdict::Fail);
    assert_eq!((outcome.worst_case, outcome.worst_value), (Some(31), Some(-0.002)));
    assert_eq!((outcome.value, outcome.offenders[0].case), (Some(-0.002), 31));
}

#[test]
fn a_limit_in_percent_is_shown_in_percent() {
    let mut run = Planted::of(10, 0);
    run.values[3] = Ok(Some(0.004));
    let outcome = one("statistic = 'minimum'\nat_least_percent = 0.5", &run);
    assert_eq!((outcome.verdict, outcome.value), (Verdict::Fail, Some(0.4)));
    assert_eq!((outcome.limit, outcome.unit.as_str()), (0.5, "percent"));
}

#[test]
fn failed_cases_and_nan_count_as_violations() {
    for bad in [Err("singular_mass".to_string()), Ok(Some(f64::NAN)), Ok(None)] {
        let mut run = Planted::of(2000, 0);
        run.values[7] = bad.clone();
        let outcome = one(MINIMUM, &run);
        assert_eq!(outcome.verdict, Verdict::Fail, "{bad:?}");
        assert_eq!((outcome.failures, outcome.violations), (1, 1));
        assert_eq!(outcome.value, None);
        assert!(outcome.offenders[0].failure.is_some());
        assert_eq!(one(TOLERANCE, &run).verdict, Verdict::Pass);
        for case in 8..10 {
            run.values[case] = bad.clone();
        }
        assert_eq!(one(TOLERANCE, &run).verdict, Verdict::Inconclusive, "{bad:?}");
        for case in 10..20 {
            run.values[case] = bad.clone();
        }
        assert_eq!(one(TOLERANCE, &run).verdict, Verdict::Fail, "{bad:?}");
        assert_eq!(one(TOLERANCE, &run).bound, None);
    }
}

#[test]
fn no_time_to_double_is_good_and_not_missing() {
    let text = r#"
[[gate]]
id = "time-to-double"
metric = "time_to_double_s"
variant = "jet_damping"
statistic = "minimum"
at_least_s = 5
rationale = "slow enough"
"#;
    let mut run = Planted::new(vec![Ok(None), Ok(Some(7.4)), Ok(None)]);
    let outcome = evaluate_text(text, &run).remove(0);
    assert_eq!((outcome.verdict, outcome.value), (Verdict::Pass, Some(7.4)));
    run.values[2] = Ok(Some(3.0));
    assert_eq!(evaluate_text(text, &run)[0].verdict, Verdict::Fail);
    // Every case stable: a pass, although there is no value.
    let outcome = evaluate_text(text, &Planted::new(vec![Ok(None); 5])).remove(0);
    assert_eq!((outcome.verdict, outcome.value), (Verdict::Pass, None));
}

#[test]
fn nothing_evaluated_is_incomplete_and_missing_cases_never_pass() {
    for keys in [MINIMUM, SHARE, TOLERANCE] {
        let empty = Planted::new(vec![]);
        assert_eq!(one(keys, &empty).verdict, Verdict::Incomplete);
        let failed = Planted::new(vec![Err("draw".into()); 3000]);
        assert_eq!(one(keys, &failed).verdict, Verdict::Incomplete);
        let mut partial = Planted::of(3000, 0);
        assert_eq!(one(keys, &partial).verdict, Verdict::Pass);
        partial.planned = 3001;
        let outcome = one(keys, &partial);
        assert_eq!((outcome.verdict, outcome.missing), (Verdict::Incomplete, 1));
        // What the present cases show already is not hidden by those missing.
        let mut failing = Planted::of(3000, 2900);
        failing.planned = 3001;
        assert_eq!(one(keys, &failing).verdict, Verdict::Fail);
    }
}

#[test]
fn fewer_cases_than_asked_for_do_not_pass_but_may_fail() {
    let keys = format!("{MINIMUM}\nmin_cases = 100");
    let outcome = one(&keys, &Planted::of(60, 0));
    assert_eq!((outcome.verdict, outcome.cases_needed), (Verdict::Inconclusive, Some(40)));
    assert_eq!(one(&keys, &Planted::of(60, 1)).verdict, Verdict::Fail);
    assert_eq!(one(&keys, &Planted::of(100, 0)).verdict, Verdict::Pass);
}

#[test]
fn exact_bounds_are_refused_to_cases_that_are_not_independent_draws() {
    let mut run = Planted::of(2000, 0);
    for drawing in [Drawing::LatinHypercube, Drawing::LowDiscrepancy, Drawing::Selected] {
        run.drawing = drawing;
        for keys in [SHARE, TOLERANCE] {
            let gates = parse(&format!("{HEAD}{keys}"), "gates.toml").unwrap();
            let problems = evaluate(&gates, &run, "gates.toml").unwrap_err();
            assert!(problems.to_string().contains("independent"), "{problems}");
            assert_eq!(problems.kind(), Kind::Input);
        }
        assert_eq!(one(MINIMUM, &run).verdict, Verdict::Pass);
    }
    let nominal = one(&format!("{MINIMUM}\npopulation = 'nominal'"), &run);
    assert_eq!((nominal.verdict, nominal.cases), (Verdict::Pass, 1));
}

#[test]
fn names_a_run_does_not_have_are_errors_with_near_misses_all_at_once() {
    let text = r#"
[[gate]]
id = "a"
metric = "dampin_ratio"
variant = "jet_dampin"
population = "disperse"
mode = "tvsee"
flight_times_s = [110, 111]
statistic = "minimum"
at_least_1 = 0
rationale = "r"
[[gate]]
id = "b"
metric = "time_to_double_s"
statistic = "minimum"
at_least_1 = 0
baseline = "no_jet_damping"
rationale = "r"
[[gate]]
id = "c"
metric = "mass_kg"
variant = "jet_damping"
statistic = "maximum"
at_most_kg = 1
rationale = "r"
[[gate]]
id = "d"
metric = "pole_re_rad_s"
variant = "jet_damping"
statistic = "maximum"
at_most_rad_s = 1
rationale = "r"
"#;
    let gates = parse(text, "gates.toml").unwrap();
    let problems = evaluate(&gates, &Planted::of(3, 0), "gates.toml").unwrap_err();
    let keys: Vec<&str> = problems.0.iter().map(|problem| problem.key.as_str()).collect();
    assert_eq!(
        keys,
        [
            "gate[0].population",
            "gate[0].variant",
            "gate[0].mode",
            "gate[0].flight_times_s",
            "gate[0].metric",
            "gate[1].variant",
            "gate[1].baseline",
            "gate[1].limit",
            "gate[2].variant",
        ]
    );
    let metric = &problems.0[4];
    assert!(metric.allowed.contains("did you mean `damping_ratio`?"), "{}", metric.allowed);
    assert!(problems.0[7].allowed.starts_with("s, the unit of"));
}

#[test]
fn cases_twice_or_beyond_the_plan_are_damage() {
    let mut run = Planted::of(5, 0);
    run.planned = 4;
    let gates = parse(&format!("{HEAD}{MINIMUM}"), "gates.toml").unwrap();
    assert_eq!(evaluate(&gates, &run, "gates.toml").unwrap_err().kind(), Kind::Damage);
}

#[test]
fn a_report_has_the_combined_verdict_and_follows_its_schema() {
    let text = format!("{HEAD}{MINIMUM}\n{}{SHARE}", HEAD.replace("\"g\"", "\"h\""));
    let report = Report::new(evaluate_text(&text, &Planted::of(30, 0)));
    assert_eq!((report.verdict, report.exit_code), (Verdict::Inconclusive, 4));
    assert_eq!(report.claims_at_once, 1);
    let json: serde_json::Value = serde_json::from_str(&report.to_json()).unwrap();
    let schema = serde_json::to_value(super::super::outcome::report_schema()).unwrap();
    let required = schema["$defs"]["Outcome"]["required"].as_array().unwrap();
    for gate in json["gates"].as_array().unwrap() {
        let keys: Vec<&String> = gate.as_object().unwrap().keys().collect();
        assert_eq!(keys.len(), required.len());
        assert!(keys.iter().all(|key| required.contains(&key.as_str().into())));
    }
    assert_eq!(json["gates"][1]["verdict"], "inconclusive");
    let empty = Report::new(vec![]);
    assert_eq!((empty.verdict, empty.exit_code), (Verdict::Incomplete, 3));
}

const NESTED: &str =
    "statistic = 'nested_statement'\nthreshold_1 = 0.0\nat_least_percent = 50\nconfidence = 0.9";

/// Outer draws of 30 cases, with so many bad ones; a tenth may be bad at a risk of a tenth.
fn outer(bad: &[usize]) -> Planted {
    let cases = bad.iter().flat_map(|bad| Planted::of(30, *bad).values);
    let nested = Some(NestedPlan { inner: 30, allowed_share: 0.1, risk: 0.1 });
    Planted { drawing: Drawing::Nested, nested, ..Planted::new(cases.collect()) }
}

#[test]
fn a_nested_gate_counts_outer_draws_whose_statement_is_shown() {
    // 0.9^30 = 0.042 and P(X ≤ 1) = 0.184: only an outer draw without a bad case shows it.
    let outcome = one(NESTED, &outer(&[0, 0, 1, 0, 0, 0]));
    assert_eq!((outcome.cases, outcome.violations), (6, 1));
    assert!((outcome.value.unwrap() - 500.0 / 6.0).abs() < 1e-9);
    // P(X ≤ 1 | 6, 0.5) = 7/64 > 0.1; seven with one: 8/128.
    assert_eq!(outcome.verdict, Verdict::Inconclusive);
    assert!(outcome.message.contains("1 of 6 outer draws"), "{}", outcome.message);
    let outcome = one(NESTED, &outer(&[0, 0, 2, 0, 0, 0, 0]));
    assert_eq!((outcome.verdict, outcome.confidence), (Verdict::Pass, Some(0.9)));
    // The outer draw is called by its first case, with the share of its bad ones.
    assert_eq!((outcome.worst_case, outcome.worst_value), (Some(60), Some(2.0 / 30.0)));
    assert_eq!(one(NESTED, &outer(&[9; 7])).verdict, Verdict::Fail);
    // A failed case is bad, and an outer draw that is not whole is missing.
    let mut failed = outer(&[0; 7]);
    failed.values[0] = Err("draw".into());
    assert_eq!(one(NESTED, &failed).violations, 1);
    let mut part = outer(&[0; 7]);
    part.values.truncate(200);
    let outcome = one(NESTED, &part);
    assert_eq!((outcome.verdict, outcome.missing, outcome.cases), (Verdict::Incomplete, 1, 6));
}

#[test]
fn a_nested_gate_needs_a_nested_plan_and_a_limit_from_below() {
    let text = format!("{HEAD}{NESTED}");
    let gates = parse(&text, "gates.toml").unwrap();
    let problems = evaluate(&gates, &Planted::of(60, 0), "gates.toml").unwrap_err();
    assert!(problems.to_string().contains("a population with a nested plan"), "{problems}");
    let problems = parse(&text.replace("at_least", "at_most"), "gates.toml").unwrap_err();
    assert!(problems.to_string().contains("gate[0].limit"), "{problems}");
}

const WORST: &str =
    "statistic = 'worst_on_worst'\nregion = 'box'\nsigma = 3\nat_least_percent = 1.0";

#[test]
fn a_worst_on_worst_gate_holds_the_worst_case_found_and_what_the_search_left() {
    let with = |value: f64, at_worst: f64| {
        let (value, at_worst) = (Some(value), Some(at_worst));
        let searched = Some(Searched { name: "a_box".into(), value, at_worst, cases: 3 });
        Planted { searched, ..Planted::of(10, 10) }
    };
    let outcome = one(WORST, &with(0.012, 0.011));
    assert_eq!((outcome.verdict, outcome.confidence), (Verdict::Pass, None));
    assert_eq!((outcome.value, outcome.cases), (Some(1.2), 3));
    assert!(outcome.message.contains("--worst a_box"), "{}", outcome.message);
    assert_eq!(one(WORST, &with(0.012, 0.009)).verdict, Verdict::Inconclusive);
    assert_eq!(one(WORST, &with(0.009, 0.009)).verdict, Verdict::Fail);
    assert_eq!(one(WORST, &with(f64::NAN, f64::NAN)).verdict, Verdict::Fail);
    // Nothing was searched, or elsewhere: no pass.
    assert_eq!(one(WORST, &Planted::of(10, 0)).verdict, Verdict::Incomplete);
    let other = WORST.replace("box", "ellipsoid");
    assert_eq!(one(&other, &with(0.5, 0.5)).verdict, Verdict::Incomplete);
    // A stable worst case has no time to double.
    let stable = Planted {
        searched: Some(Searched { name: "a".into(), value: None, at_worst: None, cases: 1 }),
        ..Planted::of(1, 0)
    };
    let text = format!("{HEAD}{}", WORST.replace("percent = 1.0", "s = 5"))
        .replace("damping_ratio", "time_to_double_s");
    assert_eq!(evaluate_text(&text, &stable)[0].verdict, Verdict::Pass);
}

#[test]
fn a_worst_on_worst_gate_says_which_search_it_means() {
    let problems = parse(&format!("{HEAD}{}", "statistic = 'worst_on_worst'\nat_least_1 = 0"), "g");
    let text = problems.unwrap_err().to_string();
    assert!(text.contains("gate[0].region") && text.contains("gate[0].sigma"), "{text}");
    let text = format!("{HEAD}{WORST}").replace("damping_ratio", "pole_re_rad_s");
    let gates = parse(&text.replace("percent", "rad_s"), "g").unwrap();
    let problems = evaluate(&gates, &Planted::of(1, 0), "g").unwrap_err();
    assert!(problems.to_string().contains("what tvse worst searches"), "{problems}");
    let problems = parse(&format!("{HEAD}{MINIMUM}\nregion = 'box'"), "g").unwrap_err();
    assert!(problems.to_string().contains("gate[0].region"), "{problems}");
}
