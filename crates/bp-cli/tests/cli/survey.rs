//! Labels that the survey of the images finds, and warnings about wrong pairs.

use super::folder::{Folder, text};

/// Two views of a noisy plane 9 px apart, one with rows 2 px lower, and another scene; all large enough for the survey.
fn views() -> Folder {
    let folder = Folder::new();
    let noise = |x: u32, y: u32| {
        let mixed = (x ^ y << 16).wrapping_mul(0x9e37_79b1);
        ((mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca6b) >> 24) as u8
    };
    for (name, x0, y0) in [("a.png", 0, 4), ("b.png", 9, 4), ("low.png", 9, 2), ("other.png", 5000, 700)] {
        image::GrayImage::from_fn(90, 70, |x, y| image::Luma([noise(x + x0, y + y0)])).save(folder.path(name)).unwrap();
    }
    folder
}

fn warnings(folder: &Folder, arguments: &str) -> String {
    let report = folder.json(&format!("match {arguments} -o map.pfm --json"));
    let warnings: Vec<&str> =
        report["warnings"].as_array().unwrap().iter().map(|line| line.as_str().unwrap()).collect();
    warnings.join("; ")
}

#[test]
fn labels_auto_takes_the_range_that_the_images_need() {
    let folder = views();
    let settings = |arguments: &str| {
        let report = folder.json(&format!("match {arguments} --json"));
        let auto = folder.json(&format!("match {arguments} --labels auto --json"));
        assert_eq!(auto["settings"]["labels"], report["settings"]["labels"], "the default is auto");
        (report["settings"]["min_disparity"].as_i64().unwrap(), report["settings"]["labels"].as_u64().unwrap())
    };
    assert_eq!(settings("a.png b.png -o map.pfm"), (8, 3));
    assert_eq!(settings("b.png a.png -o map.pfm"), (-10, 3));
    assert_eq!(settings("a.png b.png -o map.pfm --min-disparity 2"), (2, 9));
    // Nothing is negative here, so the margin is not either.
    assert_eq!(settings("a.png a.png -o map.pfm"), (0, 2));
    folder.fails("match b.png a.png -o no.png --labels auto", 2, &["exchanged", "use an output that ends in .pfm"]);
    folder.fails("match a.png b.png -o no.png --labels some", 2, &["auto or a number from 1 to 1024"]);
}

#[test]
fn wrong_pairs_and_labels_are_told_with_what_to_do() {
    let folder = views();
    assert_eq!(warnings(&folder, "a.png b.png"), "");
    for (arguments, words) in [
        ("b.png a.png", ["b.png and a.png look exchanged", "swap them"]),
        ("a.png low.png", ["rows of a.png and low.png do not correspond", "2 px too low): rectify"]),
        ("a.png other.png", ["hardly anything in a.png and other.png matches", "different scenes"]),
        ("a.png b.png --labels 6", ["disparities from about 9 to 9 px", "raise --labels"]),
        ("a.png b.png --min-disparity 12", ["reach from 12 to", "lower --min-disparity"]),
        ("a.png b.png --min-disparity 12 --labels auto", ["lower --min-disparity", "or leave it to --labels auto"]),
        ("a.png b.png --min-disparity -30 --labels 9", ["raise --min-disparity", "or use --labels auto"]),
        ("a.png a.png", ["a.png and a.png are the same image", "nearer"]),
        ("a.png b.png --labels 100", ["100 labels for images 90 pixels wide", "the last ones match nowhere"]),
        (
            "a.png b.png --labels 120 --min-disparity -100",
            ["for images 90 pixels wide", "the first ones match nowhere"],
        ),
        ("a.png other.png", ["too little in a.png and other.png matches", "give --labels a number"]),
    ] {
        let told = warnings(&folder, arguments);
        assert!(words.iter().all(|word| told.contains(word)), "{arguments}: {told}");
    }
    for fine in ["b.png a.png --labels 20 --min-disparity -15", "a.png b.png --labels 100 --min-disparity -80"] {
        assert_eq!(warnings(&folder, fine), "");
    }
}

#[test]
fn of_many_pairs_the_first_warning_of_a_kind_is_told_and_records_have_all() {
    let folder = views();
    let mut list = String::new();
    for pair in 0..25 {
        std::fs::copy(folder.path("b.png"), folder.path(&format!("b{pair}.png"))).unwrap();
        list += &format!("b{pair}.png a.png\n");
    }
    std::fs::write(folder.path("list"), list).unwrap();
    let told = text(&folder.run("match --pairs list --output out").stderr);
    assert_eq!(
        (told.matches("look exchanged:").count(), told.matches("24 more pairs look exchanged").count()),
        (1, 1),
        "{told}"
    );
    let last = std::fs::read_to_string(folder.path("out/records/b24.json")).unwrap();
    assert!(last.contains("b24.png and a.png look exchanged"), "{last}");
}
