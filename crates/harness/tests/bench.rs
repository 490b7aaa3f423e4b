//! Checks what `cargo bench` passes to criterion, and what criterion computes from it.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

#[path = "../benches/thesis/replay.rs"]
#[expect(dead_code, reason = "the bench lists too")]
mod replay;

use std::{fs, path::Path, time::Duration};

use bp_stereo::Watch;
use criterion::Criterion;
use harness::bench::{self, Bench};
use serde_json::Value;

/// All benches if no environment variable is set.
fn possible() -> Vec<Bench> {
    bench::possible(&|_| None, &Watch::default()).unwrap()
}

/// Samples in milliseconds under the name of a real bench.
fn bench(index: usize, ms: &[u64]) -> Bench {
    let mut bench = possible().swap_remove(index);
    bench.samples = ms.iter().map(|&ms| Duration::from_millis(ms)).collect();
    bench
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Reads the files with this name in which criterion keeps its results.
fn found(folder: &Path, name: &str) -> Vec<Value> {
    let groups = fs::read_dir(folder).unwrap().map(|group| group.unwrap().path());
    let benches = groups.flat_map(|group| fs::read_dir(group).unwrap().map(|bench| bench.unwrap().path()));
    benches.map(|path| path.join("new").join(name)).filter(|path| path.exists()).map(|path| json(&path)).collect()
}

#[test]
fn criterion_has_every_sample_once_and_in_order_and_finds_their_median() {
    let folder = tempfile::tempdir().unwrap();
    let mut criterion = Criterion::default().without_plots().output_directory(folder.path());
    let ms = [3, 1, 4, 1, 5, 9, 2, 6, 5, 3, 5, 60_000];
    replay::replay(&mut criterion, &[bench(0, &ms), bench(1, &ms[..replay::FEWEST - 1]), bench(2, &[])]);
    let samples = found(folder.path(), "sample.json");
    assert_eq!(samples.len(), 1, "benches with too few samples are not shown");
    let numbers = |name: &str| -> Vec<f64> {
        samples[0][name].as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let iterations = numbers("iters");
    assert!(samples[0]["sampling_mode"] == "Flat" && iterations.iter().all(|count| *count == iterations[0]));
    let handed: Vec<f64> = numbers("times").iter().zip(&iterations).map(|(time, count)| time / count / 1e6).collect();
    assert!(handed.iter().zip(ms).all(|(handed, ms)| (handed / ms as f64 - 1.0).abs() < 1e-12), "{handed:?}");
    let median = &found(folder.path(), "estimates.json")[0]["median"]["point_estimate"];
    assert!((median.as_f64().unwrap() / 4.5e6 - 1.0).abs() < 1e-12, "{median}");
}

#[test]
fn groups_are_called_after_the_tables_and_no_name_is_taken_twice() {
    let benches = possible();
    let mut ids: Vec<String> = benches.iter().map(Bench::id).collect();
    for group in ["Table 3.3, BP", "Table 3.15, CTCSBP", "Table A.1, ours", "Kernel update_messages"] {
        assert!(benches.iter().any(|bench| bench.group == group), "{group}");
    }
    assert!(ids.iter().all(|id| id.len() < 100), "criterion cuts longer names");
    ids.sort();
    assert!(ids.windows(2).all(|pair| pair[0] != pair[1]));
}
