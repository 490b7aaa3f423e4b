//! Tells the program which revision, compiler and flags it was built from.

use std::process::Command;

fn main() {
    // Asked when it runs: two checkouts that share a target folder share the compiled script.
    let root = &format!("{}/../..", std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default());
    let sources = ["Cargo.toml", "Cargo.lock", "crates", "shaders", "bench-data"];
    for source in sources {
        println!("cargo::rerun-if-changed={root}/{source}");
    }
    println!("cargo::rerun-if-changed={root}/.git/HEAD");
    println!("cargo::rerun-if-changed={root}/.git/refs/heads");
    let git = |args: &[&str]| output("git", &[&["-C", root], args].concat());
    let commit = git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    let changes = git(&[&["status", "--porcelain", "--"], sources.as_slice()].concat());
    println!("cargo::rustc-env=BP_COMMIT={commit}");
    println!("cargo::rustc-env=BP_CLEAN_TREE={}", changes.is_some_and(|changes| changes.is_empty()));
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    println!("cargo::rustc-env=BP_RUSTC={}", output(&rustc, &["--version"]).unwrap_or_default());
    let variable = |name| std::env::var(name).unwrap_or_default();
    let flags = variable("CARGO_ENCODED_RUSTFLAGS").replace('\u{1f}', " ");
    let flags = format!("opt-level={} target={} {flags}", variable("OPT_LEVEL"), variable("TARGET"));
    println!("cargo::rustc-env=BP_FLAGS={}", flags.trim());
}

/// What a command prints, without the last line's end; `None` where it cannot be run or fails.
fn output(program: &str, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}
