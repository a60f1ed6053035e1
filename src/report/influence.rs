//! The influence of draws on a mode as a table.
//!
//! The numbers are those of `campaign::influence`.

use super::statistics::{Rows, number};
use crate::campaign::DrawColumn;
use crate::campaign::influence::Influence;

/// Values of the damping ratio with one key at a low and at a high place, all else nominal.
pub type Tornado = Option<[f64; 2]>;

/// The ranking of the draws by what they do to a mode in a variant at a flight time.
pub struct Ranking<'a> {
    /// Variant.
    pub variant: &'a str,
    /// Flight time, s.
    pub flight_time_s: f64,
    /// Mode.
    pub mode: &'a str,
    /// Damping ratio of the nominal vehicle.
    pub nominal: Option<f64>,
    /// Low and high place of the tornado, σ.
    pub sigma: f64,
    /// Influences with their bars, the greatest first.
    pub all: Vec<(Influence, Tornado)>,
}

/// One row per ranking and draw, all numbers.
pub fn rows(draws: &[DrawColumn], rankings: &[Ranking<'_>]) -> Rows {
    let mut rows = Rows::new(&[
        "variant",
        "flight_time_s",
        "mode",
        "rank",
        "key",
        "mean_modulus",
        "mean_modulus_low",
        "mean_modulus_high",
        "mean",
        "mean_low",
        "mean_high",
        "standard_deviation",
        "share_linear",
        "total_index_bound",
        "tornado_sigma",
        "damping_ratio_nominal",
        "damping_ratio_at_low",
        "damping_ratio_at_high",
    ]);
    for ranking in rankings {
        for (rank, (of, tornado)) in ranking.all.iter().enumerate() {
            let end = |interval: Option<[f64; 2]>, side: usize| number(interval.map(|i| i[side]));
            rows.push(vec![
                ranking.variant.to_owned(),
                ranking.flight_time_s.to_string(),
                ranking.mode.to_owned(),
                (rank + 1).to_string(),
                draws[of.draw].key.clone(),
                number(Some(of.mean_modulus)),
                end(of.mean_modulus_interval, 0),
                end(of.mean_modulus_interval, 1),
                number(Some(of.mean)),
                end(of.mean_interval, 0),
                end(of.mean_interval, 1),
                number(of.standard_deviation),
                number(of.share),
                number(of.total_bound),
                number(Some(ranking.sigma)),
                number(ranking.nominal),
                end(*tornado, 0),
                end(*tornado, 1),
            ]);
        }
    }
    rows
}

/// What fits a screen, of the first draws, damping ratios in percent.
pub fn text(draws: &[DrawColumn], all: &[(Influence, Tornado)]) -> String {
    let mut rows = Rows::new(&[
        "key",
        "Δζ per σ, %",
        "95 % low",
        "95 % high",
        "sd, %",
        "linear share, %",
        "total ≤, %",
        "ζ at −, %",
        "ζ at +, %",
    ]);
    for (of, tornado) in all {
        let percent = |value: Option<f64>| number(value.map(|value| 100.0 * value));
        rows.push(vec![
            draws[of.draw].key.clone(),
            percent(Some(of.mean)),
            percent(of.mean_interval.map(|i| i[0])),
            percent(of.mean_interval.map(|i| i[1])),
            percent(of.standard_deviation),
            percent(of.share),
            percent(of.total_bound),
            percent(tornado.map(|t| t[0])),
            percent(tornado.map(|t| t[1])),
        ]);
    }
    rows.text()
}
