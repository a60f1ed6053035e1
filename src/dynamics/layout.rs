//! The layout of a model: which coordinate has which number and name.
//!
//! The only place where a coordinate has a number; it knows no values.

use std::ops::Range;

/// Names of the six rigid-body coordinates, axes of the structural frame.
const RIGID: [&str; 6] = ["xi.x", "xi.y", "xi.z", "theta.x", "theta.y", "theta.z"];

/// What a coordinate describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Rigid translation and rotation of the vehicle.
    RigidBody,
    /// Elastic coordinates of the body.
    Structure,
    /// Gimbal rotations.
    Nozzle,
    /// Slosh-mass displacements.
    Slosh,
    /// States of actuators and autopilot.
    Servo,
}

/// Order of the coordinates x = [ξ(3), θ(3), η(k), Θ_1(2) … Θ_r(2), δ_1(2) … δ_s(2), x_a]: rigid
/// body (optional), modes, gimballed engines, tanks whose slosh is free, and first-order states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    rigid: bool,
    labels: Vec<String>,
    /// Per engine of the vehicle: position among the gimballed ones, or `None` if locked.
    gimbal: Vec<Option<usize>>,
    /// Per tank of the vehicle: position among the free ones, or `None` if locked.
    slosh: Vec<Option<usize>>,
    /// Names of the gimbal rotations, slosh displacements and first-order states.
    gimbal_names: Vec<String>,
    slosh_names: Vec<String>,
    state_names: Vec<String>,
}

/// Positions of the members that are free, counted from 0.
fn positions(free: impl Iterator<Item = bool>) -> Vec<Option<usize>> {
    let mut count = 0;
    free.map(|free| {
        free.then(|| {
            count += 1;
            count - 1
        })
    })
    .collect()
}

impl Part {
    /// Every part, in the order of the coordinates.
    pub const ALL: [Self; 5] =
        [Self::RigidBody, Self::Structure, Self::Nozzle, Self::Slosh, Self::Servo];
}

impl Layout {
    /// A layout for elastic modes `labels` and engines given as (path, axis names, gimballed),
    /// without rigid body, slosh and first-order states.
    pub fn new<'a>(
        labels: impl IntoIterator<Item = &'a str>,
        engines: impl IntoIterator<Item = (String, [&'a str; 2], bool)>,
    ) -> Self {
        let engines: Vec<_> = engines.into_iter().collect();
        let free = engines.iter().filter(|(_, _, gimballed)| *gimballed);
        let names = free.flat_map(|(path, axes, _)| axes.map(|a| format!("theta.{path}.{a}")));
        Self {
            rigid: false,
            labels: labels.into_iter().map(str::to_owned).collect(),
            gimbal_names: names.collect(),
            gimbal: positions(engines.iter().map(|(_, _, gimballed)| *gimballed)),
            slosh: Vec::new(),
            slosh_names: Vec::new(),
            state_names: Vec::new(),
        }
    }

    /// The layout with the rigid body free.
    pub fn with_rigid_body(self) -> Self {
        Self { rigid: true, ..self }
    }

    /// The layout with tanks given as (name, free).
    pub fn with_tanks<'a>(self, tanks: impl IntoIterator<Item = (&'a str, bool)>) -> Self {
        let tanks: Vec<_> = tanks.into_iter().collect();
        let free = tanks.iter().filter(|(_, free)| *free);
        let names = free.flat_map(|(name, _)| ["1", "2"].map(|a| format!("delta.{name}.{a}")));
        Self {
            slosh_names: names.collect(),
            slosh: positions(tanks.iter().map(|(_, free)| *free)),
            ..self
        }
    }

    /// The layout with first-order states of these names.
    pub fn with_states(self, names: Vec<String>) -> Self {
        Self { state_names: names, ..self }
    }

    /// Number of coordinates, first-order states included: the size of a model.
    pub fn coordinates(&self) -> usize {
        self.second_order() + self.state_names.len()
    }

    /// Number of generalised coordinates q, which have a mass.
    pub fn second_order(&self) -> usize {
        self.slosh_start() + self.slosh_names.len()
    }

    /// Rigid translation ξ, three coordinates or none.
    pub fn translation(&self) -> Range<usize> {
        0..if self.rigid { 3 } else { 0 }
    }

    /// Rigid rotation θ, three coordinates or none.
    pub fn rotation(&self) -> Range<usize> {
        if self.rigid { 3..6 } else { 0..0 }
    }

    /// Coordinates of the body: rigid, then elastic.
    pub fn body(&self) -> Range<usize> {
        0..self.elastic().end
    }

    /// Elastic coordinates η.
    pub fn elastic(&self) -> Range<usize> {
        let first = self.rotation().end;
        first..first + self.labels.len()
    }

    /// Gimbal rotations Θ of all gimballed engines.
    pub fn gimbals(&self) -> Range<usize> {
        self.elastic().end..self.slosh_start()
    }

    fn slosh_start(&self) -> usize {
        self.elastic().end + self.gimbal_names.len()
    }

    /// Slosh displacements δ of all free tanks.
    pub fn sloshes(&self) -> Range<usize> {
        self.slosh_start()..self.second_order()
    }

    /// First-order states.
    pub fn first_order(&self) -> Range<usize> {
        self.second_order()..self.coordinates()
    }

    /// First of the two gimbal rotations of an engine, `None` if it is locked.
    pub fn gimbal(&self, engine: usize) -> Option<usize> {
        self.gimbal[engine].map(|position| self.gimbals().start + 2 * position)
    }

    /// First of the two displacements of a tank's slosh mass, `None` if it is locked.
    pub fn slosh(&self, tank: usize) -> Option<usize> {
        self.slosh[tank].map(|position| self.sloshes().start + 2 * position)
    }

    /// The coordinates of a part.
    pub fn part(&self, part: Part) -> Range<usize> {
        match part {
            Part::RigidBody => 0..self.rotation().end,
            Part::Structure => self.elastic(),
            Part::Nozzle => self.gimbals(),
            Part::Slosh => self.sloshes(),
            Part::Servo => self.first_order(),
        }
    }

    /// Coordinate of a modal label.
    pub fn position(&self, label: &str) -> Option<usize> {
        self.labels.iter().position(|l| l == label).map(|mode| self.elastic().start + mode)
    }

    /// Name of a coordinate, for instance `theta.z`, `eta.m012`, `theta.booster.left.rock`,
    /// `delta.lox.1` or the name of a first-order state.
    pub fn name(&self, coordinate: usize) -> String {
        let find =
            |range: Range<usize>| range.contains(&coordinate).then(|| coordinate - range.start);
        if let Some(mode) = find(self.elastic()) {
            return format!("eta.{}", self.labels[mode]);
        }
        let named = [
            (self.gimbals(), &self.gimbal_names),
            (self.sloshes(), &self.slosh_names),
            (self.first_order(), &self.state_names),
        ];
        let name = named.into_iter().find_map(|(range, names)| Some(names[find(range)?].clone()));
        name.unwrap_or_else(|| RIGID[coordinate].to_owned())
    }

    /// Coordinate of a name, see [`Layout::name`].
    pub fn find(&self, name: &str) -> Option<usize> {
        (0..self.coordinates()).find(|&coordinate| self.name(coordinate) == name)
    }

    /// What motions a pole can be called by, each with its coordinates: every mode by its label, a
    /// gimbal rotation and a slosh displacement by its name, the rigid body by `axial`, `roll`,
    /// `pitch` and `yaw`, a first-order state by its name up to the last dot.
    pub fn motions(&self) -> Vec<(String, Vec<usize>)> {
        let mut motions: Vec<(String, Vec<usize>)> = Vec::new();
        if self.rigid {
            let rigid =
                [("axial", vec![0]), ("roll", vec![3]), ("pitch", vec![2, 4]), ("yaw", vec![1, 5])];
            motions.extend(rigid.map(|(name, coordinates)| (name.to_owned(), coordinates)));
        }
        for coordinate in self.elastic() {
            let label = self.labels[coordinate - self.elastic().start].clone();
            motions.push((label, vec![coordinate]));
        }
        for coordinate in self.gimbals().start..self.coordinates() {
            let mut name = self.name(coordinate);
            if self.first_order().contains(&coordinate) {
                let end = name.rfind('.').unwrap_or(name.len());
                name.truncate(end);
            }
            match motions.iter_mut().find(|(known, _)| *known == name) {
                Some((_, coordinates)) => coordinates.push(coordinate),
                None => motions.push((name, vec![coordinate])),
            }
        }
        motions
    }

    /// Names of the states [q, q̇, x_a] that are not in `null` (numbers of states, see
    /// [`super::Model::null_states`]): the coordinates, rates with the prefix `d.`.
    pub fn state_names(&self, null: &[usize]) -> Vec<String> {
        let q = || (0..self.second_order()).map(|coordinate| self.name(coordinate));
        let names = q().chain(q().map(|name| format!("d.{name}")));
        let all = names.chain(self.state_names.iter().cloned()).enumerate();
        all.filter(|(state, _)| !null.contains(state)).map(|(_, name)| name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full() -> Layout {
        let engines = [
            ("booster.left".to_owned(), ["rock", "tilt"], true),
            ("core.1".to_owned(), ["rock", "tilt"], false),
        ];
        Layout::new(["m001", "m002"], engines)
            .with_rigid_body()
            .with_tanks([("lox", true), ("lh2", false)])
            .with_states(vec!["yaw.lag.1".into(), "yaw.lag.2".into()])
    }

    #[test]
    fn every_coordinate_is_found_by_its_name_and_in_one_part() {
        let layout = full();
        assert_eq!(layout.coordinates(), 14);
        for coordinate in 0..layout.coordinates() {
            assert_eq!(layout.find(&layout.name(coordinate)), Some(coordinate));
            let holders = Part::ALL.iter().filter(|part| layout.part(**part).contains(&coordinate));
            assert_eq!(holders.count(), 1, "{}", layout.name(coordinate));
        }
        assert_eq!(layout.gimbal(0), Some(8));
        assert_eq!(layout.gimbal(1), None);
        assert_eq!(layout.slosh(0), Some(10));
        assert_eq!(layout.slosh(1), None);
        assert_eq!(layout.position("m002"), Some(7));
    }

    #[test]
    fn every_coordinate_belongs_to_one_motion() {
        let layout = full();
        let mut members: Vec<usize> =
            layout.motions().into_iter().flat_map(|(_, members)| members).collect();
        members.sort_unstable();
        assert_eq!(members, (0..14).collect::<Vec<_>>());
    }

    #[test]
    fn states_are_named_without_the_null_ones() {
        let layout = full();
        let names = layout.state_names(&[0, 12]);
        assert_eq!(names.len(), 24);
        assert!(!names.contains(&"xi.x".to_owned()) && !names.contains(&"d.xi.x".to_owned()));
        assert_eq!(names.last().map(String::as_str), Some("yaw.lag.2"));
    }
}
