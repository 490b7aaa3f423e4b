//! Recorded runs and the pages generated from them.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use harness::record::{Outcome, Record, speed::Speed};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folders under `results` that hold a record.
fn runs() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("results")).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.join("record.json").exists()).collect()
}

fn read(run: &Path) -> String {
    fs::read_to_string(run.join("record.json")).unwrap()
}

#[test]
fn the_schema_in_the_repository_is_that_of_the_program() {
    let current = serde_json::to_value(schemars::schema_for!(Record)).unwrap();
    let committed = fs::read_to_string(root().join("results/schema.json")).unwrap();
    let committed: serde_json::Value = serde_json::from_str(&committed).unwrap();
    assert!(current == committed, "run: cargo run -p harness --example schema > results/schema.json");
}

#[test]
fn committed_records_fit_the_schema_and_are_whole() {
    let schema = fs::read_to_string(root().join("results/schema.json")).unwrap();
    let validator = jsonschema::validator_for(&serde_json::from_str(&schema).unwrap()).unwrap();
    let runs = runs();
    assert!(runs.len() >= 2, "the real and the synthetic scenes are recorded");
    for run in runs {
        let text = read(&run);
        let errors: Vec<_> =
            validator.iter_errors(&serde_json::from_str(&text).unwrap()).map(|e| e.to_string()).collect();
        assert!(errors.is_empty(), "{}: {errors:?}", run.display());
        let record: Record = serde_json::from_str(&text).unwrap();
        assert!(record.complete && record.program.clean_tree, "{}", run.display());
        for cell in &record.cells {
            match &cell.outcome {
                Outcome::Measured(measured) => {
                    assert!(!measured.samples.is_empty() && run.join(&measured.map).exists());
                    let planned = cell.settings.planned_bytes.unwrap();
                    // With label sets, the plan says what is needed at most.
                    let differ = if cell.settings.label_sets {
                        measured.allocated_bytes.saturating_sub(planned)
                    } else {
                        measured.allocated_bytes.abs_diff(planned)
                    };
                    assert!(differ * 1000 < planned, "{}: {} on {}", run.display(), cell.plan, cell.backend);
                }
                // A GPU may be too small for a plan, or missing.
                Outcome::Unavailable(reason) => assert!(!reason.is_empty(), "{} {}", cell.scene, cell.plan),
                Outcome::Pending | Outcome::Error(_) => panic!("{}: {} {}", run.display(), cell.scene, cell.plan),
            }
        }
    }
}

/// The committed files beside a record are those that the program makes from it now.
#[test]
fn reports_are_made_from_their_records() {
    for run in runs() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("maps")).unwrap();
        let maps = fs::read_dir(run.join("maps")).unwrap().map(|entry| entry.unwrap().path());
        for path in maps.chain([run.join("record.json")]) {
            fs::copy(&path, folder.path().join(path.strip_prefix(&run).unwrap())).unwrap();
        }
        let bp = Command::new(env!("CARGO_BIN_EXE_bp")).arg("report").arg(folder.path()).output().unwrap();
        assert!(bp.status.success());
        for entry in fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap()).filter(|e| e.path().is_file()) {
            let committed = run.join(entry.file_name());
            let same = fs::read(&committed).ok() == Some(fs::read(entry.path()).unwrap());
            assert!(same, "{}; run: cargo run -- report {}", committed.display(), run.display());
        }
    }
}

/// The same for `bp speed`. The record of a former benchmark has no schema version, and no program reads it.
#[test]
fn pages_of_speed_are_made_from_their_records() {
    let entries = fs::read_dir(root().join("results")).unwrap().map(|entry| entry.unwrap().path());
    let is_ours = |text: String| text.contains("\"schema_version\"");
    let runs = entries.filter(|path| fs::read_to_string(path.join("speed.json")).is_ok_and(is_ours));
    let mut read = 0;
    for run in runs {
        let speed: Speed = serde_json::from_str(&fs::read_to_string(run.join("speed.json")).unwrap()).unwrap();
        assert!(speed.contests.iter().all(|contest| !contest.entries.is_empty()), "{}", run.display());
        let folder = tempfile::tempdir().unwrap();
        fs::copy(run.join("speed.json"), folder.path().join("speed.json")).unwrap();
        let bp = Command::new(env!("CARGO_BIN_EXE_bp")).arg("report").arg(folder.path()).output().unwrap();
        assert!(bp.status.success(), "{bp:?}");
        for entry in fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap()) {
            let committed = run.join(entry.file_name());
            let same = fs::read(&committed).ok() == Some(fs::read(entry.path()).unwrap());
            assert!(same, "{}; run: cargo run -- report {}", committed.display(), run.display());
        }
        read += 1;
    }
    assert!(read >= 2, "growth and lavapipe are recorded");
}

/// The pages about the thesis agree with their records.
#[test]
fn the_page_on_the_thesis_is_made_from_a_record() {
    for page in ["docs/thesis.md", "docs/claims.md"] {
        agrees_with_its_record(Path::new(page));
    }
}

fn agrees_with_its_record(page: &Path) {
    let text = fs::read_to_string(root().join(page)).unwrap();
    let from = format!("--readme {}` from `", page.display());
    let (_, rest) = text.split_once(&from).expect("the note below the page's table");
    let (record, _) = rest.split_once('`').unwrap();
    let run = Path::new(record).parent().unwrap();
    let renewed = harness::report::renewed_page(&text, &root(), page, run);
    assert!(renewed.as_deref() == Some(&text), "run: bp report {} --readme {}", run.display(), page.display());
}

/// Single-precision prototypes of the same models, measured on the same six images at half size: the percentages of
/// non-occluded and of all pixels that are wrong by more than 1 px, and the root mean squared error.
#[test]
fn recorded_accuracy_is_that_of_the_prototypes() {
    let expected = [
        ("bp", [24.0, 32.1, 16.4]),
        ("cfbp", [23.4, 31.7, 16.4]),
        ("cfcsbp", [23.4, 31.7, 16.2]),
        ("ctbp", [24.2, 32.3, 16.4]),
        ("ctcsbp", [25.1, 33.2, 16.5]),
        ("census", [5.6, 13.3, 9.5]),
    ];
    let records = runs().into_iter().map(|run| serde_json::from_str::<Record>(&read(&run)).unwrap());
    let real: Vec<Record> = records.filter(|record| record.run.data == "middlebury2006").collect();
    let mut compared = 0;
    for (record, (plan, expected)) in real.iter().flat_map(|record| expected.map(|plan| (record, plan))) {
        for backend in &record.run.backends {
            let cells = record.cells.iter().filter(|cell| cell.plan == plan && cell.backend == *backend);
            // If a scene is missing, the mean is not comparable.
            let Some(measured) = cells.map(|cell| cell.measured()).collect::<Option<Vec<_>>>() else { continue };
            let mean = |value: fn(&harness::record::Measurement) -> f64| {
                measured.iter().map(|measured| value(measured)).sum::<f64>() / measured.len() as f64
            };
            let found = [mean(|m| m.visible.bad[1]), mean(|m| m.all.bad[1]), mean(|m| m.all.rmse)];
            for (found, expected) in found.iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 0.1, "{plan}: {found} where prototypes had {expected}");
            }
            compared += 1;
        }
    }
    assert!(compared > 0);
}

/// The table of start nodes on the page of claims is that of its record, and the record's.
#[test]
fn the_table_of_start_nodes_is_made_from_its_record() {
    let folder = root().join("results/2026-11-23-amd-epyc-2-cores-start-node");
    let files = [root().join("docs/claims.md"), folder.join("start-node.md"), folder.join("energies.json")];
    let [page, made, record] = files.map(|path| fs::read_to_string(path).unwrap());
    let rows: Vec<_> = made.lines().filter(|line| line.starts_with('|')).collect();
    assert!(page.contains(&rows.join("\n")));
    let record: serde_json::Value = serde_json::from_str(&record).unwrap();
    let runs = record["runs"].as_array().unwrap();
    for row in &rows[2..] {
        let cells: Vec<_> = row.split('|').map(str::trim).collect();
        let wrong: Vec<_> =
            runs.iter().filter(|run| run["order"] == cells[1]).map(|run| run["bad"][111].as_f64().unwrap()).collect();
        assert_eq!((wrong.len(), cells[13]), (6, format!("{:.1}", wrong.iter().sum::<f64>() / 6.0).as_str()), "{row}");
    }
}
