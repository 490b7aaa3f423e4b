//! The peak memory of `bp match`, measured by the system.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::{fs, path::Path, process::Command};

use nix::sys::resource::{UsageWho, getrusage};

/// A size whose buffers include both kinds: those that allocators treat as large, and those that they keep.
const SIZE: (usize, usize) = (2500, 2000);

fn pair(folder: &Path) {
    let (width, height) = SIZE;
    for (name, shift) in [("left.ppm", 0), ("right.ppm", 5)] {
        let value = |x: usize, y: usize| [((x + shift) * (x + shift) * 7 + y * 31) as u8, (x + shift) as u8, y as u8];
        let pixels = (0..height).flat_map(|y| (0..width).flat_map(move |x| value(x, y)));
        let header = format!("P6\n{width} {height}\n255\n").into_bytes();
        fs::write(folder.join(name), header.into_iter().chain(pixels).collect::<Vec<u8>>()).unwrap();
    }
}

/// The refusal of a tiny limit names the smallest possible one. The program keeps to that limit with all kinds of
/// outputs.
#[test]
fn the_least_memory_limit_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    pair(folder.path());
    for options in ["", "--picture p.png", "--speckle 20", "--check left-right --median 3 --confidence c.npy"] {
        let run = |limit: &str| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
            command.args("match left.ppm right.ppm -o m.pfm --labels 16 --threads 2 --quiet".split(' '));
            command.args(options.split_whitespace()).args(["--max-memory", limit]);
            command.current_dir(folder.path()).env("RUST_BACKTRACE", "0").output().unwrap()
        };
        let refused = String::from_utf8(run("1").stderr).unwrap();
        let words = refused.split("at least ").nth(1).unwrap_or_else(|| panic!("{refused}"));
        let least = words.split(',').next().unwrap().replace(' ', "");
        let output = run(&least);
        let least = (least.strip_suffix("MiB").unwrap().parse::<f64>().unwrap() * f64::from(1 << 20)) as u64;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        // The peak of the largest child process so far. No other test runs at the same time.
        let held = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap().max_rss() as u64 * 1024;
        assert!(held <= least, "{options:?}: {held} bytes held, {least} allowed");
    }
}
