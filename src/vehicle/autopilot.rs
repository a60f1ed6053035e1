//! The autopilot: sensors at grids, filtered paths from signals to axis commands, and the allocation.
//!
//! It holds nominal data; blocks are made of it in `dynamics::servo`.

use super::Filter;
use nalgebra::{Matrix3, Matrix3xX, Vector3};

/// A rotation about an axis of the structural frame (x aft, y, z lateral).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// About x.
    Roll,
    /// About y.
    Pitch,
    /// About z.
    Yaw,
}

impl Axis {
    /// All three, in the order of their axes x, y, z.
    pub const ALL: [Self; 3] = [Self::Roll, Self::Pitch, Self::Yaw];

    /// Name in signals.
    pub fn name(self) -> &'static str {
        ["roll", "pitch", "yaw"][self as usize]
    }
}

/// What a sensor measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorKind {
    /// Rotation rate, rad/s.
    RateGyro,
    /// Rotation, rad.
    Attitude,
}

/// A sensor at a grid, about all three axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Name.
    pub name: String,
    /// What it measures.
    pub kind: SensorKind,
    /// Its grid.
    pub grid: String,
    /// Scale factor, −.
    pub scale: f64,
}

impl Sensor {
    /// Name of its signal about an axis, for instance `gyro.fwd.roll`.
    pub fn signal(&self, axis: Axis) -> String {
        let kind = match self.kind {
            SensorKind::RateGyro => "gyro",
            SensorKind::Attitude => "attitude",
        };
        format!("{kind}.{}.{}", self.name, axis.name())
    }
}

/// A weighted sum of signals, times a gain, through filters in series.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Name; its output is the signal `path.<name>`.
    pub name: String,
    /// Signals and their weights, by name of the signal.
    pub input: Vec<(String, f64)>,
    /// Gain, −.
    pub gain: f64,
    /// Axis of whose feedback the output is a part.
    pub axis: Option<Axis>,
    /// Filters, in series.
    pub filters: Vec<Filter>,
}

impl Path {
    /// Name of its output.
    pub fn signal(&self) -> String {
        format!("path.{}", self.name)
    }
}

/// From axis commands to gimbal commands.
#[derive(Debug, Clone, PartialEq)]
pub struct Allocation {
    /// Engine and gimbal axis (indices of the vehicle and of `Engine::axes`) of each gimbal commanded.
    pub gimbals: Vec<(usize, usize)>,
    /// A row per gimbal: rotation per unit roll, pitch and yaw command, rad/rad.
    pub matrix: Vec<[f64; 3]>,
}

/// Sensors, paths and allocation of a vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Autopilot {
    /// Loop delay at the end of each axis, s.
    pub delay_s: f64,
    /// Order of its Padé approximation.
    pub delay_order: usize,
    /// Sensors.
    pub sensors: Vec<Sensor>,
    /// Paths.
    pub paths: Vec<Path>,
    /// Allocation.
    pub allocation: Allocation,
}

/// Least singular value of the moments over the greatest below which an axis has no authority: the
/// gimbals would turn by a thousand times what another axis needs.
const LEAST_AUTHORITY: f64 = 1e-3;

/// The allocation of least norm for gimbals whose moments per unit rotation about the vehicle's cg are
/// `moments`, N·m/rad: `B⁺`, each column scaled to a greatest entry of 1. `None` where the moments do not
/// span the three axes.
pub fn least_squares(moments: &[Vector3<f64>]) -> Option<Vec<[f64; 3]>> {
    let b = Matrix3xX::from_columns(moments);
    // The rows have one unit, but roll is small: judge the authority about each axis on its own.
    let row = b.row_iter().map(|row| row.norm());
    let scale = Vector3::from_iterator(row);
    if !scale.iter().all(|x| *x > 0.0 && x.is_finite()) {
        return None;
    }
    let by = Matrix3::from_diagonal(&scale.map(|x| 1.0 / x));
    let unit = by * &b;
    let gram = &unit * unit.transpose();
    let values = gram.symmetric_eigenvalues();
    if !(values.min() > LEAST_AUTHORITY.powi(2) * values.max()) {
        return None;
    }
    // B⁺ = Bᵀ(B Bᵀ)⁻¹; a diagonal factor on the axes only scales its columns.
    let pseudo = unit.transpose() * gram.try_inverse()?;
    let greatest: Vec<f64> = pseudo.column_iter().map(|column| column.amax()).collect();
    let row = |i: usize| std::array::from_fn(|j| pseudo[(i, j)] / greatest[j]);
    Some((0..moments.len()).map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two boosters at y = ±a, ℓ aft of the cg, thrust along −x, gimbal axes y and z: rotation about y
    /// moves the exhaust along z.
    fn boosters(thrust: f64) -> Vec<Vector3<f64>> {
        let (a, l) = (6.35, 30.0);
        [-a, a]
            .into_iter()
            .flat_map(|y| {
                let at = Vector3::new(l, y, 0.0);
                [Vector3::y(), Vector3::z()]
                    .map(|axis| at.cross(&(axis.cross(&-Vector3::x()) * thrust)))
            })
            .collect()
    }

    #[test]
    fn an_axis_command_moves_the_boosters_of_a_symmetric_vehicle_as_one_expects() {
        let moments = boosters(1.2e7);
        let matrix = least_squares(&moments).unwrap();
        for axis in 0..3 {
            let moment: Vector3<f64> =
                moments.iter().zip(&matrix).map(|(b, row)| b * row[axis]).sum();
            let along = moment[axis];
            assert!(along > 0.0, "a positive command makes a positive moment");
            assert!((moment.norm() - along).abs() < 1e-9 * along, "and no other");
        }
        // Roll: opposite rotations about y; pitch and yaw: equal ones about y and z.
        let column = |j: usize| matrix.iter().map(|row| row[j].abs()).collect::<Vec<_>>();
        for (j, expected) in
            [[1.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]].iter().enumerate()
        {
            for (found, expected) in column(j).iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12);
            }
        }
        assert_eq!(matrix[0][0], -matrix[2][0]);
    }

    #[test]
    fn one_engine_on_the_centreline_cannot_roll() {
        let at = Vector3::new(30.0, 0.0, 0.0);
        let moments =
            [Vector3::y(), Vector3::z()].map(|axis| at.cross(&axis.cross(&-Vector3::x())));
        assert_eq!(least_squares(&moments), None);
    }
}
