//! Rigid-body modes of a free-free model: recognised, judged, and the mass properties they hold.
//!
//! A mode is rigid by its shape, not by its number or frequency; the frequency is then judged
//! against the first elastic one.

use super::model::{Mode, Model};
use crate::vehicle::MassProperties;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Share of a shape that no rigid motion explains, below which it is a rigid motion. Elastic modes
/// are orthogonal to rigid motions by mass, so that theirs is near one.
const RIGID_SHAPE: f64 = 0.1;
/// Residual of a rigid-body mode above which it is reported: grounding or poor convergence.
const POOR_SHAPE: f64 = 0.01;
/// Frequency of a rigid-body mode over the first elastic one above which it is reported.
const POOR_FREQUENCY: f64 = 0.05;
/// Frequency of a mode over the next above which the lower one is taken for a mechanism.
const MECHANISM: f64 = 1e-3;
/// Least to greatest eigenvalue of the second moments below which the grids lie on a line, so that
/// translations alone tell no roll.
const LINE: f64 = 1e-10;
/// Departure of the rigid-body modes' mass matrix from that of a body above which none is made.
const NO_BODY: f64 = 0.05;

/// Rigid motions fitted to the shapes of a model.
#[derive(Debug)]
struct Rigid<'a> {
    model: &'a Model,
    centre_m: Vector3<f64>,
    /// Root mean square distance from the centre, m; it makes rotations comparable.
    radius_m: f64,
    /// Grids whose rotation counts as well: all that turn, where the grids lie on a line.
    turning: bool,
    inverse: Matrix6<f64>,
}

impl<'a> Rigid<'a> {
    fn new(model: &'a Model) -> Self {
        let n = model.ids.len() as f64;
        let centre_m = model.positions_m.iter().sum::<Vector3<f64>>() / n;
        let arms = || model.positions_m.iter().map(|p| p - centre_m);
        let radius_m = (arms().map(|a| a.norm_squared()).sum::<f64>() / n).sqrt();
        let radius_m = if radius_m > 0.0 { radius_m } else { 1.0 };
        let moment: Matrix3<f64> = arms()
            .map(|a| Matrix3::from_diagonal_element(a.norm_squared()) - a * a.transpose())
            .sum();
        let eigen = moment.symmetric_eigenvalues();
        let turning = !(eigen.min() > LINE * eigen.max());
        let mut rigid = Self { model, centre_m, radius_m, turning, inverse: Matrix6::zeros() };
        let mut normal = Matrix6::zeros();
        for i in 0..model.ids.len() {
            let arm = rigid.arm(i).cross_matrix();
            let mut g = nalgebra::SMatrix::<f64, 3, 6>::zeros();
            g.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
            g.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm);
            normal += g.transpose() * g;
            if rigid.turns(i) {
                for k in 3..6 {
                    normal[(k, k)] += 1.0;
                }
            }
        }
        // Directions that nothing observes stay out of the solution.
        let eigen = normal.symmetric_eigen();
        let floor = LINE * eigen.eigenvalues.max();
        let inverse = eigen.eigenvalues.map(|v| if v > floor { 1.0 / v } else { 0.0 });
        rigid.inverse =
            eigen.eigenvectors * Matrix6::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
        rigid
    }

    fn turns(&self, i: usize) -> bool {
        self.turning && self.model.turns[i]
    }

    /// Position from the centre in units of the radius.
    fn arm(&self, i: usize) -> Vector3<f64> {
        (self.model.positions_m[i] - self.centre_m) / self.radius_m
    }

    /// The nearest rigid motion (translation of the centre, rotation times the radius) and the
    /// share of the shape it leaves.
    fn fit(&self, mode: &Mode) -> (Vector6<f64>, f64) {
        let parts = || (0..self.model.ids.len()).map(|i| (i, mode.shape[i], mode.slope[i]));
        let (mut t, mut r) = (Vector3::zeros(), Vector3::zeros());
        for (i, u, turn) in parts() {
            t += u;
            r += self.arm(i).cross(&u);
            if self.turns(i) {
                r += turn * self.radius_m;
            }
        }
        let right = Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z);
        let p = self.inverse * right;
        let (t, r) = (p.fixed_rows::<3>(0).into_owned(), p.fixed_rows::<3>(3).into_owned());
        let (mut left, mut all) = (0.0, 0.0);
        for (i, u, turn) in parts() {
            left += (u - t - r.cross(&self.arm(i))).norm_squared();
            all += u.norm_squared();
            if self.turns(i) {
                left += (turn * self.radius_m - r).norm_squared();
                all += (turn * self.radius_m).norm_squared();
            }
        }
        (p, if all > 0.0 { (left / all).sqrt() } else { f64::INFINITY })
    }
}

/// A recognised rigid-body mode and its quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMode {
    /// Number in the file.
    pub number: i64,
    /// Its frequency, Hz; zero if it were perfect.
    pub frequency_hz: f64,
    /// Share of the shape that no rigid motion explains, 0 to 1.
    pub residual: f64,
}

/// The rigid-body modes of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBody {
    /// The modes that are rigid motions.
    pub modes: Vec<RigidMode>,
    /// Places of the elastic modes in the model, by ascending frequency.
    pub elastic: Vec<usize>,
    /// What is doubtful about them, one sentence each.
    pub warnings: Vec<String>,
    places: Vec<usize>,
}

/// Tells the rigid-body modes of `model` from the elastic ones.
///
/// # Errors
/// More than six rigid motions, a mechanism, an elastic mode of negative eigenvalue, no elastic
/// mode: one sentence each.
pub fn recognise(model: &Model) -> Result<RigidBody, Vec<String>> {
    let rigid = Rigid::new(model);
    let mut body = RigidBody { modes: vec![], elastic: vec![], warnings: vec![], places: vec![] };
    let mut residuals = Vec::new();
    for (place, mode) in model.modes.iter().enumerate() {
        let (_, residual) = rigid.fit(mode);
        residuals.push(residual);
        if residual <= RIGID_SHAPE {
            let (number, frequency_hz) = (mode.number, mode.frequency_hz);
            body.modes.push(RigidMode { number, frequency_hz, residual });
            body.places.push(place);
        } else {
            body.elastic.push(place);
        }
    }
    let mut faults = Vec::new();
    if body.modes.len() > 6 {
        faults.push(format!(
            "{} modes that are rigid motions on the {} grids with results, where a free body has 6: \
             too few grids, or parts that are not connected",
            body.modes.len(),
            model.ids.len()
        ));
    }
    let hz = |place: usize| model.modes[place].frequency_hz;
    for pair in body.elastic.windows(2) {
        // A frequency of zero has its own fault below.
        if hz(pair[0]) > 0.0 && hz(pair[0]) <= MECHANISM * hz(pair[1]) {
            faults.push(format!(
                "mode {} at {:.3e} Hz, {:.1e} of the next, and no rigid motion (residual {:.2}): a \
                 mechanism or a loose part",
                model.modes[pair[0]].number,
                hz(pair[0]),
                hz(pair[0]) / hz(pair[1]),
                residuals[pair[0]]
            ));
        }
    }
    for &place in body.elastic.iter().filter(|&&place| !(hz(place) > 0.0)) {
        faults.push(format!(
            "mode {} of eigenvalue zero or below ({:.3e} Hz), and no rigid motion (residual {:.2})",
            model.modes[place].number,
            hz(place),
            residuals[place]
        ));
    }
    if body.elastic.is_empty() {
        faults.push("no elastic mode".to_owned());
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let first = hz(body.elastic[0]);
    if body.modes.len() < 6 {
        body.warnings.push(format!(
            "{} rigid-body modes of 6: the model is held, or they were left out of the solution",
            body.modes.len()
        ));
    }
    for mode in &body.modes {
        let over = mode.frequency_hz.abs() / first;
        if !(over < 1.0) {
            return Err(vec![format!(
                "mode {} at {:.4} Hz, above the first elastic mode at {first:.4} Hz, that moves all \
                 grids with results as one: results at too few grids",
                mode.number, mode.frequency_hz
            )]);
        }
        if !(over <= POOR_FREQUENCY) {
            body.warnings.push(format!(
                "rigid-body mode {} at {:.3e} Hz, {:.0} % of the first elastic mode at {first:.4} Hz",
                mode.number,
                mode.frequency_hz,
                100.0 * over
            ));
        }
        if !(mode.residual <= POOR_SHAPE) {
            body.warnings.push(format!(
                "rigid-body mode {} departs by {:.1} % from a rigid motion",
                mode.number,
                100.0 * mode.residual
            ));
        }
    }
    Ok(body)
}

/// Mass properties held by six rigid-body modes, and the departure from those of a body, relative.
///
/// Modes of unit generalised mass are rigid motions p (translation of a point, rotation), so that
/// `Pᵀ M P = 1` and the rigid mass matrix is `M = (P Pᵀ)⁻¹`, whatever combinations of motions the
/// modes are. Of a body it is `[[m 1, −m d×], [m d×, J − m d× d×]]`.
///
/// # Errors
/// What is missing, in a sentence: six modes that span all rigid motions; or that the matrix is
/// not that of a body (a liquid that moves sideways with its tank, but not along it, makes it so).
pub fn mass_properties(
    model: &Model,
    body: &RigidBody,
    generalised_kg: &[f64],
) -> Result<(MassProperties, f64), String> {
    if body.places.len() != 6 {
        return Err(format!(
            "{} rigid-body modes, where 6 hold the mass matrix",
            body.places.len()
        ));
    }
    let rigid = Rigid::new(model);
    let mut p = Matrix6::zeros();
    for (column, &place) in body.places.iter().enumerate() {
        let motion = rigid.fit(&model.modes[place]).0 / generalised_kg[place].sqrt();
        p.set_column(column, &motion);
    }
    let flexibility = p * p.transpose();
    if !flexibility.iter().all(|x| x.is_finite()) {
        return Err("rigid-body modes that are not finite".to_owned());
    }
    let eigen = flexibility.symmetric_eigenvalues();
    let inverse = flexibility.try_inverse().filter(|_| eigen.min() > LINE * eigen.max());
    let Some(mass) = inverse else {
        return Err("rigid-body modes that do not span all rigid motions".to_owned());
    };
    let block = |i: usize, j: usize| mass.fixed_view::<3, 3>(i, j).into_owned();
    let mass_kg = block(0, 0).trace() / 3.0;
    let cross = block(0, 3) / -mass_kg;
    let skew = (cross - cross.transpose()) / 2.0;
    let d = Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]);
    let departure = (block(0, 0) / mass_kg - Matrix3::identity()).norm().max((cross - skew).norm());
    let inertia = (block(3, 3) + skew * skew * mass_kg) * rigid.radius_m.powi(2);
    if !(departure <= NO_BODY) {
        return Err(format!(
            "rigid-body modes whose mass differs by direction: {:.4e}, {:.4e}, {:.4e} kg in x, y, z",
            mass[(0, 0)],
            mass[(1, 1)],
            mass[(2, 2)]
        ));
    }
    let properties = MassProperties {
        mass_kg,
        cg_m: rigid.centre_m + d * rigid.radius_m,
        inertia_kg_m2: (inertia + inertia.transpose()) / 2.0,
    };
    Ok((properties, departure))
}

/// Mass properties of lumped masses.
pub fn lumped(model: &Model) -> Option<MassProperties> {
    let lumps = model.lumps.as_ref()?;
    let mass_kg: f64 = lumps.iter().map(|l| l.mass_kg).sum();
    let cg_m =
        (lumps.iter().zip(&model.positions_m)).map(|(l, p)| p * l.mass_kg).sum::<Vector3<f64>>()
            / mass_kg;
    let inertia_kg_m2 = (lumps.iter().zip(&model.positions_m))
        .map(|(l, p)| {
            let a = p - cg_m;
            l.inertia_kg_m2
                + (Matrix3::from_diagonal_element(a.norm_squared()) - a * a.transpose()) * l.mass_kg
        })
        .sum();
    (mass_kg > 0.0).then_some(MassProperties { mass_kg, cg_m, inertia_kg_m2 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::model::Lump;
    use std::collections::BTreeMap;

    /// A body of lumps at the corners of a skew box, and motions as modes of the given frequencies.
    fn model(
        motions: &[(f64, Vector3<f64>, Vector3<f64>)],
        extra: &[(f64, Vec<Vector3<f64>>)],
    ) -> Model {
        let positions_m: Vec<_> = (0..8)
            .map(|i| {
                let bit = |b: i32| f64::from(i >> b & 1);
                Vector3::new(10.0 * bit(0) + 3.0, 2.0 * bit(1), 1.0 * bit(2) + 0.3 * bit(0))
            })
            .collect();
        let rigid = motions.iter().map(|&(hz, t, r)| {
            (hz, positions_m.iter().map(|p| t + r.cross(p)).collect::<Vec<_>>())
        });
        let all: Vec<_> = rigid.chain(extra.iter().cloned()).collect();
        let modes = (all.into_iter().enumerate())
            .map(|(i, (frequency_hz, shape))| Mode {
                number: i as i64 + 1,
                frequency_hz,
                generalised_kg: None,
                slope: vec![Vector3::zeros(); shape.len()],
                shape,
            })
            .collect();
        let lump = |i: usize| Lump {
            mass_kg: 1.0 + i as f64,
            inertia_kg_m2: Matrix3::from_diagonal_element(0.1 * i as f64),
        };
        Model {
            ids: (1..=8).collect(),
            turns: vec![false; 8],
            lumps: Some((0..8).map(lump).collect()),
            sets: BTreeMap::new(),
            bare: Vec::new(),
            rounding: 0.0,
            warnings: Vec::new(),
            positions_m,
            modes,
        }
    }

    fn bent() -> Vec<Vector3<f64>> {
        (0..8).map(|i| Vector3::y() * if i % 3 == 0 { 1.0 } else { -0.6 }).collect()
    }

    /// Six motions that mix translations and rotations.
    fn six() -> Vec<(f64, Vector3<f64>, Vector3<f64>)> {
        (0..6)
            .map(|i| {
                let part = |k: usize| {
                    ((i * 7 + k * 3) % 11) as f64 / 7.0 - 0.6 + f64::from(u8::from(i == k))
                };
                (
                    1e-4,
                    Vector3::new(part(0), part(1), part(2)),
                    Vector3::new(part(3), part(4), part(5)) * 0.2,
                )
            })
            .collect()
    }

    #[test]
    fn mixed_rigid_motions_are_recognised_and_a_bending_mode_is_not() {
        let found = recognise(&model(&six(), &[(5.0, bent())])).unwrap();
        assert_eq!((found.modes.len(), found.elastic.as_slice()), (6, &[6][..]));
        assert!(found.modes.iter().all(|m| m.residual < 1e-12));
        assert!(found.warnings.is_empty());
    }

    #[test]
    fn the_mass_matrix_of_six_mixed_rigid_modes_is_that_of_the_lumps() {
        let model = model(&six(), &[(5.0, bent())]);
        let found = recognise(&model).unwrap();
        // Rigid motions are modes once orthonormal by mass: Gram-Schmidt over the lumps.
        let exact = lumped(&model).unwrap();
        let lumps = model.lumps.as_ref().unwrap();
        let turn: Vec<_> = six().iter().map(|m| m.2).collect();
        let mut gram = Matrix6::<f64>::zeros();
        for i in 0..6 {
            for j in 0..6 {
                gram[(i, j)] = (0..8)
                    .map(|k| {
                        lumps[k].mass_kg * model.modes[i].shape[k].dot(&model.modes[j].shape[k])
                            + (lumps[k].inertia_kg_m2 * turn[j]).dot(&turn[i])
                    })
                    .sum::<f64>();
            }
        }
        let mix: Matrix6<f64> = gram.cholesky().unwrap().l().try_inverse().unwrap();
        let mut orthonormal = model.clone();
        for i in 0..6 {
            for k in 0..8 {
                orthonormal.modes[i].shape[k] =
                    (0..6).map(|j| model.modes[j].shape[k] * mix[(i, j)]).sum::<Vector3<f64>>();
            }
        }
        let (body, departure) = mass_properties(&orthonormal, &found, &[1.0; 7]).unwrap();
        assert!(departure < 1e-10);
        assert!((body.mass_kg / exact.mass_kg - 1.0).abs() < 1e-11);
        assert!((body.cg_m - exact.cg_m).norm() < 1e-10);
        let error = (body.inertia_kg_m2 - exact.inertia_kg_m2).norm();
        assert!(error < 1e-9 * exact.inertia_kg_m2.norm(), "{error}");
        // The same modes, each of a generalised mass of 4 kg.
        let mut doubled = orthonormal;
        doubled.modes.iter_mut().for_each(|m| m.shape.iter_mut().for_each(|u| *u *= 2.0));
        let (body, _) = mass_properties(&doubled, &found, &[4.0; 7]).unwrap();
        assert!((body.mass_kg / exact.mass_kg - 1.0).abs() < 1e-11);
    }

    #[test]
    fn poor_rigid_modes_are_reported_and_too_few_hold_no_mass() {
        let mut motions = six();
        motions.truncate(5);
        motions[2].0 = 2.0;
        let model = model(&motions, &[(5.0, bent())]);
        let found = recognise(&model).unwrap();
        assert_eq!(found.warnings.len(), 2, "{:?}", found.warnings);
        assert!(found.warnings[0].contains("5 rigid-body modes of 6"));
        assert!(found.warnings[1].contains("40 % of the first elastic mode"));
        assert!(mass_properties(&model, &found, &[1.0; 6]).unwrap_err().contains("5 rigid-body"));
    }

    #[test]
    fn a_mechanism_a_negative_eigenvalue_and_a_seventh_rigid_motion_are_refused() {
        let loose = [(1e-4, bent()), (5.0, bent())];
        assert!(recognise(&model(&six(), &loose)).unwrap_err()[0].contains("mechanism"));
        let negative = [(-3.0, bent()), (5.0, bent())];
        assert!(recognise(&model(&six(), &negative)).unwrap_err()[0].contains("zero or below"));
        let mut seven = six();
        seven.push(six()[0]);
        assert!(recognise(&model(&seven, &[(5.0, bent())])).unwrap_err()[0].contains("7 modes"));
        assert_eq!(recognise(&model(&six(), &[])).unwrap_err(), ["no elastic mode"]);
    }

    #[test]
    fn rotations_tell_the_roll_of_grids_on_a_line() {
        let mut line = model(&six(), &[(5.0, bent())]);
        for (i, p) in line.positions_m.iter_mut().enumerate() {
            *p = Vector3::x() * i as f64;
        }
        line.turns = vec![true; 8];
        for (mode, (_, t, r)) in line.modes.iter_mut().zip(six()) {
            mode.shape = line.positions_m.iter().map(|p| t + r.cross(p)).collect();
            mode.slope = vec![r; 8];
        }
        line.modes[6].slope = (0..8).map(|i| Vector3::z() * f64::from(i)).collect();
        let found = recognise(&line).unwrap();
        assert_eq!(found.modes.len(), 6);
        // They span all rigid motions, but are not normalised to any body.
        let refused = mass_properties(&line, &found, &[1.0; 7]).unwrap_err();
        assert!(refused.contains("differs by direction"), "{refused}");
    }
}
