//! The blocks of a servo part as they are gathered: their ports by name, and what each is made of.
//!
//! How they are connected and written into a model is known to `servo`.

use crate::dynamics::interconnection::Block;
use crate::vehicle::{Autopilot, Axis, Path, StateSpace, Vehicle};
use nalgebra::DMatrix;

/// What a block is made of.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Source {
    /// Engine, set, axis.
    Actuator(usize, usize, usize),
    /// A matrix that no draw changes.
    Fixed(StateSpace),
    /// A path, with the weights of its inputs.
    Path(usize, DMatrix<f64>),
    /// Sum of as many paths and loop delay.
    Axis(usize),
}

/// A mechanical signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Signal {
    /// Rotation of a gimbal: engine, axis.
    Gimbal(usize, usize),
    /// Its rate.
    GimbalRate(usize, usize),
    /// A sensor about an axis.
    Sensor(usize, Axis),
}

/// Names `prefix.<n>`, n from 1.
fn numbered(prefix: &str, count: usize) -> impl Iterator<Item = String> {
    (1..=count).map(move |n| format!("{prefix}.{n}"))
}

/// `command.<axis>` and the like.
pub(super) fn axes(prefix: &str) -> Vec<String> {
    Axis::ALL.map(|axis| format!("{prefix}.{}", axis.name())).to_vec()
}

/// Blocks as they are gathered.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) blocks: Vec<Block>,
    pub(super) sources: Vec<Source>,
    pub(super) signals: Vec<Signal>,
    /// Names of the mechanical signals.
    pub(super) names: Vec<String>,
    pub(super) torques: Vec<(usize, usize)>,
    pub(super) external: Vec<String>,
    /// Outputs beside the torques.
    pub(super) outputs: Vec<String>,
}

impl Parts {
    fn add(
        &mut self,
        name: String,
        inputs: Vec<String>,
        outputs: Vec<String>,
        states: Vec<String>,
        source: Source,
    ) {
        self.blocks.push(Block { name, inputs, outputs, states });
        self.sources.push(source);
    }

    pub(super) fn actuator(&mut self, vehicle: &Vehicle, [e, set, axis]: [usize; 3], gimbal: &str) {
        let engine = &vehicle.engines[e];
        let actuator = engine.actuator(2 * set + axis);
        let name = format!("actuator.{}.{}", engine.path(), actuator.name);
        let (angle, rate) = (format!("theta.{gimbal}"), format!("d.theta.{gimbal}"));
        self.signals.extend([Signal::Gimbal(e, axis), Signal::GimbalRate(e, axis)]);
        self.names.extend([angle.clone(), rate.clone()]);
        self.torques.push((e, axis));
        self.external.push(format!("gimbal.{gimbal}"));
        let states = numbered(&name, actuator.law.order()).collect();
        let inputs = vec![format!("gimbal.{gimbal}"), angle, rate];
        let output = vec![format!("torque.{gimbal}")];
        self.add(name, inputs, output, states, Source::Actuator(e, set, axis));
    }

    pub(super) fn allocation(
        &mut self,
        autopilot: &Autopilot,
        gimballed: &[bool],
        gimbal: impl Fn(usize, usize) -> String,
    ) {
        let allocation = &autopilot.allocation;
        let free: Vec<usize> = (0..allocation.gimbals.len())
            .filter(|&row| gimballed[allocation.gimbals[row].0])
            .collect();
        let of = |&row: &usize| {
            let (engine, axis) = allocation.gimbals[row];
            format!("gimbal.{}", gimbal(engine, axis))
        };
        let matrix = DMatrix::from_fn(free.len(), 3, |i, j| allocation.matrix[free[i]][j]);
        let outputs = free.iter().map(of).collect();
        let source = Source::Fixed(StateSpace::gain(matrix));
        self.add("allocation".into(), axes("command"), outputs, Vec::new(), source);
    }

    /// Paths, the sum of each axis with the loop delay, and the sign with which it joins the command.
    pub(super) fn autopilot(&mut self, autopilot: &Autopilot, sign: f64) {
        for (i, sensor) in autopilot.sensors.iter().enumerate() {
            for axis in Axis::ALL {
                let name = sensor.signal(axis);
                let mut inputs = autopilot.paths.iter().flat_map(|path| &path.input);
                if inputs.any(|(input, _)| *input == name) {
                    self.signals.push(Signal::Sensor(i, axis));
                    self.names.push(name);
                }
            }
        }
        for (i, path) in autopilot.paths.iter().enumerate() {
            let weights = path.input.iter().map(|(_, weight)| *weight);
            let weights = DMatrix::from_iterator(1, path.input.len(), weights);
            let inputs = path.input.iter().map(|(signal, _)| signal.clone()).collect();
            let name = path.signal();
            let mut states = Vec::new();
            for filter in &path.filters {
                states.extend(numbered(&format!("{name}.{}", filter.name), filter.kind.order()));
            }
            self.add(name.clone(), inputs, vec![name], states, Source::Path(i, weights));
        }
        // An axis without a path has no feedback.
        let mut feedback = Vec::new();
        let mut command = Vec::new();
        for axis in Axis::ALL {
            let paths = autopilot.paths.iter().filter(|path| path.axis == Some(axis));
            let inputs: Vec<String> = paths.map(Path::signal).collect();
            if inputs.is_empty() {
                continue;
            }
            let output = format!("feedback.{}", axis.name());
            let order = if autopilot.delay_s == 0.0 { 0 } else { autopilot.delay_order };
            let states = numbered(&format!("{output}.delay"), order).collect();
            let source = Source::Axis(inputs.len());
            self.add(output.clone(), inputs, vec![output.clone()], states, source);
            feedback.push(output);
            command.push(format!("command.{}", axis.name()));
        }
        let sign = DMatrix::identity(feedback.len(), feedback.len()) * sign;
        let source = Source::Fixed(StateSpace::gain(sign));
        self.outputs.extend(feedback.iter().cloned());
        self.add("loop".into(), feedback, command, Vec::new(), source);
    }
}
