//! A linear model of mixed order, `M ẍ + D ẋ + K x = 0` in the coordinates of a layout.
//!
//! It holds matrices; what they mean is decided in `assemble`, what follows from them in `modal`.

use super::Interface;
use faer::Mat;
use std::ops::Range;

/// The matrices of one linear model in SI units, N×N each.
///
/// The first n coordinates are of second order; the last ones are first-order states x_a: their rows
/// and columns of M are zero and their block of D is the unit matrix, so that
/// `ẋ_a = −K_aa x_a − K_aq q − D_aq q̇` and `−K_qa x_a` is the force they exert.
#[derive(Debug, Clone)]
pub struct Model {
    /// Mass matrix M, symmetric positive definite in its second-order block.
    pub mass: Mat<f64>,
    /// Damping matrix D.
    pub damping: Mat<f64>,
    /// Stiffness matrix K.
    pub stiffness: Mat<f64>,
    /// Number n of second-order coordinates.
    pub second_order: usize,
    /// States (numbered in [q, q̇, x_a], ascending) that no equation of another kept state reads:
    /// each is a pole at the origin, known without solving. The state matrix leaves them out.
    pub null_states: Vec<usize>,
    /// A motion at no cost that is no single state: its null state and the components of the other
    /// states per unit of that one. The state matrix is that of the states less this motion.
    pub null_motion: Option<NullMotion>,
    /// Most poles at the origin that the equations may have beside the null states: integrators that
    /// nothing drives, rotations that nothing holds. Beyond these, a pole lost in the rounding is an error.
    pub at_origin: usize,
    /// How the elastic coordinates are coupled, as far as it was said; the matrices hold it too.
    pub interface: Interface,
}

/// See [`Model::null_motion`].
#[derive(Debug, Clone, PartialEq)]
pub struct NullMotion {
    /// The null state left out, one of [`Model::null_states`]: a rotation, whose rate is kept, or a rate.
    pub state: usize,
    /// Other states and their components per unit of the one left out.
    pub others: Vec<(usize, f64)>,
}

impl Model {
    /// A model of zeros with `coordinates` coordinates, all of second order.
    pub fn zeros(coordinates: usize) -> Self {
        let zero = || Mat::zeros(coordinates, coordinates);
        Self {
            mass: zero(),
            damping: zero(),
            stiffness: zero(),
            second_order: coordinates,
            null_states: Vec::new(),
            null_motion: None,
            at_origin: 0,
            interface: Interface::default(),
        }
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.mass.nrows()
    }

    /// Mass, damping and stiffness down a column.
    pub fn column(&self, column: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
        let [mass, damping, stiffness] =
            [&self.mass, &self.damping, &self.stiffness].map(|matrix| matrix.col_as_slice(column));
        mass.iter().zip(damping).zip(stiffness).map(|((m, d), k)| [*m, *d, *k])
    }

    /// Number of states that are solved for: 2n + p less the null states.
    pub fn states(&self) -> usize {
        self.second_order + self.coordinates() - self.null_states.len()
    }

    /// Sets every entry to zero, with `second_order` coordinates of second order and the unit block
    /// of the others.
    pub fn clear(&mut self, second_order: usize) {
        self.mass.fill(0.0);
        self.damping.fill(0.0);
        self.stiffness.fill(0.0);
        self.second_order = second_order;
        self.null_states.clear();
        self.null_motion = None;
        self.at_origin = 0;
        self.interface.clear();
        for state in second_order..self.coordinates() {
            self.damping[(state, state)] = 1.0;
        }
    }

    /// The model in which the rigid rotation is kept, null or not, as outputs may read it; the `translation` is left out
    /// where it is null.
    pub fn observed(&self, translation: Range<usize>) -> Self {
        let mut observed = self.clone();
        let n = self.second_order;
        observed.null_motion = None;
        observed.null_states.retain(|state| {
            translation.contains(state) || translation.contains(&state.wrapping_sub(n))
        });
        observed
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        [&self.mass, &self.damping, &self.stiffness].into_iter().all(|matrix| {
            matrix.col_iter().all(|column| column.iter().all(|value| value.is_finite()))
        })
    }

    /// Sets this model to `(1 − t) a + t b`, two models of one layout. Null states are those of both; a
    /// motion that is not the same in both is kept and may leave its pole at the origin.
    pub fn blend(&mut self, a: &Self, b: &Self, t: f64) {
        let pairs = [
            (&mut self.mass, &a.mass, &b.mass),
            (&mut self.damping, &a.damping, &b.damping),
            (&mut self.stiffness, &a.stiffness, &b.stiffness),
        ];
        for (to, a, b) in pairs {
            for column in 0..a.ncols() {
                for row in 0..a.nrows() {
                    to[(row, column)] = (1.0 - t) * a[(row, column)] + t * b[(row, column)];
                }
            }
        }
        self.second_order = a.second_order;
        self.interface.clear();
        self.null_states.clear();
        let motions = [&a.null_motion, &b.null_motion];
        self.null_motion = if motions[0] == motions[1] { motions[0].clone() } else { None };
        let motion = |state: &usize| {
            self.null_motion.is_none()
                && motions.iter().copied().flatten().any(|motion| motion.state == *state)
        };
        let kept = usize::from(motions[0] != motions[1]);
        self.at_origin = a.at_origin.max(b.at_origin) + kept;
        let both = a.null_states.iter().filter(|s| b.null_states.contains(s) && !motion(s));
        self.null_states.extend(both);
    }
}
