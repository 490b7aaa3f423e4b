//! Images and maps as other programs have them: any range of values, pixels without a value, the other sign.

use std::fs;

use bp_core::{DisparityMap, Size};
use bp_io::{Files, Limits, Raster, read_map};
use serde_json::Value;

use super::folder::{Folder, HEIGHT, MATCH, SHIFT, WIDTH, text};

const SIZE: Size = Size { width: WIDTH as usize, height: HEIGHT as usize };

/// Writes the folder's pair with values from 300 to 362 in 16 bits, and as floats, of which the left ones lack the first four rows.
fn write_pair(folder: &Folder) {
    for side in ["left", "right"] {
        let image = image::open(folder.path(&format!("{side}.png"))).unwrap().into_luma8();
        let wide = image::ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| {
            image::Luma([300 + u16::from(image.get_pixel(x, y).0[0] / 4)])
        });
        let is_known = |index: usize| side == "right" || index >= 4 * SIZE.width;
        let values =
            wide.iter().enumerate().map(|(index, &value)| if is_known(index) { f32::from(value) } else { f32::NAN });
        let map = DisparityMap::new(SIZE, values.collect()).unwrap();
        for format in ["pfm", "tif", "npy"] {
            let path = folder.path(&format!("{side}.{format}"));
            Raster { nan: true, ..Raster::disparities(&map) }.write(&Files::default(), &path).unwrap();
        }
        wide.save(folder.path(&format!("{side}16.png"))).unwrap();
    }
}

fn map(folder: &Folder, name: &str) -> DisparityMap {
    read_map(&folder.path(name), None, Limits::megapixels(1)).unwrap()
}

fn succeeds(folder: &Folder, arguments: &str) {
    let output = folder.run(arguments);
    assert!(output.status.success(), "{arguments}: {}", text(&output.stderr));
}

#[test]
fn values_of_any_range_are_stretched() {
    let folder = Folder::new();
    write_pair(&folder);
    for format in ["pfm", "tif", "npy"] {
        let pair = format!("left.{format} right.{format}");
        folder.fails(&format!("match {pair} -o no.pfm"), 3, &[&format!("left.{format}"), "--stretch"]);
        succeeds(&folder, &format!("match {pair} -o {format}.pfm --stretch --labels 12 --no-sidecar"));
        assert_eq!(map(&folder, &format!("{format}.pfm")), map(&folder, "pfm.pfm"));
    }
    let floats = map(&folder, "pfm.pfm");
    let (missing, known) = floats.values().split_at(4 * SIZE.width);
    assert!(missing.iter().all(|value| !value.is_finite()), "where the left image has no value");
    assert!(known.iter().all(|value| value.is_finite()));
    // In 16 bits, these values are one shade of 256 unless they are stretched.
    let bad = |options: &str| {
        let truth = "--ground-truth truth.png --scale 2 --json --labels 12";
        let report = folder.json(&format!("match left16.png right16.png -o wide.pfm {options} {truth}"));
        report["errors"]["all"]["bad"][1].as_f64().unwrap()
    };
    let [plain, stretched] = [bad(""), bad("--stretch")];
    assert!(stretched < 0.5 * plain, "{stretched} % wrong, {plain} % without");
}

#[test]
fn images_that_need_to_be_stretched_are_told_so() {
    let folder = Folder::new();
    let told = |options: &str| {
        let arguments = format!("match {options} -o map.pfm --labels 12");
        text(&folder.run(&arguments).stderr).contains("of 256 shades")
    };
    for (most, is_told) in [(0_u8, true), (1, true), (60, true), (90, false)] {
        for side in ["left", "right"] {
            let mut image = image::open(folder.path(&format!("{side}.png"))).unwrap().into_luma8();
            image.iter_mut().for_each(|value| *value = (f32::from(*value) / 255.0 * f32::from(most)).round() as u8);
            image.save(folder.path(&format!("{side}.ppm"))).unwrap();
        }
        assert_eq!(told("left.ppm right.ppm"), is_told, "{most}");
        assert!(!told("left.ppm right.ppm --stretch"));
    }
    assert!(!told("left.png right.png"));
}

#[test]
fn a_list_of_pairs_is_stretched_pair_by_pair() {
    let folder = Folder::new();
    write_pair(&folder);
    fs::write(folder.path("list"), "left.tif right.tif one\nleft16.png right16.png two\n").unwrap();
    let command = "match --pairs list -o out --labels 12 --unknown nan --format npy";
    succeeds(&folder, &format!("{command} --stretch"));
    succeeds(&folder, "match left.tif right.tif -o one.npy --labels 12 --unknown nan --stretch");
    let of = |name: &str| fs::read(folder.path(name)).unwrap();
    assert_eq!(of("out/one.npy"), of("one.npy"));
    let skipped = |options: &str| folder.json(&format!("{command} {options} --json"))["skipped"].clone();
    assert_eq!(skipped("--stretch"), 2);
    // Other settings are other maps.
    folder.command_fails(&mut folder.command(command), 3, &["1 of 2 pairs failed"]);
}

#[test]
fn a_mask_says_what_the_left_image_shows() {
    let folder = Folder::new();
    let mask = image::GrayImage::from_fn(WIDTH, HEIGHT, |x, _| image::Luma([if x < 30 { 255 } else { 0 }]));
    mask.save(folder.path("mask.png")).unwrap();
    let is_valid = |(index, value): (usize, &f32)| value.is_finite() == (index % SIZE.width < 30);
    succeeds(&folder, &format!("{MATCH} map.pfm --valid mask.png --confidence trust.pfm"));
    let trust = fs::read(folder.path("trust.pfm")).unwrap();
    assert!(map(&folder, "map.pfm").values().iter().enumerate().all(is_valid));
    let trust = trust[trust.len() - 4 * SIZE.width..].as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes));
    assert!(trust.skip(30).all(|trust| trust == 0.0));
    // Both must be valid.
    write_pair(&folder);
    succeeds(&folder, "match left.tif right.tif -o both.pfm --stretch --valid mask.png --labels 12");
    let both = map(&folder, "both.pfm");
    let expected = |index: usize| index >= 4 * SIZE.width && index % SIZE.width < 30;
    assert!(both.values().iter().enumerate().all(|(index, value)| value.is_finite() == expected(index)));
    folder.fails(&format!("{MATCH} no.pfm --valid truth.png"), 3, &["truth.png: no pixel is 255"]);
    image::GrayImage::from_pixel(WIDTH + 1, HEIGHT, image::Luma([255])).save(folder.path("wide.png")).unwrap();
    folder.fails(&format!("{MATCH} no.pfm --valid wide.png"), 3, &["wide.png: 41x24", "40x24"]);
    folder.fails("match left.tif right.tif -o no.pfm --stretch --valid wide.png", 3, &["wide.png: 41x24", "40x24"]);
    folder.fails(&format!("{MATCH} no.pfm --valid none.png"), 3, &["none.png"]);
}

#[test]
fn what_is_not_valid_has_no_shade() {
    let folder = Folder::new();
    write_pair(&folder);
    let mask = image::GrayImage::from_fn(WIDTH, HEIGHT, |x, _| image::Luma([if x < 30 { 255 } else { 0 }]));
    mask.save(folder.path("mask.png")).unwrap();
    let mut left = image::open(folder.path("left16.png")).unwrap().into_luma16();
    left.enumerate_pixels_mut().filter(|(x, ..)| *x >= 30).for_each(|(_, _, pixel)| pixel.0 = [u16::MAX]);
    left.save(folder.path("filled.png")).unwrap();
    let options = "--stretch --valid mask.png --labels 12 --ground-truth truth.png --scale 2 --json";
    let report = folder.json(&format!("match filled.png right16.png -o map.pfm {options}"));
    assert!(report["errors"]["all"]["bad"][1].as_f64().unwrap() < 5.0, "{}", report["errors"]);
    assert_eq!(report["settings"]["stretched"], true);
}

#[test]
fn maps_may_have_the_other_sign() {
    let folder = Folder::new();
    succeeds(&folder, &format!("{MATCH} plain.tif --no-sidecar"));
    for (format, negated) in [("tif", "negated.tif"), ("pfm", "negated.pfm")] {
        succeeds(&folder, &format!("{MATCH} {negated} --negate --picture {format}.png"));
        let sidecar = fs::read(folder.path(&format!("{negated}.json"))).unwrap();
        let sidecar: Value = serde_json::from_slice(&sidecar).unwrap();
        // A value is what is stored times the scale.
        assert_eq!(sidecar["scale"], -1.0);
        assert!(sidecar["found"]["max"].as_f64().unwrap() > f64::from(SHIFT) - 1.0);
        // Who reads the sidecar gets our sign again, unless it is that of another map.
        assert_eq!(map(&folder, negated), map(&folder, "plain.tif"));
        let report = folder.json(&format!("evaluate {negated} truth.png --scale 2 --json"));
        assert!(report["all"]["bad"][1].as_f64().unwrap() < 20.0, "{report}");
        let stored = fs::read(folder.path(negated)).unwrap();
        let plain = Raster::disparities(&map(&folder, "plain.tif"))
            .floats(bp_io::MapFormat::of(&folder.path(negated)).unwrap());
        fs::write(folder.path(negated), plain.unwrap().unwrap()).unwrap();
        folder.fails(&format!("convert {negated} -o no.npy"), 3, &[negated, "describes another map"]);
        fs::write(folder.path(negated), stored).unwrap();
        fs::remove_file(folder.path(&format!("{negated}.json"))).unwrap();
        let negative: Vec<f32> = map(&folder, "plain.tif").values().iter().map(|value| -value).collect();
        assert_eq!(map(&folder, negated).values(), negative);
    }
    succeeds(&folder, &format!("{MATCH} plain.pfm --picture plain.png"));
    let picture = |name: &str| fs::read(folder.path(name)).unwrap();
    assert_eq!(picture("tif.png"), picture("plain.png"));
    let output = folder.run(&format!("{MATCH} - --negate"));
    assert_eq!(output.stdout, picture("negated.pfm"));
    succeeds(&folder, "convert negated.tif -o back.tif --negate");
    fs::remove_file(folder.path("back.tif.json")).unwrap();
    assert_eq!(map(&folder, "back.tif"), map(&folder, "plain.tif"));
    folder.fails(&format!("{MATCH} no.png --negate"), 2, &["no.png", "from 0 to 255.99"]);
}

#[test]
fn what_these_options_cannot_do_is_said() {
    let folder = Folder::new();
    let raw = "--rectify --calib calib.yaml";
    folder.fails(&format!("{MATCH} no.pfm --stretch {raw}"), 2, &["--stretch", "--rectify"]);
    folder.fails(&format!("{MATCH} no.pfm --valid truth.png {raw}"), 2, &["--valid", "--rectify"]);
    folder.fails("match --pairs list -o out --valid truth.png", 2, &["--valid"]);
    folder.fails("match --video - -o - --stretch", 2, &["--stretch", "frames"]);
    folder.fails("match --video - -o - --negate", 2, &["--negate", "frames"]);
}
