//! Folders that are searched for pairs.
#![cfg(unix)]

use std::{fs, os::unix::fs::symlink};

use crate::{
    folder::{Folder, text},
    many::{TINY, names, place},
};

/// Files there come and go, links lead to no path, and some may not be read.
#[cfg(target_os = "linux")]
#[test]
fn folders_of_the_system_are_searched_to_their_end() {
    let folder = Folder::new();
    for place in ["/proc/self/fd", "/proc/self/fdinfo", "/proc/self/ns", "/proc/self/map_files", "/proc/self/net"] {
        folder.fails(&format!("match --pairs {place} --output out"), 3, &[place, "no pair found"]);
    }
}

/// One link leads up, one to a folder that is searched anyway, one to itself.
#[test]
fn links_in_a_searched_folder_are_followed_and_those_that_lead_nowhere_are_told() {
    let folder = Folder::new();
    place(&folder, &["in/a/view1.png", "in/a/view5.png"]);
    symlink(folder.path("in"), folder.path("in/a/up")).unwrap();
    symlink(folder.path("in/a"), folder.path("in/b")).unwrap();
    let run = || folder.run(&format!("match --pairs in --output out {TINY}"));
    let output = run();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(names(&folder.path("out")), ["a/view1", "b/view1"]);
    symlink("itself", folder.path("in/itself")).unwrap();
    let output = run();
    assert_eq!(output.status.code(), Some(3), "what cannot be searched may hold pairs: {}", text(&output.stderr));
    assert!(text(&output.stderr).contains("1 folders could not be read"), "{}", text(&output.stderr));
}

/// What a folder of links to folders of links holds is a million times as much.
#[test]
fn links_that_multiply_what_is_searched_are_refused() {
    let folder = Folder::new();
    for (from, to) in [("a", "b"), ("b", "c")] {
        fs::create_dir(folder.path(from)).unwrap();
        (0..100).for_each(|link| symlink(folder.path(to), folder.path(&format!("{from}/{link}"))).unwrap());
    }
    fs::create_dir(folder.path("c")).unwrap();
    (0..101).for_each(|file| fs::write(folder.path(&format!("c/{file}")), "").unwrap());
    folder.fails(&format!("match --pairs a --output out {TINY}"), 3, &["1000000"]);
}
