//! The page: sections with their figures, style and script inside, nothing from elsewhere.

use super::Section;
use crate::report::chart::{DARK, LIGHT, escaped};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The text of the page.
///
/// A policy in its head forbids every request, so that nothing in it can reach the network.
pub fn page(title: &str, subtitle: &str, sections: &[Section]) -> String {
    let links: String = sections
        .iter()
        .map(|section| format!("<a href=\"#{}\">{}</a>", section.id, escaped(&section.title)))
        .collect();
    let body: String = sections.iter().map(section).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none';style-src 'unsafe-inline';\
         script-src 'unsafe-inline';img-src data:\">\
         <link rel=\"icon\" href=\"data:,\">\
         <title>{title}</title>\n<style>{STYLE}{LIGHT}@media screen and (prefers-color-scheme:dark){{{DARK}}}</style></head>\n\
         <body>\n<h1>{title}</h1>\n<p class=\"soft\">{subtitle}</p>\n<nav>{links}</nav>\n{body}\
         <div id=\"tip\" role=\"status\"></div>\n<script>{SCRIPT}</script>\n</body></html>\n",
        title = escaped(title),
        subtitle = escaped(subtitle),
    )
}

fn section(section: &Section) -> String {
    let figures: String = section
        .figures
        .iter()
        .map(|figure| {
            format!(
                "<figure id=\"{}\"><h3>{}</h3>{}<figcaption>{}</figcaption></figure>\n",
                figure.id,
                escaped(&figure.title),
                figure.inline(),
                escaped(&figure.caption)
            )
        })
        .collect();
    format!(
        "<section id=\"{}\"><h2>{}</h2>\n{}{figures}{}</section>\n",
        section.id,
        escaped(&section.title),
        section.text,
        section.tables
    )
}
