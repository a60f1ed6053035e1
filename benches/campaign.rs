//! What a campaign costs beside its solves: evaluation alone against evaluation with writing, and
//! one thread against two. Run with `cargo bench --bench campaign`.

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use std::convert::Infallible;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tvse::campaign::outline::DrawColumn;
use tvse::campaign::{Evaluator, Outline, Pool, Record, StoredPoles, pool};
use tvse::dispersion::Sampler;
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

criterion_group!(benches, campaign);
criterion_main!(benches);
