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
    #[cfg(unix)]
    links_are_not_followed(results, &folders[0]);
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

/// A link in the folder of a run would replace a file elsewhere.
#[cfg(unix)]
fn links_are_not_followed(results: &Path, folder: &Path) {
    let elsewhere = tempfile::NamedTempFile::new().unwrap();
    fs::write(elsewhere.path(), "of somebody").unwrap();
    for name in [".lock", "REPORT.md"] {
        let (path, kept) = (folder.join(name), folder.join("kept"));
        fs::rename(&path, &kept).unwrap();
        std::os::unix::fs::symlink(elsewhere.path(), &path).unwrap();
        assert_eq!(start(results).wait().unwrap().code(), Some(1), "{name}");
        assert_eq!(fs::read_to_string(elsewhere.path()).unwrap(), "of somebody", "{name}");
        fs::remove_file(&path).unwrap();
        fs::rename(&kept, &path).unwrap();
    }
}

fn check_report(folder: &Path) {
    let markdown = fs::read_to_string(folder.join("REPORT.md")).unwrap();
    let html = fs::read_to_string(folder.join("report.html")).unwrap();
    let ours = ["3.25a", "3.30", "3.31", "A.1", "A.3", "A.4", "A.5"].map(str::to_owned);
    for number in (1..=29).map(|i| format!("3.{i}")).chain(ours) {
        assert!(markdown.contains(&format!("### Table {number}: ")), "Table {number}");
        assert!(html.contains(&format!("Table {number}: ")), "Table {number}");
    }
    // The diagrams A.1 to A.4 are our own: error, memory, and the energies of two profiles.
    let diagrams = (1..=14).map(|i| format!("diagram-4.{i}")).chain((1..=4).map(|i| format!("diagram-A.{i}")));
    let speed_ups = [1, 4, 7, 9, 12].map(|i| format!("diagram-4.{i}-speed-up"));
    let diagrams: Vec<_> = diagrams.chain(speed_ups).collect();
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
    let all_plans = fs::read_to_string(folder.join("diagram-4.12.svg")).unwrap();
    for text in [
        "ms; ",
        "BP: printed",
        "CTCSBP, Z&apos;&apos;&apos;&apos;=3: total",
        "CTCSBP, Z&apos;&apos;&apos;&apos;=4: printed",
    ] {
        assert!(all_plans.contains(text) || all_plans.contains(&text.replace("&apos;", "'")), "{text}");
    }
    for plan in ["CTBP, side by side", "CTBP, in turn", "CTCSBP, Z''''=2, side by side", "CTCSBP, Z''''=2, in turn"] {
        let rows = markdown.lines().filter(|line| line.contains(&format!("| {plan} |")));
        // Three tables of the algorithm and three against BP have a row for each scene and backend.
        assert_eq!(rows.count(), 6 * 6 * BACKENDS.split(',').count(), "{plan}");
    }
    assert!(markdown.contains("not printed") && markdown.contains("synthetic"));
    check_printed(&markdown);
    assert!(markdown.contains("On the Pareto front, where no other plan is both faster and lower: "));
    assert!(!html.contains("src=\"http") && !html.contains("<script"), "one self-contained page");
}

/// The numbers that the thesis prints.
const THESIS: &str = include_str!("../../harness/data/thesis.json");

/// An algorithm's name among the printed numbers, the beginning of its plans' titles, its table of times, and its table against
/// BP.
const PRINTED: [(&str, &str, &str, Option<&str>); 5] = [
    ("bp", "BP", "3.3", None),
    ("cfbp", "CFBP", "3.6", Some("3.18")),
    ("cfcsbp", "CFCSBP", "3.9", Some("3.21")),
    ("ctbp", "CTBP", "3.12", Some("3.24")),
    ("ctcsbp", "CTCSBP", "3.15", Some("3.26")),
];

/// Checks that every printed number stands in its table, in each row of its image and algorithm.
fn check_printed(markdown: &str) {
    let thesis: serde_json::Value = serde_json::from_str(THESIS).unwrap();
    assert_eq!((&thesis["times_ms"]["bp"][0], &thesis["speed_up_percent"]["cfbp"][0]), (&439.into(), &113.11.into()));
    for part in thesis["computer"].as_array().unwrap() {
        let printed = [0, 1].map(|column| part[column].as_str().unwrap());
        assert!(section(markdown, "3.1").any(|cells| cells[..2] == printed), "{printed:?}");
    }
    for (image, printed) in thesis["images"].as_array().unwrap().iter().enumerate() {
        let size = format!("{}x{}", printed["width"], printed["height"]);
        let row = [printed["name"].as_str().unwrap().to_owned(), size, printed["disparity_true"].to_string()];
        assert_eq!(rows(markdown, "3.2", image, "")[0][1..4], row);
        let bp = thesis["times_ms"]["bp"][image].to_string();
        for (name, title, times, against_bp) in PRINTED {
            let ms = thesis["times_ms"][name][image].to_string();
            let percent = thesis["speed_up_percent"][name][image].as_f64();
            let percent = percent.map_or(String::new(), |percent| format!("{percent:.2}"));
            check_rows(markdown, times, image, title, &[&ms]);
            check_rows(markdown, "3.29", image, title, &[&ms, &percent]);
            if let Some(table) = against_bp {
                check_rows(markdown, table, image, title, &[&bp, &ms, &percent]);
            }
        }
    }
}

/// Checks the printed cells in the rows of an image and an algorithm, but for plans that the thesis does not have.
fn check_rows(markdown: &str, table: &str, image: usize, title: &str, printed: &[&str]) {
    let header = section(markdown, table).find(|cells| cells[0] == "#").unwrap();
    let at = header.iter().position(|cell| cell.starts_with("printed")).unwrap();
    let is_ours = |cells: &Vec<String>| cells[3].contains("side by side") || cells[3].contains("in turn");
    let rows: Vec<_> = rows(markdown, table, image, title).into_iter().filter(|cells| !is_ours(cells)).collect();
    assert!(!rows.is_empty(), "Table {table}, image {}, {title}", image + 1);
    for cells in rows {
        assert_eq!(cells[at..at + printed.len()], *printed, "Table {table}, image {}, {title}", image + 1);
    }
}

/// The rows of an image whose plan is this one, or one of CTCSBP's.
fn rows(markdown: &str, table: &str, image: usize, title: &str) -> Vec<Vec<String>> {
    let number = (image + 1).to_string();
    let is_of = |plan: &str| title.is_empty() || plan.split(',').next() == Some(title);
    section(markdown, table).filter(|cells| cells[0] == number && is_of(&cells[3])).collect()
}

/// The cells of a table, row by row.
fn section<'a>(markdown: &'a str, table: &str) -> impl Iterator<Item = Vec<String>> + use<'a> {
    let (_, from) = markdown.split_once(&format!("### Table {table}: ")).unwrap();
    let text = from.split("\n### ").next().unwrap();
    let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
    text.lines().filter(|line| line.starts_with('|')).map(cells)
}
