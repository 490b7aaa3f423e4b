//! Batches into folders where something is in the way: links of others, names that no file can have.
#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::symlink,
    process::Command,
    time::{Duration, Instant},
};

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::{
    folder::{Folder, text},
    many::{TINY, names},
};

/// Pairs a to d, the last of them in a folder of its own, are to be matched into `out`.
fn four_pairs() -> (Folder, String) {
    let folder = Folder::new();
    let list = ["a", "b", "c", "e/d"].map(|name| format!("left.png right.png {name}\n")).concat();
    fs::write(folder.path("list"), list).unwrap();
    fs::create_dir_all(folder.path("out/records")).unwrap();
    fs::write(folder.path("treasure"), "mine").unwrap();
    (folder, format!("match --pairs list --output out {TINY}"))
}

#[test]
fn a_link_in_the_output_folder_is_named_and_nothing_goes_through_it() {
    let links = [("records/a.json", "treasure"), ("b.pfm", "treasure"), ("c.pfm", "new"), ("e", "elsewhere")];
    let (folder, run) = four_pairs();
    fs::create_dir(folder.path("elsewhere")).unwrap();
    for (link, target) in links {
        symlink(folder.path(target), folder.path("out").join(link)).unwrap();
    }
    let output = folder.run(&run);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    for (link, _) in links {
        assert!(text(&output.stderr).contains(&format!("out/{link}: it is a link")), "{}", text(&output.stderr));
    }
    assert_eq!(fs::read(folder.path("treasure")).unwrap(), b"mine");
    assert!(!folder.path("new").exists() && fs::read_dir(folder.path("elsewhere")).unwrap().next().is_none());
    // Once they are gone, the same command completes the batch.
    links.iter().for_each(|(link, _)| fs::remove_file(folder.path("out").join(link)).unwrap());
    assert!(folder.run(&run).status.success());
    assert_eq!(names(&folder.path("out")), ["a", "b", "c", "e/d"]);
}

#[test]
fn links_in_place_of_the_folder_of_records_its_lock_or_the_summary_are_refused() {
    for link in ["records", "records/1-of-1.lock", "summary.json"] {
        let (folder, run) = four_pairs();
        if link == "records" {
            fs::remove_dir(folder.path("out/records")).unwrap();
        }
        let target = folder.path("target");
        symlink(&target, folder.path("out").join(link)).unwrap();
        folder.fails(&run, 1, &[&format!("out/{link}: it is a link")]);
        assert!(!target.exists() && names(&folder.path("out")).is_empty(), "{link}");
    }
}

/// The folder itself is the user's choice.
#[test]
fn the_output_folder_may_be_a_link() {
    let (folder, run) = four_pairs();
    fs::rename(folder.path("out"), folder.path("real")).unwrap();
    symlink(folder.path("real"), folder.path("out")).unwrap();
    assert!(folder.run(&run).status.success());
    assert_eq!(names(&folder.path("real")), ["a", "b", "c", "e/d"]);
}

/// What an earlier run wrote besides is removed, but only files that could be that pair's outputs.
#[test]
fn a_forged_record_removes_no_file_of_others() {
    let (folder, run) = four_pairs();
    assert!(folder.run(&format!("{run} --also picture")).status.success());
    let record = folder.path("out/records/a.json");
    let mut forged: Value = serde_json::from_slice(&fs::read(&record).unwrap()).unwrap();
    for name in ["treasure.pfm", "a.mine.pfm", "b.pfm", "../treasure.pfm"] {
        fs::copy(folder.path("out/a.pfm"), folder.path("out").join(name)).unwrap();
        let mut state = forged["done"]["outputs"][0].clone();
        state["path"] = folder.path("out").join(name).display().to_string().into();
        forged["done"]["outputs"].as_array_mut().unwrap().push(state);
    }
    fs::write(&record, forged.to_string()).unwrap();
    assert!(folder.run(&format!("{run} --format npy")).status.success());
    assert!(!folder.path("out/a.pfm").exists() && !folder.path("out/a.picture.png").exists(), "its own are removed");
    for name in ["out/treasure.pfm", "out/a.mine.pfm", "treasure.pfm"] {
        assert!(folder.path(name).exists(), "{name}");
    }
}

#[test]
fn a_forged_record_removes_no_image_and_no_file_of_another_pair() {
    let folder = Folder::new();
    let images = ["left.png", "right.png"].map(|name| fs::read(folder.path(name)).unwrap());
    for name in ["a.png", "r.png"] {
        fs::write(folder.path(name), &images[usize::from(name == "r.png")]).unwrap();
    }
    // A map of `a` could be called a.png, as its left image is, or a.depth.pfm, as the map of the other pair is.
    fs::write(folder.path("list"), "a.png r.png a\nleft.png right.png a.depth\n").unwrap();
    let run = format!("match --pairs list --output . {TINY}");
    assert!(folder.run(&run).status.success());
    let record = folder.path("records/a.json");
    let mut forged: Value = serde_json::from_slice(&fs::read(&record).unwrap()).unwrap();
    for name in ["a.png", "a.depth.pfm"] {
        let bytes = fs::read(folder.path(name)).unwrap();
        let mut state = forged["done"]["outputs"][0].clone();
        state["path"] = folder.path(name).display().to_string().into();
        state["bytes"] = bytes.len().into();
        (state["modified_ns"], state["changed_ns"]) = (Value::Null, Value::Null);
        state["sha256"] = bp_io::hex(&Sha256::digest(&bytes)).into();
        forged["done"]["outputs"].as_array_mut().unwrap().push(state);
    }
    forged["settings_sha256"] = "other".into();
    fs::write(&record, forged.to_string()).unwrap();
    assert!(folder.run(&run).status.success());
    assert!(folder.path("a.pfm").exists() && folder.path("a.png").exists() && folder.path("a.depth.pfm").exists());
}

/// Work for every folder of a name, as long as the name, would take half a minute.
#[test]
fn a_name_of_very_many_folders_fails_at_once() {
    let (folder, run) = four_pairs();
    fs::write(folder.path("list"), format!("left.png right.png {}b\nleft.png right.png z\n", "a/".repeat(200_000)))
        .unwrap();
    let begun = Instant::now();
    assert_eq!(folder.run(&run).status.code(), Some(3));
    assert!(begun.elapsed() < Duration::from_secs(10));
    assert_eq!(names(&folder.path("out")), ["z"]);
}

#[test]
fn a_name_that_cannot_be_written_stops_no_other_pair() {
    let (folder, run) = four_pairs();
    let long = "n".repeat(300);
    let list =
        format!("left.png right.png {long}\nleft.png right.png e/d\nleft.png right.png pipe\nleft.png right.png z\n");
    fs::write(folder.path("list"), list).unwrap();
    // A file where a folder is needed, and a pipe that nobody reads where a map is to be written.
    fs::write(folder.path("out/e"), "").unwrap();
    assert!(Command::new("mkfifo").arg(folder.path("out/pipe.pfm")).status().unwrap().success());
    let output = folder.run(&run);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{told}");
    for words in
        ["File name too long", "out/e: a file is there", "pipe.pfm: it is not a regular file", "3 of 4 pairs failed"]
    {
        assert!(told.contains(words), "{words}: {told}");
    }
    let summary: Value = serde_json::from_slice(&fs::read(folder.path("out/summary.json")).unwrap()).unwrap();
    assert_eq!(["done", "skipped"].map(|key| &summary[key]), [1, 0]);
    fs::remove_file(folder.path("out/pipe.pfm")).unwrap();
    assert_eq!(names(&folder.path("out")), ["z"]);
}

#[test]
fn a_folder_with_the_name_of_a_temporary_file_is_passed_over() {
    let (folder, run) = four_pairs();
    for name in ["out/.bp-1-of-1-x", "out/records/.bp-1-of-1-y", "out/e/.bp-1-of-1-z"] {
        fs::create_dir_all(folder.path(name)).unwrap();
    }
    let output = folder.run(&run);
    let told = text(&output.stderr);
    assert!(output.status.success() && told.contains("warning: ") && told.contains("out/.bp-1-of-1-x"), "{told}");
    assert_eq!(names(&folder.path("out")), ["a", "b", "c", "e/d"]);
}

#[test]
fn a_folder_in_place_of_the_lock_is_refused() {
    let (folder, run) = four_pairs();
    fs::create_dir(folder.path("out/records/1-of-1.lock")).unwrap();
    folder.fails(&run, 1, &["out/records/1-of-1.lock: it is a folder"]);
    assert!(names(&folder.path("out")).is_empty());
}

#[test]
fn a_line_that_is_not_utf_8_stops_no_other_pair() {
    let (folder, run) = four_pairs();
    let list = b"left.png right.png a\nleft\xff.png right.png \xffb\n# \xfe\nleft.png right.png z\n";
    fs::write(folder.path("list"), list).unwrap();
    for done in 0..2 {
        let output = folder.run(&run);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{told}");
        assert!(
            told.contains("\\xffb: line 2 of the list is not a text in UTF-8") && told.contains("1 of 3 pairs failed")
        );
        assert_eq!(names(&folder.path("out")), ["a", "z"]);
        let summary: Value = serde_json::from_slice(&fs::read(folder.path("out/summary.json")).unwrap()).unwrap();
        assert_eq!(
            (&summary["skipped"], &summary["failures"][0]["left"]),
            (&(2 * done).into(), &"left\\xff.png".into())
        );
    }
}
