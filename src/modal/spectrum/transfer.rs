//! The frequency response of a model through its interface: one elimination of motions and other coordinates, and one
//! substitution an input, for eight frequencies at once.
//!
//! For models that are reduced and have no full part; that of any other is `modal::Response`.

use super::lanes::{Complex, Complexes, Kernel, Level, Vector, WIDTH};
use super::pack;
use super::pencil::Pencil;
use crate::dynamics::Model;
use crate::dynamics::servo::Row;
use faer::c64;
use nalgebra::DMatrix;

/// A model driven by `E w` on its right-hand side, with outputs linear in coordinates or rates.
pub struct Transfer {
    level: Level,
    pencil: Pencil,
    /// E, input by input, place by place of the pencil.
    inputs: Vec<Vec<f64>>,
    /// Places and factors of each output, and whether it reads the rates.
    outputs: Vec<(Vec<(usize, f64)>, bool)>,
    solution: Vec<Complexes>,
    core: [Vec<Complexes>; 2],
    /// The response, column-major.
    found: Vec<Complexes>,
}

impl Transfer {
    /// Prepares the response of `model` with the inputs E (coordinates × inputs) and the outputs `rows`; none where the
    /// model has no interface that pays. Outputs read no null state.
    pub fn new(model: &Model, inputs: &DMatrix<f64>, rows: &[Row]) -> Option<Self> {
        let level = Level::best();
        let mut pencil = Pencil::new();
        if !pencil.set(level, model) {
            return None;
        }
        let reduction = pencil.reduction();
        if reduction.count == 0 || reduction.is_full() {
            return None;
        }
        // Operations a frequency, of this and of the Hessenberg form.
        let (modes, signals) = (reduction.elastic.len(), reduction.count + rows.len());
        let substitutions = inputs.ncols() * 4 * modes * signals;
        let ours = 8.0 / 3.0 * reduction.effort(model) + substitutions as f64;
        let theirs = 4.0 * (model.states() as f64).powi(2) * (inputs.ncols() + 1) as f64;
        if !(ours < theirs) {
            return None;
        }
        let logarithms: f64 = reduction.own.iter().map(|own| (own[2] / own[0]).ln() / 2.0).sum();
        let typical = (logarithms / modes as f64).exp();
        if !(typical.is_finite() && typical > 0.0) {
            return None;
        }
        pencil.equilibrate(typical);
        let coordinates = pencil.coordinates();
        let place = |coordinate| coordinates.iter().position(|at| *at == coordinate);
        let columns = inputs.column_iter();
        let inputs: Vec<Vec<f64>> = columns
            .map(|column| coordinates.iter().map(|coordinate| column[*coordinate]).collect())
            .collect();
        let output = |row: &Row| {
            let entries = row.entries.iter();
            let places: Option<Vec<_>> =
                entries.map(|(at, factor)| Some((place(*at)?, *factor))).collect();
            Some((places?, row.rate))
        };
        let outputs = rows.iter().map(output).collect::<Option<Vec<_>>>()?;
        let core = [0, 1].map(|_| vec![Complexes::ZERO; pencil.size()]);
        let solution = vec![Complexes::ZERO; pencil.places()];
        let found = vec![Complexes::ZERO; inputs.len() * outputs.len()];
        Some(Self { level, pencil, inputs, outputs, solution, core, found })
    }

    /// The responses at the complex frequencies `points`, rad/s, outputs × inputs. What else is asked for in one call does
    /// not change a result.
    pub fn at(&mut self, points: &[c64]) -> Vec<DMatrix<c64>> {
        let mut responses = Vec::with_capacity(points.len());
        for chunk in points.chunks(WIDTH) {
            self.level.run(Respond { to: self, points: &pack(chunk) });
            let (outputs, inputs) = (self.outputs.len(), self.inputs.len());
            responses.extend((0..chunk.len()).map(|lane| {
                DMatrix::from_fn(outputs, inputs, |output, input| {
                    let found = &self.found[input * outputs + output];
                    c64::new(found.re[lane], found.im[lane])
                })
            }));
        }
        responses
    }
}

/// The response at eight frequencies at once.
struct Respond<'a> {
    to: &'a mut Transfer,
    points: &'a Complexes,
}

impl Kernel for Respond<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { to, points } = self;
        let Transfer { pencil, inputs, outputs, solution, core, found, .. } = to;
        let s = Complex::<V>::load(points);
        pencil.factor::<V>(points);
        for (input, found) in inputs.iter().zip(found.chunks_exact_mut(outputs.len())) {
            for (to, value) in solution.iter_mut().zip(input) {
                Complex::<V>::splat(*value, 0.0).store(to);
            }
            pencil.solve::<V>(solution, core);
            for ((entries, rate), found) in outputs.iter().zip(found) {
                let mut sums = [Complex::<V>::splat(0.0, 0.0); 2];
                for pair in entries.chunks(2) {
                    for i in 0..pair.len() {
                        let (place, factor) = pair[i];
                        let value = Complex::load(&solution[place]);
                        sums[i] = sums[i].add_real_product(V::splat(factor), value);
                    }
                }
                let sum = sums[0].add(sums[1]);
                if *rate { sum.mul(s) } else { sum }.store(found);
            }
        }
    }
}
