//! `--quality`: what each level stands for, and that other options change single parts of it.

use serde_json::{Value, json};

use super::folder::Folder;

#[test]
fn a_quality_is_a_set_of_options() {
    let folder = Folder::new();
    let grey = image::open(folder.path("left.png")).unwrap().to_rgb8();
    let mut colours = grey.clone();
    colours.pixels_mut().for_each(|pixel| pixel.0[0] /= 2);
    grey.save(folder.path("grey.png")).unwrap();
    colours.save(folder.path("colour.png")).unwrap();
    let settings = |left: &str, options: &str| -> (Value, Value) {
        let report = folder.json(&format!("match {left}.png right.png --labels 12 -o map.pfm --json {options}"));
        (report["settings"]["profile"].clone(), report["settings"]["finish"].clone())
    };
    let finish = |check: &str, median: Option<usize>, subpixel: bool| {
        let fill = check != "off";
        let mut finish = json!({ "check": check == "left-right", "fill": fill, "median": median, "speckles": null, "subpixel": subpixel });
        if check == "unique" {
            finish["unique"] = json!(true);
        }
        finish
    };
    for (options, finish) in [
        ("", finish("unique", None, true)),
        ("--quality balanced", finish("unique", None, true)),
        ("--check off", finish("off", None, true)),
        ("--check left-right", finish("left-right", None, true)),
        ("--quality fast", Value::Null),
        ("--quality fast --median 5", finish("off", Some(5), false)),
        ("--quality fast --check unique", finish("unique", None, false)),
        ("--quality best", finish("left-right", Some(3), true)),
        ("--quality best --check unique", finish("unique", Some(3), true)),
        ("--quality best --median 7 --whole-pixels", finish("left-right", Some(7), false)),
    ] {
        assert_eq!(settings("grey", options), (json!("census16"), finish), "{options}");
    }
    assert_eq!(settings("colour", "").0, "census16");
    assert_eq!(settings("colour", "--quality best").0, "census32");
    assert_eq!(settings("colour", "--quality best --profile census").0, "census");
    folder.fails("match left.png right.png -o map.pfm --quality good", 2, &["fast, balanced, best"]);
    for off in ["--check off", "--quality fast"] {
        let words = format!("match left.png right.png -o map.pfm --fill off {off}");
        folder.fails(&words, 2, &["--fill needs --check or --speckle"]);
    }
}
