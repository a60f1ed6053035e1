//! The motion of a named mode on the vehicle, gimbal angles included (the paper's Figure 5), animated.

use super::contents::{Contents, Shape, Swing};
use super::{Section, number, word};
use crate::campaign::{Definition, Evaluator};
use crate::report::chart::{Figure, escaped};
use crate::report::figure;
use crate::vehicle::{ModeSet, Vehicle};
use nalgebra::{Complex, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Greatest displacement drawn, over the greatest extent of the vehicle.
const AMPLITUDE: f64 = 0.06;
/// Greatest gimbal angle drawn, rad.
const SWING: f64 = 0.35;
/// Pictures of a period, and its length on the screen, s.
const FRAMES: usize = 24;
const PERIOD_S: f64 = 1.8;
/// Least number of grids of a beam.
const BEAM: usize = 5;
/// Half length of the ribs that show rotation, over the greatest extent of the vehicle.
const RIB: f64 = 0.028;

/// The motion of the nominal vehicle in a named mode at the flight time and in the variant with these
/// places in the definition of `evaluator`; none where nothing moves.
pub fn of(
    vehicle: &Vehicle,
    definition: &Definition,
    evaluator: &Evaluator<'_>,
    [mode, variant, flight_time]: [usize; 3],
) -> Option<Shape> {
    let at = evaluator.times.get(flight_time)?;
    let reference = at.variants.get(variant)?.references.get(mode)?;
    let layout = &at.plant(variant).layout;
    let set = vehicle.modal.at(at.flight_time_s)?;
    let x =
        |place: usize| Complex::new(reference.pair.right[place].re, reference.pair.right[place].im);
    type Motion = Vector3<Complex<f64>>;
    let three = |range: std::ops::Range<usize>| -> Motion {
        Motion::from_iterator(range.map(x).chain(std::iter::repeat(Complex::ZERO)).take(3))
    };
    let (moved, turned) = (three(layout.translation()), three(layout.rotation()));
    let complex = |v: &Vector3<f64>| v.map(|value| Complex::new(value, 0.0));
    // Translation and rotation of a grid.
    let grid = |place: usize| -> (Motion, Motion) {
        let arm = complex(&(set.grids[place].position_m - set.body.cg_m));
        let mut shift = moved + turned.cross(&arm);
        let mut turn = turned;
        for (coordinate, shape) in layout.elastic().zip(&set.modes) {
            shift += complex(&shape.shape[place]) * x(coordinate);
            turn += complex(&shape.slope[place]) * x(coordinate);
        }
        (shift, turn)
    };
    let all: Vec<(Motion, Motion)> = (0..set.grids.len()).map(grid).collect();
    // The phase in which the grid that moves most moves most, and its amplitude.
    let largest =
        all.iter().map(|(shift, _)| shift).max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let square: Complex<f64> = largest.iter().map(|c| c * c).sum();
    let phase = Complex::from_polar(1.0, -0.5 * square.arg());
    let greatest = largest.norm();
    if !(greatest > 0.0) {
        return None;
    }
    let parts = |motion: Motion| -> [Vector3<f64>; 2] {
        let scaled = motion * phase / Complex::new(greatest, 0.0);
        [scaled.map(|c| c.re), scaled.map(|c| c.im)]
    };
    let nozzle = |(index, engine): (usize, &crate::vehicle::Engine)| {
        let place = layout.gimbal(index).filter(|_| definition.gimballed[index])?;
        let grid = set.grid(&engine.gimbal_grid)?;
        let angle: Motion =
            (0..2).map(|k| complex(&engine.axes.column(k).into_owned()) * x(place + k)).sum();
        Some(Swing {
            engine: engine.path(),
            grid,
            axis_m: -engine.thrust_direction * engine.nozzle.length_m,
            angle_rad_m: parts(angle),
            structure_rad_m: parts(all[grid].1),
        })
    };
    let pole = reference.pair.pole;
    let lines = lines(set);
    Some(Shape {
        mode,
        variant,
        flight_time,
        pole_rad_s: [pole.re, pole.im],
        ribs: ribs(&lines).map(|grid| (grid, parts(all[grid].1))).collect(),
        lines,
        rest_m: set.grids.iter().map(|grid| grid.position_m).collect(),
        motion: all.iter().map(|(shift, _)| parts(*shift)).collect(),
        nozzles: vehicle.engines.iter().enumerate().filter_map(nozzle).collect(),
    })
}

/// Lines through the grids: beams of a stick model, whose grids share y and z, in the order of x; others by their
/// names.
fn lines(set: &ModeSet) -> Vec<Vec<usize>> {
    let millimetres = |value: f64| (1e3 * value).round() as i64;
    let mut beams: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
    for (place, grid) in set.grids.iter().enumerate() {
        let at = grid.position_m;
        beams.entry((millimetres(at.y), millimetres(at.z))).or_default().push(place);
    }
    let x = |place: &usize| set.grids[*place].position_m.x;
    let mut lines: Vec<Vec<usize>> =
        beams.into_values().filter(|beam| beam.len() >= BEAM).collect();
    if lines.is_empty() {
        return figure::lines(set);
    }
    lines.iter_mut().for_each(|line| line.sort_by(|a, b| x(a).total_cmp(&x(b))));
    lines
}

/// About a dozen grids of each line at which its rotation is shown.
fn ribs(lines: &[Vec<usize>]) -> impl Iterator<Item = usize> + '_ {
    lines.iter().filter(|line| line.len() >= BEAM).flat_map(|line| {
        let step = (line.len() / 12).max(1);
        line.iter().copied().step_by(step)
    })
}

/// The section, where the inputs of the run are there.
pub fn section(contents: &Contents) -> Option<Section> {
    let mut section = Section::new("shape", "Mode on the vehicle");
    section.figures = contents.shapes.iter().map(|shape| draw(contents, shape)).collect();
    (!section.figures.is_empty()).then_some(section)
}

/// A view: its title, and the directions to the right and upwards.
struct View {
    title: &'static str,
    right: Vector3<f64>,
    up: Vector3<f64>,
    /// Place in the figure and room there, px.
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

fn draw(contents: &Contents, shape: &Shape) -> Figure {
    let definition = &contents.outline.definition;
    let extent = (0..3)
        .map(|k| {
            let ends = |(a, b): (f64, f64), p: &Vector3<f64>| (a.min(p[k]), b.max(p[k]));
            let (low, high) = shape.rest_m.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
            high - low
        })
        .fold(0.0, f64::max);
    let size = AMPLITUDE * extent;
    let modulus = |[re, im]: &[Vector3<f64>; 2]| (re.norm_squared() + im.norm_squared()).sqrt();
    let widest = shape.nozzles.iter().map(|n| modulus(&n.angle_rad_m)).fold(0.0, f64::max);
    let swing = if widest > 0.0 { SWING / widest } else { 0.0 };
    let frame = |[re, im]: &[Vector3<f64>; 2], step: usize| {
        let (sin, cos) = (TAU * step as f64 / FRAMES as f64).sin_cos();
        re * cos - im * sin
    };
    // All points of a frame: grids, then the exits of the nozzles.
    let points = |step: usize| -> Vec<Vector3<f64>> {
        let grids = shape.rest_m.iter().zip(&shape.motion);
        let mut points: Vec<_> = grids.map(|(rest, u)| rest + frame(u, step) * size).collect();
        for nozzle in &shape.nozzles {
            let turn = frame(&nozzle.structure_rad_m, step) * size
                + frame(&nozzle.angle_rad_m, step) * swing;
            let exit = points[nozzle.grid] + nozzle.axis_m + turn.cross(&nozzle.axis_m);
            points.push(exit);
        }
        for (grid, turn) in &shape.ribs {
            let half = Vector3::y() * (RIB * extent);
            let turned = half + (frame(turn, step) * size).cross(&half);
            points.extend([points[*grid] - turned, points[*grid] + turned]);
        }
        points
    };
    let frames: Vec<Vec<Vector3<f64>>> = (0..FRAMES).map(points).collect();
    let still: Vec<Vector3<f64>> = (shape.rest_m.iter().copied())
        .chain(shape.nozzles.iter().map(|n| shape.rest_m[n.grid] + n.axis_m))
        .chain(shape.ribs.iter().flat_map(|(grid, _)| {
            let half = Vector3::y() * (RIB * extent);
            [shape.rest_m[*grid] - half, shape.rest_m[*grid] + half]
        }))
        .collect();
    let views = [
        View {
            title: "oblique: x aft to the right, z up, y into the picture",
            right: Vector3::new(1.0, -0.35, 0.0),
            up: Vector3::new(0.0, 1.1, 1.0),
            left: 20.0,
            top: 30.0,
            width: 600.0,
            height: 260.0,
        },
        View {
            title: "from behind: y to the right, z up",
            right: Vector3::y(),
            up: Vector3::z(),
            left: 650.0,
            top: 30.0,
            width: 230.0,
            height: 260.0,
        },
    ];
    let mut body = String::new();
    for view in &views {
        let flat = |p: &Vector3<f64>| (view.right.dot(p), view.up.dot(p));
        let all = frames.iter().flatten().chain(&still).map(flat);
        let start = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        let [a, b, c, d] =
            all.fold(start, |[a, b, c, d], (x, y)| [a.min(x), b.max(x), c.min(y), d.max(y)]);
        let scale = (view.width / (b - a).max(1e-9)).min(view.height / (d - c).max(1e-9));
        let (middle_x, middle_y) = (view.left + view.width / 2.0, view.top + view.height / 2.0);
        let place = |p: &Vector3<f64>| {
            let (x, y) = flat(p);
            (middle_x + (x - 0.5 * (a + b)) * scale, middle_y - (y - 0.5 * (c + d)) * scale)
        };
        let path = |points: &[Vector3<f64>], line: &[usize]| {
            let mut text = String::new();
            for (index, &point) in line.iter().enumerate() {
                let (x, y) = place(&points[point]);
                let _ = write!(text, "{}{x:.1} {y:.1}", if index == 0 { "M" } else { "L" });
            }
            text
        };
        let _ = write!(
            body,
            "<text class=\"note\" x=\"{:.1}\" y=\"18\">{}</text>",
            view.left, view.title
        );
        let nozzles: Vec<Vec<usize>> = (shape.nozzles.iter().enumerate())
            .map(|(index, nozzle)| vec![nozzle.grid, shape.rest_m.len() + index])
            .collect();
        let first = shape.rest_m.len() + shape.nozzles.len();
        let ribs: Vec<Vec<usize>> = (0..shape.ribs.len())
            .map(|index| vec![first + 2 * index, first + 2 * index + 1])
            .collect();
        let lines = shape.lines.iter().filter(|line| line.len() > 1);
        for line in lines.clone().chain(&nozzles) {
            let _ = write!(body, "<path class=\"rest\" d=\"{}\"/>", path(&still, line));
        }
        let moving = (ribs.iter().map(|line| (line, "body thin")))
            .chain(lines.map(|line| (line, "body")))
            .chain(nozzles.iter().map(|line| (line, "nozzle")));
        for (line, class) in moving {
            let values: Vec<String> =
                (frames.iter().chain(frames.first())).map(|points| path(points, line)).collect();
            let _ = write!(
                body,
                "<path class=\"{class}\" d=\"{}\"><animate attributeName=\"d\" dur=\"{PERIOD_S}s\" \
                 repeatCount=\"indefinite\" values=\"{}\"/></path>",
                values[0],
                values.join(";")
            );
        }
    }
    let mode = &definition.modes[shape.mode];
    let [re, im] = shape.pole_rad_s;
    let angles: Vec<String> = (shape.nozzles.iter())
        .map(|nozzle| {
            let per_metre = modulus(&nozzle.angle_rad_m).to_degrees();
            format!("{}: gimbal angle {}° per metre", nozzle.engine, number(per_metre))
        })
        .collect();
    for (place, text) in angles.iter().enumerate() {
        let _ = write!(
            body,
            "<text x=\"{}\" y=\"{}\">{}</text>",
            20 + 290 * (place % 3),
            316 + 18 * (place / 3),
            escaped(text)
        );
    }
    Figure {
        id: format!("shape-{}", word(mode)),
        title: format!(
            "{mode} of the nominal vehicle at {} s, {}: {} Hz, damping ratio {} %",
            definition.flight_times_s[shape.flight_time],
            definition.variants[shape.variant].name,
            number(im.abs() / TAU),
            number(-100.0 * re / re.hypot(im))
        ),
        caption: format!(
            "Grey at rest, blue displaced (cross lines lie along y and turn with the structure), orange the gimballed nozzles, drawn from pivot to exit. The greatest displacement is \
             drawn as {} m, gimbal angles {} times as enlarged. Below: gimbal angles relative to the \
             structure for each metre of the greatest displacement. The animation is a period with its decay or growth left out.",
            number(size),
            number(if size > 0.0 { swing / size } else { 0.0 })
        ),
        width: 900.0,
        height: 322.0 + 18.0 * ((angles.len().max(1) - 1) / 3) as f64,
        body,
    }
}
