//! Charts as SVG: axes with units, lines, bands, marks and legends, and the same as PNG.
//!
//! What is drawn, and from which numbers, is decided in `report::html`.

mod axis;
mod cells;
mod figure;
mod panel;
mod png;
mod style;

pub use axis::{Axis, probit, room};
pub use cells::{Cells, Dot};
pub use figure::Figure;
pub use panel::{Area, Panel, legend};
pub use png::{Error, png};
pub use style::{DARK, LIGHT, SERIES};

/// Text that cannot end or open an element or an attribute.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c if c.is_control() => {}
            c => safe.push(c),
        }
    }
    safe
}
