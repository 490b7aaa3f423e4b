//! What a user other than the administrator may not do: read every folder, start any number of threads.
#![cfg(unix)]

use std::{
    fs,
    os::unix::{
        fs::{PermissionsExt, chown},
        process::CommandExt as _,
    },
    path::PathBuf,
    process::Command,
};

use crate::{
    folder::{Folder, text},
    many::{TINY, names, place},
};

/// Runs the program, by way of another one, for a user whom modes and limits hold if they do not hold this one.
fn as_nobody(folder: &Folder, by_way_of: &str, arguments: &str) -> Command {
    const NOBODY: u32 = 65_534;
    let forbidden = folder.path("forbidden");
    fs::write(&forbidden, "").unwrap();
    fs::set_permissions(&forbidden, fs::Permissions::from_mode(0o000)).unwrap();
    let is_held = fs::read(&forbidden).is_err();
    fs::remove_file(&forbidden).unwrap();
    let mut program = PathBuf::from(env!("CARGO_BIN_EXE_bp"));
    if !is_held {
        // That user may not be allowed to enter the folder of the build.
        fs::copy(&program, folder.path("bp")).unwrap();
        program = folder.path("bp");
        chown(folder.path(""), Some(NOBODY), Some(NOBODY)).unwrap();
    }
    let line = format!("{by_way_of} {} {arguments}", program.display());
    let mut words = line.split_whitespace();
    let mut command = Command::new(words.next().unwrap());
    command.args(words).current_dir(folder.path(""));
    if !is_held {
        command.uid(NOBODY).gid(NOBODY);
    }
    command
}

/// With a thread less each time, from enough to none.
#[cfg(target_os = "linux")]
#[test]
fn a_system_that_starts_no_more_threads_is_an_error_or_slower() {
    let folder = Folder::new();
    fs::write(folder.path("list"), "left.png right.png").unwrap();
    let list = "match --pairs list --labels 12";
    for arguments in [
        &format!("{} ", crate::folder::MATCH),
        &format!("{list} --output many"),
        &format!("{list} --max-memory 100MB --output one"),
    ] {
        let mut codes = vec![];
        for most in (1..13).rev() {
            let mut command = as_nobody(&folder, &format!("prlimit --nproc={most}"), &format!("{arguments}{most}.pfm"));
            let output = command.env("RAYON_NUM_THREADS", "1").output().unwrap();
            let message = text(&output.stderr);
            assert!(!message.contains("panicked"), "{most}: {message}");
            codes.push(output.status.code());
        }
        assert!(codes.starts_with(&[Some(0)]) && codes.ends_with(&[Some(1)]), "{codes:?}");
    }
}

/// The administrator may read every folder, so another user runs the program then.
#[test]
fn a_folder_that_may_not_be_read_is_named_and_the_others_are_matched() {
    let folder = Folder::new();
    place(&folder, &["in/a/view1.png", "in/a/view5.png", "in/secret/view1.png", "in/secret/view5.png"]);
    let secret = folder.path("in/secret");
    fs::set_permissions(&secret, fs::Permissions::from_mode(0o000)).unwrap();
    let mut command = as_nobody(&folder, "", &format!("match --pairs in --output out {TINY}"));
    let output = command.output().unwrap();
    fs::set_permissions(&secret, fs::Permissions::from_mode(0o700)).unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("in/secret"), "{}", text(&output.stderr));
    assert_eq!(names(&folder.path("out")), ["a/view1"]);
}
