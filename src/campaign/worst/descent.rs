//! Descent inside a convex region of normal scores: spectral projected gradient (Birgin, Martínez and
//! Raydan 2000, SIAM J. Optim. 10), monotone.
//!
//! What is made less is a closure; vehicles are not known here.

use serde::{Deserialize, Serialize};

/// A region of independent normal scores about the median.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Region {
    /// Every score within ±n.
    Box(f64),
    /// The root sum of squares within n: equal joint likelihood on its surface.
    Ball(f64),
}

impl Region {
    /// The nearest point of the region.
    pub fn project(self, z: &mut [f64]) {
        match self {
            Self::Box(n) => z.iter_mut().for_each(|z| *z = z.clamp(-n, n)),
            Self::Ball(n) => {
                let length = norm(z);
                if length > n {
                    z.iter_mut().for_each(|z| *z *= n / length);
                }
            }
        }
    }

    /// What a linear objective of gradient `g` still loses from `z` to the worst point of the region; zero
    /// at a stationary point.
    pub fn gap(self, z: &[f64], g: &[f64]) -> f64 {
        let here: f64 = z.iter().zip(g).map(|(z, g)| z * g).sum();
        here + match self {
            Self::Box(n) => n * g.iter().map(|g| g.abs()).sum::<f64>(),
            Self::Ball(n) => n * norm(g),
        }
    }

    /// The worst point of the region for a linear objective of gradient `g`; zero where g is.
    pub fn worst(self, g: &[f64]) -> Vec<f64> {
        match self {
            Self::Box(n) => {
                let side = |g: &f64| if *g == 0.0 { 0.0 } else { -n * g.signum() };
                g.iter().map(side).collect()
            }
            Self::Ball(n) => {
                let length = norm(g);
                g.iter().map(|g| if length > 0.0 { -n * g / length } else { 0.0 }).collect()
            }
        }
    }

    fn size(self) -> f64 {
        match self {
            Self::Box(n) | Self::Ball(n) => n,
        }
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// An objective at a point, with what is needed to go on from there.
#[derive(Debug, Clone)]
pub struct At<P> {
    /// The objective.
    pub value: f64,
    /// Its gradient by the scores.
    pub gradient: Vec<f64>,
    /// What else belongs to the point.
    pub point: P,
}

/// Where a descent ended.
#[derive(Debug, Clone)]
pub struct End<P> {
    /// The scores.
    pub z: Vec<f64>,
    /// The objective there.
    pub at: At<P>,
    /// [`Region::gap`] there.
    pub gap: f64,
    /// Whether the gap is below what was asked for.
    pub converged: bool,
    /// Times the objective was asked for.
    pub evaluations: usize,
}

/// Share of the linear prediction that a step must gain (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// Halvings after which no step gains.
const MOST_HALVINGS: usize = 14;
/// Iterations after which a descent ends where it is.
const MOST_ITERATIONS: usize = 200;
/// Greatest step along the gradient, in sizes of the region over its greatest entry.
const GREATEST: f64 = 1e3;

/// Descends from `z`, a point of `region` at which the objective is `at`, until [`Region::gap`] is at most
/// `allowed`. `evaluate(z, from)` is the objective at z, coming from another point of the path, or `None`
/// where that cannot be: a step there is halved.
pub fn descend<P: Clone>(
    region: Region,
    mut z: Vec<f64>,
    mut at: At<P>,
    allowed: f64,
    mut evaluate: impl FnMut(&[f64], &At<P>) -> Option<At<P>>,
) -> End<P> {
    let mut evaluations = 0;
    let mut step: Option<f64> = None;
    for _ in 0..MOST_ITERATIONS {
        let gap = region.gap(&z, &at.gradient);
        if gap <= allowed {
            return End { z, at, gap, converged: true, evaluations };
        }
        let greatest = at.gradient.iter().fold(0.0_f64, |most, g| most.max(g.abs()));
        let limit = GREATEST * region.size() / greatest;
        let along = step.map_or(limit, |step| step.min(limit));
        let mut target: Vec<f64> = z.iter().zip(&at.gradient).map(|(z, g)| z - along * g).collect();
        region.project(&mut target);
        let slope: f64 =
            z.iter().zip(&target).zip(&at.gradient).map(|((z, t), g)| (t - z) * g).sum();
        let mut share = 1.0;
        let mut next = None;
        for _ in 0..MOST_HALVINGS {
            let trial: Vec<f64> = z.iter().zip(&target).map(|(z, t)| z + share * (t - z)).collect();
            evaluations += 1;
            if let Some(found) = evaluate(&trial, &at)
                && found.value <= at.value + SUFFICIENT * share * slope
            {
                next = Some((trial, found));
                break;
            }
            share /= 2.0;
        }
        let Some((trial, found)) = next else {
            return End { z, at, gap, converged: false, evaluations };
        };
        // Barzilai and Borwein's step; a concave stretch has none and goes as far as it can.
        let (mut moved, mut turned) = (0.0, 0.0);
        for i in 0..z.len() {
            let s = trial[i] - z[i];
            moved += s * s;
            turned += s * (found.gradient[i] - at.gradient[i]);
        }
        step = (turned > 0.0).then(|| moved / turned);
        (z, at) = (trial, found);
    }
    let gap = region.gap(&z, &at.gradient);
    End { converged: gap <= allowed, z, at, gap, evaluations }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quadratic Σ ½ a_i (z_i − c_i)².
    fn quadratic<'a>(
        a: &'a [f64],
        c: &'a [f64],
    ) -> impl Fn(&[f64], &At<()>) -> Option<At<()>> + 'a {
        move |z, _| {
            let gradient: Vec<f64> = (0..z.len()).map(|i| a[i] * (z[i] - c[i])).collect();
            let value = (0..z.len()).map(|i| 0.5 * a[i] * (z[i] - c[i]).powi(2)).sum();
            Some(At { value, gradient, point: () })
        }
    }

    fn run(region: Region, a: &[f64], c: &[f64]) -> End<()> {
        let evaluate = quadratic(a, c);
        let start = vec![0.1; a.len()];
        let dummy = At { value: 0.0, gradient: Vec::new(), point: () };
        let at = evaluate(&start, &dummy).unwrap();
        descend(region, start, at, 1e-12, evaluate)
    }

    #[test]
    fn a_convex_quadratic_in_a_box_is_least_at_its_clamped_centre() {
        let (a, c) = ([1.0, 10.0, 100.0, 3.0], [5.0, -7.0, 0.3, -0.2]);
        let end = run(Region::Box(3.0), &a, &c);
        assert!(end.converged);
        for (z, expected) in end.z.iter().zip([3.0, -3.0, 0.3, -0.2]) {
            assert!((z - expected).abs() < 1e-7, "{:?}", end.z);
        }
    }

    #[test]
    fn a_concave_quadratic_in_a_box_ends_in_a_vertex() {
        let end = run(Region::Box(3.0), &[-1.0, -2.0], &[0.5, -0.5]);
        assert_eq!(end.z, [-3.0, 3.0]);
    }

    #[test]
    fn a_linear_objective_in_a_ball_is_least_against_its_gradient() {
        let g = [3.0, -4.0];
        let linear = |z: &[f64], _: &At<()>| {
            let value = z.iter().zip(&g).map(|(z, g)| z * g).sum();
            Some(At { value, gradient: g.to_vec(), point: () })
        };
        let dummy = At { value: 0.0, gradient: g.to_vec(), point: () };
        let end = descend(Region::Ball(2.0), vec![0.0, 0.0], dummy, 1e-12, linear);
        assert!((end.at.value + 10.0).abs() < 1e-9, "{}", end.at.value);
        assert!((end.z[0] + 1.2).abs() < 1e-9 && (end.z[1] - 1.6).abs() < 1e-9);
        assert!((Region::Ball(2.0).worst(&g)[0] + 1.2).abs() < 1e-12);
    }

    #[test]
    fn a_step_that_cannot_be_followed_is_halved() {
        // The path may only be followed in steps of less than one.
        let (a, c) = ([1.0], [10.0]);
        let inner = quadratic(&a, &c);
        let follow = |z: &[f64], from: &At<f64>| {
            let dummy = At { value: 0.0, gradient: Vec::new(), point: () };
            let found = inner(z, &dummy)?;
            let near = (z[0] - from.point).abs() < 1.0;
            near.then(|| At { value: found.value, gradient: found.gradient, point: z[0] })
        };
        let at = At { value: 50.0, gradient: vec![-10.0], point: 0.0 };
        let end = descend(Region::Box(3.0), vec![0.0], at, 1e-9, follow);
        assert!((end.z[0] - 3.0).abs() < 1e-9 && end.converged);
    }
}
