//! The servo part of a model: actuators, allocation and autopilot as blocks, connected by name and
//! written into the model.
//!
//! The blocks are prepared once for a vehicle and a way of closing the loop; composing a drawn vehicle
//! works on numbers alone. Mechanics is added up in `assemble`.

mod blocks;

use self::blocks::{Parts, Signal, Source, axes};
use super::gradient::{C, Vectors};
use super::interconnection::{Interconnection, Member, Unknown};
use super::{ControlLaw, DrawnPath, DrawnVehicle, Layout, Model};
use crate::vehicle::{
    Autopilot, Axis, FilterDraw, Law, ModeSet, Path, SensorKind, StateSpace, Vehicle, delay,
};
use nalgebra::{DMatrix, Vector3};

/// What the autopilot does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Feedback {
    /// Servo loops closed, autopilot off: filters are no part of the model.
    #[default]
    Open,
    /// Autopilot on: its feedback is subtracted from the commands.
    Closed,
    /// The sign of every axis loop changed.
    Inverted,
}

/// Why a servo part could not be prepared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A loop is to be closed on a vehicle without an autopilot.
    #[error("the vehicle has no autopilot")]
    NoAutopilot,
    /// The autopilot commands an engine that is locked.
    #[error("the autopilot commands the locked engine `{0}`")]
    Locked(String),
    /// No engine has actuators of this set.
    #[error("no engine has actuators of the set `{0}`")]
    NoSet(String),
    /// A sensor's grid is not in the modal package at this time.
    #[error("autopilot sensor {sensor}: grid `{grid}` is not in the modal package at {time_s} s")]
    MissingGrid {
        /// Name of the sensor.
        sensor: String,
        /// Name of the grid.
        grid: String,
        /// Flight time, s.
        time_s: f64,
    },
    /// A signal that nothing makes.
    #[error("{0}")]
    Unknown(#[from] Unknown),
    /// Paths that pass on at once what they themselves make.
    #[error("an algebraic loop through {}", .0.join(", "))]
    AlgebraicLoop(Vec<String>),
}

/// Actuators, allocation and autopilot of a vehicle, connected.
#[derive(Debug, Clone, PartialEq)]
pub struct Servo {
    connection: Interconnection,
    sources: Vec<Source>,
    /// Mechanical signals, the first inputs of the whole; external ones follow.
    signals: Vec<Signal>,
    /// Engine and axis of each torque, the first outputs of the whole.
    torques: Vec<(usize, usize)>,
    /// The autopilot and its law, whether or not it acts.
    autopilot: Option<(Autopilot, ControlLaw)>,
    /// Nominal slopes of the modes at the grid of each sensor: sensors, then modes, rad/m per kg^1/2.
    slopes: Vec<Vec<Vector3<f64>>>,
    active: bool,
    /// Poles at the origin that the parts have each on its own.
    at_origin: usize,
}

/// The servo part in the form of [`super::gradient`].
#[derive(Debug, Clone)]
pub struct ServoForm {
    /// Its part of the form.
    pub value: C,
    /// Blocks that a draw changes.
    members: Vec<(Source, Member)>,
    /// Gradient by the scale of each sensor.
    pub scale: Vec<C>,
    /// Gradient by the slope gain of each sensor and mode.
    pub slope_gain: Vec<Vec<C>>,
}

impl ServoForm {
    /// The part of an actuator with this torque law, linear in its matrices.
    pub fn actuator(&self, engine: usize, axis: usize, torque: &StateSpace) -> C {
        let of = self.members.iter().find(
            |(source, _)| matches!(source, Source::Actuator(e, _, a) if (*e, *a) == (engine, axis)),
        );
        of.map_or(C::ZERO, |(_, member)| member.part(torque))
    }
}

/// Why composing cannot fail.
const NO_LOOP: &str = "algebraic loops are refused when it is prepared";

/// A linear combination of coordinates, or of their rates.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Coordinates and factors.
    pub entries: Vec<(usize, f64)>,
    /// Whether it reads the rates.
    pub rate: bool,
}

impl Servo {
    /// The servo part of `vehicle` with the modes of `modes`, these engines gimballed, this feedback, and
    /// the actuators of a set (engines without it keep their own).
    ///
    /// External inputs are the axis commands, where there is an autopilot, and the gimbal commands.
    /// Outputs are the torques, and with feedback also `feedback.<axis>`.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn new(
        vehicle: &Vehicle,
        modes: &ModeSet,
        gimballed: &[bool],
        feedback: Feedback,
        set: Option<&str>,
    ) -> Result<Self, Error> {
        if let Some(set) = set.filter(|set| !vehicle.actuator_sets().contains(set)) {
            return Err(Error::NoSet(set.to_owned()));
        }
        let mut parts = Parts::default();
        let gimbal = |engine: usize, axis: usize| {
            let engine = &vehicle.engines[engine];
            format!("{}.{}", engine.path(), engine.actuators[axis].name)
        };
        for (e, engine) in vehicle.engines.iter().enumerate().filter(|(e, _)| gimballed[*e]) {
            let number = engine.set(set);
            for axis in 0..2 {
                parts.actuator(vehicle, [e, number, axis], &gimbal(e, axis));
            }
        }
        if let Some(autopilot) = &vehicle.autopilot {
            parts.allocation(autopilot, gimballed, gimbal);
            parts.external.splice(0..0, axes("command"));
        }
        match (feedback, &vehicle.autopilot) {
            (Feedback::Open, _) => {}
            (_, None) => return Err(Error::NoAutopilot),
            (_, Some(autopilot)) => {
                let gimbals = &autopilot.allocation.gimbals;
                if let Some((engine, _)) = gimbals.iter().find(|(engine, _)| !gimballed[*engine]) {
                    return Err(Error::Locked(vehicle.engines[*engine].path()));
                }
                parts.autopilot(autopilot, if feedback == Feedback::Closed { -1.0 } else { 1.0 });
            }
        }
        let Parts { blocks, sources, signals, names, torques, external, mut outputs } = parts;
        let inputs = names.into_iter().chain(external).collect();
        let gives = torques.iter().map(|&(e, axis)| format!("torque.{}", gimbal(e, axis)));
        outputs.splice(0..0, gives);
        let connection = Interconnection::new(&blocks, inputs, outputs)?;
        let springs = sources.iter().all(|source| match source {
            Source::Actuator(engine, set, axis) => {
                let actuator = vehicle.engines[*engine].actuator(2 * set + axis);
                matches!(actuator.law, Law::SecondOrder(_))
            }
            _ => true,
        });
        let autopilot = vehicle.autopilot.as_ref();
        let at_origin = sources.iter().map(|source| match source {
            Source::Actuator(engine, set, axis) => {
                vehicle.engines[*engine].actuator(2 * set + axis).law.poles_at_origin()
            }
            Source::Path(path, _) => {
                let filters = autopilot.into_iter().flat_map(|a| &a.paths[*path].filters);
                filters.map(|filter| filter.kind.poles_at_origin()).sum()
            }
            Source::Fixed(_) | Source::Axis(_) => 0,
        });
        let at_origin = at_origin.sum();
        let servo = Self {
            at_origin,
            connection,
            sources,
            signals,
            torques,
            slopes: slopes(autopilot, modes)?,
            autopilot: autopilot.map(|a| (a.clone(), ControlLaw::new(a))),
            active: !springs || feedback != Feedback::Open,
        };
        // A draw changes numbers, not which of them are zero: what has no loop now never has one.
        let nominal: Vec<StateSpace> =
            servo.sources.iter().map(|source| servo.nominal(source, vehicle)).collect();
        servo
            .connection
            .find_loop(&nominal)
            .map_or(Ok(()), |ports| Err(Error::AlgebraicLoop(ports)))?;
        Ok(servo)
    }

    /// Whether it adds anything to a model: springs between command and nozzle stand in the model
    /// without it.
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// The autopilot and its law in the frequency domain, if the vehicle has one.
    pub fn autopilot(&self) -> Option<(&Autopilot, &ControlLaw)> {
        self.autopilot.as_ref().map(|(autopilot, law)| (autopilot, law))
    }

    /// Names of the first-order states, for the layout.
    pub fn states(&self) -> &[String] {
        self.connection.states()
    }

    /// Names of the external inputs, the columns of [`Servo::inputs`].
    pub fn externals(&self) -> &[String] {
        &self.connection.inputs()[self.signals.len()..]
    }

    /// The whole of a drawn vehicle: from mechanical signals and external inputs to torques, N·m.
    pub fn compose(&self, drawn: &DrawnVehicle) -> StateSpace {
        self.connection.compose(&self.blocks(drawn)).expect(NO_LOOP)
    }

    /// The blocks of a drawn vehicle.
    fn blocks(&self, drawn: &DrawnVehicle) -> Vec<StateSpace> {
        let block = |source: &Source| match source {
            Source::Actuator(engine, set, axis) => {
                drawn.engines[*engine].actuators[*set][*axis].torque.clone()
            }
            Source::Fixed(system) => system.clone(),
            Source::Path(path, weights) => {
                let draw = &drawn.autopilot.paths[*path];
                let filters = draw.filters.iter();
                path_system(&self.paths()[*path], draw.gain, filters, weights)
            }
            Source::Axis(paths) => self.axis(drawn.autopilot.delay_s, *paths),
        };
        self.sources.iter().map(block).collect()
    }

    /// The part of this servo part in the form of [`super::gradient`], `−ȳ_Θᵀ τ − ȳ_aᵀ (A x_a + B y)`, and
    /// what its gradient follows from; signals, torques and `feedback` as in [`Servo::attach`].
    pub fn form(
        &self,
        drawn: &DrawnVehicle,
        feedback: f64,
        layout: &Layout,
        vectors: &Vectors<'_>,
    ) -> ServoForm {
        let share = |signal: &Signal, rate: bool| {
            let share = if matches!(signal, Signal::Sensor(..)) { feedback } else { 1.0 };
            if rate { vectors.s * share } else { C::from(share) }
        };
        let mut external = vec![C::ZERO; self.connection.inputs().len()];
        for (value, signal) in external.iter_mut().zip(&self.signals) {
            let row = self.row(*signal, drawn, layout);
            let sum: C = row.entries.iter().map(|(at, factor)| vectors.right[*at] * *factor).sum();
            *value = share(signal, row.rate) * sum;
        }
        // Outputs beside the torques weigh nothing.
        let mut weights = vec![C::ZERO; self.connection.outputs().len()];
        for (weight, torque) in weights.iter_mut().zip(&self.torques) {
            *weight = gimbal(layout, *torque).map_or(C::ZERO, |at| -vectors.left[at]);
        }
        let states = layout.first_order();
        let state_weights: Vec<C> = vectors.left[states.clone()].iter().map(|z| -z).collect();
        let local = self
            .connection
            .local(
                &self.blocks(drawn),
                [&vectors.right[states], &external],
                [&weights, &state_weights],
            )
            .expect(NO_LOOP);
        let mut scale = vec![C::ZERO; drawn.autopilot.sensors.len()];
        let mut slope_gain: Vec<Vec<C>> =
            drawn.autopilot.sensors.iter().map(|s| vec![C::ZERO; s.slope_gain.len()]).collect();
        for (signal, by) in self.signals.iter().zip(&local.by_external) {
            let Signal::Sensor(sensor, axis) = *signal else { continue };
            let draw = &drawn.autopilot.sensors[sensor];
            let row = self.sensor_row(sensor, axis, drawn, layout);
            let by = by * share(signal, row.rate);
            for (mode, at) in layout.elastic().enumerate() {
                let slope = vectors.right[at] * self.slopes[sensor][mode][axis as usize];
                slope_gain[sensor][mode] += by * slope * draw.scale;
                scale[sensor] += by * slope * draw.slope_gain[mode];
            }
            if let Some(at) = layout.rotation().nth(axis as usize) {
                scale[sensor] += by * vectors.right[at];
            }
        }
        let members = self.sources.iter().zip(local.members);
        let kept = members.filter_map(|(source, member)| match source {
            Source::Fixed(_) => None,
            source => Some((source.clone(), member)),
        });
        ServoForm { value: local.value, members: kept.collect(), scale, slope_gain }
    }

    /// The part of a path in `form` with the numbers of `draw`, linear in its matrices; zero where the
    /// autopilot does not act.
    pub fn path_part(&self, form: &ServoForm, path: usize, draw: &DrawnPath) -> C {
        let of = form.members.iter().find_map(|(source, member)| match source {
            Source::Path(index, weights) if *index == path => Some((weights, member)),
            _ => None,
        });
        of.map_or(C::ZERO, |(weights, member)| {
            member.part(&path_system(&self.paths()[path], draw.gain, draw.filters.iter(), weights))
        })
    }

    /// The part of all axes in `form` with this loop delay; zero where the autopilot does not act.
    pub fn delay_part(&self, form: &ServoForm, delay_s: f64) -> C {
        let of = form.members.iter().filter_map(|(source, member)| match source {
            Source::Axis(paths) => Some(member.part(&self.axis(delay_s, *paths))),
            _ => None,
        });
        of.sum()
    }

    /// A block as the vehicle has it nominally, with a gain of one on paths.
    fn nominal(&self, source: &Source, vehicle: &Vehicle) -> StateSpace {
        match source {
            Source::Actuator(engine, set, axis) => {
                vehicle.engines[*engine].actuator(2 * set + axis).law.state_space()
            }
            Source::Fixed(system) => system.clone(),
            Source::Path(path, weights) => {
                let path = &self.paths()[*path];
                let draws: Vec<_> = path.filters.iter().map(|f| f.kind.nominal()).collect();
                path_system(path, 1.0, draws.iter(), weights)
            }
            Source::Axis(paths) => {
                self.axis(self.autopilot.as_ref().map_or(0.0, |(a, _)| a.delay_s), *paths)
            }
        }
    }

    fn paths(&self) -> &[Path] {
        self.autopilot.as_ref().map_or(&[], |(autopilot, _)| &autopilot.paths)
    }

    /// The sum of as many paths, delayed.
    fn axis(&self, delay_s: f64, paths: usize) -> StateSpace {
        let order = self.autopilot.as_ref().map_or(1, |(autopilot, _)| autopilot.delay_order);
        delay::pade(delay_s, order).after(&DMatrix::from_element(1, paths, 1.0))
    }

    /// Writes `composite` (see [`Servo::compose`]) into the model: with mechanical signals
    /// y = S_q q + S_v q̇ and torques on the gimbal rotations by H, `K −= Hᵀ D S_q`, `D −= Hᵀ D S_v`,
    /// `K_qa −= Hᵀ C`, `K_aq −= B S_q`, `D_aq −= B S_v`, `K_aa −= A`. The sensors are multiplied by
    /// `feedback` (1 in flight), so that with 0 nothing senses the rigid body.
    pub fn attach(
        &self,
        composite: &StateSpace,
        drawn: &DrawnVehicle,
        feedback: f64,
        layout: &Layout,
        model: &mut Model,
    ) {
        model.at_origin += self.at_origin;
        let first = layout.first_order().start;
        let states = composite.order();
        let rows: Vec<Option<usize>> = self.torques.iter().map(|&t| gimbal(layout, t)).collect();
        for (column, &signal) in self.signals.iter().enumerate() {
            let row = self.row(signal, drawn, layout);
            let share = if matches!(signal, Signal::Sensor(..)) { feedback } else { 1.0 };
            let matrix = if row.rate { &mut model.damping } else { &mut model.stiffness };
            for &(coordinate, factor) in &row.entries {
                let factor = share * factor;
                for (torque, at) in rows.iter().enumerate() {
                    let gain = composite.d[(torque, column)];
                    if let Some(at) = at.filter(|_| gain != 0.0) {
                        matrix[(at, coordinate)] -= gain * factor;
                    }
                }
                for state in 0..states {
                    matrix[(first + state, coordinate)] -= composite.b[(state, column)] * factor;
                }
            }
        }
        for column in 0..states {
            for (torque, at) in rows.iter().enumerate() {
                if let Some(at) = *at {
                    model.stiffness[(at, first + column)] -= composite.c[(torque, column)];
                }
            }
            for row in 0..states {
                model.stiffness[(first + row, first + column)] -= composite.a[(row, column)];
            }
        }
    }

    /// What each external input does to the model: E of `M ẍ + D ẋ + K x = E w`, coordinates ×
    /// [`Servo::externals`].
    pub fn inputs(&self, composite: &StateSpace, layout: &Layout) -> DMatrix<f64> {
        let (from, first) = (self.signals.len(), layout.first_order().start);
        let mut matrix = DMatrix::zeros(layout.coordinates(), self.externals().len());
        for column in 0..matrix.ncols() {
            for (torque, &place) in self.torques.iter().enumerate() {
                if let Some(at) = gimbal(layout, place) {
                    matrix[(at, column)] += composite.d[(torque, from + column)];
                }
            }
            for state in 0..composite.order() {
                matrix[(first + state, column)] += composite.b[(state, from + column)];
            }
        }
        matrix
    }

    /// What a sensor of the autopilot measures about an axis: `scale · (Ψ η + θ)` or its rate, rad or
    /// rad/s; θ only where the rigid body is free.
    ///
    /// # Panics
    /// If the vehicle has no such sensor.
    pub fn sensor_row(
        &self,
        sensor: usize,
        axis: Axis,
        drawn: &DrawnVehicle,
        layout: &Layout,
    ) -> Row {
        let (autopilot, _) = self.autopilot.as_ref().expect("sensors are those of an autopilot");
        let draw = &drawn.autopilot.sensors[sensor];
        let elastic = layout.elastic().zip(self.slopes[sensor].iter().zip(&draw.slope_gain));
        let mut entries: Vec<(usize, f64)> = elastic
            .map(|(at, (slope, gain))| (at, draw.scale * gain * slope[axis as usize]))
            .collect();
        entries.extend(layout.rotation().nth(axis as usize).map(|at| (at, draw.scale)));
        Row { entries, rate: autopilot.sensors[sensor].kind == SensorKind::RateGyro }
    }

    /// What the outputs beside the torques are made of, `feedback.<axis>` where the loop is closed: name,
    /// factors of the mechanical signals' rows and of the first-order states, and of the external inputs.
    pub fn feedbacks<'a>(
        &'a self,
        composite: &'a StateSpace,
        drawn: &'a DrawnVehicle,
        layout: &'a Layout,
    ) -> impl Iterator<Item = (&'a str, Vec<Row>, Vec<f64>)> {
        let names = self.connection.outputs().iter().enumerate().skip(self.torques.len());
        names.map(move |(output, name)| {
            let mut rows: Vec<Row> = (self.signals.iter().enumerate())
                .map(|(column, &signal)| {
                    let mut row = self.row(signal, drawn, layout);
                    let gain = composite.d[(output, column)];
                    row.entries.iter_mut().for_each(|(_, factor)| *factor *= gain);
                    row
                })
                .collect();
            let states = layout.first_order().zip((0..).map(|state| composite.c[(output, state)]));
            rows.push(Row { entries: states.collect(), rate: false });
            let external = self.signals.len()..composite.inputs();
            (name.as_str(), rows, external.map(|input| composite.d[(output, input)]).collect())
        })
    }

    fn row(&self, signal: Signal, drawn: &DrawnVehicle, layout: &Layout) -> Row {
        let of = |engine, axis, rate| {
            let coordinate = gimbal(layout, (engine, axis));
            Row { entries: coordinate.map(|c| (c, 1.0)).into_iter().collect(), rate }
        };
        match signal {
            Signal::Gimbal(engine, axis) => of(engine, axis, false),
            Signal::GimbalRate(engine, axis) => of(engine, axis, true),
            Signal::Sensor(sensor, axis) => self.sensor_row(sensor, axis, drawn, layout),
        }
    }
}

/// Slopes of the modes at the grids of the sensors.
fn slopes(autopilot: Option<&Autopilot>, modes: &ModeSet) -> Result<Vec<Vec<Vector3<f64>>>, Error> {
    let sensors = autopilot.map_or(&[][..], |autopilot| &autopilot.sensors);
    let of = |sensor: &crate::vehicle::Sensor| {
        let grid = modes.grid(&sensor.grid).ok_or_else(|| Error::MissingGrid {
            sensor: sensor.name.clone(),
            grid: sensor.grid.clone(),
            time_s: modes.flight_time_s,
        })?;
        Ok(modes.modes.iter().map(|mode| mode.slope[grid]).collect())
    };
    sensors.iter().map(of).collect()
}

/// Coordinate of a gimbal rotation.
fn gimbal(layout: &Layout, (engine, axis): (usize, usize)) -> Option<usize> {
    layout.gimbal(engine).map(|first| first + axis)
}

/// Weighted inputs, gain and filters in series.
fn path_system<'a>(
    path: &Path,
    gain: f64,
    draws: impl Iterator<Item = &'a FilterDraw>,
    weights: &DMatrix<f64>,
) -> StateSpace {
    let filters = path.filters.iter().zip(draws);
    filters.fold(StateSpace::gain(weights * gain), |system, (filter, draw)| {
        system.then(&filter.kind.state_space(draw))
    })
}
