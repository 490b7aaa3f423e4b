//! Broken files and tiny pairs: whatever bytes come, readers refuse them or read them, in bounded time and memory.
//!
//! The same functions as in `fuzz/`, without a fuzzer: the seeds there, and the same thousands of mutations of them on
//! every run.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

mod mutations;

use std::{
    alloc::System,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    time::{Duration, Instant},
};

use fastrand::Rng;
use harness::fuzzing::{TARGETS, Target};
use mutations::mutated;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Mutations of each target's seeds.
const MUTATIONS: usize = 1500;

/// Longest that bytes may take. They take milliseconds: only what takes longer again when the machine did something
/// else the first time counts.
const LONGEST: Duration = Duration::from_secs(2);

/// Most bytes that may be allocated in all for a file, freed ones counted too: a file is allowed 65536 pixels.
const MOST_BYTES: usize = 64 << 20;

/// The seeds of a target, in the order of their names.
fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target);
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// Whether a target takes the bytes for what it reads, and how long that takes.
fn run(target: Target, bytes: &[u8]) -> (bool, Duration) {
    let start = Instant::now();
    let taken = target(bytes);
    (taken, start.elapsed())
}

/// What is wrong with how a target takes some bytes.
fn wrong(target: Target, bytes: &[u8]) -> Option<String> {
    let region = Region::new(ALLOCATOR);
    let Ok((_, took)) = catch_unwind(AssertUnwindSafe(|| run(target, bytes))) else { return Some("panicked".into()) };
    let allocated = region.change().bytes_allocated;
    if took > LONGEST && run(target, bytes).1 > LONGEST {
        return Some(format!("took {took:?}"));
    }
    (allocated > MOST_BYTES).then(|| format!("allocated {allocated} bytes"))
}

/// One test, since allocations of all threads are counted together.
#[test]
fn any_bytes_are_read_or_refused() {
    for (name, target) in TARGETS {
        let seeds = seeds(name);
        let taken = seeds.iter().filter(|seed| target(seed)).count();
        assert!(2 * taken > seeds.len(), "{name}: {taken} of {} seeds are what they should be", seeds.len());
        let mut random = Rng::with_seed(1);
        let start = Instant::now();
        for i in 0..MUTATIONS {
            let bytes = mutated(&seeds, &mut random);
            if let Some(what) = wrong(target, &bytes) {
                let path = std::env::temp_dir().join(format!("bp-{name}-{i}"));
                fs::write(&path, &bytes).unwrap();
                panic!("{name}: mutation {i} {what}; it is {}", path.display());
            }
        }
        println!("{name}: {MUTATIONS} in {:?}", start.elapsed());
    }
}
