//! What feedback, and every other change of the first variant, adds to the damping on the same draws.

use super::contents::{Contents, Gain};
use super::{Section, percent, word};
use crate::report::chart::{Area, Axis, Figure, Panel, escaped, room};

/// The section, where there is more than one variant.
pub fn section(contents: &Contents) -> Option<Section> {
    let mut section = Section::new("added", "Added damping");
    let definition = &contents.outline.definition;
    for mode in 0..definition.modes.len() {
        let of_mode = |feedback: bool| -> Vec<&Gain> {
            let wanted = |g: &&Gain| g.mode == mode && g.feedback == feedback && g.seen > 0;
            contents.gains.iter().filter(wanted).collect()
        };
        for (feedback, what) in [(true, "by feedback"), (false, "by the other variants")] {
            section.figures.extend(figure(contents, mode, &of_mode(feedback), what));
        }
    }
    if !contents.gains.iter().any(|gain| gain.feedback) {
        section.text =
            "<p>This run has no variant that differs from the first in its feedback alone.</p>"
                .to_owned();
    }
    let text = crate::report::feedback::text(&contents.outline, &contents.feedback);
    for line in text.lines().filter(|line| !line.is_empty()) {
        section.text += &format!("<p>{}</p>", escaped(line));
    }
    (!section.figures.is_empty()).then_some(section)
}

fn figure(contents: &Contents, mode: usize, gains: &[&Gain], what: &str) -> Option<Figure> {
    if gains.is_empty() {
        return None;
    }
    let definition = &contents.outline.definition;
    let name = &definition.modes[mode];
    let all = || gains.iter().flat_map(|gain| &gain.dots);
    let x = room(all().map(|dot| 100.0 * dot.x));
    let y = room(all().map(|dot| 100.0 * dot.y).chain([0.0]));
    let mut body = String::new();
    let names: Vec<(usize, String)> =
        gains.iter().map(|g| (g.variant, definition.variants[g.variant].name.clone())).collect();
    let top = crate::report::chart::legend(&mut body, [64.0, 850.0], 4.0, &names) + 10.0;
    let area = Area { left: 74.0, top, width: 780.0, height: 320.0 };
    let first = &definition.variants[0].name;
    let mut panel = Panel::new(
        format!("added-{}-{}", word(name), word(what)),
        area,
        Axis::linear(format!("smallest damping ratio of {first}, %"), x),
        Axis::linear("smallest gain over the flight times, %", y),
    );
    panel.level(0.0, "zero");
    let mut said = Vec::new();
    for gain in gains {
        let dots: Vec<_> = gain
            .dots
            .iter()
            .map(|dot| crate::report::chart::Dot { x: 100.0 * dot.x, y: 100.0 * dot.y, ..*dot })
            .collect();
        let variant = &definition.variants[gain.variant].name;
        panel.dots(&dots, gain.variant, 1.9, variant, "cloud");
        let least = gain.dots.iter().min_by(|a, b| a.y.total_cmp(&b.y));
        said.extend(least.map(|dot| {
            format!("least gain of {variant} {} % (case {})", percent(dot.y, 3), dot.case)
        }));
    }
    panel.finish(&mut body);
    Some(Figure {
        id: format!("added-{}-{}", word(name), word(what)),
        title: format!("Damping ratio of {name} added {what}, same draws"),
        caption: format!(
            "Each mark is a case: how much its damping ratio gains over {first} at the flight time where it gains least. \
             Above the line damping is added; {}. Thinned to cells of 1/240 by 1/150; the least gain of each is kept.",
            said.join("; ")
        ),
        width: 890.0,
        height: top + 320.0 + 46.0,
        body,
    })
}
