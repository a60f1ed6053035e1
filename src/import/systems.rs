//! Coordinate systems of a model: rectangular, cylindrical, spherical, nested, brought to basic.
//!
//! Lengths stay in the units of the file; the vehicle's frame is laid in `model`.

use crate::fem::{Node, Point, Results, System, SystemKind};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// A direction shorter than this share of the distances it was made from is no direction: the
/// points that define a system are typed with about eight digits.
const FLAT: f64 = 1e-7;

/// A coordinate system in basic: its origin and its axes as columns.
#[derive(Debug, Clone, Copy)]
struct Placed {
    kind: SystemKind,
    origin: Vector3<f64>,
    axes: Matrix3<f64>,
}

const BASIC: Placed = Placed {
    kind: SystemKind::Rectangular,
    origin: Vector3::new(0.0, 0.0, 0.0),
    axes: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
};

/// The coordinate systems of a model in basic, each resolved when first asked for.
#[derive(Debug)]
pub struct Systems<'a> {
    systems: &'a BTreeMap<i64, System>,
    nodes: &'a [Node],
    /// Resolved systems; `None` while one is being resolved, and for one that cannot be.
    placed: BTreeMap<i64, Option<Placed>>,
    /// What is wrong with systems, each said once.
    faults: Vec<String>,
}

impl<'a> Systems<'a> {
    /// The systems of `results`, none of them resolved yet.
    pub fn new(results: &'a Results) -> Self {
        let (systems, nodes) = (&results.systems, results.nodes.as_slice());
        Self { systems, nodes, placed: BTreeMap::new(), faults: Vec::new() }
    }

    /// What was wrong with the systems asked for so far.
    pub fn into_faults(self) -> Vec<String> {
        self.faults
    }

    /// Position of a node in basic, file units; `None` if its system cannot be resolved.
    pub fn position(&mut self, node: &Node) -> Option<Vector3<f64>> {
        let by = || format!("the position of node {}", node.id);
        let system = self.system(node.position_system, &by)?;
        Some(system.origin + system.axes * cartesian(system.kind, node.position.into()))
    }

    /// Axes along which displacements of `node`, at `position` in basic, are given, as columns.
    pub fn axes(&mut self, node: &Node, position: &Vector3<f64>) -> Option<Matrix3<f64>> {
        let by = || format!("the displacement of node {}", node.id);
        let system = self.system(node.displacement_system, &by)?;
        let local = system.axes.transpose() * (position - system.origin);
        Some(system.axes * local_axes(system.kind, &local))
    }

    fn system(&mut self, id: i64, by: &dyn Fn() -> String) -> Option<Placed> {
        if id == 0 {
            return Some(BASIC);
        }
        if let Some(known) = self.placed.get(&id) {
            return *known;
        }
        self.placed.insert(id, None);
        let Some(system) = self.systems.get(&id) else {
            self.faults.push(format!("no coordinate system {id}, to which {} refers", by()));
            return None;
        };
        let known = self.faults.len();
        let placed = self.place(system);
        if placed.is_none() && self.faults.len() == known {
            self.faults.push(format!(
                "a coordinate system {id} that refers to itself, or whose three points lie on a line"
            ));
        }
        self.placed.insert(id, placed);
        placed
    }

    fn place(&mut self, system: &System) -> Option<Placed> {
        let [a, b, c] = [system.a, system.b, system.c].map(|point| self.point(system.id, point));
        let (a, b, c) = (a?, b?, c?);
        let z = (b - a).try_normalize(0.0)?;
        let toward = c - a;
        let across = toward - z * z.dot(&toward);
        if !(across.norm() > FLAT * toward.norm()) {
            return None;
        }
        let x = across.normalize();
        Some(Placed {
            kind: system.kind,
            origin: a,
            axes: Matrix3::from_columns(&[x, z.cross(&x), z]),
        })
    }

    fn point(&mut self, id: i64, point: Point) -> Option<Vector3<f64>> {
        match point {
            Point::Given { reference, position } => {
                let by = || format!("coordinate system {id}");
                let system = self.system(reference, &by)?;
                Some(system.origin + system.axes * cartesian(system.kind, position.into()))
            }
            Point::Node(node) => {
                let Ok(at) = self.nodes.binary_search_by_key(&node, |n| n.id) else {
                    self.faults.push(format!(
                        "no node {node}, which is a point of coordinate system {id}"
                    ));
                    return None;
                };
                self.position(&self.nodes[at])
            }
        }
    }
}

/// Rectangular coordinates, in the system's own axes, of what is given in a system of this kind.
fn cartesian(kind: SystemKind, p: Vector3<f64>) -> Vector3<f64> {
    match kind {
        SystemKind::Rectangular => p,
        SystemKind::Cylindrical => {
            let (sin, cos) = p.y.to_radians().sin_cos();
            Vector3::new(p.x * cos, p.x * sin, p.z)
        }
        SystemKind::Spherical => {
            let (sin, cos) = p.y.to_radians().sin_cos();
            let (sin_phi, cos_phi) = p.z.to_radians().sin_cos();
            Vector3::new(p.x * sin * cos_phi, p.x * sin * sin_phi, p.x * cos)
        }
    }
}

/// Axes at the point `p` (rectangular, own axes) as columns: x y z, r θ z or r θ φ. On the polar
/// axis, where r has no direction of its own, it is taken along x.
fn local_axes(kind: SystemKind, p: &Vector3<f64>) -> Matrix3<f64> {
    let radius = p.x.hypot(p.y);
    let on_axis = !(radius > FLAT * p.z.abs()) || radius == 0.0;
    let (sin_phi, cos_phi) = if on_axis { (0.0, 1.0) } else { (p.y / radius, p.x / radius) };
    let outward = Vector3::new(cos_phi, sin_phi, 0.0);
    let around = Vector3::new(-sin_phi, cos_phi, 0.0);
    match kind {
        SystemKind::Rectangular => Matrix3::identity(),
        SystemKind::Cylindrical => Matrix3::from_columns(&[outward, around, Vector3::z()]),
        SystemKind::Spherical => {
            let theta = radius.atan2(p.z);
            let r = outward * theta.sin() + Vector3::z() * theta.cos();
            let down = outward * theta.cos() - Vector3::z() * theta.sin();
            Matrix3::from_columns(&[r, down, around])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Precision;

    fn given(reference: i64, position: [f64; 3]) -> Point {
        Point::Given { reference, position }
    }

    fn system(id: i64, kind: SystemKind, reference: i64, points: [[f64; 3]; 3]) -> System {
        let [a, b, c] = points.map(|p| given(reference, p));
        System { id, kind, a, b, c }
    }

    fn results(systems: Vec<System>, nodes: Vec<Node>) -> Results {
        let mut results = Results::empty("trial", Precision::Double);
        results.systems = systems.into_iter().map(|s| (s.id, s)).collect();
        results.nodes = nodes;
        results
    }

    fn node(id: i64, position_system: i64, position: [f64; 3], displacement_system: i64) -> Node {
        Node { id, position, position_system, displacement_system }
    }

    #[test]
    fn cylindrical_in_rectangular_in_spherical_is_what_geometry_says() {
        use SystemKind::{Cylindrical, Rectangular, Spherical};
        // 1: spherical at (1, 0, 0) of basic, axes as basic.
        // 2: rectangular at r 2, θ 90°, φ 90° of it, that is (1, 2, 0); z towards basic +x.
        // 3: cylindrical at (0, 0, 1) of 2, that is (2, 2, 0); z along z of 2, x as x of 2.
        let systems = vec![
            system(1, Spherical, 0, [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [2.0, 0.0, 0.0]]),
            System {
                id: 2,
                kind: Rectangular,
                a: given(1, [2.0, 90.0, 90.0]),
                b: given(0, [2.0, 2.0, 0.0]),
                c: given(0, [1.0, 3.0, 0.0]),
            },
            system(3, Cylindrical, 2, [[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [1.0, 0.0, 1.0]]),
        ];
        // x of 2 is basic y, z is basic x, so y = z × x = x̂ × ŷ is basic z.
        let r = results(systems, vec![node(7, 3, [5.0, 90.0, 3.0], 3)]);
        let mut systems = Systems::new(&r);
        let position = systems.position(&r.nodes[0]).unwrap();
        // 5 along y of 2 (basic z), 3 along z of 2 (basic x), from (2, 2, 0).
        assert!((position - Vector3::new(5.0, 2.0, 5.0)).norm() < 1e-14, "{position}");
        let axes = systems.axes(&r.nodes[0], &position).unwrap();
        let expected = Matrix3::from_columns(&[Vector3::z(), -Vector3::y(), Vector3::x()]);
        assert!((axes - expected).norm() < 1e-14, "{axes}");
        assert!(systems.into_faults().is_empty());
    }

    #[test]
    fn axes_are_the_normalised_derivatives_of_positions() {
        let points = [[0.3, -0.2, 0.1], [0.4, 0.6, 2.0], [1.0, 0.7, -0.3]];
        for kind in [SystemKind::Cylindrical, SystemKind::Spherical] {
            let at = [1.7, 37.0, 49.0];
            let r = results(vec![system(1, kind, 0, points)], vec![node(1, 1, at, 1)]);
            let mut systems = Systems::new(&r);
            let position = systems.position(&r.nodes[0]).unwrap();
            let axes = systems.axes(&r.nodes[0], &position).unwrap();
            for axis in 0..3 {
                let step = 1e-3;
                let [plus, minus] = [step, -step].map(|h| {
                    let mut moved = at;
                    moved[axis] += h;
                    systems.position(&node(1, 1, moved, 1)).unwrap()
                });
                let along = (plus - minus).normalize();
                // A thousandth of a degree squared is 3e-10; round-off over it is less.
                assert!((axes.column(axis) - along).norm() < 1e-8, "{kind:?} {axis}");
            }
        }
    }

    #[test]
    fn on_the_polar_axis_r_is_along_x() {
        let points = [[0.0; 3], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        let r = results(
            vec![system(1, SystemKind::Cylindrical, 0, points)],
            vec![node(1, 0, [0.0, 0.0, 4.0], 1)],
        );
        let axes = Systems::new(&r).axes(&r.nodes[0], &Vector3::new(0.0, 0.0, 4.0)).unwrap();
        assert!((axes.column(0) - Vector3::y()).norm() < 1e-15);
    }

    #[test]
    fn a_system_by_nodes_is_that_by_their_positions() {
        let nodes = vec![
            node(4, 0, [1.0, 1.0, 1.0], 0),
            node(5, 0, [1.0, 1.0, 3.0], 0),
            node(6, 0, [1.0, 4.0, 1.0], 0),
            node(9, 2, [1.0, 2.0, 3.0], 2),
        ];
        let [a, b, c] = [4, 5, 6].map(Point::Node);
        let r = results(vec![System { id: 2, kind: SystemKind::Rectangular, a, b, c }], nodes);
        let position = Systems::new(&r).position(&r.nodes[3]).unwrap();
        assert!((position - Vector3::new(-1.0, 2.0, 4.0)).norm() < 1e-14);
    }

    #[test]
    fn missing_circular_and_flat_systems_are_each_said_once() {
        use SystemKind::Rectangular;
        let plain = [[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        let systems = vec![
            system(1, Rectangular, 2, plain),
            system(2, Rectangular, 1, plain),
            system(3, Rectangular, 0, [[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 5.0]]),
            System {
                id: 4,
                kind: Rectangular,
                a: Point::Node(77),
                b: Point::Node(77),
                c: Point::Node(77),
            },
        ];
        let nodes = [1, 3, 4, 5, 5, 1].map(|s| node(8, s, [0.0; 3], 0)).to_vec();
        let r = results(systems, nodes);
        let mut systems = Systems::new(&r);
        assert!(r.nodes.iter().all(|n| systems.position(n).is_none()));
        let faults = systems.into_faults();
        assert_eq!(faults.len(), 6, "{faults:#?}");
        assert!(faults.iter().any(|f| f.contains("no coordinate system 5, to which the position")));
        assert!(faults.iter().any(|f| f.contains("no node 77")));
        assert!(faults.iter().any(|f| f.contains("3 that refers to itself, or whose")));
    }
}
