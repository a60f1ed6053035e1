//! The three loops at one frequency: each broken at its axis command with the others closed.
//!
//! Where the loop matrix comes from, and at which frequencies, is decided by the caller.

use nalgebra::{Complex, Matrix3};

/// Names of the axes, in the order of the loop matrix.
pub const AXES: [&str; 3] = ["roll", "pitch", "yaw"];

/// The loops at one point of the contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Place on the contour, see [`super::contour::Contour`].
    pub place: f64,
    /// Complex frequency, rad/s.
    pub s: Complex<f64>,
    /// L of each axis, the others closed.
    pub broken: [Complex<f64>; 3],
    /// det(1 + G).
    pub difference: Complex<f64>,
}

impl Sample {
    /// The loops of the loop matrix G at `s`.
    pub fn new(place: f64, s: Complex<f64>, g: &Matrix3<Complex<f64>>) -> Self {
        let one = Complex::new(1.0, 0.0);
        let broken = [(0, 1, 2), (1, 0, 2), (2, 0, 1)].map(|(a, b, c)| {
            let (bb, cc) = (one + g[(b, b)], one + g[(c, c)]);
            let determinant = bb * cc - g[(b, c)] * g[(c, b)];
            // (1 + G_bb)⁻¹ G_ba by Cramer's rule.
            let b_of_a = (cc * g[(b, a)] - g[(b, c)] * g[(c, a)]) / determinant;
            let c_of_a = (bb * g[(c, a)] - g[(c, b)] * g[(b, a)]) / determinant;
            g[(a, a)] - g[(a, b)] * b_of_a - g[(a, c)] * c_of_a
        });
        Self { place, s, broken, difference: (g + Matrix3::identity()).determinant() }
    }

    /// Angular frequency, rad/s: zero on the real axis.
    pub fn omega_rad_s(&self) -> f64 {
        self.s.im
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.broken.iter().chain([&self.difference]).all(|z| z.re.is_finite() && z.im.is_finite())
    }
}

/// The angle of `z` from −180°, in (−π, π], rad: zero at −1.
pub fn from_critical(z: Complex<f64>) -> f64 {
    (-z).arg()
}

/// 20 log₁₀ |z|.
pub fn decibels(z: Complex<f64>) -> f64 {
    10.0 * z.norm_sqr().log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_broken_loop_times_the_rest_is_the_determinant() {
        let c = Complex::new;
        let g = Matrix3::new(
            c(1.0, 0.3),
            c(0.2, -0.4),
            c(-0.6, 0.1),
            c(0.5, 0.5),
            c(-2.0, 1.0),
            c(0.1, 0.7),
            c(0.3, -0.2),
            c(0.9, 0.4),
            c(0.4, -1.2),
        );
        let sample = Sample::new(0.0, c(0.0, 1.0), &g);
        for axis in 0..3 {
            let rest = (g + Matrix3::identity()).remove_row(axis).remove_column(axis);
            let product = (c(1.0, 0.0) + sample.broken[axis]) * rest.determinant();
            assert!((product - sample.difference).norm() < 1e-14);
        }
    }

    #[test]
    fn uncoupled_axes_are_their_own_loops() {
        let g = Matrix3::from_diagonal(&nalgebra::Vector3::new(
            Complex::new(0.5, 1.0),
            Complex::new(-3.0, 0.0),
            Complex::default(),
        ));
        let sample = Sample::new(0.0, Complex::default(), &g);
        assert_eq!(sample.broken, [g[(0, 0)], g[(1, 1)], g[(2, 2)]]);
    }
}
