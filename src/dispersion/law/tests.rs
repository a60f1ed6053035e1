//! Laws against samples of `rand_distr`, distribution functions of `statrs`, closed forms and
//! numerical integration. Each statistical test fixes its seed and errs once in a million.

use super::super::stream::Stream;
use super::*;
use rand::rngs::ChaCha12Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::Distribution;
use rand_distr::weighted::WeightedIndex;
use statrs::distribution::ContinuousCDF;

const SAMPLES: usize = 50_000;

/// The Kolmogorov-Smirnov distance of `sample` from `cdf`, times √n; above 2.694 with probability
/// 1e-6 at most (2 exp(−2 d²), Massart's bound).
fn distance(mut sample: Vec<f64>, cdf: impl Fn(f64) -> f64) -> f64 {
    sample.sort_by(f64::total_cmp);
    let n = sample.len() as f64;
    let gap = sample.iter().enumerate().map(|(i, &x)| {
        let f = cdf(x);
        (f - i as f64 / n).abs().max(((i + 1) as f64 / n - f).abs())
    });
    gap.fold(0.0, f64::max) * n.sqrt()
}

const ONE_IN_A_MILLION: f64 = 2.694;

fn from_rand_distr(distribution: impl Distribution<f64>) -> Vec<f64> {
    let generator = ChaCha12Rng::seed_from_u64(20_260_101);
    generator.sample_iter(distribution).take(SAMPLES).collect()
}

fn drawn(law: &Law) -> Vec<f64> {
    let mut sample = vec![0.0; SAMPLES];
    Stream::new(7, "law test").fill(0, &mut sample);
    sample.iter().map(|&u| law.quantile(u)).collect()
}

/// Every continuous law once, with awkward arguments.
fn continuous() -> Vec<Law> {
    vec![
        Law::normal(-2.0, 3.0).unwrap(),
        Law::truncated_normal(1.0, 0.05 / 3.0, Bound::Sigma(-3.0), Bound::Sigma(3.0)).unwrap(),
        Law::truncated_normal(1.0, 2.0, Bound::Value(0.5), Bound::Sigma(4.0)).unwrap(),
        Law::truncated_normal(0.0, 1.0, Bound::Value(9.0), Bound::Value(11.0)).unwrap(),
        Law::truncated_normal(0.0, 1.0, Bound::Sigma(-36.0), Bound::Sigma(-35.0)).unwrap(),
        Law::truncated_normal(5.0, 2.0, Bound::Sigma(1.0), Bound::Sigma(f64::INFINITY)).unwrap(),
        Law::uniform(0.0035, 0.0075).unwrap(),
        Law::uniform(-3.0, 5.0).unwrap(),
        Law::triangular(-1.0, 0.5, 4.0).unwrap(),
        Law::triangular(2.0, 2.0, 3.0).unwrap(),
        Law::triangular(2.0, 3.0, 3.0).unwrap(),
        Law::lognormal(2.5, 0.4).unwrap(),
        Law::beta(2.0, 5.0, -1.0, 3.0).unwrap(),
        Law::beta(0.5, 0.5, 0.0, 1.0).unwrap(),
        Law::beta(1.0, 3.0, 0.0, 1.0).unwrap(),
        Law::beta(40.0, 0.7, 10.0, 20.0).unwrap(),
        Law::beta(800.0, 900.0, 0.0, 1.0).unwrap(),
        Law::empirical(&[0.0, 0.1, 0.7, 1.0], &[-1.0, 0.0, 0.5, 8.0]).unwrap(),
        Law::sample(&[3.0, 1.0, 2.0, 10.0]).unwrap(),
    ]
}

#[test]
fn the_distribution_function_undoes_the_quantile_in_both_tails() {
    const STEP: f64 = 1.0 / 9_007_199_254_740_992.0;
    let mut probabilities = vec![STEP, 3.0 * STEP, 1e-12, 1e-6, 1e-3];
    probabilities.extend((1..100).map(|i| f64::from(i) / 100.0));
    for law in continuous() {
        for &u in &probabilities {
            for (u, upper) in [(u, false), (1.0 - u, true)] {
                let x = law.quantile(u);
                let at = |x: f64| if upper { law.tails(x).1 } else { law.tails(x).0 };
                // What one rounding of x either way changes cannot be recovered.
                let lost = (at(x.next_up()) - at(x.next_down())).abs();
                let tail = if upper { 1.0 - u } else { u };
                // Beside its own bound a truncated law is a difference of two values of Φ.
                let difference = matches!(law.0, Shape::TruncatedNormal { .. });
                let rounding = if difference { f64::EPSILON } else { 0.0 };
                let error = (at(x) - tail).abs();
                // The logarithm of the beta density is a difference of terms up to 1000 ln 1000.
                let relative = if matches!(law.0, Shape::Beta { .. }) { 2e-12 } else { 1e-13 };
                let allowed = relative * tail + 2.0 * lost + rounding;
                assert!(error <= allowed, "{law:?} at {u}: {error:e}");
            }
        }
    }
}

#[test]
fn the_score_of_a_drawn_value_is_the_score_that_was_drawn() {
    for law in continuous() {
        for z in [-7.5, -3.0, -1.0, 0.0, 0.3, 2.0, 6.0] {
            let x = law.value(&Position::of_score(z));
            // Beside a bound where the density is infinite x may round to the bound itself.
            let Some(back) = law.score(x) else {
                assert!(law.range().unwrap().contains(&x), "{law:?} at {z}: {x}");
                continue;
            };
            let lost = [x.next_up(), x.next_down()]
                .map(|x| law.score(x).map_or(f64::INFINITY, |s| (s - back).abs()));
            let tolerance = 1e-12 + 2.0 * lost[0].max(lost[1]);
            assert!((back - z).abs() <= tolerance, "{law:?} at {z}: {back}");
        }
    }
}

#[test]
fn quantiles_never_descend_and_stay_in_the_range() {
    let mut uniforms = vec![0.0; 2000];
    Stream::new(1, "order").fill(0, &mut uniforms);
    uniforms.extend([f64::EPSILON / 2.0, 1.0 - f64::EPSILON / 2.0, 0.5]);
    uniforms.sort_by(f64::total_cmp);
    for law in continuous() {
        let values: Vec<f64> = uniforms.iter().map(|&u| law.quantile(u)).collect();
        assert!(values.windows(2).all(|v| v[0] <= v[1]), "{law:?}");
        let [low, high] = law.support();
        assert!(values.iter().all(|&v| low <= v && v <= high && v.is_finite()), "{law:?}");
    }
}

#[test]
fn medians_are_exact() {
    assert_eq!(Law::normal(0.1, 7.0).unwrap().quantile(0.5), 0.1);
    let symmetric = Law::truncated_normal(0.1, 0.3, Bound::Sigma(-3.0), Bound::Sigma(3.0));
    assert_eq!(symmetric.unwrap().quantile(0.5), 0.1);
    assert_eq!(Law::uniform(-3.0, 5.0).unwrap().quantile(0.5), 1.0);
    assert_eq!(Law::triangular(0.0, 1.0, 2.0).unwrap().quantile(0.5), 1.0);
    assert_eq!(Law::lognormal(2.5, 0.4).unwrap().quantile(0.5), 2.5);
    assert_eq!(Law::beta(3.0, 3.0, 0.0, 4.0).unwrap().quantile(0.5), 2.0);
    assert_eq!(Law::sample(&[5.0, 1.0, 3.0]).unwrap().quantile(0.5), 3.0);
    assert_eq!(Law::fixed(4.2).unwrap().quantile(0.5), 4.2);
}

#[test]
fn closed_forms_hold() {
    let close = |x: f64, y: f64| assert!((x - y).abs() <= 4.0 * f64::EPSILON * y.abs(), "{x} {y}");
    // Exponential tail of Beta(1, 3): F = 1 − (1 − t)³. Arcsine law: t = sin²(π u / 2).
    assert!((Law::beta(1.0, 3.0, 0.0, 1.0).unwrap().quantile(0.875) / 0.5 - 1.0).abs() < 1e-14);
    let arcsine = Law::beta(0.5, 0.5, 0.0, 1.0).unwrap();
    let t = (std::f64::consts::PI * 0.1).sin().powi(2);
    assert!((arcsine.quantile(0.2) / t - 1.0).abs() < 1e-14);
    close(Law::uniform(2.0, 6.0).unwrap().quantile(0.25), 3.0);
    close(Law::triangular(0.0, 0.0, 1.0).unwrap().quantile(0.75), 0.5);
    close(Law::triangular(0.0, 1.0, 1.0).unwrap().quantile(0.25), 0.5);
    close(Law::lognormal(3.0, 0.5).unwrap().value(&Position::of_score(2.0)), 3.0 * 1_f64.exp());
    close(Law::normal(1.0, 0.5).unwrap().value(&Position::of_score(-3.0)), -0.5);
}

#[test]
#[expect(clippy::excessive_precision, reason = "digits as the reference gives them")]
fn beta_probabilities_agree_with_forty_digit_values() {
    // mpmath `betainc(.., regularized=True)`.
    for (alpha, beta, t, probability) in [
        (2.0, 3.0, 0.25, 0.261_718_75),
        (0.5, 0.5, 0.1, 0.204_832_764_699_133_451_65),
        (50.0, 30.0, 0.5, 0.011_909_896_429_000_633_401),
    ] {
        let law = Law::beta(alpha, beta, 0.0, 1.0).unwrap();
        assert!((law.cdf(t) / probability - 1.0).abs() < 2e-12, "{}", law.cdf(t));
        assert!((law.quantile(probability) / t - 1.0).abs() < 2e-12);
    }
}

#[test]
fn a_truncated_normal_agrees_with_its_density_integrated() {
    for (a, b) in [(-3.0, 3.0), (-1.0, 2.5), (0.5, 4.0), (8.0, 9.0), (-21.0, -20.0)] {
        let law = Law::truncated_normal(0.0, 1.0, Bound::Sigma(a), Bound::Sigma(b)).unwrap();
        // Simpson's rule; the density is scaled by its value at the end nearest to zero.
        let peak = if a > 0.0 { a } else { f64::min(b, 0.0) };
        let density = |z: f64| (0.5 * (peak - z) * (peak + z)).exp();
        let integral = |from: f64, to: f64| {
            let n = 2000;
            let h = (to - from) / f64::from(2 * n);
            let sum: f64 = (0..=2 * n)
                .map(|i| {
                    let weight =
                        if i == 0 || i == 2 * n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
                    weight * density(from + f64::from(i) * h)
                })
                .sum();
            sum * h / 3.0
        };
        for share in [0.01, 0.2, 0.5, 0.9] {
            let x = a + share * (b - a);
            let expected = integral(a, x) / integral(a, b);
            // Simpson's error with 4000 steps of a length ≤ 0.0015: below 1e-11 of the integral
            // where the density decays as exp(−21 z).
            assert!((law.cdf(x) / expected - 1.0).abs() < 1e-9, "[{a}, {b}] at {x}");
            assert!((law.quantile(expected) - x).abs() < 1e-9, "[{a}, {b}] at {x}");
        }
    }
}

#[test]
fn laws_follow_the_samples_of_rand_distr() {
    let check = |law: Law, sample: Vec<f64>| {
        let d = distance(sample, |x| law.cdf(x));
        assert!(d < ONE_IN_A_MILLION, "{law:?}: {d}");
    };
    let normal = || rand_distr::Normal::new(-2.0, 3.0).unwrap();
    check(Law::normal(-2.0, 3.0).unwrap(), from_rand_distr(normal()));
    let truncated =
        Law::truncated_normal(-2.0, 3.0, Bound::Value(-4.0), Bound::Value(3.0)).unwrap();
    let kept = from_rand_distr(normal()).into_iter().filter(|x| (-4.0..=3.0).contains(x)).collect();
    check(truncated, kept);
    check(
        Law::uniform(-3.0, 5.0).unwrap(),
        from_rand_distr(rand_distr::Uniform::new(-3.0, 5.0).unwrap()),
    );
    check(
        Law::triangular(-1.0, 0.5, 4.0).unwrap(),
        from_rand_distr(rand_distr::Triangular::new(-1.0, 4.0, 0.5).unwrap()),
    );
    check(
        Law::lognormal(2.5, 0.4).unwrap(),
        from_rand_distr(rand_distr::LogNormal::new(2.5_f64.ln(), 0.4).unwrap()),
    );
    for (alpha, beta) in [(2.0, 5.0), (0.5, 0.5), (40.0, 0.7), (800.0, 900.0)] {
        check(
            Law::beta(alpha, beta, 0.0, 1.0).unwrap(),
            from_rand_distr(rand_distr::Beta::new(alpha, beta).unwrap()),
        );
    }
    let segments = WeightedIndex::new([0.1, 0.6, 0.3]).unwrap();
    let ends = [(-1.0, 0.0), (0.0, 0.5), (0.5, 8.0)];
    let mut generator = ChaCha12Rng::seed_from_u64(3);
    let sample = (0..SAMPLES)
        .map(|_| {
            let (low, high) = ends[segments.sample(&mut generator)];
            generator.random_range(low..high)
        })
        .collect();
    check(Law::empirical(&[0.0, 0.1, 0.7, 1.0], &[-1.0, 0.0, 0.5, 8.0]).unwrap(), sample);
}

#[test]
fn draws_follow_the_distribution_functions_of_statrs() {
    use statrs::distribution as statrs;
    fn check(law: Law, other: impl ContinuousCDF<f64, f64>) {
        let d = distance(drawn(&law), |x| other.cdf(x));
        assert!(d < ONE_IN_A_MILLION, "{law:?}: {d}");
        for i in 1..1000 {
            let x = law.quantile(f64::from(i) / 1000.0);
            // The constants of its erf are given to ten digits.
            assert!((law.cdf(x) - other.cdf(x)).abs() < 1e-10, "{law:?} at {x}");
        }
    }
    check(Law::normal(-2.0, 3.0).unwrap(), statrs::Normal::new(-2.0, 3.0).unwrap());
    check(Law::uniform(-3.0, 5.0).unwrap(), statrs::Uniform::new(-3.0, 5.0).unwrap());
    check(
        Law::triangular(-1.0, 0.5, 4.0).unwrap(),
        statrs::Triangular::new(-1.0, 4.0, 0.5).unwrap(),
    );
    check(Law::lognormal(2.5, 0.4).unwrap(), statrs::LogNormal::new(2.5_f64.ln(), 0.4).unwrap());
    check(Law::beta(2.0, 5.0, 0.0, 1.0).unwrap(), statrs::Beta::new(2.0, 5.0).unwrap());
}

#[test]
fn discrete_frequencies_follow_the_weights() {
    let (values, weights) = ([3.0, -1.0, 2.0], [1.0, 5.0, 2.0]);
    let law = Law::discrete(&values, &weights).unwrap();
    let sample = drawn(&law);
    let reference: Vec<f64> = {
        let index = WeightedIndex::new(weights).unwrap();
        let generator = ChaCha12Rng::seed_from_u64(5);
        generator.sample_iter(index).map(|i: usize| values[i]).take(SAMPLES).collect()
    };
    for sample in [sample, reference] {
        let chi_square: f64 = values
            .iter()
            .zip(weights)
            .map(|(&value, weight)| {
                let expected = SAMPLES as f64 * weight / 8.0;
                let seen = sample.iter().filter(|&&x| x == value).count() as f64;
                (seen - expected).powi(2) / expected
            })
            .sum();
        // Two degrees of freedom: the tail is exp(−χ²/2), one in a million at 27.6.
        assert!(chi_square < 27.6, "{chi_square}");
    }
}

#[test]
fn a_discrete_law_jumps_at_its_values_and_scores_at_mid_distribution() {
    let law = Law::discrete(&[3.0, -1.0, 2.0], &[1.0, 5.0, 2.0]).unwrap();
    assert_eq!(law.range(), Some([-1.0, 3.0]));
    assert_eq!(
        [law.cdf(-1.1), law.cdf(-1.0), law.cdf(2.5), law.cdf(3.0)],
        [0.0, 0.625, 0.875, 1.0]
    );
    // The quantile is the least value whose F reaches u.
    assert_eq!([law.quantile(0.625), law.quantile(0.626)], [-1.0, 2.0]);
    assert_eq!([law.quantile(1e-16), law.quantile(1.0 - 1.2e-16)], [-1.0, 3.0]);
    assert_eq!(law.score(2.0), Some(normal::score(0.75, 0.25)));
    assert_eq!(law.score(-1.0), Some(normal::score(0.3125, 0.6875)));
    assert_eq!(law.score(0.0), None);
    assert!(law.is_outside(0.0) && !law.is_outside(2.0) && !law.is_continuous());
    // Equal weights are symmetric: the middle value scores zero.
    assert_eq!(Law::discrete(&[1.0, 2.0, 3.0], &[1.0; 3]).unwrap().score(2.0), Some(0.0));
    let only = Law::discrete(&[4.0], &[0.3]).unwrap();
    assert_eq!((only.quantile(0.99), only.score(4.0)), (4.0, Some(0.0)));
    assert_eq!(only.fraction_of_range(4.0), None);
}

#[test]
fn repeated_values_of_an_empirical_law_carry_their_probability() {
    let law = Law::empirical(&[0.0, 0.25, 0.75, 1.0], &[0.0, 1.0, 1.0, 2.0]).unwrap();
    assert!(!law.is_continuous());
    assert_eq!([law.quantile(0.125), law.quantile(0.3), law.quantile(0.7)], [0.5, 1.0, 1.0]);
    assert_eq!([law.cdf(0.5), law.cdf(1.0), law.cdf(1.5)], [0.125, 0.75, 0.875]);
    assert_eq!(law.score(1.0), Some(0.0));
    assert_eq!(law.score(0.5), Some(normal::score(0.125, 0.875)));
    // Ties at an end.
    let law = Law::sample(&[1.0, 1.0, 3.0]).unwrap();
    assert_eq!([law.cdf(1.0), law.cdf(2.0), law.cdf(3.0), law.cdf(0.9)], [0.5, 0.75, 1.0, 0.0]);
    assert_eq!(law.score(1.0), Some(normal::score(0.25, 0.75)));
}

#[test]
fn a_fixed_law_is_certain() {
    let law = Law::fixed(4.2).unwrap();
    assert_eq!((law.score(4.2), law.score(4.3)), (Some(0.0), None));
    assert_eq!((law.cdf(4.1), law.cdf(4.2)), (0.0, 1.0));
    assert_eq!(law.fraction_of_range(4.2), None);
}

#[test]
fn bounded_laws_tell_the_fraction_of_the_range_and_what_lies_outside() {
    let law = Law::uniform(0.0035, 0.0075).unwrap();
    assert!((law.fraction_of_range(0.0045).unwrap() - 0.25).abs() < 1e-15);
    assert!((law.fraction_of_range(0.0025).unwrap() + 0.25).abs() < 1e-15);
    assert!(law.is_outside(0.0025) && !law.is_outside(0.0035));
    assert_eq!(law.score(0.0025), None);
    // At the very end the score is infinite, so there is none.
    assert_eq!(law.score(0.0035), None);
    let open = Law::truncated_normal(0.0, 1.0, Bound::Sigma(-1.0), Bound::Sigma(f64::INFINITY));
    assert_eq!(open.unwrap().range(), None);
    assert_eq!(Law::normal(0.0, 1.0).unwrap().fraction_of_range(1.0), None);
    assert!(Law::lognormal(1.0, 1.0).unwrap().is_outside(-0.1));
}

#[test]
fn a_bound_given_in_sigma_is_not_outside_by_its_rounding() {
    for percent in 1..100 {
        let share = f64::from(percent) / 100.0;
        let sigma = share / 3.0;
        let law = Law::truncated_normal(1.0, sigma, Bound::Sigma(-3.0), Bound::Sigma(3.0)).unwrap();
        assert!(!law.is_outside(1.0 + share) && !law.is_outside(1.0 - share), "{percent} %");
        assert!(law.is_outside(1.0 + 1.001 * share));
    }
}

#[test]
fn impossible_arguments_are_refused_by_name() {
    let refused = |result: Result<Law, Refusal>, argument: &str| {
        let refusal = result.unwrap_err();
        assert_eq!(refusal.argument, argument, "{refusal}");
    };
    let nan = f64::NAN;
    let inf = f64::INFINITY;
    refused(Law::fixed(nan), "value");
    refused(Law::normal(nan, 1.0), "mean");
    refused(Law::normal(0.0, -1.0), "sigma");
    refused(Law::normal(0.0, 0.0), "sigma");
    refused(Law::normal(0.0, nan), "sigma");
    refused(Law::normal(0.0, inf), "sigma");
    refused(Law::uniform(1.0, 1.0), "high");
    refused(Law::uniform(2.0, 1.0), "high");
    refused(Law::uniform(nan, 1.0), "low");
    refused(Law::uniform(0.0, inf), "high");
    refused(Law::uniform(-f64::MAX, f64::MAX), "high");
    refused(Law::triangular(0.0, 2.0, 1.0), "mode");
    refused(Law::triangular(0.0, nan, 1.0), "mode");
    refused(Law::lognormal(0.0, 1.0), "median");
    refused(Law::lognormal(1.0, -1.0), "sigma_ln");
    refused(Law::beta(0.0, 1.0, 0.0, 1.0), "alpha");
    refused(Law::beta(1.0, nan, 0.0, 1.0), "beta");
    refused(Law::beta(1.0, 1.0, 1.0, 0.0), "high");
    refused(Law::discrete(&[], &[]), "values");
    refused(Law::discrete(&[1.0, 1.0], &[1.0, 1.0]), "values");
    refused(Law::discrete(&[1.0, nan], &[1.0, 1.0]), "values");
    refused(Law::discrete(&[1.0, 2.0], &[1.0]), "weights");
    refused(Law::discrete(&[1.0, 2.0], &[1.0, 0.0]), "weights");
    refused(Law::discrete(&[1.0, 2.0], &[f64::MAX, f64::MAX]), "weights");
    refused(Law::empirical(&[0.0], &[1.0]), "values");
    refused(Law::empirical(&[0.0, 1.0, 1.0], &[1.0, 2.0]), "probabilities");
    refused(Law::empirical(&[0.1, 1.0], &[1.0, 2.0]), "probabilities");
    refused(Law::empirical(&[0.0, 0.5, 0.5, 1.0], &[1.0, 2.0, 3.0, 4.0]), "probabilities");
    refused(Law::empirical(&[0.0, 1.0], &[2.0, 1.0]), "values");
    refused(Law::empirical(&[0.0, 1.0], &[1.0, 1.0]), "values");
    refused(Law::empirical(&[0.0, 1.0], &[1.0, nan]), "values");
    refused(Law::sample(&[1.0]), "values");
    refused(Law::sample(&[]), "values");
    let sigma = Bound::Sigma;
    refused(Law::truncated_normal(0.0, 1.0, sigma(1.0), sigma(1.0)), "high");
    refused(Law::truncated_normal(0.0, 1.0, sigma(nan), sigma(1.0)), "low");
    refused(Law::truncated_normal(0.0, 1.0, sigma(0.0), sigma(nan)), "high");
    refused(Law::truncated_normal(0.0, 1.0, sigma(38.0), sigma(39.0)), "low");
    refused(Law::truncated_normal(0.0, 1.0, sigma(-39.0), sigma(-38.0)), "high");
    refused(Law::truncated_normal(1e300, 1e-300, sigma(-1.0), sigma(1.0)), "high");
}

#[test]
fn the_slope_is_what_differences_of_the_value_by_the_normal_score_say() {
    for law in continuous() {
        for z in [-2.3, -1.1, -0.2, 0.3, 1.4, 2.2] {
            let slope = law.slope(law.value(&Position::of_score(z)), z).unwrap();
            let at = |h: f64| law.value(&Position::of_score(z + h));
            let step = 1e-4;
            let secant = |h: f64| (at(h) - at(-h)) / (2.0 * h);
            let expected = (4.0 * secant(step) - secant(2.0 * step)) / 3.0;
            // Rounding of the value over the step; an inverse by iteration is good to some of its digits.
            let scale = slope.abs() + 1e-9 * at(0.0).abs() / step;
            assert!((slope - expected).abs() < 1e-5 * scale, "{law:?} at {z}: {slope} {expected}");
        }
    }
    assert_eq!(Law::fixed(3.0).unwrap().slope(3.0, 1.0), Some(0.0));
    let discrete = Law::discrete(&[1.0, 2.0], &[1.0, 1.0]).unwrap();
    assert_eq!(discrete.slope(2.0, 1.0), None);
}
