//! Formats of images and maps, pictures, depth and points.

use std::{fs, path::Path};

use serde_json::Value;

use super::folder::{Folder, HEIGHT, MATCH, SHIFT, WIDTH, text};

const FORMATS: [&str; 4] = ["pfm", "png", "tif", "npy"];

/// The options of a geometry.
const GEOMETRY: &str = "--focal 1870 --baseline 160 --doffs 45.5";

/// Writes a map with one disparity per column and one unknown pixel.
fn write_map(folder: &Folder, name: &str, disparity: impl Fn(u32) -> f32) {
    let value = |i: u32| if i == 3 { f32::INFINITY } else { disparity(i % WIDTH) };
    write_pfm(&folder.path(name), 'f', &(0..WIDTH * HEIGHT).map(value).collect::<Vec<_>>());
}

/// Writes values `[height][width][channel]` as a PFM with the size of the folder's images.
fn write_pfm(path: &Path, kind: char, values: &[f32]) {
    let rows = values.chunks_exact(values.len() / HEIGHT as usize).rev();
    let bytes: Vec<u8> = rows.flatten().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(path, [format!("P{kind}\n{WIDTH} {HEIGHT}\n-1.0\n").as_bytes(), &bytes].concat()).unwrap();
}

/// The floats at the end of a file, in its order.
fn floats(path: &Path) -> Vec<f32> {
    let bytes = fs::read(path).unwrap();
    let values = bytes[bytes.len() - 4 * (WIDTH * HEIGHT) as usize..].chunks_exact(4);
    values.map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect()
}

fn succeeds(folder: &Folder, arguments: &str) -> String {
    let output = folder.run(arguments);
    assert!(output.status.success(), "{arguments}: {}", text(&output.stderr));
    text(&output.stderr)
}

fn sidecar(folder: &Folder, map: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path(&format!("{map}.json"))).unwrap()).unwrap()
}

#[test]
fn the_same_map_is_read_back_from_every_format() {
    let folder = Folder::new();
    // Avoids a disparity of 0, which a PNG stores as 1/256.
    for format in FORMATS {
        succeeds(&folder, &format!("{MATCH} a.{format} --min-disparity 1 --whole-pixels"));
        let report = folder.json(&format!("evaluate a.{format} a.pfm --json"));
        assert_eq!((&report["all"]["rmse"], &report["all"]["known"]), (&0.0.into(), &960.into()), "{format}");
    }
}

#[test]
fn unknown_pixels_and_fractions_survive_every_format() {
    let folder = Folder::new();
    write_map(&folder, "map.pfm", |x| 0.25 + x as f32 / 16.0);
    for format in FORMATS {
        succeeds(&folder, &format!("convert map.pfm -o other.{format}"));
        succeeds(&folder, &format!("convert other.{format} -o back.pfm"));
        assert_eq!(fs::read(folder.path("back.pfm")).unwrap(), fs::read(folder.path("map.pfm")).unwrap(), "{format}");
    }
}

#[test]
fn floats_may_hold_nan_for_unknown_pixels() {
    let folder = Folder::new();
    write_map(&folder, "map.pfm", |x| 0.25 + x as f32 / 16.0);
    for format in ["tif", "npy"] {
        succeeds(&folder, &format!("convert map.pfm -o other.{format} --unknown nan"));
        assert_eq!(sidecar(&folder, &format!("other.{format}"))["unknown"], "nan");
        succeeds(&folder, &format!("convert other.{format} -o back.pfm"));
        assert_eq!(fs::read(folder.path("back.pfm")).unwrap(), fs::read(folder.path("map.pfm")).unwrap(), "{format}");
    }
    let stored = fs::read(folder.path("other.npy")).unwrap();
    let values = stored[stored.len() - 4 * (WIDTH * HEIGHT) as usize..].chunks_exact(4);
    let values: Vec<f32> = values.map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    let count = |is_it: fn(f32) -> bool| values.iter().filter(|&&value| is_it(value)).count();
    assert_eq!((count(f32::is_nan), count(f32::is_infinite)), (1, 0));
    succeeds(&folder, "convert map.pfm -o other.pfm --unknown nan");
    assert_eq!(fs::read(folder.path("other.pfm")).unwrap(), fs::read(folder.path("map.pfm")).unwrap(), "PFM has +inf");
}

#[test]
fn negative_disparities_survive_where_the_format_holds_them() {
    let folder = Folder::new();
    write_map(&folder, "map.pfm", |x| x as f32 - 20.0);
    for format in ["tif", "npy"] {
        succeeds(&folder, &format!("convert map.pfm -o other.{format}"));
        let report = folder.json(&format!("evaluate other.{format} map.pfm --json"));
        assert_eq!((&report["all"]["rmse"], &report["all"]["answered"]), (&0.0.into(), &959.into()), "{format}");
    }
    assert_eq!(sidecar(&folder, "other.npy")["found"], serde_json::json!({"min": -20.0, "max": 19.0}));
    folder.fails("convert map.pfm -o other.png", 2, &["other.png", ".pfm"]);
}

#[test]
fn the_sidecar_says_how_stored_numbers_become_disparities() {
    let folder = Folder::new();
    succeeds(&folder, &format!("{MATCH} a.pfm --min-disparity 1"));
    succeeds(&folder, &format!("{MATCH} a.png --min-disparity 1"));
    let told = sidecar(&folder, "a.png");
    let number = |name: &str| told[name].as_f64().unwrap();
    let stored = image::open(folder.path("a.png")).unwrap().into_luma16();
    let found: Vec<f32> =
        stored.pixels().map(|pixel| (f64::from(pixel.0[0]) * number("scale") + number("offset")) as f32).collect();
    let expected: Vec<f32> = floats(&folder.path("a.pfm")).chunks(WIDTH as usize).rev().flatten().copied().collect();
    let off = found.iter().zip(&expected).map(|(found, expected)| (found - expected).abs()).fold(0.0, f32::max);
    assert!(found.len() == expected.len() && off <= 0.5 / 256.0, "{off}");
    assert_eq!((&told["unknown"], &sidecar(&folder, "a.pfm")["unknown"]), (&0.into(), &"inf".into()));
    assert_eq!(told["labels"], serde_json::json!({"min": 1, "max": 12}));
    assert_eq!((&told["plan"]["algorithm"], &told["unit"]), (&"sweep".into(), &"px".into()));
    assert_eq!(told["inputs"], serde_json::json!(["left.png", "right.png"]));
    succeeds(&folder, &format!("{MATCH} b.png --no-sidecar"));
    assert!(!folder.path("b.png.json").exists());
    fs::create_dir(folder.path("c.png.json")).unwrap();
    folder.fails(&format!("{MATCH} c.png"), 1, &["c.png.json", "folder"]);
}

/// Middlebury 2006 at half size: f = 3740 / 2 px, B = 160 mm, doffs half of dmin.
#[test]
fn depth_is_focal_length_times_baseline_through_disparity() {
    let folder = Folder::new();
    write_map(&folder, "map.pfm", |x| x as f32 / 2.0 - 10.0);
    for format in ["pfm", "tif", "npy"] {
        succeeds(&folder, &format!("convert map.pfm --depth depth.{format} {GEOMETRY}"));
    }
    folder.fails("convert depth.tif -o no.pfm", 3, &["depth.tif", "holds depth", "depth.tif.json"]);
    succeeds(&folder, &format!("convert map.pfm --depth depth.png {GEOMETRY}"));
    let (disparities, depths) = (floats(&folder.path("map.pfm")), floats(&folder.path("depth.pfm")));
    for (disparity, depth) in disparities.into_iter().zip(depths.iter().copied()) {
        let expected = 1870.0 * 160.0 / (f64::from(disparity) + 45.5);
        let exact = if disparity.is_finite() { (f64::from(depth) / expected - 1.0).abs() < 1e-5 } else { depth > 1e30 };
        assert!(exact, "{disparity} px: {depth} mm");
    }
    for other in ["depth.tif", "depth.npy"] {
        fs::remove_file(folder.path(&format!("{other}.json"))).unwrap();
        succeeds(&folder, &format!("convert {other} -o back.pfm"));
        assert_eq!(floats(&folder.path("back.pfm")), depths, "{other}");
    }
    let stored = image::open(folder.path("depth.png")).unwrap().into_luma16();
    assert_eq!((stored.get_pixel(0, 0).0, stored.get_pixel(3, 0).0), ([8428], [0]));
    let told = sidecar(&folder, "depth.png");
    assert_eq!((&told["unit"], &told["calibration"]["doffs_px"]), (&"mm".into(), &45.5.into()));
    let warning = succeeds(&folder, "convert map.pfm --depth far.png --focal 1870 --baseline 160 --doffs 10.5");
    assert!(warning.contains("far.png") && warning.contains("65535"), "{warning}");
    let warning = succeeds(&folder, "convert map.pfm --depth none.pfm --focal 1870 --baseline 160 --doffs -999");
    assert!(warning.contains("none.pfm: no pixel is known"), "{warning}");
}

#[test]
fn a_match_gives_points_for_all_pixels_of_known_depth() {
    let folder = Folder::new();
    fs::write(
        folder.path("calib.txt"),
        format!("cam0=[99 0 20; 0 99 12; 0 0 1]\ndoffs=0\nbaseline=50\nwidth={WIDTH}\nheight={HEIGHT}\n"),
    )
    .unwrap();
    let report = folder.json(&format!("{MATCH} a.pfm --points a.ply --depth d.pfm --calib calib.txt --json"));
    let known = floats(&folder.path("a.pfm")).iter().filter(|&&disparity| disparity > 0.0).count();
    let cloud = fs::read(folder.path("a.ply")).unwrap();
    let end = b"end_header\n";
    let begin = cloud.windows(end.len()).position(|window| window == end).unwrap() + end.len();
    assert!(text(&cloud[..begin]).contains(&format!("element vertex {known}\n")));
    assert_eq!(cloud.len() - begin, 15 * known);
    assert_eq!(report["written"], serde_json::json!(["a.pfm", "d.pfm", "a.ply", "a.pfm.json", "d.pfm.json"]));
    assert_eq!(sidecar(&folder, "d.pfm")["inputs"], serde_json::json!(["left.png", "right.png", "calib.txt"]));
    succeeds(&folder, "convert a.pfm --image left.png --points b.ply --calib calib.txt");
    assert_eq!(fs::read(folder.path("b.ply")).unwrap(), cloud);
}

#[test]
fn geometry_that_cannot_be_used_is_told_before_the_work() {
    let folder = Folder::new();
    let camera = "cam0=[99 0 20; 0 99 12; 0 0 1]";
    for (calib, code, words) in [
        (format!("{camera}\nbaseline=50\n"), 3, ["doffs", "cam1"]),
        (format!("{camera}\ndoffs=nan\nbaseline=50\n"), 3, ["doffs=nan", "number"]),
        ("cam0=[0 0 20; 0 0 12; 0 0 1]\ndoffs=0\nbaseline=50\n".to_owned(), 3, ["focal length", "above 0"]),
        (format!("{camera}\ndoffs=0\nbaseline=50\nwidth=80\nheight=48\n"), 3, ["80x48", "by 2.0000"]),
        ("\u{0}\u{ffff}".to_owned(), 3, ["not a calibration", "OpenCV"]),
    ] {
        fs::write(folder.path("calib.txt"), &calib).unwrap();
        folder.fails(
            &format!("{MATCH} a.pfm --depth d.pfm --calib calib.txt"),
            code,
            &["calib.txt", words[0], words[1]],
        );
    }
    for (options, words) in [
        ("--depth d.pfm", ["depth", "--calib"]),
        ("--points p.ply --focal 9", ["--baseline", "required"]),
        ("--depth d.pfm --focal 0 --baseline 9", ["--focal", "above 0"]),
        ("--depth d.pfm --focal 9 --baseline nan", ["--baseline", "above 0"]),
        ("--depth d.pfm --focal 9 --baseline 9 --principal-point 3", ["--principal-point", "comma"]),
        ("--depth d.pfm --focal 9 --baseline 9 --calib calib.txt", ["--calib", "--focal"]),
        ("--focal 9 --baseline 9", ["--focal", "--depth or --points"]),
        ("--colours jet", ["--colours", "--picture"]),
        ("--depth d.pfm --focal -9 --baseline 9", ["--focal", "above 0"]),
        ("--depth d.jpg --focal 9 --baseline 9", ["d.jpg", ".pfm"]),
        ("--points p.pcd --focal 9 --baseline 9", ["p.pcd", ".ply"]),
        ("--depth a.pfm --focal 9 --baseline 9", ["a.pfm", "twice"]),
    ] {
        folder.fails(&format!("{MATCH} a.pfm {options}"), 2, &words);
    }
    folder.fails(&format!("{MATCH} a.pfm --depth d.pfm --calib missing.txt"), 3, &["missing.txt"]);
    folder.fails("convert truth.png", 2, &["--output"]);
    folder.fails(&format!("convert truth.png --points p.ply {GEOMETRY}"), 2, &["--image"]);
    folder.fails(&format!("convert truth.png --image wide.png --points p.ply {GEOMETRY}"), 3, &["wide.png", "41x24"]);
}

#[test]
fn a_picture_has_the_maps_pixels_and_a_bar_beside_them() {
    let folder = Folder::new();
    write_map(&folder, "map.pfm", |x| x as f32);
    let picture = |options: &str| {
        succeeds(&folder, &format!("convert map.pfm --picture p.png {options}"));
        image::open(folder.path("p.png")).unwrap().into_rgb8()
    };
    let alone = picture("--no-colour-bar");
    let told = sidecar(&folder, "p.png");
    assert_eq!((&told["format"], &told["colours"]), (&"coloured PNG".into(), &"viridis".into()));
    let [scale, offset] = ["scale", "offset"].map(|name| told[name].as_f64().unwrap());
    let ends = ["min", "max"].map(|end| told["found"][end].as_f64().unwrap());
    assert_eq!([offset, offset + scale], ends);
    assert_eq!(alone.dimensions(), (WIDTH, HEIGHT));
    assert_eq!([alone.get_pixel(3, 0).0, alone.get_pixel(0, 0).0], [[0, 0, 0], [68, 1, 84]]);
    let with_bar = picture("");
    assert!(with_bar.width() > WIDTH + 40 && with_bar.height() >= HEIGHT);
    assert!(alone.enumerate_pixels().all(|(x, y, pixel)| with_bar.get_pixel(x, y) == pixel));
    assert_eq!(picture("--no-colour-bar --colours jet").get_pixel(0, 0).0, [0, 0, 128]);
}

#[test]
fn an_image_gives_the_same_messages_from_every_format_that_holds_it() {
    let folder = Folder::new();
    let left = image::open(folder.path("left.png")).unwrap();
    let shares: Vec<f32> = left.to_luma8().pixels().map(|pixel| f32::from(pixel.0[0]) / 255.0).collect();
    write_pfm(&folder.path("share.pfm"), 'f', &shares);
    let colours: Vec<f32> = shares.iter().flat_map(|share| [255.0 * share; 3]).collect();
    write_pfm(&folder.path("colours.pfm"), 'F', &colours);
    left.save(folder.path("grey.tif")).unwrap();
    left.to_rgb8().save(folder.path("rgb.tiff")).unwrap();
    let wide = image::ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| {
        image::Luma([u16::from(left.to_luma8().get_pixel(x, y).0[0]) * 257])
    });
    wide.save(folder.path("wide.tif")).unwrap();
    let hash = |left: &str| {
        let report = folder.json(&format!("match {left} right.png -o a.png --labels 12 --json --messages-hash"));
        report["messages_sha256"].clone()
    };
    for other in ["share.pfm", "colours.pfm", "grey.tif", "rgb.tiff", "wide.tif"] {
        assert_eq!(hash(other), hash("left.png"), "{other}");
    }
}

#[test]
fn a_map_is_limited_and_filled_before_it_is_evaluated() {
    let folder = Folder::new();
    let grey = |name: &str, values: [u8; 4]| {
        image::GrayImage::from_raw(4, 1, values.to_vec()).unwrap().save(folder.path(name)).unwrap();
    };
    grey("known.png", [10, 10, 10, 10]);
    grey("holes.png", [90, 0, 12, 0]);
    let run =
        |options: &str| folder.json(&format!("evaluate holes.png known.png --thresholds 1,9,60 --json {options}"));
    let plain = run("");
    assert_eq!(plain["all"]["answered"], 2);
    assert_eq!(plain["all"]["bad_or_unanswered"], serde_json::json!([100.0, 75.0, 75.0]));
    assert_eq!(plain["all"]["mean"], 41.0);
    assert_eq!((&plain["all"]["a50"], &plain["all"]["a90"]), (&serde_json::json!(80.0), &Value::Null));
    assert_eq!(run("--limit 30")["all"]["mean"], 11.0);
    // The hole between 30 and 12 becomes 12, and so does the last pixel.
    let filled = run("--limit 30 --fill");
    assert_eq!(filled["all"]["bad_or_unanswered"], serde_json::json!([100.0, 25.0, 0.0]));
    assert_eq!((&filled["all"]["mean"], &filled["all"]["d1"]), (&serde_json::json!(6.5), &serde_json::json!(25.0)));
    folder.fails("evaluate holes.png known.png --thresholds 1,-2", 2, &["--thresholds", "above 0"]);
}

#[test]
fn jpegs_are_images_and_no_maps_and_cut_ones_neither() {
    let folder = Folder::new();
    for name in ["left", "right"] {
        let image = image::open(folder.path(&format!("{name}.png"))).unwrap();
        image.save(folder.path(&format!("{name}.jpg"))).unwrap();
    }
    let report = folder.json("match left.jpg right.jpg -o a.pfm --labels 12 --ground-truth truth.png --scale 2 --json");
    assert!(report["errors"]["all"]["bad"][1].as_f64().unwrap() < 50.0, "{}", report["errors"]);
    folder.fails("evaluate left.jpg truth.png", 3, &["left.jpg", "JPEG"]);
    let whole = fs::read(folder.path("left.jpg")).unwrap();
    fs::write(folder.path("cut.jpg"), &whole[..whole.len() / 2]).unwrap();
    folder.fails("match cut.jpg right.jpg -o b.pfm", 3, &["cut.jpg", "ends too early"]);
}

#[test]
fn floats_are_images_only_within_a_known_range() {
    let folder = Folder::new();
    write_map(&folder, "map.pfm", |_| SHIFT as f32);
    succeeds(&folder, "convert map.pfm -o map.tif");
    succeeds(&folder, "convert map.pfm -o map.npy");
    folder.fails("match map.pfm right.png -o a.pfm", 3, &["map.pfm", "0 to 1", "disparity map"]);
    folder.fails("match map.tif right.png -o a.pfm", 3, &["map.tif", "--stretch"]);
    folder.fails("match map.npy right.png -o a.pfm", 3, &["map.npy", "known format", "--stretch"]);
}

#[test]
fn only_sidecars_of_this_program_are_removed() {
    let folder = Folder::new();
    fs::write(folder.path("a.pfm.json"), "{\"mine\": 1}").unwrap();
    succeeds(&folder, &format!("{MATCH} a.pfm --no-sidecar"));
    assert_eq!(fs::read(folder.path("a.pfm.json")).unwrap(), b"{\"mine\": 1}");
    succeeds(&folder, &format!("{MATCH} b.pfm"));
    assert!(folder.path("b.pfm.json").exists());
    succeeds(&folder, &format!("{MATCH} b.pfm --no-sidecar"));
    assert!(!folder.path("b.pfm.json").exists());
}

#[test]
fn what_is_unknown_is_not_trusted_and_what_was_filled_a_little() {
    for check in ["left-right", "unique"] {
        let folder = Folder::new();
        succeeds(&folder, &format!("{MATCH} holes.pfm --check {check} --fill off --confidence c.pfm"));
        succeeds(&folder, &format!("{MATCH} filled.pfm --check {check} --median 3 --confidence filled-c.pfm"));
        let [map, trust, filled, of_filled] =
            ["holes.pfm", "c.pfm", "filled.pfm", "filled-c.pfm"].map(|name| floats(&folder.path(name)));
        assert!(map.iter().any(|value| !value.is_finite()) && trust.iter().any(|&trust| trust > 0.9));
        assert!(filled.iter().all(|value| value.is_finite()));
        for ((value, trust), of_filled) in map.iter().zip(trust).zip(of_filled) {
            let expected = if value.is_finite() { (trust, trust) } else { (0.0, bp_core::finish::FILLED) };
            assert_eq!((trust, of_filled), expected);
        }
    }
}
