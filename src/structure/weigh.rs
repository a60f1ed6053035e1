//! Mass and stiffness matrices, mass properties and grids of a stick model at one flight time.
//!
//! Assembly only; what the matrices mean is found in `free_free`.

use super::Stick;
use super::beam::{self, Density, Local};
use super::solve::Error;
use crate::vehicle::{Grid, MassProperties};
use faer::Mat;
use nalgebra::{Matrix3, Matrix6, Vector3};
use std::ops::AddAssign;

/// Freedoms of a node: translations along and rotations about x, y, z.
pub const FREEDOMS: usize = 6;

/// A stick model at one flight time.
#[derive(Debug, Clone)]
pub struct Weighed {
    /// Mass matrix, 6 n × 6 n, node by node (u, θ).
    pub mass: Mat<f64>,
    /// Stiffness matrix, 6 n × 6 n.
    pub stiffness: Mat<f64>,
    /// Positions of the nodes, m.
    pub positions_m: Vec<Vector3<f64>>,
    /// Mass properties. Mass that is left out of axial motion or torsion of the modes counts in
    /// full here: it is carried along by the rigid vehicle.
    pub body: MassProperties,
    /// All grids: nodes, point masses, points.
    pub grids: Vec<Grid>,
    /// Node to which each grid is rigidly attached, and the way from the node to the grid, m.
    pub links: Vec<(usize, Vector3<f64>)>,
}

/// Matrices and mass properties of `stick` at `time_s`.
///
/// # Errors
/// [`Error::Time`] if a mass is not tabulated there, [`Error::NoInertia`] if nothing weighs.
pub fn weigh(stick: &Stick, time_s: f64) -> Result<Weighed, Error> {
    let n = FREEDOMS * stick.nodes.len();
    let (mut mass, mut stiffness) = (Mat::zeros(n, n), Mat::zeros(n, n));
    let mut sum = Sum::default();
    let mut grids: Vec<Grid> =
        (stick.nodes.iter()).map(|node| massless_grid(&node.name, node.position_m)).collect();
    let mut links: Vec<_> = (0..stick.nodes.len()).map(|i| (i, Vector3::zeros())).collect();

    for element in &stick.elements {
        let h = element.stations_m[1] - element.stations_m[0];
        let mut local = Local::zeros();
        for (s, w) in beam::gauss() {
            let section = element.sections[0].toward(&element.sections[1], s);
            let (e, g) = (element.youngs_modulus_pa, element.shear_modulus_pa);
            local += beam::stiffness_at(s, h, &section, e, g) * (w * h);
        }
        add_local(&mut stiffness, &local, element.nodes, &element.axes);
    }
    for line in &stick.line_masses {
        let at_time = line
            .mass_kg
            .at(time_s)
            .ok_or_else(|| Error::Time { time_s, what: line.name.clone() })?;
        let kept = at_time - if stick.slosh_in_body { 0.0 } else { line.slosh_kg };
        let [from, to] = line.stations_m;
        // A settled liquid stands against the end of its range with its surface upstream.
        let from = line.full_kg.map_or(from, |full| to - (to - from) * at_time / full);
        if !(to > from) {
            continue;
        }
        let per_length = kept / (to - from);
        for element in &stick.elements[line.elements.clone()] {
            let [start, end] = element.stations_m;
            let (a, b) = (start.max(from), end.min(to));
            if !(b > a) {
                continue;
            }
            let h = end - start;
            let axis: Vector3<f64> = element.axes.row(0).transpose();
            let along = axis.component_mul(&axis);
            let across = Vector3::repeat(1.0) - along;
            let mut local = Local::zeros();
            for (g, w) in beam::gauss() {
                let s = (a + g * (b - a) - start) / h;
                let section = element.sections[0].toward(&element.sections[1], s);
                let gyration_m2 = line.gyration_m.map_or(
                    (section.inertia_y_m4 + section.inertia_z_m4) / section.area_m2,
                    |radius| radius * radius,
                );
                let density = Density {
                    axial_kg_m: if line.axial { per_length } else { 0.0 },
                    lateral_kg_m: per_length,
                    torsion_kg_m: if line.torsion { per_length * gyration_m2 } else { 0.0 },
                };
                let length = w * (b - a);
                local += beam::mass_at(s, h, &density) * length;
                let [p, q] = element.nodes.map(|node| stick.nodes[node].position_m);
                let turning = Matrix3::from_diagonal(&along) * density.torsion_kg_m * length;
                sum.add(per_length * length, p + (q - p) * s, &turning);
                for (node, share) in element.nodes.into_iter().zip([1.0 - s, s]) {
                    grids[node].mass_kg += (along * density.axial_kg_m
                        + across * density.lateral_kg_m)
                        * (share * length);
                    grids[node].inertia_kg_m2 += along * (density.torsion_kg_m * share * length);
                }
            }
            add_local(&mut mass, &local, element.nodes, &element.axes);
        }
    }
    for point in &stick.point_masses {
        let m = point
            .mass_kg
            .at(time_s)
            .ok_or_else(|| Error::Time { time_s, what: point.name.clone() })?;
        let arm = point.position_m - stick.nodes[point.node].position_m;
        let inertia = Matrix3::from_diagonal(&point.inertia_kg_m2);
        let link = rigid_link(arm);
        let mut own = Matrix6::zeros();
        own.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(m);
        own.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
        let block = link.transpose() * own * link;
        add_block(&mut mass, point.node, point.node, &block);
        sum.add(m, point.position_m, &inertia);
        grids.push(Grid {
            mass_kg: Vector3::repeat(m),
            inertia_kg_m2: point.inertia_kg_m2,
            ..massless_grid(&point.name, point.position_m)
        });
        links.push((point.node, arm));
    }
    for spring in &stick.springs {
        let mut own = Matrix6::zeros();
        own.fixed_view_mut::<3, 3>(0, 0).set_diagonal(&spring.translation_n_m);
        own.fixed_view_mut::<3, 3>(3, 3).set_diagonal(&spring.rotation_n_m_rad);
        let link = spring.nodes.map(|i| rigid_link(spring.position_m - stick.nodes[i].position_m));
        for (i, j, sign) in [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)] {
            let block = link[i].transpose() * own * link[j] * sign;
            add_block(&mut stiffness, spring.nodes[i], spring.nodes[j], &block);
        }
    }
    for point in &stick.points {
        grids.push(massless_grid(&point.name, point.position_m));
        links.push((point.node, point.position_m - stick.nodes[point.node].position_m));
    }
    let positions_m = stick.nodes.iter().map(|node| node.position_m).collect();
    let body = sum.properties().ok_or(Error::NoInertia { time_s })?;
    Ok(Weighed { mass, stiffness, positions_m, body, grids, links })
}

/// Motion of a point carried by a node, `arm` away: `u + θ × arm`, θ.
pub fn rigid_link(arm: Vector3<f64>) -> Matrix6<f64> {
    let mut link = Matrix6::identity();
    link.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
    link
}

fn massless_grid(name: &str, position_m: Vector3<f64>) -> Grid {
    Grid {
        name: name.to_owned(),
        position_m,
        mass_kg: Vector3::zeros(),
        inertia_kg_m2: Vector3::zeros(),
    }
}

fn add_local(matrix: &mut Mat<f64>, local: &Local, nodes: [usize; 2], axes: &Matrix3<f64>) {
    let mut turn = Matrix6::zeros();
    turn.fixed_view_mut::<3, 3>(0, 0).copy_from(axes);
    turn.fixed_view_mut::<3, 3>(3, 3).copy_from(axes);
    for i in 0..2 {
        for j in 0..2 {
            let block = turn.transpose() * local.fixed_view::<6, 6>(6 * i, 6 * j) * turn;
            add_block(matrix, nodes[i], nodes[j], &block);
        }
    }
}

fn add_block(matrix: &mut Mat<f64>, row: usize, column: usize, block: &Matrix6<f64>) {
    for i in 0..FREEDOMS {
        for j in 0..FREEDOMS {
            matrix[(FREEDOMS * row + i, FREEDOMS * column + j)].add_assign(block[(i, j)]);
        }
    }
}

/// Running mass, first and second moments about the origin.
#[derive(Default)]
struct Sum {
    mass_kg: f64,
    first_kg_m: Vector3<f64>,
    second_kg_m2: Matrix3<f64>,
}

impl Sum {
    fn add(&mut self, mass_kg: f64, at_m: Vector3<f64>, own_kg_m2: &Matrix3<f64>) {
        self.mass_kg += mass_kg;
        self.first_kg_m += at_m * mass_kg;
        self.second_kg_m2 += own_kg_m2 + steiner(at_m) * mass_kg;
    }

    fn properties(&self) -> Option<MassProperties> {
        let cg_m = self.first_kg_m / self.mass_kg;
        (self.mass_kg > 0.0).then(|| MassProperties {
            mass_kg: self.mass_kg,
            cg_m,
            inertia_kg_m2: self.second_kg_m2 - steiner(cg_m) * self.mass_kg,
        })
    }
}

/// Inertia of a unit mass at `r`: `r² 1 − r rᵀ`.
fn steiner(r: Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose()
}
