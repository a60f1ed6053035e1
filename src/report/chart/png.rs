//! Figures as PNG. Text is set in a font of its own, so that no font need be installed.

use super::Figure;
use resvg::{tiny_skia, usvg};
use std::sync::Arc;

/// DejaVu Sans, reduced to Latin, Greek and the signs used here; its licence is beside it.
const FONT: &[u8] = include_bytes!("sans.ttf");

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The drawing is no SVG that the renderer understands.
    #[error("{0}")]
    Drawing(#[from] usvg::Error),
    /// The picture would be too large or could not be written.
    #[error("{0}")]
    Picture(String),
}

/// A figure as PNG, `scale` points for each of its own, on white.
///
/// # Errors
/// A figure of no size, or larger than memory.
pub fn png(figure: &Figure, scale: f32) -> Result<Vec<u8>, Error> {
    let mut options = usvg::Options::default();
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    options.fontdb = Arc::new(fonts);
    options.font_family = "DejaVu Sans".to_owned();
    let tree = usvg::Tree::from_str(&figure.light(), &options)?;
    let size = tree.size().to_int_size();
    let scaled = |length: u32| (length as f32 * scale).ceil() as u32;
    let mut picture = tiny_skia::Pixmap::new(scaled(size.width()), scaled(size.height()))
        .ok_or_else(|| Error::Picture(format!("{} is too large", figure.id)))?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut picture.as_mut());
    picture.encode_png().map_err(|error| Error::Picture(error.to_string()))
}
