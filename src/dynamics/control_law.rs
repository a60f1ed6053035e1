//! The feedback of the autopilot in the frequency domain: exact, delays included.
//!
//! From sensor signals to the feedback of each axis; the plant between is known to others.

use super::DrawnAutopilot;
use crate::vehicle::{Autopilot, Axis, delay};
use nalgebra::{Complex, DMatrix};

/// The paths of an autopilot with their signals resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlLaw {
    /// Sensor signals in use: sensor and axis.
    signals: Vec<(usize, Axis)>,
    /// Weights of the sensor signals, paths × signals.
    sensed: DMatrix<Complex<f64>>,
    /// Weights of the outputs of other paths, paths × paths.
    chained: DMatrix<Complex<f64>>,
}

impl ControlLaw {
    /// The law of an autopilot.
    pub fn new(autopilot: &Autopilot) -> Self {
        let every = || {
            let sensors = autopilot.sensors.iter().enumerate();
            sensors.flat_map(|(i, sensor)| Axis::ALL.map(|axis| ((i, axis), sensor.signal(axis))))
        };
        let read = |signal: &String| {
            autopilot.paths.iter().any(|path| path.input.iter().any(|(input, _)| input == signal))
        };
        let (signals, names): (Vec<_>, Vec<_>) = every().filter(|(_, name)| read(name)).unzip();
        let paths = &autopilot.paths;
        let weight = |path: usize, signal: &String| {
            let of = paths[path].input.iter().filter(|(input, _)| input == signal);
            Complex::new(of.map(|(_, weight)| weight).sum(), 0.0)
        };
        let outputs: Vec<String> = paths.iter().map(|path| path.signal()).collect();
        let count = paths.len();
        Self {
            sensed: DMatrix::from_fn(count, names.len(), |i, j| weight(i, &names[j])),
            chained: DMatrix::from_fn(count, count, |i, j| weight(i, &outputs[j])),
            signals,
        }
    }

    /// Sensor signals in use, the columns of the response: sensor (index) and axis.
    pub fn signals(&self) -> &[(usize, Axis)] {
        &self.signals
    }

    /// Exact response F at the complex frequency s, rad/s: feedback of roll, pitch and yaw per unit of
    /// each sensor signal, 3 × signals. `None` at a pole of a filter.
    pub fn response(
        &self,
        autopilot: &Autopilot,
        drawn: &DrawnAutopilot,
        s: Complex<f64>,
    ) -> Option<DMatrix<Complex<f64>>> {
        let paths = autopilot.paths.len();
        let mut left = DMatrix::identity(paths, paths);
        let mut right = self.sensed.clone();
        for (i, (path, draw)) in autopilot.paths.iter().zip(&drawn.paths).enumerate() {
            let filters = path.filters.iter().zip(&draw.filters);
            let value: Complex<f64> =
                filters.map(|(filter, draw)| filter.kind.response(draw, s)).product();
            let value = value * draw.gain;
            if !(value.re.is_finite() && value.im.is_finite()) {
                return None;
            }
            right.row_mut(i).iter_mut().for_each(|entry| *entry *= value);
            for j in 0..paths {
                left[(i, j)] -= value * self.chained[(i, j)];
            }
        }
        let outputs = left.lu().solve(&right)?;
        let delay = delay::response(drawn.delay_s, s);
        let mut feedback = DMatrix::zeros(Axis::ALL.len(), self.signals.len());
        for (i, path) in autopilot.paths.iter().enumerate() {
            if let Some(axis) = path.axis {
                for column in 0..self.signals.len() {
                    feedback[(axis as usize, column)] += delay * outputs[(i, column)];
                }
            }
        }
        Some(feedback)
    }
}
