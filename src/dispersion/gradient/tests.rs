//! Gradients by scores against differences of the effects, and scores against the draws they come from.

use super::super::fixture::vehicle;
use super::super::resolve::resolve;
use super::super::table::Table;
use super::*;
use crate::dispersion::Sampler;

const ROWS: &str = r#"
[[common]]
id = "f"
source = "R"

[[row]]
path = "modes.*.frequency"
law = { kind = "truncated_normal", mean = 1.0, three_sigma = 0.1, low_sigma = -3.0, high_sigma = 3.0 }
apply = "scale"
level = "mode"
common = "f"
common_weight = 0.6
source = "R"

[[row]]
path = "booster.*.thrust"
law = { kind = "uniform", low = 1.1e7, high = 1.3e7 }
apply = "absolute"
level = "vehicle"
id = "a"
source = "E"

[[row]]
path = "booster.*.thrust"
law = { kind = "lognormal", median = 1.0, sigma_ln = 0.05 }
apply = "scale"
level = "booster"
id = "b"
source = "E"

[[row]]
path = "booster.*.thrust"
law = { kind = "triangular", low = 0.9, mode = 1.0, high = 1.2 }
apply = "scale"
level = "vehicle"
id = "c"
source = "E"

[[row]]
path = "booster.*.thrust"
law = { kind = "normal", mean = 0.0, sigma = 1e5 }
apply = "offset"
level = "booster"
id = "d"
source = "E"

[[row]]
path = "booster.*.nozzle.mass"
law = { kind = "normal", mean = 1.0, sigma = 0.1 }
apply = "scale"
level = "engine"
source = "E"

[[correlation]]
kind = "rank"
source = "E"
keys = ["booster.left.nozzle.mass @ engine", "booster.right.nozzle.mass @ engine"]
matrix = [[1.0, 0.7], [0.7, 1.0]]
"#;

fn dispersion() -> Dispersion {
    let table: Table = toml::from_str(ROWS).unwrap();
    resolve(&table, &vehicle(), &mut |key, found, _| panic!("{key}: {found}"))
}

/// A number that looks random, between −1 and 1.
fn odd(seed: usize) -> f64 {
    (78.233 * seed as f64 + 0.4).sin()
}

/// Nominal value and weight of a parameter.
fn nominal(parameter: usize) -> (f64, f64) {
    (2.0 + odd(parameter), odd(parameter + 500))
}

/// Σ weight · drawn value over all parameters, with these values fixed.
fn sum(dispersion: &Dispersion, values: &[(usize, f64)]) -> f64 {
    let sampler = Sampler::new(dispersion, 1);
    let mut cursor = sampler.cursor();
    let effects = &cursor.draw(0, values, false).effects;
    let all = effects.iter().enumerate().map(|(parameter, effect)| {
        let (nominal, weight) = nominal(parameter);
        weight * effect.apply(nominal)
    });
    all.sum()
}

#[test]
fn the_gradient_by_scores_is_what_differences_say() {
    let dispersion = dispersion();
    let z: Vec<Option<f64>> =
        (0..dispersion.draws().len()).map(|i| Some(1.8 * odd(i + 9))).collect();
    let values = dispersion.values_at(&z);
    let sampler = Sampler::new(&dispersion, 1);
    let mut cursor = sampler.cursor();
    let draws = cursor.draw(0, &values, false).clone();
    let effects: Vec<AffineGradient> = (0..dispersion.parameters().count())
        .map(|parameter| {
            let (nominal, weight) = nominal(parameter);
            let c = |x: f64| Complex::new(x, 2.0 * x);
            AffineGradient { scale: c(weight * nominal), offset: c(weight) }
        })
        .collect();
    let found = dispersion.chain(&draws, &[]).gradient(&effects);
    for (index, by) in found.iter().enumerate() {
        let at = |shift: f64| {
            let mut z = z.clone();
            z[index] = z[index].map(|z| z + shift);
            sum(&dispersion, &dispersion.values_at(&z))
        };
        let step = 1e-3;
        let secant = |h: f64| (at(h) - at(-h)) / (2.0 * h);
        let expected = (4.0 * secant(step) - secant(2.0 * step)) / 3.0;
        let by = by.unwrap();
        let allowed = 1e-8 * (by.re.abs() + sum(&dispersion, &values).abs() * 1e-2);
        assert!((by.re - expected).abs() < allowed, "{index}: {by} is not {expected}");
        assert!((by.im - 2.0 * by.re).abs() <= 1e-12 * by.norm(), "the imaginary part alike");
    }
    assert!(found.iter().all(|by| by.is_some_and(|by| by.norm() > 0.0)), "all are felt");
}

#[test]
fn a_key_that_is_held_does_not_move_with_its_common_score() {
    let dispersion = dispersion();
    let common = dispersion.draws().iter().position(|d| d.role == Role::Common).unwrap();
    let z = vec![Some(0.3); dispersion.draws().len()];
    let values = dispersion.values_at(&z);
    let sampler = Sampler::new(&dispersion, 1);
    let draws = sampler.cursor().draw(0, &values, false).clone();
    let one = AffineGradient { scale: Complex::new(1.0, 0.0), offset: Complex::new(0.0, 0.0) };
    let effects = vec![one; dispersion.parameters().count()];
    let held = dispersion.chain(&draws, &values).gradient(&effects);
    let free = dispersion.chain(&draws, &[]).gradient(&effects);
    assert_eq!(held[common], Some(Complex::ZERO));
    assert!(free[common].unwrap().re > 0.0);
}

#[test]
fn values_come_back_from_the_scores_of_a_drawn_case() {
    let dispersion = dispersion();
    let sampler = Sampler::new(&dispersion, 3);
    let mut cursor = sampler.cursor();
    for case in 0..20 {
        let draws = cursor.draw(case, &[], true).clone();
        let values = dispersion.values_at(&dispersion.scores_of(&draws));
        for (index, value) in values {
            let expected = draws.values[index].unwrap();
            assert!((value - expected).abs() < 1e-9 * expected.abs().max(1.0), "{index}");
        }
    }
}

#[test]
fn a_key_that_stays_nominal_counts_as_one_at_its_median() {
    let dispersion = dispersion();
    let sampler = Sampler::new(&dispersion, 1);
    let nominal = sampler.cursor().draw(0, &[], false).clone();
    let one = AffineGradient { scale: Complex::new(1.0, 0.0), offset: Complex::new(0.0, 0.0) };
    let effects = vec![one; dispersion.parameters().count()];
    let found = dispersion.chain(&nominal, &[]).gradient(&effects);
    let lognormal = dispersion.draws().iter().position(|d| d.key.ends_with("# b")).unwrap();
    // One engine, factor of median 1 and slope σ_ln there.
    assert!((found[lognormal].unwrap().re - 0.05).abs() < 1e-12);
}
