//! The examples in C and C++, compiled by the system's compilers and run against the shared library.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]
#![cfg(unix)]

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// The folder of the shared library: that of this test.
fn library() -> PathBuf {
    env::current_exe().unwrap().parent().unwrap().to_owned()
}

/// Compiles an example; `None` if there is no such compiler.
fn compiled(compiler: &str, standard: &str, name: &str, folder: &Path) -> Option<PathBuf> {
    let (here, library) = (Path::new(env!("CARGO_MANIFEST_DIR")), library());
    let program = folder.join(name.replace('.', "-"));
    let mut command = Command::new(compiler);
    command.args([standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-g", "-I"]).arg(here.join("include"));
    command.arg(here.join("examples").join(name)).arg("-o").arg(&program);
    command.arg("-L").arg(&library).args(["-lbpstereo", "-lm"]).arg(format!("-Wl,-rpath,{}", library.display()));
    let output = match command.output() {
        Ok(output) => output,
        Err(_) => return skipped(compiler),
    };
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    Some(program)
}

/// Tells that a tool is missing, which is a failure where all are expected.
fn skipped<T>(tool: &str) -> Option<T> {
    assert!(env::var_os("BP_REQUIRE_TOOLS").is_none(), "there is no {tool}");
    eprintln!("skipped: there is no {tool}");
    None
}

fn run(program: &Path, arguments: &[&Path]) -> Output {
    Command::new(program).args(arguments).output().unwrap()
}

/// Two PGM files of noise, the second shifted by 4 pixels.
fn pair(folder: &Path) -> [PathBuf; 2] {
    let (width, height, shift) = (80, 60, 4);
    let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729 + x * x * 31 + x * y * 17) % 251) as u8;
    [0, shift].map(|shift| {
        let path = folder.join(format!("{shift}.pgm"));
        let pixels = (0..width * height).map(|index| noise(index % width + shift, index / width));
        fs::write(&path, [format!("P5 {width} {height} 255\n").into_bytes(), pixels.collect()].concat()).unwrap();
        path
    })
}

#[test]
fn c_programs_match_pairs_and_are_told_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = compiled("cc", "-std=c99", "match.c", folder.path()) else { return };
    let [left, right] = pair(folder.path());
    let matched = run(&program, &[&left, &right]);
    let told = String::from_utf8_lossy(&matched.stdout);
    let found: Option<f32> = told.split_whitespace().next().and_then(|word| word.parse().ok());
    assert!(
        found.is_some_and(|found| (found - 4.0).abs() < 0.2),
        "{told} {}",
        String::from_utf8_lossy(&matched.stderr)
    );
    let failed = run(&program, &[&left, Path::new("nowhere.pgm")]);
    assert_eq!(failed.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&failed.stderr).starts_with("match: "), "{failed:?}");
}

#[test]
fn cpp_programs_match_pairs() {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = compiled("c++", "-std=c++17", "match.cpp", folder.path()) else { return };
    let matched = run(&program, &[]);
    let told = String::from_utf8_lossy(&matched.stdout);
    // The program itself compares the disparity with the true one.
    assert!(matched.status.success() && told.contains("px"), "{told} {}", String::from_utf8_lossy(&matched.stderr));
}

#[test]
fn valgrind_finds_no_error_and_no_leak() {
    let folder = tempfile::tempdir().unwrap();
    let has_valgrind = Command::new("valgrind").arg("--version").output().is_ok();
    let programs = [("cc", "-std=c99", "match.c"), ("c++", "-std=c++17", "match.cpp")];
    let programs = programs.map(|(compiler, standard, name)| compiled(compiler, standard, name, folder.path()));
    if !has_valgrind {
        return skipped("valgrind").unwrap_or_default();
    }
    let images = pair(folder.path());
    for (program, arguments) in programs.iter().zip([&images[..], &[]]) {
        let Some(program) = program else { continue };
        let mut command = Command::new("valgrind");
        command.args(["--error-exitcode=99", "--leak-check=full", "--errors-for-leak-kinds=definite", "--quiet"]);
        let output = command.arg(program).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
