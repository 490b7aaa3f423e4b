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
    let finish = |check: bool, median: Option<usize>, subpixel: bool| json!({ "check": check, "fill": check, "median": median, "speckles": null, "subpixel": subpixel });
    for (options, finish) in [
        ("", finish(false, None, true)),
        ("--quality balanced", finish(false, None, true)),
        ("--quality fast", Value::Null),
        ("--quality fast --median 5", finish(false, Some(5), false)),
        ("--quality best", finish(true, Some(3), true)),
        ("--quality best --median 7 --whole-pixels", finish(true, Some(7), false)),
    ] {
        assert_eq!(settings("grey", options), (json!("census16"), finish), "{options}");
    }
    assert_eq!(settings("colour", "").0, "census16");
    assert_eq!(settings("colour", "--quality best").0, "census32");
    assert_eq!(settings("colour", "--quality best --profile census").0, "census");
    folder.fails("match left.png right.png -o map.pfm --quality good", 2, &["fast, balanced, best"]);
}
