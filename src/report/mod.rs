//! Values become text: terminal tables, Markdown, HTML and SVG.

mod number;

pub mod gates;
pub mod how_many;
pub mod story;

pub use number::{percent, significant};
