//! Shape functions of a straight Euler-Bernoulli beam element with axial motion and torsion.
//!
//! Local matrices only; where an element lies and what it carries is decided in `weigh`.

use super::stick::Properties;
use nalgebra::{SMatrix, SVector};

/// Matrix over the twelve local freedoms: (u, v, w, θx, θy, θz) at the start, then at the end.
pub type Local = SMatrix<f64, 12, 12>;
type Shape = SVector<f64, 12>;

/// Abscissae on (0, 1) and weights of the four-point Gauss rule: exact to degree 7, hence for the
/// consistent mass of a uniform or linear density (degree 6 or 7).
pub fn gauss() -> [(f64, f64); 4] {
    let inner = (3.0 / 7.0 - 2.0 / 7.0 * (6.0_f64 / 5.0).sqrt()).sqrt();
    let outer = (3.0 / 7.0 + 2.0 / 7.0 * (6.0_f64 / 5.0).sqrt()).sqrt();
    let heavy = (18.0 + 30.0_f64.sqrt()) / 72.0;
    let light = (18.0 - 30.0_f64.sqrt()) / 72.0;
    [
        (0.5 - outer / 2.0, light),
        (0.5 - inner / 2.0, heavy),
        (0.5 + inner / 2.0, heavy),
        (0.5 + outer / 2.0, light),
    ]
}

/// Mass per length at a point of an element, by the motion it takes part in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Density {
    /// Axial, kg/m.
    pub axial_kg_m: f64,
    /// Lateral, kg/m.
    pub lateral_kg_m: f64,
    /// Torsional, kg·m²/m.
    pub torsion_kg_m: f64,
}

/// Stiffness per length at the fraction `s` of an element of length `h`, m:
/// `EA u'² + GJ θ'² + EI_z v''² + EI_y w''²`.
pub fn stiffness_at(s: f64, h: f64, section: &Properties, e_pa: f64, g_pa: f64) -> Local {
    let slope = [-1.0 / h, 1.0 / h];
    let curvature = [
        (12.0 * s - 6.0) / (h * h),
        (6.0 * s - 4.0) / h,
        (6.0 - 12.0 * s) / (h * h),
        (6.0 * s - 2.0) / h,
    ];
    square(&along(0, slope)) * (e_pa * section.area_m2)
        + square(&along(3, slope)) * (g_pa * section.torsion_m4)
        + square(&in_xy(curvature)) * (e_pa * section.inertia_z_m4)
        + square(&in_xz(curvature)) * (e_pa * section.inertia_y_m4)
}

/// Consistent mass per length at the fraction `s` of an element of length `h`, m.
pub fn mass_at(s: f64, h: f64, density: &Density) -> Local {
    let linear = [1.0 - s, s];
    let (s2, s3) = (s * s, s * s * s);
    let cubic =
        [1.0 - 3.0 * s2 + 2.0 * s3, h * (s - 2.0 * s2 + s3), 3.0 * s2 - 2.0 * s3, h * (s3 - s2)];
    square(&along(0, linear)) * density.axial_kg_m
        + square(&along(3, linear)) * density.torsion_kg_m
        + (square(&in_xy(cubic)) + square(&in_xz(cubic))) * density.lateral_kg_m
}

fn square(n: &Shape) -> Local {
    n * n.transpose()
}

/// A shape of the freedom `at` of both ends.
fn along(at: usize, n: [f64; 2]) -> Shape {
    let mut shape = Shape::zeros();
    shape[at] = n[0];
    shape[at + 6] = n[1];
    shape
}

/// Bending in x-y: v with θz = v'.
fn in_xy(n: [f64; 4]) -> Shape {
    let mut shape = Shape::zeros();
    (shape[1], shape[5], shape[7], shape[11]) = (n[0], n[1], n[2], n[3]);
    shape
}

/// Bending in x-z: w with θy = −w'.
fn in_xz(n: [f64; 4]) -> Shape {
    let mut shape = Shape::zeros();
    (shape[2], shape[4], shape[8], shape[10]) = (n[0], -n[1], n[2], -n[3]);
    shape
}
