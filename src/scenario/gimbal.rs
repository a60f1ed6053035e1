//! Gimbal geometry: unit vectors, gimbal axes and the moments of the actuators' action lines.
//!
//! It judges the geometry of one engine; where its numbers stand in a file is known to `vehicle`.

use crate::dynamics::virtual_grid::{Geometry, VirtualGrid};
use nalgebra::{Matrix3x2, Vector3};

/// How far a typed direction may be from unit length or from perpendicular: numbers printed with
/// three decimals are off by half of the last one, and √3 times that in length.
const TYPED: f64 = 1e-3;

/// Largest angle by which the moments of two action lines may miss the perpendicular, degrees.
const LARGEST_SKEW_DEG: f64 = 1.0;

/// What was found and what is allowed.
pub type Refusal = (String, String);

/// The unit vector meant by `typed`.
///
/// # Errors
/// A length off one by more than the rounding of three decimals.
pub fn unit(typed: [f64; 3]) -> Result<Vector3<f64>, Refusal> {
    let vector = Vector3::from(typed);
    let length = vector.norm();
    if (length - 1.0).abs() <= TYPED {
        Ok(vector / length)
    } else {
        Err((format!("{typed:?} of length {length}"), "a unit vector (to 0.001)".into()))
    }
}

/// The gimbal axes meant by `typed`, made exactly orthonormal and normal to `thrust`.
///
/// # Errors
/// Axes that are not of unit length, not perpendicular or not normal to the thrust, beyond the
/// rounding of three decimals.
pub fn given_axes(typed: [[f64; 3]; 2], thrust: &Vector3<f64>) -> Result<Matrix3x2<f64>, Refusal> {
    let axes = [unit(typed[0])?, unit(typed[1])?];
    let products = [
        ("axis 0 with axis 1", axes[0].dot(&axes[1])),
        ("axis 0 with the thrust direction", axes[0].dot(thrust)),
        ("axis 1 with the thrust direction", axes[1].dot(thrust)),
    ];
    for (names, product) in products {
        if !(product.abs() <= TYPED) {
            let found = format!("a scalar product of {names} of {product}");
            return Err((
                found,
                "two axes perpendicular to each other and to the thrust direction (to 0.001)"
                    .into(),
            ));
        }
    }
    Ok(orthonormal(axes, thrust))
}

/// The gimbal axes made from the actuators: the moments r_b × u_b of their action lines in the
/// plane normal to the nozzle, orthonormalised, first actuator first.
///
/// # Errors
/// Moments more than 1° off perpendicular.
pub fn axes_of_actuators(
    geometry: &Geometry,
    thrust: &Vector3<f64>,
) -> Result<Matrix3x2<f64>, Refusal> {
    let moment = |a: usize| {
        let full = geometry.attach_m.column(a).cross(&geometry.action_line.column(a));
        (full - thrust * full.dot(thrust)).normalize()
    };
    let moments = [moment(0), moment(1)];
    let skew = moments[0].dot(&moments[1]).asin().to_degrees();
    if skew.abs() <= LARGEST_SKEW_DEG {
        Ok(orthonormal(moments, thrust))
    } else {
        Err((
            format!("moments of the two action lines about the gimbal {:.3}° apart", 90.0 - skew),
            format!("90° to within {LARGEST_SKEW_DEG}°, or `axes` given"),
        ))
    }
}

/// Checks that the action lines resolve a torque (the Improved Virtual Grid exists).
///
/// # Errors
/// Parallel or degenerate action lines.
pub fn check_action_lines(geometry: &Geometry) -> Result<(), Refusal> {
    VirtualGrid::new(geometry).map(|_| ()).map_err(|degenerate| {
        (
            degenerate.to_string(),
            "two action lines that turn the nozzle about different axes".into(),
        )
    })
}

fn orthonormal(axes: [Vector3<f64>; 2], thrust: &Vector3<f64>) -> Matrix3x2<f64> {
    let first = (axes[0] - thrust * axes[0].dot(thrust)).normalize();
    // The second axis is ± thrust × first: exactly perpendicular to both.
    let normal = thrust.cross(&first).normalize();
    Matrix3x2::from_columns(&[first, normal * normal.dot(&axes[1]).signum()])
}

#[cfg(test)]
mod tests {
    use super::*;

    const THRUST: Vector3<f64> = Vector3::new(-1.0, 0.0, 0.0);

    fn actuators(attach: [Vector3<f64>; 2], line: [Vector3<f64>; 2]) -> Geometry {
        Geometry {
            attach_m: Matrix3x2::from_columns(&attach),
            action_line: Matrix3x2::from_columns(&line),
        }
    }

    #[test]
    fn rounded_directions_become_exact_and_others_are_refused() {
        let vector = unit([0.707, 0.707, 0.0]).unwrap();
        assert!((vector.norm() - 1.0).abs() < 1e-15);
        for bad in [[0.7, 0.7, 0.0], [0.0; 3], [f64::NAN, 0.0, 1.0], [2.0, 0.0, 0.0]] {
            assert!(unit(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn given_axes_keep_their_sense_and_become_orthonormal() {
        // √3/2 rounded to three decimals.
        let s = 0.866;
        for typed in [[[0.0, s, 0.5], [0.0, -0.5, s]], [[0.0, s, 0.5], [0.0, 0.5, -s]]] {
            let axes = given_axes(typed, &THRUST).unwrap();
            assert!((axes.transpose() * axes - nalgebra::Matrix2::identity()).amax() < 1e-15);
            assert!((axes.transpose() * THRUST).amax() < 1e-15);
            assert!((axes.column(1) - Vector3::from(typed[1])).amax() < 1e-4);
        }
        assert!(given_axes([[0.0, 1.0, 0.0], [0.0, s, 0.5]], &THRUST).is_err());
        assert!(given_axes([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], &THRUST).is_err());
    }

    #[test]
    fn axes_follow_the_moments_of_the_action_lines() {
        let s = 0.5_f64.sqrt();
        let x = Vector3::x();
        let attach = [Vector3::new(-0.3, s, s) * 1.79, Vector3::new(-0.3, -s, s) * 1.79];
        let axes = axes_of_actuators(&actuators(attach, [x, x]), &THRUST).unwrap();
        // r × x for r = (·, s, s) is (0, s, −s).
        assert!((axes.column(0) - Vector3::new(0.0, s, -s)).amax() < 1e-15);
        assert!((axes.column(1) - Vector3::new(0.0, s, s)).amax() < 1e-15);
    }

    #[test]
    fn action_lines_more_than_one_degree_off_perpendicular_are_refused() {
        let x = Vector3::x();
        let at = |deg: f64| {
            let angle = deg.to_radians();
            actuators([Vector3::y(), Vector3::new(0.0, angle.cos(), angle.sin())], [x, x])
        };
        assert!(axes_of_actuators(&at(90.9), &THRUST).is_ok());
        assert!(axes_of_actuators(&at(89.1), &THRUST).is_ok());
        let (found, _) = axes_of_actuators(&at(88.9), &THRUST).unwrap_err();
        assert!(found.contains("88.900°"), "{found}");
        assert!(check_action_lines(&at(0.5)).is_err());
        assert!(check_action_lines(&at(180.0)).is_err());
    }
}
