//! Damping ratio against flight time: a panel a variant, with bands of the dispersed cases.

use super::contents::Contents;
use super::{Section, word};
use crate::campaign::summary::LEVELS;
use crate::report::chart::{Area, Axis, Dot, Figure, Panel, room};

/// Levels whose values bound the two inner bands.
const INNER: [[f64; 2]; 2] = [[0.01, 0.99], [0.05, 0.95]];

/// The section, where there is more than one flight time.
pub fn section(contents: &Contents) -> Option<Section> {
    let definition = &contents.outline.definition;
    if definition.flight_times_s.len() < 2 {
        return None;
    }
    let mut section = Section::new("flight-time", "Damping against flight time");
    for mode in 0..definition.modes.len() {
        section.figures.extend(figure(contents, mode));
    }
    (!section.figures.is_empty()).then_some(section)
}

fn figure(contents: &Contents, mode: usize) -> Option<Figure> {
    let definition = &contents.outline.definition;
    let name = &definition.modes[mode];
    let times = &definition.flight_times_s;
    let spread = |variant: usize, time: usize| {
        contents.row(variant, mode, Some(time)).and_then(|row| row.damping_ratio.as_ref())
    };
    let variants = 0..definition.variants.len();
    // A common axis for all variants with thrust, another for those without.
    let axis = |thrust: bool| {
        let same = variants.clone().filter(|v| definition.variants[*v].thrust == thrust);
        let all = same.flat_map(|v| (0..times.len()).map(move |t| (v, t)));
        let ends = all.filter_map(|(v, t)| spread(v, t)).flat_map(|s| [s.smallest, s.largest]);
        room(ends.map(|ratio| 100.0 * ratio).chain([0.0]))
    };
    variants.clone().find_map(|v| (0..times.len()).find_map(|t| spread(v, t)))?;
    let x = room(times.iter().copied());
    let columns = definition.variants.len().min(3);
    let width = (850.0 - 46.0 * (columns as f64 - 1.0)) / columns as f64;
    let (height, down) = (230.0, 300.0);
    let level = |level: f64| LEVELS.iter().position(|(l, _)| *l == level);
    let mut body = String::new();
    for variant in variants.clone() {
        let (column, row) = (variant % columns, variant / columns);
        let area = Area {
            left: 64.0 + column as f64 * (width + 46.0),
            top: 24.0 + row as f64 * down,
            width,
            height,
        };
        let mut panel = Panel::new(
            format!("bands-{}-{variant}", word(name)),
            area,
            Axis::linear("flight time, s", x),
            Axis::linear(
                if column == 0 { "damping ratio, %" } else { "" },
                axis(definition.variants[variant].thrust),
            ),
        );
        panel.title(&definition.variants[variant].name);
        let series = variant % crate::report::chart::SERIES;
        let rows: Vec<_> =
            (0..times.len()).filter_map(|t| Some((times[t], spread(variant, t)?))).collect();
        let band = |low: &dyn Fn(&crate::campaign::summary::Spread) -> [f64; 2]| {
            rows.iter()
                .map(|(time, spread)| {
                    let [low, high] = low(spread);
                    (*time, 100.0 * low, 100.0 * high)
                })
                .collect::<Vec<_>>()
        };
        panel.band(&band(&|s| [s.smallest, s.largest]), &format!("fill s{series} wide"));
        for ([low, high], class) in INNER.into_iter().zip(["middle", "narrow"]) {
            if let (Some(low), Some(high)) = (level(low), level(high)) {
                let band = band(&|s| [s.quantiles[low], s.quantiles[high]]);
                panel.band(&band, &format!("fill s{series} {class}"));
            }
        }
        panel.level(0.0, "zero");
        if let Some(median) = level(0.5) {
            let line = rows.iter().map(|(time, s)| (*time, 100.0 * s.quantiles[median]));
            panel.line(line, &format!("line s{series}"));
        }
        let nominal = (0..times.len()).filter_map(|t| {
            let spread = contents.nominal(variant, mode, Some(t))?.damping_ratio.as_ref()?;
            Some((times[t], 100.0 * spread.mean))
        });
        panel.line(nominal, "strong");
        let least = contents.clouds.iter().filter(|cloud| cloud.mode == mode).filter_map(|cloud| {
            let (ratio, case) = cloud.variants[variant].least?;
            Some(Dot { x: times[cloud.flight_time], y: 100.0 * ratio, case })
        });
        let least: Vec<Dot> = least.collect();
        let called = format!("{}, least damped", definition.variants[variant].name);
        panel.dots(&least, variant, 2.6, &called, "");
        panel.finish(&mut body);
    }
    let rows = definition.variants.len().div_ceil(columns);
    Some(Figure {
        id: format!("damping-{}", word(name)),
        title: format!("Damping ratio of {name} against flight time"),
        caption: "Bands from light to dark: least to greatest, 1 to 99 %, 5 to 95 % of the cases; line: median; dashed: \
                  nominal; marks: the least damped case of each flight time. Variants with thrust have a common axis."
            .to_owned(),
        width: 930.0,
        height: 24.0 + rows as f64 * down,
        body,
    })
}
