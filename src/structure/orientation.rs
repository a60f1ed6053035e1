//! Orientation of repeated modes and sign of every mode, independent of the solver.
//!
//! Eigenvectors only; how modes at different flight times correspond is found in `label`.
//!
//! **Repeated modes.** Consecutive modes whose squared frequencies differ by less than
//! [`CLUSTER`] (relative), or by no more than round-off, span one subspace; in it any rotation is as good, and a solver returns
//! one by chance. The basis is chosen by a fixed list of geometric fields over the body (lateral
//! y, then z, axial, roll; even, then odd in y and z; waves of growing number along x): the first
//! mode is the projection onto the subspace of the first field that it answers to at least half
//! as strongly as to any other, the next is that of a field projected onto what remains, and so on.
//! So a pair of bending modes of a round beam comes out as pure y, then pure z, and a pair
//! on two sides of a mirror plane as symmetric and antisymmetric.
//!
//! **Sign.** The freedom of greatest size is positive; among those equal to within a millionth
//! the first in order of direction (y, z, x), then of position decides. Rotations decide only
//! where nothing translates.

use super::weigh::FREEDOMS;
use faer::{Col, Mat, MatRef};
use nalgebra::Vector3;

/// Relative difference of squared frequencies under which modes count as repeated: √ε. Vectors of
/// a closer pair have lost more than half of their digits to round-off.
pub const CLUSTER: f64 = 1.490_116_119_384_765_6e-8;

/// The mass that weighs shapes over the six freedoms of each node.
#[derive(Debug, Clone, Copy)]
pub enum Mass<'a> {
    /// A mass matrix.
    Full(MatRef<'a, f64>),
    /// Its diagonal, where there is nothing else.
    Diagonal(&'a [f64]),
}

impl Mass<'_> {
    fn times(&self, shapes: MatRef<'_, f64>) -> Mat<f64> {
        match self {
            Self::Full(mass) => mass * shapes,
            Self::Diagonal(mass) => {
                Mat::from_fn(shapes.nrows(), shapes.ncols(), |i, j| mass[i] * shapes[(i, j)])
            }
        }
    }

    fn energy(&self, field: &Col<f64>) -> f64 {
        match self {
            Self::Full(mass) => field.transpose() * mass * field,
            Self::Diagonal(mass) => mass.iter().zip(field.iter()).map(|(m, v)| m * v * v).sum(),
        }
    }

    fn at(&self, i: usize) -> f64 {
        match self {
            Self::Full(mass) => mass[(i, i)],
            Self::Diagonal(mass) => mass[i],
        }
    }
}

/// Whether the mode at `i` and the next are repeated. `mu` are the inverse squares of the circular
/// frequencies of a model with `n` freedoms, descending, each known to `n ε mu[0]`.
fn repeated(mu: &[f64], i: usize, n: usize) -> bool {
    let round_off = n as f64 * f64::EPSILON * mu[0];
    i + 1 < mu.len() && mu[i] - mu[i + 1] <= CLUSTER * mu[i] + round_off
}

/// Number of modes to be oriented so that no cluster among the first `kept` is cut through.
pub(super) fn whole(mu: &[f64], kept: usize, n: usize) -> usize {
    let more = (kept..).take_while(|&i| i > 0 && repeated(mu, i - 1, n)).count();
    kept + more
}

/// Orients repeated modes and fixes the sign of all. `mu` are the inverse squares of the circular
/// frequencies, descending; modes are columns over the six freedoms of the nodes at `positions_m`,
/// of unit generalised mass.
pub fn orient(mu: &[f64], shapes: &mut Mat<f64>, mass: Mass<'_>, positions_m: &[Vector3<f64>]) {
    let n = shapes.nrows();
    let mut start = 0;
    while start < mu.len() {
        let more = (start..).take_while(|&i| repeated(mu, i, n)).count();
        if more > 0 {
            rotate(shapes, start, more + 1, mass, positions_m);
        }
        start += more + 1;
    }
    let order = freedoms_in_order(positions_m);
    for j in 0..shapes.ncols() {
        if deciding(shapes, j, &order) < 0.0 {
            for i in 0..shapes.nrows() {
                shapes[(i, j)] = -shapes[(i, j)];
            }
        }
    }
}

/// Rotates the `size` columns from `start` into their canonical basis.
fn rotate(
    shapes: &mut Mat<f64>,
    start: usize,
    size: usize,
    mass: Mass<'_>,
    positions_m: &[Vector3<f64>],
) {
    let old = shapes.subcols(start, size).to_owned();
    let momentum = mass.times(old.as_ref());
    // Answers of the subspace to each field: coefficients that any rotation turns alike.
    let mut answers: Vec<Col<f64>> = fields(positions_m)
        .iter()
        .map(|field| {
            let energy = mass.energy(field).max(f64::MIN_POSITIVE);
            momentum.transpose() * field * faer::Scale(1.0 / energy.sqrt())
        })
        .collect();
    // Should no field reach some direction, the single freedoms do.
    answers.extend(
        freedoms_in_order(positions_m)
            .into_iter()
            .map(|i| Col::from_fn(size, |j| old[(i, j)] * mass.at(i).max(0.0).sqrt())),
    );
    let mut basis: Vec<Col<f64>> = Vec::new();
    while basis.len() < size {
        let greatest = answers.iter().map(|a| a.norm_l2()).fold(0.0, f64::max);
        let Some(first) = answers.iter().find(|a| a.norm_l2() >= 0.5 * greatest) else {
            return; // not finite: left as it came, and refused later
        };
        let mut next = first.clone();
        // Twice is enough: the second pass removes what cancellation left in the first.
        for _ in 0..2 {
            for b in &basis {
                let part = b.transpose() * &next;
                next -= b * faer::Scale(part);
            }
        }
        let norm = next.norm_l2();
        let next = next * faer::Scale(1.0 / norm);
        for a in &mut answers {
            let part = next.transpose() * &*a;
            *a -= &next * faer::Scale(part);
        }
        basis.push(next);
    }
    let turn = Mat::from_fn(size, size, |i, j| basis[j][i]);
    shapes.subcols_mut(start, size).copy_from(&old * turn);
}

/// Number of half waves along x to which the fields go.
const WAVES: usize = 16;

/// Geometric fields over the freedoms, in order of preference.
fn fields(positions_m: &[Vector3<f64>]) -> Vec<Col<f64>> {
    let extent = |axis: usize| {
        let values = positions_m.iter().map(|p| p[axis]);
        let (least, most) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        (0.5 * (least + most), most - least)
    };
    let (cx, lx) = extent(0);
    // A body without extent in a direction has no sides there.
    let scale = (0..3).map(|axis| extent(axis).1).fold(f64::MIN_POSITIVE, f64::max);
    let lx = lx.max(CLUSTER * scale);
    let lateral = |p: &Vector3<f64>, axis: usize| {
        let (c, l) = extent(axis);
        2.0 * (p[axis] - c) / l.max(CLUSTER * scale)
    };
    let mut fields = Vec::new();
    for wave in 0..WAVES {
        for factor in 0..3 {
            for freedom in [1, 2, 0, 3] {
                let mut field = Col::zeros(FREEDOMS * positions_m.len());
                for (node, p) in positions_m.iter().enumerate() {
                    let phase = std::f64::consts::PI * wave as f64 * ((p.x - cx) / lx + 0.5);
                    let side = if factor == 0 { 1.0 } else { lateral(p, factor) };
                    field[FREEDOMS * node + freedom] = phase.cos() * side;
                }
                fields.push(field);
            }
        }
    }
    fields
}

/// All freedoms by direction (y, z, x, then rotations likewise), then by position.
fn freedoms_in_order(positions_m: &[Vector3<f64>]) -> Vec<usize> {
    let mut nodes: Vec<usize> = (0..positions_m.len()).collect();
    nodes.sort_by(|&a, &b| {
        let (p, q) = (positions_m[a], positions_m[b]);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
    });
    [1, 2, 0, 4, 5, 3]
        .into_iter()
        .flat_map(|freedom| nodes.iter().map(move |node| FREEDOMS * node + freedom))
        .collect()
}

/// The component that decides the sign of column `j`.
fn deciding(shapes: &Mat<f64>, j: usize, order: &[usize]) -> f64 {
    let (translations, rotations) = order.split_at(order.len() / 2);
    let greatest = |part: &[usize]| part.iter().map(|&i| shapes[(i, j)].abs()).fold(0.0, f64::max);
    // In pure torsion the translations are round-off beside a rotation over a metre.
    let still = greatest(translations) <= 1e-6 * greatest(rotations);
    let part = if still { rotations } else { translations };
    let bound = (1.0 - 1e-6) * greatest(part);
    part.iter().map(|&i| shapes[(i, j)]).find(|v| v.abs() >= bound).unwrap_or(0.0)
}
