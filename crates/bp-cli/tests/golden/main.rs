//! Outputs that must not change by accident: help, the shape of every JSON, maps, messages and exit codes. Their golden
//! files are beside this one. `BLESS=1 cargo test --test golden` rewrites them; a commit that does so says why.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

mod hashes;
mod shape;

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;

/// The names of the commands; the empty name is the program itself.
#[cfg(all(feature = "vulkan", feature = "wgpu"))]
const COMMANDS: [&str; 16] = [
    "",
    "match",
    "convert",
    "evaluate",
    "reproduce",
    "report",
    "scenes",
    "devices",
    "doctor",
    "conform",
    "speed",
    "gate",
    "compare",
    "export",
    "completions",
    "man",
];

/// Compares a text with its golden file, or rewrites the file.
fn check(name: &str, found: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name);
    if env::var_os("BLESS").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, found).unwrap();
    }
    let golden = fs::read_to_string(&path).unwrap_or_default();
    assert!(golden == found, "{} differs; found:\n{found}", path.display());
}

/// A folder with a pair of three planes, textured in colour.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let noise = |x: u32, y: u32, channel: u32| {
        let mixed = (x ^ y << 12 ^ channel << 24).wrapping_mul(0x9e37_79b1);
        ((mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca6b) >> 24) as u8
    };
    let depth = |x: u32, y: u32| if (30..60).contains(&x) && (20..45).contains(&y) { 9 } else { 2 + y / 24 };
    let colour = |x, y| image::Rgb([noise(x, y, 0), noise(x, y, 1), noise(x / 2, y, 2)]);
    let save = |image: image::RgbImage, name: &str| image.save(folder.path().join(name)).unwrap();
    save(image::RgbImage::from_fn(97, 61, colour), "left.png");
    save(image::RgbImage::from_fn(97, 61, |x, y| colour(x + depth(x, y), y)), "right.png");
    let truth = image::GrayImage::from_fn(97, 61, |x, y| image::Luma([4 * depth(x, y) as u8]));
    truth.save(folder.path().join("truth.png")).unwrap();
    folder
}

fn run_in(folder: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
    command.args(arguments.split_whitespace()).current_dir(folder).env_remove("BP_DATA").env_remove("COLUMNS");
    command.output().unwrap()
}

/// Like [`run_in`], but hides all GPUs of this machine.
fn without_gpu(folder: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
    command.args(arguments.split_whitespace()).current_dir(folder).env_remove("BP_DATA");
    command.env("VK_DRIVER_FILES", "/nonexistent").env_remove("VK_ICD_FILENAMES").output().unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

fn file(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap()
}

/// A committed record of this project.
fn record(name: &str) -> PathBuf {
    fs::canonicalize(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results").join(name)).unwrap()
}

#[cfg(all(feature = "vulkan", feature = "wgpu"))]
#[test]
fn help() {
    let folder = tempfile::tempdir().unwrap();
    for command in COMMANDS {
        let name = if command.is_empty() { "bp" } else { command };
        for (option, ending) in [("--help", "txt"), ("-h", "short.txt")] {
            let output = run_in(folder.path(), &format!("{command} {option}"));
            check(&format!("help/{name}.{ending}"), &String::from_utf8(output.stdout).unwrap());
        }
    }
}

#[test]
fn exit_codes() {
    let folder = folder();
    fs::write(folder.path().join("broken.png"), "no image").unwrap();
    fs::write(folder.path().join("list"), "left.png right.png a\nleft.png broken.png b\n").unwrap();
    let mut codes = String::new();
    for arguments in [
        "match left.png right.png -o map.pfm --labels 16",
        "match left.png right.png -o map.pfm --labels 16 --json",
        "match left.png right.png -o map.jpg",
        "match left.png right.png -o map.pfm --algorithm bp --z 2",
        "match left.png right.png -o map.pfm --magic",
        "match left.png missing.png -o map.pfm",
        "match left.png broken.png -o map.pfm",
        "match left.png right.png -o missing/map.pfm",
        "match left.png right.png -o map.pfm --backend magic",
        "match left.png right.png -o map.pfm --device 99",
        "match left.png right.png -o map.pfm --max-memory 1M",
        "match --pairs list -o maps --labels 16",
        "match --pairs missing -o maps --labels 16",
        "convert map.pfm --picture map.png",
        "convert map.pfm",
        "evaluate map.pfm truth.png --scale 4",
        "evaluate map.pfm missing.png",
        "scenes",
        "scenes --data missing",
        "devices",
        "doctor",
        "report missing",
        "compare missing missing",
        "export --format csv missing",
        "gate --baselines missing",
        "speed --problem magic",
        "reproduce --backend magic --quick",
        "conform --backend magic",
        "completions bash",
        "man pages",
        "",
    ] {
        let code = run_in(folder.path(), arguments).status.code().unwrap();
        codes += &format!("{code}  bp {arguments}\n");
    }
    check("exit-codes.txt", &codes);
}

#[test]
fn json_of_matching() {
    let folder = folder();
    let run = |arguments: &str| json(&run_in(folder.path(), arguments));
    let all = "--ground-truth truth.png --scale 4 --mask mask.png --messages-hash --check left-right --median 3 \
               --confidence trust.png --picture map.png --depth depth.pfm --focal 100 --baseline 50 --repeat 2";
    image::GrayImage::from_pixel(97, 61, image::Luma([255])).save(folder.path().join("mask.png")).unwrap();
    let matched = run(&format!("match left.png right.png -o map.pfm --labels 16 --json {all}"));
    check("json/match.txt", &shape::of(&matched));
    check(
        "json/match-cut.txt",
        &shape::of(&run("match left.png right.png -o m.pfm --algorithm ctcsbp --labels 16 --json")),
    );
    check("json/evaluate.txt", &shape::of(&run("evaluate map.pfm truth.png --scale 4 --mask mask.png --json")));
    for name in ["map.pfm", "map.png", "depth.pfm", "trust.png"] {
        check(&format!("json/sidecar-{name}.txt"), &shape::of(&file(folder.path(), &format!("{name}.json"))));
    }
    fs::write(folder.path().join("list"), "left.png right.png a\nleft.png missing.png b\n").unwrap();
    let batch = run_in(folder.path(), "match --pairs list --output out --labels 16 --json --also picture");
    check("json/match-pairs.txt", &shape::of(&json(&batch)));
    check("json/summary.txt", &shape::of(&file(folder.path(), "out/summary.json")));
    check("json/pair-record.txt", &shape::of(&file(folder.path(), "out/records/a.json")));
}

#[test]
fn json_of_machines_and_records() {
    let folder = tempfile::tempdir().unwrap();
    let devices = json(&without_gpu(folder.path(), "devices --json"));
    check("json/devices.txt", &shape::of(&devices));
    check("json/doctor.txt", &shape::of(&json(&without_gpu(folder.path(), "doctor --json"))));
    let run = record("2026-11-21-amd-epyc-2-cores-synthetic").display().to_string();
    check("json/compare.txt", &shape::of(&json(&run_in(folder.path(), &format!("compare {run} {run} --json")))));
    for format in ["github-action-benchmark", "bencher", "vega-lite"] {
        let exported = json(&run_in(folder.path(), &format!("export --format {format} {run}")));
        check(&format!("json/export-{format}.txt"), &shape::of(&exported));
    }
}

#[test]
fn json_of_measuring() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("baselines")).unwrap();
    let judged = without_gpu(folder.path(), "gate --quick --json --baselines baselines");
    check("json/gate.txt", &shape::of(&json(&judged)));
    let output = without_gpu(folder.path(), "speed --quick --problem update --backend rayon,vulkan --output speed");
    assert!(output.status.success(), "{output:?}");
    check("json/speed.txt", &shape::of(&file(folder.path(), "speed/speed.json")));
}
