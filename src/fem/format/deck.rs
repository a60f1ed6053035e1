//! Nastran bulk data deck: `GRID`, `GRDSET` and the `CORD1x`, `CORD2x` coordinate systems.
//!
//! Nothing else of the deck is read; files that it includes are named, not followed.

use super::lines::{lines, real};
use crate::fem::results::{Node, Point, Precision, Results, System, SystemKind};
use crate::problem::Problems;

const SYSTEMS: [(&str, SystemKind, bool); 6] = [
    ("CORD1R", SystemKind::Rectangular, true),
    ("CORD1C", SystemKind::Cylindrical, true),
    ("CORD1S", SystemKind::Spherical, true),
    ("CORD2R", SystemKind::Rectangular, false),
    ("CORD2C", SystemKind::Cylindrical, false),
    ("CORD2S", SystemKind::Spherical, false),
];

/// A system that a grid leaves to `GRDSET`.
const BLANK: i64 = i64::MIN;

/// Problems told before the reader gives up.
const MOST_PROBLEMS: usize = 20;

pub(super) fn recognised(bytes: &[u8]) -> bool {
    lines(bytes).any(|(_, line)| {
        let words = line.trim_start().to_ascii_uppercase();
        words.starts_with("BEGIN BULK")
            || ["GRID", "CORD1", "CORD2"].iter().any(|card| {
                words.strip_prefix(card).is_some_and(|rest| {
                    rest.starts_with([' ', ',', '*', '\t', 'R', 'C', 'S'])
                        && rest.bytes().any(|b| b.is_ascii_digit())
                })
            })
    })
}

/// One card with its continuations: the name without `*` and the fields after it.
struct Card {
    line: usize,
    name: String,
    fields: Vec<String>,
}

impl Card {
    fn field(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }
}

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let mut results = Results::empty("Nastran bulk data deck", Precision::Text { digits: 0 });
    let mut problems = Problems::default();
    // Systems that a grid leaves blank until the whole deck is read: GRDSET may come later.
    let mut grids: Vec<Node> = Vec::new();
    let mut default_systems = [0, 0];
    let mut card: Option<Card> = None;
    let mut wanted = |card: Card, results: &mut Results, problems: &mut Problems| {
        if problems.0.len() >= MOST_PROBLEMS {
        } else if card.name == "GRDSET" {
            default_systems = [1, 5].map(|k| integer(&card, k, 0, name, problems));
        } else if card.name == "GRID" {
            grids.extend(grid(&card, name, problems));
        } else {
            system(&card, name, results, problems);
        }
    };
    // A file that is included has no BEGIN BULK.
    let mut bulk = !lines(bytes).any(|(_, line)| begins_bulk(&line).is_some());
    let mut skipped_super = false;
    for (number, line) in lines(bytes) {
        let line = line.split('$').next().unwrap_or("");
        if let Some(of_superelement) = begins_bulk(line) {
            bulk = !of_superelement;
            skipped_super |= of_superelement;
            continue;
        }
        let start = line.trim_start();
        if start.get(..7).is_some_and(|word| word.eq_ignore_ascii_case("INCLUDE")) {
            let file = start[7..].trim().trim_matches(['\'', '"']);
            let what = format!("line {number} includes {file}, which is not followed");
            results.warnings.push(format!("{what}: give that file too if it holds grids"));
            continue;
        }
        if !bulk || line.trim().is_empty() {
            continue;
        }
        if start.get(..7).is_some_and(|word| word.eq_ignore_ascii_case("ENDDATA")) {
            break;
        }
        let (first, fields) = split(line);
        if first.is_empty() || first.starts_with(['+', '*']) {
            if let Some(card) = &mut card
                && card.fields.len() < 24
            {
                card.fields.extend(fields);
            }
            continue;
        }
        if let Some(card) = card.take() {
            wanted(card, &mut results, &mut problems);
        }
        if first.starts_with('=') {
            problems.extend(Problems::input(
                name,
                format!("line {number}"),
                "a replicated card (=)",
                "cards written out in full",
            ));
            break;
        }
        let first = first.trim_end_matches('*').trim_end();
        let known = ["GRID", "GRDSET"].contains(&first) || SYSTEMS.iter().any(|s| s.0 == first);
        card = known.then(|| Card { line: number, name: first.to_owned(), fields });
    }
    if let Some(card) = card.take() {
        wanted(card, &mut results, &mut problems);
    }
    let mut fluid = 0;
    for mut node in grids {
        let systems = [&mut node.position_system, &mut node.displacement_system];
        for (system, default) in systems.into_iter().zip(default_systems) {
            if *system == BLANK {
                *system = default;
            }
        }
        if node.displacement_system < 0 {
            fluid += 1;
        } else {
            results.nodes.push(node);
        }
    }
    if fluid > 0 {
        results.warnings.push(format!("{fluid} fluid grids are left out"));
    }
    if skipped_super {
        results.warnings.push("the parts of superelements (BEGIN SUPER) are left out".into());
    }
    if problems.0.is_empty() && results.nodes.is_empty() && results.systems.is_empty() {
        let includes = results.warnings.join("; ");
        let found = format!("a deck without grids and coordinate systems {includes}");
        problems.extend(Problems::input(name, "", found.trim_end(), "GRID or CORD cards"));
    }
    problems.into_result(results)
}

/// Whether a line begins bulk data, and then whether that of a superelement.
fn begins_bulk(line: &str) -> Option<bool> {
    let upper = line.get(..line.len().min(72)).unwrap_or("").to_ascii_uppercase();
    let mut words = upper.split([' ', '=', '\t']).filter(|word| !word.is_empty());
    if words.next() != Some("BEGIN") {
        return None;
    }
    Some(words.any(|word| ["SUPER", "ARBMODEL", "AUXMODEL", "MASSID"].contains(&word)))
}

/// The first field in capitals and the data fields of one line: 8 or with `*` 4, fixed or free.
fn split(line: &str) -> (String, Vec<String>) {
    let (first, large) = if line.contains(',') {
        let first = line.split(',').next().unwrap_or("").trim();
        (first.to_owned(), first.contains('*'))
    } else {
        let first = line.get(..8.min(line.len())).unwrap_or("");
        // A tab ends the field early.
        let first = first.split('\t').next().unwrap_or("").trim();
        (first.to_owned(), first.contains('*'))
    };
    let count = if large { 4 } else { 8 };
    let mut fields: Vec<String> = if line.contains(',') {
        line.split(',').skip(1).take(count).map(|field| field.trim().to_owned()).collect()
    } else {
        let width = if large { 16 } else { 8 };
        let line = spread_tabs(line);
        let field = |k: usize| {
            let from = 8 + k * width;
            line.get(from..(from + width).min(line.len())).unwrap_or("").trim().to_owned()
        };
        (0..count).map(field).collect()
    };
    fields.resize(count, String::new());
    (first.to_ascii_uppercase(), fields)
}

/// Tabs move to the next multiple of eight columns.
fn spread_tabs(line: &str) -> String {
    let mut spread = String::with_capacity(line.len());
    for c in line.chars() {
        if c == '\t' {
            let to = (spread.len() / 8 + 1) * 8;
            spread.extend(std::iter::repeat_n(' ', to - spread.len()));
        } else {
            spread.push(c);
        }
    }
    spread
}

fn integer(card: &Card, index: usize, blank: i64, name: &str, problems: &mut Problems) -> i64 {
    let text = card.field(index);
    if text.is_empty() {
        return blank;
    }
    text.parse().unwrap_or_else(|_| {
        let key = format!("line {}: {} field {}", card.line, card.name, index + 2);
        problems.extend(Problems::input(name, key, format!("{text:?}"), "an integer"));
        -1
    })
}

fn number(card: &Card, index: usize, name: &str, problems: &mut Problems) -> f64 {
    let text = card.field(index);
    if text.is_empty() {
        return 0.0;
    }
    real(text).unwrap_or_else(|| {
        let key = format!("line {}: {} field {}", card.line, card.name, index + 2);
        problems.extend(Problems::input(name, key, format!("{text:?}"), "a number"));
        0.0
    })
}

fn grid(card: &Card, name: &str, problems: &mut Problems) -> Option<Node> {
    let node = Node {
        id: integer(card, 0, -1, name, problems),
        position_system: integer(card, 1, BLANK, name, problems),
        position: [2, 3, 4].map(|k| number(card, k, name, problems)),
        displacement_system: integer(card, 5, BLANK, name, problems),
    };
    let good = node.id > 0 && (node.position_system >= 0 || node.position_system == BLANK);
    if !good {
        let key = format!("line {}", card.line);
        let found = format!("GRID {:?} in system {:?}", card.field(0), card.field(1));
        problems.extend(Problems::input(name, key, found, "a positive id"));
    }
    good.then_some(node)
}

fn system(card: &Card, name: &str, results: &mut Results, problems: &mut Problems) {
    let Some((_, kind, by_nodes)) = SYSTEMS.iter().find(|system| system.0 == card.name) else {
        return;
    };
    let mut add = |id: i64, [a, b, c]: [Point; 3], problems: &mut Problems| {
        let system = System { id, kind: *kind, a, b, c };
        if results.systems.insert(id, system).is_some_and(|known| known != system) {
            let key = format!("line {}", card.line);
            let found = format!("a second coordinate system {id}");
            problems.extend(Problems::input(name, key, found, "one definition"));
        }
    };
    if *by_nodes {
        for from in [0, 4] {
            if !card.field(from).is_empty() {
                let mut at = |k| integer(card, from + k, -1, name, problems);
                let (id, nodes) = (at(0), [at(1), at(2), at(3)]);
                add(id, nodes.map(Point::Node), problems);
            }
        }
    } else {
        if card.fields.len() < 11 || card.fields[8..11].iter().all(String::is_empty) {
            let key = format!("line {}", card.line);
            let found = format!("{} {} without its continuation", card.name, card.field(0));
            let allowed = "the third point on the line that follows";
            problems.extend(Problems::input(name, key, found, allowed));
        }
        let id = integer(card, 0, -1, name, problems);
        let reference = integer(card, 1, 0, name, problems);
        let mut point = |from: usize| Point::Given {
            reference,
            position: [0, 1, 2].map(|k| number(card, from + k, name, problems)),
        };
        let points = [point(2), point(5), point(8)];
        add(id, points, problems);
    }
}
