//! Row alignment, by pair and by camera.

use std::fs;

use bp_core::{Alignment, Size};
use bp_io::{Files, Limits, read_image, write_image};
use bp_testkit::synthetic;
use serde_json::Value;

use super::folder::{Folder, text};

const MATCH: &str = "match left.png right.png --labels 32 -o";

/// Two views whose rows differ by 0.2 to 0.8 px, as frames of a video too.
fn views() -> Folder {
    let folder = Folder::new();
    let pair = synthetic::scene(0, 2).pair;
    let pair = Alignment::new(pair.size(), [-0.5, -0.3, 0.0, 0.0, 0.0, 0.0]).unwrap().aligned(&pair).unwrap();
    let Size { width, height } = pair.size();
    for (image, names) in [(pair.left(), ["left", "l1", "l2"]), (pair.right(), ["right", "r1", "r2"])] {
        let bytes = image.pixels().as_flattened().to_vec();
        let picture = image::RgbImage::from_raw(width as u32, height as u32, bytes).unwrap();
        names.iter().for_each(|name| picture.save(folder.path(&format!("{name}.png"))).unwrap());
    }
    folder
}

fn rows(folder: &Folder, arguments: &str) -> Value {
    folder.json(&format!("{MATCH} {arguments} --json"))["settings"]["rows"].clone()
}

#[test]
fn rows_are_aligned_unless_that_is_off() {
    let folder = views();
    let found = rows(&folder, "auto.pfm");
    let [least, largest] = [0, 1].map(|i| found["range"][i].as_f64().unwrap());
    assert!((least - 0.2).abs() < 0.05 && (largest - 0.8).abs() < 0.05 && found["corrected"] == true, "{found}");
    assert_eq!(rows(&folder, "off.pfm --align off"), Value::Null);
    assert_ne!(fs::read(folder.path("auto.pfm")).unwrap(), fs::read(folder.path("off.pfm")).unwrap());
    let report = text(&folder.run(&format!("{MATCH} a.pfm")).stdout);
    assert!(report.contains(&format!("rows      differ by {least:.2} to {largest:.2} px; corrected")), "{report}");
    let same = text(&folder.run("match left.png left.png --labels 16 -o a.pfm").stdout);
    assert!(same.contains("rows      agree"), "{same}");
}

/// Rows are aligned in grey: between rows, the grey value of a colour is not always that of the grey rows.
#[test]
fn colours_that_a_profile_does_not_compare_change_nothing() {
    let folder = views();
    for name in ["left", "right"] {
        let grey = read_image(&folder.path(&format!("{name}.png")), Limits::default()).unwrap().without_colours();
        write_image(&Files::default(), &folder.path(&format!("grey-{name}.png")), &grey).unwrap();
    }
    for (options, is_same) in [("", true), ("--check left-right", true), ("--profile census32", false)] {
        assert_eq!(rows(&folder, &format!("coloured.pfm {options}"))["corrected"], true);
        assert!(
            folder
                .run(&format!("match grey-left.png grey-right.png --labels 32 -o grey.pfm {options}"))
                .status
                .success()
        );
        let [coloured, grey] = ["coloured", "grey"].map(|name| fs::read(folder.path(&format!("{name}.pfm"))).unwrap());
        assert_eq!(coloured == grey, is_same, "{options}");
    }
}

#[test]
fn the_alignment_of_a_camera_is_kept_in_a_file() {
    let folder = views();
    let found = rows(&folder, "first.pfm --align camera.json");
    assert_eq!(rows(&folder, "again.pfm --align camera.json"), found);
    let [first, again, auto] = ["first", "again", "auto"].map(|name| {
        if name == "auto" {
            rows(&folder, "auto.pfm");
        }
        fs::read(folder.path(&format!("{name}.pfm"))).unwrap()
    });
    assert!(first == again && first == auto);
    // A video takes it too, and every frame is aligned alike.
    let video = "match --labels 32 --video l%d.png r%d.png --format pfm --no-sidecar";
    for (name, options) in [("measured", ""), ("known", "--align camera.json"), ("new", "--align new.json")] {
        assert!(folder.run(&format!("{video} -o {name} {options}")).status.success());
        for frame in ["1.pfm", "2.pfm"] {
            assert_eq!(fs::read(folder.path(&format!("{name}/{frame}"))).unwrap(), first, "{name}/{frame}");
        }
    }
    assert_eq!(fs::read(folder.path("new.json")).unwrap(), fs::read(folder.path("camera.json")).unwrap());
}

#[test]
fn unsuitable_alignments_are_refused_and_none_is_invented() {
    let folder = views();
    let fails = |name: &str, contents: &str, code: i32, words: &[&str]| {
        fs::write(folder.path(name), contents).unwrap();
        folder.fails(&format!("{MATCH} map.pfm --align {name}"), code, words);
    };
    let other = r#"{ "width": 8, "height": 9, "coefficients": [1, 0, 0, 0, 0, 0] }"#;
    fails("other.json", other, 2, &["--align is for images of 8x9 pixels"]);
    fails("huge.json", &other.replace('1', "1e99"), 3, &["huge.json", "coefficients"]);
    fails("text.json", "camera", 3, &["text.json: not an alignment"]);
    let blank = image::GrayImage::new(200, 150);
    blank.save(folder.path("blank.png")).unwrap();
    let output = folder.run("match blank.png blank.png --labels 16 -o map.pfm --align none.json");
    assert!(output.status.success() && !folder.path("none.json").exists());
    assert!(text(&output.stderr).contains("none.json is not written"), "{}", text(&output.stderr));
    let output = folder.run("match blank.png blank.png --labels 16 -o map.pfm");
    assert!(text(&output.stdout).contains("rows      not aligned: too few points agree"));
}
