//! Maps of `sweep` show no borders of bands or tiles.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::path::{Path, PathBuf};

use bp_core::{
    Algorithm, Backend, HALO, Image, Model, Plan, Profile, Schedule, Settings, Size, StereoPair, Tiled, Tiling,
};
use bp_cpu_rayon::Rayon;
use bp_testkit::{jumps, synthetic};

/// Bands and the nodes of all five grids repeat after one of these numbers of rows.
const PERIODS: [usize; 4] = [16, 32, 64, 128];

/// The labels of a pair, with or without label sets, as a whole or in tiles.
fn labels(
    (pair, labels): &(StereoPair, usize),
    (profile, label_sets): (Profile, bool),
    cut: impl Fn(Plan) -> Tiling,
) -> Vec<u16> {
    let settings = Settings { label_sets, ..Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep) };
    let plan = Plan::new(pair.size(), Model::new(profile, *labels).unwrap(), settings).unwrap();
    let device = Rayon.open(0).unwrap();
    let mut tiled = Tiled::new(device.as_ref(), cut(plan)).unwrap();
    tiled.solve(device.as_ref(), pair).unwrap();
    tiled.labels().to_vec()
}

/// Profiles, with label sets or without: the last is the default.
const MATCHERS: [(Profile, bool); 3] = [(Profile::Census, false), (Profile::Census, true), (Profile::Census16, true)];

/// How many times as frequent jumps are between rows at these periods as elsewhere, means over the pairs.
fn ratios(pairs: &[(StereoPair, usize)], matcher: (Profile, bool)) -> [f64; 4] {
    let mut means = [0.0; 4];
    for pair in pairs {
        let jumps = jumps::between_rows(&labels(pair, matcher, Tiling::whole), pair.0.size());
        PERIODS.iter().zip(&mut means).for_each(|(&period, mean)| *mean += jumps::ratio(&jumps, period));
    }
    means.map(|sum| sum / pairs.len() as f64)
}

/// The same between the rows and the columns at borders of tiles.
fn ratios_of_tiles(pairs: &[(StereoPair, usize)]) -> [f64; 2] {
    let (width, height) = (128, 128);
    let mut means = [0.0; 2];
    for pair in pairs {
        let labels = labels(pair, (Profile::Census16, true), |plan| Tiling::cut(plan, Size { width, height }, HALO));
        let rows = jumps::ratio(&jumps::between_rows(&labels, pair.0.size()), height);
        let columns = jumps::ratio(&jumps::between_columns(&labels, pair.0.size()), width);
        means = [means[0] + rows, means[1] + columns];
    }
    means.map(|sum| sum / pairs.len() as f64)
}

/// Bands that exchanged nothing had ratios of 5.7, 10.0, 12.8 and 16.6. Straight borders of tiles had 2.0 between rows.
#[test]
fn synthetic_scenes_have_no_seams() {
    let pairs: Vec<_> = (0..6).map(|scene| (synthetic::scene(scene, 2).pair, 56)).collect();
    for ratios in MATCHERS.map(|matcher| ratios(&pairs, matcher)) {
        assert!(ratios.iter().all(|&ratio| ratio < 1.5), "{ratios:?}");
    }
    let tiles = ratios_of_tiles(&pairs);
    assert!(tiles.iter().all(|&ratio| ratio < 1.5), "{tiles:?}");
}

/// Bands that exchanged nothing had ratios of 5.6, 8.9, 10.8 and 14.0. A sweep over the whole image as one band has 1.2, 1.0,
/// 1.0 and 1.2. Straight borders of tiles had 2.2 between rows.
#[test]
fn real_scenes_have_no_seams() {
    let Some(data) = std::env::var_os("BP_DATA").map(PathBuf::from) else {
        return eprintln!("skipped: BP_DATA names no folder of public data");
    };
    let half = ["Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books"].map(|scene| (scene, 112));
    let half = half.map(|(scene, labels)| pair(&data.join("middlebury2006").join(scene), ["view1", "view5"], labels));
    let version_3 = [("ArtL", 64), ("Motorcycle", 72), ("MotorcycleE", 72), ("Piano", 68), ("Playroom", 84)];
    let version_3 = version_3.into_iter().chain([("Playtable", 76), ("Recycle", 68), ("Teddy", 64)]);
    let quarter = data.join("middlebury-v3-quarter");
    let version_3 = version_3.map(|(scene, labels)| pair(&quarter.join(scene), ["im0", "im1"], labels));
    let pairs: Vec<_> = half.into_iter().chain(version_3).collect();
    for ratios in MATCHERS.map(|matcher| ratios(&pairs, matcher)) {
        assert!(ratios.iter().all(|&ratio| ratio < 1.4), "{ratios:?}");
    }
    let tiles = ratios_of_tiles(&pairs);
    assert!(tiles.iter().all(|&ratio| ratio < 1.4), "{tiles:?}");
}

fn pair(folder: &Path, names: [&str; 2], labels: usize) -> (StereoPair, usize) {
    let image = |name: &str| {
        let read = image::open(folder.join(name).with_extension("png")).unwrap().to_rgb8();
        let pixels = read.pixels().map(|pixel| pixel.0).collect();
        Image::from_rgb(read.width() as usize, read.height() as usize, pixels).unwrap()
    };
    (StereoPair::new(image(names[0]), image(names[1])).unwrap(), labels)
}
