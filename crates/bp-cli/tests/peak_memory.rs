//! The peak memory of the program, measured by the system.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::{env, fs, path::Path, process::Command};

use image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage};
use nix::sys::resource::{UsageWho, getrusage};
use tempfile::TempDir;

/// A size whose buffers include both kinds: those that allocators treat as large, and those that they keep.
const SIZE: [u32; 2] = [2500, 2000];

/// The arguments for [`in_a_process_of_its_own`].
const ARGUMENTS: &str = "BP_TESTED_ARGUMENTS";

/// What the test process prints before the exit code and the peak.
const MEASURED: &str = "measured:";

/// An end of the program.
#[derive(Debug)]
struct End {
    code: i32,
    peak: u64,
    told: String,
}

/// Runs the program from a process that has no other children: the system tells the largest peak of all of them.
fn run(folder: &TempDir, arguments: &str) -> End {
    let mut command = Command::new(env::current_exe().unwrap());
    command.args(["--exact", "in_a_process_of_its_own", "--nocapture"]).current_dir(folder.path());
    let output = command.env(ARGUMENTS, arguments).output().unwrap();
    let (printed, told) = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).into();
    let measured = printed.split(MEASURED).nth(1).unwrap_or_else(|| panic!("{printed}{told}"));
    let numbers: Vec<u64> = measured.split_whitespace().take(2).map(|number| number.parse().unwrap()).collect();
    End { code: numbers[0] as i32, peak: numbers[1], told }
}

/// Not a test of its own: [`run`] calls it.
#[test]
fn in_a_process_of_its_own() {
    let Ok(arguments) = env::var(ARGUMENTS) else { return };
    let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
    let output = command.args(arguments.split_whitespace()).env("RUST_BACKTRACE", "0").output().unwrap();
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    let peak = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap().max_rss() * 1024;
    println!("{MEASURED} {} {peak}", output.status.code().unwrap());
}

/// The right one is shifted by 5 px.
fn save_pair(folder: &Path, ending: &str, convert: impl Fn(RgbImage) -> DynamicImage) {
    for (name, shift) in [("left", 0), ("right", 5)] {
        let [width, height] = SIZE;
        let pixel = |x: u32, y: u32| Rgb([(x * x * 7 + y * 31) as u8, x as u8, y as u8]);
        let image = RgbImage::from_fn(width, height, |x, y| pixel(x + shift, y));
        convert(image).save(folder.join(name).with_extension(ending)).unwrap();
    }
}

/// A limit that was too low names a larger one. Ends when the program keeps to the limit that it asked for, and returns that.
fn least_limit_kept(folder: &TempDir, arguments: &str, code: i32) -> u64 {
    let mut limit = "1".to_owned();
    // Each file is refused first for its length, then for its pixels.
    for _ in 0..9 {
        let end = run(folder, &format!("{arguments} --max-memory {limit}"));
        let allowed = limit.strip_suffix("MiB").map_or(0, |number| (number.parse::<f64>().unwrap() * 1048576.0) as u64);
        assert!(allowed == 0 || end.peak <= allowed, "{arguments}: {limit} allowed, {} bytes held", end.peak);
        let Some(words) = end.told.split("at least ").nth(1) else {
            assert_eq!(end.code, code, "{end:?}");
            return allowed;
        };
        limit = words.split(',').next().unwrap().replace(' ', "");
    }
    panic!("{arguments}: refused with {limit} too");
}

/// The refusal of a tiny limit names a larger one, first for reading, then for the rest. The program keeps to the limit that it
/// asks for, with all kinds of inputs and outputs.
#[test]
fn the_least_memory_limit_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    save_pair(folder.path(), "ppm", Into::into);
    save_pair(folder.path(), "jpg", Into::into);
    save_pair(folder.path(), "png", |image| DynamicImage::from(image).into_rgb16().into());
    save_pair(folder.path(), "tif", |image| DynamicImage::from(image).into_rgb16().into());
    for (ending, options) in [
        ("ppm", ""),
        ("ppm", "--picture p.png"),
        ("ppm", "--speckle 20"),
        ("ppm", "--check off"),
        ("ppm", "--check left-right --median 3 --confidence c.npy"),
        ("jpg", ""),
        ("png", ""),
        ("tif", ""),
    ] {
        let arguments =
            format!("match left.{ending} right.{ending} -o m.pfm --labels 16 --threads 2 --quiet {options}");
        least_limit_kept(&folder, &arguments, 0);
    }
}

/// Masks and ground truth take more while they are read than afterwards.
#[test]
fn the_least_memory_limit_is_kept_for_maps_beside_a_pair() {
    let folder = tempfile::tempdir().unwrap();
    save_pair(folder.path(), "pgm", |image| DynamicImage::from(image).into_luma8().into());
    let [width, height] = SIZE;
    let values = GrayImage::from_fn(width, height, |x, _| Luma([if x % 9 == 0 { 0 } else { 255 }]));
    values.save(folder.path().join("mask.pgm")).unwrap();
    DynamicImage::from(values.clone()).into_luma_alpha8().save(folder.path().join("mask.png")).unwrap();
    DynamicImage::from(values).into_rgb16().save(folder.path().join("truth.png")).unwrap();
    for options in [
        "--valid mask.pgm",
        "--valid mask.png",
        "--valid mask.pgm --stretch",
        "--ground-truth truth.png",
        "--ground-truth mask.pgm",
    ] {
        let arguments = "match left.pgm right.pgm -o m.pfm --labels 16 --threads 1 --whole-pixels --align off --quiet";
        least_limit_kept(&folder, &format!("{arguments} {options}"), 0);
    }
}

/// First the pairs of another shard are listed, then all of this one fail, so that their names are held as failures too.
#[test]
fn the_least_memory_limit_is_kept_for_lists_of_long_and_of_short_names() {
    let folder = tempfile::tempdir().unwrap();
    GrayImage::new(16, 16).save(folder.path().join("l.pgm")).unwrap();
    let long = ["n", "m", "o", "p", "q"].map(|letter| letter.repeat(200)).join("/");
    for (name, pairs, most) in [(long.as_str(), 10_000, 110), ("n", 40_000, 120)] {
        let list: String = (0..pairs).map(|pair| format!("l.pgm l.pgm {name}{pair}\n")).collect();
        fs::write(folder.path().join("list"), list).unwrap();
        let arguments = "match --pairs list --output o --labels 12 --threads 1 --quiet --also picture,confidence";
        let held = least_limit_kept(&folder, &format!("{arguments} --shard 1/1000000000"), 0);
        assert!(held < most << 20, "{name}: {held}");
    }
    let list: String = (0..5_000).map(|pair| format!("none{long}{pair}.pgm none{long}.pgm {long}{pair}\n")).collect();
    fs::write(folder.path().join("list"), list).unwrap();
    least_limit_kept(&folder, "match --pairs list --output o --labels 12 --threads 1 --quiet", 3);
}

/// Lists of tabs, quotes, empty lines or bytes that are no text, which are many times as long once they are split or shown.
#[test]
fn lists_that_are_larger_than_they_seem_stay_within_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let (tabs, quoted) = ("a\t".repeat(4 << 20), format!("\"a\"{}", ",".repeat(2 << 20)));
    let (lines, text) = ("\n".repeat(8 << 20), [&b"a "[..], &[0xff; 2 << 20]].concat());
    for (list, code) in [(tabs.as_bytes(), 6), (quoted.as_bytes(), 6), (lines.as_bytes(), 3), (&text, 6)] {
        fs::write(folder.path().join("list"), list).unwrap();
        let end = run(&folder, "match --pairs list --output o --labels 12 --threads 1 --max-memory 60MB");
        assert!(end.code == code && end.peak <= 60_000_000, "{end:?}");
        let end = run(&folder, "match --pairs list --output o --labels 12 --threads 1 --max-memory 10GB");
        assert!(end.code == 3 && end.peak <= 10_000_000_000, "{end:?}");
    }
}

/// All compressed data of a PNG, which inflates to the bytes of its rows.
fn compressed(png: &[u8]) -> Vec<u8> {
    let (mut data, mut rest) = (Vec::new(), &png[8..]);
    while let [a, b, c, d, kind @ ..] = rest {
        let len = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
        if kind.starts_with(b"IDAT") {
            data.extend(&kind[4..4 + len]);
        }
        rest = &rest[12 + len..];
    }
    data
}

/// Small files that stand for a lot, and images with one row or column.
#[test]
fn limits_are_kept_for_files_that_are_larger_than_they_seem_and_for_images_of_odd_shapes() {
    let folder = tempfile::tempdir().unwrap();
    let save = |name: &str, width, height| GrayImage::new(width, height).save(folder.path().join(name)).unwrap();
    save("huge.png", 9999, 9999);
    save("wide.png", 3_000_000, 1);
    save("high.png", 1, 3_000_000);
    let huge = compressed(&fs::read(folder.path().join("huge.png")).unwrap());
    let file = fs::File::create(folder.path().join("profile.png")).unwrap();
    let mut encoder = png::Encoder::new(file, 8, 8);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::iCCP, &[b"profile\0\0", &huge[..]].concat()).unwrap();
    writer.write_image_data(&[7; 64]).unwrap();
    writer.finish().unwrap();
    for (image, options, megabytes, code) in [
        ("profile.png", "", 60, 0),
        ("huge.png", "", 200, 6),
        ("wide.png", "", 200, 6),
        ("wide.png", "--whole-pixels --check off", 200, 0),
        ("high.png", "", 200, 0),
        ("high.png", "--picture p.png --median 5", 200, 0),
        ("wide.png", "--picture p.png --median 5", 300, 6),
    ] {
        let arguments = format!("match {image} {image} -o m.pfm --labels 8 --threads 2 {options}");
        let end = run(&folder, &format!("{arguments} --max-memory {megabytes}MB"));
        assert!(end.peak <= megabytes * 1_000_000, "{image} {options}: {end:?}");
        assert_eq!(end.code, code, "{image} {options}: {end:?}");
    }
}
