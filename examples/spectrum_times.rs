//! Times of the certified spectrum and of the dense path on dispersed cases of the reference vehicle, for
//! `scripts/bench-eigen`: prints a line a case, and writes its state matrix as raw numbers for LAPACK.
//!
//!     cargo run --release --example spectrum_times -- RUN.toml FOLDER CASES

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock and writes files")]

use std::path::Path;
use std::time::Instant;
use tvse::campaign::Evaluator;
use tvse::io::scenario::{self, Reach};
use tvse::modal::Solver;
use tvse::modal::spectrum::{Base, Spectrum};

/// Repetitions, of which the least time counts: others share the machine.
const REPETITIONS: usize = 15;

fn least(mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..REPETITIONS).map(time).fold(f64::INFINITY, f64::min)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, run, folder, cases] = &arguments[..] else {
        return Err("arguments: RUN.toml FOLDER CASES".into());
    };
    let loaded = scenario::load(Path::new(run), Reach::Study)?;
    let definition = &loaded.definition;
    let sampler = loaded.sampler(definition)?;
    let evaluator = Evaluator::new(&loaded.vehicle.vehicle, &sampler, definition, false)?;
    println!(
        "variant,flight_time_s,case,states,file,structured_s,dense_s,determinants,poles,bound"
    );
    for case in 0..cases.parse()? {
        let mut failed = None;
        evaluator.visit(1, case, |view| {
            let result = || -> Result<(), Box<dyn std::error::Error>> {
                let (variant, time) = (view.evaluation.variant, view.evaluation.flight_time);
                let name = &definition.variants[variant].name;
                let nominal = &evaluator.times[time].variants[variant].nominal;
                let mut solver = Solver::new(view.model.coordinates());
                let base = Base::of(nominal, &mut solver)?;
                let mut spectrum = Spectrum::new();
                let state = solver.state_matrix(view.model)?.clone();
                let file = format!("{name}-{time}-{case}.f64");
                let bytes: Vec<u8> = state.iter().flat_map(|v| v.to_le_bytes()).collect();
                std::fs::write(Path::new(folder).join(&file), bytes)?;
                let certified = spectrum.solve(&base, view.model);
                let structured = least(|| {
                    std::hint::black_box(spectrum.solve(&base, view.model).is_ok());
                });
                let mut poles = Vec::new();
                let dense = least(|| {
                    std::hint::black_box(solver.poles(view.model, &mut poles).is_ok());
                });
                let bound = certified.map_or(f64::NAN, |found| {
                    found.iter().map(|p| p.bound / p.root.norm()).fold(0.0, f64::max)
                });
                let (states, count) = (state.nrows(), poles.len());
                let time = definition.flight_times_s[time];
                let effort = spectrum.evaluations();
                println!("{name},{time},{case},{states},{file},{structured:e},{dense:e},{effort},{count},{bound:e}");
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
