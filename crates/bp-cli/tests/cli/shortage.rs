//! A lack of memory where Rust aborts the program.
#![cfg(target_os = "linux")]

use std::{fs, process::Output};

use crate::folder::{Folder, text};

/// Runs the program with at most so many bytes of addresses.
fn run_within(folder: &Folder, kibibytes: u32, arguments: &str) -> Output {
    let script = format!("ulimit -v {kibibytes}; exec \"$0\" {arguments}");
    let mut command = std::process::Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_bp")]).current_dir(folder.path(""));
    command.env("RUST_BACKTRACE", "0").output().unwrap()
}

/// The table of a list grows in a way that cannot fail, and the system says nothing of its limit before.
#[test]
fn an_abort_for_lack_of_memory_ends_like_an_error() {
    let folder = Folder::new();
    fs::write(folder.path("list"), "a b\n".repeat(500_000)).unwrap();
    let steps = || (1..40).map(|step| step << 14);
    let least = steps().find(|&most| run_within(&folder, most, "--version").status.success()).unwrap();
    let run = |most| run_within(&folder, most, "match --pairs list --output out --labels 12 --threads 1");
    let mut told = String::new();
    for output in steps().filter(|&most| most >= least).map(run) {
        let code = output.status.code();
        let message = text(&output.stderr);
        assert!(matches!(code, Some(1 | 2 | 3 | 6)), "{code:?}: {message}");
        told += &message;
        // All pairs would write the same map, which is only seen where there is memory for the list.
        if code == Some(2) {
            break;
        }
    }
    assert!(told.contains("memory allocation of") && told.contains("bp: out of memory; free some"), "{told}");
}
