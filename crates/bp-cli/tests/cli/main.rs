//! The program as its users see it: options, files, messages, exit codes.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

mod align;
mod devices;
mod folder;
mod foreign;
mod hostile;
mod manners;
mod many;
mod nobody;
mod outputs;
mod quality;
mod recorded;
mod rectify;
mod resumed;
mod running;
mod searched;
mod shortage;
mod speed;
mod stream;
mod survey;
mod unwritable;

use std::{fs, path::Path, process::Command};

use folder::{Folder, HEIGHT, MATCH, SHIFT, WIDTH, text};
use serde_json::Value;

#[test]
fn a_shifted_pair_is_matched_and_evaluated_in_every_format() {
    let folder = Folder::new();
    let truth = "--ground-truth truth.png --ground-truth-right truth.png --scale 2";
    for (algorithm, output) in [
        ("bp", "a.pfm"),
        ("cfbp", "b.png"),
        ("cfcsbp", "c.PFM"),
        ("ctbp", "d.png"),
        ("ctcsbp", "e.pfm"),
        ("sweep", "g.png"),
    ] {
        let report = folder.json(&format!("{MATCH} {output} --algorithm {algorithm} {truth} --json"));
        let bad = report["errors"]["visible"]["bad"][1].as_f64().unwrap();
        assert!(bad < 2.0, "{algorithm}: {bad} % of non-occluded pixels");
        assert_eq!(report["settings"]["algorithm"], algorithm);
        let again =
            folder.json(&format!("evaluate {output} truth.png --ground-truth-right truth.png --scale 2 --json"));
        assert_eq!(again["visible"]["bad"], report["errors"]["visible"]["bad"], "{output}");
    }
    let whole = folder.run("match left.png right.pgm -o f.png --picture p.png --labels 12 --whole-pixels");
    assert_eq!(whole.status.code(), Some(0));
    assert_eq!(image::open(folder.path("p.png")).unwrap().color(), image::ColorType::Rgb8);
    let stored = |name: &str| image::open(folder.path(name)).unwrap().into_luma16().get_pixel(30, 12).0[0];
    assert_eq!(stored("f.png"), 256 * SHIFT as u16);
    assert!(stored("b.png").abs_diff(256 * SHIFT as u16) < 10, "fractions: {}", stored("b.png"));
}

#[test]
fn text_output_tells_size_labels_stages_memory_energy_and_errors() {
    let folder = Folder::new();
    let output = folder.run(&format!("{MATCH} a.png --ground-truth truth.png --scale 2 --messages-hash"));
    let text = text(&output.stdout);
    let words = ["40x24", "12 labels", "match_cost", "update_messages", "MiB", "smoothness", "sha256", "RMSE", "a.png"];
    assert!(words.iter().all(|word| text.contains(word)), "{text}");
}

#[test]
fn settings_change_what_they_say() {
    let folder = Folder::new();
    let run = |options: &str| folder.json(&format!("{MATCH} a.pfm --json --messages-hash {options}"));
    let steps = |options: &str| {
        let report = run(options);
        (report["settings"]["grids"].as_u64().unwrap(), report["settings"]["steps_per_grid"].as_u64().unwrap())
    };
    assert_eq!(steps("--algorithm bp"), (1, 12));
    assert_eq!(steps("--algorithm bp --loops 7 --schedule checkerboard"), (1, 14));
    assert_eq!(steps("--algorithm cfbp --loops 30"), (5, 5));
    assert_eq!(steps("--algorithm cfcsbp --loops 30 --z 5"), (5, 1));
    assert_eq!(steps("--algorithm ctcsbp --loops 30 --z 4"), (1, 7));
    assert_eq!(steps("--algorithm cfbp --grids 3 --loops 4"), (3, 4));
    assert_eq!(steps("--algorithm cfcsbp --grids 3 --half-steps 5"), (3, 5));
    assert_eq!(steps("--algorithm cfbp --loops 30 --schedule sweep"), (5, 5));
    assert_eq!(steps("--algorithm sweep"), (5, 1));
    assert_eq!(steps("--algorithm sweep --grids 3 --schedule sweep"), (3, 1));
    assert_eq!(steps("--algorithm sweep --loops 4"), (5, 4));
    assert_eq!(steps("--grids 2 --loops 3"), (2, 3));
    assert_eq!(run("--algorithm cfbp --half-steps 5")["settings"]["schedule"], "checkerboard");
    let swept = &run("--loops 2")["settings"];
    assert_eq!(*swept, run("--algorithm sweep --loops 2")["settings"]);
    assert_eq!((&swept["schedule"], &swept["coarse_clip"], &swept["k"]), (&"sweep".into(), &true.into(), &Value::Null));
    assert_eq!(run("--algorithm cfbp")["settings"]["coarse_clip"], false);
    let hash = |options: &str| run(options)["messages_sha256"].as_str().unwrap().to_owned();
    assert_eq!(hash(""), hash(""));
    let default = hash("--algorithm cfbp --grids 3 --loops 1");
    for other in [
        "--message-start sender",
        "--slope 1",
        "--truncation 5",
        "--edge-threshold 9",
        "--profile mrf",
        "--min-disparity -2",
    ] {
        assert_ne!(hash(&format!("--algorithm cfbp --grids 3 --loops 1 {other}")), default, "{other}");
    }
    assert_ne!(hash("--algorithm sweep --profile mrf --coarse-clip off"), hash("--algorithm sweep --profile mrf"));
    let sets = |options: &str| run(options)["settings"]["label_sets"].as_bool().unwrap();
    assert!(!sets("") && sets("--label-sets on") && sets("--algorithm cfbp --schedule sweep --label-sets on"));
    let updates = |options: &str| run(options)["message_updates"].as_u64().unwrap();
    assert!(updates("--label-sets on") < updates("--label-sets off"));
    let seeded = "--algorithm ctbp --loops 1 --profile mrf --seed-start";
    assert_ne!(hash(&format!("{seeded} on")), hash(&format!("{seeded} off")));
}

#[test]
fn a_negative_least_disparity_swaps_the_views() {
    let folder = Folder::new();
    let swapped = "match right.png left.png --labels 12 --min-disparity -8 --output a.pfm --whole-pixels";
    assert_eq!(folder.run(swapped).status.code(), Some(0));
    let report = folder.json("evaluate a.pfm a.pfm --json");
    assert_eq!(report["all"]["rmse"], 0.0);
    let bytes = fs::read(folder.path("a.pfm")).unwrap();
    let values = bytes[bytes.len() - 4 * (WIDTH * HEIGHT) as usize..].chunks_exact(4);
    let right = values.filter(|value| f32::from_le_bytes([value[0], value[1], value[2], value[3]]) == -5.0).count();
    assert!(right as u32 > WIDTH * HEIGHT * 3 / 4, "{right}");
    folder.fails("match right.png left.png --labels 12 --min-disparity -8 --output b.png", 2, &["b.png", ".pfm"]);
}

#[test]
fn contradictory_options_are_usage_errors_that_name_them() {
    let folder = Folder::new();
    for (options, words) in [
        ("--algorithm cfbp --grids 3", ["--grids", "--loops"]),
        ("--algorithm bp --grids 3 --loops 2", ["--grids", "cfbp"]),
        ("--algorithm bp --z 3", ["--z", "cfcsbp"]),
        ("--algorithm cfcsbp --z 3 --half-steps 5", ["--z", "--half-steps"]),
        ("--algorithm cfbp --seed-start off", ["--seed-start", "ctbp"]),
        ("--algorithm bp --message-start sender", ["--message-start", "cfbp"]),
        ("--algorithm bp --half-steps 3 --schedule sync", ["--half-steps", "checkerboard"]),
        ("--algorithm bp --half-steps 3 --schedule sweep", ["--half-steps", "checkerboard"]),
        ("--half-steps 3", ["--half-steps", "cfbp"]),
        ("--algorithm sweep --half-steps 3", ["--half-steps", "sweep"]),
        ("--algorithm sweep --schedule sync", ["--schedule", "sweep"]),
        ("--algorithm sweep --z 2", ["--z", "sweep"]),
        ("--algorithm sweep --message-start receiver", ["--message-start", "sweep"]),
        ("--algorithm cfbp --schedule sweep --message-start sender", ["message start", "sweep"]),
        ("--algorithm bp --coarse-clip on", ["--coarse-clip", "cfbp"]),
        ("--algorithm bp --label-sets off", ["--label-sets", "cfbp"]),
        ("--algorithm cfbp --label-sets on", ["--label-sets", "--schedule sweep"]),
        ("--half-steps 3 --loops 2", ["--half-steps", "--loops"]),
        ("--truncation 64", ["--truncation", "63"]),
        ("--labels 0", ["--labels", "1024"]),
        ("--labels 100000", ["--labels", "1024"]),
        ("--loops 0", ["--loops", "0"]),
        ("--min-disparity 99999999", ["--min-disparity", "99999999"]),
        ("--mask truth.png", ["--mask", "--ground-truth"]),
        ("--algorithm magic", ["--algorithm", "magic"]),
        ("--threads 0", ["--threads", "1024"]),
        ("--repeat 0", ["--repeat", "10000"]),
        ("--max-memory much", ["--max-memory", "much"]),
        ("--scale 0 --ground-truth truth.png", ["--scale", "above 0"]),
    ] {
        folder.fails(&format!("match left.png right.png --output a.png {options}"), 2, &words);
    }
    folder.fails("match left.png right.png --output a.jpg", 2, &["a.jpg", ".pfm"]);
    folder.fails("match left.png right.png --output a.png --picture b.jpg", 2, &["b.jpg", ".png"]);
    folder.fails("match left.png right.png --output a.png --picture ./a.png", 2, &["a.png", "twice"]);
    folder.fails("match left.png right.png --output ./left.png", 2, &["left.png", "overwritten"]);
    folder.fails("reproduce --quick --synthetic --backend scalar,scalar:0", 2, &["--backend", "twice"]);
    folder.fails("reproduce --quick --synthetic --backend scalar --threads 2", 2, &["--threads 2", "rayon"]);
    folder.fails(
        "match left.png right.png --output a.png --backend scalar:1",
        5,
        &["scalar", "device \"1\"", "1 thread"],
    );
    folder.fails("match left.png right.png --output a.png --backend rayon:9", 5, &["rayon", "device \"9\"", "threads"]);
    folder.fails("match left.png right.png --output a.png --backend magic", 5, &["--backend", "magic", "scalar"]);
}

#[test]
fn bad_input_names_the_file() {
    let folder = Folder::new();
    let whole = fs::read(folder.path("left.png")).unwrap();
    fs::write(folder.path("cut.png"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.path("text.png"), "not an image").unwrap();
    fs::write(folder.path("empty.png"), "").unwrap();
    fs::write(folder.path("huge.pgm"), "P5\n60000 60000\n255\n").unwrap();
    fs::write(folder.path("none.pgm"), "P5\n0 5\n255\n").unwrap();
    fs::create_dir(folder.path("folder.png")).unwrap();
    for (file, word) in [
        ("missing.png", "No such file"),
        ("cut.png", ""),
        ("text.png", "not an image"),
        ("empty.png", "not an image"),
        ("huge.pgm", "--max-megapixels"),
        ("none.pgm", ""),
        ("folder.png", "folder"),
    ] {
        folder.fails(&format!("match left.png {file} --output a.png"), 3, &[file, word]);
        folder.fails(&format!("evaluate {file} truth.png"), 3, &[file, word]);
    }
    folder.fails("match left.png wide.png --output a.png", 3, &["left.png", "wide.png", "40x24", "41x24"]);
    folder.fails("match left.png right.png -o a.png --ground-truth wide.png", 3, &["wide.png", "41x24"]);
    folder.fails("evaluate left.png wide.png", 3, &["left.png", "wide.png", "41x24"]);
    folder.fails("match left.png right.png -o a.png --max-megapixels 0", 3, &["left.png", "--max-megapixels"]);
    folder.fails("reproduce --data nowhere", 3, &["nowhere", "middlebury2006"]);
}

#[test]
fn a_data_file_that_is_not_the_listed_one_is_named() {
    let folder = Folder::new();
    for scene in ["Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books"] {
        fs::create_dir_all(folder.path("data/middlebury2006").join(scene)).unwrap();
    }
    folder.fails("scenes --data data", 3, &["--data data", "none of the listed files"]);
    let file = folder.path("data/middlebury2006/Baby1/view1.png");
    for (width, height, word) in [(620, 555, "delete it"), (621, 555, "621x555 pixels instead of 620x555")] {
        image::GrayImage::new(width, height).save(&file).unwrap();
        let output = folder.run("scenes --data data");
        let text = text(&output.stdout);
        assert!(text.contains("Baby1/view1.png") && text.contains(word), "{text}");
        assert_eq!(output.status.code(), Some(3));
        folder.fails("reproduce --data data --results r", 3, &["Baby1/view1.png", word]);
    }
}

#[test]
fn what_cannot_be_written_is_told_before_the_work_and_leaves_nothing() {
    let folder = Folder::new();
    folder.fails(&format!("{MATCH} no/such/a.png"), 3, &["no/such/a.png"]);
    fs::create_dir(folder.path("taken.png")).unwrap();
    folder.fails(&format!("{MATCH} taken.png"), 1, &["taken.png", "folder"]);
    if Path::new("/dev/full").exists() {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let status = Command::new(env!("CARGO_BIN_EXE_bp"))
            .args("evaluate truth.png truth.png".split(' '))
            .current_dir(folder.path(""))
            .stdout(full)
            .output()
            .unwrap();
        assert_eq!(status.status.code(), Some(1), "{}", text(&status.stderr));
        assert!(text(&status.stderr).contains("standard output"));
    }
}

#[test]
fn more_memory_than_is_allowed_is_refused_before_it_is_taken() {
    let folder = Folder::new();
    fs::write(folder.path("big.pgm"), [b"P5\n20000 4000\n255\n".as_slice(), &vec![0; 80_000_000]].concat()).unwrap();
    let words = ["needs at least 1.", "1.0 GiB is allowed by --max-memory", "--labels"];
    folder.fails("match big.pgm big.pgm -o a.pfm --labels 1024 --max-memory 1GiB", 6, &words);
}

#[test]
fn more_labels_than_columns_are_matched_with_a_warning() {
    let folder = Folder::new();
    let output = folder.run("match left.png right.png -o a.png --labels 60");
    assert!(output.status.success() && text(&output.stderr).contains("warning: 60 labels"));
}

#[test]
fn unanswered_pixels_are_counted_apart() {
    let folder = Folder::new();
    let half = |x: u32| image::Luma([if x < WIDTH / 2 { 0 } else { 10 }]);
    image::GrayImage::from_fn(WIDTH, HEIGHT, |x, _| half(x)).save(folder.path("half.png")).unwrap();
    let report = folder.json("evaluate half.png truth.png --scale 2 --map-scale 2 --json");
    assert_eq!((&report["all"]["known"], &report["all"]["answered"]), (&Value::from(960), &Value::from(480)));
    assert_eq!(
        (&report["all"]["bad"][1], &report["all"]["bad_or_unanswered"][1]),
        (&Value::from(0.0), &Value::from(50.0))
    );
    folder.fails("evaluate truth.png truth.png --mask half.png", 3, &["half.png", "255"]);
    image::GrayImage::new(WIDTH, HEIGHT).save(folder.path("unknown.png")).unwrap();
    let nothing = folder.json("evaluate unknown.png truth.png --json");
    assert_eq!((&nothing["all"]["answered"], &nothing["all"]["bad"][1]), (&Value::from(0), &Value::Null));
    folder.fails("evaluate truth.png unknown.png", 3, &["unknown.png", "without a known pixel"]);
    assert!(text(&folder.run("evaluate half.png truth.png").stdout).contains("unanswered wrong"));
}

/// Decoders stretch values of fewer bits, but a map must have the stored values.
#[test]
fn maps_are_read_as_stored_or_refused() {
    let folder = Folder::new();
    image::ImageBuffer::from_pixel(4, 3, image::LumaA([5 * 256 + 128_u16, 65535]))
        .save(folder.path("la16.png"))
        .unwrap();
    image::ImageBuffer::from_pixel(4, 3, image::Luma([5 * 256 + 128_u16])).save(folder.path("l16.png")).unwrap();
    assert_eq!(folder.json("evaluate la16.png l16.png --json")["all"]["rmse"], 0.0);
    let half = folder.json("evaluate l16.png l16.png --map-scale 128 --json");
    assert_eq!(half["all"]["rmse"], 5.5);
    fs::write(folder.path("stretched.pgm"), [b"P5\n4 3\n100\n".as_slice(), &[5; 12]].concat()).unwrap();
    folder.fails("evaluate stretched.pgm l16.png", 3, &["stretched.pgm", "255"]);
    image::RgbImage::from_pixel(4, 3, image::Rgb([1, 2, 3])).save(folder.path("coloured.png")).unwrap();
    folder.fails("evaluate coloured.png l16.png", 3, &["coloured.png", "colours"]);
}

#[test]
fn sixteen_bits_and_colours_are_read() {
    let folder = Folder::new();
    let grey = image::open(folder.path("left.png")).unwrap();
    let wide = image::ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| {
        image::Luma([u16::from(grey.as_luma8().unwrap().get_pixel(x, y).0[0]) * 257])
    });
    wide.save(folder.path("left16.png")).unwrap();
    grey.to_rgba8().save(folder.path("left_rgba.png")).unwrap();
    grey.to_rgb8().save(folder.path("left.ppm")).unwrap();
    let hash = |left: &str| {
        folder.json(&format!("match {left} right.png -o a.png --labels 12 --json --messages-hash"))["messages_sha256"]
            .clone()
    };
    for other in ["left16.png", "left_rgba.png", "left.ppm"] {
        assert_eq!(hash(other), hash("left.png"), "{other}");
    }
}
