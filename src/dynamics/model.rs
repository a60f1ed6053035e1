//! A linear model `M q̈ + D q̇ + K q = 0` in the coordinates of a layout.
//!
//! It holds matrices; what they mean is decided in `assemble`, what follows from them in `modal`.

use faer::Mat;

/// The matrices of one linear model, n×n each, in SI units.
#[derive(Debug, Clone)]
pub struct Model {
    /// Mass matrix M, symmetric positive definite.
    pub mass: Mat<f64>,
    /// Damping matrix D.
    pub damping: Mat<f64>,
    /// Stiffness matrix K.
    pub stiffness: Mat<f64>,
}

impl Model {
    /// A model of zeros with `coordinates` coordinates.
    pub fn zeros(coordinates: usize) -> Self {
        let zero = || Mat::zeros(coordinates, coordinates);
        Self { mass: zero(), damping: zero(), stiffness: zero() }
    }

    /// Number of generalised coordinates.
    pub fn coordinates(&self) -> usize {
        self.mass.nrows()
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.mass.fill(0.0);
        self.damping.fill(0.0);
        self.stiffness.fill(0.0);
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        [&self.mass, &self.damping, &self.stiffness].into_iter().all(|matrix| {
            matrix.col_iter().all(|column| column.iter().all(|value| value.is_finite()))
        })
    }

    /// Sets this model to `(1 − t) a + t b`.
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
    }
}
