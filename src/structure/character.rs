//! Character of a mode: the direction in which most of its kinetic energy lies.
//!
//! For tables that people read; nothing is decided by it.

use crate::vehicle::{Grid, Mode};
use std::fmt;

/// Direction of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Translation along x.
    Axial,
    /// Translation along y, and rotation about z.
    BendingY,
    /// Translation along z, and rotation about y.
    BendingZ,
    /// Rotation about x.
    Torsion,
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Axial => "axial",
            Self::BendingY => "bending y",
            Self::BendingZ => "bending z",
            Self::Torsion => "torsion",
        })
    }
}

/// The foremost direction of a mode and its share of the kinetic energy, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Character {
    /// Direction.
    pub direction: Direction,
    /// Its share of the lumped kinetic energy.
    pub share: f64,
}

impl Character {
    /// Character of `mode` on `grids` by their lumped masses and inertias (`Σ m φ² + J ψ²`); `None`
    /// where they weigh nothing.
    pub fn of(mode: &Mode, grids: &[Grid]) -> Option<Self> {
        let mut energy = [0.0; 4];
        for ((grid, shape), slope) in grids.iter().zip(&mode.shape).zip(&mode.slope) {
            let shift = grid.mass_kg.component_mul(&shape.component_mul(shape));
            let turn = grid.inertia_kg_m2.component_mul(&slope.component_mul(slope));
            energy[0] += shift.x;
            energy[1] += shift.y + turn.z;
            energy[2] += shift.z + turn.y;
            energy[3] += turn.x;
        }
        let directions =
            [Direction::Axial, Direction::BendingY, Direction::BendingZ, Direction::Torsion];
        let total: f64 = energy.iter().sum();
        let (direction, most) = (directions.into_iter().zip(energy))
            .fold((Direction::Axial, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        (total > 0.0).then(|| Self { direction, share: most / total })
    }
}
