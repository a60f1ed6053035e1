//! A figure: a drawing with title and caption, inside a page or as a file of its own.

use super::escaped;
use super::style::{DARK, LIGHT};

/// A drawing with its words.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its file and of its place in the page, `[a-z0-9-]+`.
    pub id: String,
    /// Title.
    pub title: String,
    /// What is seen, how it was thinned, what the bands are.
    pub caption: String,
    /// Width, px.
    pub width: f64,
    /// Height, px.
    pub height: f64,
    /// SVG elements.
    pub body: String,
}

impl Figure {
    /// The drawing as part of a page, whose style it takes.
    pub fn inline(&self) -> String {
        format!(
            "<svg class=\"tvse\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" role=\"img\" \
             aria-label=\"{title}\">{body}</svg>",
            w = self.width,
            h = self.height,
            title = escaped(&self.title),
            body = self.body
        )
    }

    /// The drawing as a file, light or dark as the reader's screen.
    pub fn file(&self) -> String {
        self.document(&format!("{LIGHT}@media (prefers-color-scheme:dark){{{DARK}}}"))
    }

    /// The drawing as a light document, for a renderer that knows no media.
    pub(super) fn light(&self) -> String {
        self.document(LIGHT)
    }

    /// A title line above the drawing, and the style inside.
    fn document(&self, style: &str) -> String {
        let (w, h) = (self.width, self.height + 30.0);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"tvse\" viewBox=\"0 -30 {w} {h}\" width=\"{w}\" \
             height=\"{h}\">\n<title>{title}</title>\n<desc>{caption}</desc>\n<style>{style}</style>\n\
             <rect class=\"ground\" x=\"0\" y=\"-30\" width=\"{w}\" height=\"{h}\"/>\n\
             <text class=\"head\" x=\"12\" y=\"-10\">{title}</text>\n{body}\n</svg>\n",
            title = escaped(&self.title),
            caption = escaped(&self.caption),
            body = self.body
        )
    }
}
