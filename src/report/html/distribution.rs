//! Distributions on normal-probability paper: the smallest damping ratio with its order-statistic bound, and
//! each gate's values against its limit.

use super::contents::{Contents, Distribution, Gated};
use super::{Section, number, percent, word};
use crate::gate::{Sense, Statistic, Verdict};
use crate::report::chart::{Area, Axis, Dot, Figure, Panel, escaped, legend, probit, room};

/// The section, where there are values.
pub fn section(contents: &Contents) -> Option<Section> {
    let mut section = Section::new("distribution", "Distributions, bounds and gates");
    for mode in 0..contents.outline.definition.modes.len() {
        section.figures.extend(least(contents, mode));
    }
    if contents.gates.is_empty() {
        section.text = "<p>No gates were given: <code>tvse report RUN --gates FILE</code> draws the values of each \
                        gate against its limit.</p>"
            .to_owned();
    } else {
        section.figures.extend(contents.gates.iter().enumerate().filter_map(gate));
        section.tables = gate_table(&contents.gates);
    }
    (!section.figures.is_empty() || !section.tables.is_empty()).then_some(section)
}

/// Normal scores of the shares of the cases at or below each point; failed cases lie below all
/// others, or above.
pub(super) fn scores(values: &Distribution, failed_below: bool) -> Vec<Dot> {
    let cases = (values.known + values.failed) as f64;
    let below = if failed_below { values.failed as f64 } else { 0.0 };
    let dot = |&(x, rank, case): &(f64, u64, u64)| Dot {
        x,
        y: probit((rank as f64 + below + 0.5) / cases),
        case,
    };
    values.points.iter().map(dot).collect()
}

/// A line that reaches as far as the largest number of cases, and back.
pub(super) fn shares(cases: u64) -> [f64; 2] {
    let end = probit(1.0 - 0.3 / cases.max(2) as f64);
    [-end, end]
}

fn least(contents: &Contents, mode: usize) -> Option<Figure> {
    let definition = &contents.outline.definition;
    let name = &definition.modes[mode];
    let all: Vec<_> =
        contents.least.iter().filter(|l| l.mode == mode && l.values.known > 0).collect();
    if all.is_empty() {
        return None;
    }
    let x = room(all.iter().flat_map(|l| l.values.points.iter().map(|p| 100.0 * p.0)).chain([0.0]));
    let cases = all.iter().map(|l| l.values.known + l.values.failed).max().unwrap_or(2);
    let mut body = String::new();
    let names: Vec<(usize, String)> =
        all.iter().map(|l| (l.variant, definition.variants[l.variant].name.clone())).collect();
    let top = legend(&mut body, [64.0, 850.0], 4.0, &names) + 10.0;
    let area = Area { left: 74.0, top, width: 780.0, height: 340.0 };
    let mut panel = Panel::new(
        format!("least-{}", word(name)),
        area,
        Axis::linear("smallest damping ratio over the flight times, %", x),
        Axis::probability("share of the cases at or below, %", shares(cases)),
    );
    panel.upright(0.0, "zero");
    let mut bounds = Vec::new();
    for least in &all {
        let dots: Vec<Dot> = scores(&least.values, true)
            .into_iter()
            .map(|dot| Dot { x: 100.0 * dot.x, ..dot })
            .collect();
        let variant = &definition.variants[least.variant].name;
        let series = least.variant % crate::report::chart::SERIES;
        panel.line(dots.iter().map(|d| (d.x, d.y)), &format!("line thin s{series}"));
        panel.dots(&dots, least.variant, 1.7, variant, "");
        if let Some(bound) = least.bound {
            let at = 100.0 * bound.value;
            let share = probit(1.0 - bound.coverage);
            let low = panel.ends()[1][0];
            panel.line([(at, low), (at, share)], &format!("line s{series}"));
            bounds.push(format!(
                "{variant} {} % ({} exceedances allowed)",
                percent(bound.value, 3),
                bound.exceedances
            ));
        }
    }
    let stated = all.iter().find_map(|l| l.bound);
    if let Some(bound) = stated {
        let share = probit(1.0 - bound.coverage);
        panel.level(share, "ray");
        let end = panel.ends()[0][1];
        let text = format!("{} %", number(100.0 * (1.0 - bound.coverage)));
        panel.text((end, share), (-4.0, -4.0), "end", "small note", &text);
    }
    panel.finish(&mut body);
    let said = stated.map_or_else(
        || "No order-statistic bound: it needs independent draws, and enough of them.".to_owned(),
        |bound| {
            format!(
                "Upright lines from below: order-statistic bound that {} % of the population keeps, with at most \
                 {} % risk: {}.",
                number(100.0 * bound.coverage),
                number(100.0 * bound.risk),
                bounds.join(", ")
            )
        },
    );
    Some(Figure {
        id: format!("distribution-{}", word(name)),
        title: format!("Smallest damping ratio of {name}, each case at its worst flight time"),
        caption: format!(
            "Normal-probability scale: a normal law is a straight line. {said} Failed cases count as below all others. \
             The hundred cases at either end are all drawn, every so many between them."
        ),
        width: 890.0,
        height: top + 340.0 + 46.0,
        body,
    })
}

/// Factor and name of a metric as shown: damping ratios in percent.
pub(super) fn shown(metric: &str, unit: &str) -> (f64, String) {
    match unit {
        "1" if metric.starts_with("damping_ratio") => (100.0, format!("{metric}, %")),
        "1" => (1.0, format!("{metric}, 1")),
        unit => (1.0, format!("{metric}, {unit}")),
    }
}

fn gate((index, gated): (usize, &Gated)) -> Option<Figure> {
    let Gated { gate, outcome, values } = gated;
    if values.known == 0 {
        return None;
    }
    let (factor, mut label) = shown(&gate.metric, &outcome.metric_unit);
    if let Some(baseline) = &gate.selection.baseline {
        label = label.replacen(',', &format!(" less that of {baseline},"), 1);
    }
    if gate.selection.baseline_run {
        label = label.replacen(',', " less the baseline run,", 1);
    }
    let threshold = match &gate.statistic {
        Statistic::ShareBelow { threshold, .. }
        | Statistic::ShareAbove { threshold, .. }
        | Statistic::NestedStatement { threshold, .. } => Some(threshold.base()),
        _ => None,
    };
    // The limit of a nested statement is a share of outer draws, which has no place here.
    let of_outer = matches!(gate.statistic, Statistic::NestedStatement { .. });
    // In the unit of the metric; of a gate on a share, the share.
    let scale = gate.limit.quantity.scale();
    let limit = gate.limit.quantity.base();
    let bound = outcome.bound.map(|bound| bound * scale);
    let below = match (threshold, gate.limit.sense, &gate.statistic) {
        (None, sense, _) => sense == Sense::AtLeast,
        (_, _, Statistic::NestedStatement { .. }) => true,
        (_, sense, Statistic::ShareBelow { .. }) => sense == Sense::AtMost,
        (_, sense, _) => sense == Sense::AtLeast,
    };
    let marked = threshold.unwrap_or(limit);
    let on_axis = if threshold.is_some() { None } else { bound };
    let drawn = (values.points.iter().map(|p| p.0)).chain([marked]).chain(on_axis);
    let drawn: Vec<f64> = drawn.map(|value| value * factor).collect();
    let [least, most] = room(drawn.iter().copied());
    let smallest = drawn.iter().copied().fold(f64::INFINITY, f64::min);
    // Times to double reach over decades.
    let x = if smallest > 0.0 && most > 100.0 * smallest {
        Axis::logarithmic(label, [0.8 * smallest, most])
    } else {
        Axis::linear(label, [least, most])
    };
    let all = values.known + values.failed;
    let area = Area { left: 74.0, top: 24.0, width: 780.0, height: 250.0 };
    let mut panel = Panel::new(
        format!("gate-{index}"),
        area,
        x,
        Axis::probability("share of the cases at or below, %", shares(all)),
    );
    let dots: Vec<Dot> =
        scores(values, below).into_iter().map(|dot| Dot { x: factor * dot.x, ..dot }).collect();
    panel.line(dots.iter().map(|d| (d.x, d.y)), "line thin s1");
    panel.dots(&dots, 1, 1.7, &gate.id, "");
    let [[_, right], [low, high]] = panel.ends();
    // Beside the line, towards the middle.
    let middle = area.left + 0.5 * area.width;
    let side = |px: f64| if px < middle { (5.0, "start") } else { (-5.0, "end") };
    panel.upright(marked * factor, "limit");
    let (moved, anchor) = side(panel.x(marked * factor));
    let word = if threshold.is_some() { "threshold" } else { "limit" };
    let text = format!("{word} {}", number(marked * factor));
    panel.text((marked * factor, high), (moved, 14.0), anchor, "limit-text", &text);
    if of_outer {
        // Only the threshold of its cases is drawn.
    } else if threshold.is_some() {
        let level = |share: f64| {
            let at_or_below = if matches!(gate.statistic, Statistic::ShareBelow { .. }) {
                share
            } else {
                1.0 - share
            };
            probit(at_or_below).clamp(low, high)
        };
        panel.level(level(limit), "limit");
        let text = format!("limit {} %", number(100.0 * limit));
        panel.text((right, level(limit)), (-6.0, -5.0), "end", "limit-text", &text);
        if let Some(bound) = bound {
            panel.level(level(bound), "bound");
            let text = format!("bound {} %", number(100.0 * bound));
            panel.text((right, level(bound)), (-6.0, 13.0), "end", "", &text);
        }
    } else if let Some(bound) = bound {
        panel.upright(bound * factor, "bound");
        let (moved, anchor) = side(panel.x(bound * factor));
        let text = format!("bound {}", number(bound * factor));
        panel.text((bound * factor, high), (moved, 30.0), anchor, "", &text);
    }
    let mut body = String::new();
    panel.finish(&mut body);
    Some(Figure {
        id: format!("gate-{}", super::word(&gate.id)),
        title: format!("Gate {}: {}", gate.id, verdict(outcome.verdict)),
        caption: format!(
            "{}. {} cases, {} failed; {} against. {}",
            outcome.statistic,
            outcome.cases,
            outcome.failures,
            outcome.violations,
            capitalised(&outcome.message)
        ),
        width: 890.0,
        height: 24.0 + 250.0 + 46.0,
        body,
    })
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    let end = if text.ends_with('.') { "" } else { "." };
    format!("{first}{}{end}", letters.as_str())
}

fn verdict(verdict: Verdict) -> &'static str {
    verdict.name()
}

fn gate_table(gates: &[Gated]) -> String {
    let mut table = String::from(
        "<table><thead><tr><th>gate</th><th>verdict</th><th>severity</th><th>statistic</th><th>value</th><th>bound</th>\
         <th>limit</th><th>cases</th><th>against</th><th>worst case</th></tr></thead><tbody>",
    );
    for Gated { outcome, .. } in gates {
        let value = |value: Option<f64>| value.map_or("–".to_owned(), number);
        let severity = match outcome.severity {
            crate::gate::Severity::Error => "error",
            crate::gate::Severity::Warning => "warning",
        };
        table += &format!(
            "<tr><td>{}</td><td class=\"{v}\">{v}</td><td>{severity}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{} {} {}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escaped(&outcome.id),
            escaped(&outcome.statistic),
            value(outcome.value),
            value(outcome.bound),
            if outcome.sense == "at_least" { "≥" } else { "≤" },
            number(outcome.limit),
            escaped(match outcome.unit.as_str() {
                "1" => "",
                "percent" => "%",
                unit => unit,
            }),
            outcome.cases,
            outcome.violations,
            outcome.worst_case.map_or("–".to_owned(), |case| case.to_string()),
            v = verdict(outcome.verdict),
        );
    }
    table + "</tbody></table>"
}
