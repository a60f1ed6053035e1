//! One physical body, a free-free tube whose sections stay plane, written as programs write it: in
//! several unit systems, frames, coordinate systems and normalisations.

use super::super::table;
use super::*;
use crate::fem::{Node, NodeMass, NodeShape, Point, Precision, RawMode, System, SystemKind};
use crate::import::UnitSystem;
use std::collections::BTreeMap;

const LENGTH_M: f64 = 20.0;
/// Slender enough that rotary inertia adds less than 2 % to the generalised mass of the third pair.
const RADIUS_M: f64 = 0.3;
const MASS_KG: f64 = 6000.0;
const STATIONS: i64 = 21;
const RING: i64 = 8;
/// A node on the axis at the aft end, with rotations.
const GIMBAL: i64 = 5000;
/// A node outside, with rotations that are zero.
const BLOCK: i64 = 5001;
/// A node without results.
const BARE: i64 = 5002;

/// Displacement and slope of a free-free beam of unit length and mean square, φ(0) = 2.
fn beam(mode: usize, x: f64) -> (f64, f64) {
    let b: f64 = [4.730_040_744_862_7, 7.853_204_624_095_8, 10.995_607_838_002][mode];
    let sigma = (b.cosh() - b.cos()) / (b.sinh() - b.sin());
    let phi = (b * x).cosh() + (b * x).cos() - sigma * ((b * x).sinh() + (b * x).sin());
    let slope = b * ((b * x).sinh() - (b * x).sin() - sigma * ((b * x).cosh() + (b * x).cos()));
    (phi, slope)
}

fn body() -> MassProperties {
    let across = MASS_KG * (LENGTH_M * LENGTH_M / 12.0 + RADIUS_M * RADIUS_M / 2.0);
    MassProperties {
        mass_kg: MASS_KG,
        cg_m: Vector3::x() * (LENGTH_M / 2.0),
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(
            MASS_KG * RADIUS_M * RADIUS_M,
            across,
            across,
        )),
    }
}

/// Nodes in the vehicle's frame, m.
fn nodes() -> Vec<(i64, Vector3<f64>)> {
    let mut nodes = Vec::new();
    for s in 0..STATIONS {
        for k in 0..RING {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / RING as f64).sin_cos();
            let x = LENGTH_M * s as f64 / (STATIONS - 1) as f64;
            nodes.push((100 * s + k + 1, Vector3::new(x, RADIUS_M * cos, RADIUS_M * sin)));
        }
    }
    nodes.push((GIMBAL, Vector3::x() * LENGTH_M));
    nodes.push((BLOCK, Vector3::new(3.0, 2.0, 0.5)));
    nodes
}

/// Translation and rotation at a point.
type Motion = dyn Fn(&Vector3<f64>) -> (Vector3<f64>, Vector3<f64>);

/// A mode of the body: frequency, translation and rotation at a point, unit generalised mass.
struct Physical {
    frequency_hz: f64,
    motion: Box<Motion>,
}

/// Six mixed rigid motions, then three pairs of bending modes, each pair turned by some angle.
fn physical() -> Vec<Physical> {
    let body = body();
    let mut modes = Vec::new();
    // Columns of an orthogonal matrix mix the six motions: a Householder reflection.
    let v = nalgebra::Vector6::new(0.3, -0.5, 0.2, 0.7, -0.1, 0.4).normalize();
    let mix = nalgebra::Matrix6::identity() - v * v.transpose() * 2.0;
    for j in 0..6 {
        let column = mix.column(j).into_owned();
        let motion = move |p: &Vector3<f64>| {
            let shift = column.fixed_rows::<3>(0) / body.mass_kg.sqrt();
            let turn = Vector3::from_fn(|k, _| column[3 + k] / body.inertia_kg_m2[(k, k)].sqrt());
            (shift + turn.cross(&(p - body.cg_m)), turn)
        };
        modes.push(Physical { frequency_hz: 1e-5 * (j + 1) as f64, motion: Box::new(motion) });
    }
    for mode in 0..3 {
        for quarter in 0..2 {
            let angle: f64 = 0.4 + mode as f64 + std::f64::consts::FRAC_PI_2 * quarter as f64;
            let direction = Vector3::new(0.0, angle.cos(), angle.sin());
            let motion = move |p: &Vector3<f64>| {
                let (phi, slope) = beam(mode, p.x / LENGTH_M);
                let (phi, slope) = (phi / MASS_KG.sqrt(), slope / LENGTH_M / MASS_KG.sqrt());
                let shape = direction * phi - Vector3::x() * (direction.dot(p) * slope);
                (shape, Vector3::x().cross(&direction) * slope)
            };
            let b: f64 = [4.730_040_744_862_7, 7.853_204_624_095_8, 10.995_607_838_002][mode];
            modes.push(Physical { frequency_hz: 0.5 * b * b, motion: Box::new(motion) });
        }
    }
    modes
}

/// How a program writes the body.
#[derive(Clone, Copy)]
struct Style {
    units: UnitSystem,
    /// The vehicle's origin in basic, m, and its axes as columns.
    origin_m: Vector3<f64>,
    axes: Matrix3<f64>,
    /// Ring nodes in a cylindrical system about the axis, defined in a skew rectangular one.
    cylindrical: bool,
    maximum: bool,
    precision: Precision,
}

const PLAIN: Style = Style {
    units: UnitSystem::Si,
    origin_m: Vector3::new(0.0, 0.0, 0.0),
    axes: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    cylindrical: false,
    maximum: false,
    precision: Precision::Double,
};

/// x forward and y up in basic, the nose 31 m ahead of the origin.
fn turned() -> Style {
    Style {
        units: UnitSystem::MmTS,
        origin_m: Vector3::new(31.0, -2.0, 0.7),
        // The vehicle's x is −x, y is +z, z = x × y = −x × z = +y of basic.
        axes: Matrix3::from_columns(&[-Vector3::x(), Vector3::z(), Vector3::y()]),
        cylindrical: true,
        maximum: true,
        ..PLAIN
    }
}

fn results(style: &Style) -> Results {
    let units = style.units.units(None).unwrap();
    let basic = |p: &Vector3<f64>| (style.origin_m + style.axes * p) / units.length_m;
    let mut results = Results::empty("trial", style.precision);
    // System 7 is skew; system 5 has its origin at the nose, its z aft and its x along the
    // vehicle's y, and is written in coordinates of 7.
    let (from, skew) = (
        Vector3::new(1.0, 2.0, 3.0) / units.length_m,
        *nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 1.9).matrix(),
    );
    let point = |reference, p: Vector3<f64>| Point::Given { reference, position: p.into() };
    let seven = [0.0 * Vector3::x(), Vector3::z(), Vector3::x()].map(|p| point(0, from + skew * p));
    let five = [Vector3::zeros(), Vector3::x(), Vector3::y()]
        .map(|p| point(7, skew.transpose() * (basic(&p) - from)));
    for (id, kind, [a, b, c]) in
        [(7, SystemKind::Rectangular, seven), (5, SystemKind::Cylindrical, five)]
    {
        results.systems.insert(id, System { id, kind, a, b, c });
    }
    let ring = |id: i64| style.cylindrical && id < GIMBAL;
    // Angle from the vehicle's y towards its z, in degrees.
    let angle = |p: &Vector3<f64>| p.z.atan2(p.y);
    for (id, p) in nodes() {
        let (position, system) = if ring(id) {
            let radius = p.y.hypot(p.z) / units.length_m;
            ([radius, angle(&p).to_degrees(), p.x / units.length_m], 5)
        } else {
            (basic(&p).into(), 0)
        };
        let node = Node { id, position, position_system: system, displacement_system: system };
        results.nodes.push(node);
    }
    results.nodes.push(Node {
        id: BARE,
        position: [0.0; 3],
        position_system: 0,
        displacement_system: 0,
    });
    // Displacement axes of a node, in those of the vehicle.
    let axes = |id: i64, p: &Vector3<f64>| {
        if ring(id) {
            let (sin, cos) = angle(p).sin_cos();
            Matrix3::from_columns(&[
                Vector3::new(0.0, cos, sin),
                Vector3::new(0.0, -sin, cos),
                Vector3::x(),
            ])
        } else {
            style.axes.transpose()
        }
    };
    for (j, mode) in physical().iter().enumerate() {
        let greatest = nodes()
            .iter()
            .map(|(id, p)| (axes(*id, p).transpose() * (mode.motion)(p).0).amax())
            .fold(0.0, f64::max);
        // Unit generalised mass in the file's unit, or a greatest component of 1.
        let scale = if style.maximum { 0.999 / greatest } else { units.mass_kg.sqrt() };
        let shape = nodes()
            .iter()
            .map(|(id, p)| {
                let (u, turn) = (mode.motion)(p);
                let axes = axes(*id, p);
                let local = |v: Vector3<f64>| axes.transpose() * v;
                // The ring nodes are those of solid elements.
                let turn = if *id == GIMBAL { turn } else { Vector3::zeros() };
                let round = |x: f64| match style.precision {
                    Precision::Single => f64::from(x as f32),
                    _ => x,
                };
                NodeShape {
                    node: *id,
                    translation: (local(u) * scale).map(round).into(),
                    rotation: Some((local(turn) * scale * units.length_m).map(round).into()),
                }
            })
            .collect();
        results.modes.push(RawMode {
            number: j as i64 + 1,
            frequency_hz: mode.frequency_hz,
            generalised_mass: Some(scale * scale / units.mass_kg),
            shape,
        });
    }
    results.sets.insert("GIMBAL".to_owned(), vec![GIMBAL]);
    results.sets.insert("AFT RING".to_owned(), (2001..=2008).collect());
    results
}

fn description(style: &Style) -> String {
    let units = style.units.units(None).unwrap();
    let origin = style.origin_m / units.length_m;
    let (aft, y) = (style.axes.column(0), style.axes.column(1));
    let list = |v: &[f64]| format!("{v:?}");
    format!(
        r#"
format = 1
source = "a tube"
units = "{}"
frame = {{ origin = {}, aft = {}, y = {} }}
body = {{ kind = "reduced" }}
modes = {{ normalisation = "{}" }}

[[flight_time]]
time_s = 80
results = ["any.op2"]
mass = {{ from = "rigid-body-modes" }}

[[grid]]
name = "gimbal"
role = "gimbal"
set = "GIMBAL"
section = {{ set = "AFT RING" }}

[[grid]]
name = "rock"
role = "actuator"
node = {BLOCK}

[[grid]]
name = "gyro"
role = "sensor"
nearest_m = [20.01, 0.0, 0.0]
within_m = 0.02

[[centreline]]
name = "case"
from_m = [0.0, 0.0, 0.0]
to_m = [20.0, 0.0, 0.0]
stations = 21
slice_m = 0.01
radius_m = [0.2, 0.4]
"#,
        style.units.word(),
        list(origin.as_slice()),
        list(aft.as_slice()),
        list(y.as_slice()),
        if style.maximum { "maximum" } else { "mass" },
    )
}

fn import(text: &str, read: Vec<Results>) -> Result<Made, Problems> {
    let (raw, findings) = table::read::<ImportFile>("import.toml", text)?;
    let mut read = read.into_iter();
    resolve(&raw, |_, _| Some(Read { results: read.next()?, matrix: None }), findings)
}

fn plain() -> Made {
    import(&description(&PLAIN), vec![results(&PLAIN)]).unwrap()
}

/// Problems with the first `from` of the plain description replaced by `to`.
fn refused(from: &str, to: &str, results: Results) -> String {
    let text = description(&PLAIN);
    assert!(text.contains(from), "{from}");
    import(&text.replacen(from, to, 1), vec![results]).expect_err("a problem").to_string()
}

#[test]
fn a_tube_becomes_its_beam_with_shapes_slopes_and_mass_properties() {
    let made = plain();
    let set = &made.modal.sets[0];
    assert_eq!((set.modes.len(), set.grids.len()), (6, 24));
    let exact = body();
    assert!((set.body.mass_kg / exact.mass_kg - 1.0).abs() < 1e-10);
    assert!((set.body.cg_m - exact.cg_m).norm() < 1e-9);
    let apart = (set.body.inertia_kg_m2 - exact.inertia_kg_m2).norm();
    assert!(apart < 1e-9 * exact.inertia_kg_m2.norm(), "{apart}");
    // Repeated modes come out as pure y, then pure z, whatever pair the file has.
    for (mode, axis) in [(0, 1), (1, 2), (2, 1), (3, 2), (4, 1), (5, 2)] {
        let found = &set.modes[mode];
        let at = |grid: &str| {
            let place = set.grid(grid).unwrap();
            (found.shape[place], found.slope[place], set.grids[place].position_m)
        };
        let sign = at("case.01").0[axis].signum();
        let names =
            (1..=21).map(|i| format!("case.{i:02}")).chain(["gimbal".into(), "gyro".into()]);
        for name in names {
            let (shape, slope, p) = at(&name);
            let (phi, psi) = beam(mode / 2, p.x / LENGTH_M);
            let direction = Vector3::ith(axis, sign);
            let shape_error = shape * MASS_KG.sqrt() - direction * phi;
            let slope_error =
                slope * MASS_KG.sqrt() * LENGTH_M - Vector3::x().cross(&direction) * psi;
            assert!(shape_error.norm() < 1e-10, "{name} {mode}: {shape_error}");
            assert!(slope_error.norm() < 1e-9, "{name} {mode}: {slope_error}");
        }
    }
    assert!(made.warnings.is_empty(), "{:?}", made.warnings);
    assert!(made.sections.iter().all(|s| s.residual < 1e-12));
    assert_eq!(made.sections.len(), 22 * 6);
    assert_eq!(made.roles["gimbal"], "gimbal");
    assert_eq!(made.roles["case.07"], "centreline");
    assert!(made.times[0].chosen[2].from.contains("0.0100 m away"));
    assert!(made.times[0].chosen[1].from.contains("slope zero"));
}

#[test]
fn units_frame_coordinate_systems_and_normalisation_leave_the_package_as_it_is() {
    let reference = plain().modal;
    let inches = Style { units: UnitSystem::InLbf, maximum: false, ..turned() };
    for style in [turned(), inches, Style { cylindrical: true, ..PLAIN }] {
        let made = import(&description(&style), vec![results(&style)]).unwrap();
        assert!(made.warnings.is_empty(), "{:?}", made.warnings);
        let (a, b) = (&reference.sets[0], &made.modal.sets[0]);
        assert!((a.body.mass_kg / b.body.mass_kg - 1.0).abs() < 1e-9);
        assert!((a.body.cg_m - b.body.cg_m).norm() < 1e-8);
        for (p, q) in a.grids.iter().zip(&b.grids) {
            assert_eq!(p.name, q.name);
            assert!((p.position_m - q.position_m).norm() < 1e-11, "{}", p.name);
        }
        for (m, n) in a.modes.iter().zip(&b.modes) {
            assert_eq!((&m.label, m.frequency_hz), (&n.label, n.frequency_hz));
            let parts = m.shape.iter().zip(&n.shape).chain(m.slope.iter().zip(&n.slope));
            for (u, v) in parts {
                // Shapes are up to 2/√6000; round-off of millimetres around 5·10⁴ over a radius.
                assert!((u - v).norm() < 1e-11, "{} {u} {v}", m.label);
            }
        }
    }
}

#[test]
fn pounds_by_wtmass_are_the_same_modes_as_slinches() {
    // The solver's mass matrix is in lbf·s²/in either way, and so are modes and generalised masses.
    let style = Style { units: UnitSystem::InLbf, ..PLAIN };
    let text = description(&style);
    let slinch = import(&text, vec![results(&style)]).unwrap().modal;
    let wtmass = 1.0 / crate::import::units::POUNDS_PER_SLINCH;
    let pounds = text.replace("\"in-lbf\"", &format!("\"in-lbm\"\nwtmass = {wtmass:e}"));
    let made = import(&pounds, vec![results(&style)]).unwrap().modal;
    for (m, n) in slinch.sets[0].modes.iter().zip(&made.sets[0].modes) {
        assert!(m.shape.iter().zip(&n.shape).all(|(u, v)| (u - v).norm() < 1e-14));
    }
}

#[test]
fn a_set_of_the_description_serves_as_one_of_the_files_and_does_not_replace_it() {
    let with = |set: &str| {
        description(&PLAIN).replace(
            "[[grid]]\nname = \"rock\"",
            &format!("[set]\n{set}\n\n[[grid]]\nname = \"rock\""),
        )
    };
    let text =
        with("aft = [2008, 2007, 2006, 2005, 2004, 2003, 2002, 2001]").replace("AFT RING", "aft");
    let made = import(&text, vec![results(&PLAIN)]).unwrap();
    assert_eq!(made.modal.sets, plain().modal.sets);
    let text = with("\"AFT RING\" = [1, 2, 3]");
    let problems = import(&text, vec![results(&PLAIN)]).unwrap_err().to_string();
    assert!(problems.contains("set.AFT RING: found other nodes"), "{problems}");
}

#[test]
fn the_wrong_unit_system_is_refused_with_the_one_that_fits() {
    let millimetres = Style { units: UnitSystem::MmTS, ..PLAIN };
    let text = description(&millimetres).replace("mm-t-s", "si");
    let problems = import(&text, vec![results(&millimetres)]).unwrap_err().to_string();
    assert!(problems.contains("units: found the grids extend over 2.0000e4 m"), "{problems}");
    assert!(problems.contains("would look right in mm-t-s"), "{problems}");
}

#[test]
fn modes_without_masses_are_normalised_by_a_mass_matrix_or_refused() {
    // The mass of the tube as a diagonal matrix over ring nodes, for which the sums are made here.
    let entries: Vec<Entry> = (nodes().iter().filter(|(id, _)| *id < GIMBAL))
        .flat_map(|&(id, _)| {
            (1..=3).map(move |k| Entry { row: (id, k), column: (id, k), value: 2.5 })
        })
        .chain([Entry { row: (2, 1), column: (1, 1), value: 0.3 }])
        .collect();
    let mut bare = results(&PLAIN);
    for mode in &mut bare.modes {
        mode.generalised_mass = None;
        mode.shape.iter_mut().for_each(|s| s.translation = s.translation.map(|t| 7.0 * t));
    }
    let text = description(&PLAIN).replace("\"mass\" }", "\"none\" }");
    let problems = import(&text, vec![bare.clone()]).unwrap_err().to_string();
    assert!(problems.contains("no generalised mass for mode 1"), "{problems}");
    assert!(problems.contains("the same of 7 more modes"), "{problems}");

    let (raw, findings) = table::read::<ImportFile>(
        "import.toml",
        &text.replace(
            "from = \"rigid-body-modes\"",
            "from = \"declared\", mass_kg = 6000, cg_m = [10, 0, 0], \
             inertia_kg_m2 = [[1, 0, 0], [0, 2, 0], [0, 0, 2]]",
        ),
    )
    .unwrap();
    let shapes = bare.modes.clone();
    let mut read = Some(Read { results: bare, matrix: Some(entries) });
    let made = resolve(&raw, |_, _| read.take(), findings).unwrap();
    let sum: f64 = (shapes[6].shape.iter().filter(|s| s.node < GIMBAL))
        .map(|s| 2.5 * s.translation.iter().map(|t| t * t).sum::<f64>())
        .sum();
    let cross = 0.6 * shapes[6].shape[0].translation[0] * shapes[6].shape[1].translation[0];
    let expected = shapes[6].shape.last().unwrap().translation[1] / (sum + cross).sqrt();
    // The pair was turned; its length over both modes at a grid stays.
    let expected_2 = expected.powi(2)
        + (shapes[7].shape.last().unwrap().translation[1]).powi(2)
            / ((shapes[7].shape.iter().filter(|s| s.node < GIMBAL))
                .map(|s| 2.5 * s.translation.iter().map(|t| t * t).sum::<f64>())
                .sum::<f64>()
                + 0.6 * shapes[7].shape[0].translation[0] * shapes[7].shape[1].translation[0]);
    let set = &made.modal.sets[0];
    let rock = set.grid("rock").unwrap();
    let found = set.modes[0].shape[rock].y.powi(2) + set.modes[1].shape[rock].y.powi(2);
    assert!((found / expected_2 - 1.0).abs() < 1e-10, "{found} {expected_2}");
}

#[test]
fn masses_that_contradict_the_normalisation_are_refused() {
    let style = Style { maximum: true, ..PLAIN };
    let text = description(&PLAIN);
    let problems = import(&text, vec![results(&style)]).unwrap_err().to_string();
    assert!(problems.contains("where normalisation = \"mass\" says 1"), "{problems}");
    let loud = refused("\"mass\" }", "\"maximum\" }", {
        let mut loud = results(&PLAIN);
        loud.modes[3].shape[5].translation[0] = 1.5;
        loud
    });
    assert!(loud.contains("a translation of 1.50000 in mode 4"), "{loud}");
}

#[test]
fn a_greatest_component_of_one_is_that_of_the_file_whatever_the_frame_of_the_vehicle() {
    // A mode along the vehicle's y has three components in a skew frame, each less than its length.
    let skew = nalgebra::Rotation3::from_euler_angles(0.6, -0.7, 0.9);
    let style = Style { maximum: true, axes: *skew.matrix(), ..PLAIN };
    let made = import(&description(&style), vec![results(&style)]).unwrap();
    let (a, b) = (&plain().modal.sets[0], &made.modal.sets[0]);
    assert!((a.body.mass_kg / b.body.mass_kg - 1.0).abs() < 1e-9);
    for (m, n) in a.modes.iter().zip(&b.modes) {
        for (u, v) in m.shape.iter().zip(&n.shape) {
            assert!((u - v).norm() < 1e-11, "{} {u} {v}", m.label);
        }
    }
}

#[test]
fn single_precision_is_a_warning_with_its_effect_on_slopes() {
    let style = Style { precision: Precision::Single, ..PLAIN };
    let made = import(&description(&style), vec![results(&style)]).unwrap();
    let warning = &made.warnings[0];
    assert!(warning.contains("single precision (32 bits)"), "{warning}");
    // Eight nodes of a ring of 0.3 m: about 6e-8 · φ/√3 · √2/(0.3 · √8) for φ near 2/√6000.
    let exact = plain().modal;
    for ((a, b), moved) in exact.sets[0].modes.iter().zip(&made.modal.sets[0].modes).zip(0..) {
        let rows = made.sections.iter().filter(|s| s.label == b.label);
        let stated = rows.map(|s| s.rounding).fold(0.0, f64::max);
        assert!((1e-10..1e-8).contains(&stated), "{stated}");
        let case = 3..;
        for (u, v) in a.slope[case.clone()].iter().zip(&b.slope[case.clone()]) {
            // Four deviations in each of three directions, of the pair and of its turning.
            assert!((u - v).norm() < 16.0 * stated, "mode {moved}: {}", (u - v).norm() / stated);
        }
    }
    let text = Style { precision: Precision::Text { digits: 4 }, ..PLAIN };
    let made = import(&description(&text), vec![results(&text)]).unwrap();
    assert!(made.warnings[0].contains("text of 4 digits"), "{:?}", made.warnings);
}

#[test]
fn a_ring_that_does_not_move_as_one_is_reported_with_its_residual() {
    let mut results = results(&PLAIN);
    // The aft ring ovalises in one mode as strongly as it moves.
    for shape in results.modes[8].shape.iter_mut().filter(|s| (2001..=2008).contains(&s.node)) {
        let angle = std::f64::consts::TAU * (shape.node - 2001) as f64 / 8.0;
        shape.translation[1] += 0.03 * angle.cos();
        shape.translation[2] -= 0.03 * angle.sin();
    }
    let made = import(&description(&PLAIN), vec![results]).unwrap();
    let said: Vec<&String> = made.warnings.iter().filter(|w| w.contains("move as one")).collect();
    assert_eq!(said.len(), 2, "{:?}", made.warnings);
    assert!(said[0].contains("the 8 nodes of `gimbal`") && said[1].contains("`case.21`"));
    let worst = made.sections.iter().map(|s| s.residual).fold(0.0, f64::max);
    assert!(worst > 0.5 && worst < 1.0, "{worst}");
}

#[test]
fn a_declared_mass_tells_a_reduced_body_from_an_integrated_one() {
    let declare = |mass: f64, kind: &str| {
        let inertia = body().inertia_kg_m2;
        let rows: Vec<[f64; 3]> = (0..3).map(|i| [0, 1, 2].map(|j| inertia[(i, j)])).collect();
        description(&PLAIN)
            .replace(
                "from = \"rigid-body-modes\"",
                &format!(
                    "from = \"declared\", mass_kg = {mass}, cg_m = [10, 0, 0], inertia_kg_m2 = {rows:?}"
                ),
            )
            .replace(
                "{ kind = \"reduced\" }",
                &format!(
                    "{{ kind = \"{kind}\", engine = [{{ name = \"core.1\", mass_kg = 900 }}] }}"
                ),
            )
    };
    let says = |mass: f64, kind: &str| import(&declare(mass, kind), vec![results(&PLAIN)]);
    assert!(says(6000.0, "reduced").unwrap().warnings.is_empty());
    let integrated = says(6000.0, "integrated").unwrap();
    assert_eq!(integrated.modal.contains_engines, ["core.1"]);
    let wrong = says(5100.0, "reduced").unwrap_err().to_string();
    assert!(wrong.contains("of a body with the engines than to the declared 5.10000e3"), "{wrong}");
    let wrong = says(6900.0, "integrated").unwrap_err().to_string();
    assert!(wrong.contains("of a body without the engines"), "{wrong}");
    let doubtful = says(6300.0, "reduced").unwrap().warnings;
    assert!(doubtful.iter().any(|w| w.contains("give 6.00000e3 kg, the package says")));
    let slipped = declare(60.0, "reduced").replace(", mass_kg = 900", "");
    let slipped = import(&slipped, vec![results(&PLAIN)]).unwrap_err().to_string();
    assert!(slipped.contains("give 6.00000e3 kg, the package says 6.00000e1 kg"), "{slipped}");
    let heavy = declare(6000.0, "integrated").replace("mass_kg = 900", "mass_kg = 9000");
    let heavy = import(&heavy, vec![results(&PLAIN)]).unwrap_err().to_string();
    assert!(heavy.contains("9000 kg of engines in 6.00000e3 kg"), "{heavy}");
}

#[test]
fn lumped_masses_give_mass_properties_and_weigh_the_grids() {
    let mut results = results(&PLAIN);
    // The mass of the tube by the trapezoid: half at the end rings, none beside the rings.
    let (part, last) = (MASS_KG / 160.0, 100 * (STATIONS - 1));
    let mass = nodes().into_iter().filter(|(id, _)| *id < GIMBAL).map(|(id, _)| {
        let end = id < 100 || id > last;
        (id, NodeMass { mass: if end { part / 2.0 } else { part }, inertia: [0.01; 3] })
    });
    results.mass = Some(mass.collect());
    let text = description(&PLAIN).replace("rigid-body-modes", "lumped-masses");
    let made = import(&text, vec![results]).unwrap();
    let set = &made.modal.sets[0];
    assert!((set.body.mass_kg / MASS_KG - 1.0).abs() < 1e-14);
    // The gimbal has the mass of its own node, none, though its rotation is that of the aft ring.
    let grid = |name: &str| &set.grids[set.grid(name).unwrap()];
    assert_eq!(grid("gimbal").mass_kg.x, 0.0);
    assert_eq!(grid("case.21").mass_kg.y, 4.0 * part);
    let about_x = 8.0 * (0.01 + part / 2.0 * RADIUS_M * RADIUS_M);
    assert!((grid("case.21").inertia_kg_m2.x - about_x).abs() < 1e-9);
    assert_eq!(made.times[0].estimates.len(), 2);
    assert!(made.warnings.is_empty(), "{:?}", made.warnings);
}

#[test]
fn labels_follow_modes_over_flight_times_whatever_their_order_in_the_file() {
    let text = description(&PLAIN).replace(
        "[[grid]]\nname = \"gimbal\"",
        "[[flight_time]]\ntime_s = 90\nresults = [\"b.op2\"]\nmass = { from = \"rigid-body-modes\" }\n\n\
         [[grid]]\nname = \"gimbal\"",
    );
    let mut later = results(&PLAIN);
    // The first pair overtakes the second.
    later.modes[6].frequency_hz = 40.0;
    later.modes[7].frequency_hz = 40.0;
    let made = import(&text, vec![results(&PLAIN), later]).unwrap();
    let labels: Vec<&str> = made.modal.sets[1].modes.iter().map(|m| m.label.as_str()).collect();
    assert_eq!(labels, ["m003", "m004", "m001", "m002", "m005", "m006"]);
    assert!(made.modal.parents.is_empty());
    let rows = made.sections.iter().filter(|s| s.flight_time_s == 90.0);
    assert!(rows.clone().any(|s| s.label == "m003") && rows.count() == 22 * 6);
}

#[test]
fn every_problem_of_a_description_and_its_results_is_found_at_once() {
    let text = r#"
format = 1
source = "  "
units = "in-lbm"
frame = { aft = [1, 0, 0], y = [1, 1, 0] }
body = { kind = "integrated" }
modes = { normalisation = "mass" }
[[flight_time]]
time_s = 80
results = ["a.op2"]
mass = { from = "rigid-body-modes" }
[[flight_time]]
time_s = 70
results = ["b.op2"]
mass = { from = "rigid-body-modes" }
[[grid]]
name = "Gimbal!"
node = 1
set = "A"
[[grid]]
name = "a"
nearest_m = [0, 0, 0]
[[grid]]
name = "a"
section = { nodes = [1, 1, 2], near_m = [0, 0, 0], weights = [1] }
[[centreline]]
name = "row"
from_m = [0, 0, 0]
to_m = [0, 0, 0]
slice_m = 1
radius_m = [2, 1]
"#;
    let problems = import(text, vec![results(&PLAIN), results(&PLAIN)]).unwrap_err();
    let keys: BTreeMap<&str, &str> =
        problems.0.iter().map(|p| (p.key.as_str(), p.found.as_str())).collect();
    for key in [
        "source",
        "flight_time[1].time_s",
        "body.engine",
        "grid[0].name",
        "grid[0]",
        "grid[1]",
        "grid[2].name",
        "grid[2].section",
        "grid[2].section.weights",
        "grid[2].section.nodes",
        "centreline[0]",
        "centreline[0].radius_m",
        "wtmass",
        "frame",
    ] {
        assert!(keys.contains_key(key), "{key} is not in {keys:#?}");
    }
}

#[test]
fn nodes_that_cannot_be_used_are_named() {
    for (from, to, said) in [
        ("node = 5001", "node = 77", "node 77, which is not in the files"),
        ("node = 5001", "node = 5002", "node 5002, which carries no results"),
        ("set = \"GIMBAL\"", "set = \"GIMBEL\"", "set \"GIMBEL\"; allowed: "),
        ("set = \"GIMBAL\"", "set = \"AFT RING\"", "of 8 nodes; allowed: a set of one node"),
        ("within_m = 0.02", "within_m = 0.005", "node 5000 as the nearest, 0.0100 m from"),
        ("role = \"actuator\"", "role = \"sensor\"", "whose rotations are zero in every mode"),
        ("stations = 21", "stations = 20", "0 grids in the slice of `case.02`"),
        ("{ set = \"AFT RING\" }", "{ nodes = [1, 2] }", "grid[0].section.nodes: found 2 grids"),
        ("{ set = \"AFT RING\" }", "{ nodes = [1, 101, 201] }", "3 grids on one line"),
    ] {
        let problems = refused(from, to, results(&PLAIN));
        assert!(problems.contains(said), "{to}: {problems}");
    }
}

#[test]
fn results_that_are_no_free_body_are_refused_or_told() {
    let mut held = results(&PLAIN);
    held.modes.drain(..6);
    let problems = refused("a tube", "a tube", held);
    assert!(problems.contains("0 rigid-body modes, where 6 hold the mass matrix"), "{problems}");

    let mut grounded = results(&PLAIN);
    grounded.modes[5].frequency_hz = 9.0;
    let made = import(&description(&PLAIN), vec![grounded]).unwrap();
    assert!(made.warnings.iter().any(|w| w.contains("rigid-body mode 6 at 9.000e0 Hz, 80 %")));

    let mut lost = results(&PLAIN);
    lost.systems.clear();
    lost.nodes[0].displacement_system = 5;
    lost.nodes[1].position_system = 6;
    let problems = refused("a tube", "a tube", lost);
    assert!(problems.contains("no coordinate system 5, to which the displacement"), "{problems}");
    assert!(problems.contains("no coordinate system 6, to which the position"), "{problems}");

    let mut ragged = results(&PLAIN);
    ragged.modes[4].shape.pop();
    assert!(refused("a tube", "a tube", ragged).contains("on 170 grids and mode 5 on 169 others"));
}

#[test]
fn no_modes_below_the_greatest_frequency_is_a_problem_of_that_key() {
    let text = "normalisation = \"mass\", max_hz = 3";
    let problems = refused("normalisation = \"mass\"", text, results(&PLAIN));
    assert!(problems.contains("modes.max_hz: found no elastic mode up to 3 Hz"), "{problems}");
    let text = description(&PLAIN).replace("\"mass\" }", "\"mass\", count = 3 }");
    // The pair that the count cuts through is still turned as a pair.
    let made = import(&text, vec![results(&PLAIN)]).unwrap();
    let set = &made.modal.sets[0];
    assert_eq!(set.modes.len(), 3);
    let gimbal = set.modes[2].shape[set.grid("gimbal").unwrap()];
    assert!(gimbal.z.abs() < 1e-10 * gimbal.y.abs(), "{gimbal}");
}

#[test]
fn masses_that_would_contradict_their_modes_stay_out_of_the_package() {
    // The whole mass on two rings of the centreline's 21: the modes do not weigh 1 on them.
    let mut results = results(&PLAIN);
    let mass =
        (1..=8).chain(2001..=2008).map(|id| (id, NodeMass { mass: 375.0, inertia: [0.0; 3] }));
    results.mass = Some(mass.collect());
    let made = import(&description(&PLAIN), vec![results]).unwrap();
    assert!(made.warnings.iter().any(|w| w.contains("left out of the package")));
    assert!(made.modal.sets[0].grids.iter().all(|g| g.mass_kg.x == 0.0));
}

#[test]
fn an_elastic_mode_that_looks_rigid_on_its_grids_is_refused() {
    let mut results = results(&PLAIN);
    results.modes[2].frequency_hz = 30.0;
    let problems = refused("a tube", "a tube", results);
    assert!(problems.contains("moves all grids with results as one"), "{problems}");
}

#[test]
fn positions_beyond_any_vehicle_are_refused_before_they_overflow() {
    let mut results = results(&PLAIN);
    results.nodes[3].position = [1e200, 0.0, 0.0];
    let problems = refused("a tube", "a tube", results);
    assert!(problems.contains("node 4 at a distance"), "{problems}");
    let mut results = self::results(&PLAIN);
    results.modes.iter_mut().for_each(|m| {
        m.shape.iter_mut().for_each(|s| s.translation = s.translation.map(|t| 1e200 * t));
    });
    assert!(!refused("a tube", "a tube", results).is_empty());
}

#[test]
fn the_description_in_the_documentation_is_one() {
    let page = include_str!("../../../docs/import/README.md");
    let text = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let (raw, mut findings) = table::read::<ImportFile>("README.md", text).unwrap();
    assert!(grids::check(&raw, &mut findings));
    let raw = findings.finish(Some(raw)).unwrap();
    assert_eq!((raw.grid.len(), raw.centreline.len(), raw.set.len()), (2, 1, 1));
}

proptest::proptest! {
    #[test]
    fn no_value_of_a_description_makes_the_import_panic(
        line in 1_usize..40,
        junk in proptest::sample::select(vec![
            "0", "-1", "1e300", "1e-300", "\"\"", "[]", "{}", "true", "[0, 0, 0]", "\"x\"", "[1, 2]",
        ]),
    ) {
        let text = description(&PLAIN);
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        if let Some(line) = lines.get_mut(line)
            && let Some((key, _)) = line.clone().split_once(" = ")
        {
            *line = format!("{key} = {junk}");
        }
        if let Ok((raw, findings)) = table::read::<ImportFile>("import.toml", &lines.join("\n")) {
            let read = |_: usize, _: &mut Findings| Some(Read { results: results(&PLAIN), matrix: None });
            let _ = resolve(&raw, read, findings);
        }
    }
}
