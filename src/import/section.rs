//! Motion of a section: translation and rotation of a set of grids by weighted least squares.
//!
//! A solid or shell model carries no usable rotations, and the rotation of a single grid is that of
//! its element, not of the structure. The rigid motion nearest to that of several grids is, as
//! far as they move as one; the misfit says how far. Which grids belong together is the user's.

use nalgebra::{Matrix3, Vector3};

/// Least to greatest principal second moment below which grids lie on a line, about which their
/// translations tell no rotation: (a thousandth of the extent)².
const LINE: f64 = 1e-6;

/// Grids whose motion gives that of one point.
#[derive(Debug, Clone)]
pub struct Section {
    /// Places of the grids in the model.
    pub nodes: Vec<usize>,
    /// Point to which the motion refers, m.
    pub at_m: Vector3<f64>,
    /// Weights, sum 1.
    weights: Vec<f64>,
    /// Positions from the weighted centroid, m.
    arms_m: Vec<Vector3<f64>>,
    /// From the weighted centroid to the point.
    to_point_m: Vector3<f64>,
    /// Inverse of `Σ w (a² 1 − a aᵀ)`, 1/m².
    inverse: Matrix3<f64>,
}

/// Why grids make no section.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Degenerate {
    /// Fewer than three.
    #[error("{0} grids")]
    Few(usize),
    /// On a line.
    #[error("{0} grids on one line, about which their translations tell no rotation")]
    Line(usize),
    /// A weight that is not above zero, or as many weights as grids.
    #[error("{weights} weights for {grids} grids")]
    Weights {
        /// Number of weights.
        weights: usize,
        /// Number of grids.
        grids: usize,
    },
}

/// Motion of a section in one mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Translation of the point, as the shape's.
    pub shape: Vector3<f64>,
    /// Rotation, as the shape's per metre.
    pub slope: Vector3<f64>,
    /// Weighted root mean square of what the rigid motion leaves, as the shape's.
    pub misfit: f64,
    /// The misfit over the root mean square of the motion, 0 to 1.
    pub residual: f64,
    /// Standard deviation of the rotation if the misfit is taken for scatter between grids, as the
    /// shape's per metre. Zero where three grids leave none.
    pub scatter: f64,
    /// Standard deviation of the rotation from the rounding of the stored translations, as the
    /// shape's per metre.
    pub rounding: f64,
}

impl Section {
    /// The grids at `nodes` of a model, their motion referred to `at_m` (default: their weighted
    /// centroid); no weights are equal weights.
    ///
    /// # Errors
    /// See [`Degenerate`].
    pub fn new(
        nodes: Vec<usize>,
        positions_m: &[Vector3<f64>],
        weights: &[f64],
        at_m: Option<Vector3<f64>>,
    ) -> Result<Self, Degenerate> {
        let n = nodes.len();
        if n < 3 {
            return Err(Degenerate::Few(n));
        }
        let weights = if weights.is_empty() { vec![1.0; n] } else { weights.to_vec() };
        let sum: f64 = weights.iter().sum();
        if weights.len() != n || !weights.iter().all(|&w| w > 0.0) || !sum.is_finite() {
            return Err(Degenerate::Weights { weights: weights.len(), grids: n });
        }
        let weights: Vec<f64> = weights.iter().map(|w| w / sum).collect();
        let centroid: Vector3<f64> =
            nodes.iter().zip(&weights).map(|(&i, w)| positions_m[i] * *w).sum();
        let arms_m: Vec<_> = nodes.iter().map(|&i| positions_m[i] - centroid).collect();
        let moment: Matrix3<f64> = (arms_m.iter().zip(&weights))
            .map(|(a, w)| {
                (Matrix3::from_diagonal_element(a.norm_squared()) - a * a.transpose()) * *w
            })
            .sum();
        let principal = moment.symmetric_eigenvalues();
        let inverse = moment.try_inverse().filter(|_| principal.min() > LINE * principal.max());
        let at_m = at_m.unwrap_or(centroid);
        Ok(Self {
            to_point_m: at_m - centroid,
            inverse: inverse.ok_or(Degenerate::Line(n))?,
            nodes,
            at_m,
            weights,
            arms_m,
        })
    }

    /// The rigid motion nearest to `shape`, the translations of all grids of the model, stored with
    /// the relative rounding `rounding` (half a unit in the last place).
    ///
    /// With arms a from the weighted centroid and `N = Σ w (a² 1 − a aᵀ)`, the least squares give
    /// `θ = N⁻¹ Σ w a × u` and the mean translation; misfits e of root mean square s have `3n − 6`
    /// degrees of freedom and scatter θ by `N⁻¹ (Σ w² (a² 1 − a aᵀ) σ²) N⁻¹`, roundings likewise.
    pub fn fit(&self, shape: &[Vector3<f64>], rounding: f64) -> Fit {
        let motions = || self.nodes.iter().map(|&i| &shape[i]);
        let mean: Vector3<f64> = motions().zip(&self.weights).map(|(u, w)| u * *w).sum();
        let moment: Vector3<f64> = (motions().zip(&self.arms_m).zip(&self.weights))
            .map(|((u, a), w)| a.cross(&(u - mean)) * *w)
            .sum();
        let slope = self.inverse * moment;
        let n = self.nodes.len() as f64;
        let (mut misfit, mut motion) = (0.0, 0.0);
        let (mut spread, mut rounded) = (Matrix3::zeros(), Matrix3::zeros());
        for ((u, a), &w) in motions().zip(&self.arms_m).zip(&self.weights) {
            misfit += w * (u - mean - slope.cross(a)).norm_squared();
            motion += w * u.norm_squared();
            let lever =
                (Matrix3::from_diagonal_element(a.norm_squared()) - a * a.transpose()) * (w * w);
            spread += lever;
            // Uniform rounding within ± δ|u| has the variance (δ|u|)²/3 in each direction.
            rounded += lever * (rounding * rounding * u.norm_squared() / 3.0);
        }
        let deviation =
            |levers: Matrix3<f64>| (self.inverse * levers * self.inverse).trace().max(0.0).sqrt();
        let freedoms = 3.0 * n - 6.0;
        let variance = misfit * n / freedoms;
        Fit {
            shape: mean + slope.cross(&self.to_point_m),
            slope,
            misfit: misfit.sqrt(),
            residual: if motion > 0.0 { (misfit / motion).sqrt() } else { 0.0 },
            scatter: deviation(spread) * variance.sqrt(),
            rounding: deviation(rounded),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispersion::stream::Stream;
    use proptest::prelude::*;

    fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = Vector3<f64>> {
        [range.clone(), range.clone(), range].prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn a_rigid_motion_gives_its_exact_rotation_and_translation_whatever_the_weights(
            positions in proptest::collection::vec(vector(-3.0..3.0), 4..12),
            far in vector(-100.0..100.0),
            t in vector(-1.0..1.0),
            theta in vector(-1.0..1.0),
            weights in proptest::collection::vec(0.1..10.0_f64, 12),
        ) {
            let positions: Vec<_> = positions.iter().map(|p| p + far).collect();
            let nodes: Vec<usize> = (0..positions.len()).collect();
            let made = Section::new(nodes, &positions, &weights[..positions.len()], Some(far));
            // Random grids that happen to lie on a line are refused, and that is all.
            prop_assume!(made.is_ok());
            let section = made.unwrap();
            let shape: Vec<_> = positions.iter().map(|p| t + theta.cross(p)).collect();
            let fit = section.fit(&shape, 0.0);
            // Round-off of motions up to 200 over arms of metres, by the worst accepted moment.
            let bound = 64.0 * f64::EPSILON * 200.0 / LINE.sqrt();
            prop_assert!((fit.slope - theta).norm() < bound, "{}", fit.slope - theta);
            prop_assert!((fit.shape - (t + theta.cross(&far))).norm() < bound);
            prop_assert!(fit.residual < 1e-12 && fit.rounding == 0.0);
        }
    }

    fn ring(n: usize, radius: f64) -> Vec<Vector3<f64>> {
        (0..n)
            .map(|i| {
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
                Vector3::new(5.0, radius * cos, radius * sin)
            })
            .collect()
    }

    #[test]
    fn a_ring_that_breathes_has_no_rotation_and_a_residual_of_one() {
        let positions = ring(16, 2.0);
        let section = Section::new((0..16).collect(), &positions, &[], None).unwrap();
        let oval: Vec<_> = positions.iter().map(|p| Vector3::new(0.0, p.y, -p.z)).collect();
        let fit = section.fit(&oval, 0.0);
        assert!(fit.slope.norm() < 1e-15 && fit.shape.norm() < 1e-15);
        assert!((fit.residual - 1.0).abs() < 1e-12);
    }

    #[test]
    fn warping_of_a_ring_of_four_shows_as_half_of_the_motion() {
        // Rotation θ about z moves the ring by −θ y along x; a warping c y z stays out of the fit.
        let positions = ring(8, 1.0);
        let section = Section::new((0..8).collect(), &positions, &[], None).unwrap();
        let shape: Vec<_> =
            positions.iter().map(|p| Vector3::x() * (-0.3 * p.y + 0.6 * p.y * p.z)).collect();
        let fit = section.fit(&shape, 0.0);
        assert!((fit.slope - Vector3::z() * 0.3).norm() < 1e-15);
        // Mean squares: 0.09/2 of the rotation, 0.36/8 of the warping: the same.
        assert!((fit.residual - 0.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn weights_move_the_mean_towards_the_heavier_grids() {
        let positions = [Vector3::zeros(), Vector3::y(), Vector3::z()];
        let section = Section::new(vec![0, 1, 2], &positions, &[2.0, 1.0, 1.0], None).unwrap();
        assert!((section.at_m - Vector3::new(0.0, 0.25, 0.25)).norm() < 1e-15);
    }

    /// Trials of random motions of `grids` grids, each component uniform within ± 1.
    fn trials(grids: usize) -> Vec<Vec<Vector3<f64>>> {
        const TRIALS: usize = 4000;
        let mut uniforms = vec![0.0; TRIALS * grids * 3];
        Stream::new(7, "section").fill(0, &mut uniforms);
        let vectors: Vec<Vector3<f64>> = uniforms
            .chunks(3)
            .map(|u| Vector3::new(u[0], u[1], u[2]) * 2.0 - Vector3::repeat(1.0))
            .collect();
        vectors.chunks(grids).map(<[_]>::to_vec).collect()
    }

    // The mean of 4000 squares of rotations (three components each) has a relative deviation of
    // about √(2/12000) = 1.3 %; 7 % is five of them.
    #[test]
    fn the_stated_rounding_is_that_of_repeated_rounding() {
        let positions = ring(6, 0.5);
        let section = Section::new((0..6).collect(), &positions, &[], None).unwrap();
        let delta = 2.0_f64.powi(-24);
        let exact = Vector3::repeat(1.0);
        let trials = trials(6);
        let sum: f64 = (trials.iter())
            .map(|trial| {
                let rounded: Vec<_> =
                    trial.iter().map(|noise| exact + noise * (delta * exact.norm())).collect();
                section.fit(&rounded, 0.0).slope.norm_squared()
            })
            .sum();
        let stated = section.fit(&[exact; 6], delta).rounding;
        let found = sum / trials.len() as f64 / (stated * stated);
        assert!((found - 1.0).abs() < 0.07, "{found}");
    }

    #[test]
    fn the_scatter_of_random_misfits_is_stated_right() {
        let positions = ring(12, 2.0);
        let section = Section::new((0..12).collect(), &positions, &[], None).unwrap();
        let (mut errors, mut stated) = (0.0, 0.0);
        for trial in trials(12) {
            let fit = section.fit(&trial, 0.0);
            errors += fit.slope.norm_squared();
            stated += fit.scatter.powi(2);
        }
        assert!((errors / stated - 1.0).abs() < 0.07, "{}", errors / stated);
    }

    #[test]
    fn too_few_grids_a_line_and_wrong_weights_are_refused() {
        let line: Vec<_> = (0..5).map(|i| Vector3::x() * f64::from(i)).collect();
        let new = |nodes: Vec<usize>, weights: &[f64]| Section::new(nodes, &line, weights, None);
        assert_eq!(new(vec![0, 1], &[]).unwrap_err(), Degenerate::Few(2));
        assert_eq!(new(vec![0, 1, 2], &[]).unwrap_err(), Degenerate::Line(3));
        assert!(matches!(new(vec![0, 1, 2], &[1.0]).unwrap_err(), Degenerate::Weights { .. }));
        assert!(matches!(
            new(vec![0, 1, 2], &[1.0, -1.0, 1.0]).unwrap_err(),
            Degenerate::Weights { .. }
        ));
    }
}
