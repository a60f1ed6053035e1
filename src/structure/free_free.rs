//! Free-free eigenproblem: six rigid-body vectors by geometry, elastic modes by deflation.
//!
//! It knows matrices and node positions; what is assembled, labelled or kept is not its business.

use super::orientation::{self, Mass};
use super::solve::Error;
use super::weigh::{FREEDOMS, Weighed};
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Mat, MatRef, Par, Side};
use nalgebra::Matrix6;

/// Free-free modes of a weighed model.
#[derive(Debug, Clone)]
pub struct FreeFree {
    /// Squared circular frequencies of the elastic modes, (rad/s)², ascending.
    pub omega2: Vec<f64>,
    /// Elastic mode shapes as columns over the freedoms of the nodes, `φᵀ M φ = 1`.
    pub shapes: Mat<f64>,
    /// Rigid-body vectors as columns, `RᵀMR = 1`.
    pub rigid_shapes: Mat<f64>,
    /// The rigid body that was recognised, and how well.
    pub rigid: Rigid,
}

/// Quality of the recognised rigid-body modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// Number of modes without strain: six, or the solution is refused.
    pub count: usize,
    /// Greatest strain energy of a rigid-body vector over `Σ K_ii r_i²`, the energy its parts would
    /// have one by one; round-off if no spring holds the body to the ground.
    pub strain: f64,
    /// Greatest `|RᵀMφ|` over rigid-body vectors and elastic modes.
    pub overlap: f64,
}

/// Solves `K φ = ω² M φ` for the elastic modes, at most `count`, up to `limit` (rad/s)².
///
/// The rigid-body vectors R (`RᵀMR = 1`) come from the positions of the nodes. With
/// `K' = K + σ MR(MR)ᵀ = CCᵀ` and `M' = M − MR(MR)ᵀ`, the modes of `C⁻¹M'C⁻ᵀ` with eigenvalue 1/ω² are
/// the elastic ones, and only they: rigid motion has the eigenvalue 0. As the lowest
/// frequencies are the largest eigenvalues, they come out to full relative precision, and
/// freedoms without mass do no harm.
///
/// # Errors
/// No inertia against a rigid motion, a mechanism (a further motion without strain), no
/// convergence.
pub fn free_free(model: &Weighed, limit: f64, count: usize) -> Result<FreeFree, Error> {
    let (k, m) = (model.stiffness.as_ref(), model.mass.as_ref());
    let n = k.nrows();
    let rigid_shapes = rigid_shapes(model)?;
    let momentum = m * &rigid_shapes;
    // The deflating term is as large as it can be without outweighing the stiffness anywhere.
    let sigma = (0..n)
        .map(|i| k[(i, i)] / (0..6).map(|j| momentum[(i, j)].powi(2)).sum::<f64>())
        .filter(|s| *s > 0.0)
        .fold(f64::INFINITY, f64::min);
    let held = k + faer::Scale(sigma) * (&momentum * momentum.transpose());
    let Ok(cholesky) = held.llt(Side::Lower) else {
        return Err(mechanism(model, held.as_ref()));
    };
    let c = cholesky.L();
    let mut half = m - &momentum * momentum.transpose();
    solve_lower_triangular_in_place(c, half.as_mut(), Par::Seq);
    let mut flexibility = half.transpose().to_owned();
    solve_lower_triangular_in_place(c, flexibility.as_mut(), Par::Seq);
    let eigen = flexibility.self_adjoint_eigen(Side::Lower).map_err(|_| Error::NoConvergence)?;

    let mu: Vec<f64> = (0..n).rev().map(|i| eigen.S()[i]).collect();
    // Beyond the rigid ones, eigenvalues at round-off belong to freedoms without mass.
    let floor = n as f64 * f64::EPSILON * mu.first().copied().unwrap_or(0.0);
    let elastic: Vec<f64> =
        mu.into_iter().take(n.saturating_sub(6)).take_while(|&mu| mu > floor).collect();
    let kept = elastic.iter().take(count).take_while(|&&mu| 1.0 / mu <= limit).count();
    // A cluster of eigenvalues is oriented as a whole, even where the count cuts through it.
    let elastic = &elastic[..orientation::whole(&elastic, kept, n)];
    let mut shapes =
        Mat::from_fn(n, elastic.len(), |i, j| eigen.U()[(i, n - 1 - j)] / elastic[j].sqrt());
    solve_upper_triangular_in_place(c.transpose(), shapes.as_mut(), Par::Seq);
    let mut omega2: Vec<f64> = elastic.iter().map(|mu| 1.0 / mu).collect();
    for (j, &omega2) in omega2.iter().enumerate() {
        // Strain energy that round-off in K alone could feign.
        let parts: f64 = (0..n).map(|i| k[(i, i)] * shapes[(i, j)].powi(2)).sum();
        if !(omega2 > n as f64 * f64::EPSILON * parts) {
            return Err(mechanism(model, held.as_ref()));
        }
    }
    orientation::orient(elastic, &mut shapes, Mass::Full(m), &model.positions_m);
    omega2.truncate(kept);
    shapes.truncate(n, kept);
    clear_round_off(&mut shapes, m);
    let rigid = Rigid {
        count: 6,
        strain: greatest_strain(k, rigid_shapes.as_ref()),
        overlap: (momentum.transpose() * &shapes).norm_max(),
    };
    Ok(FreeFree { omega2, shapes, rigid_shapes, rigid })
}

/// Translations and rotations of all nodes, orthonormal with respect to the mass matrix.
fn rigid_shapes(model: &Weighed) -> Result<Mat<f64>, Error> {
    let n = model.mass.nrows();
    let mut shapes = Mat::zeros(n, 6);
    for (node, position) in model.positions_m.iter().enumerate() {
        let link = super::weigh::rigid_link(position - model.body.cg_m);
        for i in 0..FREEDOMS {
            for j in 0..6 {
                shapes[(FREEDOMS * node + i, j)] = link[(i, j)];
            }
        }
    }
    let gram = shapes.transpose() * &model.mass * &shapes;
    let gram = Matrix6::from_fn(|i, j| gram[(i, j)]);
    let inverse = (gram.cholesky())
        .and_then(|cholesky| cholesky.l().transpose().try_inverse())
        .ok_or(Error::Massless)?;
    Ok(&shapes * Mat::from_fn(6, 6, |i, j| inverse[(i, j)]))
}

/// Sets to zero what is no more than round-off beside the unit generalised mass, so that motions
/// which symmetry forbids are exactly zero.
fn clear_round_off(shapes: &mut Mat<f64>, m: MatRef<'_, f64>) {
    let n = m.nrows();
    let floor = (n as f64 * f64::EPSILON).powi(2);
    for j in 0..shapes.ncols() {
        for i in 0..n {
            if m[(i, i)] * shapes[(i, j)].powi(2) <= floor && m[(i, i)] > 0.0 {
                shapes[(i, j)] = 0.0;
            }
        }
    }
}

fn greatest_strain(k: MatRef<'_, f64>, shapes: MatRef<'_, f64>) -> f64 {
    let force = k * shapes;
    (0..shapes.ncols())
        .map(|j| {
            let (mut energy, mut parts) = (0.0, 0.0);
            for i in 0..k.nrows() {
                energy += shapes[(i, j)] * force[(i, j)];
                parts += k[(i, i)] * shapes[(i, j)].powi(2);
            }
            energy.abs() / parts
        })
        .fold(0.0, f64::max)
}

/// Counts and names the motions without strain besides those of the rigid body, from the
/// eigenvalues of K' scaled to a unit diagonal.
fn mechanism(model: &Weighed, held: MatRef<'_, f64>) -> Error {
    let n = held.nrows();
    let scale: Vec<f64> =
        (0..n).map(|i| if held[(i, i)] > 0.0 { 1.0 / held[(i, i)].sqrt() } else { 1.0 }).collect();
    let scaled = Mat::from_fn(n, n, |i, j| held[(i, j)] * scale[i] * scale[j]);
    let Ok(eigen) = scaled.self_adjoint_eigen(Side::Lower) else {
        return Error::NoConvergence;
    };
    // Round-off in an eigenvalue of a matrix with unit diagonal, whose norm is below n.
    let floor = n as f64 * n as f64 * f64::EPSILON;
    let extra = (0..n).take_while(|&i| !(eigen.S()[i] > floor)).count().max(1);
    // The node whose freedom moves most, in the scaled measure, names the place.
    let moving = (0..n)
        .max_by(|&a, &b| eigen.U()[(a, 0)].abs().total_cmp(&eigen.U()[(b, 0)].abs()))
        .unwrap_or(0);
    let grid = model.grids[moving / FREEDOMS].name.clone();
    Error::Mechanism { zero_modes: 6 + extra, grid }
}
