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
    /// Paths, each with those that it reads, in an order in which these come before; none where some read each other.
    order: Option<Vec<(usize, Vec<usize>)>>,
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
        let chained = DMatrix::from_fn(count, count, |i, j| weight(i, &outputs[j]));
        Self {
            sensed: DMatrix::from_fn(count, names.len(), |i, j| weight(i, &names[j])),
            order: order(&chained),
            chained,
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
        let mut values = Vec::with_capacity(autopilot.paths.len());
        for (path, draw) in autopilot.paths.iter().zip(&drawn.paths) {
            let filters = path.filters.iter().zip(&draw.filters);
            let value: Complex<f64> =
                filters.map(|(filter, draw)| filter.kind.response(draw, s)).product();
            let value = value * draw.gain;
            if !(value.re.is_finite() && value.im.is_finite()) {
                return None;
            }
            values.push(value);
        }
        let outputs = self.outputs(&values)?;
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

    /// Outputs of the paths, paths × signals, for the response of each path; none where paths that read each other have
    /// no solution.
    fn outputs(&self, values: &[Complex<f64>]) -> Option<DMatrix<Complex<f64>>> {
        let mut outputs = self.sensed.clone();
        if let Some(order) = &self.order {
            for (i, read) in order {
                for column in 0..outputs.ncols() {
                    let mut input = outputs[(*i, column)];
                    for j in read {
                        input += self.chained[(*i, *j)] * outputs[(*j, column)];
                    }
                    outputs[(*i, column)] = values[*i] * input;
                }
            }
            return Some(outputs);
        }
        let mut left = DMatrix::identity(values.len(), values.len());
        for (i, &value) in values.iter().enumerate() {
            outputs.row_mut(i).iter_mut().for_each(|entry| *entry *= value);
            for j in 0..values.len() {
                left[(i, j)] -= value * self.chained[(i, j)];
            }
        }
        left.lu().solve(&outputs)
    }
}

/// An order in which every path comes after those it reads, with these.
fn order(chained: &DMatrix<Complex<f64>>) -> Option<Vec<(usize, Vec<usize>)>> {
    let count = chained.nrows();
    let reads = |i: usize| (0..count).filter(move |j| chained[(i, *j)] != Complex::ZERO);
    let mut order: Vec<(usize, Vec<usize>)> = Vec::with_capacity(count);
    while order.len() < count {
        let done = |i: usize| order.iter().any(|(path, _)| *path == i);
        let next = (0..count).find(|i| !done(*i) && reads(*i).all(done))?;
        order.push((next, reads(next).collect()));
    }
    Some(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_in_order_give_what_solving_for_all_gives() {
        let complex = |x: f64| Complex::new(x, 0.0);
        // The third reads the first and a sensor, the second the third.
        let chained = DMatrix::from_row_slice(3, 3, &[0., 0., 0., 0., 0., 2., -0.5, 0., 0.]);
        let sensed = DMatrix::from_row_slice(3, 2, &[1., 0., 0., 3., 0.5, 0.]);
        let (sensed, chained) = (sensed.map(complex), chained.map(complex));
        let values = [Complex::new(0.3, -1.0), Complex::new(2.0, 0.7), Complex::new(-0.1, 0.4)];
        let mut law = ControlLaw { signals: Vec::new(), sensed, order: order(&chained), chained };
        assert_eq!(law.order, Some(vec![(0, vec![]), (2, vec![0]), (1, vec![2])]));
        let by_order = law.outputs(&values).expect("regular");
        law.order = None;
        let by_solution = law.outputs(&values).expect("regular");
        assert!((by_order - by_solution).norm() < 1e-14);
    }

    #[test]
    fn paths_that_read_each_other_have_no_order() {
        let chained = DMatrix::from_row_slice(3, 3, &[0., 1., 0., 0., 0., 2., -0.5, 0., 0.]);
        assert_eq!(order(&chained.map(|x| Complex::new(x, 0.0))), None);
        assert_eq!(order(&DMatrix::from_element(1, 1, Complex::new(0.5, 0.0))), None);
    }
}
