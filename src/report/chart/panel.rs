//! A panel: a rectangle with two axes, in which lines, bands and marks are drawn.
//!
//! It turns numbers into places; several panels make a figure.

use super::axis::Axis;
use super::cells::Dot;
use super::escaped;
use super::style::mark;
use std::fmt::Write;

/// A rectangle in the figure, px: the frame of a panel without its labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Left end.
    pub left: f64,
    /// Upper end.
    pub top: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

/// A panel being drawn.
#[derive(Debug, Clone)]
pub struct Panel {
    area: Area,
    x: Axis,
    y: Axis,
    clip: String,
    /// Behind everything, clipped to the frame, and above the frame.
    behind: String,
    inside: String,
    above: String,
    x_label: bool,
    y_label: bool,
}

/// Appends to a string.
macro_rules! add {
    ($text:expr, $($arguments:tt)*) => {
        write!($text, $($arguments)*).expect("a string takes any text")
    };
}

impl Panel {
    /// An empty panel; `clip` is a name that no other panel of the page has.
    pub fn new(clip: impl Into<String>, area: Area, x: Axis, y: Axis) -> Self {
        let clip = format!("clip-{}", clip.into());
        let texts = [(); 3].map(|()| String::new());
        let [behind, inside, above] = texts;
        Self { area, x, y, clip, behind, inside, above, x_label: true, y_label: true }
    }

    /// Leaves out the label of the x axis and its numbers, of the y axis and its numbers.
    pub fn bare(mut self, x: bool, y: bool) -> Self {
        (self.x_label, self.y_label) = (!x, !y);
        self
    }

    /// Where a number of the x axis lies, px.
    pub fn x(&self, value: f64) -> f64 {
        self.area.left + self.area.width * self.x.place(value)
    }

    /// Where a number of the y axis lies, px.
    pub fn y(&self, value: f64) -> f64 {
        self.area.top + self.area.height * (1.0 - self.y.place(value))
    }

    /// The ends of the axes.
    pub fn ends(&self) -> [[f64; 2]; 2] {
        [self.x.ends(), self.y.ends()]
    }

    /// A title above the frame.
    pub fn title(&mut self, text: &str) {
        let Area { left, top, width, .. } = self.area;
        // A title is never longer than its panel: about 6.4 px a letter.
        let most = (width / 6.4) as usize;
        let short = if text.chars().count() > most {
            text.chars().take(most.saturating_sub(1)).chain(['…']).collect()
        } else {
            text.to_owned()
        };
        add!(
            self.above,
            "<text class=\"head\" x=\"{left:.1}\" y=\"{:.1}\">{}</text>",
            top - 6.0,
            escaped(&short)
        );
    }

    fn points(&self, points: impl IntoIterator<Item = (f64, f64)>) -> String {
        let mut text = String::new();
        for (x, y) in points {
            let (x, y) = (self.x(x), self.y(y));
            if x.is_finite() && y.is_finite() {
                add!(text, "{}{x:.1} {y:.1}", if text.is_empty() { "" } else { "L" });
            }
        }
        text
    }

    /// A line through points.
    pub fn line(&mut self, points: impl IntoIterator<Item = (f64, f64)>, class: &str) {
        let points = self.points(points);
        if !points.is_empty() {
            add!(self.inside, "<path class=\"{class}\" d=\"M{points}\"/>");
        }
    }

    /// A vertical line through the panel.
    pub fn upright(&mut self, x: f64, class: &str) {
        let [low, high] = self.y.ends();
        self.line([(x, low), (x, high)], class);
    }

    /// A horizontal line through the panel.
    pub fn level(&mut self, y: f64, class: &str) {
        let [low, high] = self.x.ends();
        self.line([(low, y), (high, y)], class);
    }

    /// A band between two lines.
    pub fn band(&mut self, points: &[(f64, f64, f64)], class: &str) {
        let there = self.points(points.iter().map(|&(x, low, _)| (x, low)));
        let back = self.points(points.iter().rev().map(|&(x, _, high)| (x, high)));
        if !there.is_empty() && !back.is_empty() {
            add!(self.inside, "<path class=\"{class}\" d=\"M{there}L{back}z\"/>");
        }
    }

    /// A bar between two numbers of the x axis, at a place of the y axis, so many px high.
    pub fn bar(&mut self, [from, to]: [f64; 2], y: f64, height: f64, class: &str) {
        let (a, b) = (self.x(from), self.x(to));
        let (left, width) = (a.min(b), (a - b).abs());
        let top = self.y(y) - height / 2.0;
        add!(
            self.inside,
            "<rect class=\"{class}\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/>"
        );
    }

    /// The dots of a series with its mark of half width `r`; hovering names the series and the case.
    pub fn dots(&mut self, dots: &[Dot], series: usize, r: f64, name: &str, class: &str) {
        let mark = mark(series, r);
        let (mut path, mut cases) = (String::new(), String::new());
        for dot in dots {
            let (x, y) = (self.x(dot.x), self.y(dot.y));
            let within = x >= self.area.left - 1.0 && x <= self.area.left + self.area.width + 1.0;
            if within && y.is_finite() {
                add!(path, "M{x:.1} {y:.1}{mark}");
                add!(cases, "{}{}", if cases.is_empty() { "" } else { " " }, dot.case);
            }
        }
        if !path.is_empty() {
            add!(
                self.inside,
                "<path class=\"dots fill s{} {class}\" data-name=\"{}\" data-cases=\"{cases}\" d=\"{path}\"/>",
                series % super::SERIES,
                escaped(name)
            );
        }
    }

    /// Any closed line given by its points, or text with a class, below what is drawn next.
    pub fn shape(&mut self, points: impl IntoIterator<Item = (f64, f64)>, class: &str) {
        let points = self.points(points);
        add!(self.behind, "<path class=\"{class}\" d=\"M{points}z\"/>");
    }

    /// A text at numbers of the axes, moved by px, anchored at `start`, `middle` or `end`.
    pub fn text(
        &mut self,
        at: (f64, f64),
        moved: (f64, f64),
        anchor: &str,
        class: &str,
        text: &str,
    ) {
        let (x, y) = (self.x(at.0) + moved.0, self.y(at.1) + moved.1);
        add!(
            self.above,
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
            escaped(text)
        );
    }

    /// A second scale on the right, in another unit: numbers of the y axis and their texts.
    pub fn right_scale(&mut self, label: &str, ticks: &[(f64, String)]) {
        let right = self.area.left + self.area.width;
        for (value, text) in ticks {
            let y = self.y(*value);
            add!(
                self.above,
                "<path class=\"frame\" d=\"M{right:.1} {y:.1}h4\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                right + 7.0,
                y + 4.0,
                escaped(text)
            );
        }
        let widest = ticks.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0);
        self.upright_label(right + 24.0 + 6.8 * widest as f64, label);
    }

    fn upright_label(&mut self, x: f64, label: &str) {
        let y = self.area.top + self.area.height / 2.0;
        add!(
            self.above,
            "<text class=\"label\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" \
             transform=\"rotate(-90 {x:.1} {y:.1})\">{}</text>",
            escaped(label)
        );
    }

    /// Draws the panel into a figure's body.
    pub fn finish(mut self, body: &mut String) {
        let Area { left, top, width, height } = self.area;
        let (right, bottom) = (left + width, top + height);
        let mut grid = String::new();
        let x_ticks = self.x.ticks((width / 62.0).clamp(2.0, 12.0) as usize);
        let y_ticks = self.y.ticks((height / 42.0).clamp(2.0, 12.0) as usize);
        let mut last = f64::NEG_INFINITY;
        for (value, text) in &x_ticks {
            let x = self.x(*value);
            add!(grid, "<path class=\"grid\" d=\"M{x:.1} {top:.1}V{bottom:.1}\"/>");
            // Texts that would touch are left out.
            let half = 3.6 * text.chars().count() as f64;
            if self.x_label && x - half > last + 4.0 {
                add!(
                    self.above,
                    "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>",
                    bottom + 16.0
                );
                last = x + half;
            }
        }
        let mut last = f64::INFINITY;
        let mut widest = 0;
        for (value, text) in &y_ticks {
            let y = self.y(*value);
            if self.y_label || !self.y.label().is_empty() {
                add!(grid, "<path class=\"grid\" d=\"M{left:.1} {y:.1}H{right:.1}\"/>");
            }
            if self.y_label && y < last - 13.0 {
                add!(
                    self.above,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                    left - 6.0,
                    y + 4.0
                );
                last = y;
                widest = widest.max(text.chars().count());
            }
        }
        if self.x_label {
            add!(
                self.above,
                "<text class=\"label\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                left + width / 2.0,
                bottom + 34.0,
                escaped(self.x.label())
            );
        }
        if self.y_label {
            let label = self.y.label().to_owned();
            self.upright_label(left - 18.0 - 6.8 * widest as f64, &label);
        }
        let axis = |axis: &Axis| {
            let [low, high] = axis.ends();
            format!("{low:e} {high:e} {}", axis.word())
        };
        add!(
            body,
            "<g class=\"panel\" data-frame=\"{left:.1} {top:.1} {width:.1} {height:.1}\" data-x=\"{}\" data-y=\"{}\" \
             data-x-label=\"{}\" data-y-label=\"{}\"><clipPath id=\"{clip}\"><rect x=\"{left:.1}\" y=\"{top:.1}\" \
             width=\"{width:.1}\" height=\"{height:.1}\"/></clipPath>{grid}<g clip-path=\"url(#{clip})\">{}{}</g>\
             <rect class=\"frame\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/>{}</g>\n",
            axis(&self.x),
            axis(&self.y),
            escaped(self.x.label()),
            escaped(self.y.label()),
            self.behind,
            self.inside,
            self.above,
            clip = self.clip,
        );
    }
}

/// A legend: a row of marks and names from `left`, broken at `right`; gives the lower end, px.
pub fn legend(
    body: &mut String,
    [left, right]: [f64; 2],
    top: f64,
    names: &[(usize, String)],
) -> f64 {
    let (mut x, mut y) = (left, top + 12.0);
    for (series, name) in names {
        let width = 26.0 + 7.0 * name.chars().count() as f64;
        if x > left && x + width > right {
            (x, y) = (left, y + 18.0);
        }
        add!(
            body,
            "<path class=\"dots fill s{}\" d=\"M{:.1} {:.1}{}\"/><text x=\"{:.1}\" y=\"{y:.1}\">{}</text>",
            series % super::SERIES,
            x + 6.0,
            y - 4.0,
            mark(*series, 4.0),
            x + 15.0,
            escaped(name)
        );
        x += width;
    }
    y + 8.0
}
