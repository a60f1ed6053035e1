//! A model with its ports as `ẋ = A x + B w`, `y = C x + D w`, for use outside.
//!
//! It holds every state, the null ones included, so that outputs may read them. Poles of the program
//! come from `eigen`.

use super::{Solver, eigen};
use crate::dynamics::servo::Row;
use crate::dynamics::{DrawnVehicle, Layout, Model, Plant};
use crate::vehicle::{Axis, StateSpace};
use nalgebra::DMatrix;

/// A system with named states and ports, SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Realisation {
    /// The matrices.
    pub system: StateSpace,
    /// States: coordinates, their rates with the prefix `d.`, first-order states.
    pub states: Vec<String>,
    /// Inputs: axis and gimbal commands, rad, and load torques on the gimbals, N·m.
    pub inputs: Vec<String>,
    /// Outputs: sensor signals and gimbal rotations, rad and rad/s, and where the loop is closed the
    /// feedback of each axis, rad.
    pub outputs: Vec<String>,
}

impl Realisation {
    /// The realisation of the model that `plant` made of `drawn`.
    ///
    /// # Errors
    /// A model that is not finite, or whose mass matrix is not positive definite.
    pub fn of(plant: &Plant, drawn: &DrawnVehicle, model: &Model) -> Result<Self, eigen::Error> {
        let layout = &plant.layout;
        let mut whole = model.clone();
        whole.null_states.clear();
        whole.null_motion = None;
        let a = Solver::new(layout.coordinates()).state_matrix(&whole)?.clone();

        let gimbals: Vec<(usize, String)> = layout
            .gimbals()
            .map(|at| (at, layout.name(at).trim_start_matches("theta.").to_owned()))
            .collect();
        let composite = plant.servo.as_ref().map(|servo| (servo, servo.compose(drawn)));
        let mut inputs: Vec<String> = Vec::new();
        let mut force = DMatrix::zeros(layout.coordinates(), 0);
        if let Some((servo, composite)) = &composite {
            inputs.extend(servo.externals().iter().cloned());
            force = servo.inputs(composite, layout);
        }
        let commands = inputs.len();
        let mut force = force.resize_horizontally(commands + gimbals.len(), 0.0);
        for (load, (at, name)) in gimbals.iter().enumerate() {
            inputs.push(format!("load.{name}"));
            force[(*at, commands + load)] = 1.0;
        }
        let n = layout.second_order();
        let mass = DMatrix::from_fn(n, n, |i, j| model.mass[(i, j)]);
        let factor = mass.cholesky().ok_or(eigen::Error::SingularMass { pivot: n })?;
        let mut b = DMatrix::zeros(a.nrows(), inputs.len());
        b.rows_mut(n, n).copy_from(&factor.solve(&force.rows(0, n).into_owned()));
        let first_order = layout.coordinates() - n;
        b.rows_mut(2 * n, first_order).copy_from(&force.rows(n, first_order));

        let mut outputs = Outputs { layout, names: Vec::new(), rows: Vec::new() };
        if let Some((servo, composite)) = &composite {
            if let Some((autopilot, _)) = servo.autopilot() {
                for (i, sensor) in autopilot.sensors.iter().enumerate() {
                    for axis in Axis::ALL {
                        let row = servo.sensor_row(i, axis, drawn, layout);
                        outputs.add(sensor.signal(axis), &[row], &[]);
                    }
                }
            }
            outputs.gimbals(&gimbals);
            for (name, rows, external) in servo.feedbacks(composite, drawn, layout) {
                outputs.add(name.to_owned(), &rows, &external);
            }
        } else {
            outputs.gimbals(&gimbals);
        }
        let Outputs { names, rows, .. } = outputs;
        let count = names.len();
        let c = DMatrix::from_fn(count, a.nrows(), |i, j| rows[i].0[j]);
        let d =
            DMatrix::from_fn(count, inputs.len(), |i, j| rows[i].1.get(j).copied().unwrap_or(0.0));
        let states = layout.state_names(&[]);
        Ok(Self { system: StateSpace { a, b, c, d }, states, inputs, outputs: names })
    }
}

/// Outputs as they are gathered: factors of the states, and of the first inputs.
struct Outputs<'a> {
    layout: &'a Layout,
    names: Vec<String>,
    rows: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Outputs<'_> {
    fn add(&mut self, name: String, rows: &[Row], inputs: &[f64]) {
        let n = self.layout.second_order();
        let mut states = vec![0.0; n + self.layout.coordinates()];
        for row in rows {
            for &(at, factor) in &row.entries {
                // States are [q, q̇, x_a].
                let state = if at < n && !row.rate { at } else { n + at };
                states[state] += factor;
            }
        }
        self.names.push(name);
        self.rows.push((states, inputs.to_vec()));
    }

    fn gimbals(&mut self, gimbals: &[(usize, String)]) {
        for (prefix, rate) in [("theta", false), ("d.theta", true)] {
            for (at, name) in gimbals {
                let row = Row { entries: vec![(*at, 1.0)], rate };
                self.add(format!("{prefix}.{name}"), &[row], &[]);
            }
        }
    }
}
