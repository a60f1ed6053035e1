//! What a campaign costs beside its solves: evaluation alone against evaluation with writing, and
//! one thread against two; a whole campaign of the planar pair, tables and summary included. Run
//! with `cargo bench --bench campaign`.

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use std::convert::Infallible;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tvse::campaign::outline::DrawColumn;
use tvse::campaign::planar::{PlanarCampaign, Scatter};
use tvse::campaign::{Evaluator, Outline, Pool, Record, StoredPoles, pool};
use tvse::dispersion::Sampler;
use tvse::dynamics::NozzleJet;
use tvse::dynamics::planar::Parameters;
use tvse::io::{self, Results};

const RUN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/runs/smoke.toml");
const CASES: u64 = 1024;

fn campaign(criterion: &mut Criterion) {
    let mut loaded = io::scenario::load(Path::new(RUN), io::scenario::Reach::Study).expect("read");
    loaded.definition.set_cases(CASES);
    let definition = &loaded.definition;
    let sampler = Sampler::new(&loaded.dispersion, definition.seed);
    let vehicle = &loaded.vehicle.vehicle;
    let evaluator = Evaluator::new(vehicle, &sampler, definition, false).expect("prepared");
    let spans = pool::spans(&definition.populations);
    let evaluate = |population, case| evaluator.evaluate(population, case);
    let go = AtomicBool::new(false);
    let records: Vec<Record> =
        spans.iter().flat_map(|s| s.cases.clone().map(|c| evaluate(s.population, c))).collect();

    let mut group = criterion.benchmark_group("campaign");
    group.sampling_mode(SamplingMode::Flat).sample_size(10).throughput(Throughput::Elements(CASES));
    for jobs in [1, 2] {
        let pool = Pool::new(jobs).expect("threads");
        group.bench_function(format!("evaluate, {jobs} threads"), |b| {
            b.iter(|| {
                let sink = |_| Ok::<(), Infallible>(());
                pool.run(definition, &spans, evaluate, sink, |_| (), &go)
            });
        });
    }
    group.bench_function("write, sum up", |b| {
        b.iter_batched(
            || (tempfile::tempdir().expect("a folder"), records.clone()),
            |(folder, records)| {
                let draws = loaded.dispersion.draws().iter().map(DrawColumn::of).collect();
                let outline =
                    Outline::new(definition.clone(), StoredPoles::Named, draws, Vec::new());
                let mut results =
                    Results::create(&folder.path().join("run"), outline).expect("opened");
                for record in records {
                    results.push(record).expect("written");
                }
                results.finish(1, 10).expect("finished");
                folder
            },
            criterion::BatchSize::PerIteration,
        );
    });
    group.finish();
}

fn planar(criterion: &mut Criterion) {
    const CASES: u64 = 200_000;
    let nominal = Parameters {
        inertia_kg_m2: 1.0,
        actuator_damping_ratio: 0.3,
        actuator_omega_rad_s: 1.2,
        mode_damping_ratio: 0.005,
        mode_omega_rad_s: 1.0,
        coupling: 0.2,
        shape: 1.0,
        slope: 0.0,
        thrust_n: 0.0,
        nozzle_jet: NozzleJet::Off,
        mass_flow_kg_s: 0.0,
        nozzle_length_m: 0.0,
    };
    let scatters = [("thrust", 0.0, 0.4), ("zeta_b", 0.0035, 0.0075), ("omega_n", 1.0, 1.4)];
    let scatters =
        scatters.map(|(name, low, high)| Scatter::new(name, low, high).expect("a parameter"));
    let pair = PlanarCampaign::new(nominal, &scatters, 1);
    let outline = pair.outline(1, CASES, Vec::new());
    let spans = pool::spans(&outline.definition.populations);
    let evaluate = |population, case| pair.evaluate(population, case);
    let go = AtomicBool::new(false);

    let mut group = criterion.benchmark_group("planar pair");
    group.sampling_mode(SamplingMode::Flat).sample_size(10).throughput(Throughput::Elements(CASES));
    for jobs in [1, 2] {
        let pool = Pool::new(jobs).expect("threads").of_small_cases();
        group.bench_function(format!("run and written, {jobs} threads"), |b| {
            b.iter_with_large_drop(|| {
                let folder = tempfile::tempdir().expect("a folder");
                let mut results =
                    Results::create(&folder.path().join("run"), outline.clone()).expect("opened");
                let sink = |record| results.push(record);
                pool.run(&outline.definition, &spans, evaluate, sink, |_| (), &go)
                    .expect("written");
                results.finish(jobs, 10).expect("finished");
                folder
            });
        });
    }
    group.finish();
}

criterion_group!(benches, campaign, planar);
criterion_main!(benches);
