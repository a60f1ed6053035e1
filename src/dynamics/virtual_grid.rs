//! The Improved Virtual Grid: gimbal slope from translations at the gimbal and two actuator
//! attach points, equations (15) to (22).
//!
//! It knows geometry and shapes, not where they come from.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x2, SMatrix, Vector3};

/// Geometry of the two actuators of an engine: attach points from the gimbal and action lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// Attach points r_b from the gimbal, m, as columns.
    pub attach_m: Matrix3x2<f64>,
    /// Unit action lines u_b, as columns.
    pub action_line: Matrix3x2<f64>,
}

/// Why a geometry has no virtual grid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the moments of the two action lines about the gimbal are parallel or zero \
     (smallest over largest singular value {ratio:.2e})"
)]
pub struct Degenerate {
    /// Smallest over largest singular value of [r_b1 × u_b1, r_b2 × u_b2], −.
    pub ratio: f64,
}

/// Smallest allowed ratio of the singular values of the moment arms: below it the action lines span
/// less than half a degree and the slope is mostly amplified noise of the attach points.
const LEAST_RATIO: f64 = 1e-2;

/// The Jacobian M = L₁₁ 2Aᵀ (5×3) of (18): how an applied torque resolves into the two actuator
/// forces and the gimbal reaction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VirtualGrid {
    force: Matrix2x3<f64>,
    reaction: Matrix3<f64>,
    action_line: Matrix3x2<f64>,
}

impl VirtualGrid {
    /// Solves the KKT system (16) by its closed form: with B = [r_b1×u_b1, r_b2×u_b2] the actuator
    /// forces are B⁺τ and the reaction −[u_b1 u_b2] B⁺τ.
    ///
    /// # Errors
    /// [`Degenerate`] where the moment arms are parallel, zero or not finite.
    pub fn new(geometry: &Geometry) -> Result<Self, Degenerate> {
        let arms = Matrix3x2::from_columns(&[
            geometry.attach_m.column(0).cross(&geometry.action_line.column(0)),
            geometry.attach_m.column(1).cross(&geometry.action_line.column(1)),
        ]);
        // For unit columns at angle φ the singular values are √(1 ± cos φ); their ratio is tan(φ/2).
        // (Unit columns: a long and a short arm are both well posed.)
        let (first, second) = (arms.column(0), arms.column(1));
        let angle = first.cross(&second).norm().atan2(first.dot(&second).abs());
        let ratio = (angle / 2.0).tan();
        if !(ratio >= LEAST_RATIO) {
            return Err(Degenerate { ratio });
        }
        let gram = arms.transpose() * arms;
        let inverse = gram.try_inverse().ok_or(Degenerate { ratio })?;
        let force = inverse * arms.transpose();
        let action_line = geometry.action_line;
        Ok(Self { force, reaction: -(action_line * force), action_line })
    }

    /// Virtual slope Ψ_G of one mode (22), rad/m per kg^1/2, from the translations at the gimbal
    /// and at the two attach points, kg^-1/2.
    pub fn slope(&self, gimbal: &Vector3<f64>, attach: [&Vector3<f64>; 2]) -> Vector3<f64> {
        let mut slope = self.reaction.transpose() * gimbal;
        for (index, shape) in attach.into_iter().enumerate() {
            let along = self.action_line.column(index).dot(shape);
            slope += self.force.row(index).transpose() * along;
        }
        slope
    }

    /// The matrix M of (18), rows f_1, f_2, f_g.
    pub fn jacobian(&self) -> SMatrix<f64, 5, 3> {
        let mut jacobian = SMatrix::<f64, 5, 3>::zeros();
        jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&self.force);
        jacobian.fixed_view_mut::<3, 3>(2, 0).copy_from(&self.reaction);
        jacobian
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skewed() -> Geometry {
        let u1 = Vector3::new(0.95, 0.1, 0.2).normalize();
        let u2 = Vector3::new(0.9, -0.3, 0.1).normalize();
        Geometry {
            attach_m: Matrix3x2::from_columns(&[
                Vector3::new(-0.4, 0.2, 1.6),
                Vector3::new(-0.3, 1.7, -0.1),
            ]),
            action_line: Matrix3x2::from_columns(&[u1, u2]),
        }
    }

    /// The KKT system (16) as printed, with `A` (3×5) and `C` (3×5) of (15).
    fn kkt(geometry: &Geometry) -> SMatrix<f64, 5, 3> {
        let mut a = SMatrix::<f64, 3, 5>::zeros();
        let mut c = SMatrix::<f64, 3, 5>::zeros();
        for j in 0..2 {
            let u = geometry.action_line.column(j).into_owned();
            a.set_column(j, &geometry.attach_m.column(j).cross(&u));
            c.set_column(j, &u);
        }
        c.fixed_view_mut::<3, 3>(0, 2).fill_with_identity();
        let mut full = SMatrix::<f64, 8, 8>::zeros();
        full.fixed_view_mut::<5, 5>(0, 0).copy_from(&(2.0 * a.transpose() * a));
        full.fixed_view_mut::<5, 3>(0, 5).copy_from(&c.transpose());
        full.fixed_view_mut::<3, 5>(5, 0).copy_from(&c);
        let inverse = full.try_inverse().expect("the KKT matrix is regular");
        inverse.fixed_view::<5, 5>(0, 0) * 2.0 * a.transpose()
    }

    #[test]
    fn the_closed_form_solves_the_kkt_system() {
        let geometry = skewed();
        let grid = VirtualGrid::new(&geometry).expect("regular");
        // The KKT matrix has a condition number below 1e3 here.
        assert!((grid.jacobian() - kkt(&geometry)).amax() < 1e3 * f64::EPSILON);
    }

    #[test]
    fn axial_actuators_have_the_forces_of_the_lever_law() {
        let lever = 1.79;
        let x = Vector3::x();
        let grid = VirtualGrid::new(&Geometry {
            attach_m: Matrix3x2::from_columns(&[Vector3::z() * lever, Vector3::y() * lever]),
            action_line: Matrix3x2::from_columns(&[x, x]),
        })
        .expect("regular");
        let m = grid.jacobian();
        let expected = [[0.0, 1.0 / lever, 0.0], [0.0, 0.0, -1.0 / lever]];
        for (row, want) in expected.iter().enumerate() {
            for (column, value) in want.iter().enumerate() {
                assert!((m[(row, column)] - value).abs() < 4.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn a_rigid_motion_gives_its_rotation_in_the_actuated_plane() {
        let geometry = skewed();
        let grid = VirtualGrid::new(&geometry).expect("regular");
        let (t, theta) = (Vector3::new(0.3, -2.0, 5.0), Vector3::new(0.7, -0.4, 1.1));
        let at = |r: Vector3<f64>| t + theta.cross(&r);
        let slope = grid.slope(
            &t,
            [
                &at(geometry.attach_m.column(0).into_owned()),
                &at(geometry.attach_m.column(1).into_owned()),
            ],
        );
        let arms = Matrix3x2::from_columns(&[
            geometry.attach_m.column(0).cross(&geometry.action_line.column(0)),
            geometry.attach_m.column(1).cross(&geometry.action_line.column(1)),
        ]);
        let pseudo = (arms.transpose() * arms).try_inverse().expect("rank 2") * arms.transpose();
        assert!((slope - (arms * pseudo).transpose() * theta).amax() < 1e-13);
        let translation = grid.slope(&t, [&t, &t]);
        assert!(translation.amax() < 1e-13);
    }

    #[test]
    fn parallel_action_lines_and_nan_are_refused() {
        let mut geometry = skewed();
        geometry.attach_m.set_column(1, &(geometry.attach_m.column(0) * 2.0));
        let first = geometry.action_line.column(0).into_owned();
        geometry.action_line.set_column(1, &first);
        assert!(VirtualGrid::new(&geometry).is_err());
        geometry.attach_m[(0, 0)] = f64::NAN;
        assert!(VirtualGrid::new(&geometry).is_err());
    }
}
