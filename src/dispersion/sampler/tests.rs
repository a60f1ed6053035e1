//! Draws depend on seed, key and case alone, follow their laws, and combine as documented.

use super::super::fixture::vehicle;
use super::super::resolve::resolve;
use super::super::stream::Stream;
use super::super::table::Table;
use super::*;
use crate::dispersion::{Place, Quantity};

fn dispersion(text: &str) -> Dispersion {
    let table: Table = toml::from_str(text).unwrap();
    resolve(&table, &vehicle(), &mut |key, found, _| panic!("{key}: {found}"))
}

fn row(path: &str, level: &str, apply: &str, law: &str, more: &str) -> String {
    format!(
        "[[row]]\npath = \"{path}\"\nlevel = \"{level}\"\napply = \"{apply}\"\n\
         law = {law}\nsource = \"E\"\n{more}\n"
    )
}

const UNIFORM: &str = "{ kind = \"uniform\", low = 0.9, high = 1.1 }";
const NORMAL: &str = "{ kind = \"normal\", mean = 1.0, sigma = 0.1 }";
const COMMON: &str = "[[common]]\nid = \"f\"\nsource = \"R\"\n";
const SHARED: &str = "common = \"f\"\ncommon_weight = 0.5";

/// Value and score of the draw called `key` in the first `cases` cases.
fn series(dispersion: &Dispersion, seed: u64, key: &str, cases: u64) -> Vec<(f64, f64)> {
    let sampler = Sampler::new(dispersion, seed);
    let mut cursor = sampler.cursor();
    let index = dispersion.index(key).unwrap();
    (0..cases)
        .map(|case| {
            let draws = cursor.draw(case, &[], true);
            (draws.values[index].unwrap(), draws.scores[index].unwrap())
        })
        .collect()
}

#[test]
fn a_draw_is_the_quantile_of_the_uniform_of_its_key_and_case() {
    let dispersion = dispersion(&row("booster.*.nozzle.mass", "engine", "scale", UNIFORM, ""));
    let key = "booster.right.nozzle.mass @ engine";
    let stream = Stream::new(9, key);
    let law = &dispersion.draws()[dispersion.index(key).unwrap()].law;
    for (case, (value, score)) in series(&dispersion, 9, key, 100).into_iter().enumerate() {
        let u = stream.uniform(case as u64);
        assert_eq!(value, law.quantile(u));
        assert_eq!(score, Position::of_uniform(u).score());
    }
}

#[test]
fn draws_do_not_depend_on_the_cases_before_nor_on_how_many_there_are() {
    let text = row("booster.*.nozzle.mass", "engine", "scale", UNIFORM, "")
        + COMMON
        + &row("modes.*.frequency", "mode", "scale", NORMAL, SHARED);
    let dispersion = dispersion(&text);
    let sampler = Sampler::new(&dispersion, 3);
    let mut forward = sampler.cursor();
    let all: Vec<Draws> = (0..200).map(|case| forward.draw(case, &[], true).clone()).collect();
    let mut jumping = sampler.cursor();
    for step in 0..200_u64 {
        let case = step * 67 % 200;
        // Other populations between the cases leave no trace either.
        jumping.draw(case, &[(0, 0.7)], step % 2 == 0);
        assert_eq!(jumping.draw(case, &[], true), &all[case as usize]);
        assert_eq!(sampler.cursor().draw(case, &[], true), &all[case as usize]);
    }
    assert!(forward.draw(u64::MAX, &[], true).values.iter().all(Option::is_some));
}

#[test]
fn draws_do_not_depend_on_the_presence_of_other_rows() {
    let mass = row("booster.*.nozzle.mass", "engine", "scale", UNIFORM, "");
    let more = row("booster.*.thrust", "vehicle", "scale", NORMAL, "")
        + &mass
        + COMMON
        + &row("modes.*.frequency", "mode", "scale", NORMAL, SHARED);
    let key = "booster.left.nozzle.mass @ engine";
    assert_eq!(series(&dispersion(&mass), 1, key, 100), series(&dispersion(&more), 1, key, 100));
    assert_ne!(series(&dispersion(&mass), 1, key, 100), series(&dispersion(&mass), 2, key, 100));
}

#[test]
fn a_common_score_correlates_rows_and_leaves_each_law_as_it_is() {
    let text = COMMON.to_string() + &row("modes.*.frequency", "mode", "scale", UNIFORM, SHARED);
    let dispersion = dispersion(&text);
    let cases = 100_000;
    let n = cases as f64;
    let first = series(&dispersion, 11, "modes.m001.frequency @ mode", cases);
    let second = series(&dispersion, 11, "modes.m002.frequency @ mode", cases);
    let common = series(&dispersion, 11, "common.f @ vehicle", cases);
    let correlation = |a: &[(f64, f64)], b: &[(f64, f64)]| {
        a.iter().zip(b).map(|(a, b)| a.1 * b.1).sum::<f64>() / n
    };
    // The mean of z z' has variance (1 + ρ²)/n; 4.9 of its deviations are passed once in a million.
    for (found, rho) in [(correlation(&first, &second), 0.25), (correlation(&first, &common), 0.5)]
    {
        assert!((found - rho).abs() < 4.9 * ((1.0 + rho * rho) / n).sqrt(), "{found} {rho}");
    }
    // Kolmogorov-Smirnov against the uniform law: 2.694 is passed once in a million.
    let mut values: Vec<f64> = first.iter().map(|v| (v.0 - 0.9) / 0.2).collect();
    values.sort_by(f64::total_cmp);
    let gap = values.iter().enumerate().map(|(i, u)| (u - (i as f64 + 0.5) / n).abs());
    let distance = gap.fold(0.0, f64::max) * n.sqrt();
    assert!(distance < 2.694, "{distance}");
}

#[test]
fn a_weight_of_one_makes_rows_one() {
    let text = COMMON.to_string()
        + &row("modes.*.frequency", "mode", "scale", NORMAL, "common = \"f\"\ncommon_weight = 1.0");
    let dispersion = dispersion(&text);
    let draws = Sampler::new(&dispersion, 1).cursor().draw(5, &[], true).clone();
    assert_eq!(draws.scores[0], draws.scores[1]);
    assert_eq!(draws.values[1], draws.values[2]);
}

fn effect(dispersion: &Dispersion, draws: &Draws, quantity: Quantity, place: Place) -> Affine {
    draws.effects[dispersion.parameters().index(quantity, place)]
}

#[test]
fn what_is_not_drawn_stays_nominal() {
    let text = row("booster.*.nozzle.mass", "engine", "absolute", UNIFORM, "");
    let dispersion = dispersion(&text);
    let sampler = Sampler::new(&dispersion, 1);
    let mut cursor = sampler.cursor();
    cursor.draw(0, &[], true);
    let draws = cursor.draw(0, &[], false);
    assert!(draws.values.iter().chain(&draws.scores).all(Option::is_none));
    assert!(draws.effects.iter().all(|e| *e == Affine::IDENTITY));
    let draws = cursor.draw(0, &[(1, 1.05)], false);
    let mass = |e| effect(&dispersion, draws, Quantity::NozzleMass, Place::Engine(e));
    assert_eq!(mass(0), Affine::IDENTITY);
    assert_eq!(mass(1), Affine { scale: 0.0, offset: 1.05 });
}

#[test]
fn a_fixed_value_outside_its_law_has_no_score_but_acts() {
    let dispersion = dispersion(&row("structure.damping", "vehicle", "absolute", UNIFORM, ""));
    let sampler = Sampler::new(&dispersion, 1);
    let mut cursor = sampler.cursor();
    let draws = cursor.draw(4, &[(0, 0.5)], true);
    assert_eq!((draws.values[0], draws.scores[0]), (Some(0.5), None));
    let found = effect(&dispersion, draws, Quantity::StructuralDamping, Place::Vehicle);
    assert_eq!(found.apply(0.005), 0.5);
    let draws = cursor.draw(4, &[(0, 1.0)], true);
    assert!(draws.scores[0].unwrap().abs() < 1e-15);
}

#[test]
fn a_fixed_common_score_moves_the_rows_that_share_it() {
    let text = COMMON.to_string() + &row("modes.*.frequency", "mode", "scale", NORMAL, SHARED);
    let dispersion = dispersion(&text);
    let sampler = Sampler::new(&dispersion, 1);
    let mut cursor = sampler.cursor();
    let draws = cursor.draw(0, &[(0, 2.0)], false);
    assert_eq!(draws.scores, [Some(2.0), Some(1.0), Some(1.0), Some(1.0)]);
    assert_eq!(draws.values[1], Some(1.1));
    let drawn = cursor.draw(0, &[(0, 2.0)], true).scores[1].unwrap();
    let alone = Position::of_uniform(Stream::new(1, "modes.m001.frequency @ mode").uniform(0));
    assert!((drawn - (1.0 + 0.75_f64.sqrt() * alone.score())).abs() < 1e-15);
}

#[test]
fn absolute_acts_first_then_scales_then_offsets_whatever_the_order_of_rows() {
    let fixed = |value: f64| format!("{{ kind = \"fixed\", value = {value} }}");
    let path = "booster.*.nozzle.mass";
    let rows = [
        row(path, "engine", "offset", &fixed(-30.0), "id = \"a\""),
        row(path, "vehicle", "scale", &fixed(1.1), ""),
        row(path, "engine", "absolute", &fixed(8000.0), "id = \"b\""),
        row(path, "engine", "scale", &fixed(0.7), "id = \"c\""),
        row(path, "vehicle", "offset", &fixed(0.1), "id = \"d\""),
    ];
    let found = |rows: &[String]| {
        let dispersion = dispersion(&rows.concat());
        let draws = Sampler::new(&dispersion, 1).cursor().draw(0, &[], true).clone();
        effect(&dispersion, &draws, Quantity::NozzleMass, Place::Engine(1))
    };
    // Key order: scales `*` before `right`, offsets `*` before `right`.
    let offset = 8000.0 * 1.1 * 0.7 + 0.1 - 30.0;
    assert_eq!(found(&rows), Affine { scale: 0.0, offset });
    let mut reversed = rows.to_vec();
    reversed.reverse();
    assert_eq!(found(&reversed), found(&rows));
    let relative = [rows[0].clone(), rows[1].clone(), rows[3].clone(), rows[4].clone()];
    assert_eq!(found(&relative), Affine { scale: 1.1 * 0.7, offset: 0.1 - 30.0 });
}

#[test]
fn a_discrete_value_is_scored_at_its_mid_distribution() {
    let law = "{ kind = \"discrete\", values = [0.9, 1.0, 1.1] }";
    let dispersion = dispersion(&row("structure.damping", "vehicle", "scale", law, ""));
    for (value, score) in series(&dispersion, 1, "structure.damping @ vehicle", 50) {
        let u = if value == 1.0 {
            0.5
        } else if value < 1.0 {
            1.0 / 6.0
        } else {
            5.0 / 6.0
        };
        assert!((crate::dispersion::normal::below(score) - u).abs() < 1e-15, "{value} {score}");
    }
}
