//! Worst cases as tables, as text, and as fixed cases of a run file.
//!
//! The numbers are those of `campaign::worst`.

use super::significant;
use super::statistics::{Rows, number};
use crate::campaign::worst::{Standing, WorstCase};
use crate::campaign::{Definition, DrawColumn};
use std::fmt::Write;

/// Keys shown of a case.
const KEYS: usize = 8;

/// One row per case, each with its standing to the sample.
pub fn cases(definition: &Definition, all: &[WorstCase], standing: &[Option<Standing>]) -> Rows {
    let mut rows = Rows::new(&[
        "name",
        "method",
        "flight_time_s",
        "objective",
        "damping_ratio",
        "frequency_hz",
        "time_to_double_s",
        "distance_sigma",
        "greatest_sigma",
        "log10_likelihood",
        "sample_as_bad",
        "sample_cases",
        "ranges_below_sample",
        "gap",
        "switches",
    ]);
    for (case, standing) in all.iter().zip(standing) {
        rows.push(vec![
            case.name.clone(),
            case.method.name().to_owned(),
            definition.flight_times_s[case.flight_time].to_string(),
            number(Some(case.objective)),
            number(Some(case.damping_ratio())),
            number(Some(case.pole[1].abs() / std::f64::consts::TAU)),
            number(case.time_to_double_s()),
            number(Some(case.distance())),
            number(Some(case.farthest())),
            number(Some(case.log10_likelihood())),
            standing.map_or_else(String::new, |s| s.worse.to_string()),
            standing.map_or_else(String::new, |s| s.cases.to_string()),
            number(standing.map(|s| s.ranges_below)),
            number(case.gap),
            case.switches.to_string(),
        ]);
    }
    rows
}

/// The table for people: what fits a screen.
pub fn text(definition: &Definition, all: &[WorstCase], standing: &[Option<Standing>]) -> String {
    let mut rows = Rows::new(&[
        "case",
        "time, s",
        "objective",
        "ζ, %",
        "double, s",
        "distance, σ",
        "log10 L/L0",
        "as bad in sample",
        "ranges below it",
    ]);
    for (case, standing) in all.iter().zip(standing) {
        rows.push(vec![
            case.name.clone(),
            definition.flight_times_s[case.flight_time].to_string(),
            number(Some(case.objective)),
            number(Some(100.0 * case.damping_ratio())),
            number(case.time_to_double_s()),
            number(Some(case.distance())),
            number(Some(case.log10_likelihood())),
            standing.map_or_else(String::new, |s| format!("{} of {}", s.worse, s.cases)),
            number(standing.map(|s| s.ranges_below)),
        ]);
    }
    rows.text()
}

/// One row per case and draw key that has a value.
pub fn parameters(draws: &[DrawColumn], all: &[WorstCase]) -> Rows {
    let mut rows =
        Rows::new(&["name", "key", "score_sigma", "value", "unit", "objective_per_sigma"]);
    for case in all {
        for &(draw, value) in &case.values {
            let of = &draws[draw];
            rows.push(vec![
                case.name.clone(),
                of.key.clone(),
                number(case.scores[draw]),
                number(Some(value)),
                of.unit.clone(),
                number(case.by_score.get(draw).copied()),
            ]);
        }
    }
    rows
}

/// Draws with their score and the share z ∂/∂z of the objective that is theirs, the most adverse first.
fn shares(case: &WorstCase) -> Vec<(usize, f64, f64)> {
    let share =
        |(draw, by): (usize, &f64)| Some((draw, case.scores[draw]?, case.scores[draw]? * by));
    let mut all: Vec<(usize, f64, f64)> =
        case.by_score.iter().enumerate().filter_map(share).collect();
    all.sort_by(|a, b| a.2.total_cmp(&b.2));
    all
}

/// The keys that make a case what it is: those with the greatest share z ∂/∂z of the objective.
pub fn keys(draws: &[DrawColumn], case: &WorstCase) -> String {
    let mut text = String::new();
    for (draw, score, share) in
        shares(case).into_iter().take(KEYS).filter(|(.., share)| *share < 0.0)
    {
        let key = &draws[draw].key;
        let share = significant(share);
        let _ = writeln!(text, "  {score:+.2} σ  {share:>10}  {key}");
    }
    text
}

/// Monte Carlo around the cases that were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Around {
    /// Cases of each.
    pub cases: u64,
    /// Keys that are held: those with the greatest shares of the objective.
    pub held: usize,
}

/// The cases as `[[fixed]]` tables of a run file; their values come back bit for bit.
pub fn fixed(draws: &[DrawColumn], all: &[WorstCase], around: Option<Around>) -> String {
    let mut text = String::from(
        "# Fixed cases found by tvse worst; append them to a run file. With `cases = N` and the keys to be\n\
         # drawn in `free`, Monte Carlo goes around them.\n",
    );
    for case in all {
        let _ = write!(
            text,
            "\n[[fixed]] # {}: damping ratio {}, {} sigma from the median\nname = \"{}\"\n",
            case.method.name(),
            significant(case.damping_ratio()),
            significant(case.distance()),
            case.name
        );
        if let Some(around) = around.filter(|_| !case.by_score.is_empty()) {
            let free = shares(case).into_iter().skip(around.held);
            let free: Vec<String> =
                free.map(|(draw, ..)| format!("\"{}\"", draws[draw].key)).collect();
            let _ = writeln!(text, "cases = {}\nfree = [{}]", around.cases, free.join(", "));
        }
        let _ = writeln!(text, "[fixed.values]");
        for &(draw, value) in &case.values {
            let _ = writeln!(text, "\"{}\" = {value:?}", draws[draw].key);
        }
    }
    text
}
