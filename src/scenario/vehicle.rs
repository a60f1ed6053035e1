//! The vehicle: from the vehicle file and the modal data to validated values.
//!
//! Types and ranges of single values are checked before, by `table`.

use super::gimbal::{self, Refusal};
use super::table::Findings;
use super::vehicle_file::{EngineFile, MotorFile, VehicleFile};
use super::{actuator, aerodynamics, autopilot, names, pattern, tank};
use crate::dynamics::virtual_grid::Geometry;
use crate::problem::Problems;
use crate::spelling::allowed_instead;
use crate::vehicle::{
    Ablation, Actuator, ActuatorSet, Engine, Modal, ModeSet, Motor, NamedMode, Nozzle, Vehicle,
};
use nalgebra::{Matrix3x2, Vector3};
use std::sync::Arc;

/// A vehicle and the flight times at which it can be evaluated.
#[derive(Debug, Clone)]
pub struct Resolved {
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Flight times, s, ascending.
    pub flight_times_s: Vec<f64>,
}

/// First segments of the parameter paths that belong to no engine.
const RESERVED_GROUPS: [&str; 7] =
    ["structure", "modes", "tank", "body", "aerodynamics", "autopilot", "sensor"];

/// How far an attach point may move from one flight time to the next, m: nothing but rounding.
const SAME_PLACE_M: f64 = 1e-6;

/// Checks what the values of `file` mean together and with the modal data. Without modal data
/// (where they could not be read, which `findings` knows) the rest is still checked.
///
/// # Errors
/// All problems of the file.
pub fn resolve(
    file: &VehicleFile,
    modal: Option<Modal>,
    mut findings: Findings,
) -> Result<Resolved, Problems> {
    let mut resolver = Resolver { file, sets: Vec::new(), findings: &mut findings };
    let parts = resolver.resolve(modal.as_ref());
    let tanks = tank::resolve(file, &resolver.sets, modal.as_ref(), resolver.findings);
    let aerodynamics = aerodynamics::resolve(file, modal.as_ref(), resolver.findings);
    let engines = parts.as_ref().map(|(engines, _)| engines.as_slice());
    let body = engines.zip(tanks.as_deref());
    let autopilot = (file.autopilot.as_ref())
        .map(|file| autopilot::resolve(file, body, &resolver.sets, resolver.findings));
    // One that is there but wrong leaves no vehicle.
    let autopilot = autopilot.map_or(Some(None), |autopilot| autopilot.map(Some));
    let parts = parts.zip(tanks).zip(aerodynamics).zip(autopilot).zip(modal);
    let resolved =
        parts.map(|(((((engines, named_modes), tanks), aerodynamics), autopilot), modal)| {
            Resolved {
                vehicle: Vehicle {
                    name: file.name.clone(),
                    structural_damping: file.structure.damping_ratio,
                    band_time_s: file.structure.band_time_s,
                    named_modes,
                    engines,
                    tanks,
                    aerodynamics,
                    autopilot,
                    modal,
                },
                flight_times_s: file.flight_times_s.clone(),
            }
        });
    findings.finish(resolved)
}

/// Where an actuator is attached, see [`Actuator`].
#[derive(Clone)]
struct Place {
    attach_grid: String,
    attach_m: Vector3<f64>,
    action_line: Vector3<f64>,
}

struct Resolver<'a> {
    file: &'a VehicleFile,
    /// Mode sets at the flight times of the file; empty without modal data.
    sets: Vec<&'a ModeSet>,
    findings: &'a mut Findings,
}

impl<'a> Resolver<'a> {
    fn resolve(&mut self, modal: Option<&'a Modal>) -> Option<(Vec<Engine>, Vec<NamedMode>)> {
        if self.file.name.trim().is_empty() {
            self.findings.push("name", "an empty text", "a name");
        }
        // It is shown on terminals, beside every result.
        if self.file.name.contains(char::is_control) {
            let found = format!("{:?}", self.file.name);
            self.findings.push("name", found, "a name on one line, without control characters");
        }
        self.flight_times(modal);
        let motors: Vec<Option<Arc<Motor>>> = self.motors();
        names::unique(self.findings, "motor", self.file.motor.iter().map(|m| m.name.as_str()));
        let engines: Vec<Option<Engine>> =
            (0..self.file.engine.len()).map(|i| self.engine(i, &motors, modal)).collect();
        let paths: Vec<String> =
            self.file.engine.iter().map(|e| format!("{}.{}", e.group, e.name)).collect();
        names::unique(self.findings, "engine", paths.iter().map(String::as_str));
        if let Some(modal) = modal {
            self.engines_in_modes(&paths, &modal.contains_engines);
        }
        let named_modes = self.named_modes(modal);
        let engines: Option<Vec<Engine>> = engines.into_iter().collect();
        Some((engines?, named_modes))
    }

    fn flight_times(&mut self, modal: Option<&'a Modal>) {
        let times = &self.file.flight_times_s;
        names::ascending(self.findings, "flight_times_s", times);
        let Some(modal) = modal else { return };
        for (i, &time) in times.iter().enumerate() {
            match modal.at(time) {
                Some(set) => self.sets.push(set),
                None => {
                    let known: Vec<f64> = modal.sets.iter().map(|s| s.flight_time_s).collect();
                    let allowed = format!("a flight time of the modal package, one of {known:?} s");
                    self.findings.push(
                        format!("flight_times_s[{i}]"),
                        format!("{time} s"),
                        allowed,
                    );
                }
            }
        }
    }

    fn motors(&mut self) -> Vec<Option<Arc<Motor>>> {
        let file = self.file;
        file.motor
            .iter()
            .enumerate()
            .map(|(i, motor)| self.motor(&format!("motor[{i}]"), motor).map(Arc::new))
            .collect()
    }

    fn motor(&mut self, key: &str, file: &MotorFile) -> Option<Motor> {
        let count = file.time_s.len();
        let zero = vec![0.0; count];
        let burned = file.burned_fraction.as_ref().unwrap_or(&zero);
        let mut good = names::ascending(self.findings, &format!("{key}.time_s"), &file.time_s);
        /// Key, values, what holds for each, and that in words.
        type Table<'a> = (&'a str, &'a [f64], fn(f64) -> bool, &'a str);
        let tables: [Table; 3] = [
            ("thrust_n", &file.thrust_n, |x| x >= 0.0, "numbers ≥ 0"),
            ("mass_flow_kg_s", &file.mass_flow_kg_s, |x| x >= 0.0, "numbers ≥ 0"),
            ("burned_fraction", burned, |x| (0.0..=1.0).contains(&x), "numbers from 0 to 1"),
        ];
        for (name, values, holds, allowed) in tables {
            if values.len() != count {
                let found = format!("{} entries", values.len());
                let allowed = format!("{count}, as many as in `time_s`");
                self.findings.push(format!("{key}.{name}"), found, allowed);
                good = false;
            }
            for (i, value) in values.iter().enumerate().filter(|(_, x)| !holds(**x)) {
                self.findings.push(format!("{key}.{name}[{i}]"), value.to_string(), allowed);
                good = false;
            }
        }
        let flows = file.thrust_n.iter().zip(&file.mass_flow_kg_s);
        if let Some(i) = flows.into_iter().position(|(thrust, flow)| *thrust == 0.0 && *flow > 0.0)
        {
            let key = format!("{key}.mass_flow_kg_s[{i}]");
            self.findings.push(key, file.mass_flow_kg_s[i].to_string(), "0 where the thrust is 0");
            good = false;
        }
        if let Some(i) = burned.windows(2).position(|w| good && w[0] > w[1]) {
            let found = format!("{} after {}", burned[i + 1], burned[i]);
            let key = format!("{key}.burned_fraction[{}]", i + 1);
            self.findings.push(key, found, "numbers that never fall");
            good = false;
        }
        let users = || self.file.engine.iter().filter(|e| e.motor == file.name);
        if file.burned_fraction.is_none() && users().any(|e| e.nozzle.ablation.is_some()) {
            let allowed = "a table, since a nozzle on this motor ablates";
            self.findings.push(format!("{key}.burned_fraction"), "nothing", allowed);
        }
        if let ([first, .., last] | [first @ last], true) = (file.time_s.as_slice(), good) {
            let times = &self.file.flight_times_s;
            let outside: Vec<&f64> =
                times.iter().filter(|t| !(first <= *t && *t <= last)).collect();
            if !outside.is_empty() && users().next().is_some() {
                let found = format!("tables from {first} to {last} s, without {outside:?} s");
                self.findings.push(
                    format!("{key}.time_s"),
                    found,
                    "tables that hold every flight time",
                );
                good = false;
            }
        }
        good.then(|| Motor {
            name: file.name.clone(),
            specific_impulse_s: file.specific_impulse_s,
            time_s: file.time_s.clone(),
            thrust_n: file.thrust_n.clone(),
            mass_flow_kg_s: file.mass_flow_kg_s.clone(),
            burned_fraction: burned.clone(),
        })
    }

    /// The motor of an engine.
    fn motor_of(
        &mut self,
        key: &str,
        file: &EngineFile,
        motors: &[Option<Arc<Motor>>],
    ) -> Option<Arc<Motor>> {
        let known = self.file.motor.iter().map(|m| m.name.as_str());
        let Some(index) = known.clone().position(|name| name == file.motor) else {
            let found = format!("\"{}\"", file.motor);
            self.findings.push(format!("{key}.motor"), found, allowed_instead(&file.motor, known));
            return None;
        };
        motors[index].clone()
    }

    fn engine(
        &mut self,
        index: usize,
        motors: &[Option<Arc<Motor>>],
        modal: Option<&Modal>,
    ) -> Option<Engine> {
        let file = &self.file.engine[index];
        let key = format!("engine[{index}]");
        names::word(self.findings, &format!("{key}.group"), &file.group);
        names::word(self.findings, &format!("{key}.name"), &file.name);
        if RESERVED_GROUPS.contains(&file.group.as_str()) {
            let found = format!("\"{}\"", file.group);
            self.findings.push(format!("{key}.group"), found, "another word: this one is taken");
        }
        let motor = self.motor_of(&key, file, motors);
        let nozzle = self.nozzle(&key, file, motor.as_deref());
        let gimbal = self.grid(&format!("{key}.gimbal_grid"), &file.gimbal_grid);
        let thrust =
            self.accept(&format!("{key}.thrust_direction"), gimbal::unit(file.thrust_direction));
        let actuators = self.actuators(&key, file, thrust.as_ref());
        let case_stations = match (gimbal, thrust) {
            (Some(()), Some(thrust)) => self.case_stations(&key, file, &thrust),
            _ => None,
        };
        let ((actuators, alternatives), thrust_direction) = (actuators?, thrust?);
        let axes = self.axes(&key, file, &actuators, &thrust_direction);
        let path = format!("{}.{}", file.group, file.name);
        let bearing = file.bearing.as_ref();
        Some(Engine {
            in_modes: modal.is_some_and(|m| m.contains_engines.contains(&path)),
            group: file.group.clone(),
            name: file.name.clone(),
            thrust_direction,
            gimbal_grid: file.gimbal_grid.clone(),
            axes: axes?,
            motor: motor?,
            nozzle,
            bearing_stiffness_n_m_rad: bearing.map_or(0.0, |b| b.stiffness_n_m_rad),
            bearing_damping_n_m_s_rad: bearing.map_or(0.0, |b| b.damping_n_m_s_rad),
            actuators,
            alternatives,
            case_stations: case_stations?,
        })
    }

    /// The value, or its refusal as a problem at `key`.
    fn accept<T>(&mut self, key: &str, result: Result<T, Refusal>) -> Option<T> {
        result.map_err(|(found, allowed)| self.findings.push(key, found, allowed)).ok()
    }

    fn nozzle(&mut self, key: &str, file: &EngineFile, motor: Option<&Motor>) -> Nozzle {
        let raw = &file.nozzle;
        let nozzle = Nozzle {
            mass_kg: raw.mass_kg,
            cg_m: raw.cg_m,
            inertia_kg_m2: raw.inertia_kg_m2,
            axial_inertia_kg_m2: raw.axial_inertia_kg_m2,
            length_m: raw.length_m,
            ablation: raw.ablation.as_ref().map(|a| Ablation {
                factor: a.factor,
                mass_loss_kg: a.mass_loss_kg,
                inertia_loss_kg_m2: a.inertia_loss_kg_m2,
                cg_change_m: a.cg_change_m,
            }),
        };
        let mut states = vec![("unablated".to_string(), nozzle)];
        if let (Some(ablation), Some(motor)) = (nozzle.ablation, motor) {
            states.extend(self.file.flight_times_s.iter().map(|&time| {
                let share = ablation.factor * motor.burned_fraction_at(time);
                (format!("ablated at {time} s"), nozzle.ablated(share))
            }));
        }
        // The first state that is impossible tells enough.
        let impossible =
            states.iter().find(|(_, n)| !(n.mass_kg > 0.0 && n.central_inertia_kg_m2() > 0.0));
        if let Some((state, n)) = impossible {
            let found = format!(
                "{state} a mass of {} kg and an inertia J − m r² = {} − {} · {}² = {} kg·m² about its own cg",
                n.mass_kg,
                n.inertia_kg_m2,
                n.mass_kg,
                n.cg_m,
                n.central_inertia_kg_m2()
            );
            self.findings.push(format!("{key}.nozzle"), found, "both above zero");
        }
        nozzle
    }

    /// Checks that a grid exists at every flight time; `None` where it does not or is unknown.
    fn grid(&mut self, key: &str, name: &str) -> Option<()> {
        names::grid(self.findings, key, name, &self.sets)
    }

    fn position(&self, set: &ModeSet, grid: &str) -> Option<Vector3<f64>> {
        set.grid(grid).map(|index| set.grids[index].position_m)
    }

    /// The engine's own actuators and the alternative sets.
    fn actuators(
        &mut self,
        engine_key: &str,
        engine: &EngineFile,
        thrust: Option<&Vector3<f64>>,
    ) -> Option<([Actuator; 2], Vec<ActuatorSet>)> {
        let key = format!("{engine_key}.actuator");
        let files = &engine.actuator;
        names::unique(self.findings, &key, files.iter().map(|a| a.name.as_str()));
        let mut sets: Vec<Option<&String>> = vec![None];
        for set in files.iter().map(|a| a.set.as_ref()) {
            if !sets.contains(&set) {
                sets.push(set);
            }
        }
        let mut places: [Option<Place>; 2] = [None, None];
        let mut pairs = Vec::new();
        for set in sets {
            let of_set = |a: &usize| files[*a].set.as_ref() == set;
            let members: Vec<usize> = (0..files.len()).filter(of_set).collect();
            let &[first, second] = members.as_slice() else {
                let whose = set.map_or("without a `set`".into(), |set| format!("of set \"{set}\""));
                let found = format!("{} actuators {whose}", members.len());
                self.findings.push(&key, found, "two, one for each gimbal axis");
                return None;
            };
            match set {
                None => {
                    places = [first, second].map(|a| self.place(&format!("{key}[{a}]"), engine, a))
                }
                Some(set) => {
                    names::word(self.findings, &format!("{key}[{first}].set"), set);
                    self.no_place(&key, engine, [first, second]);
                }
            }
            let [first, second] = [(0, first), (1, second)].map(|(axis, a)| {
                self.actuator(&format!("{key}[{a}]"), engine, a, places[axis].as_ref(), thrust)
            });
            pairs.push((set, first.zip(second)));
        }
        let mut pairs = pairs.into_iter();
        let own: [Actuator; 2] = pairs.next()?.1?.into();
        let set = |(name, pair): (Option<&String>, Option<(Actuator, Actuator)>)| {
            Some(ActuatorSet { name: name?.clone(), actuators: pair?.into() })
        };
        Some((own, pairs.map(set).collect::<Option<_>>()?))
    }

    /// An alternative actuator says nothing about its place.
    fn no_place(&mut self, key: &str, engine: &EngineFile, members: [usize; 2]) {
        for a in members {
            let file = &engine.actuator[a];
            for (name, given) in [
                ("attach_grid", file.attach_grid.is_some()),
                ("attach_m", file.attach_m.is_some()),
                ("action_line", file.action_line.is_some()),
            ] {
                if given {
                    let allowed =
                        "nothing: a set stands in the place of the engine's own actuators";
                    self.findings.push(format!("{key}[{a}].{name}"), "a value", allowed);
                }
            }
        }
    }

    fn actuator(
        &mut self,
        key: &str,
        engine: &EngineFile,
        a: usize,
        place: Option<&Place>,
        thrust: Option<&Vector3<f64>>,
    ) -> Option<Actuator> {
        let file = &engine.actuator[a];
        names::word(self.findings, &format!("{key}.name"), &file.name);
        let arm = place.zip(thrust).map(|(place, thrust)| {
            let moment = place.attach_m.cross(&place.action_line);
            (moment - thrust * thrust.dot(&moment)).norm()
        });
        let (bearing, law) = actuator::drive(key, file, engine, arm, self.findings)?;
        let Place { attach_grid, attach_m, action_line } = place?.clone();
        Some(Actuator { name: file.name.clone(), attach_grid, attach_m, action_line, bearing, law })
    }

    /// Where an engine's own actuator is attached.
    fn place(&mut self, key: &str, engine: &EngineFile, a: usize) -> Option<Place> {
        let file = &engine.actuator[a];
        let mut given = |name: &str, given: bool, allowed: &str| {
            if !given {
                self.findings.push(format!("{key}.{name}"), "nothing", allowed);
            }
        };
        given("attach_grid", file.attach_grid.is_some(), "a text");
        given("action_line", file.action_line.is_some(), "a list of 3, each a finite number");
        let line = file.action_line.map(gimbal::unit);
        let action_line = line.and_then(|line| self.accept(&format!("{key}.action_line"), line));
        let grid = file.attach_grid.as_ref();
        let attached = grid.and_then(|grid| self.grid(&format!("{key}.attach_grid"), grid));
        let attach_m = match file.attach_m {
            Some(point) => Some(Vector3::from(point)),
            None => attached.and_then(|()| self.attach_point(key, engine, grid?)),
        };
        Some(Place { attach_grid: grid?.clone(), attach_m: attach_m?, action_line: action_line? })
    }

    /// The attach point from the gimbal, by the grids' positions, the same at every flight time.
    fn attach_point(&mut self, key: &str, engine: &EngineFile, grid: &str) -> Option<Vector3<f64>> {
        let arms: Vec<Vector3<f64>> = self
            .sets
            .iter()
            .map(|set| {
                let attach = self.position(set, grid)?;
                Some(attach - self.position(set, &engine.gimbal_grid)?)
            })
            .collect::<Option<_>>()?;
        let first = *arms.first()?;
        if let Some(i) = arms.iter().position(|arm| !((arm - first).norm() <= SAME_PLACE_M)) {
            let found = format!(
                "an attach point that moves against the gimbal between {} and {} s",
                self.sets[0].flight_time_s, self.sets[i].flight_time_s
            );
            self.findings.push(format!("{key}.attach_grid"), found, "one place, or `attach_m`");
            return None;
        }
        Some(first)
    }

    fn axes(
        &mut self,
        key: &str,
        file: &EngineFile,
        actuators: &[Actuator; 2],
        thrust: &Vector3<f64>,
    ) -> Option<Matrix3x2<f64>> {
        let [first, second] = actuators;
        let geometry = Geometry {
            attach_m: Matrix3x2::from_columns(&[first.attach_m, second.attach_m]),
            action_line: Matrix3x2::from_columns(&[first.action_line, second.action_line]),
        };
        let named = |(found, allowed): Refusal| {
            (format!("engine \"{}.{}\": {found}", file.group, file.name), allowed)
        };
        let lines = gimbal::check_action_lines(&geometry).map_err(named);
        let resolved = self.accept(&format!("{key}.actuator"), lines);
        match file.axes {
            Some(axes) => {
                let axes = gimbal::given_axes(axes, thrust).map_err(named);
                self.accept(&format!("{key}.axes"), axes)
            }
            None => {
                resolved?;
                let axes = gimbal::axes_of_actuators(&geometry, thrust).map_err(named);
                self.accept(&format!("{key}.actuator"), axes)
            }
        }
    }

    /// Names of the case stations, in the order of the flow, the throat last.
    fn case_stations(
        &mut self,
        engine_key: &str,
        file: &EngineFile,
        thrust: &Vector3<f64>,
    ) -> Option<Vec<String>> {
        if file.case_stations.is_empty() {
            return Some(Vec::new());
        }
        let key = format!("{engine_key}.case_stations");
        let throat = file.throat_grid.as_ref().unwrap_or(&file.gimbal_grid);
        self.grid(&format!("{engine_key}.throat_grid"), throat)?;
        let set = *self.sets.first()?;
        // The exhaust flows against the thrust on the vehicle.
        let along = |set: &ModeSet, name: &str| self.position(set, name).map(|p| -p.dot(thrust));
        let end = along(set, throat)?;
        let mut stations: Vec<String> = Vec::new();
        let mut unmatched = Vec::new();
        for (i, entry) in file.case_stations.iter().enumerate() {
            if !entry.contains('*') {
                stations.push(entry.clone());
                continue;
            }
            let matching = set.grids.iter().filter(|g| pattern::matches(entry, &g.name));
            let mut matching: Vec<(f64, &String)> = matching
                .map(|g| (-g.position_m.dot(thrust), &g.name))
                .filter(|(at, name)| *at < end && *name != throat)
                .collect();
            if matching.is_empty() {
                unmatched.push((i, entry));
            }
            matching.sort_by(|a, b| a.0.total_cmp(&b.0));
            stations.extend(matching.into_iter().map(|(_, name)| name.clone()));
        }
        for (i, entry) in unmatched {
            let found = format!("\"{entry}\", which matches no grid forward of the throat");
            let known = set.grids.iter().map(|g| g.name.as_str());
            self.findings.push(format!("{key}[{i}]"), found, allowed_instead(entry, known));
        }
        if stations.last() != Some(throat) {
            stations.push(throat.clone());
        }
        for name in &stations {
            self.grid(&key, name)?;
        }
        for set in self.sets.clone() {
            let along =
                |name: &String| self.position(set, name).map_or(f64::NAN, |p| -p.dot(thrust));
            let descent = stations.windows(2).find(|w| !(along(&w[0]) < along(&w[1])));
            if let Some(pair) = descent {
                let found = format!(
                    "\"{}\" at {} m and then \"{}\" at {} m along the flow at {} s",
                    pair[0],
                    along(&pair[0]),
                    pair[1],
                    along(&pair[1]),
                    set.flight_time_s
                );
                let allowed = format!(
                    "stations in the order of the flow, none aft of the throat \"{throat}\""
                );
                self.findings.push(key, found, allowed);
                return None;
            }
        }
        if stations.len() < 2 {
            self.findings.push(key, "only the throat", "at least one station forward of it");
            return None;
        }
        Some(stations)
    }

    /// Modes hold all engines (integrated body) or none (reduced body).
    fn engines_in_modes(&mut self, paths: &[String], contained: &[String]) {
        for path in contained.iter().filter(|path| !paths.contains(path)) {
            let found = format!("a package whose modes contain an engine \"{path}\"");
            let known = paths.iter().map(String::as_str);
            self.findings.push("modal_package", found, allowed_instead(path, known));
        }
        let inside = paths.iter().filter(|path| contained.contains(path)).count();
        if inside != 0 && inside != paths.len() {
            let outside: Vec<&str> =
                paths.iter().filter(|p| !contained.contains(p)).map(String::as_str).collect();
            let found =
                format!("modes that contain {inside} engines but not {}", outside.join(", "));
            let allowed = "all engines (integrated body) or none (reduced body)";
            self.findings.push("modal_package", found, allowed);
        }
    }

    fn named_modes(&mut self, modal: Option<&Modal>) -> Vec<NamedMode> {
        let file = self.file;
        let known = modal.map(Modal::labels);
        names::unique(self.findings, "named_mode", file.named_mode.iter().map(|m| m.name.as_str()));
        for (i, mode) in file.named_mode.iter().enumerate() {
            names::word(self.findings, &format!("named_mode[{i}].name"), &mode.name);
            let Some(known) = &known else { continue };
            for (j, label) in mode.labels.iter().enumerate() {
                if !known.contains(&label.as_str()) {
                    let key = format!("named_mode[{i}].labels[{j}]");
                    let allowed = allowed_instead(label, known.iter().copied());
                    self.findings.push(key, format!("label \"{label}\""), allowed);
                }
            }
        }
        let named = |m: &super::vehicle_file::NamedModeFile| NamedMode {
            name: m.name.clone(),
            labels: m.labels.clone(),
        };
        file.named_mode.iter().map(named).collect()
    }
}

#[cfg(test)]
mod tests;
