//! Plans give what their names promise, case by case, whatever was asked before.

use super::super::factorial::generators;
use super::super::fixture::vehicle;
use super::super::strata::inside;
use super::super::{Sampler, Table, resolve};
use super::*;

/// A dispersion of four nozzle and two thrust keys; the first two correlated if asked for.
fn dispersion(more: &str) -> Dispersion {
    let row = |path: &str, class: &str| {
        format!(
            "[[row]]\npath = \"{path}\"\nlevel = \"engine\"\napply = \"scale\"\nsource = \"E\"\n\
             law = {{ kind = \"uniform\", low = 0.9, high = 1.1 }}\nworst = [0.8, 1.2]\n\
             class = \"{class}\"\n"
        )
    };
    let text = [
        row("booster.*.thrust", "flight_day"),
        row("booster.*.nozzle.mass", "unknown"),
        row("booster.*.nozzle.cg", "vehicle"),
        more.to_owned(),
    ];
    let table: Table = toml::from_str(&text.concat()).unwrap();
    resolve(&table, &vehicle(), &mut |key, found, _| panic!("{key}: {found}"))
}

const CORRELATED: &str = "[[correlation]]\nkind = \"rank\"\nsource = \"E\"\n\
    keys = [\"booster.left.nozzle.mass @ engine\", \"booster.right.nozzle.mass @ engine\"]\n\
    matrix = [[1.0, 0.7], [0.7, 1.0]]\n";

fn plan(scheme: &Scheme, cases: u64, dispersion: &Dispersion) -> Plan {
    Plan::new(scheme, cases, dispersion, 3, None).unwrap()
}

/// Uniforms by draw and case.
fn uniforms(plan: &Plan, dispersion: &Dispersion, first: u64, cases: usize) -> Vec<Vec<f64>> {
    let mut all = vec![0.0; dispersion.draws().len() * cases];
    plan.fill(dispersion, first, &mut all);
    all.chunks(cases).map(<[f64]>::to_vec).collect()
}

fn schemes() -> [Scheme; 5] {
    [
        Scheme::MonteCarlo,
        Scheme::LatinHypercube { replicates: 4 },
        Scheme::Sobol { replicates: 4 },
        Scheme::Nested { inner: 10, flight_day_outside: true, allowed_share: 0.1, risk: 0.1 },
        Scheme::Saltelli,
    ]
}

#[test]
fn a_case_is_the_same_in_every_window_and_reading_order() {
    for more in ["", CORRELATED] {
        let dispersion = dispersion(more);
        for scheme in schemes() {
            if scheme.check(160, &dispersion).is_err() {
                continue;
            }
            let plan = plan(&scheme, 160, &dispersion);
            let all = uniforms(&plan, &dispersion, 0, 160);
            assert!(all.iter().flatten().all(|u| *u > 0.0 && *u < 1.0));
            for (first, cases) in [(0, 1), (37, 5), (96, 64), (159, 1)] {
                let part = uniforms(&plan, &dispersion, first, cases);
                for (all, part) in all.iter().zip(part) {
                    assert_eq!(all[first as usize..][..cases], part, "{scheme:?}");
                }
            }
        }
    }
}

#[test]
fn more_cases_keep_the_first_ones_where_the_scheme_says_so() {
    let dispersion = dispersion("");
    for scheme in schemes() {
        let few = uniforms(&plan(&scheme, 80, &dispersion), &dispersion, 0, 80);
        let many = uniforms(&plan(&scheme, 160, &dispersion), &dispersion, 0, 80);
        assert_eq!(few == many, scheme.keeps_first_cases(), "{scheme:?}");
    }
}

/// Counts of the uniforms of a replicate in its strata.
fn strata(uniforms: &[f64], replicate: usize, replicates: usize) -> Vec<u32> {
    let points: Vec<f64> = uniforms.iter().skip(replicate).step_by(replicates).copied().collect();
    let mut counts = vec![0; points.len()];
    points.iter().for_each(|u| counts[(u * points.len() as f64) as usize] += 1);
    counts
}

#[test]
fn every_stratum_of_every_replicate_and_key_holds_one_case_correlated_or_not() {
    for more in ["", CORRELATED] {
        let dispersion = dispersion(more);
        for (cases, replicates) in [(37, 1), (150, 3), (4096, 2), (6000, 1)] {
            let scheme = Scheme::LatinHypercube { replicates };
            let all = uniforms(&plan(&scheme, cases, &dispersion), &dispersion, 0, cases as usize);
            for of_draw in &all {
                for replicate in 0..replicates as usize {
                    let counts = strata(of_draw, replicate, replicates as usize);
                    assert!(counts.iter().all(|count| *count == 1), "{cases}");
                }
            }
        }
    }
}

#[test]
fn the_uniform_in_a_stratum_never_leaves_it() {
    for count in [1, 2, 3, 7, 1000, 999_999_937] {
        for stratum in [0, 1, count / 2, count - 1].into_iter().filter(|s| *s < count) {
            for word in [0, 1, u64::MAX / 2, u64::MAX] {
                let u = inside(stratum, count, word);
                // u and n below 2⁵³ and 2³⁰: the comparison in whole numbers is exact.
                let odd = u128::from((u * 2_f64.powi(53)) as u64);
                let scaled = odd * u128::from(count);
                assert!(
                    scaled >= u128::from(stratum) << 53 && scaled < u128::from(stratum + 1) << 53
                );
            }
        }
    }
}

/// Spearman's correlation of two columns without ties.
fn spearman(a: &[f64], b: &[f64]) -> f64 {
    let ranks = |values: &[f64]| {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|i, j| values[*i].total_cmp(&values[*j]));
        let mut ranks = vec![0.0; values.len()];
        order.iter().enumerate().for_each(|(rank, i)| ranks[*i] = rank as f64);
        ranks
    };
    let n = a.len() as f64;
    let d: f64 = ranks(a).iter().zip(ranks(b)).map(|(x, y)| (x - y) * (x - y)).sum();
    1.0 - 6.0 * d / (n * (n * n - 1.0))
}

#[test]
fn correlated_hypercubes_have_the_rank_correlation_of_their_blocks() {
    // The mean over 200 replicates of 40 points (one block) and over 12 of 2000 points (two blocks
    // of 1000), each within 5 deviations of 1/√(number of points in all): a rank correlation of
    // n pairs has no greater one. A correct program fails once in a million.
    let dispersion = dispersion(CORRELATED);
    let group = &dispersion.groups()[0].draws;
    let rho = 2.0 * (std::f64::consts::PI * 0.7 / 6.0).sin();
    for (points, block, replicates) in [(40, 40.0, 200), (2000, 1000.0, 12)] {
        let cases = points * replicates;
        let scheme = Scheme::LatinHypercube { replicates };
        let all = uniforms(&plan(&scheme, cases, &dispersion), &dispersion, 0, cases as usize);
        let column = |draw: usize, r: u64| -> Vec<f64> {
            all[draw].iter().skip(r as usize).step_by(replicates as usize).copied().collect()
        };
        let mean = (0..replicates)
            .map(|r| spearman(&column(group[0], r), &column(group[1], r)))
            .sum::<f64>()
            / replicates as f64;
        let expected = 6.0 / (std::f64::consts::PI * (block + 1.0))
            * (f64::asin(rho) + (block - 2.0) * f64::asin(rho / 2.0));
        // Blocks beside each other share the strata evenly: their correlation is that of the whole.
        assert!((mean - expected).abs() < 5.0 / (cases as f64).sqrt(), "{mean}, {expected}");
        assert!((expected - 0.7).abs() < 0.6 / block);
    }
}

#[test]
fn copulas_keep_margins_and_give_the_rank_correlation_under_every_random_scheme() {
    // 4096 cases: Spearman within 5/√4096 of 0.7; every margin uniform in 16 intervals (χ², 15
    // degrees of freedom, beyond 53 less than once in 200 000 correct programs).
    let dispersion = dispersion(CORRELATED);
    let group = dispersion.groups()[0].draws.clone();
    for scheme in [Scheme::MonteCarlo, Scheme::Sobol { replicates: 1 }] {
        let sampler = Sampler::new(&dispersion, 5).with_plan(&scheme, 4096, None).unwrap();
        let mut cursor = sampler.cursor();
        let mut columns = vec![Vec::new(); dispersion.draws().len()];
        for case in 0..4096 {
            let values = &cursor.draw_planned(case).values;
            columns.iter_mut().zip(values).for_each(|(c, v)| c.push((v.unwrap() - 0.9) / 0.2));
        }
        let found = spearman(&columns[group[0]], &columns[group[1]]);
        assert!((found - 0.7).abs() < 5.0 / 64.0, "{scheme:?}: {found}");
        for column in &columns {
            let mut counts = [0.0; 16];
            column.iter().for_each(|u| counts[(u * 16.0) as usize] += 1.0);
            let chi: f64 = counts.iter().map(|n| (n - 256.0_f64).powi(2) / 256.0).sum();
            assert!(chi < 53.0, "{scheme:?}: {chi}");
        }
    }
}

#[test]
fn inner_campaigns_share_what_is_known_and_nothing_else() {
    let dispersion = dispersion("");
    for flight_day_outside in [true, false] {
        let scheme =
            Scheme::Nested { inner: 10, flight_day_outside, allowed_share: 0.1, risk: 0.1 };
        let all = uniforms(&plan(&scheme, 50, &dispersion), &dispersion, 0, 50);
        let independent = uniforms(&plan(&Scheme::MonteCarlo, 50, &dispersion), &dispersion, 0, 50);
        for ((draw, of_draw), independent) in dispersion.draws().iter().zip(&all).zip(independent) {
            let outside = match draw.class {
                Class::Vehicle => true,
                Class::FlightDay => flight_day_outside,
                Class::Unknown => false,
            };
            let expected: Vec<f64> =
                (0..50).map(|c| independent[if outside { c / 10 } else { c }]).collect();
            assert_eq!(*of_draw, expected, "{}", draw.key);
        }
    }
}

#[test]
fn the_crossings_of_a_row_take_one_draw_from_the_second_sample() {
    let dispersion = dispersion("");
    let count = dispersion.draws().len();
    let all = uniforms(&plan(&Scheme::Saltelli, 80, &dispersion), &dispersion, 0, 80);
    for row in (0..80).step_by(count + 2) {
        for (draw, of_draw) in all.iter().enumerate() {
            let (first, second) = (of_draw[row], of_draw[row + 1]);
            assert_ne!(first, second);
            for crossed in 0..count {
                let expected = if crossed == draw { second } else { first };
                assert_eq!(of_draw[row + 2 + crossed], expected);
            }
        }
    }
}

#[test]
fn fractions_have_their_resolution_in_the_fewest_runs_known() {
    // Runs of the best two-level fractions (Box, Hunter and Hunter; Xu 2009 for 17 in 256).
    let known = [
        (3, 7, 8),
        (3, 15, 16),
        (4, 8, 16),
        (4, 16, 32),
        (5, 5, 16),
        (5, 6, 32),
        (5, 8, 64),
        (5, 11, 128),
        (5, 17, 256),
    ];
    for (resolution, count, runs) in known {
        let generators = generators(count, Some(resolution));
        let scheme = Scheme::Corners {
            draws: (0..count).collect(),
            at: Levels::Worst,
            generators: generators.clone(),
            resolution: Some(resolution),
        };
        assert_eq!(scheme.own_cases(), Some(runs), "{count} at {resolution}");
        // Every set of fewer than `resolution` factors is balanced: no exclusive or is zero.
        let mut sums = vec![vec![0_u64]];
        for terms in 1..resolution {
            let mut next = Vec::new();
            fn choose(g: &[u64], terms: usize, sum: u64, out: &mut Vec<u64>) {
                if terms == 0 {
                    out.push(sum);
                    return;
                }
                (0..g.len()).for_each(|i| choose(&g[i + 1..], terms - 1, sum ^ g[i], out));
            }
            choose(&generators, terms, 0, &mut next);
            assert!(next.iter().all(|sum| *sum != 0), "{terms} of {count} at {resolution}");
            sums.push(next);
        }
    }
    assert_eq!(generators(4, None), [1, 2, 4, 8]);
}

#[test]
fn designs_put_draws_at_their_levels_and_leave_the_others_nominal() {
    let dispersion = dispersion("");
    let one = Scheme::OneAtATime { draws: vec![1, 4], at: Levels::Scores([-1.0, 1.0]) };
    assert_eq!(one.own_cases(), Some(4));
    let sampler = Sampler::new(&dispersion, 1).with_plan(&one, 4, None).unwrap();
    let mut cursor = sampler.cursor();
    for (case, draw, score) in [(0, 1, -1.0), (1, 1, 1.0), (2, 4, -1.0), (3, 4, 1.0)] {
        let draws = cursor.draw_planned(case);
        assert_eq!(draws.values.iter().flatten().count(), 1);
        // A value and back through the law: a few roundings of Φ and its inverse.
        assert!((draws.scores[draw].unwrap() - score).abs() < 1e-12);
    }
    let corners = Scheme::Corners {
        draws: vec![0, 2, 3],
        at: Levels::Worst,
        generators: generators(3, None),
        resolution: None,
    };
    let sampler = Sampler::new(&dispersion, 1).with_plan(&corners, 8, None).unwrap();
    let mut cursor = sampler.cursor();
    let mut seen = std::collections::BTreeSet::new();
    for case in 0..8 {
        let values = cursor.draw_planned(case).values.clone();
        assert_eq!([values[1], values[4], values[5]], [None; 3]);
        seen.insert([0, 2, 3].map(|draw| (values[draw].unwrap() == 1.2) as u8));
        assert!([0, 2, 3].iter().all(|d| [0.8, 1.2].contains(&values[*d].unwrap())));
    }
    assert_eq!(seen.len(), 8);
}

#[test]
fn listed_cases_are_drawn_as_they_are() {
    let dispersion = dispersion("");
    let columns = (0..6).map(|draw| (draw, vec![1.0, 1.05, 1.5])).collect();
    let listed = Listed { columns };
    let sampler = Sampler::new(&dispersion, 1).with_plan(&Scheme::File, 3, Some(&listed)).unwrap();
    let draws = sampler.cursor().draw_planned(2).clone();
    assert_eq!(draws.values, [Some(1.5); 6]);
    assert_eq!(draws.scores, [None; 6]);
    assert!(Sampler::new(&dispersion, 1).with_plan(&Scheme::File, 4, Some(&listed)).is_err());
    assert!(Sampler::new(&dispersion, 1).with_plan(&Scheme::File, 3, None).is_err());
}

#[test]
fn numbers_of_cases_that_do_not_fit_are_refused_with_one_that_does() {
    let dispersion = dispersion(CORRELATED);
    for (scheme, cases) in [
        (Scheme::LatinHypercube { replicates: 3 }, 100),
        (Scheme::Sobol { replicates: 0 }, 100),
        (schemes()[3].clone(), 101),
        // A prime beyond 1024, with correlated draws.
        (Scheme::LatinHypercube { replicates: 1 }, 10_007),
        (Scheme::Saltelli, 80),
    ] {
        assert!(scheme.check(cases, &dispersion).is_err(), "{scheme:?}");
    }
    let error = Scheme::LatinHypercube { replicates: 1 }.check(10_007, &dispersion).unwrap_err();
    assert!(error.allowed.ends_with("cases = 10240"), "{error}");
    assert!(Scheme::LatinHypercube { replicates: 1 }.check(10_240, &dispersion).is_ok());
}

#[test]
fn sobol_dimensions_follow_the_rows_and_not_the_text_of_the_keys() {
    let first = dispersion("");
    let more = "[[row]]\npath = \"booster.*.mass_flow\"\nlevel = \"engine\"\n\
        apply = \"scale\"\nsource = \"E\"\nlaw = { kind = \"uniform\", low = 0.9, high = 1.1 }\n";
    let second = dispersion(more);
    let scheme = Scheme::Sobol { replicates: 1 };
    let [one, two] = [&first, &second].map(|d| uniforms(&plan(&scheme, 64, d), d, 0, 64));
    for (draw, uniforms) in first.draws().iter().zip(one) {
        assert_eq!(two[second.index(&draw.key).unwrap()], uniforms, "{}", draw.key);
    }
}
