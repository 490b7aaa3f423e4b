//! Fuzz targets, with the feature `fuzzing`: every file reader, and matching itself, on any bytes.
//!
//! A reader may refuse a file, but it must not panic, and its results must keep their promises. Every broken promise is
//! a panic. `fuzz/README.md` says how to run the targets.

mod tiny;

use std::{
    io::Cursor,
    path::{Component, Path},
};

use bp_core::{Size, depth_map, image::Stretch};
use bp_io::{
    Cameras, Frames, Layout, Limits, MapFormat, Mask, PairFrames, Raster, parse_image, parse_map, parse_mask,
    parse_samples,
};
use bp_stereo::pairs;

use crate::{
    compare::{Comparison, page},
    export::{Format, export},
    gate,
    record::parse,
    report,
};

/// Maximum number of pixels in a file, so that none takes long.
const LIMIT: Limits = Limits { pixels: 1 << 16, memory: None };

/// The file name of the bytes in messages.
const NAME: &str = "bytes";

/// Takes any bytes, and returns whether they were valid input.
pub type Target = fn(&[u8]) -> bool;

/// All targets, each with the name of its folder in `fuzz/corpus`.
pub const TARGETS: [(&str, Target); 9] = [
    ("image", image),
    ("frames", frames),
    ("map", map),
    ("mask", mask),
    ("calibration", calibration),
    ("pair_list", pair_list),
    ("record", record),
    ("baseline", baseline),
    ("tiny_match", tiny_match),
];

/// Reads an image: PNG, PNM, TIFF, JPEG or PFM. Reads it again with any range of values.
///
/// # Panics
/// If it is larger than allowed, or if it is an image but has no values.
pub fn image(bytes: &[u8]) -> bool {
    let samples = parse_samples(Path::new(NAME), bytes, LIMIT);
    let image = parse_image(Path::new(NAME), bytes, LIMIT);
    if let Ok(samples) = samples {
        let (size, stretch) = (samples.size(), Stretch::of(&[&samples]));
        assert!(samples.valid().is_none_or(|valid| valid.len() == size.pixels()));
        let stretched = samples.stretched(&stretch).unwrap_or_else(|error| panic!("{error}"));
        assert!(stretched.size() == size && size.pixels() as u64 <= LIMIT.pixels, "{size} pixels");
        assert!(image.as_ref().is_ok_and(|image| image.size() == size) || image.is_err());
    } else {
        assert!(image.is_err(), "an image without values");
    }
    image.is_ok()
}

/// Reads frames of a video, with both images side by side.
///
/// # Panics
/// If an image is larger than allowed.
pub fn frames(bytes: &[u8]) -> bool {
    let Ok(frames) = Frames::new(Box::new(Cursor::new(bytes.to_vec())), Path::new(NAME), LIMIT) else { return false };
    let mut pairs = PairFrames::Joined(Box::new(frames), Layout::SideBySide);
    let mut count = 0;
    while let Ok(Some(pair)) = pairs.next_pair() {
        assert!(pair.size().pixels() as u64 <= LIMIT.pixels, "{} pixels", pair.size());
        count += 1;
    }
    count > 0
}

/// Reads a map: PFM, NPY, TIFF, PNG or PNM.
///
/// # Panics
/// If a map changes when it is written and read again.
pub fn map(bytes: &[u8]) -> bool {
    let Ok(map) = parse_map(Path::new(NAME), bytes, None, LIMIT) else { return false };
    let formats = [MapFormat::Pfm, MapFormat::Npy, MapFormat::Tiff];
    for encoded in formats.into_iter().filter_map(|format| Raster::disparities(&map).floats(format)) {
        let encoded = encoded.unwrap_or_else(|error| panic!("{error}"));
        match parse_map(Path::new(NAME), &encoded, None, LIMIT) {
            Ok(again) => assert!(again == map, "{map:?} became {again:?}"),
            Err(failure) => panic!("{map:?}: {failure}"),
        }
    }
    true
}

/// Reads a mask.
///
/// # Panics
/// If the mask does not have one value per pixel.
pub fn mask(bytes: &[u8]) -> bool {
    let Ok(Mask { size, values }) = parse_mask(Path::new(NAME), bytes, LIMIT) else { return false };
    assert_eq!(values.len(), size.pixels());
    true
}

/// The size of raw images.
const RAW: Size = Size { width: 40, height: 24 };

/// Reads a calibration, and uses it to convert a map to depths, and to rectify an image.
///
/// # Panics
/// If a depth is negative or not a number, or if a position lies outside of the image.
pub fn calibration(bytes: &[u8]) -> bool {
    let Ok(cameras) = Cameras::parse(&[(NAME.into(), bytes.to_vec())]) else { return false };
    if let Ok(rectifier) = cameras.rectifier(RAW) {
        let Size { width, height } = rectifier.rectification().size;
        let sources = (0..2 * width * height).filter_map(|i| rectifier.source(i % 2, i / 2 % width, i / 2 / width));
        let sides = [RAW.width as f64, RAW.height as f64];
        sources.for_each(|source| assert!((0..2).all(|i| (0.0..sides[i]).contains(&source[i])), "{source:?}"));
    }
    let Some(geometry) = cameras.geometry() else { return true };
    let size = geometry.file.as_ref().and_then(|file| file.size);
    if let Ok(calibration) = geometry.of(size.unwrap_or(tiny::MAP)) {
        let depths = depth_map(&tiny::map(), &calibration);
        assert!(depths.iter().all(|&depth| depth >= 0.0), "{depths:?} by {calibration:?}");
    }
    true
}

/// Reads a list of pairs.
///
/// # Panics
/// If a name leads out of the output folder.
pub fn pair_list(bytes: &[u8]) -> bool {
    let Ok(found) = pairs::parse(bytes, NAME) else { return false };
    for name in found.pairs.iter().map(|pair| &pair.name) {
        let inside = name.components().all(|part| matches!(part, Component::Normal(_)));
        assert!(inside && name.file_name().is_some(), "{}", name.display());
    }
    true
}

/// Reads a record, and makes every export, report and comparison from it.
///
/// # Panics
/// If one of these panics, or if the comparison is empty.
pub fn record(bytes: &[u8]) -> bool {
    let path = Path::new(NAME);
    let Some(record) = std::str::from_utf8(bytes).ok().and_then(|text| parse(path, text).ok()) else { return false };
    Format::ALL.into_iter().for_each(|format| drop(export(&record, format)));
    // An error is allowed.
    drop(report::pages_without_maps(&record));
    let twice = [(path, record.clone()), (path, record)];
    if let Ok(comparison) = Comparison::new(&twice) {
        assert!(!page(&comparison).is_empty());
    }
    true
}

/// Reads a baseline file, of speed-ups or of instruction counts.
pub fn baseline(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|text| gate::is_baseline(Path::new(NAME), text))
}

/// Matches a tiny pair. The pair, its size, the model, the settings, the finishing steps and a memory limit are all
/// derived from the bytes.
///
/// # Panics
/// If backends differ in a label or a message, tiles differ in a label that they promise, or a map breaks a promise.
pub fn tiny_match(bytes: &[u8]) -> bool {
    tiny::run(bytes)
}
