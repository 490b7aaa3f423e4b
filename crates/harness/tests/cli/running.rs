//! Threads, repeats and memory of `bp match`.

use std::fs;

use crate::folder::{Folder, MATCH, text};

#[test]
fn a_memory_limit_is_kept_by_a_smaller_plan_or_refused() {
    let folder = Folder::new();
    let planned = |options: &str| {
        let report = folder.json(&format!("{MATCH} a.pfm --json {options}"));
        (report["settings"]["planned_bytes"].as_u64().unwrap(), report["settings"]["grids"].as_u64().unwrap())
    };
    let plans = ["", "--coarse-clip off", "--grids 2", "--grids 1"].map(planned);
    assert!(plans.is_sorted_by(|a, b| a.0 > b.0), "{plans:?}");
    let [whole, unclipped, _, one_grid] = plans;
    let limited = |bytes: u64| planned(&format!("--max-memory {bytes}"));
    assert_eq!(plans.map(|(bytes, _)| limited(bytes)), plans);
    assert_eq!(limited(whole.0 - 1), unclipped);
    assert_eq!(planned("--max-memory 1GiB"), whole);
    let told = folder.run(&format!("{MATCH} a.pfm --max-memory {}", one_grid.0));
    assert!(text(&told.stderr).contains("--grids 1"), "{}", text(&told.stderr));
    let (needed, allowed) = (one_grid.0.to_string(), (one_grid.0 - 1).to_string());
    let words = [needed.as_str(), &allowed, "--max-memory", "--labels"];
    folder.fails(&format!("{MATCH} b.pfm --max-memory {allowed}"), 6, &words);
    let by_hand = |option: &str, word: &str| {
        let needed = planned(option).0;
        let words = [&needed.to_string(), "--max-memory", word];
        folder.fails(&format!("{MATCH} b.pfm {option} --max-memory {}", needed - 1), 6, &words);
    };
    by_hand("--loops 1", "--labels");
    by_hand("--algorithm cfbp", "--algorithm sweep");
}

#[test]
fn every_backend_and_number_of_threads_gives_the_same_map_and_messages() {
    let folder = Folder::new();
    for algorithm in ["sweep", "cfcsbp", "ctbp"] {
        let run = |options: &str| {
            let report =
                folder.json(&format!("{MATCH} a.pfm --json --messages-hash --algorithm {algorithm} {options}"));
            let same =
                (report["messages_sha256"].clone(), report["energy"].clone(), fs::read(folder.path("a.pfm")).unwrap());
            (report["device"]["workers"].as_u64().unwrap(), same)
        };
        let (workers, reference) = run("--backend scalar");
        assert_eq!(workers, 1);
        for threads in [1, 3] {
            assert_eq!(
                run(&format!("--backend rayon --threads {threads}")),
                (threads, reference.clone()),
                "{algorithm}"
            );
        }
        assert_eq!(run("--threads 2"), (2, reference), "rayon is the default");
    }
}

#[test]
fn a_repeated_match_tells_every_time() {
    let folder = Folder::new();
    let report = folder.json(&format!("{MATCH} a.pfm --json --repeat 4"));
    let mut samples: Vec<f64> =
        report["samples_ms"].as_array().unwrap().iter().map(|ms| ms.as_f64().unwrap()).collect();
    samples.sort_by(f64::total_cmp);
    assert_eq!((samples.len(), samples[1]), (4, report["total_ms"].as_f64().unwrap()));
    let text = text(&folder.run(&format!("{MATCH} a.pfm --repeat 3")).stdout);
    assert!(text.contains("median of 3 from"), "{text}");
    assert_eq!(folder.json(&format!("{MATCH} a.pfm --json"))["samples_ms"].as_array().unwrap().len(), 1);
}
