//! Passes the samples to criterion.

use std::time::Duration;

use criterion::{BenchmarkGroup, Criterion, SamplingMode, Throughput, measurement::WallTime};
use harness::bench::Bench;

/// The fewest samples that criterion accepts.
pub(crate) const FEWEST: usize = 10;

/// Criterion's resamples, as many as ours.
const RESAMPLES: usize = 2000;

/// From this time and the duration of passing one sample, criterion derives the number of iterations. It warns about a
/// single one, and with a million the times are still exact.
const TIME: Duration = Duration::from_millis(100);

/// Names all benches; criterion shows those that its options leave.
pub(crate) fn list(criterion: &mut Criterion, benches: &[Bench]) {
    for group in benches.chunk_by(|a, b| a.group == b.group) {
        let mut named = criterion.benchmark_group(&group[0].group);
        for bench in group {
            named.bench_function(&bench.name, |_| ());
        }
    }
}

/// Runs all benches that have enough samples, and reports those that have too few.
pub(crate) fn replay(criterion: &mut Criterion, benches: &[Bench]) {
    let (enough, few): (Vec<_>, Vec<_>) = benches.iter().partition(|bench| bench.samples.len() >= FEWEST);
    for group in enough.chunk_by(|a, b| a.group == b.group) {
        let mut shown = criterion.benchmark_group(&group[0].group);
        shown.sampling_mode(SamplingMode::Flat).warm_up_time(Duration::from_nanos(1));
        shown.measurement_time(TIME).nresamples(RESAMPLES);
        group.iter().for_each(|bench| one(&mut shown, bench));
    }
    for bench in few.iter().filter(|bench| !bench.samples.is_empty()) {
        eprintln!("{}: not for criterion, which takes {FEWEST} samples: {}", bench.id(), bench.samples.len());
    }
}

fn one(group: &mut BenchmarkGroup<'_, WallTime>, bench: &Bench) {
    group.sample_size(bench.samples.len());
    match (bench.entries, bench.bytes) {
        (Some(elements), Some(bytes)) => _ = group.throughput(Throughput::ElementsAndBytes { elements, bytes }),
        (Some(elements), None) => _ = group.throughput(Throughput::Elements(elements)),
        (None, Some(bytes)) => _ = group.throughput(Throughput::Bytes(bytes)),
        (None, None) => (),
    }
    // The first call is the warm-up. It gets the last sample, so that the samples that count come in order.
    let mut next = bench.samples.len() - 1;
    group.bench_function(&bench.name, |bencher| {
        bencher.iter_custom(|iterations| {
            let sample = bench.samples[next];
            next = (next + 1) % bench.samples.len();
            Duration::from_nanos((sample.as_nanos() as u64).saturating_mul(iterations))
        });
    });
}
