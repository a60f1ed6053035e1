//! Two runs on the same draws: paired differences of their metrics, and the summaries side by side.

use super::contents::{Comparison, Contents, PairedMetric};
use super::distribution::{scores, shares, shown};
use super::{Section, number, percent, word};
use crate::report::chart::{Area, Axis, Dot, Figure, Panel, escaped, room};

/// The section, where there is another run.
pub fn section(contents: &Contents) -> Option<Section> {
    let other = contents.comparison.as_ref()?;
    let mut section = Section::new("compare", "Comparison of two runs");
    let (cases, keys) = other.common;
    section.text = format!(
        "<p><em>{}</em> less <em>{}</em>: {cases} common cases, {keys} common draw keys with equal values. A positive difference of a \
         damping ratio says that the first is better damped.</p>",
        escaped(&contents.folder),
        escaped(&other.folder)
    );
    section.figures = other.metrics.iter().filter_map(|m| figure(contents, other, m)).collect();
    section.tables = lines(other) + &sides(contents, other);
    Some(section)
}

fn figure(contents: &Contents, other: &Comparison, metric: &PairedMetric) -> Option<Figure> {
    if metric.differences.known == 0 {
        return None;
    }
    let (factor, label) = shown(&metric.name, "1");
    let unit = label.rsplit(' ').next().unwrap_or_default().to_owned();
    let scaled = |dot: &Dot| Dot { x: factor * dot.x, y: factor * dot.y, ..*dot };
    let dots: Vec<Dot> = metric.dots.iter().map(scaled).collect();
    let id = format!("difference-{}", word(&metric.name));
    let mut body = String::new();
    let area = |left: f64| Area { left, top: 24.0, width: 350.0, height: 290.0 };
    let name = |folder: &str| folder.rsplit('/').next().unwrap_or(folder).to_owned();
    let ends = room(dots.iter().map(|d| d.x));
    let y = room(dots.iter().map(|d| d.y).chain([0.0]));
    let mut panel = Panel::new(
        format!("{id}-cloud"),
        area(74.0),
        Axis::linear(format!("value in {}, {unit}", name(&other.folder)), ends),
        Axis::linear(format!("difference, {unit}"), y),
    );
    panel.title("difference by case");
    panel.level(0.0, "zero");
    panel.dots(&dots, 1, 1.8, &metric.name, "cloud");
    panel.finish(&mut body);
    let points: Vec<Dot> =
        scores(&metric.differences, true).iter().map(|d| Dot { x: factor * d.x, ..*d }).collect();
    let mut panel = Panel::new(
        format!("{id}-distribution"),
        area(520.0),
        Axis::linear(format!("difference, {unit}"), room(points.iter().map(|d| d.x).chain([0.0]))),
        Axis::probability(
            "share of the cases at or below, %",
            shares(metric.differences.known + metric.differences.failed),
        ),
    );
    panel.title("distribution of the difference");
    panel.upright(0.0, "zero");
    panel.line(points.iter().map(|d| (d.x, d.y)), "line thin s1");
    panel.dots(&points, 1, 1.7, &metric.name, "");
    panel.finish(&mut body);
    Some(Figure {
        id,
        title: format!("Paired difference of {label}"),
        caption: format!(
            "{} less {}, the same draws in each pair. {} pairs, {} left out because one of them failed.",
            contents.folder, other.folder, metric.differences.known, metric.differences.failed
        ),
        width: 890.0,
        height: 24.0 + 290.0 + 46.0,
        body,
    })
}

fn lines(other: &Comparison) -> String {
    let mut table = String::from(
        "<table><caption>Paired differences</caption><thead><tr><th>metric</th><th>statistic</th><th>value</th>\
         <th>95 % interval</th><th>method</th><th>pairs</th></tr></thead><tbody>",
    );
    for metric in &other.metrics {
        for line in &metric.lines {
            table += &format!(
                "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{}</td></tr>",
                escaped(&metric.name),
                escaped(&line.statistic),
                line.value.map_or("–".to_owned(), number),
                line.interval.map_or("–".to_owned(), |[a, b]| format!(
                    "{} – {}",
                    number(a),
                    number(b)
                )),
                escaped(line.method),
                line.cases
            );
        }
    }
    table + "</tbody></table>"
}

/// The worst over the flight times in both, by variants and modes of the same name.
fn sides(contents: &Contents, other: &Comparison) -> String {
    let definition = &contents.outline.definition;
    let there = &other.outline.definition;
    let population = &definition.populations[contents.population].name;
    let Some(other_population) = there.populations.iter().position(|p| p.name == *population)
    else {
        return String::new();
    };
    let mut table = String::from(
        "<table><caption>Each case at its worst flight time, first and second run</caption><thead><tr><th>mode</th><th>variant</th>\
         <th colspan=\"2\">least ζ, %</th><th colspan=\"2\">unstable, %</th><th colspan=\"2\">failed</th></tr></thead><tbody>",
    );
    for (mode, name) in definition.modes.iter().enumerate() {
        for (variant, v) in definition.variants.iter().enumerate() {
            let Some(mode_there) = there.modes.iter().position(|m| m == name) else { continue };
            let Some(variant_there) = there.variants.iter().position(|w| w.name == v.name) else {
                continue;
            };
            let second = other.summary.iter().find(|row| {
                let group = &row.group;
                (group.population, group.variant, group.mode, group.flight_time, group.outer)
                    == (other_population, variant_there, mode_there, None, None)
            });
            let (Some(first), Some(second)) = (contents.row(variant, mode, None), second) else {
                continue;
            };
            table += &format!("<tr><td>{}</td><td>{}</td>", escaped(name), escaped(&v.name));
            for row in [first, second] {
                let least = row.damping_ratio.as_ref().map(|s| percent(s.smallest, 3));
                table += &format!("<td class=\"n\">{}</td>", least.unwrap_or("–".to_owned()));
            }
            for row in [first, second] {
                let share = row.share_unstable.map(|share| percent(share, 1));
                table += &format!("<td class=\"n\">{}</td>", share.unwrap_or("–".to_owned()));
            }
            table += &format!(
                "<td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
                first.failures, second.failures
            );
        }
    }
    table + "</tbody></table>"
}
