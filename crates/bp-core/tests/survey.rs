//! Surveys of synthetic scenes, and of pairs with a single fault.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::sync::LazyLock;

use bp_core::{
    Image, MAX_LABELS, Model, Profile, Size, StereoPair,
    survey::{DisparityRange, SeenDisparities, Survey},
};
use bp_testkit::synthetic::{self, Scene};

fn noise(x: usize, y: usize) -> u8 {
    let mixed = (x as u32 ^ (y as u32) << 16).wrapping_mul(0x9e37_79b1);
    (((mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca6b)) >> 24) as u8
}

fn image(size: Size, pixel: impl Fn(usize, usize) -> u8) -> Image {
    let pixels: Vec<u8> = (0..size.pixels()).map(|i| pixel(i % size.width, i / size.width)).collect();
    Image::from_grey(size.width, size.height, pixels).unwrap()
}

/// Two views of a noisy plane, `disparity` pixels and `rows` rows apart.
fn plane(width: usize, height: usize, disparity: usize, rows: usize) -> StereoPair {
    let size = Size { width, height };
    let view = |x0: usize, y0: usize| image(size, |x, y| noise(x + x0, y + y0));
    StereoPair::new(view(0, rows), view(disparity, 0)).unwrap()
}

fn exchanged(pair: &StereoPair) -> StereoPair {
    StereoPair::new(pair.right().clone(), pair.left().clone()).unwrap()
}

/// The pair with a resampled right image: `from` maps each pixel to its source position.
fn moved(pair: &StereoPair, from: impl Fn(f64, f64) -> (f64, f64)) -> StereoPair {
    let Size { width, height } = pair.size();
    let inside = |place: f64, side: usize| (place.round().max(0.0) as usize).min(side - 1);
    let pixel = |i: usize| {
        let (x, y) = from((i % width) as f64, (i / width) as f64);
        pair.right().rgb(inside(x, width), inside(y, height))
    };
    let right = Image::from_rgb(width, height, (0..width * height).map(pixel).collect()).unwrap();
    StereoPair::new(pair.left().clone(), right).unwrap()
}

/// The scenes at half size, which are large enough to be shrunk. Rendering them takes longer than all other work here.
static SCENES: LazyLock<Vec<Scene>> =
    LazyLock::new(|| (0..synthetic::NAMES.len()).map(|index| synthetic::scene(index, 2)).collect());

fn look(pair: &StereoPair) -> Survey {
    Survey::of(pair).unwrap()
}

#[test]
fn a_shifted_plane_gives_its_shift_and_nothing_else() {
    for shift in [0, 1, 7, 31] {
        let pair = plane(120, 50, shift, 0);
        let (survey, back) = (look(&pair), look(&exchanged(&pair)));
        let shift = shift as i32;
        assert_eq!(survey.seen, Some(SeenDisparities { least: shift, largest: shift, margin: 1 }));
        assert_eq!(back.seen, Some(SeenDisparities { least: -shift, largest: -shift, margin: 1 }));
        let min_disparity = (shift - 1).max(0);
        let labels = (shift + 1 - min_disparity + 1) as usize;
        assert_eq!(survey.seen.unwrap().range(), DisparityRange { min_disparity, labels });
        assert_eq!([survey.exchanged, back.exchanged], [false, shift > 0]);
        assert_eq!([survey.unlike, back.unlike], [false; 2]);
        assert_eq!([survey.rows, back.rows], [None; 2]);
    }
}

#[test]
fn tiny_and_flat_images_say_nothing_and_do_no_harm() {
    for (width, height) in [(1, 1), (3, 2), (2, 1), (40, 1), (1, 40), (5, 5), (900, 1), (1, 900)] {
        let survey = look(&plane(width, height, 0, 0));
        assert_eq!((survey.exchanged, survey.rows), (false, None), "{width}x{height}");
        let flat = image(Size { width, height }, |_, _| 9);
        let survey = look(&StereoPair::new(flat.clone(), flat).unwrap());
        assert_eq!((survey.matched, survey.seen, survey.exchanged), (0.0, None, false), "{width}x{height}");
    }
}

#[test]
fn scenes_raise_no_alarm_and_lie_within_the_range_found() {
    for scene in SCENES.iter() {
        let survey = look(&scene.pair);
        assert_eq!((survey.exchanged, survey.rows, survey.unlike), (false, None, false), "{}", scene.name);
        let range = survey.seen.unwrap().range();
        let (first, last) = (range.min_disparity as f32 - 0.5, range.max_disparity() as f32 + 0.5);
        let mut truth = scene.truth_left.values().to_vec();
        truth.sort_unstable_by(f32::total_cmp);
        let outside = truth.iter().filter(|&&disparity| disparity < first || disparity > last).count();
        assert!(outside * 200 <= truth.len(), "{}: {outside} outside {range:?}", scene.name);
        let needed = (truth[truth.len() * 399 / 400] - truth[truth.len() / 400]) as usize + 1;
        assert!(range.labels * 10 <= needed * 13, "{}: {needed} {range:?}", scene.name);
    }
}

const VGA: Size = Size { width: 640, height: 480 };

/// Whether a survey finds labels up to a disparity: a coarse one, and one that looks for the ends closely.
fn reach(pair: &StereoPair, disparity: i32) -> [bool; 2] {
    let coarse = Survey::coarse(pair).unwrap();
    [coarse, look(pair)].map(|survey| survey.seen.unwrap().range().max_disparity() >= disparity)
}

#[test]
fn leaves_before_all_else_that_coarse_matching_takes_for_specks_are_found_at_full_resolution() {
    let is_leaf = |x: usize, y: usize| (x + 40) % 100 < 16 && (y + 30) % 100 < 40;
    let seen = |x: usize, y: usize, [leaf, wall]: [usize; 2]| {
        if is_leaf(x + leaf, y) { noise(x + leaf, y + 1000) } else { noise(x + wall, y) }
    };
    let left = image(VGA, |x, y| seen(x, y, [0, 0]));
    let pair = StereoPair::new(left, image(VGA, |x, y| seen(x, y, [50, 20 + y / 24]))).unwrap();
    assert_eq!(reach(&pair, 50), [false, true]);
    // The margin, but nothing that only looks alike.
    assert!(look(&pair).seen.unwrap().range().max_disparity() <= 53);
    // Four rows are one of a shrunk image.
    assert_eq!(reach(&moved(&pair, |x, y| (x, y - 4.0)), 50), [false, true]);
}

#[test]
fn a_floor_that_rises_steeply_at_the_border_is_found_in_its_last_row() {
    let floor = |y: usize| (y + 16).saturating_sub(VGA.height);
    for row in [|y: usize| y, |y: usize| VGA.height - 1 - y] {
        let left = image(VGA, |x, y| noise(x.wrapping_sub(10 + x / 32 + floor(row(y))), y));
        let pair = StereoPair::new(left, image(VGA, noise)).unwrap();
        assert_eq!(reach(&pair, 10 + 19 + 13), [false, true]);
    }
}

#[test]
fn labels_that_leave_out_what_was_seen_are_told_at_their_end() {
    let seen = look(&SCENES[1].pair).seen.unwrap();
    let beyond = |min_disparity, labels| {
        seen.beyond(&Model::new(Profile::Census, labels).unwrap().with_min_disparity(min_disparity).unwrap())
    };
    let range = seen.range();
    assert_eq!(beyond(range.min_disparity, range.labels), [false, false]);
    let from_zero = range.starting_at(0);
    assert_eq!((from_zero.min_disparity, from_zero.max_disparity()), (0, range.max_disparity()));
    assert_eq!(range.starting_at(i32::MIN).labels, MAX_LABELS);
    assert_eq!(range.starting_at(i32::MAX).labels, 1);
    assert_eq!(beyond(0, 64), [false, false]);
    assert_eq!(beyond(0, 40), [false, true]);
    assert_eq!(beyond(20, 60), [true, false]);
    assert_eq!(beyond(20, 10), [true, true]);
}

#[test]
fn exchanged_scenes_are_told() {
    for scene in SCENES.iter() {
        let survey = look(&exchanged(&scene.pair));
        assert!(survey.exchanged && survey.rows.is_none() && !survey.unlike, "{}", scene.name);
    }
}

#[test]
fn rows_that_are_apart_are_told_by_how_many() {
    for scene in SCENES.iter() {
        for rows in [1, 2, 3, 5, -2] {
            let survey = look(&moved(&scene.pair, |x, y| (x, y - f64::from(rows))));
            assert_eq!(survey.rows.map(|found| found.whole), Some(rows), "{}", scene.name);
        }
    }
}

#[test]
fn a_turned_image_has_rows_that_fall_to_one_side() {
    for scene in SCENES.iter() {
        let (sine, cosine) = 1.0_f64.to_radians().sin_cos();
        let (centre_x, centre_y) = (scene.pair.size().width as f64 / 2.0, scene.pair.size().height as f64 / 2.0);
        let turned = |x: f64, y: f64| {
            let (x, y) = (x - centre_x, y - centre_y);
            (cosine * x - sine * y + centre_x, sine * x + cosine * y + centre_y)
        };
        let rows = look(&moved(&scene.pair, turned)).rows.unwrap();
        assert!(rows.left > 0 && rows.right <= 0 || rows.left >= 0 && rows.right < 0, "{}: {rows:?}", scene.name);
    }
}

#[test]
fn different_scenes_and_noise_are_no_pair() {
    let [first, second] = [0, 3].map(|index| &SCENES[index].pair);
    let size = Size { width: 300, height: 270 };
    let cut = |from: &Image| image(size, |x, y| from.grey(x, y));
    let grain = image(size, |x, y| noise(x, y + 7000));
    for (left, right) in [(first.left(), second.right()), (second.left(), first.right()), (first.left(), &grain)] {
        let survey = look(&StereoPair::new(cut(left), cut(right)).unwrap());
        assert!(survey.unlike && survey.seen.is_none() && !survey.exchanged, "{survey:?}");
    }
}
