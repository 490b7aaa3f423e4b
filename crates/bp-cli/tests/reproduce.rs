//! A quick run on the synthetic scenes that is interrupted, killed, resumed and completed.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread::sleep,
    time::Duration,
};

use harness::record::{Outcome, Record};

/// One of them has no device, which must not affect the others.
const BACKENDS: &str = if cfg!(feature = "vulkan") { "scalar,vulkan,rayon" } else { "scalar,rayon" };

fn start(results: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_bp"))
        .args([
            "reproduce",
            "--quick",
            "--synthetic",
            "--machine",
            "test",
            "--backend",
            BACKENDS,
            "--threads",
            "2",
            "--results",
        ])
        .arg(results)
        .env("VK_DRIVER_FILES", "/nonexistent")
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn run_folders(results: &Path) -> Vec<PathBuf> {
    fs::read_dir(results).unwrap().map(|entry| entry.unwrap().path()).collect()
}

fn record(folder: &Path) -> Record {
    serde_json::from_str(&fs::read_to_string(folder.join("record.json")).unwrap()).unwrap()
}

fn measured(record: &Record) -> usize {
    record.cells.iter().filter(|cell| cell.measured().is_some()).count()
}

fn wait_for(mut happens: impl FnMut() -> bool) {
    for _ in 0..600 {
        if happens() {
            return;
        }
        sleep(Duration::from_millis(100));
    }
    panic!("it did not happen within a minute");
}

/// Waits until the run has measured more than `count` cells.
fn wait_for_more(results: &Path, count: usize) {
    wait_for(|| {
        let folder = run_folders(results).into_iter().next().filter(|folder| folder.join("record.json").exists());
        folder.is_some_and(|folder| measured(&record(&folder)) > count)
    });
}

#[test]
fn an_interrupted_run_goes_on_where_it_was_and_makes_every_table_and_chart() {
    let results = tempfile::tempdir().unwrap();
    let results = results.path();
    let mut child = start(results);
    wait_for_more(results, 1);
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let interrupted = record(&run_folders(results)[0]);

    let mut child = start(results);
    wait_for_more(results, measured(&interrupted) + 1);
    child.kill().unwrap();
    child.wait().unwrap();

    assert!(start(results).wait().unwrap().success());
    let folders = run_folders(results);
    assert_eq!(folders.len(), 1, "an interrupted run is resumed, not started again");
    let complete = record(&folders[0]);
    let unavailable = complete.cells.iter().filter(|cell| matches!(cell.outcome, Outcome::Unavailable(_))).count();
    assert_eq!(unavailable > 0, BACKENDS.contains("vulkan"));
    assert!(complete.complete && measured(&complete) + unavailable == complete.cells.len());
    for cell in interrupted.cells.iter().filter(|cell| cell.measured().is_some()) {
        assert!(complete.cells.contains(cell), "{} {} was run again", cell.scene, cell.plan);
    }
    check_report(&folders[0]);

    fs::remove_file(folders[0].join("report.html")).unwrap();
    assert!(start(results).wait().unwrap().success());
    assert_eq!((run_folders(results).len(), &record(&folders[0]).cells), (1, &complete.cells));
    check_report(&folders[0]);

    let complete = record(&folders[0]);
    let mut another = start(results);
    let mut at_the_same_time = start(results);
    wait_for(|| run_folders(results).len() == 3);
    for child in [&mut another, &mut at_the_same_time] {
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert_eq!(record(&folders[0]), complete, "a complete run is never written over");
}

fn check_report(folder: &Path) {
    let markdown = fs::read_to_string(folder.join("REPORT.md")).unwrap();
    let html = fs::read_to_string(folder.join("report.html")).unwrap();
    let ours = ["3.25a", "3.30", "3.31", "A.1", "A.3", "A.4"].map(str::to_owned);
    for number in (1..=29).map(|i| format!("3.{i}")).chain(ours) {
        assert!(markdown.contains(&format!("### Table {number}: ")), "Table {number}");
        assert!(html.contains(&format!("Table {number}: ")), "Table {number}");
    }
    // The diagrams A.1 to A.4 are our own: error, memory, and the energies of two profiles.
    let diagrams = (1..=14).map(|i| format!("diagram-4.{i}")).chain((1..=4).map(|i| format!("diagram-A.{i}")));
    let diagrams: Vec<_> = diagrams.collect();
    for name in &diagrams {
        let (width, height) = image::image_dimensions(folder.join(format!("{name}.png"))).unwrap();
        assert!(width == 1800 && height >= 960, "{name}");
    }
    for name in diagrams.into_iter().chain((2..=6).map(|i| format!("figure-3.{i}"))) {
        let svg = fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("<title"), "{name}");
        assert!(markdown.contains(&format!("({name}.svg)")) && html.contains(&format!("id=\"{name}\"")), "{name}");
    }
    assert_eq!(
        markdown.contains("Unavailable: vulkan: "),
        BACKENDS.contains("vulkan"),
        "the reason beneath the tables"
    );
    for plan in ["CTBP, side by side", "CTBP, in turn", "CTCSBP, Z''''=2, side by side", "CTCSBP, Z''''=2, in turn"] {
        let rows = markdown.lines().filter(|line| line.contains(&format!("| {plan} |")));
        // Three tables of the algorithm and three against BP have a row for each scene and backend.
        assert_eq!(rows.count(), 6 * 6 * BACKENDS.split(',').count(), "{plan}");
    }
    assert!(markdown.contains("not printed") && markdown.contains("synthetic"));
    assert!(markdown.contains("439") && markdown.contains("113.11"), "the thesis's numbers stand beside ours");
    assert!(markdown.contains("On the Pareto front, where no other plan is both faster and lower: "));
    assert!(!html.contains("src=\"http") && !html.contains("<script"), "one self-contained page");
}
