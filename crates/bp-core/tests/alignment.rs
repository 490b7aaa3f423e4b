//! Row alignment of scenes whose rows were displaced by a known amount.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::sync::LazyLock;

use bp_core::{Alignment, Error, Image, MAX_SIDE, Size, StereoPair, survey::Survey};
use bp_testkit::synthetic;

/// A rectified pair.
static PAIR: LazyLock<StereoPair> = LazyLock::new(|| synthetic::scene(0, 2).pair);

/// Constant, rotated, sheared and bent displacements of up to a pixel and a half.
const DISPLACEMENTS: [[f64; 6]; 4] = [
    [0.4, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-0.2, 0.5, 0.0, 0.0, 0.0, 0.0],
    [0.1, -0.3, 0.6, 0.0, 0.2, 0.0],
    [-1.0, 0.2, -0.2, 0.3, -0.1, -0.25],
];

fn find(pair: &StereoPair) -> Option<Alignment> {
    Alignment::find(pair, &Survey::of(pair).unwrap())
}

/// The pair with rows of its right image displaced.
fn displaced(pair: &StereoPair, displacement: [f64; 6]) -> StereoPair {
    Alignment::new(pair.size(), displacement.map(|coefficient| -coefficient)).unwrap().aligned(pair).unwrap()
}

/// The mean difference of grey values, without the rows at the borders, where displaced rows are lost.
fn difference(a: &Image, b: &Image) -> f64 {
    let Size { width, height } = a.size();
    let inside = 3 * width..(height - 3) * width;
    let greys = |image: &Image| -> Vec<u8> { image.pixels()[inside.clone()].iter().map(|pixel| pixel[1]).collect() };
    let differences = greys(a).into_iter().zip(greys(b)).map(|(a, b)| f64::from(a.abs_diff(b)));
    differences.sum::<f64>() / inside.len() as f64
}

#[test]
fn displacements_are_found_to_a_twentieth_of_a_pixel() {
    for displacement in DISPLACEMENTS {
        let found = find(&displaced(&PAIR, displacement)).unwrap();
        let truth = Alignment::new(PAIR.size(), displacement).unwrap();
        let Size { width, height } = PAIR.size();
        for (x, y) in [(0, 0), (width, 0), (0, height), (width, height), (width / 2, height / 2)] {
            let [found, truth] = [found, truth].map(|alignment| alignment.rows_at(x as f64, y as f64));
            assert!((found - truth).abs() < 0.05, "{displacement:?} at {x}, {y}: {found}, not {truth}");
        }
    }
}

#[test]
fn alignment_undoes_a_displacement() {
    for displacement in DISPLACEMENTS {
        let displaced = displaced(&PAIR, displacement);
        let aligned = find(&displaced).unwrap().aligned(&displaced).unwrap();
        assert_eq!(aligned.left(), PAIR.left());
        let [before, after] = [&displaced, &aligned].map(|pair| difference(pair.right(), PAIR.right()));
        assert!(after < 0.5 * before, "{displacement:?}: from {before} to {after}");
    }
}

/// Windows that cross the border of a surface give small errors, so this is not 0.
#[test]
fn equal_rows_stay_within_a_tenth_of_a_pixel() {
    for index in 0..synthetic::NAMES.len() {
        let found = find(&synthetic::scene(index, 2).pair);
        let most = found.map_or(0.0, |found| found.range().map(f64::abs).into_iter().fold(0.0, f64::max));
        assert!(most < 0.1, "{}: {found:?}", synthetic::NAMES[index]);
    }
    let same = StereoPair::new(PAIR.left().clone(), PAIR.left().clone()).unwrap();
    assert!(find(&same).unwrap().is_negligible());
}

#[test]
fn whole_rows_are_copied() {
    let (width, height) = (40, 9);
    let pixels: Vec<u8> = (0..width * height).map(|i| (i * i * 37 % 251) as u8).collect();
    let image = || Image::from_grey(width, height, pixels.as_slice()).unwrap();
    let pair = StereoPair::new(image(), image()).unwrap();
    let down = |rows: f64| Alignment::new(pair.size(), [rows, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let moved = |rows: f64| down(rows).aligned(&pair).unwrap().right().clone();
    assert_eq!(moved(0.0), image());
    for (rows, from) in [(2.0, [2, 3, 4, 5, 6, 7, 8, 8, 8]), (-1.0, [0, 0, 1, 2, 3, 4, 5, 6, 7]), (1e4, [8; 9])] {
        let expected: Vec<_> = from.iter().flat_map(|&y| image().greys_near(y).to_vec()).collect();
        assert_eq!(moved(rows).greys(), expected, "{rows} rows");
    }
}

#[test]
fn too_few_points_give_nothing() {
    let noise = |seed: u32, i: u32| ((i ^ seed).wrapping_mul(0x9e37_79b1) >> 15 ^ i.wrapping_mul(seed)) as u8;
    for (width, height) in [(1, 1), (7, 300), (300, 7), (200, 150)] {
        let image = |seed| {
            let pixels: Vec<u8> = (0..(width * height) as u32).map(|i| noise(seed, i)).collect();
            Image::from_grey(width, height, pixels).unwrap()
        };
        assert_eq!(find(&StereoPair::new(image(0x1234_5677), image(0x7654_321f)).unwrap()), None);
        let blank = Image::from_grey(width, height, vec![7; width * height]).unwrap();
        assert_eq!(find(&StereoPair::new(blank.clone(), blank).unwrap()), None);
    }
}

#[test]
fn a_brighter_image_is_aligned_all_the_same() {
    let displaced = displaced(&PAIR, DISPLACEMENTS[1]);
    let brighter = displaced.right().pixels().iter().map(|pixel| pixel.map(|value| 40 + value / 2)).collect();
    let Size { width, height } = PAIR.size();
    let right = Image::from_rgb(width, height, brighter).unwrap();
    let found = find(&StereoPair::new(displaced.left().clone(), right).unwrap()).unwrap();
    let [least, largest] = found.range();
    assert!((least + 0.7).abs() < 0.06 && (largest - 0.3).abs() < 0.06, "{least} to {largest}");
}

#[test]
fn impossible_alignments_are_refused() {
    let size = Size { width: 3, height: 2 };
    for wrong in [f64::NAN, f64::INFINITY, -1.0 - MAX_SIDE as f64] {
        assert!(matches!(Alignment::new(size, [0.0, 0.0, wrong, 0.0, 0.0, 0.0]), Err(Error::Plan(_))), "{wrong}");
    }
    let other = Alignment::new(size, [0.0; 6]).unwrap();
    assert!(matches!(other.aligned(&PAIR), Err(Error::WrongSize { .. })));
}
