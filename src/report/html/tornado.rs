//! Tornado charts: what the low and the high side of each draw do to the smallest damping ratio.

use super::contents::{Contents, Influenced};
use super::{Section, number, percent, word};
use crate::campaign::sensitivity::Ranking;
use crate::report::chart::{Area, Axis, Figure, Panel, escaped, room};

/// Draws shown.
const MOST: usize = 15;

/// The section; it says why where there is no ranking.
pub fn section(contents: &Contents) -> Option<Section> {
    let mut section = Section::new("tornado", "Which draws matter");
    match &contents.rankings {
        Err(reason) => {
            section.text = format!("<p>No ranking of the draws: {}.</p>", escaped(reason));
        }
        Ok(rankings) => {
            section.figures = rankings
                .iter()
                .filter_map(|(metric, cases, ranking)| figure(contents, metric, *cases, ranking))
                .collect();
            if section.figures.is_empty() {
                section.text = "<p>No ranking of the draws: too few cases.</p>".to_owned();
            }
        }
    }
    section
        .figures
        .extend(contents.influences.iter().filter_map(|found| influence(contents, found)));
    Some(section)
}

/// Mean change of the damping ratio per σ of each draw, from derivatives.
fn influence(contents: &Contents, found: &Influenced) -> Option<Figure> {
    let definition = &contents.outline.definition;
    let (variant, mode) = (&definition.variants[found.variant].name, &definition.modes[found.mode]);
    let time = definition.flight_times_s[found.flight_time];
    let bars = &found.ranking[..found.ranking.len().min(MOST)];
    if bars.is_empty() {
        return None;
    }
    let ends = bars.iter().flat_map(|b| b.mean_interval.unwrap_or([b.mean; 2]).map(|v| 100.0 * v));
    let x = room(ends.chain([0.0]));
    let row = 21.0;
    let height = row * bars.len() as f64 + 8.0;
    let area = Area { left: 400.0, top: 10.0, width: 400.0, height };
    let y = Axis::linear("", [-(bars.len() as f64) + 0.3, 0.7]);
    let id = format!("influence-{}-{}", word(variant), word(mode));
    let axis = Axis::linear("mean change of the damping ratio for one σ, %", x);
    let mut panel = Panel::new(id.clone(), area, axis, y).bare(false, true);
    for (place, influence) in bars.iter().enumerate() {
        let at = -(place as f64);
        let class = if influence.mean < 0.0 { "fill s0" } else { "fill s1" };
        panel.bar([0.0, 100.0 * influence.mean], at, 0.62 * row, class);
        if let Some(ends) = influence.mean_interval {
            panel.line(ends.map(|end| (100.0 * end, at)), "bound");
        }
        panel.text(
            (x[0], at),
            (-8.0, 4.0),
            "end",
            "",
            &short(&contents.outline.draws[influence.draw].key),
        );
        let share =
            influence.share.map_or(String::new(), |share| format!("{} %", percent(share, 0)));
        panel.text((x[1], at), (10.0, 4.0), "start", "small note", &share);
    }
    panel.upright(0.0, "zero");
    let mut body = String::new();
    panel.finish(&mut body);
    let [cases, veering] = found.cases;
    Some(Figure {
        id,
        title: format!("Eigenvalue derivatives: {mode}, {variant}, at {time} s"),
        caption: format!(
            "Mean over {cases} cases of the derivative of the damping ratio with respect to the normal score of each draw, with its 95 % \
             interval, and on the right the share of the variance that is linear in it. {veering} cases are near veering, where a \
             derivative holds for small changes only. All numbers: tvse influence."
        ),
        width: 910.0,
        height: 10.0 + height + 46.0,
        body,
    })
}

/// A draw key that fits beside the bars.
fn short(key: &str) -> String {
    if key.chars().count() > 56 {
        key.chars().take(55).chain(['…']).collect()
    } else {
        key.to_owned()
    }
}

fn figure(contents: &Contents, metric: &str, cases: usize, ranking: &Ranking) -> Option<Figure> {
    // Bars in the order of their length; those without one are not drawn.
    let mut bars: Vec<_> =
        ranking.effects.iter().filter_map(|e| Some((e, e.tornado?))).take(MOST).collect();
    if bars.is_empty() {
        return None;
    }
    bars.sort_by(|(_, a), (_, b)| (b[1] - b[0]).abs().total_cmp(&(a[1] - a[0]).abs()));
    let middle = bars.iter().map(|(_, [a, b])| 0.5 * (a + b)).sum::<f64>() / bars.len() as f64;
    let x = room(bars.iter().flat_map(|(_, pair)| pair.map(|v| 100.0 * v)));
    let row = 21.0;
    let height = row * bars.len() as f64 + 8.0;
    let area = Area { left: 400.0, top: 26.0, width: 400.0, height };
    let y = Axis::linear("", [-(bars.len() as f64) + 0.3, 0.7]);
    let mut panel = Panel::new(
        format!("tornado-{}", word(metric)),
        area,
        Axis::linear("smallest damping ratio, %", x),
        y,
    )
    .bare(false, true);
    for (place, (effect, [low, high])) in bars.iter().enumerate() {
        let at = -(place as f64);
        let (low, high) = (100.0 * low, 100.0 * high);
        let middle = 100.0 * middle;
        for (end, class) in [(low, "fill s1"), (high, "fill s0")] {
            panel.bar([middle, end], at, 0.62 * row, class);
        }
        panel.text((x[0], at), (-8.0, 4.0), "end", "", &short(&effect.key));
        let said = effect
            .total
            .or(effect.first_order)
            .map_or(String::new(), |index| format!("{} %", percent(index.value.max(0.0), 0)));
        panel.text((x[1], at), (10.0, 4.0), "start", "small note", &said);
    }
    panel.upright(100.0 * middle, "zero");
    let mut body = String::new();
    body += "<path class=\"fill s1\" d=\"M400 8h12v9h-12z\"/><text x=\"416\" y=\"17\">lowest tenth of the draw</text>\
             <path class=\"fill s0\" d=\"M590 8h12v9h-12z\"/><text x=\"606\" y=\"17\">highest tenth</text>\
             <text class=\"small note\" x=\"810\" y=\"17\">share of variance</text>";
    panel.finish(&mut body);
    let explained = ranking.explained.map_or(String::new(), |share| {
        format!(" A linear model explains {} % of the variance.", number(100.0 * share))
    });
    let used = contents.outline.definition.populations[contents.population].cases;
    let limited = if (cases as u64) < used {
        format!(" From the first {cases} of {used} cases.")
    } else {
        String::new()
    };
    Some(Figure {
        id: format!("tornado-{}", word(metric)),
        title: metric.to_owned(),
        caption: format!(
            "Mean over the cases in which a draw is in its lowest and in its highest tenth (of a one-at-a-time plan its \
             two cases), the {} draws that matter most. Share of variance: first-order index, or total index where \
             the plan gives one.{explained}{limited} {} cases left out as failed. All numbers: <code>tvse sensitivity</code>.",
            bars.len(),
            ranking.left_out
        )
        .replace("<code>", "")
        .replace("</code>", ""),
        width: 910.0,
        height: 26.0 + height + 46.0,
        body,
    })
}
