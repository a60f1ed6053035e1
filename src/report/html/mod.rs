//! The report of a run as one HTML page that needs nothing else, and its figures.
//!
//! Values come from `contents`, drawings are made with `report::chart`; who writes them is decided in
//! `cli`.

mod bands;
mod compare;
pub mod contents;
mod distribution;
mod gains;
pub mod loops;
mod page;
mod poles;
pub mod shape;
mod tables;
mod tornado;

pub use contents::Contents;
pub use page::page;

use crate::report::chart::Figure;

/// A part of the report.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Name of its place in the page.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// Sentences, in HTML.
    pub text: String,
    /// Figures.
    pub figures: Vec<Figure>,
    /// Tables, in HTML, below the figures.
    pub tables: String,
}

impl Section {
    fn new(id: &'static str, title: &str) -> Self {
        Self {
            id,
            title: title.to_owned(),
            text: String::new(),
            figures: Vec::new(),
            tables: String::new(),
        }
    }
}

/// The sections of a report, in order; those of which the run has nothing are left out.
pub fn sections(contents: &Contents) -> Vec<Section> {
    let all = [
        compare::section(contents),
        Some(tables::summary(contents)),
        poles::section(contents),
        bands::section(contents),
        distribution::section(contents),
        tornado::section(contents),
        tables::worst(contents),
        gains::section(contents),
        loops::section(contents),
        shape::section(contents),
        Some(tables::failures(contents)),
        Some(tables::provenance(contents)),
    ];
    all.into_iter().flatten().collect()
}

/// Names of modes as part of the name of a figure.
fn word(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    name.chars().map(plain).collect()
}

/// A number for a sentence or a cell: four digits, a real minus.
fn number(value: f64) -> String {
    super::significant(value).replace('-', "\u{2212}")
}

/// A share or a damping ratio in percent.
fn percent(value: f64, digits: usize) -> String {
    format!("{:.digits$}", 100.0 * value).replace('-', "\u{2212}")
}
