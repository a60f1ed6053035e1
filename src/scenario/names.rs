//! Names and lists of a file: words, unique names, known grids, ascending numbers.
//!
//! What is named is known to the callers.

use super::table::Findings;
use crate::spelling::allowed_instead;
use crate::vehicle::ModeSet;

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

/// Finds a grid that does not exist at every flight time; `None` where it does not or no set is known.
pub fn grid(findings: &mut Findings, key: &str, name: &str, sets: &[&ModeSet]) -> Option<()> {
    let missing: Vec<&&ModeSet> = sets.iter().filter(|s| s.grid(name).is_none()).collect();
    if let Some(first) = missing.first() {
        let times: Vec<String> = missing.iter().map(|s| s.flight_time_s.to_string()).collect();
        let found = format!("grid \"{name}\", missing at {} s", times.join(", "));
        let known = first.grids.iter().map(|g| g.name.as_str());
        findings.push(key, found, allowed_instead(name, known));
        return None;
    }
    (!sets.is_empty()).then_some(())
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

/// Checks the abscissae of a table in flight time: ascending, from before the first flight time to
/// after the last.
pub fn table_of_times(
    findings: &mut Findings,
    key: &str,
    time_s: &[f64],
    flight_times_s: &[f64],
) -> bool {
    let mut good = ascending(findings, &format!("{key}.time_s"), time_s);
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return false };
    let outside: Vec<&f64> =
        flight_times_s.iter().filter(|t| !(first <= *t && *t <= last)).collect();
    if good && !outside.is_empty() {
        let found = format!("tables from {first} to {last} s, without {outside:?} s");
        findings.push(format!("{key}.time_s"), found, "tables that hold every flight time");
        good = false;
    }
    good
}

/// Checks the entries of a table: `count` of them, each as `holds` says.
pub fn table_entries(
    findings: &mut Findings,
    key: &str,
    values: &[f64],
    count: usize,
    holds: impl Fn(f64) -> bool,
    allowed: &str,
) -> bool {
    let mut good = true;
    if values.len() != count {
        let found = format!("{} entries", values.len());
        findings.push(key, found, format!("{count}, as many as in `time_s`"));
        good = false;
    }
    for (i, value) in values.iter().enumerate().filter(|(_, x)| !holds(**x)) {
        findings.push(format!("{key}[{i}]"), value.to_string(), allowed);
        good = false;
    }
    good
}
