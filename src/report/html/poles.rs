//! The pole cloud of the paper's Figure 6: nominal and dispersed poles with lines of constant damping.

use super::contents::{Cloud, Contents};
use super::{Section, number, word};
use crate::report::chart::{Area, Axis, Dot, Figure, Panel, legend, room};
use std::f64::consts::TAU;

/// Damping ratios of the lines, −.
const RAYS: [f64; 17] = [
    -0.1, -0.05, -0.02, -0.01, -0.005, -0.002, -0.001, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1,
    0.2, 0.5, 0.7,
];

/// The section, where there are poles.
pub fn section(contents: &Contents) -> Option<Section> {
    let mut section = Section::new("poles", "Poles");
    let definition = &contents.outline.definition;
    for (mode, name) in definition.modes.iter().enumerate() {
        let (_, focus) = contents.focus(mode);
        let clouds: Vec<&Cloud> = contents.clouds.iter().filter(|c| c.mode == mode).collect();
        let Some(large) = clouds.iter().find(|cloud| cloud.flight_time == focus) else { continue };
        section.figures.push(one(contents, name, large));
        if clouds.len() > 1 {
            section.figures.push(all(contents, name, &clouds));
        }
    }
    (!section.figures.is_empty()).then_some(section)
}

fn names(contents: &Contents) -> Vec<(usize, String)> {
    contents.outline.definition.variants.iter().map(|v| v.name.clone()).enumerate().collect()
}

/// The ranges of the axes; the axis of stability is always seen.
fn axes(clouds: &[&Cloud]) -> [[f64; 2]; 2] {
    let re = room(clouds.iter().flat_map(|c| c.re_rad_s).chain([0.0]));
    let im = room(clouds.iter().flat_map(|c| c.im_rad_s));
    [re, im]
}

/// The dots of a variant: less stable ones last, so that they lie on top.
fn dots(dots: &[Dot]) -> Vec<Dot> {
    let mut dots = dots.to_vec();
    dots.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.case.cmp(&b.case)));
    dots
}

fn draw(contents: &Contents, panel: &mut Panel, cloud: &Cloud, r: f64, texts: bool) {
    let [[left, right], [low, high]] = panel.ends();
    let structural = contents.structural_damping.filter(|ratio| ratio.abs() < 0.7);
    // x = −ζ/√(1 − ζ²) y: a line for as many ratios as there is room for.
    let slope = |ratio: f64| -ratio / (1.0 - ratio * ratio).sqrt();
    let mut taken: Vec<f64> = vec![panel.x(0.0)];
    let mut ray = |panel: &mut Panel, ratio: f64, class: &str| {
        let x = |y: f64| slope(ratio) * y;
        let top = panel.x(x(high));
        let inside = (left..=right).contains(&x(high));
        if !inside || taken.iter().any(|other| (other - top).abs() < 46.0) {
            return;
        }
        taken.push(top);
        panel.line([(x(low), low), (x(high), high)], class);
        if texts {
            let text = format!("{} %", number(100.0 * ratio));
            panel.text((x(high), high), (3.0, 12.0), "start", "small note", &text);
        }
    };
    if let Some(ratio) = structural {
        ray(panel, ratio, "strong");
    }
    for ratio in RAYS {
        ray(panel, ratio, "ray");
    }
    panel.upright(0.0, "zero");
    for (variant, found) in cloud.variants.iter().enumerate() {
        let name = &contents.outline.definition.variants[variant].name;
        panel.dots(&dots(&found.dots), variant, r, name, "cloud");
    }
    for (variant, found) in cloud.variants.iter().enumerate() {
        let name = format!("{}, nominal", contents.outline.definition.variants[variant].name);
        panel.dots(&found.nominal, variant, 2.4 * r, &name, "nominal");
    }
}

fn one(contents: &Contents, mode: &str, cloud: &Cloud) -> Figure {
    let definition = &contents.outline.definition;
    let time = definition.flight_times_s[cloud.flight_time];
    let [re, im] = axes(&[cloud]);
    let mut body = String::new();
    let top = legend(&mut body, [64.0, 830.0], 4.0, &names(contents)) + 10.0;
    let area = Area { left: 74.0, top, width: 740.0, height: 430.0 };
    let mut panel = Panel::new(
        format!("poles-{}", word(mode)),
        area,
        Axis::linear("real part, rad/s", re),
        Axis::linear("imaginary part, rad/s", im),
    );
    draw(contents, &mut panel, cloud, 1.9, true);
    let hertz = Axis::linear("", im.map(|im| im / TAU)).ticks(9);
    let hertz: Vec<(f64, String)> = hertz.into_iter().map(|(f, text)| (f * TAU, text)).collect();
    panel.right_scale("frequency, Hz", &hertz);
    panel.finish(&mut body);
    let (shown, seen) = cloud
        .variants
        .iter()
        .fold((0, 0), |(shown, seen), v| (shown + v.dots.len() as u64, seen + v.seen));
    let ray = contents.structural_damping.map_or(String::new(), |ratio| {
        format!(
            " The strong dashed line is the structural damping of the uncoupled mode, {} %.",
            number(100.0 * ratio)
        )
    });
    Figure {
        id: format!("poles-{}", word(mode)),
        title: format!("Poles of {mode} at {time} s, nominal (large) and dispersed"),
        caption: format!(
            "Dashed lines: constant damping ratio. Right of the vertical line a pole is unstable.{ray} {} of {seen} \
             poles are drawn: of each cell of 1/240 by 1/150 of the figure that holds poles of a variant the \
             least damped one, so that no extreme is lost.",
            shown
        ),
        width: 890.0,
        height: top + 430.0 + 46.0,
        body,
    }
}

fn all(contents: &Contents, mode: &str, clouds: &[&Cloud]) -> Figure {
    let definition = &contents.outline.definition;
    let mut body = String::new();
    let [re, _] = axes(clouds);
    let start = legend(&mut body, [64.0, 880.0], 4.0, &names(contents)) + 22.0;
    let (columns, width, height) = (3, 236.0, 190.0);
    let (across, down) = (width + 62.0, height + 62.0);
    for (index, cloud) in clouds.iter().enumerate() {
        let (column, row) = (index % columns, index / columns);
        let area = Area {
            left: 64.0 + column as f64 * across,
            top: start + row as f64 * down,
            width,
            height,
        };
        let lowest = index + columns >= clouds.len();
        let [_, im] = axes(&[cloud]);
        let mut panel = Panel::new(
            format!("poles-all-{}-{index}", word(mode)),
            area,
            Axis::linear(if lowest { "real part, rad/s" } else { "" }, re),
            Axis::linear(if column == 0 { "imaginary part, rad/s" } else { "" }, im),
        );
        panel.title(&format!("{} s", definition.flight_times_s[cloud.flight_time]));
        draw(contents, &mut panel, cloud, 1.2, false);
        panel.finish(&mut body);
    }
    let rows = clouds.len().div_ceil(columns);
    Figure {
        id: format!("poles-by-time-{}", word(mode)),
        title: format!("Poles of {mode} at every flight time"),
        caption: "The real axis is common, so that the panels compare; the imaginary axes (rad/s) are not. Thinned as above, to cells \
                  of 1/100 by 1/66 of a panel."
            .to_owned(),
        width: 64.0 + columns as f64 * across,
        height: start + rows as f64 * down,
        body,
    }
}
