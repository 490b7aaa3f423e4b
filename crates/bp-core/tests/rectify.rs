//! Rectification against its definition: what a point in space shows in raw and in rectified images.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use bp_core::{Camera, Error, Image, Lens, Rectification, Rectifier, Rig, Size};

const SIZE: Size = Size { width: 97, height: 61 };
const STRAIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A turn about the axes by small angles.
fn turn([x, y, z]: [f64; 3]) -> [[f64; 3]; 3] {
    let [a, b, c] = [x, y, z].map(f64::sin);
    let [d, e, f] = [x, y, z].map(f64::cos);
    [[e * f, a * b * f - d * c, d * b * f + a * c], [e * c, a * b * c + d * f, d * b * c - a * f], [-b, a * e, d * e]]
}

fn camera(focal: [f64; 2], principal_point: [f64; 2], lens: Lens) -> Camera {
    Camera { size: SIZE, focal, principal_point, lens }
}

/// A rig whose cameras differ in everything.
fn rig(lenses: [Lens; 2]) -> Rig {
    let [left, right] = lenses;
    let cameras = [camera([90.0, 91.0], [50.0, 28.0], left), camera([88.0, 87.0], [46.5, 31.0], right)];
    Rig { cameras, rotation: turn([0.02, -0.05, 0.03]), translation: [-120.0, 4.0, -7.0] }
}

fn brown(k1: f64, k2: f64, k4: f64) -> Lens {
    Lens::Brown { radial: [k1, k2, 0.01, k4, 0.0, 0.0], tangential: [0.001, -0.002] }
}

fn rigs() -> [Rig; 3] {
    [
        rig([brown(-0.3, 0.08, 0.0), brown(-0.28, 0.1, 0.0)]),
        rig([brown(0.1, 0.02, 0.35), brown(0.12, 0.01, 0.4)]),
        rig([Lens::Fisheye([0.02, -0.01, 0.004, -0.001]), Lens::Fisheye([0.01, 0.003, -0.002, 0.0])]),
    ]
}

fn product(matrix: [[f64; 3]; 3], point: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(point).map(|(factor, value)| factor * value).sum())
}

#[test]
fn a_point_lies_in_one_row_and_where_the_cameras_show_it() {
    for rig in rigs() {
        let rectification = Rectification::of(&rig, 0.0).unwrap();
        let rectifier = Rectifier::new(&rig, rectification).unwrap();
        let mut compared = 0;
        for [x, y, z] in [[-300.0, 100.0, 900.0], [20.0, -150.0, 700.0], [400.0, 200.0, 2000.0], [0.0, 0.0, 500.0]] {
            let left = [x, y, z];
            let turned = product(rig.rotation, left);
            let right = [0, 1, 2].map(|i| turned[i] + rig.translation[i]);
            let pixels = [left, right].into_iter().enumerate().map(|(index, point)| {
                let [x, y, z] = product(rectification.rotations[index], point);
                let [column, row] = rectification.principal_points[index];
                compared += usize::from(shows(&rectifier, &rig, index, [x, y, z]));
                [column + rectification.focal * x / z, row + rectification.focal * y / z, z]
            });
            let [one, other]: [[f64; 3]; 2] = pixels.collect::<Vec<_>>().try_into().unwrap();
            let depth = rectifier.calibration().depth((one[0] - other[0]) as f32).unwrap();
            assert!((one[1] - other[1]).abs() < 1e-9 && (one[2] - other[2]).abs() < 1e-9, "{one:?} {other:?}");
            assert!((f64::from(depth) / one[2] - 1.0).abs() < 1e-5, "{depth} {one:?}");
        }
        assert!(compared > 4, "{compared} points are in view");
    }
}

/// Whether the rectified pixel nearest to a point is in view. It must then come from where the camera shows that pixel's ray.
fn shows(rectifier: &Rectifier, rig: &Rig, index: usize, [x, y, z]: [f64; 3]) -> bool {
    let Rectification { rotations, focal, principal_points, .. } = *rectifier.rectification();
    let [centre_x, centre_y] = principal_points[index];
    let [column, row] = [(centre_x + focal * x / z).round(), (centre_y + focal * y / z).round()];
    if !(0.0..SIZE.width as f64).contains(&column) || !(0.0..SIZE.height as f64).contains(&row) {
        return false;
    }
    let ray = [(column - centre_x) / focal, (row - centre_y) / focal, 1.0];
    let back = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotations[index][j][i]));
    let expected = rig.cameras[index].pixel(product(back, ray)).unwrap();
    let found = rectifier.source(index, column as usize, row as usize).unwrap();
    assert!((0..2).all(|i| (found[i] - expected[i]).abs() <= 0.51 / 256.0), "{found:?} {expected:?}");
    true
}

#[test]
fn a_rectified_pair_stays_as_it_is() {
    let cameras = [camera([90.0; 2], [48.0, 30.0], Lens::NONE); 2];
    let rig = Rig { cameras, rotation: STRAIGHT, translation: [-100.0, 0.0, 0.0] };
    let rectifier = Rectifier::new(&rig, Rectification::of(&rig, 0.0).unwrap()).unwrap();
    let image = |seed: usize| {
        let pixels = (0..SIZE.width * SIZE.height).map(|i| [i * 7 + seed, i / 5, i * i].map(|v| (v % 251) as u8));
        Image::from_rgb(SIZE.width, SIZE.height, pixels.collect()).unwrap()
    };
    let (left, right) = (image(0), image(100));
    let pair = rectifier.rectified(&left, &right).unwrap();
    assert!(*pair.left() == left && *pair.right() == right);
    assert_eq!(rectifier.rectification().principal_points, [[48.0, 30.0]; 2]);
    let small = Image::from_grey(5, 5, [0; 25]).unwrap();
    assert!(matches!(rectifier.rectified(&left, &small), Err(Error::WrongSize { what: "the right image", .. })));
}

#[test]
fn colours_lie_between_those_of_four_pixels() {
    let colour = |i: usize| [i * 7, i * i, i / 5].map(|v| (v % 251) as u8);
    let image = Image::from_rgb(SIZE.width, SIZE.height, (0..SIZE.pixels()).map(colour).collect()).unwrap();
    for rig in rigs() {
        let rectifier = Rectifier::new(&rig, Rectification::of(&rig, 1.0).unwrap()).unwrap();
        let pair = rectifier.rectified(&image, &image).unwrap();
        let mut black = 0;
        for (index, rectified) in [pair.left(), pair.right()].into_iter().enumerate() {
            let width = rectified.size().width;
            for (i, &found) in rectified.pixels().iter().enumerate() {
                let source = rectifier.source(index, i % width, i / width);
                black += usize::from(source.is_none());
                assert_eq!(found, source.map_or([0; 3], |at| between(&image, at)), "pixel {i} of image {index}");
            }
        }
        assert!(black > 100, "{black}");
    }
}

/// The nearest whole number to a colour between pixels.
fn between(image: &Image, at: [f64; 2]) -> [u8; 3] {
    let [column, row] = at.map(|side| (side.floor() as usize, side.fract()));
    let mut sums = [0.5; 3];
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = [(dx, column.1), (dy, row.1)].map(|(d, part)| if d == 1 { part } else { 1.0 - part });
        let [x, y] = [(column.0 + dx).min(SIZE.width - 1), (row.0 + dy).min(SIZE.height - 1)];
        let colour = image.pixels()[y * SIZE.width + x];
        sums.iter_mut().zip(colour).for_each(|(sum, value)| *sum += weight[0] * weight[1] * f64::from(value));
    }
    sums.map(|sum| sum as u8)
}

#[test]
fn a_view_shows_nothing_black_or_everything() {
    let white = Image::from_grey(SIZE.width, SIZE.height, vec![255; SIZE.pixels()]).unwrap();
    let black = |rig: &Rig, kept| {
        let rectifier = Rectifier::new(rig, Rectification::of(rig, kept).unwrap()).unwrap();
        let pair = rectifier.rectified(&white, &white).unwrap();
        let all = pair.left().greys().iter().chain(pair.right().greys());
        all.filter(|&&grey| grey == 0).count() as f64 / (2 * SIZE.pixels()) as f64
    };
    for (rig, most) in rigs().into_iter().zip([0.01, 0.01, 0.1]) {
        // The view is chosen at some points of the border only; that of fisheyes cuts off corners.
        assert!(black(&rig, 0.0) < most, "{}", black(&rig, 0.0));
        assert!(black(&rig, 1.0) > 0.05, "{}", black(&rig, 1.0));
    }
}

#[test]
fn impossible_rigs_are_refused_with_the_reason() {
    let good = rigs()[0];
    let refused = |rig: Rig, word: &str| {
        let message = Rectification::of(&rig, 0.0).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    };
    refused(Rig { translation: [0.0; 3], ..good }, "one place");
    refused(Rig { translation: [3.0, 100.0, 0.0], ..good }, "side by side");
    refused(Rig { translation: [100.0, 0.0, 0.0], ..good }, "exchange");
    refused(Rig { translation: [f64::NAN, 0.0, 0.0], ..good }, "finite");
    refused(Rig { rotation: [[1.0; 3]; 3], ..good }, "no rotation");
    refused(Rig { rotation: turn([2.6, 0.0, 0.0]), translation: [-100.0, 0.0, 0.0], ..good }, "in common");
    let [left, right] = good.cameras;
    refused(Rig { cameras: [Camera { focal: [0.0, 1.0], ..left }, right], ..good }, "focal");
    let larger = Camera { size: Size { width: 98, ..SIZE }, ..right };
    refused(Rig { cameras: [left, larger], ..good }, "one size");
}
