//! Times of the certified spectrum and of the dense path on dispersed cases of the reference vehicle, for
//! `scripts/bench-eigen`: prints a line a case, and writes its state matrix as raw numbers for LAPACK.
//!
//!     cargo run --release --example spectrum_times -- RUN.toml FOLDER CASES [MODES]
//!
//! With a number of modes the stick model of the reference vehicle is solved for as many at 105 s, and engines that
//! are not gimballed are left out.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock and writes files")]

use nalgebra::Complex;
use std::cell::RefCell;
use std::path::Path;
use std::time::Instant;
use tvse::campaign::Evaluator;
use tvse::dispersion::Sampler;
use tvse::dynamics::Model;
use tvse::io::scenario::{self, Reach};
use tvse::modal::Solver;
use tvse::modal::spectrum::lanes::{Kernel, Level, Vector, WIDTH};
use tvse::modal::spectrum::{Base, Spectrum};
use tvse::structure::{self, Selection, Stick};
use tvse::vehicle::Vehicle;

/// Repetitions, of which the least time counts: others share the machine.
const REPETITIONS: usize = 15;

fn least(work: impl FnMut()) -> f64 {
    least_after(|| (), work)
}

/// The least time, each after something that is not counted.
fn least_after(mut before: impl FnMut(), mut work: impl FnMut()) -> f64 {
    let time = |_| {
        before();
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..REPETITIONS).map(time).fold(f64::INFINITY, f64::min)
}

/// Products and sums of independent numbers, as many as registers hold.
struct Peak(usize);

impl Kernel for Peak {
    type Output = f64;

    #[inline(always)]
    fn run<V: Vector>(self) -> f64 {
        let factor = V::splat(1.0 - f64::EPSILON);
        let mut sums = [V::splat(1.0); 24];
        for _ in 0..self.0 {
            for sum in &mut sums {
                *sum = sum.mul_add(factor, factor);
            }
        }
        let mut stored = [0.0; WIDTH];
        sums.into_iter().fold(V::splat(0.0), V::add).store(&mut stored);
        stored[0]
    }
}

/// Operations a second that the core can do.
fn peak() -> f64 {
    const TURNS: usize = 100_000;
    let time = least(|| {
        std::hint::black_box(Level::best().run(Peak(std::hint::black_box(TURNS))));
    });
    (2 * 24 * WIDTH * TURNS) as f64 / time
}

/// Gives the vehicle as many modes, and leaves it the gimballed engines only.
fn with_modes(vehicle: &mut Vehicle, gimballed: &[bool], count: usize) -> Result<(), String> {
    let stick = include_str!("../vehicles/sls-like/stick.toml");
    let stick = Stick::parse(stick, "stick.toml").map_err(|e| e.to_string())?;
    let thresholds = structure::Thresholds::default();
    let named = &vehicle.named_modes[0].labels;
    let set = vehicle.modal.at(TIME_S).ok_or("no such flight time")?;
    let frequency = named.iter().find_map(|label| Some(set.modes[set.mode(label)?].frequency_hz));
    let frequency = frequency.ok_or("no such mode")?;
    let (modal, _) = structure::solve(&stick, &[TIME_S], Selection::Count(count), &thresholds)
        .map_err(|e| e.to_string())?;
    let near = |mode: &&tvse::vehicle::Mode| (mode.frequency_hz - frequency).abs() < 1e-3;
    let label = modal.sets[0].modes.iter().find(near).ok_or("the mode is not there")?.label.clone();
    vehicle.named_modes[0].labels = vec![label];
    vehicle.modal = modal;
    let mut gimballed = gimballed.iter();
    vehicle.engines.retain(|_| gimballed.next().is_some_and(|gimballed| *gimballed));
    Ok(())
}

/// Flight time of the model with a number of modes, s.
const TIME_S: f64 = 105.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let (run, folder, cases, modes) = match &arguments[..] {
        [_, run, folder, cases] => (run, folder, cases, None),
        [_, run, folder, cases, modes] => (run, folder, cases, Some(modes.parse::<usize>()?)),
        _ => return Err("arguments: RUN.toml FOLDER CASES [MODES]".into()),
    };
    let mut loaded = scenario::load(Path::new(run), Reach::Study)?;
    let mut definition = loaded.definition.clone();
    if let Some(modes) = modes {
        with_modes(&mut loaded.vehicle.vehicle, &definition.gimballed, modes)?;
        definition.gimballed.retain(|gimballed| *gimballed);
        definition.flight_times_s = vec![TIME_S];
        definition.variants.retain(|v| ["no_jet_damping", "jet_damping"].contains(&&*v.name));
    }
    let definition = &definition;
    let drawn = include_str!("../dispersions/reference.toml");
    let dispersion =
        tvse::scenario::dispersion::read("reference.toml", drawn, &loaded.vehicle.vehicle)
            .map_err(|e| e.to_string())?;
    let sampler = match modes {
        Some(_) => Sampler::new(&dispersion, definition.seed),
        None => loaded.sampler(definition)?,
    };
    let evaluator = Evaluator::new(&loaded.vehicle.vehicle, &sampler, definition, false)?;
    println!(
        "variant,flight_time_s,case,states,file,structured_s,some_s,all_s,dense_s,determinants,poles,bound,certificate,operations,peak"
    );
    let peak = peak();
    let mut before: Vec<(Base, Model)> = Vec::new();
    for case in 0..cases.parse()? {
        let mut failed = None;
        evaluator.visit(1, case, |view| {
            let mut result = || -> Result<(), Box<dyn std::error::Error>> {
                let (variant, time) = (view.evaluation.variant, view.evaluation.flight_time);
                let name = &definition.variants[variant].name;
                let nominal = &evaluator.times[time].variants[variant].nominal;
                let size = view.model.coordinates();
                let mut solver = Solver::new(size);
                let base = Base::of(nominal, &mut solver)?;
                let mut spectrum = Spectrum::new();
                let state = solver.state_matrix(view.model)?.clone();
                let file = format!("{name}-{time}-{case}.f64");
                let bytes: Vec<u8> = state.iter().flat_map(|v| v.to_le_bytes()).collect();
                std::fs::write(Path::new(folder).join(&file), bytes)?;
                let certified = spectrum.solve(&base, view.model);
                let mode = evaluator.times[time].variants[variant].references[0].predict(view.model);
                // Each time after the model that a campaign solves before it in the same buffers: that of the
                // variant before, or of another vehicle; and with the model just written, as there.
                let spectrum = RefCell::new(spectrum);
                let model = RefCell::new(view.model.clone());
                let last = before.iter().position(|(_, model)| model.coordinates() == size);
                let (other_base, other_model) = match last {
                    Some(last) => before.swap_remove(last),
                    None => (base.clone(), nominal.clone()),
                };
                let other = || {
                    let mut spectrum = spectrum.borrow_mut();
                    let found = spectrum.solve_near(&other_base, &other_model, &[mode], 4);
                    std::hint::black_box(found.is_ok());
                    let mut model = model.borrow_mut();
                    model.mass.copy_from(&view.model.mass);
                    model.damping.copy_from(&view.model.damping);
                    model.stiffness.copy_from(&view.model.stiffness);
                };
                let structured = least_after(other, || {
                    let (mut spectrum, model) = (spectrum.borrow_mut(), model.borrow());
                    std::hint::black_box(spectrum.solve(&base, &model).is_ok());
                });
                let with_vectors = |near: Option<usize>| {
                    let mut given = 0;
                    let time = least_after(other, || {
                        let (mut spectrum, model) = (spectrum.borrow_mut(), model.borrow());
                        let found = match near {
                            Some(count) => spectrum.solve_near(&base, &model, &[mode], count),
                            None => spectrum.solve(&base, &model),
                        };
                        let mut poles: Vec<_> = found.iter().flatten().map(|p| p.root).collect();
                        if let Some(count) = near {
                            let distance = |pole: &Complex<f64>| (pole - mode).norm();
                            poles.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
                            poles.truncate(count);
                        }
                        given = std::hint::black_box(spectrum.vectors(&model, &poles).len());
                    });
                    // A model that is not reduced has none from its structure.
                    if given > 0 { time } else { f64::NAN }
                };
                let (some, all) = (with_vectors(Some(16)), with_vectors(None));
                let spectrum = spectrum.into_inner();
                let kind = match (spectrum.is_refined(), certified.is_ok()) {
                    (_, false) => "none",
                    (true, _) => "residual",
                    (false, _) => "discs",
                };
                let mut poles = Vec::new();
                let dense = least(|| {
                    std::hint::black_box(solver.poles(view.model, &mut poles).is_ok());
                });
                let bound = certified.map_or(f64::NAN, |found| {
                    found.iter().map(|p| p.bound / p.root.norm()).fold(0.0, f64::max)
                });
                let (states, count) = (state.nrows(), poles.len());
                let time = definition.flight_times_s[time];
                before.push((base, view.model.clone()));
                let (effort, operations) = (spectrum.evaluations(), spectrum.operations(view.model));
                println!("{name},{time},{case},{states},{file},{structured:e},{some:e},{all:e},{dense:e},{effort},{count},{bound:e},{kind},{operations:e},{peak:e}");
                Ok(())
            };
            failed = result().err().or(failed.take());
        });
        if let Some(error) = failed {
            return Err(error);
        }
    }
    Ok(())
}
