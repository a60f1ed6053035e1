//! The model at one flight time: positions and modes of all grids that carry results, in the
//! vehicle's frame and SI units.
//!
//! Conversion happens here and nowhere else. Modes keep the scale of the file; `normalise` brings
//! them to unit generalised mass.

use super::systems::Systems;
use super::units::Units;
use crate::fem::{Precision, Results};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Farthest position of a grid, m; no vehicle is so large in any unit, and squares do not overflow.
const FARTHEST_M: f64 = 1e9;

/// The vehicle's frame in the basic frame of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin in the basic frame, m.
    pub origin_m: Vector3<f64>,
    /// The vehicle's x (aft), y and z in the basic frame, as columns.
    pub axes: Matrix3<f64>,
}

impl Frame {
    /// The frame whose x is along `aft` and whose y is along `y`, at `origin_m`; `None` unless both
    /// have a direction and are perpendicular to within `skew` (cosine).
    pub fn new(
        origin_m: Vector3<f64>,
        aft: Vector3<f64>,
        y: Vector3<f64>,
        skew: f64,
    ) -> Option<Self> {
        let x = aft.try_normalize(0.0)?;
        let y = y.try_normalize(0.0)?;
        if !(x.dot(&y).abs() <= skew) {
            return None;
        }
        let y = (y - x * x.dot(&y)).normalize();
        Some(Self { origin_m, axes: Matrix3::from_columns(&[x, y, x.cross(&y)]) })
    }

    fn place(&self, basic_m: Vector3<f64>) -> Vector3<f64> {
        self.axes.transpose() * (basic_m - self.origin_m)
    }
}

/// A mode of the model: translations, and rotations where the file has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Number in the file.
    pub number: i64,
    /// Natural frequency, Hz; negative for a negative eigenvalue.
    pub frequency_hz: f64,
    /// Generalised mass of the shape as it stands, kg, where the file gives it.
    pub generalised_kg: Option<f64>,
    /// Greatest component of a translation along the displacement axes of the file, in its scale.
    pub greatest: f64,
    /// Translation at each grid.
    pub shape: Vec<Vector3<f64>>,
    /// Rotation at each grid, per metre; zero where the file has none.
    pub slope: Vec<Vector3<f64>>,
}

/// Mass lumped at a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lump {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Inertia about the grid, kg·m².
    pub inertia_kg_m2: Matrix3<f64>,
}

/// A model at one flight time.
#[derive(Debug, Clone)]
pub struct Model {
    /// Node ids, ascending.
    pub ids: Vec<i64>,
    /// Positions, m.
    pub positions_m: Vec<Vector3<f64>>,
    /// Modes by ascending frequency.
    pub modes: Vec<Mode>,
    /// Whether a grid turns in any mode: where none does, the file's zeros are no rotations.
    pub turns: Vec<bool>,
    /// Mass lumped at each grid, where the file holds that of the whole model.
    pub lumps: Option<Vec<Lump>>,
    /// Named sets of node ids.
    pub sets: BTreeMap<String, Vec<i64>>,
    /// Ids of nodes that have a position and no results, ascending.
    pub bare: Vec<i64>,
    /// Half a unit in the last place of the stored shapes, relative.
    pub rounding: f64,
    /// What the file and the conversion had to say, one sentence each.
    pub warnings: Vec<String>,
}

/// Half a unit in the last place, relative to the number.
fn rounding(precision: Precision) -> f64 {
    match precision {
        Precision::Single => f64::from(f32::EPSILON) / 2.0,
        Precision::Double => f64::EPSILON / 2.0,
        // A mantissa of 1 with d digits is rounded by half a unit of the last of them.
        Precision::Text { digits } => 0.5 * 10.0_f64.powi(1 - i32::from(digits)),
    }
}

impl Model {
    /// Brings `results` to the vehicle's frame and SI units.
    ///
    /// # Errors
    /// Everything that keeps the results from being a model, one sentence each.
    pub fn new(results: Results, units: &Units, frame: &Frame) -> Result<Self, Vec<String>> {
        let mut faults = Vec::new();
        if results.modes.is_empty() {
            faults.push("no modes".to_owned());
        }
        if results.nodes.is_empty() {
            faults.push("no grid positions: they are in the deck, not in every result".to_owned());
        }
        let listed = |mode: &crate::fem::RawMode| -> Vec<i64> {
            mode.shape.iter().map(|s| s.node).collect()
        };
        let with_results = results.modes.first().map(&listed).unwrap_or_default();
        if let Some(other) = results.modes.iter().find(|m| listed(m) != with_results) {
            faults.push(format!(
                "mode {} on {} grids and mode {} on {} others",
                results.modes[0].number,
                with_results.len(),
                other.number,
                other.shape.len()
            ));
        }
        if !faults.is_empty() {
            return Err(faults);
        }

        let mut systems = Systems::new(&results);
        let (mut ids, mut positions_m, mut axes, mut kept) = (vec![], vec![], vec![], vec![]);
        let mut without_position = 0_usize;
        for (place, &id) in with_results.iter().enumerate() {
            let Ok(at) = results.nodes.binary_search_by_key(&id, |n| n.id) else {
                without_position += 1;
                continue;
            };
            let node = &results.nodes[at];
            let Some(basic) = systems.position(node) else { continue };
            let Some(local) = systems.axes(node, &basic) else { continue };
            let position_m = frame.place(basic * units.length_m);
            if !(position_m.amax() <= FARTHEST_M) {
                faults.push(format!("node {id} at a distance of {:.1e} m", position_m.amax()));
                break;
            }
            ids.push(id);
            positions_m.push(position_m);
            axes.push(frame.axes.transpose() * local);
            kept.push(place);
        }
        faults.extend(systems.into_faults());
        if ids.is_empty() && faults.is_empty() {
            faults.push("no grid that has both a position and results".to_owned());
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let mut warnings = results.warnings;
        if without_position > 0 {
            warnings.push(format!(
                "{without_position} points carry results and have no position (scalar points, or \
                 grids of another deck): left out"
            ));
        }
        let lumps = results.mass.map(|listed| {
            let masses: BTreeMap<i64, _> = listed.into_iter().collect();
            let lost = masses.keys().filter(|&id| ids.binary_search(id).is_err()).count();
            if lost > 0 {
                warnings.push(format!("{lost} grids with mass carry no results: left out"));
            }
            let lump = |(id, axes): (&i64, &Matrix3<f64>)| {
                let (mass, inertia) =
                    masses.get(id).map_or((0.0, [0.0; 3]), |m| (m.mass, m.inertia));
                let own = Matrix3::from_diagonal(&Vector3::from(inertia));
                Lump {
                    mass_kg: mass * units.listed_kg,
                    inertia_kg_m2: axes
                        * own
                        * axes.transpose()
                        * (units.listed_kg * units.length_m * units.length_m),
                }
            };
            ids.iter().zip(&axes).map(lump).collect()
        });
        let mut modes: Vec<Mode> = (results.modes.into_iter())
            .map(|mode| {
                let translations = kept.iter().map(|&place| mode.shape[place].translation);
                let components = translations.flatten().map(f64::abs);
                let greatest = components.fold(0.0, f64::max);
                let (shape, slope) = (kept.iter().zip(&axes))
                    .map(|(&place, axes)| {
                        let at = &mode.shape[place];
                        let turn = at.rotation.map_or(Vector3::zeros(), Vector3::from);
                        // A rotation per unit of length.
                        (axes * Vector3::from(at.translation), axes * turn / units.length_m)
                    })
                    .unzip();
                Mode {
                    number: mode.number,
                    frequency_hz: mode.frequency_hz,
                    generalised_kg: mode.generalised_mass.map(|m| m * units.mass_kg),
                    greatest,
                    shape,
                    slope,
                }
            })
            .collect();
        modes.sort_by(|a, b| {
            a.frequency_hz.total_cmp(&b.frequency_hz).then(a.number.cmp(&b.number))
        });
        if let Some(mode) = modes.iter().find(|m| {
            let all = m.shape.iter().chain(&m.slope).flat_map(|v| v.iter());
            !all.chain(&m.generalised_kg).chain([&m.frequency_hz]).all(|x| x.is_finite())
        }) {
            return Err(vec![format!("a number that is not finite in mode {}", mode.number)]);
        }
        let turns =
            (0..ids.len()).map(|i| modes.iter().any(|m| m.slope[i] != Vector3::zeros())).collect();
        let bare = (results.nodes.iter().map(|n| n.id))
            .filter(|id| with_results.binary_search(id).is_err())
            .collect();
        Ok(Self {
            ids,
            positions_m,
            modes,
            turns,
            lumps,
            sets: results.sets,
            bare,
            rounding: rounding(results.precision),
            warnings,
        })
    }

    /// Place of the node `id`.
    pub fn place(&self, id: i64) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// The grid nearest to a point, and its distance, m.
    pub fn nearest(&self, point_m: &Vector3<f64>) -> Option<(usize, f64)> {
        let distances = self.positions_m.iter().map(|p| (p - point_m).norm());
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Largest extent of the grids along one of the axes, m.
    pub fn extent_m(&self) -> f64 {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = -low;
        for p in &self.positions_m {
            (low, high) = (low.inf(p), high.sup(p));
        }
        (high - low).max()
    }
}
