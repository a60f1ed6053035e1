//! Choice of the nodes from which each grid of the package is made.
//!
//! How their motion becomes that of the grid is `import::section`.

use super::super::import_file::{CentrelineFile, GridFile, ImportFile, Role, SectionFile};
use super::super::names;
use super::super::table::Findings;
use crate::import::model::Mode;
use crate::import::{Model, Section};
use crate::spelling::allowed_instead;
use crate::vehicle::Grid;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// A grid of the package and the nodes that it is made from.
#[derive(Debug)]
pub(super) struct Choice {
    pub(super) name: String,
    /// What it is made from, for people.
    pub(super) from: String,
    /// The node that gives the translation, and the rotation where there is no section.
    node: Option<usize>,
    /// The nodes that give the rotation, and the translation where there is no node.
    pub(super) section: Option<Section>,
}

impl Choice {
    /// Translation and rotation in a mode, in the scale of the file.
    pub(super) fn motion(&self, mode: &Mode, rounding: f64) -> (Vector3<f64>, Vector3<f64>) {
        let fit = self.section.as_ref().map(|s| s.fit(&mode.shape, rounding));
        match (self.node, fit) {
            (Some(node), Some(fit)) => (mode.shape[node], fit.slope),
            (Some(node), None) => (mode.shape[node], mode.slope[node]),
            (None, Some(fit)) => (fit.shape, fit.slope),
            (None, None) => unreachable!("a choice has a node or a section"),
        }
    }

    fn nodes(&self) -> impl Iterator<Item = usize> {
        let section = self.section.iter().flat_map(|s| s.nodes.iter().copied());
        // A node that has its own mass does not take that of the nodes that give its rotation.
        let section = section.filter(|_| self.node.is_none());
        self.node.into_iter().chain(section)
    }
}

/// Role of each grid that has one, by name.
pub(super) fn roles(file: &ImportFile) -> BTreeMap<String, &'static str> {
    let single = file.grid.iter().filter_map(|g| Some((g.name.clone(), g.role?.word())));
    let rows = file.centreline.iter().flat_map(|line| {
        let role = line.role.unwrap_or(Role::Centreline).word();
        names_of(line).into_iter().map(move |name| (name, role))
    });
    single.chain(rows).collect()
}

/// Stations of a line, m from its start.
fn stations(line: &CentrelineFile) -> Vec<f64> {
    let length = (Vector3::from(line.to_m) - Vector3::from(line.from_m)).norm();
    match (&line.stations_m, line.stations) {
        (Some(given), _) => given.clone(),
        (None, Some(n)) => (0..n).map(|i| length * i as f64 / (n.max(2) - 1) as f64).collect(),
        (None, None) => Vec::new(),
    }
}

fn names_of(line: &CentrelineFile) -> Vec<String> {
    let count = stations(line).len();
    let width = count.to_string().len().max(2);
    (1..=count).map(|i| format!("{}.{i:0width$}", line.name)).collect()
}

/// Checks what can be told without results; whether names and choices hold.
pub(super) fn check(file: &ImportFile, findings: &mut Findings) -> bool {
    let mut sound = true;
    let mut refuse = |key: String, found: String, allowed: &str| {
        findings.push(key, found, allowed);
        sound = false;
    };
    if file.grid.is_empty() && file.centreline.is_empty() {
        refuse("grid".into(), "none".into(), "[[grid]] or [[centreline]]");
    }
    let mut seen = BTreeSet::new();
    let singles = file
        .grid
        .iter()
        .enumerate()
        .map(|(i, g)| (format!("grid[{i}].name"), vec![g.name.clone()]));
    let rows = file.centreline.iter().enumerate();
    let rows = rows.map(|(i, line)| (format!("centreline[{i}].name"), names_of(line)));
    for (key, names) in singles.chain(rows) {
        for name in names {
            if !name.split('.').all(names::is_word) {
                refuse(
                    key.clone(),
                    format!("\"{name}\""),
                    "words of a–z, 0–9 and _, with dots between",
                );
                break;
            }
            if !seen.insert(name.clone()) {
                refuse(key.clone(), format!("\"{name}\" again"), "a name for each grid");
                break;
            }
        }
    }
    for (i, grid) in file.grid.iter().enumerate() {
        let key = format!("grid[{i}]");
        let ways = [grid.node.is_some(), grid.set.is_some(), grid.nearest_m.is_some()];
        let ways = ways.iter().filter(|way| **way).count();
        if ways > 1 || (ways == 0 && grid.section.is_none()) {
            let allowed = "exactly one of `node`, `set` and `nearest_m`, or a `section` alone";
            refuse(key.clone(), format!("{ways} of them"), allowed);
        }
        if grid.nearest_m.is_some() != grid.within_m.is_some() {
            let allowed = "`nearest_m` and `within_m` together";
            refuse(key.clone(), "one without the other".into(), allowed);
        }
        if let Some(section) = &grid.section {
            check_section(section, ways > 0, &format!("{key}.section"), &mut refuse);
        }
    }
    for (i, line) in file.centreline.iter().enumerate() {
        let key = format!("centreline[{i}]");
        if !(Vector3::from(line.to_m) - Vector3::from(line.from_m)).norm().is_normal() {
            refuse(key.clone(), "a line without length".into(), "two different ends");
        }
        if line.stations.is_some() == line.stations_m.is_some() {
            let allowed = "exactly one of `stations` and `stations_m`";
            refuse(key.clone(), "both or neither".into(), allowed);
        }
        if let Some(stations) = &line.stations_m
            && (stations.is_empty() || !stations.windows(2).all(|w| w[0] < w[1]))
        {
            refuse(format!("{key}.stations_m"), format!("{stations:?}"), "ascending distances");
        }
        if !(0.0 <= line.radius_m[0] && line.radius_m[0] < line.radius_m[1]) {
            let found = format!("{:?}", line.radius_m);
            refuse(format!("{key}.radius_m"), found, "least and greatest distance, from 0 up");
        }
    }
    sound
}

fn check_section(
    section: &SectionFile,
    with_node: bool,
    key: &str,
    refuse: &mut impl FnMut(String, String, &str),
) {
    let ways = [section.nodes.is_some(), section.set.is_some(), section.near_m.is_some()];
    if ways.iter().filter(|way| **way).count() != 1 {
        let allowed = "exactly one of `nodes`, `set` and `near_m`";
        refuse(key.into(), "another number of them".into(), allowed);
    }
    if section.near_m.is_some() != section.radius_m.is_some() {
        let allowed = "`near_m` and `radius_m` together";
        refuse(key.into(), "one without the other".into(), allowed);
    }
    let listed = section.nodes.as_ref().map_or(0, Vec::len);
    if !section.weights.is_empty() && section.weights.len() != listed {
        let found = format!("{} weights for {listed} listed nodes", section.weights.len());
        refuse(format!("{key}.weights"), found, "one for each of `nodes`, or none");
    }
    if let Some(node) = section.nodes.as_ref().and_then(|nodes| {
        let mut seen = BTreeSet::new();
        nodes.iter().find(|node| !seen.insert(**node))
    }) {
        refuse(format!("{key}.nodes"), format!("node {node} again"), "each node once");
    }
    if with_node && section.at_m.is_some() {
        let allowed = "`at_m` only where the grid names no node";
        refuse(format!("{key}.at_m"), "a point beside the node of the grid".into(), allowed);
    }
}

/// Receives a problem: key, found, allowed.
type Refuse<'a> = dyn FnMut(String, String, &str) + 'a;

/// The grids of the package on the nodes of `model`; `None` if any cannot be made, after all
/// problems were told.
pub(super) fn choose(
    file: &ImportFile,
    model: &Model,
    mut refuse: impl FnMut(String, String, &str),
) -> Option<Vec<Choice>> {
    let refuse: &mut Refuse<'_> = &mut refuse;
    let singles = file.grid.iter().enumerate();
    let mut made: Vec<Option<Choice>> =
        singles.map(|(i, grid)| single(grid, &format!("grid[{i}]"), model, refuse)).collect();
    for (i, line) in file.centreline.iter().enumerate() {
        row(line, &format!("centreline[{i}]"), model, refuse, &mut made);
    }
    made.into_iter().collect()
}

/// Place of a node that carries results.
fn node(id: i64, key: &str, model: &Model, refuse: &mut Refuse<'_>) -> Option<usize> {
    let place = model.place(id);
    if place.is_none() {
        let found = if model.bare.binary_search(&id).is_ok() {
            format!("node {id}, which carries no results")
        } else {
            format!("node {id}, which is not in the files")
        };
        let allowed = "a node with results: ask the program to write displacements of this node";
        refuse(key.into(), found, allowed);
    }
    place
}

/// Places of the nodes of a named set.
fn set(name: &str, key: &str, model: &Model, refuse: &mut Refuse<'_>) -> Option<Vec<usize>> {
    let Some(ids) = model.sets.get(name) else {
        let known = model.sets.keys().map(String::as_str);
        refuse(key.into(), format!("set \"{name}\""), &allowed_instead(name, known));
        return None;
    };
    let places: Vec<usize> = ids.iter().filter_map(|&id| model.place(id)).collect();
    if places.len() != ids.len() {
        let found =
            format!("set \"{name}\", of whose {} nodes {} carry results", ids.len(), places.len());
        refuse(key.into(), found, "results at every node of the set");
        return None;
    }
    Some(places)
}

fn single(grid: &GridFile, key: &str, model: &Model, refuse: &mut Refuse<'_>) -> Option<Choice> {
    let mut from = Vec::new();
    let named = grid.node.is_some() || grid.set.is_some() || grid.nearest_m.is_some();
    let place = if let Some(id) = grid.node {
        node(id, &format!("{key}.node"), model, refuse)
    } else if let Some(name) = &grid.set {
        let key = format!("{key}.set");
        set(name, &key, model, refuse).and_then(|places| match places.as_slice() {
            [only] => Some(*only),
            several => {
                let found = format!("set \"{name}\" of {} nodes", several.len());
                refuse(key, found, "a set of one node, or `section = { set = … }`");
                None
            }
        })
    } else if let (Some(point), Some(within)) = (grid.nearest_m, grid.within_m) {
        model.nearest(&Vector3::from(point)).and_then(|(place, distance)| {
            if !(distance <= within) {
                let found = format!(
                    "node {} as the nearest, {distance:.4} m from {point:?}",
                    model.ids[place]
                );
                refuse(format!("{key}.nearest_m"), found, &format!("a node within {within} m"));
                return None;
            }
            from.push(format!("{distance:.4} m away"));
            Some(place)
        })
    } else {
        None
    };
    if let Some(place) = place {
        from.insert(0, format!("node {}", model.ids[place]));
    }
    let at = place.map(|place| model.positions_m[place]);
    let section = grid.section.as_ref();
    let made =
        section.map(|raw| section_of(raw, at, &format!("{key}.section"), model, refuse, &mut from));
    let place = if named { Some(place?) } else { None };
    let section = match made {
        Some(section) => Some(section?),
        None => None,
    };
    let slopeless = section.is_none() && place.is_some_and(|place| !model.turns[place]);
    if slopeless && grid.role == Some(Role::Actuator) {
        from.push("no rotation, slope zero".to_owned());
    } else if slopeless {
        let found = format!(
            "node {}, whose rotations are zero in every mode",
            place.map_or(0, |place| model.ids[place])
        );
        let allowed = "a `section` whose motion gives the rotation (solid elements have none), or \
                       role = \"actuator\", which needs none";
        refuse(key.into(), found, allowed);
        return None;
    }
    Some(Choice { name: grid.name.clone(), from: from.join(", "), node: place, section })
}

fn section_of(
    raw: &SectionFile,
    at: Option<Vector3<f64>>,
    key: &str,
    model: &Model,
    refuse: &mut Refuse<'_>,
    from: &mut Vec<String>,
) -> Option<Section> {
    let (places, key) = if let Some(ids) = &raw.nodes {
        let key = format!("{key}.nodes");
        // Every node is asked for, so that all that are missing are told.
        let found: Vec<_> = ids.iter().map(|&id| node(id, &key, model, refuse)).collect();
        (found.into_iter().collect::<Option<Vec<_>>>()?, key)
    } else if let Some(name) = &raw.set {
        let key = format!("{key}.set");
        (set(name, &key, model, refuse)?, key)
    } else {
        let (near, radius) = (Vector3::from(raw.near_m?), raw.radius_m?);
        let places = (0..model.ids.len())
            .filter(|&i| (model.positions_m[i] - near).norm() <= radius)
            .collect();
        (places, format!("{key}.near_m"))
    };
    let at = at.or(raw.at_m.map(Vector3::from));
    let made = Section::new(places, &model.positions_m, &raw.weights, at);
    match made {
        Ok(section) => {
            from.push(format!("section of {} nodes", section.nodes.len()));
            Some(section)
        }
        Err(fault) => {
            refuse(key, fault.to_string(), "three nodes or more, not on one line");
            None
        }
    }
}

fn row(
    line: &CentrelineFile,
    key: &str,
    model: &Model,
    refuse: &mut Refuse<'_>,
    made: &mut Vec<Option<Choice>>,
) {
    let (start, end) = (Vector3::from(line.from_m), Vector3::from(line.to_m));
    let axis = (end - start).normalize();
    let only = match &line.set {
        None => None,
        Some(name) => match set(name, &format!("{key}.set"), model, refuse) {
            Some(places) => Some(places.into_iter().collect::<BTreeSet<usize>>()),
            None => {
                made.push(None);
                return;
            }
        },
    };
    // Nodes near the line by their station, so that each slice is a range.
    let mut near: Vec<(f64, usize)> = (0..model.ids.len())
        .filter(|place| only.as_ref().is_none_or(|only| only.contains(place)))
        .filter_map(|place| {
            let arm = model.positions_m[place] - start;
            let along = arm.dot(&axis);
            let radius = (arm - axis * along).norm();
            (line.radius_m[0] <= radius && radius <= line.radius_m[1]).then_some((along, place))
        })
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (station, name) in stations(line).into_iter().zip(names_of(line)) {
        let (low, high) = (station - line.slice_m / 2.0, station + line.slice_m / 2.0);
        let slice = near.partition_point(|n| n.0 < low)..near.partition_point(|n| n.0 <= high);
        let places: Vec<usize> = near[slice].iter().map(|n| n.1).collect();
        let at = start + axis * station;
        match Section::new(places, &model.positions_m, &[], Some(at)) {
            Ok(section) => made.push(Some(Choice {
                name,
                from: format!("section of {} nodes", section.nodes.len()),
                node: None,
                section: Some(section),
            })),
            Err(fault) => {
                let found = format!("{fault} in the slice of `{name}` at {station} m");
                let allowed = "three nodes or more in each slice, not on one line";
                refuse(key.into(), found, allowed);
                made.push(None);
            }
        }
    }
}

/// The grids of the package with the lumped masses of their nodes; a node counts once.
pub(super) fn package_grids(choices: &[Choice], model: &Model) -> Vec<Grid> {
    let mut taken = BTreeSet::new();
    let grid = |choice: &Choice| {
        let position_m = match (choice.node, &choice.section) {
            (Some(node), _) => model.positions_m[node],
            (None, Some(section)) => section.at_m,
            (None, None) => unreachable!("a choice has a node or a section"),
        };
        let (mut mass_kg, mut inertia) = (0.0, Vector3::zeros());
        for node in choice.nodes() {
            let Some(lumps) = model.lumps.as_ref().filter(|_| taken.insert(node)) else { continue };
            let (lump, arm) = (&lumps[node], model.positions_m[node] - position_m);
            mass_kg += lump.mass_kg;
            let squares = arm.component_mul(&arm);
            let across = Vector3::repeat(squares.sum()) - squares;
            inertia += lump.inertia_kg_m2.diagonal() + across * lump.mass_kg;
        }
        Grid {
            name: choice.name.clone(),
            position_m,
            mass_kg: Vector3::repeat(mass_kg),
            inertia_kg_m2: inertia,
        }
    };
    choices.iter().map(grid).collect()
}
