//! Comparing and exporting recorded runs, and refusing files that are not ours.

use std::{
    fs::{self, File},
    path::Path,
};

use serde_json::{Value, json};

use crate::folder::{Folder, text};

const EVERY: &str = "2026-11-21-amd-epyc-2-cores-every-backend-middlebury2006";
const SYNTHETIC: &str = "2026-11-21-amd-epyc-2-cores-synthetic";
const SCALAR: &str = "scalar";
const RAYON: &str = "rayon";

/// The folder of a committed run.
fn committed(name: &str) -> String {
    fs::canonicalize(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results").join(name))
        .unwrap()
        .to_str()
        .unwrap()
        .to_owned()
}

/// The part of a committed run that one backend measured.
fn record(backend: &str) -> Value {
    let file = Path::new(&committed(EVERY)).join("record.json");
    let mut record: Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    record["cells"].as_array_mut().unwrap().retain(|cell| cell["backend"] == backend);
    record["run"]["backends"] = json!([backend]);
    record
}

/// Writes that part with a change to a file.
fn changed(folder: &Folder, backend: &str, file: &str, change: impl FnOnce(&mut Value)) {
    let mut record = record(backend);
    change(&mut record);
    fs::write(folder.path(file), record.to_string()).unwrap();
}

/// Writes that part without a change. Returns the name of the file.
fn run(folder: &Folder, backend: &str) -> String {
    let file = format!("{backend}.json");
    changed(folder, backend, &file, |_| ());
    file
}

/// A file, its change to a committed record, and a word of the refusal.
type Change = (&'static str, fn(&mut Value), &'static str);

/// Every measurement of a record.
fn measured(record: &mut Value) -> impl Iterator<Item = &mut Value> {
    record["cells"].as_array_mut().unwrap().iter_mut().map(|cell| &mut cell["outcome"]["measured"])
}

/// The cells of a plan on rayon in that record.
fn cells(plan: &str) -> Vec<Value> {
    let cells = record(RAYON)["cells"].as_array().unwrap().clone();
    cells.into_iter().filter(|cell| cell["plan"] == plan).collect()
}

/// The mean over the scenes of the median of five samples, in milliseconds.
fn mean_ms(plan: &str) -> f64 {
    let median = |cell: &Value| {
        let samples = cell["outcome"]["measured"]["samples"].as_array().unwrap();
        let mut times: Vec<f64> = samples.iter().map(|sample| sample["total_ms"].as_f64().unwrap()).collect();
        times.sort_by(f64::total_cmp);
        times[2]
    };
    cells(plan).iter().map(median).sum::<f64>() / 6.0
}

fn close(found: &Value, expected: f64) {
    let found = found.as_f64().unwrap();
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn backends_of_two_records_stand_in_one_table_and_give_the_same_labels() {
    let folder = Folder::new();
    let (scalar, rayon) = (run(&folder, SCALAR), run(&folder, RAYON));
    let output = folder.run(&format!("compare {scalar} {rayon}"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    let page = text(&output.stdout);
    let words = [
        "| bp | scalar |",
        "| bp | rayon |",
        "Record 2: bp on rayon, cfbp on rayon",
        "Labels are the same",
        "in turns",
    ];
    assert!(words.iter().all(|word| page.contains(word)), "{page}");
    let again = folder.run(&format!("compare {scalar} {rayon}"));
    assert_eq!(text(&again.stdout), page, "the intervals are the same every time");
}

#[test]
fn a_slower_record_with_other_labels_is_told() {
    let folder = Folder::new();
    changed(&folder, RAYON, "slow.json", |record| {
        let samples = measured(record).flat_map(|measured| measured["samples"].as_array_mut().unwrap());
        samples.for_each(|sample| sample["total_ms"] = json!(2.0 * sample["total_ms"].as_f64().unwrap()));
        measured(record).take(1).for_each(|measured| measured["labels_sha256"] = json!("other"));
        record["cells"].as_array_mut().unwrap().retain(|cell| cell["plan"] != "sweep");
        record["machine"]["cpu"] = json!("a | b <script>\u{1b}[2J");
    });
    let arguments = format!("compare {} slow.json", run(&folder, RAYON));
    let report = folder.json(&format!("{arguments} --json"));
    assert_eq!((&report["rows"][0]["plan"], &report["rows"][1]["plan"]), (&json!("bp"), &json!("cfbp")));
    let row = |plan: &str| report["rows"].as_array().unwrap().iter().find(|row| row["plan"] == plan).unwrap();
    let total = &row("cfbp")["values"][1]["means"]["total"];
    close(&total["ratio"], 2.0);
    close(&row("cfbp")["values"][0]["means"]["total"]["ms"], mean_ms("cfbp"));
    let [low, high] = [0, 1].map(|end| total["ratio_interval"][end].as_f64().unwrap());
    assert!(low < 2.0 && 2.0 < high && low > 1.0 && high < 4.0, "{low} {high}");
    assert_eq!(row("bp")["values"][1]["other_labels"], json!(["Baby1"]));
    assert_eq!((&row("sweep")["only_in"], &row("bp")["only_in"]), (&json!(0), &Value::Null));
    let page = text(&folder.run(&arguments).stdout);
    let words = [
        "* bp on rayon, record 2: **labels differ** on 1 of 6",
        "a &#124; b &#60;script>",
        "Record 1: sweep on rayon.",
    ];
    assert!(words.iter().all(|word| page.contains(word)) && !page.contains('\u{1b}'), "{page}");
}

/// A record agrees with itself. If BP takes twice as long, all speed-ups differ, except that of a plan that takes twice
/// as long too.
#[test]
fn speed_ups_of_two_records_are_counted_where_they_overlap() {
    let folder = Folder::new();
    let rayon = run(&folder, RAYON);
    changed(&folder, RAYON, "same.json", |_| ());
    changed(&folder, RAYON, "slow.json", |record| {
        let cells = record["cells"].as_array_mut().unwrap().iter_mut();
        for cell in cells.filter(|cell| cell["plan"] == "bp" || cell["plan"] == "ctbp") {
            for sample in cell["outcome"]["measured"]["samples"].as_array_mut().unwrap() {
                sample["total_ms"] = json!(2.0 * sample["total_ms"].as_f64().unwrap());
            }
        }
    });
    let report = folder.json(&format!("compare {rayon} same.json slow.json --json"));
    let speed_ups = &report["speed_ups"];
    let intervals = 2 * 9 * 6;
    let agreement = |overlapping: usize| json!({ "intervals": intervals, "overlapping": overlapping });
    assert_eq!(speed_ups["agreement"], json!([agreement(intervals), agreement(intervals - 8 * 6)]));
    assert_eq!(speed_ups["rows"].as_array().unwrap().len(), 9 * 6);
    let ratio = |record: usize| speed_ups["rows"][0]["total"][record]["median"].as_f64().unwrap();
    assert!((ratio(2) / ratio(0) - 2.0).abs() < 1e-9, "{speed_ups}");
    let page = text(&folder.run(&format!("compare {rayon} same.json slow.json")).stdout);
    for words in ["* Record 2: 108 of 108 intervals (100.0 %) overlap", "* Record 3: 60 of 108", "message passing only"]
    {
        assert!(page.contains(words), "{page}");
    }
}

#[test]
fn records_of_other_problems_are_refused_side_by_side() {
    let folder = Folder::new();
    let rayon = run(&folder, RAYON);
    folder.fails(
        &format!("compare {rayon} {}", committed(SYNTHETIC)),
        3,
        &[SYNTHETIC, "data set", "synthetic", "rayon.json"],
    );
    let changes: [Change; 4] = [
        ("quick.json", |record| record["run"]["quick"] = json!(true), "--quick"),
        ("labels.json", |record| record["run"]["labels"] = json!(64), "L = 64, but 112"),
        ("k.json", |record| record["run"]["k"] = json!(7), "k = 7, but 112"),
        ("scenes.json", |record| record["scenes"][0]["images"][0]["sha256"] = json!("0"), "checksums"),
    ];
    for (file, change, word) in changes {
        changed(&folder, RAYON, file, change);
        folder.fails(&format!("compare {rayon} {file}"), 3, &[file, word]);
    }
    folder.fails(&format!("compare quick.json {rayon}"), 3, &["quick.json", "--quick"]);
    folder.fails(&format!("compare {rayon}"), 2, &["RECORD"]);
}

#[test]
fn what_is_no_record_of_ours_is_refused_by_name() {
    let folder = Folder::new();
    let rayon = run(&folder, RAYON);
    fs::write(folder.path("broken.json"), "{\"schema_version\": 1").unwrap();
    fs::write(folder.path("other.json"), "{}").unwrap();
    File::create(folder.path("huge.json")).unwrap().set_len(1 << 40).unwrap();
    changed(&folder, RAYON, "version.json", |record| *record = json!({ "schema_version": 2, "new": [] }));
    changed(&folder, RAYON, "field.json", |record| record["\u{1b}[2J"] = json!(1));
    changed(&folder, RAYON, "empty.json", |record| record["cells"] = json!([]));
    changed(&folder, RAYON, "map.json", |record| {
        measured(record).for_each(|measured| measured["map"] = json!("maps/../../../dev/zero"));
    });
    fs::create_dir(folder.path("folder")).unwrap();
    for (file, word) in [
        ("broken.json", "not a record"),
        ("other.json", "missing field \"schema_version\""),
        ("huge.json", "larger than 64 MiB"),
        ("version.json", "schema version 2, this program reads 1"),
        ("field.json", "unknown field"),
        ("map.json", "a map outside of its folder"),
        ("folder", "record.json"),
        ("missing.json", "No such file"),
        ("/dev/zero", "not a file"),
    ] {
        folder.fails(&format!("compare {rayon} {file}"), 3, &[file, word]);
        folder.fails(&format!("export --format csv {file} --output out.csv"), 3, &[file, word]);
        folder.fails(&format!("report {file}"), 3, &[file, word]);
    }
    assert!(!text(&folder.run("export --format csv field.json").stderr).contains('\u{1b}'));
    folder.fails("export --format csv empty.json", 3, &["empty.json", "bp reproduce"]);
    folder.fails("export --format csv empty.json --output ./empty.json", 2, &["empty.json", "overwritten"]);
}

#[test]
fn every_format_is_read_again_and_holds_what_was_measured() {
    let folder = Folder::new();
    let export = |format: &str| folder.json(&format!("export --format {format} {}", run(&folder, RAYON)));
    let entries = export("github-action-benchmark");
    let name = "middlebury2006/cfbp/rayon: total";
    let entry = entries.as_array().unwrap().iter().find(|entry| entry["name"] == name).unwrap();
    close(&entry["value"], mean_ms("cfbp"));
    assert!(entry["unit"] == "ms" && entry["range"].as_str().unwrap().contains(" to "), "{entry}");
    assert!(entry["extra"].as_str().unwrap().contains("AVX-512"), "{entry}");
    let latency = &export("bencher")[name]["latency"];
    close(&latency["value"], 1e6 * mean_ms("cfbp"));
    let [low, middle, high] = ["lower_value", "value", "upper_value"].map(|end| latency[end].as_f64().unwrap());
    assert!(low <= middle && middle <= high, "{latency}");
    let chart = export("vega-lite");
    assert!(chart["$schema"].as_str().unwrap().ends_with("vega-lite/v5.json"));
    let values = chart["data"]["values"].as_array().unwrap();
    close(&values.iter().find(|value| value["plan"] == "cfbp").unwrap()["ms"], mean_ms("cfbp"));
    assert!(chart["title"]["subtitle"].as_str().unwrap().contains("L = 112") && chart["description"].is_string());
}

#[test]
fn csv_has_a_row_for_every_sample() {
    let folder = Folder::new();
    let output = folder.run(&format!("export --format csv {} --output out.csv", run(&folder, RAYON)));
    assert!(output.status.success() && text(&output.stderr).contains("out.csv"));
    let mut reader = csv::Reader::from_path(folder.path("out.csv")).unwrap();
    let columns = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 6 * 10 * 5);
    let first = |column: &str| rows[0].get(columns.iter().position(|name| name == column).unwrap()).unwrap();
    let cell = &cells("bp")[0];
    let measured = &cell["outcome"]["measured"];
    assert_eq!([first("scene"), first("plan"), first("backend")], ["Baby1", "bp", "rayon"]);
    assert_eq!((first("device"), first("software_rasteriser")), ("CPU, AVX-512, 2 threads", "false"));
    assert_eq!(first("total_ms").parse().ok(), measured["samples"][0]["total_ms"].as_f64());
    assert_eq!(first("energy").parse().ok(), measured["energy"]["total"].as_u64());
}
