//! What each layer of an evaluation costs, by number of elastic modes, on the reference vehicle's
//! stick model at 105 s with both boosters gimballed: run with `cargo bench --bench layers`.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use tvse::campaign::{Definition, Evaluator, LoopPlan, NozzleJet, Population, Slope, Variant};
use tvse::dispersion::Sampler;
use tvse::dynamics::{Feedback, Model};
use tvse::io::scenario::Reach;
use tvse::margins::Settings;
use tvse::modal::Solver;
use tvse::modal::identify::{self, Solved};
use tvse::modal::spectrum::{Base, Spectrum};
use tvse::structure::{self, Selection, Stick};
use tvse::vehicle::Vehicle;

const TIME_S: f64 = 105.0;
const VEHICLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/vehicles/sls-like");
const DISPERSION: &str = include_str!("../dispersions/reference.toml");

/// The reference vehicle with this number of elastic modes; the mode of interest by frequency.
fn vehicle(modes: usize) -> Vehicle {
    let mut vehicle =
        tvse::io::scenario::vehicle(VEHICLE.as_ref(), Reach::Study).expect("read").resolved.vehicle;
    let stick = include_str!("../vehicles/sls-like/stick.toml");
    let stick = Stick::parse(stick, "stick.toml").expect("parsed");
    let thresholds = structure::Thresholds::default();
    let (modal, _) =
        structure::solve(&stick, &[TIME_S], Selection::Count(modes), &thresholds).expect("solved");
    let near = |mode: &&tvse::vehicle::Mode| (mode.frequency_hz - 5.2045).abs() < 1e-3;
    let label = modal.sets[0].modes.iter().find(near).expect("the TVSE mode").label.clone();
    vehicle.named_modes[0].labels = vec![label];
    vehicle.modal = modal;
    vehicle
}

fn definition(vehicle: &Vehicle) -> Definition {
    let population = |name: &str, cases, drawn| Population {
        name: name.to_owned(),
        cases,
        fixed: Vec::new(),
        drawn,
        scheme: Default::default(),
    };
    Definition {
        name: "bench".to_owned(),
        seed: 1,
        populations: vec![population("nominal", 1, false), population("dispersed", 1000, true)],
        flight_times_s: vec![TIME_S],
        variants: vec![Variant {
            name: "jet_damping".to_owned(),
            thrust: true,
            case_jet_damping: true,
            nozzle_jet_damping: NozzleJet::Linear,
            follower_thrust: false,
            slope: Slope::VirtualGrid,
            rigid_body: false,
            slosh: false,
            aerodynamics: false,
            feedback: tvse::dynamics::servo::Feedback::Open,
            actuators: None,
        }],
        modes: vec!["tvse".to_owned()],
        gimballed: vehicle.engines.iter().map(|e| e.group == "booster").collect(),
        exchange_ratio: 0.5,
        solver: tvse::campaign::definition::Solver::Structured,
        sensitivity: None,
        margins: None,
    }
}

fn layers(criterion: &mut Criterion) {
    for modes in [20, 40, 58, 120] {
        let vehicle = vehicle(modes);
        let definition = definition(&vehicle);
        let dispersion =
            tvse::scenario::dispersion::read("reference.toml", DISPERSION, &vehicle).expect("read");
        let sampler = Sampler::new(&dispersion, definition.seed);
        let evaluator = Evaluator::new(&vehicle, &sampler, &definition, false).expect("prepared");
        let at = &evaluator.times[0];
        let (nominal, reference) = (&at.variants[0].nominal, &at.variants[0].references[0]);
        let mut model = Model::zeros(nominal.coordinates());
        evaluator.visit(1, 7, |view| model = view.model.clone());
        let mut solver = Solver::new(model.coordinates());
        let mut poles = Vec::new();
        solver.poles(&model, &mut poles).expect("solved");

        let mut group = criterion.benchmark_group("layer");
        let id = |layer: &str| BenchmarkId::new(layer, modes);
        group.bench_function(id("draw"), |b| {
            let mut cursor = sampler.cursor();
            let mut case = 0;
            b.iter(|| {
                case += 1;
                black_box(cursor.draw(case, &[], true).effects.len())
            });
        });
        group.bench_function(id("build"), |b| b.iter(|| evaluator.assemble(0, 0, &mut model)));
        evaluator.visit(1, 7, |view| model = view.model.clone());
        group.bench_function(id("state matrix"), |b| {
            b.iter(|| black_box(solver.state_matrix(&model).expect("solved").trace()));
        });
        let state = solver.state_matrix(&model).expect("solved").clone();
        group.bench_function(id("balance"), |b| {
            b.iter(|| {
                let mut state = state.clone();
                black_box(nalgebra::linalg::balancing::balance_parlett_reinsch(&mut state))
            });
        });
        group.bench_function(id("solve (all of it)"), |b| {
            b.iter(|| solver.poles(&model, &mut poles).expect("solved"));
        });
        if let Some(base) = Base::proven(nominal, &mut solver) {
            let mut spectrum = Spectrum::new();
            group.bench_function(id("certified spectrum"), |b| {
                b.iter(|| spectrum.solve(&base, &model).expect("certified"));
            });
        }
        let mut scratch = Model::zeros(model.coordinates());
        group.bench_function(id("identify"), |b| {
            b.iter(|| {
                let mut case = Solved::new(&model, &poles);
                identify::identify(&mut solver, reference, nominal, &mut case, 0.5, &mut scratch)
                    .expect("identified")
            });
        });
        let mut case = 0;
        group.bench_function(id("evaluation (all of it)"), |b| {
            b.iter(|| {
                case = (case + 1) % 1000;
                evaluator.evaluate(1, case)
            });
        });
        group.finish();
    }
}

/// What the loops cost: an evaluation with the loops open, closed, and closed with its margins.
fn loops(criterion: &mut Criterion) {
    let vehicle =
        tvse::io::scenario::vehicle(VEHICLE.as_ref(), Reach::Study).expect("read").resolved.vehicle;
    let dispersion =
        tvse::scenario::dispersion::read("reference.toml", DISPERSION, &vehicle).expect("read");
    let mut group = criterion.benchmark_group("loops");
    for (name, feedback, margins) in [
        ("open", Feedback::Open, false),
        ("closed", Feedback::Closed, false),
        ("closed with margins", Feedback::Closed, true),
    ] {
        let mut definition = definition(&vehicle);
        let variant = &mut definition.variants[0];
        (variant.rigid_body, variant.slosh, variant.feedback) = (true, true, feedback);
        definition.margins = margins.then(|| LoopPlan {
            settings: Settings::default(),
            variants: vec![0],
            envelope_hz: Vec::new(),
        });
        let sampler = Sampler::new(&dispersion, definition.seed);
        let evaluator = Evaluator::new(&vehicle, &sampler, &definition, false).expect("prepared");
        let mut case = 0;
        group.bench_function(name, |b| {
            b.iter(|| {
                case = (case + 1) % 1000;
                evaluator.evaluate(1, case)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, layers, loops);
criterion_main!(benches);
