//! The flight control loops of one variant at one flight time: the plant with every loop open, and its
//! margins in a drawn vehicle.
//!
//! What margins are is decided in `margins`; which variants have them by the run definition.

use super::definition::{Definition, LoopPlan, Variant};
use super::evaluator::{Buffers, Sought, find_poles};
use super::plant::{self, Extent};
use super::{Failure, FailureKind};
use crate::dynamics::servo::{self, Row};
use crate::dynamics::{DrawnVehicle, Effects, Feedback, Model, Plant, Servo};
use crate::margins::{self, Assessment, AxisMargins, Peak, assess};
use crate::modal::spectrum::{Base, Transfer};
use crate::modal::{Reference, Response, Solver};
use crate::vehicle::{ModeSet, Vehicle};
use nalgebra::{Complex, DMatrix, Matrix3};
use std::f64::consts::TAU;

/// Peaks in the loops below this are not stored, dB.
pub const LEAST_PEAK_DB: f64 = -60.0;

/// A peak of a mode in a loop, with the motion that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPeak {
    /// The peak.
    pub peak: Peak,
    /// Mode, rigid motion, nozzle, tank or servo with the largest participation in the pole.
    pub motion: String,
}

/// One point of the curve of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Magnitude, dB; −∞ for a loop of nothing.
    pub magnitude_db: f64,
    /// Unwrapped phase, degrees.
    pub phase_deg: f64,
}

/// What is stored of the loops of one evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct Loops {
    /// Closed-loop poles in the right half plane by Nyquist's count.
    pub unstable: i64,
    /// Margins of roll, pitch and yaw.
    pub axes: [AxisMargins; 3],
    /// Peaks of the resonances.
    pub peaks: Vec<NamedPeak>,
    /// Per frequency of the envelopes, roll, pitch and yaw.
    pub curve: Vec<[CurvePoint; 3]>,
}

/// The plant of a variant with every loop open.
pub struct OpenLoop {
    plant: Plant,
    effects: Effects,
    /// Sign of the feedback: −1 where the variant inverts it.
    sign: f64,
    /// Every nominal pole, from which those of cases are found.
    base: Option<Base>,
}

/// What sensors see of the commands.
enum Sensed {
    /// Through the interface of the model.
    Interface(Box<Transfer>),
    /// From its state space.
    States(Box<Response>),
}

impl Sensed {
    /// The responses at these frequencies, rad/s, signals × axes.
    fn at(&mut self, points: &[Complex<f64>]) -> Vec<DMatrix<Complex<f64>>> {
        match self {
            Self::Interface(transfer) => transfer.at(points),
            Self::States(response) => response.at(points),
        }
    }
}

impl OpenLoop {
    /// The open loops of `variant`; `effects` are those of the variant.
    ///
    /// # Errors
    /// Those of its plant; [`servo::Error::NoAutopilot`] where there is nothing to break.
    pub fn new(
        vehicle: &Vehicle,
        set: &ModeSet,
        definition: &Definition,
        variant: &Variant,
        effects: Effects,
    ) -> Result<Self, plant::Error> {
        let extent = Extent { feedback: Feedback::Open, ..Extent::of(variant) };
        let plant = plant::plant(vehicle, set, &definition.gimballed, extent)?;
        if plant.servo.as_ref().and_then(Servo::autopilot).is_none() {
            return Err(servo::Error::NoAutopilot.into());
        }
        let sign = if variant.feedback == Feedback::Inverted { -1.0 } else { 1.0 };
        Ok(Self { plant, effects, sign, base: None })
    }

    /// Has poles found from those of the nominal vehicle, where these can be certified.
    pub fn prove(&mut self, nominal: &DrawnVehicle) {
        let mut model = Model::zeros(self.coordinates());
        self.plant.assemble(nominal, &self.effects, &mut model);
        self.base = Base::proven(&model, &mut Solver::new(self.coordinates()));
    }

    /// Size of its models.
    pub fn coordinates(&self) -> usize {
        self.plant.layout.coordinates()
    }

    /// Assesses the loops of a drawn vehicle; the model of the open loops stays in `buffers`, which are of its size.
    /// `closed` are the poles of the closed loop, `wanted_hz` frequencies at which the curve shall have a sample.
    ///
    /// # Errors
    /// A model that cannot be solved, or loops that cannot be followed.
    pub(super) fn assess(
        &self,
        drawn: &DrawnVehicle,
        buffers: &mut Buffers,
        closed: &[Complex<f64>],
        plan: &LoopPlan,
        wanted_hz: &[f64],
    ) -> Result<Assessment, Failure> {
        let Plant { layout, servo, .. } = &self.plant;
        let servo = servo.as_ref().expect("an open loop has a servo part");
        let (autopilot, law) = servo.autopilot().expect("an open loop has an autopilot");
        self.plant.assemble(drawn, &self.effects, &mut buffers.model);
        let mut poles = Vec::new();
        find_poles(self.base.as_ref(), buffers, Sought::All, &mut poles)?;
        let Buffers { model, solver, .. } = buffers;
        // Axis commands are the first external inputs.
        let inputs = servo.inputs(&servo.compose(drawn), layout).columns(0, 3).into_owned();
        let signals = law.signals().iter();
        let mut rows: Vec<Row> =
            signals.map(|&(sensor, axis)| servo.sensor_row(sensor, axis, drawn, layout)).collect();
        // An attitude is the integral of its rate; read from the rigid rotation itself, which is small among
        // the balanced states, it would lose half of its digits.
        let attitudes: Vec<usize> = (0..rows.len()).filter(|&row| !rows[row].rate).collect();
        rows.iter_mut().for_each(|row| row.rate = true);
        let observed = model.observed(layout.translation());
        let structured = self.base.as_ref().and_then(|_| Transfer::new(&observed, &inputs, &rows));
        let mut sensed = match structured {
            Some(transfer) => Sensed::Interface(Box::new(transfer)),
            None => {
                let space = solver
                    .state_space(&observed, &inputs, &rows)
                    .map_err(|error| Failure::from(&error))?;
                let response = Response::new(&space.a, &space.b, &space.c, &space.d);
                Sensed::States(Box::new(response.map_err(|error| Failure::from(&error))?))
            }
        };
        let one = |s: Complex<f64>, mut sensed: DMatrix<Complex<f64>>| {
            for &row in &attitudes {
                sensed.row_mut(row).iter_mut().for_each(|attitude| *attitude /= s);
            }
            match law.response(autopilot, &drawn.autopilot, s) {
                Some(feedback) => Matrix3::from_fn(|row, column| {
                    let products = (0..rows.len())
                        .map(|signal| feedback[(row, signal)] * sensed[(signal, column)]);
                    self.sign * products.sum::<Complex<f64>>()
                }),
                // At a pole of a filter.
                None => Matrix3::from_element(Complex::new(f64::NAN, f64::NAN)),
            }
        };
        let g = |points: &[Complex<f64>]| {
            points.iter().zip(sensed.at(points)).map(|(s, sensed)| one(*s, sensed)).collect()
        };
        let wanted: Vec<f64> = wanted_hz.iter().map(|hz| TAU * hz).collect();
        assess(g, &poles, closed, &wanted, &plan.settings)
            .map_err(|error| Failure::new(FailureKind::Loop, error.to_string()))
    }

    /// What is stored of an assessment; `buffers` are those it was made with.
    pub(super) fn store(
        &self,
        found: &Assessment,
        buffers: &mut Buffers,
        plan: &LoopPlan,
    ) -> Loops {
        let Buffers { model, solver, .. } = buffers;
        let motions = self.plant.layout.motions();
        let mut named: Option<(Complex<f64>, String)> = None;
        let mut peaks = Vec::new();
        for of_pole in found.peaks.chunk_by(|a, b| a.pole == b.pole) {
            for peak in of_pole.iter().filter(|peak| peak.peak_db >= LEAST_PEAK_DB) {
                let motion = match &named {
                    Some((pole, motion)) if *pole == peak.pole => motion.clone(),
                    _ => motion_of(model, solver, &motions, peak.pole),
                };
                named = Some((peak.pole, motion.clone()));
                peaks.push(NamedPeak { peak: *peak, motion });
            }
        }
        let curve = plan.envelope_hz.iter().map(|hz| point(found, TAU * hz)).collect();
        Loops { unstable: found.unstable, axes: found.axes, peaks, curve }
    }
}

/// The motion with the largest participation in a pole.
fn motion_of(
    model: &Model,
    solver: &mut Solver,
    motions: &[(String, Vec<usize>)],
    pole: Complex<f64>,
) -> String {
    let reference = Reference::new(model, solver.pair(model, pole));
    let shares = motions
        .iter()
        .map(|(name, members)| (name, reference.participation(members.iter().copied())));
    shares.max_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(String::new(), |(name, _)| name.clone())
}

/// The curves at an angular frequency that was wanted.
fn point(found: &Assessment, omega_rad_s: f64) -> [CurvePoint; 3] {
    let curve = &found.curve;
    let place = curve.contour.place(omega_rad_s);
    let index = curve.samples.partition_point(|sample| sample.place < place);
    let index = index.min(curve.samples.len() - 1);
    std::array::from_fn(|axis| CurvePoint {
        magnitude_db: margins::loops::decibels(curve.samples[index].broken[axis]),
        phase_deg: curve.phase_deg[index][axis],
    })
}
