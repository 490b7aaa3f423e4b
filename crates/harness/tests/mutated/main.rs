//! Broken files and tiny pairs: readers must read or refuse any bytes, in bounded time and memory.
//!
//! Calls the functions of `fuzz/` without a fuzzer, on the seeds there and on thousands of mutations of them. The
//! mutations are the same in every run.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

mod mutations;

use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind, set_hook},
    path::Path,
    time::{Duration, Instant},
};

use fastrand::Rng;
use harness::fuzzing::{TARGETS, Target};
use mutations::mutated;

/// Mutations of each target's seeds; fewer for targets that take milliseconds.
const MUTATIONS: usize = 10_000;
const FEWER: (usize, [&str; 2]) = (1500, ["record", "tiny_match"]);

/// Maximum time for one input. Inputs take milliseconds. One only fails if it is too slow twice, because the machine
/// may have been busy the first time.
const LONGEST: Duration = Duration::from_secs(2);

/// Maximum memory that the test may ever hold, if the system reports it. Files may have 65536 pixels here. Address
/// space does not count: the TIFF decoder reserves up to 256 MiB if a directory says so, and then finds the file too
/// short.
const MOST_KIB: u64 = 32 << 10;

/// The seeds of a target, sorted by name.
fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target);
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// Whether the bytes are valid input of a target, and how long it takes.
fn run(target: Target, bytes: &[u8]) -> (bool, Duration) {
    let start = Instant::now();
    let taken = target(bytes);
    (taken, start.elapsed())
}

/// The maximum memory that this process ever held, in KiB.
fn most_kib() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches(" kB").parse().ok()
}

/// Describes how a target fails on some bytes; `None` if it does not.
fn wrong(target: Target, bytes: &[u8]) -> Option<String> {
    let Ok((_, took)) = catch_unwind(AssertUnwindSafe(|| run(target, bytes))) else { return Some("panicked".into()) };
    if took > LONGEST && run(target, bytes).1 > LONGEST {
        return Some(format!("took {took:?}"));
    }
    most_kib().filter(|&most| most > MOST_KIB).map(|most| format!("took {most} KiB"))
}

/// A single test, because memory is measured for the whole process.
#[test]
fn any_bytes_are_read_or_refused() {
    // A backtrace would read the debug information of this test into memory, seven times what the inputs take.
    set_hook(Box::new(|panic| eprintln!("{panic}")));
    for (name, target) in TARGETS {
        let seeds = seeds(name);
        let taken = seeds.iter().filter(|seed| target(seed)).count();
        assert!(2 * taken > seeds.len(), "{name}: {taken} of {} seeds are what they should be", seeds.len());
        let mut random = Rng::with_seed(1);
        let start = Instant::now();
        let count = if FEWER.1.contains(&name) { FEWER.0 } else { MUTATIONS };
        for i in 0..count {
            let bytes = mutated(&seeds, &mut random);
            if let Some(what) = wrong(target, &bytes) {
                let path = std::env::temp_dir().join(format!("bp-{name}-{i}"));
                fs::write(&path, &bytes).unwrap();
                panic!("{name}: mutation {i} {what}; it is {}", path.display());
            }
        }
        println!("{name}: {count} in {:?}, at most {:?} KiB so far", start.elapsed(), most_kib());
    }
}
