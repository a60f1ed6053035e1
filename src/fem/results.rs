//! What a finite element program wrote: grids, coordinate systems and real eigenvectors, in the
//! file's own units and frames.
//!
//! Not what they mean: nothing here is converted, normalised or chosen.

use std::collections::BTreeMap;

use crate::problem::Problems;

/// Problems of one kind told before the rest is left out: a damaged file can have millions.
const MOST_PROBLEMS: usize = 20;

/// The content of one result file, or of several that complete each other ([`Results::merge`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// Program and format as far as the file tells, for instance `Nastran OP2`.
    pub program: String,
    /// How exactly the eigenvectors are stored.
    pub precision: Precision,
    /// Units the file declares, in its own words; nothing is converted.
    pub units: Option<String>,
    /// The eigenvectors are along the basic axes whatever the displacement systems of the nodes:
    /// [`Results::finish`] and [`Results::merge`] then set those to 0.
    pub basic_shapes: bool,
    /// Coordinate systems by id; the basic system 0 is not among them.
    pub systems: BTreeMap<i64, System>,
    /// Grids in ascending id.
    pub nodes: Vec<Node>,
    /// Modes in ascending number.
    pub modes: Vec<RawMode>,
    /// Named sets of node ids, ascending; a label of a single node is a set of one.
    pub sets: BTreeMap<String, Vec<i64>>,
    /// Lumped masses in ascending node id, where the file holds the whole mass of the model.
    pub mass: Option<Vec<(i64, NodeMass)>>,
    /// What the user should know about this file, one sentence each.
    pub warnings: Vec<String>,
}

/// Precision of the stored eigenvectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit floating point, 24 bits of mantissa.
    Single,
    /// 64-bit floating point, 53 bits of mantissa.
    Double,
    /// Decimal text.
    Text {
        /// Significant decimal digits.
        digits: u8,
    },
}

/// What the three numbers of a position, or the three axes at a point, are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SystemKind {
    /// x, y, z.
    Rectangular,
    /// r, θ in degrees, z.
    Cylindrical,
    /// r, θ in degrees from the z axis, φ in degrees from the x-z plane.
    Spherical,
}

/// A coordinate system defined by three points, as in Nastran's `CORD1x` and `CORD2x` cards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct System {
    /// Its id, above 0.
    pub id: i64,
    /// Rectangular, cylindrical or spherical.
    pub kind: SystemKind,
    /// The origin.
    pub a: Point,
    /// A point on the positive z axis.
    pub b: Point,
    /// A point in the half plane of z and positive x.
    pub c: Point,
}

/// A point that defines a coordinate system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Point {
    /// The position of a node (`CORD1x`), which has a coordinate system of its own.
    Node(i64),
    /// A position in the coordinates of a reference system (`CORD2x`), angles in degrees.
    Given {
        /// Id of the reference system; 0 is the basic one.
        reference: i64,
        /// Position in its coordinates.
        position: [f64; 3],
    },
}

/// One grid point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Its id.
    pub id: i64,
    /// Position in the coordinates of `position_system`, angles in degrees.
    pub position: [f64; 3],
    /// System of the position; 0 is the basic one.
    pub position_system: i64,
    /// System whose axes at this point carry displacements and rotations; 0 is the basic one.
    pub displacement_system: i64,
}

/// One real eigenvector.
#[derive(Debug, Clone, PartialEq)]
pub struct RawMode {
    /// Number in the file, from 1.
    pub number: i64,
    /// Natural frequency, Hz, as the file gives it or from its eigenvalue; negative for a negative
    /// eigenvalue.
    pub frequency_hz: f64,
    /// Generalised mass for the stored shape, where the file gives it.
    pub generalised_mass: Option<f64>,
    /// Shape in ascending node id.
    pub shape: Vec<NodeShape>,
}

/// Eigenvector at one node, along the axes of its displacement system there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeShape {
    /// Id of the node.
    pub node: i64,
    /// Translations.
    pub translation: [f64; 3],
    /// Rotations, where the file has them: programs write zeros for nodes without rotations.
    pub rotation: Option<[f64; 3]>,
}

/// Mass lumped at one node, in the units of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeMass {
    /// Mass.
    pub mass: f64,
    /// Moments of inertia about the node along its displacement axes, xx, yy, zz.
    pub inertia: [f64; 3],
}

impl Results {
    /// Nothing yet, by a named program.
    pub fn empty(program: impl Into<String>, precision: Precision) -> Self {
        Self {
            program: program.into(),
            precision,
            units: None,
            basic_shapes: false,
            systems: BTreeMap::new(),
            nodes: Vec::new(),
            modes: Vec::new(),
            sets: BTreeMap::new(),
            mass: None,
            warnings: Vec::new(),
        }
    }

    /// Puts nodes, modes and shapes in ascending order, as every reader does in the end.
    ///
    /// # Errors
    /// Numbers that are not finite; a node, mode or shape given twice; a mode without a shape.
    pub fn finish(mut self, name: &str) -> Result<Self, Problems> {
        let mut problems = Problems::default();
        let damage = |problems: &mut Problems, key: String, found: String, allowed: &str| {
            if problems.0.len() < MOST_PROBLEMS {
                problems.extend(Problems::damage(name, key, found, allowed));
            }
        };
        self.nodes.sort_by_key(|node| node.id);
        self.nodes.dedup_by(|b, a| a.id == b.id && same_node(a, b));
        for pair in self.nodes.windows(2).filter(|pair| pair[0].id == pair[1].id) {
            let found = format!("{:?} and {:?}", pair[0], pair[1]);
            damage(&mut problems, format!("node {}", pair[0].id), found, "one definition");
        }
        for node in self.nodes.iter().filter(|n| !n.position.iter().all(|x| x.is_finite())) {
            let found = format!("position {:?}", node.position);
            damage(&mut problems, format!("node {}", node.id), found, "finite numbers");
        }
        for system in self.systems.values() {
            let finite = [system.a, system.b, system.c].iter().all(|point| match point {
                Point::Node(_) => true,
                Point::Given { position, .. } => position.iter().all(|x| x.is_finite()),
            });
            if !finite || system.id <= 0 {
                let key = format!("coordinate system {}", system.id);
                damage(&mut problems, key, format!("{system:?}"), "finite numbers, id above 0");
            }
        }
        self.modes.sort_by_key(|mode| mode.number);
        for pair in self.modes.windows(2).filter(|pair| pair[0].number == pair[1].number) {
            let found = "two eigenvectors, of several subcases or runs".into();
            damage(&mut problems, format!("mode {}", pair[0].number), found, "one of each number");
        }
        for mode in &mut self.modes {
            let key = |node| format!("mode {}: node {node}", mode.number);
            mode.shape.sort_by_key(|shape| shape.node);
            for pair in mode.shape.windows(2).filter(|pair| pair[0].node == pair[1].node) {
                damage(&mut problems, key(pair[0].node), "two values".into(), "one value");
            }
            for shape in &mode.shape {
                let mut all = shape.translation.iter().chain(shape.rotation.iter().flatten());
                if !all.all(|x| x.is_finite()) {
                    damage(&mut problems, key(shape.node), format!("{shape:?}"), "finite numbers");
                }
            }
            if !mode.frequency_hz.is_finite() || mode.shape.is_empty() {
                let found = format!("{} Hz, {} nodes", mode.frequency_hz, mode.shape.len());
                let key = format!("mode {}", mode.number);
                damage(&mut problems, key, found, "a finite frequency and a shape");
            }
        }
        for members in self.sets.values_mut() {
            members.sort_unstable();
            members.dedup();
        }
        if let Some(mass) = &mut self.mass {
            mass.sort_by_key(|(node, _)| *node);
        }
        self.forget_displacement_systems();
        problems.into_result(self)
    }

    fn forget_displacement_systems(&mut self) {
        if self.basic_shapes {
            for node in &mut self.nodes {
                node.displacement_system = 0;
            }
        }
    }

    /// Checks that the parts together describe modes: eigenvectors, the grids they belong to and
    /// every coordinate system that is named.
    ///
    /// # Errors
    /// No eigenvectors, no grids, eigenvectors at none of the grids, and systems or nodes that are
    /// named but not there.
    pub fn complete(&self, name: &str) -> Result<(), Problems> {
        let mut problems = Problems::default();
        let mut input = |key: &str, found: &str, allowed: &str| {
            problems.extend(Problems::input(name, key, found, allowed));
        };
        let is_node = |id: i64| self.nodes.binary_search_by_key(&id, |node| node.id).is_ok();
        if self.modes.is_empty() {
            input(
                "modes",
                "grids without results",
                "real eigenvectors of a normal modes solution, from this or another file",
            );
        }
        if self.nodes.is_empty() {
            input(
                "nodes",
                "eigenvectors without grids",
                "grids, from this or another file (for a punch file its bulk data deck)",
            );
        } else if !self.modes.is_empty() {
            let none = |mode: &RawMode| !mode.shape.iter().any(|shape| is_node(shape.node));
            if self.modes.iter().all(none) {
                input("modes", "eigenvectors at none of the grids", "files of one model");
            }
        }
        let missing = |id: i64| id != 0 && !self.systems.contains_key(&id);
        let mut named: BTreeMap<i64, String> = BTreeMap::new();
        for node in &self.nodes {
            for id in [node.position_system, node.displacement_system] {
                if missing(id) {
                    named.entry(id).or_insert_with(|| format!("node {}", node.id));
                }
            }
        }
        for system in self.systems.values() {
            for point in [system.a, system.b, system.c] {
                match point {
                    Point::Given { reference, .. } if missing(reference) => {
                        let by = || format!("coordinate system {}", system.id);
                        named.entry(reference).or_insert_with(by);
                    }
                    Point::Node(id) if !self.nodes.is_empty() && !is_node(id) => input(
                        &format!("coordinate system {}", system.id),
                        &format!("node {id}, which is not there"),
                        "nodes of the model",
                    ),
                    _ => {}
                }
            }
        }
        for (id, by) in named.iter().take(MOST_PROBLEMS) {
            input(
                &format!("coordinate system {id}"),
                &format!("no definition, but {by} names it"),
                "a definition in one of the files (give the deck, and the files it includes)",
            );
        }
        problems.into_result(())
    }

    /// Completes these results by another part, for instance a punch file by its deck.
    ///
    /// Modes, masses and each named set come from one part; a node or system in both must agree to
    /// single precision, the more exact one is kept. `name` is the file of `other`.
    ///
    /// # Errors
    /// Every contradiction between the parts.
    pub fn merge(&mut self, other: Self, name: &str) -> Result<(), Problems> {
        let mut problems = Problems::default();
        let exact = other.precision != Precision::Single;
        if !self.modes.is_empty() && !other.modes.is_empty() {
            problems.extend(Problems::input(
                name,
                "modes",
                "modes, which another of the files holds too",
                "one file with modes",
            ));
        }
        if self.mass.is_some() && other.mass.is_some() {
            problems.extend(Problems::input(
                name,
                "mass",
                "masses, which another of the files holds too",
                "one file with masses",
            ));
        }
        let mut nodes: BTreeMap<i64, Node> = self.nodes.iter().map(|n| (n.id, *n)).collect();
        for node in other.nodes {
            match nodes.get_mut(&node.id) {
                None => {
                    nodes.insert(node.id, node);
                }
                Some(known) if !same_node(known, &node) => problems.extend(Problems::input(
                    name,
                    format!("node {}", node.id),
                    format!("{node:?}"),
                    format!("what another of the files says, {known:?}"),
                )),
                Some(known) if exact => *known = node,
                Some(_) => {}
            }
        }
        for (id, system) in other.systems {
            match self.systems.get_mut(&id) {
                None => {
                    self.systems.insert(id, system);
                }
                Some(known) if !same_system(known, &system) => problems.extend(Problems::input(
                    name,
                    format!("coordinate system {id}"),
                    format!("{system:?}"),
                    format!("what another of the files says, {known:?}"),
                )),
                Some(known) if exact => *known = system,
                Some(_) => {}
            }
        }
        for (set, members) in other.sets {
            if self.sets.get(&set).is_some_and(|known| *known != members) {
                problems.extend(Problems::input(
                    name,
                    format!("set {set}"),
                    "other members than in another of the files",
                    "the same members",
                ));
            }
            self.sets.insert(set, members);
        }
        problems.into_result(())?;
        self.nodes = nodes.into_values().collect();
        self.units = self.units.take().or(other.units);
        if !other.modes.is_empty() {
            self.basic_shapes = other.basic_shapes;
            self.precision = other.precision;
            self.program = other.program;
            self.modes = other.modes;
        }
        self.forget_displacement_systems();
        self.mass = self.mass.take().or(other.mass);
        for warning in other.warnings {
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
        Ok(())
    }
}

/// Equal to the rounding of single precision: each of the two may be rounded by half a unit.
fn same(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= f64::from(f32::EPSILON) * a.abs().max(b.abs()))
}

fn same_node(a: &Node, b: &Node) -> bool {
    a.position_system == b.position_system
        && a.displacement_system == b.displacement_system
        && same(a.position, b.position)
}

fn same_system(a: &System, b: &System) -> bool {
    let point = |a: &Point, b: &Point| match (a, b) {
        (
            Point::Given { reference: ra, position: pa },
            Point::Given { reference: rb, position: pb },
        ) => ra == rb && same(*pa, *pb),
        _ => a == b,
    };
    a.kind == b.kind && point(&a.a, &b.a) && point(&a.b, &b.b) && point(&a.c, &b.c)
}
