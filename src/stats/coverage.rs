//! Coverage of the intervals by simulation: how often they hold the truth they are made for.
//!
//! Test only. Seeds are fixed; each check states how often it would fail for a correct program.

use super::*;

/// A counter-based source of uniform words: SplitMix64 (Steele, Lea and Flood 2014).
pub(super) fn words(seed: u64) -> impl FnMut() -> u64 {
    let mut counter = seed.wrapping_mul(0x2545_F491_4F6C_DD1D);
    move || {
        counter = counter.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = counter;
        word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        word ^ (word >> 31)
    }
}

fn uniforms(seed: u64) -> impl FnMut() -> f64 {
    let mut words = words(seed);
    move || ((words() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
}

fn witness() -> Independent {
    Drawing::Independent.independent().unwrap()
}

fn confidence(value: f64) -> Confidence {
    Confidence::new(value).unwrap()
}

/// Asserts that the number of misses in the trials agrees with a true miss rate at most `risk`
/// (exact intervals): a correct program fails one check in a million at most.
fn assert_misses_at_most(misses: u64, trials: u64, risk: f64) {
    let tail = binomial::at_least(misses, trials, risk);
    assert!(tail > 1e-6, "{misses} of {trials} intervals missed; allowed rate {risk}");
}

/// Asserts in addition that it is at least `risk` less `slack`.
fn assert_misses_near(misses: u64, trials: u64, risk: f64, slack: f64) {
    assert_misses_at_most(misses, trials, risk + slack);
    let tail = binomial::at_most(misses, trials, risk - slack);
    assert!(tail > 1e-6, "only {misses} of {trials} intervals missed; expected rate {risk}");
}

#[test]
fn clopper_pearson_covers_at_least_as_often_as_it_says() {
    for (seed, p) in (1..).zip([0.003, 0.04, 0.5, 0.9]) {
        let mut uniform = uniforms(seed);
        let trials = 4000;
        let misses = (0..trials)
            .filter(|_| {
                let events = (0..200).filter(|_| uniform() < p).count() as u64;
                let interval =
                    clopper_pearson(events, 200, confidence(0.9), Sides::Two, witness()).unwrap();
                !(interval.lower() <= p && p <= interval.upper())
            })
            .count();
        assert_misses_at_most(misses as u64, trials, 0.1);
    }
}

#[test]
fn the_exact_coverage_of_clopper_pearson_is_never_below_its_confidence() {
    // No simulation: the sum of the binomial probabilities of the counts whose interval holds p.
    let n = 30;
    let intervals: Vec<Estimate> = (0..=n)
        .map(|k| clopper_pearson(k, n, confidence(0.9), Sides::Two, witness()).unwrap())
        .collect();
    for p in (1..100).map(|i| f64::from(i) / 100.0) {
        let covered: f64 = (0..=n)
            .filter(|&k| {
                let interval = &intervals[k as usize];
                interval.lower() <= p && p <= interval.upper()
            })
            .map(|k| {
                binomial::at_most(k, n, p)
                    - if k > 0 { binomial::at_most(k - 1, n, p) } else { 0.0 }
            })
            .sum();
        assert!(covered >= 0.9 - 1e-12, "p = {p}: {covered}");
    }
}

#[test]
fn wilks_bounds_fail_exactly_at_the_consumers_risk() {
    // Of uniform draws the bound itself is the share it covers.
    let trials = 20_000;
    let coverage = Probability::new(0.95).unwrap();
    let mut uniform = uniforms(11);
    let (mut below, mut risk) = (0, 0.0);
    let (mut enclosed, mut enclosed_risk) = (0, 0.0);
    for _ in 0..trials {
        let values: Vec<f64> = (0..100).map(|_| uniform()).collect();
        let sample = Ordered::new(&values).unwrap();
        let bound =
            tolerance_bound(&sample, coverage, confidence(0.9), Sides::Upper, witness()).unwrap();
        below += u64::from(bound.estimate.upper() < 0.95);
        risk = bound.risk;
        let interval = tolerance_interval(&sample, coverage, confidence(0.9), witness()).unwrap();
        enclosed += u64::from(interval.upper - interval.lower < 0.95);
        enclosed_risk = interval.risk;
    }
    assert_misses_near(below, trials, risk, 0.0);
    assert_misses_near(enclosed, trials, enclosed_risk, 0.0);
}

#[test]
fn quantile_intervals_cover_at_least_as_often_as_they_say() {
    for (seed, level) in (21..).zip([0.05, 0.5, 0.9]) {
        let mut uniform = uniforms(seed);
        let trials = 5000;
        let misses = (0..trials)
            .filter(|_| {
                let values: Vec<f64> = (0..150).map(|_| uniform()).collect();
                let interval = Ordered::new(&values).unwrap().quantile_interval(
                    Probability::new(level).unwrap(),
                    confidence(0.9),
                    Sides::Two,
                    witness(),
                );
                !(interval.lower() <= level && level <= interval.upper())
            })
            .count();
        assert_misses_at_most(misses as u64, trials, 0.1);
    }
}

#[test]
fn students_interval_of_normal_differences_is_exact_and_that_of_the_median_conservative() {
    // Differences of pairs that share a large common part, normal with mean 0.3.
    let mut uniform = uniforms(31);
    let trials = 10_000;
    let (mut mean_misses, mut median_misses) = (0, 0);
    for _ in 0..trials {
        let common: Vec<f64> = (0..12).map(|_| 100.0 * uniform()).collect();
        let first: Vec<f64> =
            common.iter().map(|c| c + 0.3 - normal::upper_point(uniform())).collect();
        let difference = PairedDifference::of(&first, &common, confidence(0.9), witness()).unwrap();
        let misses = |e: &Estimate| u64::from(!(e.lower() <= 0.3 && 0.3 <= e.upper()));
        mean_misses += misses(&difference.mean);
        median_misses += misses(&difference.median);
    }
    assert_misses_near(mean_misses, trials, 0.1, 0.0);
    assert_misses_at_most(median_misses, trials, 0.1);
}

#[test]
fn intervals_from_replicates_cover_about_as_often_as_they_say() {
    // Means of ln u over ten replicates of sixteen strata of u, and shares of u v < 0.3.
    let independent = Drawing::LatinHypercube.independent_replicates(10).unwrap();
    let trials = 4000;
    let mut uniform = uniforms(41);
    let mut misses = [0; 2];
    let share = 0.3 * (1.0 - 0.3_f64.ln());
    for _ in 0..trials {
        let mut values = [vec![], vec![]];
        for _ in 0..10 {
            let (mut mean, mut bad) = (0.0, 0.0);
            for stratum in 0..16 {
                let u = (f64::from(stratum) + uniform()) / 16.0;
                mean += u.ln() / 16.0;
                bad += if u * uniform() < 0.3 { 1.0 / 16.0 } else { 0.0 };
            }
            values[0].push(mean);
            values[1].push(bad);
        }
        for ((values, truth), misses) in values.iter().zip([-1.0, share]).zip(&mut misses) {
            // All replicates alike gives no interval: it cannot miss.
            if let Ok(found) = of_replicates(values, confidence(0.9), independent)
                && !(found.lower() <= truth && truth <= found.upper())
            {
                *misses += 1;
            }
        }
    }
    // Means of 16 values are not quite normal: approximate by design, within three hundredths.
    misses.iter().for_each(|misses| assert_misses_near(*misses, trials, 0.1, 0.03));
}

#[test]
fn intervals_of_quantiles_over_replicates_cover_about_as_often_as_they_say() {
    // The 5 % point of u + v over replicates of 100 strata of u, five values beyond it in each: √0.1.
    let level = Probability::new(0.05).unwrap();
    let quantile = |values: &[f64]| Ordered::new(values).unwrap().quantile(level);
    for (seed, replicates) in [(61, 4), (62, 8), (63, 30)] {
        let independent = Drawing::LatinHypercube.independent_replicates(replicates).unwrap();
        let mut uniform = uniforms(seed);
        let trials = 2000;
        let misses = (0..trials).filter(|_| {
            let mut replicate = |_| -> Vec<f64> {
                (0..100).map(|i| (f64::from(i) + uniform()) / 100.0 + uniform()).collect()
            };
            let parts: Vec<Vec<f64>> = (0..replicates).map(&mut replicate).collect();
            let values: Vec<f64> = parts.iter().map(|part| quantile(part)).collect();
            let whole = quantile(&parts.concat());
            let found = of_sections(whole, &values, confidence(0.9), independent).unwrap();
            !(found.lower() <= 0.1_f64.sqrt() && 0.1_f64.sqrt() <= found.upper())
        });
        // Approximate by design, within three hundredths.
        assert_misses_near(misses.count() as u64, trials, 0.1, 0.03);
    }
}

#[test]
fn bootstrap_intervals_of_mean_deviation_and_median_cover_about_as_often_as_they_say() {
    // Uniform values: mean 1/2, deviation 1/√12, median 1/2. The bootstrap is approximate: its
    // coverage at n = 60 is known to be a few percent off, which the slack allows for.
    let mean = |values: &mut [f64]| values.iter().sum::<f64>() / values.len() as f64;
    let deviation = |values: &mut [f64]| Moments::of(values).unwrap().standard_deviation().unwrap();
    let median =
        |values: &mut [f64]| Ordered::new(values).unwrap().quantile(Probability::new(0.5).unwrap());
    type Statistic<'a> = &'a dyn Fn(&mut [f64]) -> f64;
    let truths: [(Statistic<'_>, f64); 3] =
        [(&mean, 0.5), (&deviation, 1.0 / 12_f64.sqrt()), (&median, 0.5)];
    for (seed, (statistic, truth)) in (41..).zip(truths) {
        for interval in [BootstrapInterval::Percentile, BootstrapInterval::Bca] {
            let bootstrap = Bootstrap::new(200, confidence(0.9), interval).unwrap();
            let mut uniform = uniforms(seed);
            let mut words = words(seed + 1000);
            let trials = 1000;
            let misses = (0..trials)
                .filter(|_| {
                    let values: Vec<f64> = (0..60).map(|_| uniform()).collect();
                    let e = bootstrap.estimate(&values, statistic, &mut words, witness()).unwrap();
                    !(e.lower() <= truth && truth <= e.upper())
                })
                .count();
            assert_misses_near(misses as u64, trials, 0.1, 0.04);
        }
    }
}
