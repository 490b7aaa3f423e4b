//! Many pairs: which ones are found, how they are named, and the notes about them.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::folder::{Folder, text};

/// Options that make matching tiny pairs quick.
pub(super) const TINY: &str = "--labels 12 --threads 1";

/// Copies the folder's pair to these paths.
pub(super) fn place(folder: &Folder, images: &[&str]) {
    for image in images {
        let to = folder.path(image);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        let is_left =
            ["view1", "im2", "im0", "imL", "left", "image_2", "image_0"].iter().any(|name| image.contains(name));
        fs::copy(folder.path(if is_left { "left.png" } else { "right.png" }), to).unwrap();
    }
}

/// All files below a folder, relative to it.
pub(super) fn files(folder: &Path) -> BTreeSet<PathBuf> {
    let below = |entry: fs::DirEntry| {
        let name = PathBuf::from(entry.file_name());
        if entry.path().is_dir() {
            files(&entry.path()).into_iter().map(|file| name.join(file)).collect()
        } else {
            vec![name]
        }
    };
    fs::read_dir(folder).unwrap().flat_map(|entry| below(entry.unwrap())).collect()
}

pub(super) fn maps(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let is_map = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "pfm");
    files(folder).into_iter().filter(is_map).map(|path| (path.clone(), fs::read(folder.join(path)).unwrap())).collect()
}

pub(super) fn names(folder: &Path) -> Vec<String> {
    maps(folder).into_iter().map(|(path, _)| path.with_extension("").display().to_string()).collect()
}

#[test]
fn pairs_of_every_layout_are_found_and_what_is_lonely_or_ambiguous_is_told() {
    let folder = Folder::new();
    place(
        &folder,
        &["in/a/view1.png", "in/a/view5.png", "in/b/im0.png", "in/b/IM1.PNG", "in/c/imL.png", "in/c/imR.png"],
    );
    place(
        &folder,
        &["in/d/im2.png", "in/d/im6.png", "in/d/im0.png", "in/d/im1.png", "in/e/left.PNG", "in/e/right.png"],
    );
    place(&folder, &["in/k/image_2/f2.png", "in/k/image_3/f2.png", "in/k/image_2/f10.png", "in/k/image_3/f10.png"]);
    place(&folder, &["in/k/image_0/f2.png", "in/k/image_1/f2.png", "in/k/image_2/f3.png"]);
    place(&folder, &["in/v/left/1.png", "in/v/right/1.png", "in/l/view5.png", "in/m/left/1.png"]);
    let output = folder.run(&format!("match --pairs in --output in/out {TINY}"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    let expected =
        ["a/view1", "b/im0", "c/imL", "d/im2", "e/left", "k/image_0/f2", "k/image_2/f10", "k/image_2/f2", "v/left/1"];
    assert_eq!(names(&folder.path("in/out")), expected);
    let told = text(&output.stderr);
    for words in ["image_2/f3.png", "l/view5.png has no view1.png", "m/left has no folder right"] {
        assert!(told.contains(words), "{told}");
    }
    assert!(told.contains("im2.png and im6.png are taken as its pair, not im0.png and im1.png"), "{told}");
    assert_eq!(told.lines().count(), 4, "{told}");
    // Outputs are not searched, complete pairs are skipped, and a pair matched on its own gives the same map.
    let again = folder.json(&format!("match --pairs in --output in/out --json {TINY}"));
    assert_eq!((&again["pairs"], &again["skipped"]), (&9.into(), &9.into()));
    folder.run(&format!("match in/d/im2.png in/d/im6.png --output alone.pfm {TINY}"));
    assert_eq!(fs::read(folder.path("alone.pfm")).unwrap(), fs::read(folder.path("in/out/d/im2.pfm")).unwrap());
    fs::create_dir(folder.path("empty")).unwrap();
    folder.fails("match --pairs empty --output out", 3, &["empty", "no pair"]);
}

#[cfg(unix)]
#[test]
fn names_that_no_record_can_hold_are_passed_over() {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
    let folder = Folder::new();
    place(&folder, &["in/a/left.png", "in/a/right.png", "in/b/left.png", "in/b/right.png"]);
    let odd = folder.path("in").join(OsStr::from_bytes(b"\xff"));
    if fs::rename(folder.path("in/b"), &odd).is_err() {
        return; // Some file systems do not allow such names.
    }
    let output = folder.run(&format!("match --pairs in --output out {TINY}"));
    let told = text(&output.stderr);
    assert!(output.status.success() && told.contains("no name in UTF-8"), "{told}");
    assert_eq!(names(&folder.path("out")), ["a/left"]);
    let mut inside = folder.command(&format!("match --pairs {} --output out {TINY}", folder.path("in").display()));
    let output = inside.current_dir(&odd).output().unwrap();
    assert!(output.status.code() == Some(2) && text(&output.stderr).contains("rename it"), "{}", text(&output.stderr));
}

#[test]
fn lists_name_maps_and_broken_lines_are_told_by_number() {
    let folder = Folder::new();
    place(&folder, &["a b/left.png", "a b/right.png"]);
    fs::write(folder.path("list"), "a b/left.png\ta b/right.png\nleft.png right.png x/y\n").unwrap();
    assert!(folder.run(&format!("match --pairs list --output out --also picture {TINY}")).status.success());
    let expected = [
        "a b/left.pfm",
        "a b/left.pfm.json",
        "x/y.pfm.json",
        "a b/left.picture.png",
        "a b/left.picture.png.json",
        "x/y.picture.png.json",
        "records/1-of-1.lock",
        "records/a b/left.json",
        "records/x/y.json",
        "summary.json",
    ];
    let expected: BTreeSet<_> = expected.into_iter().chain(["x/y.pfm", "x/y.picture.png"]).map(PathBuf::from).collect();
    assert_eq!(files(&folder.path("out")), expected);
    fs::write(folder.path("bad"), "left.png right.png\nleft.png\n").unwrap();
    folder.fails("match --pairs bad --output no", 3, &["bad:2", "left, right"]);
    let mut piped = folder.command(&format!("match --pairs - --output piped --format png {TINY}"));
    let piped = piped.stdin(fs::File::open(folder.path("list")).unwrap()).output().unwrap();
    assert!(piped.status.success() && folder.path("piped/x/y.png").exists());
}

#[test]
fn outputs_that_would_collide_are_refused_before_the_work() {
    let folder = Folder::new();
    let list = |lines: &str| fs::write(folder.path("list"), lines).unwrap();
    for (lines, options, words) in [
        ("left.png right.png\nright.png left.png left\n", "", ["left.pfm", "right.png"]),
        ("left.png right.png a\nright.png left.png A\n", "", ["A.pfm", "names"]),
        ("left.png right.png a\nright.png left.png a.pfm/b\n", "", ["a.pfm", "right.png"]),
        (
            "left.png right.png a\nright.png left.png a.picture\n",
            "--also picture --format png",
            ["a.picture.png", "names"],
        ),
        ("left.png right.png\n", "--format png --output .", ["left.png", "overwritten"]),
    ] {
        list(lines);
        let output = if options.contains("--output") { "" } else { "--output out" };
        folder.fails(&format!("match --pairs list {output} {options} {TINY}"), 2, &words);
    }
    list("left.png right.png\n");
    for format in ["tiff.gz", "../pfm", "/", "x.pfm"] {
        folder.fails(&format!("match --pairs list --output out --format {format}"), 2, &[format, ".pfm, .png"]);
        folder.fails(&format!("match --video left*.png right*.png --output out --format {format}"), 2, &[format]);
    }
    for options in [
        "left.png right.png --shard 1/2",
        "left.png right.png --pairs list",
        "--pairs list --shard 3/2",
        "--pairs list --repeat 2",
        "--pairs list --confidence c.pfm",
    ] {
        folder.fails(&format!("match --output out {options}"), 2, &["--"]);
    }
}

#[test]
fn frames_are_matched_in_order_and_gaps_are_told() {
    let folder = Folder::new();
    place(&folder, &["l/left_8.png", "l/left_9.png", "l/left_10.png", "l/left_13.png", "l/left_x.png"]);
    for frame in ["8", "9", "10", "13", "14"] {
        fs::copy(folder.path("right.png"), folder.path(&format!("l/r{frame}.png"))).unwrap();
    }
    let output = folder
        .command(&format!("match --output out --json {TINY} --video l/left_%d.png l/r%02d.png"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(names(&folder.path("out")), ["10", "13", "8", "9"]);
    let told = text(&output.stderr);
    assert!(told.contains("r14.png has no left frame 14") && told.contains("frames 11 to 12 are missing"), "{told}");
    assert_eq!(told.lines().count(), 2, "{told}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["solved_per_second"].as_f64().unwrap() >= report["pairs_per_second"].as_f64().unwrap());
    let order =
        |frame: &str| fs::metadata(folder.path(&format!("out/records/{frame}.json"))).unwrap().modified().unwrap();
    assert!(["8", "9", "10", "13"].map(order).is_sorted());
    let globbed = folder.run(&format!("match --output globbed {TINY} --video l/left_*.png l/r*.png"));
    assert!(globbed.status.success(), "{}", text(&globbed.stderr));
    assert_eq!(maps(&folder.path("globbed")), maps(&folder.path("out")));
    for patterns in ["left.png r%d.png", "l/%s.png r%d.png", "l/*/*.png r%d.png"] {
        folder.fails(&format!("match --output no --video {patterns}"), 2, &["--video", "%04d"]);
    }
}

#[test]
fn frames_that_start_warm_are_the_same_however_they_are_resumed_or_shared() {
    let folder = Folder::new();
    for frame in 0..7 {
        place(&folder, &[&format!("v/left/{frame}.png"), &format!("v/right/{frame}.png")]);
        let noise = |x: u32, y: u32| ((x * x * 7 + x * y * 13 + y * 31 + x * 5) % 251) as u8;
        let view = |shift: u32| image::GrayImage::from_fn(40, 24, |x, y| image::Luma([noise(x + shift + frame, y)]));
        view(0).save(folder.path(&format!("v/left/{frame}.png"))).unwrap();
        view(2 + 3 * (frame % 3)).save(folder.path(&format!("v/right/{frame}.png"))).unwrap();
    }
    let options = "--algorithm cfbp --half-steps 1 --slope 9 --truncation 60 --labels 12 --threads 1";
    let run = |output: &str, rest: &str| {
        folder.json(&format!("match --video v/left/%d.png v/right/%d.png --json {options} --output {output} {rest}"))
    };
    run("cold", "");
    assert_eq!(run("warm", "--warm-start=3")["done"], 7);
    let whole = maps(&folder.path("warm"));
    let same: Vec<bool> = maps(&folder.path("cold")).iter().zip(&whole).map(|(cold, warm)| cold == warm).collect();
    assert!(same[0] && same[3] && same[6] && !same.iter().all(|&same| same), "{same:?}");
    fs::remove_file(folder.path("warm/4.pfm")).unwrap();
    assert_eq!(run("warm", "--warm-start=3")["skipped"], 4);
    assert_eq!(maps(&folder.path("warm")), whole);
    assert_eq!(
        [1, 2].map(|shard| run("shared", &format!("--warm-start=3 --shard {shard}/2"))["done"].as_u64().unwrap()),
        [4, 3]
    );
    assert_eq!(maps(&folder.path("shared")), whole);
    // A chain is matched again if its records follow a different first frame, even though the first frame is complete.
    let (new, old) = (fs::read(folder.path("v/left/5.png")).unwrap(), fs::read(folder.path("v/left/0.png")).unwrap());
    run("cut", "--warm-start=3");
    let records: Vec<_> = [1, 2].map(|frame| format!("cut/records/{frame}.json")).into();
    let kept: Vec<_> = records.iter().map(|record| fs::read(folder.path(record)).unwrap()).collect();
    let maps_before: Vec<_> = [1, 2].map(|frame| fs::read(folder.path(&format!("cut/{frame}.pfm"))).unwrap()).into();
    fs::write(folder.path("v/left/0.png"), new).unwrap();
    run("cut", "--warm-start=3");
    let anew = maps(&folder.path("cut"));
    for ((record, kept), (frame, map)) in records.iter().zip(kept).zip([1, 2].into_iter().zip(maps_before)) {
        fs::write(folder.path(record), kept).unwrap();
        fs::write(folder.path(&format!("cut/{frame}.pfm")), map).unwrap();
    }
    assert_eq!(run("cut", "--warm-start=3")["skipped"], 4);
    assert_eq!(maps(&folder.path("cut")), anew);
    fs::write(folder.path("v/left/0.png"), old).unwrap();
    // Frames after a missing one start from the messages of a different frame.
    fs::rename(folder.path("v/left/1.png"), folder.path("v/left_1.png")).unwrap();
    assert_eq!(run("warm", "--warm-start=3")["skipped"], 0);
    run("anew", "--warm-start=3");
    fs::remove_file(folder.path("warm/1.pfm")).unwrap();
    assert_eq!(maps(&folder.path("warm")), maps(&folder.path("anew")));
    fs::rename(folder.path("v/left_1.png"), folder.path("v/left/1.png")).unwrap();
    // If the first frame of a chain fails, the next frame must not start from the messages of another chain.
    fs::write(folder.path("v/left/3.png"), "broken").unwrap();
    let broken = "match --video v/left/%d.png v/right/%d.png --warm-start=3 --algorithm cfbp --half-steps 1 --slope 9 --truncation 60 --labels 12";
    for output in ["warm", "broken"] {
        assert_eq!(folder.run(&format!("{broken} --output {output}")).status.code(), Some(3));
    }
    assert_eq!(maps(&folder.path("warm")), maps(&folder.path("broken")));
    for options in ["", "--algorithm cfbp --check left-right", "--algorithm cfbp --also confidence"] {
        let run = format!("match --video l%d r%d --output no --warm-start {options}");
        folder.fails(&run, 2, &["--warm-start", "cfbp", "--check"]);
    }
    folder.fails("match left.png right.png -o no.pfm --warm-start", 2, &["--warm-start needs --video"]);
    let cold = "--output no --algorithm cfbp --half-steps 4 --warm-start";
    folder.fails(&format!("match --pairs . {cold}"), 2, &["--warm-start needs --video"]);
    folder.fails(&format!("match --video l%d r%d {cold} --labels auto"), 2, &["--labels a number"]);
}

#[test]
fn options_of_many_pairs_are_refused_by_name_for_one() {
    let folder = Folder::new();
    for option in ["--force", "--shard 1/2", "--also picture", "--format tif"] {
        let name = option.split(' ').next().unwrap();
        let sentence = format!("{name} is for many pairs: give --pairs or --video");
        folder.fails(&format!("match left.png right.png -o no.pfm {option}"), 2, &[&sentence]);
    }
    folder.fails("match left.png right.png -o no.pfm --layout top-bottom", 2, &["--layout needs --video"]);
    folder.fails("match --pairs . -o no --layout top-bottom", 2, &["--layout needs --video"]);
}
