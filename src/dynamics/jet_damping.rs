//! Elastic jet damping: the Coriolis force of the exhaust on the bending structure, (7) to (14).
//!
//! It yields generalised forces per rate and unit mass flow; signs of the damping matrix and the
//! drawn mass flow are applied in `assemble`.

use nalgebra::Vector3;

/// One station of the case centreline.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// Distance from the head end along the flow, m.
    pub x_m: f64,
    /// Translation of every mode at the station, kg^-1/2.
    pub shape: Vec<Vector3<f64>>,
    /// Rotation of every mode at the station, rad/m per kg^1/2.
    pub slope: Vec<Vector3<f64>>,
}

/// Case jet damping (14) per unit mass flow: the k×k matrix C, row-major, 1/kg, of
/// `Q_c = ṁ C η̇` with flow direction `î = +x` and mass flow linear from 0 at the first station to
/// ṁ at the last.
///
/// Stations must be at least two, with increasing x from 0 (checked by the scenario).
pub fn case_per_flow(stations: &[Station]) -> Vec<f64> {
    let modes = stations[0].shape.len();
    let length = stations[stations.len() - 1].x_m - stations[0].x_m;
    let mut matrix = vec![0.0; modes * modes];
    for (j, station) in stations.iter().enumerate() {
        // The trapezoid gives station j half of each interval beside it, times x_j 2/L.
        let before = if j == 0 { 0.0 } else { station.x_m - stations[j - 1].x_m };
        let after = stations.get(j + 1).map_or(0.0, |next| next.x_m - station.x_m);
        let weight = (before + after) * (station.x_m - stations[0].x_m) / length;
        for (row, shape) in matrix.chunks_exact_mut(modes).zip(&station.shape) {
            for (entry, slope) in row.iter_mut().zip(&station.slope) {
                // Φᵀ (x̂ × Ψ), with x̂ × ψ = (0, −ψ_z, ψ_y).
                *entry += weight * (shape.z * slope.y - shape.y * slope.z);
            }
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Free-free Euler-Bernoulli modes of unit length and mass, with φ(0) = +2.
    fn free_free(mode: usize, x: f64) -> (f64, f64) {
        let b: f64 = [4.730_040_744_862_7, 7.853_204_624_095_8, 10.995_607_838_002][mode];
        let sigma = (b.cosh() - b.cos()) / (b.sinh() - b.sin());
        let phi = (b * x).cosh() + (b * x).cos() - sigma * ((b * x).sinh() + (b * x).sin());
        let slope = b * ((b * x).sinh() - (b * x).sin() - sigma * ((b * x).cosh() + (b * x).cos()));
        (phi, slope)
    }

    /// The damping matrix entries −C of the beam bending in y with `count` uniform stations.
    fn beam(count: usize) -> Vec<f64> {
        let stations: Vec<Station> = (0..count)
            .map(|j| {
                let x_m = j as f64 / (count - 1) as f64;
                let at: Vec<(f64, f64)> = (0..3).map(|mode| free_free(mode, x_m)).collect();
                Station {
                    x_m,
                    shape: at.iter().map(|v| Vector3::new(0.0, v.0, 0.0)).collect(),
                    slope: at.iter().map(|v| Vector3::new(0.0, 0.0, v.1)).collect(),
                }
            })
            .collect();
        case_per_flow(&stations).into_iter().map(|v| -v).collect()
    }

    #[test]
    fn a_uniform_beam_is_damped_by_three_flows_per_mass() {
        // Verification case 2; the trapezoid's error falls with the square of the spacing.
        for (count, expected) in [(21, 3.0515), (41, 3.0129), (81, 3.0032)] {
            assert!((beam(count)[0] - expected).abs() < 5e-5, "{count} stations");
        }
        let fine = beam(20_001);
        for (index, expected) in [
            (0, 3.0),
            (4, 3.0),
            (8, 3.0),
            (1, -9.212_395_92),
            (3, 1.212_395_92),
            (2, 8.283_664_55),
            (6, -0.283_664_548),
        ] {
            assert!((fine[index] - expected).abs() < 1e-6, "entry {index}: {}", fine[index]);
        }
    }

    fn station(x_m: f64, shape: Vector3<f64>, slope: Vector3<f64>) -> Station {
        Station { x_m, shape: vec![shape], slope: vec![slope] }
    }

    #[test]
    fn bending_in_z_is_damped_like_bending_in_y() {
        let (phi, psi) = ([0.0, 1.5], 1.5);
        // A rotation −φ' about y moves points aft of it along +z.
        let in_z = [0, 1].map(|j| station(j as f64, Vector3::z() * phi[j], Vector3::y() * -psi));
        let in_y = [0, 1].map(|j| station(j as f64, Vector3::y() * phi[j], Vector3::z() * psi));
        assert_eq!(case_per_flow(&in_z), case_per_flow(&in_y));
    }

    #[test]
    fn rigid_rotation_about_the_centre_gives_a_sixth() {
        let stations: Vec<Station> = (0..2001)
            .map(|j| f64::from(j) / 2000.0)
            .map(|x| station(x, Vector3::y() * (x - 0.5), Vector3::z()))
            .collect();
        assert!((-case_per_flow(&stations)[0] - 1.0 / 6.0).abs() < 1e-6);
    }

    #[test]
    fn torsion_and_axial_motion_are_not_damped() {
        let stations =
            [1.0, 2.0].map(|v| station(v - 1.0, Vector3::x() * v, Vector3::x() * (v + 1.0)));
        assert_eq!(case_per_flow(&stations), vec![0.0]);
    }
}
