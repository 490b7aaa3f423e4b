//! The common behaviour of all commands: help, man pages, silence on request, nothing left behind.

use std::{fs, process::Stdio, time::Duration};

use crate::folder::{Folder, MATCH, text};

const COMMANDS: [&str; 16] = [
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
    "rectify",
    "completions",
    "man",
];

#[test]
fn every_command_has_examples_completions_and_a_man_page() {
    let folder = Folder::new();
    assert!(folder.run("man pages").status.success());
    let page = |name: &str| fs::read_to_string(folder.path(&format!("pages/{name}.1"))).unwrap();
    for command in COMMANDS {
        let help = text(&folder.run(&format!("{command} --help")).stdout);
        assert!(help.contains("Example") && help.contains(&format!("  bp {command} ")), "{help}");
        let page = page(&format!("bp-{command}"));
        assert!(page.contains(".TH bp-") && page.contains("OPTIONS") && page.contains("Example"), "{page}");
    }
    assert_eq!(fs::read_dir(folder.path("pages")).unwrap().count(), COMMANDS.len() + 1);
    let program = page("bp");
    assert!(program.contains("130 interrupted") && program.contains("RUST_LOG"), "{program}");
    let help = text(&folder.run("--help").stdout);
    assert!(help.contains("130 interrupted") && COMMANDS.iter().all(|command| help.contains(command)), "{help}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = text(&folder.run(&format!("completions {shell}")).stdout);
        assert!(script.contains("coarse-clip") && COMMANDS.iter().all(|command| script.contains(command)), "{shell}");
    }
}

#[test]
fn quiet_tells_errors_only_and_the_log_only_what_was_asked_for() {
    let folder = Folder::new();
    let noted = format!("{MATCH} a.pfm --min-disparity 100");
    assert!(text(&folder.run(&noted).stderr).contains("warning"));
    for quiet in ["--quiet", "-q"] {
        let output = folder.run(&format!("{noted} {quiet}"));
        assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
    }
    folder.fails("match no.png right.png -o b.pfm --quiet", 3, &["no.png"]);
    let output = folder.run(&format!("{MATCH} a.pfm --json"));
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    let output = folder.command(&format!("{MATCH} a.pfm --json")).env("RUST_LOG", "debug").output().unwrap();
    let log = text(&output.stderr);
    assert!(["opened device", "prepared for 40x24 pixels", "solved in"].iter().all(|what| log.contains(what)), "{log}");
    serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap();
}

#[test]
fn colours_are_left_out_where_they_are_not_wanted() {
    let folder = Folder::new();
    let error = |variable: &str| {
        let mut command = folder.command("match --labels");
        text(&command.env("CLICOLOR_FORCE", "1").env(variable, "1").output().unwrap().stderr)
    };
    assert!(error("BP_NOTHING").contains('\u{1b}'));
    assert!(!error("NO_COLOR").contains('\u{1b}'));
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_match_without_a_trace() {
    let folder = Folder::new();
    let noise = image::GrayImage::from_fn(400, 300, |x, y| image::Luma([((x * x * 7 + y * 31 + x * y) % 251) as u8]));
    noise.save(folder.path("big.pgm")).unwrap();
    let run = "match big.pgm big.pgm --output a.pfm --picture a.png --labels 64 --algorithm bp --loops 100000";
    for signal in ["INT", "TERM"] {
        let child = folder.command(run).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let before = fs::read_dir(folder.path("")).unwrap().count();
        std::thread::sleep(Duration::from_millis(300));
        let kill = std::process::Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
        assert_eq!(fs::read_dir(folder.path("")).unwrap().count(), before);
    }
}
