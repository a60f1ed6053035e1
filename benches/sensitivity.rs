//! What eigenvalue derivatives cost beside the solve they belong to, how many corners a second are
//! evaluated, and what a search to convergence takes, on the reference vehicle: run with
//! `cargo bench --bench sensitivity`.

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tvse::campaign::worst::{self, Aim, Objective, Quantity};
use tvse::campaign::{Definition, Evaluator, SensitivityRule, Variant};
use tvse::dispersion::Sampler;
use tvse::io::scenario::{self, Loaded};

const RUN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/runs/closed-loop.toml");
/// Cases of a sample.
const CASES: u64 = 16;

fn loaded() -> Loaded {
    scenario::load(Path::new(RUN), scenario::Reach::Study).expect("read")
}

/// The run at 105 s in one variant, with or without derivatives.
fn definition(loaded: &Loaded, variant: &Variant, derivatives: bool) -> Definition {
    let rule = SensitivityRule { variants: vec![0], flight_times: vec![0], cases: None };
    Definition {
        flight_times_s: vec![105.0],
        variants: vec![variant.clone()],
        margins: None,
        sensitivity: derivatives.then_some(rule),
        ..loaded.definition.clone()
    }
}

/// The elastic vehicle, and the one with all effects and the loop closed.
fn variants(loaded: &Loaded) -> [Variant; 2] {
    let named = |name: &str| loaded.definition.variants.iter().find(|v| v.name == name);
    let closed = named("closed").expect("of the run").clone();
    let open = named("open").expect("of the run").clone();
    let elastic = Variant {
        name: "elastic".into(),
        rigid_body: false,
        slosh: false,
        aerodynamics: false,
        ..open
    };
    [elastic, closed]
}

fn derivatives(criterion: &mut Criterion) {
    let loaded = loaded();
    let mut group = criterion.benchmark_group("derivatives");
    group.sampling_mode(SamplingMode::Flat).sample_size(10).throughput(Throughput::Elements(CASES));
    for variant in variants(&loaded) {
        for derivatives in [false, true] {
            let definition = definition(&loaded, &variant, derivatives);
            let sampler = Sampler::new(&loaded.dispersion, definition.seed);
            let vehicle = &loaded.vehicle.vehicle;
            let evaluator =
                Evaluator::new(vehicle, &sampler, &definition, false).expect("prepared");
            let what = if derivatives { "with derivatives" } else { "alone" };
            group.bench_function(format!("{}, {what}", variant.name), |b| {
                b.iter(|| (0..CASES).map(|case| evaluator.evaluate(1, case)).collect::<Vec<_>>());
            });
        }
    }
    group.finish();
}

fn search(criterion: &mut Criterion) {
    let loaded = loaded();
    let dispersion = &loaded.dispersion;
    let [elastic, _] = variants(&loaded);
    let definition = definition(&loaded, &elastic, false);
    let sampler = Sampler::new(dispersion, definition.seed);
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, &definition, false).expect("prepared");
    let aim = Aim { variant: 0, baseline: None, mode: 0, quantity: Quantity::DampingRatio };
    let mut group = criterion.benchmark_group("worst");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.throughput(Throughput::Elements(1));
    let objective = Objective { evaluator: &evaluator, dispersion, aim, flight_time: 0 };
    let corner: Vec<Option<f64>> =
        (0..dispersion.draws().len()).map(|i| Some(if i % 2 == 0 { 3.0 } else { -3.0 })).collect();
    group.bench_function("corner", |b| b.iter(|| objective.value(&corner).expect("solved")));
    let go = AtomicBool::new(false);
    let plan = |corner_keys| worst::Plan {
        aim,
        flight_times: vec![0],
        box_sigma: 3.0,
        radius_sigma: 3.0,
        corner_keys,
        starts: Vec::new(),
    };
    for (name, keys) in [("search to convergence", 0), ("search and 256 corners", 8)] {
        group.bench_function(name, |b| {
            b.iter(|| {
                worst::search(&evaluator, dispersion, &definition, &plan(keys), &go).expect("found")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, derivatives, search);
criterion_main!(benches);
