//! The parallel pool: evaluates cases on all threads and hands their records over in order.
//!
//! What a case is and where its record goes is decided by the caller; nothing here depends on the
//! number of threads but the time it takes.

use super::definition::{Definition, Population};
use super::record::{Evaluation, Failure, FailureKind, Record};
use std::any::Any;
use std::collections::VecDeque;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

/// Cases handed to a thread at once: few, so that the last ones are shared out evenly.
const BLOCK: usize = 4;
/// Cases handed to a thread at once where one takes microseconds, less than handing it over.
const LARGE_BLOCK: usize = 256;
/// Blocks in flight for each thread; they bound the memory and let the threads work on while
/// records are written.
const BLOCKS_PER_THREAD: usize = 8;

/// What the names of a pool's threads begin with.
pub const THREAD: &str = "case-";

/// Consecutive cases of one population.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// Index of the population.
    pub population: usize,
    /// Case indices.
    pub cases: Range<u64>,
}

/// Every case of every population, in canonical order.
pub fn spans(populations: &[Population]) -> Vec<Span> {
    let all = populations.iter().enumerate();
    all.map(|(population, p)| Span { population, cases: 0..p.cases }).collect()
}

/// One of several parts of a campaign with about the same number of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Its number, from 1.
    pub number: u64,
    /// Number of parts.
    pub of: u64,
}

impl Part {
    /// The cases of the part: consecutive ones of all populations in canonical order.
    pub fn spans(self, populations: &[Population]) -> Vec<Span> {
        let total: u64 = populations.iter().map(|p| p.cases).sum();
        let bound =
            |number: u64| (u128::from(total) * u128::from(number) / u128::from(self.of)) as u64;
        let (from, to) = (bound(self.number - 1), bound(self.number));
        let mut before = 0;
        let mut found = Vec::new();
        for span in spans(populations) {
            let cases = span.cases.end;
            let inside = |case: u64| case.saturating_sub(before).min(cases);
            if inside(from) < inside(to) {
                found.push(Span { cases: inside(from)..inside(to), ..span });
            }
            before += cases;
        }
        found
    }
}

/// How far a run has come; counts of cases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// Cases asked for.
    pub total: u64,
    /// Cases handed over.
    pub done: u64,
    /// Of these, cases with a failed evaluation.
    pub failed: u64,
    /// Of these, cases with a named mode that is unstable in some evaluation.
    pub unstable: u64,
}

/// A pool of threads for cases.
#[derive(Debug)]
pub struct Pool {
    threads: rayon::ThreadPool,
    block: usize,
}

impl Pool {
    /// A pool of `jobs` threads, at least one.
    ///
    /// # Errors
    /// The system's message if it gives no threads.
    pub fn new(jobs: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(jobs.max(1))
            .thread_name(|index| format!("{THREAD}{index}"))
            .build()?;
        Ok(Self { threads, block: BLOCK })
    }

    /// The pool for cases that take microseconds: more of them are handed to a thread at once.
    pub fn of_small_cases(self) -> Self {
        Self { block: LARGE_BLOCK, ..self }
    }

    /// Runs `work` so that what it does in parallel is done on the threads of the pool.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.threads.install(work)
    }

    /// Evaluates every case of `spans` and hands the records to `sink` in the order of `spans`.
    ///
    /// `evaluate` gets the population's index and the case index. A case that panics becomes a
    /// record without draws whose evaluations all failed; records are [`Record::checked`]. `progress` is called after each record.
    /// Once `stop` is set no case is begun; the cases begun are still handed over, and the counts
    /// returned tell how far the run came. Memory holds a bounded number of records.
    ///
    /// # Errors
    /// The first error of `sink`, after which no record is handed over.
    pub fn run<E>(
        &self,
        definition: &Definition,
        spans: &[Span],
        evaluate: impl Fn(usize, u64) -> Record + Sync,
        mut sink: impl FnMut(Record) -> Result<(), E>,
        mut progress: impl FnMut(&Progress),
        stop: &AtomicBool,
    ) -> Result<Progress, E> {
        let total = spans.iter().map(|s| s.cases.end.saturating_sub(s.cases.start)).sum();
        let mut counts = Progress { total, ..Progress::default() };
        let mut blocks = spans.iter().flat_map(|span| blocks(span, self.block));
        let window = BLOCKS_PER_THREAD * self.threads.current_num_threads();
        let abandoned = &AtomicBool::new(false);
        let evaluate = &evaluate;
        let (sender, receiver) = mpsc::channel();
        self.threads.in_place_scope(|scope| {
            // Blocks handed out and not yet handed over, the oldest first.
            let mut waiting: VecDeque<Option<Vec<Record>>> = VecDeque::with_capacity(window);
            let mut oldest = 0;
            loop {
                while waiting.len() < window && !stop.load(Ordering::Relaxed) {
                    let Some(block) = blocks.next() else { break };
                    let index = oldest + waiting.len();
                    waiting.push_back(None);
                    let sender = sender.clone();
                    scope.spawn(move |_| {
                        let mut records = Vec::with_capacity(self.block);
                        for case in block.cases {
                            if abandoned.load(Ordering::Relaxed) || stop.load(Ordering::Relaxed) {
                                break;
                            }
                            records.push(guarded(definition, block.population, case, evaluate));
                        }
                        // The receiver is gone only after an error, when nobody wants the block.
                        let _ = sender.send((index, records));
                    });
                }
                let Some(front) = waiting.front_mut() else { return Ok(counts) };
                let Some(records) = front.take() else {
                    let (index, records) = receiver.recv().expect("this end holds a sender");
                    waiting[index - oldest] = Some(records);
                    continue;
                };
                for record in records {
                    counts.done += 1;
                    counts.failed += u64::from(record.failure().is_some());
                    counts.unstable += u64::from(record.unstable());
                    if let Err(error) = sink(record) {
                        abandoned.store(true, Ordering::Relaxed);
                        return Err(error);
                    }
                    progress(&counts);
                }
                waiting.pop_front();
                oldest += 1;
            }
        })
    }
}

fn blocks(span: &Span, size: usize) -> impl Iterator<Item = Span> + use<> {
    let (population, end) = (span.population, span.cases.end);
    span.cases
        .clone()
        .step_by(size)
        .map(move |start| Span { population, cases: start..end.min(start + size as u64) })
}

/// The record of a case, whatever happens inside it.
fn guarded(
    definition: &Definition,
    population: usize,
    case: u64,
    evaluate: &impl Fn(usize, u64) -> Record,
) -> Record {
    let record = catch_unwind(AssertUnwindSafe(|| evaluate(population, case)));
    record.map(|record| record.checked(definition.modes.len())).unwrap_or_else(|payload| {
        let failure = Failure::new(FailureKind::Panic, message(payload.as_ref()));
        let evaluations = (0..definition.flight_times_s.len()).flat_map(|flight_time| {
            let failure = failure.clone();
            let plan = definition.margins.as_ref();
            (0..definition.variants.len()).map(move |variant| Evaluation {
                null_poles: 0,
                solution: None,
                variant,
                flight_time,
                outcome: Err(failure.clone()),
                loops: plan.filter(|plan| plan.holds(variant)).map(|_| Err(failure.clone())),
            })
        });
        Record {
            population,
            case,
            values: Vec::new(),
            scores: Vec::new(),
            evaluations: evaluations.collect(),
        }
    })
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without a message").to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::synthetic;
    use super::*;
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    fn records(jobs: usize) -> (Vec<Record>, Progress) {
        let definition = synthetic::definition(&[1, 50, 30]);
        let mut records = Vec::new();
        let progress = Pool::new(jobs)
            .unwrap()
            .run(
                &definition,
                &spans(&definition.populations),
                |population, case| {
                    // Threads overtake each other.
                    std::thread::sleep(Duration::from_micros(case % 7 * 50));
                    synthetic::record(&definition, population, case)
                },
                |record| {
                    records.push(record);
                    Ok::<(), ()>(())
                },
                |_| (),
                &AtomicBool::new(false),
            )
            .unwrap();
        (records, progress)
    }

    #[test]
    fn records_come_in_order_whatever_the_number_of_threads() {
        let (one, progress) = records(1);
        let order: Vec<_> = one.iter().map(|r| (r.population, r.case)).collect();
        assert!(order.is_sorted() && order.len() == 81);
        assert_eq!((progress.total, progress.done), (81, 81));
        for jobs in [2, 7] {
            assert_eq!(records(jobs), (one.clone(), progress));
        }
    }

    #[test]
    fn parts_are_disjoint_and_hold_every_case() {
        let definition = synthetic::definition(&[1, 50, 30]);
        let cases = |spans: Vec<Span>| -> Vec<(usize, u64)> {
            spans.into_iter().flat_map(|s| s.cases.map(move |case| (s.population, case))).collect()
        };
        let all = cases(spans(&definition.populations));
        for of in [1, 2, 7, 81, 100] {
            let part = |number| cases(Part { number, of }.spans(&definition.populations));
            let parts: Vec<_> = (1..=of).map(part).collect();
            assert_eq!(parts.concat(), all);
            let most = parts.iter().map(Vec::len).max().unwrap() as u64;
            assert!(most <= 81_u64.div_ceil(of));
        }
    }

    #[test]
    fn failed_and_unstable_cases_are_counted() {
        let (all, progress) = records(2);
        assert_eq!(progress.failed as usize, all.iter().filter(|r| r.failure().is_some()).count());
        assert_eq!(progress.unstable as usize, all.iter().filter(|r| r.unstable()).count());
        assert!(progress.failed > 0 && progress.unstable > 0);
    }

    #[test]
    fn a_case_that_panics_is_a_record_in_which_every_evaluation_failed() {
        let definition = synthetic::definition(&[9]);
        let mut failed = Vec::new();
        Pool::new(2)
            .unwrap()
            .run(
                &definition,
                &spans(&definition.populations),
                |population, case| {
                    assert!(case != 5, "case {case} broke");
                    synthetic::record(&definition, population, case)
                },
                |record| {
                    failed.extend((record.case == 5).then_some(record));
                    Ok::<(), ()>(())
                },
                |_| (),
                &AtomicBool::new(false),
            )
            .unwrap();
        let [record] = &failed[..] else { panic!("one record of case 5") };
        assert_eq!(
            record.evaluations.len(),
            definition.flight_times_s.len() * definition.variants.len()
        );
        for evaluation in &record.evaluations {
            let failure = evaluation.outcome.as_ref().unwrap_err();
            assert_eq!(failure, &Failure::new(FailureKind::Panic, "case 5 broke"));
        }
    }

    #[test]
    fn a_sink_that_fails_ends_the_run_with_its_error() {
        let definition = synthetic::definition(&[100_000]);
        let mut handed = 0;
        let result = Pool::new(2).unwrap().run(
            &definition,
            &spans(&definition.populations),
            |population, case| synthetic::record(&definition, population, case),
            |_| {
                handed += 1;
                if handed == 10 { Err("disk full") } else { Ok(()) }
            },
            |_| (),
            &AtomicBool::new(false),
        );
        assert_eq!(result, Err("disk full"));
        assert_eq!(handed, 10);
    }

    #[test]
    fn a_stop_hands_over_the_cases_begun_without_a_gap() {
        let definition = synthetic::definition(&[100_000]);
        let stop = AtomicBool::new(false);
        let mut next = 0;
        let progress = Pool::new(2)
            .unwrap()
            .run(
                &definition,
                &spans(&definition.populations),
                |population, case| synthetic::record(&definition, population, case),
                |record| {
                    assert_eq!(record.case, next);
                    next += 1;
                    stop.store(next >= 20, Ordering::Relaxed);
                    Ok::<(), ()>(())
                },
                |_| (),
                &stop,
            )
            .unwrap();
        assert_eq!(progress.done, next);
        let in_flight = (BLOCK * BLOCKS_PER_THREAD * 2) as u64;
        assert!((20..20 + 2 * in_flight).contains(&progress.done));
    }

    #[test]
    fn a_slow_sink_holds_back_the_evaluation_so_that_memory_is_bounded() {
        let definition = synthetic::definition(&[400]);
        let begun = AtomicUsize::new(0);
        let mut written = 0;
        Pool::new(2)
            .unwrap()
            .run(
                &definition,
                &spans(&definition.populations),
                |population, case| {
                    begun.fetch_add(1, Ordering::Relaxed);
                    synthetic::record(&definition, population, case)
                },
                |_| {
                    if written < 100 {
                        std::thread::sleep(Duration::from_micros(300));
                    }
                    written += 1;
                    let bound = written + BLOCK * BLOCKS_PER_THREAD * 2;
                    assert!(begun.load(Ordering::Relaxed) <= bound);
                    Ok::<(), ()>(())
                },
                |_| (),
                &AtomicBool::new(false),
            )
            .unwrap();
        assert_eq!(written, 400);
    }
}
