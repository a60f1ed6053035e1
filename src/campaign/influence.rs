//! The influence of every draw over a campaign, from the eigenvalue derivatives of its cases.
//!
//! All draws are functions of independent standard normal scores z. So the mean of ∂f/∂z_i is the linear
//! regression coefficient of f on z_i (Stein 1981), its square over Var f the share of the variance that is
//! linear in z_i, and E[(∂f/∂z_i)²]/Var f an upper bound of the total index of z_i (Poincaré's inequality;
//! Sobol' and Kucherenko 2009). Where derivatives come from is decided in `derivative`.

use super::derivative::Sensitivity;
use super::sample::CONFIDENCE;
use crate::stats::{Confidence, Drawing, Estimate, RunningMoments, Sides};

/// What one draw does to the damping ratio over a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence {
    /// Index of the draw.
    pub draw: usize,
    /// Mean change of the damping ratio per σ.
    pub mean: f64,
    /// Its 95 % interval, where the cases are independent draws.
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
#[derive(Debug, Clone, Default)]
pub struct Influences {
    damping: RunningMoments,
    signed: Vec<RunningMoments>,
    modulus: Vec<RunningMoments>,
    /// Cases taken in.
    pub cases: u64,
    /// Of these, cases near veering, whose derivatives hold for small changes only.
    pub veering: u64,
}

impl Influences {
    /// Takes in a case.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn add(
        &mut self,
        damping_ratio: f64,
        sensitivity: &Sensitivity,
    ) -> Result<(), crate::stats::Error> {
        let count = sensitivity.damping_ratio.len();
        self.signed.resize_with(count, RunningMoments::default);
        self.modulus.resize_with(count, RunningMoments::default);
        self.damping.push(damping_ratio)?;
        self.cases += 1;
        self.veering += u64::from(sensitivity.is_veering());
        for (index, by) in sensitivity.damping_ratio.iter().enumerate() {
            if let Some(by) = by {
                self.signed[index].push(*by)?;
                self.modulus[index].push(by.abs())?;
            }
        }
        Ok(())
    }

    /// The influences, greatest first, of cases that came about by `drawing`.
    pub fn ranking(&self, drawing: Drawing) -> Vec<Influence> {
        let variance = self.damping.moments().standard_deviation().map(|sd| sd * sd);
        let variance = variance.filter(|variance| *variance > 0.0);
        let independent = drawing.independent().ok();
        let confidence = Confidence::new(CONFIDENCE).ok();
        let interval = |of: &RunningMoments| {
            let ends = |estimate: Estimate| [estimate.lower(), estimate.upper()];
            of.moments().mean_interval(confidence?, Sides::Two, independent?).ok().map(ends)
        };
        let mut all = Vec::new();
        for (draw, (signed, modulus)) in self.signed.iter().zip(&self.modulus).enumerate() {
            let moments = signed.moments();
            let (Some(mean), Some(mean_modulus)) = (moments.mean(), modulus.moments().mean())
            else {
                continue;
            };
            let mean_interval = interval(signed);
            let standard_deviation = moments.standard_deviation();
            let spread = standard_deviation.unwrap_or(0.0);
            all.push(Influence {
                draw,
                mean,
                mean_interval,
                mean_modulus,
                mean_modulus_interval: interval(modulus),
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
    use crate::dispersion::normal;

    /// f = 3 + 2 z_0 − z_1 + z_2²/2 on a regular grid of the normal distribution.
    fn influences() -> Influences {
        let steps = 15;
        let score = |i: usize| {
            let below = (i as f64 + 0.5) / steps as f64;
            normal::score(below, 1.0 - below)
        };
        let mut all = Influences::default();
        for i in 0..steps * steps * steps {
            let z = [score(i % steps), score(i / steps % steps), score(i / steps / steps)];
            let value = 3.0 + 2.0 * z[0] - z[1] + 0.5 * z[2] * z[2];
            let by = vec![Some(2.0), Some(-1.0), Some(z[2]), None];
            let sensitivity =
                Sensitivity { damping_ratio: by, real_part_rad_s: vec![], curvature: Some(0.0) };
            all.add(value, &sensitivity).unwrap();
        }
        all
    }

    #[test]
    fn shares_of_a_linear_part_and_bounds_of_a_square_are_those_of_the_closed_form() {
        let all = influences().ranking(Drawing::Independent);
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
        for influence in influences().ranking(Drawing::Selected) {
            assert_eq!((influence.mean_interval, influence.mean_modulus_interval), (None, None));
        }
        assert!(influences().ranking(Drawing::Independent)[2].mean_interval.is_some());
    }
}
