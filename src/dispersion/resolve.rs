//! Resolving: what the rows of a table mean for a vehicle, with every problem of the table.
//!
//! Raw types belong to `table`; the result is a [`Dispersion`].

use super::correlation::{Group, Offender};
use super::draw::{Dispersion, Draw, Role, Shared, name_columns};
use super::law::Law;
use super::parameter::{Domain, Parameter, Parameters, Place, Quantity, Scope};
use super::table::{Apply, Class, Common, Correlation, Row, Table};
use crate::spelling;
use crate::vehicle::{Bearing, Vehicle};
use std::collections::{BTreeMap, BTreeSet};

/// Takes a problem: key path, what was found, what is allowed.
pub type Report<'a> = &'a mut dyn FnMut(String, String, String);

/// Level at which a value is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Vehicle,
    Engine,
    Actuator,
    Tank,
    Mode,
    Sensor,
    Path,
    Filter,
}

impl Level {
    const ALL: [Self; 8] = [
        Self::Vehicle,
        Self::Engine,
        Self::Actuator,
        Self::Tank,
        Self::Mode,
        Self::Sensor,
        Self::Path,
        Self::Filter,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Vehicle => "vehicle",
            Self::Engine => "engine",
            Self::Actuator => "actuator",
            Self::Tank => "tank",
            Self::Mode => "mode",
            Self::Sensor => "sensor",
            Self::Path => "path",
            Self::Filter => "filter",
        }
    }

    /// Whether a quantity of this scope can be drawn at this level.
    fn fits(self, scope: Scope) -> bool {
        match self {
            Self::Vehicle => true,
            Self::Engine => matches!(scope, Scope::Engine | Scope::Actuator | Scope::Gimbal),
            Self::Actuator => scope == Scope::Actuator,
            Self::Tank => scope == Scope::Tank,
            Self::Mode => matches!(scope, Scope::Mode | Scope::Gimbal | Scope::SensorMode),
            Self::Sensor => matches!(scope, Scope::Sensor | Scope::SensorMode),
            Self::Path => matches!(scope, Scope::Path | Scope::Filter),
            Self::Filter => scope == Scope::Filter,
        }
    }

    /// Whether a wildcard in this place of a template is expanded to the instance.
    fn expands(self, segment: &str) -> bool {
        match segment {
            "<group>" | "<engine>" | "<sensor>" | "<path>" => self != Self::Vehicle,
            "<actuator>" => self == Self::Actuator,
            "<filter>" => self == Self::Filter,
            "<tank>" => self == Self::Tank,
            "<label>" => self == Self::Mode,
            _ => false,
        }
    }
}

/// The dispersion that `table` describes for `vehicle`.
///
/// Every problem goes to `report`; the result is only worth something if there was none.
pub fn resolve(table: &Table, vehicle: &Vehicle, report: Report) -> Dispersion {
    let parameters = Parameters::of(vehicle);
    let mut draws = commons(&table.common, report);
    let common: BTreeMap<&str, Class> =
        table.common.iter().map(|c| (c.id.as_str(), c.class)).collect();
    let mut sound = true;
    let mut owners: BTreeMap<String, usize> = BTreeMap::new();
    let mut absolutes: BTreeMap<usize, usize> = BTreeMap::new();
    // Which draw takes part in which common score, by key until the draws are in order.
    let mut shared: BTreeMap<String, (String, f64)> = BTreeMap::new();
    for (number, row) in table.row.iter().enumerate() {
        let mut at = |key: &str, found: String, allowed: String| {
            report(format!("row[{number}].{key}"), found, allowed);
        };
        let law = row.law.law().map_err(|refusal| {
            let key = format!("law.{}", refusal.argument);
            at(&key, refusal.found, refusal.allowed.into());
        });
        if row.source.trim().is_empty() {
            at("source", "an empty text".into(), "the source of the numbers".into());
        }
        if row.id.as_ref().is_some_and(|id| !is_name(id)) {
            at("id", quoted(row.id.as_deref()), NAME.into());
        }
        let shares = shares(row, &common, &mut at);
        let Some(matched) = matching(row, vehicle, &parameters, &mut at) else {
            sound = false;
            continue;
        };
        let level = level(row, &matched, vehicle, &mut at);
        let quantity = matched.quantity;
        let unit = if row.apply == Apply::Scale { "1" } else { quantity.definition().unit };
        if row.unit.as_ref().is_some_and(|u| u != unit) {
            at("unit", quoted(row.unit.as_deref()), format!("\"{unit}\""));
        }
        let targets = in_band(row, &matched, &parameters, &mut at);
        check_bearing(quantity, &targets, vehicle, &parameters, &mut at);
        if let Ok(law) = &law {
            check_values(row, law, quantity, &mut at);
        }
        let (Ok(law), Some(level)) = (law, level) else {
            sound = false;
            continue;
        };
        let mut keys: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for target in targets {
            let key = draw_key(row, level, &parameters, &parameters.all()[target]);
            keys.entry(key).or_default().push(target);
        }
        let mut clash = Clash::default();
        for (key, targets) in keys {
            if let Some(&owner) = owners.get(&key) {
                clash.same_key(owner, &key);
                continue;
            }
            for &target in targets.iter().filter(|_| row.apply == Apply::Absolute) {
                if let Some(&owner) = absolutes.get(&target) {
                    clash.both_absolute(owner, &parameters.all()[target].path);
                }
                absolutes.insert(target, number);
            }
            owners.insert(key.clone(), number);
            if let Some((id, weight)) = &shares {
                shared.insert(key.clone(), (common_key(id), *weight));
            }
            draws.push(Draw {
                key,
                column: String::new(),
                unit,
                description: quantity.definition().description,
                source: row.source.clone(),
                law: law.clone(),
                worst: row.worst,
                class: row.class,
                dimension: draws.len(),
                role: Role::Value { apply: row.apply, common: None, targets },
            });
        }
        clash.report(&table.row, row, &mut at);
    }
    draws.sort_by(|a, b| a.key.cmp(&b.key));
    let index: BTreeMap<String, usize> =
        draws.iter().enumerate().map(|(i, d)| (d.key.clone(), i)).collect();
    for draw in &mut draws {
        if let (Role::Value { common, .. }, Some((key, weight))) =
            (&mut draw.role, shared.get(&draw.key))
        {
            *common = index.get(key).map(|&draw| Shared { draw, weight: *weight });
        }
    }
    name_columns(&mut draws);
    // Keys of rows that could not be read would only seem to be unknown.
    let groups = if sound { groups(&table.correlation, &draws, report) } else { Vec::new() };
    Dispersion::new(parameters, draws, groups)
}

const NAME: &str = "letters, digits, `_` and `-`";

fn is_name(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
}

fn quoted(text: Option<&str>) -> String {
    format!("\"{}\"", text.unwrap_or_default())
}

fn common_key(id: &str) -> String {
    format!("common.{id} @ vehicle")
}

fn commons(commons: &[Common], report: Report) -> Vec<Draw> {
    let mut seen = BTreeSet::new();
    let mut draws = Vec::new();
    for (number, common) in commons.iter().enumerate() {
        if !is_name(&common.id) {
            report(format!("common[{number}].id"), quoted(Some(&common.id)), NAME.into());
        }
        if common.source.trim().is_empty() {
            let key = format!("common[{number}].source");
            report(key, "an empty text".into(), "why the rows are correlated".into());
        }
        if !seen.insert(&common.id) {
            let found = format!("\"{}\" a second time", common.id);
            report(format!("common[{number}].id"), found, "an id of its own".into());
            continue;
        }
        draws.push(Draw {
            key: common_key(&common.id),
            column: String::new(),
            unit: "1",
            description: "common normal score",
            source: common.source.clone(),
            law: Law::standard_normal(),
            worst: None,
            class: common.class,
            dimension: draws.len(),
            role: Role::Common,
        });
    }
    draws
}

/// The common score in which a row takes part, and its weight.
fn shares(
    row: &Row,
    common: &BTreeMap<&str, Class>,
    at: &mut dyn FnMut(&str, String, String),
) -> Option<(String, f64)> {
    match (&row.common, row.common_weight) {
        (None, None) => None,
        (Some(id), Some(weight)) => {
            let Some(class) = common.get(id.as_str()) else {
                let declared = spelling::allowed_instead(id, common.keys().copied());
                at("common", quoted(Some(id)), format!("the id of a [[common]]: {declared}"));
                return None;
            };
            if *class != row.class {
                let found = format!("{:?}, the common score being {class:?}", row.class);
                at("class", found, "the class of the common score".into());
            }
            if !(weight > 0.0 && weight <= 1.0) {
                at("common_weight", weight.to_string(), "above 0, at most 1".into());
            }
            Some((id.clone(), weight))
        }
        (Some(_), None) => {
            at("common_weight", "nothing".into(), "the weight of the common score".into());
            None
        }
        (None, Some(_)) => {
            at("common", "nothing".into(), "the id of the common score weighed".into());
            None
        }
    }
}

/// The groups of correlated draws that a table's matrices say.
fn groups(correlations: &[Correlation], draws: &[Draw], report: Report) -> Vec<Group> {
    let mut owners: BTreeMap<usize, usize> = BTreeMap::new();
    let mut groups = Vec::new();
    for (number, correlation) in correlations.iter().enumerate() {
        let mut sound = true;
        let mut at = |key: &str, found: String, allowed: &str| {
            sound = false;
            report(format!("correlation[{number}].{key}"), found, allowed.into());
        };
        if correlation.source.trim().is_empty() {
            at("source", "an empty text".into(), "the source of the numbers");
        }
        let mut members = Vec::new();
        for (i, key) in correlation.keys.iter().enumerate() {
            let place = format!("keys[{i}]");
            let Ok(index) = draws.binary_search_by(|d| d.key.as_str().cmp(key)) else {
                let known = draws.iter().map(|d| d.key.as_str());
                at(&place, quoted(Some(key)), &spelling::allowed_instead(key, known));
                continue;
            };
            let found = match &draws[index] {
                Draw { role: Role::Common, .. } => Some("a common score"),
                Draw { role: Role::Value { common: Some(_), .. }, .. } => {
                    Some("a key that takes part in a common score")
                }
                Draw { law, .. } if !law.is_continuous() => Some("a key of single values"),
                Draw { class, .. }
                    if members.first().is_some_and(|m: &usize| draws[*m].class != *class) =>
                {
                    Some("a key of another class")
                }
                _ => None,
            };
            if let Some(found) = found {
                let allowed = "keys of one class with continuous laws and no common score";
                at(&place, format!("\"{key}\", {found}"), allowed);
            }
            if let Some(owner) = owners.insert(index, number) {
                let found = format!("\"{key}\", which correlation[{owner}] has too");
                at(&place, found, "each key once");
            }
            members.push(index);
        }
        let size = correlation.keys.len();
        let square = correlation.matrix.len() == size
            && correlation.matrix.iter().all(|row| row.len() == size);
        if !square {
            let rows = correlation.matrix.len();
            let found = format!("{rows} rows for {size} keys, or rows of another length");
            at("matrix", found, "as many rows, and numbers in each, as keys");
            continue;
        }
        for (i, row) in correlation.matrix.iter().enumerate() {
            for (j, r) in row.iter().enumerate() {
                let (mirror, place) = (correlation.matrix[j][i], format!("matrix[{i}][{j}]"));
                if i == j && *r != 1.0 {
                    at(&place, r.to_string(), "1, on the diagonal");
                } else if i != j && !(r.abs() < 1.0) {
                    at(&place, r.to_string(), "above −1 and below 1");
                } else if j > i && *r != mirror {
                    at(
                        &place,
                        format!("{r}, and {mirror} across"),
                        "the same number on both sides",
                    );
                }
            }
        }
        if !sound || members.len() != size {
            continue;
        }
        match Group::new(members, correlation.kind, &correlation.matrix) {
            Ok(group) => groups.push(group),
            Err(Offender { pair: [i, j], allowed: [low, high], together }) => {
                let keys = &correlation.keys;
                let found = format!(
                    "{} between `{}` and `{}`: the matrix is not positive definite (already for the \
                     keys number {together:?})",
                    correlation.matrix[i][j], keys[i], keys[j]
                );
                let allowed = format!("for this pair, the others as they are, {low} < r < {high}");
                report(format!("correlation[{number}].matrix[{i}][{j}]"), found, allowed);
            }
        }
    }
    groups
}

/// The parameters that a row's path names, all of one quantity.
struct Matched {
    quantity: Quantity,
    targets: Vec<usize>,
}

fn segments_match(pattern: &str, template: &str, path: &str) -> bool {
    let count = |text: &str| text.split('.').count();
    count(pattern) == count(path)
        && pattern
            .split('.')
            .zip(template.split('.'))
            .zip(path.split('.'))
            .all(|((p, t), name)| p == name || (p == "*" && t.starts_with('<')))
}

fn matching(
    row: &Row,
    vehicle: &Vehicle,
    parameters: &Parameters,
    at: &mut dyn FnMut(&str, String, String),
) -> Option<Matched> {
    let all = parameters.all();
    let named: Vec<usize> = (0..all.len())
        .filter(|&i| segments_match(&row.path, all[i].quantity.definition().path, &all[i].path))
        .collect();
    let targets: Vec<usize> = named.iter().copied().filter(|&i| all[i].exists).collect();
    let Some(&first) = targets.first() else {
        if let Some(&absent) = named.first() {
            let description = all[absent].quantity.definition().description;
            let allowed = format!("a part of the vehicle that has one ({description})");
            at("path", format!("\"{}\", which no part has", row.path), allowed);
        } else {
            at("path", quoted(Some(&row.path)), alternatives(&row.path, vehicle, parameters));
        }
        return None;
    };
    Some(Matched { quantity: all[first].quantity, targets })
}

/// Near misses of a path that matches nothing, and all templates.
fn alternatives(path: &str, vehicle: &Vehicle, parameters: &Parameters) -> String {
    /// Beyond this length a path is no slip of the keyboard, and comparing it would take long.
    const LONGEST: usize = 200;
    const SHOWN: usize = 3;
    let groups: BTreeSet<&str> = vehicle.engines.iter().map(|e| e.group.as_str()).collect();
    let mut candidates: BTreeSet<String> =
        parameters.all().iter().filter(|p| p.exists).map(|p| p.path.clone()).collect();
    for definition in Quantity::ALL.iter().map(|q| q.definition()) {
        let wild =
            ["<engine>", "<actuator>", "<label>", "<sensor>", "<path>", "<filter>", "<tank>"]
                .iter()
                .fold(definition.path.to_string(), |path, segment| path.replace(segment, "*"));
        candidates.extend(groups.iter().map(|group| wild.replace("<group>", group)));
    }
    let mut near = Vec::new();
    while near.len() < SHOWN && path.len() <= LONGEST {
        let Some(next) = spelling::nearest(path, candidates.iter().map(String::as_str)) else {
            break;
        };
        near.push(format!("`{next}`"));
        let next = next.to_string();
        candidates.remove(&next);
    }
    let held = |quantity: &Quantity| {
        parameters.all().iter().any(|parameter| parameter.exists && parameter.quantity == *quantity)
    };
    let templates: Vec<&str> =
        Quantity::ALL.iter().filter(|q| held(q)).map(|q| q.definition().path).collect();
    let asked = match near.as_slice() {
        [] => String::new(),
        near => format!("did you mean {}? ", near.join(" or ")),
    };
    format!("{asked}A path of this vehicle, `*` for any name: {}", templates.join(", "))
}

fn level(
    row: &Row,
    matched: &Matched,
    vehicle: &Vehicle,
    at: &mut dyn FnMut(&str, String, String),
) -> Option<Level> {
    let definition = matched.quantity.definition();
    let named = Level::ALL.into_iter().find(|level| level.name() == row.level);
    // The group's own name says `engine` for a path that starts with it.
    let group = row.path.split('.').next().is_some_and(|group| group == row.level)
        && definition.path.starts_with("<group>");
    let level = named.or(group.then_some(Level::Engine)).filter(|l| l.fits(definition.scope));
    if level.is_none() {
        let fitting = Level::ALL.into_iter().filter(|l| l.fits(definition.scope));
        let mut allowed: Vec<String> = fitting.map(|l| format!("\"{}\"", l.name())).collect();
        let own = vehicle.engines.iter().find(|e| row.path.starts_with(&format!("{}.", e.group)));
        if let (Some(engine), true) = (own, Level::Engine.fits(definition.scope)) {
            allowed.push(format!("\"{}\" (for \"engine\")", engine.group));
        }
        at("level", quoted(Some(&row.level)), format!("for this path {}", allowed.join(", ")));
    }
    level
}

/// The targets of a row whose modes lie in its band.
fn in_band(
    row: &Row,
    matched: &Matched,
    parameters: &Parameters,
    at: &mut dyn FnMut(&str, String, String),
) -> Vec<usize> {
    let Some([low, high]) = row.band_hz else { return matched.targets.clone() };
    let scope = matched.quantity.definition().scope;
    if !matches!(scope, Scope::Mode | Scope::Gimbal | Scope::SensorMode) {
        at("band_hz", format!("[{low}, {high}]"), "no band: the path has no modal label".into());
        return matched.targets.clone();
    }
    if !(low >= 0.0 && low < high) {
        at("band_hz", format!("[{low}, {high}]"), "0 ≤ low < high".into());
        return matched.targets.clone();
    }
    let frequency = |target: usize| {
        parameters.all()[target].place.label().map(|label| parameters.band_frequency_hz(label))
    };
    let inside = |target: &usize| frequency(*target).is_some_and(|f| low <= f && f < high);
    let targets: Vec<usize> = matched.targets.iter().copied().filter(inside).collect();
    if targets.is_empty() {
        let (least, most) = matched
            .targets
            .iter()
            .filter_map(|&target| frequency(target))
            .fold((f64::INFINITY, 0.0_f64), |(a, b), f| (a.min(f), b.max(f)));
        let allowed = format!("a band with a mode; those of the path are {least} to {most} Hz");
        at("band_hz", format!("[{low}, {high}], in which no mode lies"), allowed);
    }
    targets
}

/// A flex bearing inside the actuator stiffness has no stiffness of its own to disperse.
fn check_bearing(
    quantity: Quantity,
    targets: &[usize],
    vehicle: &Vehicle,
    parameters: &Parameters,
    at: &mut dyn FnMut(&str, String, String),
) {
    if !matches!(quantity, Quantity::BearingStiffness | Quantity::BearingDamping) {
        return;
    }
    let included: Vec<&str> = targets
        .iter()
        .map(|&target| &parameters.all()[target])
        .filter(|parameter| match parameter.place {
            Place::Engine(e) => {
                let mut pairs = vehicle.engines[e].sets();
                pairs.all(|(_, pair)| pair.iter().all(|a| a.bearing == Bearing::Included))
            }
            _ => false,
        })
        .map(|parameter| parameter.path.as_str())
        .collect();
    if !included.is_empty() {
        let allowed = "bearings of engines with an actuator whose bearing is \"separate\"; \
                       an included one is part of the actuator's stiffness and damping";
        at("path", format!("the included bearing of {}", included.join(", ")), allowed.into());
    }
}

/// Values that are sure to be impossible: unbounded laws may still draw one, which is then a
/// failed case.
fn check_values(
    row: &Row,
    law: &Law,
    quantity: Quantity,
    at: &mut dyn FnMut(&str, String, String),
) {
    let domain = match row.apply {
        Apply::Absolute | Apply::Scale => quantity.definition().domain,
        Apply::Offset => Domain::Any,
    };
    let words = domain.words();
    let [low, high] = law.support();
    let impossible = domain != Domain::Any && low.is_finite() && low < 0.0
        || domain == Domain::Positive && high <= 0.0;
    if impossible {
        at("law", format!("values from {low} to {high}"), words.into());
    }
    let Some([low, high]) = row.worst else { return };
    // Both are finite, as every number that was read.
    if low > high {
        at("worst", format!("[{low}, {high}]"), "[low, high] in this order".into());
    }
    for (i, value) in [low, high].into_iter().enumerate().filter(|(_, v)| !domain.contains(*v)) {
        at(&format!("worst[{i}]"), value.to_string(), words.into());
    }
}

/// `instance path @ level # id`: names up to the level, what the row says beyond it. At mode
/// level the label is the one under which the mode draws, so that descendants share.
fn draw_key(row: &Row, level: Level, parameters: &Parameters, target: &Parameter) -> String {
    let template = target.quantity.definition().path;
    let label = target.place.label().map_or("", |label| parameters.draw_label(label));
    let segments: Vec<&str> = template
        .split('.')
        .zip(row.path.split('.'))
        .zip(target.path.split('.'))
        .map(|((segment, written), name)| match segment {
            _ if !level.expands(segment) => written,
            "<label>" => label,
            _ => name,
        })
        .collect();
    let id = row.id.as_ref().map_or(String::new(), |id| format!(" # {id}"));
    format!("{} @ {}{id}", segments.join("."), level.name())
}

/// Draws of one row that clash with those of earlier rows: the first example per row.
#[derive(Default)]
struct Clash {
    keys: BTreeMap<usize, (String, usize)>,
    absolutes: BTreeMap<usize, (String, usize)>,
}

impl Clash {
    fn same_key(&mut self, owner: usize, key: &str) {
        self.keys.entry(owner).or_insert((key.into(), 0)).1 += 1;
    }

    fn both_absolute(&mut self, owner: usize, path: &str) {
        self.absolutes.entry(owner).or_insert((path.into(), 0)).1 += 1;
    }

    fn report(self, rows: &[Row], row: &Row, at: &mut dyn FnMut(&str, String, String)) {
        let more = |count: usize| match count {
            1 => String::new(),
            n => format!(" and {} more", n - 1),
        };
        for (owner, (key, count)) in self.keys {
            let found = format!(
                "`{}`, which draws under the key `{key}`{}, as row[{owner}] (`{}`) does",
                row.path,
                more(count),
                rows[owner].path
            );
            at("path", found, "keys of its own: give one of the two rows an `id`".into());
        }
        for (owner, (path, count)) in self.absolutes {
            let found = format!(
                "`{}`, a second absolute value for `{path}`{} beside row[{owner}] (`{}`)",
                row.path,
                more(count),
                rows[owner].path
            );
            at("apply", found, "one absolute row a parameter; others scale or offset".into());
        }
    }
}

#[cfg(test)]
mod tests;
