//! The architecture: which crates may depend on each other, and what only the program may do.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

mod circles;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

/// Every crate, with the crates of the workspace that it may depend on. These come earlier in the list.
const ROOMS: [(&str, &[&str]); 15] = [
    ("bp-shaders", &[]),
    ("bp-core", &[]),
    ("bp-testkit", &["bp-core"]),
    ("bp-cpu-scalar", &["bp-core"]),
    ("bp-cpu-rayon", &["bp-core"]),
    ("bp-gpu", &["bp-core", "bp-shaders", "bp-testkit"]),
    ("bp-vulkan", &["bp-core", "bp-gpu"]),
    ("bp-wgpu", &["bp-core", "bp-gpu"]),
    ("bp-io", &["bp-core"]),
    ("bp-stereo", &["bp-core", "bp-cpu-scalar", "bp-cpu-rayon", "bp-vulkan", "bp-wgpu", "bp-io"]),
    ("bp-python", &["bp-core", "bp-stereo"]),
    ("bp-capi", &["bp-core", "bp-stereo"]),
    ("bp-charts", &[]),
    ("harness", &["bp-core", "bp-testkit", "bp-cpu-scalar", "bp-cpu-rayon", "bp-io", "bp-stereo", "bp-charts"]),
    ("bp-cli", &["bp-core", "bp-testkit", "bp-gpu", "bp-io", "bp-stereo", "bp-charts", "harness"]),
];

/// Dependencies that only a program with a command line may have.
const OF_PROGRAMS: [&str; 6] = ["clap", "clap_complete", "clap_mangen", "ctrlc", "env_logger", "indicatif"];

fn root() -> PathBuf {
    fs::canonicalize(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap()
}

fn cargo(arguments: &str) -> String {
    let mut command = Command::new(env!("CARGO"));
    let output =
        command.args(arguments.split_whitespace()).args(["--offline", "--locked"]).current_dir(root()).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The packages of the workspace with their normal dependencies.
fn packages() -> BTreeMap<String, BTreeSet<String>> {
    let metadata: Value = serde_json::from_str(&cargo("metadata --no-deps --format-version 1")).unwrap();
    let dependencies = |package: &Value| -> BTreeSet<String> {
        let all = package["dependencies"].as_array().unwrap().iter();
        all.filter(|it| it["kind"].is_null()).map(|it| it["name"].as_str().unwrap().to_owned()).collect()
    };
    let packages = metadata["packages"].as_array().unwrap().iter();
    packages.map(|package| (package["name"].as_str().unwrap().to_owned(), dependencies(package))).collect()
}

#[test]
fn a_crate_depends_on_the_rooms_below_it_alone() {
    let packages = packages();
    let rooms: BTreeMap<&str, &[&str]> = ROOMS.into_iter().collect();
    assert!(packages.keys().all(|name| rooms.contains_key(name.as_str())), "{:?}", packages.keys());
    for (name, dependencies) in &packages {
        let ours = dependencies.iter().filter(|dependency| packages.contains_key(*dependency));
        let not_allowed: Vec<_> = ours.filter(|ours| !rooms[name.as_str()].contains(&ours.as_str())).collect();
        assert!(not_allowed.is_empty(), "{name} depends on {not_allowed:?}");
    }
    let place = |name: &str| ROOMS.iter().position(|(room, _)| *room == name).unwrap();
    for (name, below) in ROOMS {
        assert!(below.iter().all(|&other| place(other) < place(name) || other == "bp-charts"), "{name} is too high up");
    }
}

#[test]
fn only_the_program_has_a_command_line() {
    for (name, dependencies) in packages().iter().filter(|(name, _)| *name != "bp-cli") {
        let found: Vec<_> = OF_PROGRAMS.iter().filter(|only| dependencies.contains(**only)).collect();
        assert!(found.is_empty(), "{name} depends on {found:?}");
    }
}

#[test]
fn a_build_without_gpu_backends_has_no_crate_of_theirs() {
    let tree = cargo("tree -p bp-cli --no-default-features --edges normal,build --prefix none");
    let names: BTreeSet<&str> = tree.lines().filter_map(|line| line.split_whitespace().next()).collect();
    for gpu in ["bp-gpu", "bp-shaders", "bp-vulkan", "bp-wgpu", "ash", "wgpu", "naga"] {
        assert!(!names.contains(gpu), "{gpu}");
    }
    let tree = cargo("tree -p bp-stereo --edges normal --prefix none");
    assert!(!tree.lines().any(|line| line.starts_with("resvg") || line.starts_with("harness")), "{tree}");
}

/// Files of libraries that only tests use.
const IS_FOR_TESTS: [&str; 2] = ["tests.rs", "conformance.rs"];

/// All lines of a library's sources outside of tests, with their files.
fn lines(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut lines = Vec::new();
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() {
            lines.extend(self::lines(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs")
            && !IS_FOR_TESTS.iter().any(|name| path.ends_with(name))
        {
            let text = fs::read_to_string(&path).unwrap();
            let tests = text.find("#[cfg(test)]\nmod tests").unwrap_or(text.len());
            lines.extend(text[..tests].lines().map(|line| (path.clone(), line.to_owned())));
        }
    }
    lines
}

#[test]
fn libraries_print_nothing_and_change_no_panic_hook() {
    let crates = packages().into_keys().filter(|name| name != "bp-cli" && name != "bp-shaders");
    for (path, line) in crates.flat_map(|name| lines(&root().join("crates").join(name).join("src"))) {
        let is_comment = line.trim_start().starts_with("//");
        for word in
            ["println!", "print!", "eprintln!", "eprint!", "dbg!", "stdout()", "stderr()", "set_hook", "set_var"]
        {
            assert!(is_comment || !line.contains(word), "{}: {line}", path.display());
        }
    }
}

#[test]
fn no_modules_of_a_crate_import_each_other_in_a_circle() {
    for name in packages().into_keys().filter(|name| name != "bp-shaders") {
        let folder = root().join("crates").join(&name).join("src");
        let mut sources: BTreeMap<PathBuf, String> = BTreeMap::new();
        for (path, line) in lines(&folder) {
            *sources.entry(path.strip_prefix(&folder).unwrap().to_owned()).or_default() += &(line + "\n");
        }
        let circle = circles::circle(&sources);
        assert!(circle.is_none(), "{name}: {}", circle.unwrap_or_default().join(" -> "));
    }
}
