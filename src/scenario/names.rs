//! Names and lists of a file: words, unique names, ascending numbers.
//!
//! What is named is known to the callers.

use super::table::Findings;

/// Whether `text` is one or more of `a`–`z`, `0`–`9` and `_`: fit for a column name and a
/// parameter path.
pub fn is_word(text: &str) -> bool {
    !text.is_empty()
        && text.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

/// Finds a name that is no word.
pub fn word(findings: &mut Findings, key: &str, text: &str) {
    if !is_word(text) {
        findings.push(key, format!("\"{text}\""), "one or more of a–z, 0–9 and _");
    }
}

/// Finds names of the entries of `list` that occur before.
pub fn unique<'a>(findings: &mut Findings, list: &str, names: impl Iterator<Item = &'a str>) {
    let mut seen: Vec<&str> = Vec::new();
    for (i, name) in names.enumerate() {
        if let Some(first) = seen.iter().position(|s| *s == name) {
            let found = format!("\"{name}\" again");
            let allowed = format!("another name than that of {list}[{first}]");
            findings.push(format!("{list}[{i}].name"), found, allowed);
        }
        seen.push(name);
    }
}

/// Finds a number that is not above the one before; whether there is none.
pub fn ascending(findings: &mut Findings, key: &str, values: &[f64]) -> bool {
    let descent = values.windows(2).position(|w| !(w[0] < w[1]));
    if let Some(i) = descent {
        let found = format!("{} after {}", values[i + 1], values[i]);
        findings.push(format!("{key}[{}]", i + 1), found, "ascending numbers");
    }
    descent.is_none()
}
