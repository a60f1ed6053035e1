//! Figure of a mode on the vehicle, as SVG: three views of the grids at rest and displaced.
//!
//! A package holds no elements, so grids whose names share all but the last part (`core.01`,
//! `core.02`) are joined in the order of x; others are points.

use super::significant;
use crate::vehicle::{Mode, ModeSet};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Width of the figure, in its own units.
const WIDTH: f64 = 960.0;
const MARGIN: f64 = 24.0;
/// Height of a line of text.
const LINE: f64 = 18.0;
/// Greatest displacement drawn, over the greatest extent of the vehicle.
const AMPLITUDE: f64 = 0.06;

/// A view: what it is called, and the coordinates to the right and upwards.
struct View {
    title: &'static str,
    axes: [usize; 2],
    names: [&'static str; 2],
}

const VIEWS: [View; 3] = [
    View { title: "side: x aft, z up", axes: [0, 2], names: ["x", "z"] },
    View { title: "top: x aft, y up", axes: [0, 1], names: ["x", "y"] },
    View { title: "from behind: y right, z up", axes: [1, 2], names: ["y", "z"] },
];

/// The figure of `mode` of `set`.
pub fn mode(source: &str, set: &ModeSet, mode: &Mode) -> String {
    let rest: Vec<Vector3<f64>> = set.grids.iter().map(|g| g.position_m).collect();
    let greatest = mode.shape.iter().map(Vector3::norm).fold(0.0, f64::max);
    let extent = (0..3).map(|k| range(&rest, k)).map(|(low, high)| high - low).fold(0.0, f64::max);
    let factor = if greatest > 0.0 { AMPLITUDE * extent.max(1e-9) / greatest } else { 0.0 };
    let moved: Vec<Vector3<f64>> =
        rest.iter().zip(&mode.shape).map(|(p, u)| p + u * factor).collect();
    let lines = lines(set);
    let scale = (WIDTH - 2.0 * MARGIN) / padded(&rest, &moved, 0).1.max(extent).max(1e-9);

    let mut body = String::new();
    let mut top = 2.0 * LINE + MARGIN;
    for view in VIEWS {
        let [(left, wide), (low, high)] = view.axes.map(|k| padded(&rest, &moved, k));
        let height = high * scale;
        let _ = writeln!(
            body,
            "<text x=\"{MARGIN}\" y=\"{:.1}\" fill=\"#555\">{}</text>",
            top + LINE - 4.0,
            view.title
        );
        top += LINE;
        let place = |p: &Vector3<f64>| {
            let x = MARGIN + (p[view.axes[0]] - left) * scale;
            (x, top + height - (p[view.axes[1]] - low) * scale)
        };
        let _ = writeln!(
            body,
            "<g id=\"view-{}{}\"><rect x=\"{MARGIN}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{height:.1}\" \
             fill=\"none\" stroke=\"#ddd\"/>",
            view.names[0],
            view.names[1],
            wide * scale
        );
        for (points, colour, width) in [(&rest, "#9aa5b1", 1.0), (&moved, "#c0392b", 1.8)] {
            for line in &lines {
                let path: Vec<String> = (line.iter())
                    .map(|&i| place(&points[i]))
                    .map(|(x, y)| format!("{x:.2},{y:.2}"))
                    .collect();
                if let [point] = path.as_slice() {
                    let (x, y) = point.split_once(',').unwrap_or_default();
                    let _ = writeln!(
                        body,
                        "<circle cx=\"{x}\" cy=\"{y}\" r=\"2.5\" fill=\"{colour}\"/>"
                    );
                } else {
                    let _ = writeln!(
                        body,
                        "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" \
                         stroke-width=\"{width}\"/>",
                        path.join(" ")
                    );
                }
            }
        }
        body.push_str("</g>\n");
        top += height + MARGIN / 2.0;
    }
    let height = top + MARGIN;
    let title = format!(
        "{}: mode {}, {} Hz at {} s",
        source,
        mode.label,
        significant(mode.frequency_hz),
        set.flight_time_s
    );
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.1}\" \
         width=\"{WIDTH}\" height=\"{height:.1}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <title>{0}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"{MARGIN}\" y=\"{1}\" font-size=\"15\">{0}</text>\n\
         <text x=\"{MARGIN}\" y=\"{2}\" fill=\"#555\">grey at rest, red displaced: the greatest \
         displacement, {3} kg^-1/2, is drawn as {4} m</text>\n{body}</svg>\n",
        escaped(&title),
        MARGIN,
        MARGIN + LINE,
        significant(greatest),
        significant(greatest * factor),
    )
}

fn range(points: &[Vector3<f64>], k: usize) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p[k]), b.max(p[k])))
}

/// Start and length of the coordinate `k` over both, with a little room.
fn padded(rest: &[Vector3<f64>], moved: &[Vector3<f64>], k: usize) -> (f64, f64) {
    let ((a, b), (c, d)) = (range(rest, k), range(moved, k));
    let (low, high) = (a.min(c), b.max(d));
    let room = 0.02 * (high - low).max(1e-3);
    (low - room, high - low + 2.0 * room)
}

/// Grids joined by their names, each row in the order of x; the others alone.
pub(super) fn lines(set: &ModeSet) -> Vec<Vec<usize>> {
    let mut rows: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    let mut alone = Vec::new();
    for (i, grid) in set.grids.iter().enumerate() {
        match grid.name.rsplit_once('.') {
            Some((row, last)) if last.chars().all(|c| c.is_ascii_digit()) => {
                rows.entry(row).or_default().push(i);
            }
            _ => alone.push(vec![i]),
        }
    }
    let x = |i: &usize| set.grids[*i].position_m.x;
    let rows = rows.into_values().map(|mut row| {
        row.sort_by(|a, b| x(a).total_cmp(&x(b)));
        row
    });
    rows.chain(alone).collect()
}

/// Text that cannot end or open an element.
fn escaped(text: &str) -> String {
    text.chars()
        .filter(|c| !c.is_control())
        .map(|c| match c {
            '&' => "&amp;".to_owned(),
            '<' => "&lt;".to_owned(),
            '>' => "&gt;".to_owned(),
            '"' => "&quot;".to_owned(),
            c => c.to_string(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::{Grid, MassProperties};
    use nalgebra::Matrix3;

    fn set() -> ModeSet {
        let grid = |name: &str, x: f64| Grid {
            name: name.to_owned(),
            position_m: Vector3::new(x, 0.0, 0.0),
            mass_kg: Vector3::zeros(),
            inertia_kg_m2: Vector3::zeros(),
        };
        ModeSet {
            flight_time_s: 80.0,
            body: MassProperties {
                mass_kg: 1.0,
                cg_m: Vector3::zeros(),
                inertia_kg_m2: Matrix3::identity(),
            },
            grids: vec![grid("core.02", 10.0), grid("core.01", 0.0), grid("gimbal", 10.0)],
            modes: vec![Mode {
                label: "m<1>".to_owned(),
                frequency_hz: 2.0,
                shape: vec![Vector3::z(), -Vector3::z(), Vector3::z()],
                slope: vec![Vector3::zeros(); 3],
            }],
        }
    }

    #[test]
    fn the_figure_has_three_views_with_the_row_joined_and_the_gimbal_as_a_point() {
        let set = set();
        let figure = mode("a & b", &set, &set.modes[0]);
        assert_eq!(figure.matches("<g id=\"view-").count(), 3);
        assert_eq!(figure.matches("<polyline").count(), 6);
        assert_eq!(figure.matches("<circle").count(), 6);
        assert!(figure.contains("a &amp; b: mode m&lt;1&gt;, 2 Hz at 80 s"));
        assert_eq!(figure.matches("<g ").count(), figure.matches("</g>").count());
    }

    #[test]
    fn the_greatest_displacement_is_six_hundredths_of_the_vehicle() {
        let set = set();
        let figure = mode("s", &set, &set.modes[0]);
        assert!(figure.contains("is drawn as 0.6 m"), "{figure}");
        // At rest the row is level; displaced, its ends are 1.2 m apart by the scale of the view.
        let lines: Vec<&str> = figure.lines().filter(|l| l.contains("<polyline")).collect();
        let points = |line: &str| -> Vec<(f64, f64)> {
            let text = line.split('"').nth(1).unwrap();
            text.split(' ')
                .map(|p| p.split_once(',').unwrap())
                .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
                .collect()
        };
        let (rest, moved) = (points(lines[0]), points(lines[1]));
        assert_eq!(rest[0].1, rest[1].1);
        let scale = (rest[1].0 - rest[0].0) / 10.0;
        // Two decimals are drawn.
        assert!(((moved[0].1 - moved[1].1).abs() / scale - 1.2).abs() < 0.02 / scale);
    }
}
