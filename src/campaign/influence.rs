//! The influence of every draw over a campaign, from the eigenvalue derivatives of its cases.
//!
//! All draws are functions of independent standard normal scores z. So the mean of ∂f/∂z_i is the linear
//! regression coefficient of f on z_i (Stein 1981), its square over Var f the share of the variance that is
//! linear in z_i, and E[(∂f/∂z_i)²]/Var f an upper bound of the total index of z_i (Poincaré's inequality;
//! Sobol' and Kucherenko 2009). Where derivatives come from is decided in `derivative`.

use super::derivative::Sensitivity;
use super::sample::{CONFIDENCE, Intervals, Sample, ends};
use crate::stats::{Confidence, Independent, RunningMoments, Sides, of_replicates};

/// What one draw does to the damping ratio over a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence {
    /// Index of the draw.
    pub draw: usize,
    /// Mean change of the damping ratio per σ.
    pub mean: f64,
    /// Its 95 % interval: of independent draws, or over replicates or outer draws; none where neither are.
    pub mean_interval: Option<[f64; 2]>,
    /// Mean of its modulus.
    pub mean_modulus: f64,
    /// 95 % interval of that.
    pub mean_modulus_interval: Option<[f64; 2]>,
    /// Standard deviation over the cases.
    pub standard_deviation: Option<f64>,
    /// Share of the variance that is linear in the score.
    pub share: Option<f64>,
    /// Upper bound of the total index.
    pub total_bound: Option<f64>,
}

/// The influences of all draws on one mode in one variant at one flight time.
#[derive(Debug, Clone)]
pub struct Influences {
    sample: Sample,
    damping: RunningMoments,
    signed: Vec<RunningMoments>,
    modulus: Vec<RunningMoments>,
    /// Of every replicate or outer draw and key, where intervals come from these: sum of the changes, sum of
    /// their moduli, and their number.
    clusters: Vec<Vec<[f64; 3]>>,
    /// Cases taken in.
    pub cases: u64,
    /// Of these, cases near veering, whose derivatives hold for small changes only.
    pub veering: u64,
}

impl Influences {
    /// Of no case yet of a sample.
    pub fn new(sample: Sample) -> Self {
        Self {
            sample,
            damping: RunningMoments::default(),
            signed: Vec::new(),
            modulus: Vec::new(),
            clusters: Vec::new(),
            cases: 0,
            veering: 0,
        }
    }

    /// Takes in a case by its number.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn add(
        &mut self,
        case: u64,
        damping_ratio: f64,
        sensitivity: &Sensitivity,
    ) -> Result<(), crate::stats::Error> {
        let count = sensitivity.damping_ratio.len();
        self.signed.resize_with(count, RunningMoments::default);
        self.modulus.resize_with(count, RunningMoments::default);
        self.damping.push(damping_ratio)?;
        self.cases += 1;
        self.veering += u64::from(sensitivity.is_veering());
        let cluster = self.sample.drawing().independent().is_err().then(|| {
            let cluster = self.sample.cluster(case);
            self.clusters.resize_with(self.clusters.len().max(cluster + 1), Vec::new);
            self.clusters[cluster].resize(count, [0.0; 3]);
            cluster
        });
        for (index, by) in sensitivity.damping_ratio.iter().enumerate() {
            if let Some(by) = by {
                self.signed[index].push(*by)?;
                self.modulus[index].push(by.abs())?;
                if let Some(cluster) = cluster {
                    let [signed, modulus, count] = &mut self.clusters[cluster][index];
                    (*signed, *modulus, *count) = (*signed + by, *modulus + by.abs(), *count + 1.0);
                }
            }
        }
        Ok(())
    }

    /// Student's interval of the mean of the changes by a key, or of their moduli (`which` 0 and 1): over the cases
    /// where they are independent, else over the means of replicates or outer draws.
    fn interval(&self, key: usize, which: usize) -> Option<[f64; 2]> {
        let confidence = Confidence::new(CONFIDENCE).ok()?;
        if let Ok(independent) = self.sample.drawing().independent() {
            let of = [&self.signed, &self.modulus][which][key].moments();
            return of.mean_interval(confidence, Sides::Two, independent).ok().map(ends);
        }
        let means = self.clusters.iter().map(|cluster| {
            let [.., count] = cluster.get(key)?;
            (*count > 0.0).then(|| cluster[key][which] / count)
        });
        let means: Vec<f64> = means.collect::<Option<_>>()?;
        of_replicates(&means, confidence, self.independent()?).ok().map(ends)
    }

    fn independent(&self) -> Option<Independent> {
        let clusters = self.clusters.len() as u64;
        self.sample.drawing().independent_replicates(clusters).ok()
    }

    /// Where the intervals of the ranking come from.
    pub fn intervals(&self) -> Intervals {
        if self.sample.drawing().independent().is_ok() {
            Intervals::Independent
        } else if self.independent().is_some() {
            Intervals::Replicates
        } else {
            Intervals::None
        }
    }

    /// The influences, greatest first.
    pub fn ranking(&self) -> Vec<Influence> {
        let variance = self.damping.moments().standard_deviation().map(|sd| sd * sd);
        let variance = variance.filter(|variance| *variance > 0.0);
        let mut all = Vec::new();
        for (draw, (signed, modulus)) in self.signed.iter().zip(&self.modulus).enumerate() {
            let moments = signed.moments();
            let (Some(mean), Some(mean_modulus)) = (moments.mean(), modulus.moments().mean())
            else {
                continue;
            };
            let mean_interval = self.interval(draw, 0);
            let standard_deviation = moments.standard_deviation();
            let spread = standard_deviation.unwrap_or(0.0);
            all.push(Influence {
                draw,
                mean,
                mean_interval,
                mean_modulus,
                mean_modulus_interval: self.interval(draw, 1),
                standard_deviation,
                share: variance.map(|variance| mean * mean / variance),
                total_bound: variance.map(|variance| (mean * mean + spread * spread) / variance),
            });
        }
        all.sort_by(|a, b| b.mean_modulus.total_cmp(&a.mean_modulus).then(a.draw.cmp(&b.draw)));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispersion::{Sampler, Scheme, fixture, normal};
    use crate::scenario::dispersion;
    use crate::stats::Drawing;

    /// f = 3 + 2 z_0 − z_1 + z_2²/2 on a regular grid of the normal distribution.
    fn influences(sample: Sample) -> Influences {
        let steps = 15;
        let score = |i: usize| {
            let below = (i as f64 + 0.5) / steps as f64;
            normal::score(below, 1.0 - below)
        };
        let mut all = Influences::new(sample);
        for i in 0..steps * steps * steps {
            let z = [score(i % steps), score(i / steps % steps), score(i / steps / steps)];
            let value = 3.0 + 2.0 * z[0] - z[1] + 0.5 * z[2] * z[2];
            let by = vec![Some(2.0), Some(-1.0), Some(z[2]), None];
            let sensitivity =
                Sensitivity { damping_ratio: by, real_part_rad_s: vec![], curvature: Some(0.0) };
            all.add(i as u64, value, &sensitivity).unwrap();
        }
        all
    }

    #[test]
    fn shares_of_a_linear_part_and_bounds_of_a_square_are_those_of_the_closed_form() {
        let all = influences(Sample::INDEPENDENT).ranking();
        let of = |draw: usize| all.iter().find(|influence| influence.draw == draw).unwrap();
        // Var f = 4 + 1 + ½; the grid of 15 points has a variance of 0.93 in place of one and less in its
        // square.
        assert!((of(0).share.unwrap() - 4.0 / 5.5).abs() < 0.1);
        assert!((of(1).share.unwrap() - 1.0 / 5.5).abs() < 0.05);
        assert!(of(2).share.unwrap() < 1e-12 && of(2).total_bound.unwrap() > 0.5 / 5.5);
        assert_eq!(of(0).standard_deviation, Some(0.0));
        assert_eq!(
            all.iter().map(|i| i.draw).collect::<Vec<_>>(),
            [0, 1, 2],
            "and the key without a slope is left out"
        );
    }

    #[test]
    fn cases_that_are_no_independent_draws_have_no_intervals() {
        for (drawing, replicates) in [(Drawing::Selected, 4), (Drawing::LatinHypercube, 1)] {
            let found = influences(Sample::turns(drawing, replicates));
            assert_eq!(found.intervals(), Intervals::None);
            for influence in found.ranking() {
                assert_eq!(
                    (influence.mean_interval, influence.mean_modulus_interval),
                    (None, None)
                );
            }
        }
        assert!(influences(Sample::INDEPENDENT).ranking()[2].mean_interval.is_some());
    }

    #[test]
    fn replicates_give_students_interval_over_their_own_means() {
        let mut all = Influences::new(Sample::turns(Drawing::LowDiscrepancy, 3));
        for (case, by) in [1.0, 2.0, 4.0, 2.0, 2.0, -5.0].into_iter().enumerate() {
            let by = vec![Some(by)];
            let sensitivity =
                Sensitivity { damping_ratio: by, real_part_rad_s: vec![], curvature: None };
            all.add(case as u64, 0.1, &sensitivity).unwrap();
        }
        assert_eq!(all.intervals(), Intervals::Replicates);
        let found = &all.ranking()[0];
        // Means 1.5, 2, −0.5 of the replicates, 1.5, 2, 4.5 of the moduli, and the tabulated t(0.975, 2) = 4.302653.
        let expected = |means: [f64; 3]| {
            let mean = means.iter().sum::<f64>() / 3.0;
            let square = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 2.0;
            let half = 4.302_653 * (square / 3.0).sqrt();
            [mean - half, mean + half]
        };
        for (found, means) in [
            (found.mean_interval, [1.5, 2.0, -0.5]),
            (found.mean_modulus_interval, [1.5, 2.0, 4.5]),
        ] {
            let (found, expected) = (found.unwrap(), expected(means));
            assert!(
                (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-5),
                "{found:?} {expected:?}"
            );
        }
    }

    /// Coverage by simulation of whole plans: derivatives z₀² (mean 1) and z₁ − z₀/2 − 0.3 (mean −0.3).
    #[test]
    fn intervals_over_the_replicates_of_plans_cover_about_as_often_as_they_say() {
        let row = |path: &str| {
            format!(
                "[[row]]\npath = \"{path}\"\nlaw = {{ kind = \"normal\", mean = 1.0, sigma = 0.01 }}\n\
                 apply = \"scale\"\nlevel = \"vehicle\"\nsource = \"test\"\n"
            )
        };
        let text = row("booster.*.thrust") + &row("booster.*.nozzle.mass");
        let dispersion = dispersion::read("test", &text, &fixture::vehicle()).unwrap();
        let (replicates, cases, trials) = (8, 128, 1500);
        for (scheme, drawing) in [
            (Scheme::LatinHypercube { replicates }, Drawing::LatinHypercube),
            (Scheme::Sobol { replicates }, Drawing::LowDiscrepancy),
        ] {
            let mut misses = [0; 2];
            for seed in 0..trials {
                let sampler =
                    Sampler::new(&dispersion, seed).with_plan(&scheme, cases, None).unwrap();
                let mut cursor = sampler.cursor();
                let mut all = Influences::new(Sample::turns(drawing, replicates as usize));
                for case in 0..cases {
                    let scores = &cursor.draw_planned(case).scores;
                    let z = [scores[0].unwrap(), scores[1].unwrap()];
                    let by = vec![Some(z[0] * z[0]), Some(z[1] - 0.5 * z[0] - 0.3)];
                    let sensitivity =
                        Sensitivity { damping_ratio: by, real_part_rad_s: vec![], curvature: None };
                    all.add(case, 0.1, &sensitivity).unwrap();
                }
                let ranking = all.ranking();
                for (draw, truth) in [1.0, -0.3].into_iter().enumerate() {
                    let of = ranking.iter().find(|influence| influence.draw == draw).unwrap();
                    let [low, high] = of.mean_interval.unwrap();
                    misses[draw] += u64::from(!(low <= truth && truth <= high));
                }
            }
            // 75 of 1500 expected; means of 16 values in a replicate are not quite normal, which the rates 3 % to
            // 7.5 % allow for: beyond five deviations of either a correct program comes once in a million trials.
            let deviation = |rate: f64| (rate * (1.0 - rate) / trials as f64).sqrt();
            for missed in misses {
                let rate = missed as f64 / trials as f64;
                assert!(rate < 0.075 + 5.0 * deviation(0.075), "{drawing:?}: {missed} missed");
                assert!(rate > 0.03 - 5.0 * deviation(0.03), "{drawing:?}: {missed} missed");
            }
        }
    }
}
