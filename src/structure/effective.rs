//! Rigid-body modes of a body by its mass properties, and effective masses of its elastic modes.
//!
//! For tables that people read, and for the quality of a package; no campaign uses them.

use crate::vehicle::{Grid, Mode, ModeSet};
use nalgebra::Vector3;

/// The six rigid-body modes of the body of `set` on its grids, of unit generalised mass: translation
/// along x, y and z, rotation of the cg's axes x, y and z, each freed of those before it.
pub fn rigid_modes(set: &ModeSet) -> Vec<Mode> {
    let body = &set.body;
    let translations = (0..3).map(|k| {
        let shape = Vector3::ith(k, 1.0 / body.mass_kg.sqrt());
        (format!("rigid {}", ["x", "y", "z"][k]), shape, Vector3::zeros())
    });
    // Gram and Schmidt by the inertia: the axes themselves where they are principal.
    let mut axes: Vec<Vector3<f64>> = Vec::new();
    for k in 0..3 {
        let mut axis = Vector3::ith(k, 1.0);
        for other in &axes {
            axis -= other * (body.inertia_kg_m2 * other).dot(&axis);
        }
        axes.push(axis / (body.inertia_kg_m2 * axis).dot(&axis).sqrt());
    }
    let names = ["rigid roll", "rigid pitch", "rigid yaw"];
    let rotations = names.into_iter().zip(axes);
    let rotations = rotations.map(|(name, axis)| (name.to_owned(), Vector3::zeros(), axis));
    translations
        .chain(rotations)
        .map(|(label, shift, turn): (String, Vector3<f64>, Vector3<f64>)| Mode {
            label,
            frequency_hz: 0.0,
            shape: (set.grids.iter())
                .map(|g| shift + turn.cross(&(g.position_m - body.cg_m)))
                .collect(),
            slope: vec![turn; set.grids.len()],
        })
        .collect()
}

/// Effective mass of `mode` in x, y, z, kg: `(Σ m φ)²` over unit generalised mass, on the lumped
/// masses of the grids; `None` where they weigh nothing. A free-free elastic mode moves no cg,
/// so that its effective mass is zero but for lumping: what is left measures its orthogonality to
/// the rigid-body modes, which hold the whole mass.
pub fn effective_mass_kg(mode: &Mode, grids: &[Grid]) -> Option<Vector3<f64>> {
    let total: Vector3<f64> = grids.iter().map(|g| g.mass_kg).sum();
    let momentum: Vector3<f64> =
        grids.iter().zip(&mode.shape).map(|(g, phi)| g.mass_kg.component_mul(phi)).sum();
    (total.max() > 0.0).then(|| momentum.component_mul(&momentum))
}

/// Mass which a lateral or axial force at a grid finds in `mode` alone, kg: the generalised mass
/// for a unit motion of that grid, `1/|φ|²`; infinite at a node of the mode.
pub fn mass_at_grid_kg(shape: &Vector3<f64>) -> f64 {
    shape.norm_squared().recip()
}

/// Greatest departure from orthonormality of the rigid-body modes to each other by the body's mass
/// properties.
#[cfg(test)]
fn orthonormality(set: &ModeSet) -> f64 {
    let modes = rigid_modes(set);
    let body = &set.body;
    let at_cg = |mode: &Mode| {
        let turn = mode.slope[0];
        (mode.shape[0] - turn.cross(&(set.grids[0].position_m - body.cg_m)), turn)
    };
    let inertia = body.inertia_kg_m2;
    let mut greatest = 0.0_f64;
    for (i, a) in modes.iter().enumerate() {
        for (j, b) in modes.iter().enumerate() {
            let ((u, p), (v, q)) = (at_cg(a), at_cg(b));
            let product = body.mass_kg * u.dot(&v) + (inertia * q).dot(&p);
            greatest = greatest.max((product - f64::from(u8::from(i == j))).abs());
        }
    }
    greatest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::MassProperties;
    use nalgebra::Matrix3;

    fn set() -> ModeSet {
        let grid = |x: f64, mass: f64| Grid {
            name: format!("g{x}"),
            position_m: Vector3::new(x, 0.0, 0.0),
            mass_kg: Vector3::repeat(mass),
            inertia_kg_m2: Vector3::zeros(),
        };
        ModeSet {
            flight_time_s: 0.0,
            body: MassProperties {
                mass_kg: 4.0,
                cg_m: Vector3::new(1.0, 0.2, 0.0),
                inertia_kg_m2: Matrix3::new(1.0, 0.2, 0.1, 0.2, 9.0, 0.3, 0.1, 0.3, 8.0),
            },
            grids: vec![grid(0.0, 1.0), grid(1.0, 2.0), grid(2.0, 1.0)],
            modes: Vec::new(),
        }
    }

    #[test]
    fn rigid_modes_are_orthonormal_by_mass_and_roll_is_about_x() {
        let set = set();
        assert!(orthonormality(&set) < 1e-13);
        let modes = rigid_modes(&set);
        let roll = modes[3].slope[0];
        assert_eq!(modes[3].label, "rigid roll");
        assert_eq!(roll, Vector3::x());
    }

    #[test]
    fn a_mode_that_moves_no_cg_has_no_effective_mass_and_a_translation_has_all() {
        let set = set();
        let mode = |y: [f64; 3]| Mode {
            label: String::new(),
            frequency_hz: 1.0,
            shape: y.map(|y| Vector3::y() * y).to_vec(),
            slope: vec![Vector3::zeros(); 3],
        };
        assert_eq!(effective_mass_kg(&mode([1.0, -1.0, 1.0]), &set.grids), Some(Vector3::zeros()));
        let shift = effective_mass_kg(&mode([0.5; 3]), &set.grids).unwrap();
        assert_eq!(shift, Vector3::y() * 4.0);
        assert_eq!(mass_at_grid_kg(&Vector3::new(0.0, 0.5, 0.0)), 4.0);
    }
}
