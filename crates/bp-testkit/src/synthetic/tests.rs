use super::*;

/// Least and largest disparity of the real scenes that these replace, in pixels at full size.
const RANGES: [(f32, f32); 6] = [(12.5, 68.5), (21.5, 105.5), (19.5, 86.0), (1.5, 90.5), (19.5, 99.0), (4.5, 110.5)];

fn worlds() -> impl Iterator<Item = (usize, World)> {
    (0..NAMES.len()).map(|index| (index, scenes::world(index)))
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

#[test]
fn sides_are_rounded_up_and_disparities_divided() {
    let sizes = [1, 2, 3].map(|divisor| reduced(SIZES[1], divisor).to_string());
    assert_eq!(sizes, ["641x555", "321x278", "214x185"]);
    let world = scenes::world(1);
    let third = truth(&world, View::Left, reduced(SIZES[1], 3), 3);
    assert_eq!(third.at(70, 90), Some((world.look(View::Left, 211.0, 271.0).disparity / 3.0) as f32));
}

#[test]
fn disparities_span_the_ranges_of_the_real_scenes() {
    for (index, world) in worlds() {
        let (low, high) = truth(&world, View::Left, reduced(SIZES[index], 1), 1).range().unwrap();
        let (real_low, real_high) = RANGES[index];
        assert!((low - real_low).abs() < 2.0 && (high - real_high).abs() < 3.0, "{}: {low}..{high}", NAMES[index]);
        let (low, high) = truth(&world, View::Right, reduced(SIZES[index], 3), 3).range().unwrap();
        assert!(0.0 <= low && f64::from(high) * 3.0 <= MAX_DISPARITY, "{} right: {low}..{high}", NAMES[index]);
    }
}

/// Otherwise a surface would cover a right pixel twice.
#[test]
fn no_surface_gains_a_pixel_per_pixel() {
    for (index, world) in worlds() {
        let [width, height] = SIZES[index];
        for surface in world.objects.iter().chain([&world.backdrop]) {
            for i in 0..width * height / 16 {
                let (x, y) = ((4 * i % width) as f64, (4 * (4 * i / width)) as f64);
                let steep = (surface.disparity(x + 0.5, y) - surface.disparity(x - 0.5, y)).abs();
                assert!(steep < 0.85, "{} at ({x}, {y}): {steep}", NAMES[index]);
            }
        }
    }
}

#[test]
fn each_view_sees_what_the_other_sees_or_something_nearer() {
    for (index, world) in worlds() {
        for (x, y) in per_pixel(reduced(SIZES[index], 4), 4, |x, y| (x, y)) {
            let left = world.look(View::Left, x, y);
            let across = world.look(View::Right, x - left.disparity, y);
            let same = std::ptr::eq(left.surface, across.surface) && close(across.x, x, 1e-4);
            assert!(same || across.disparity > left.disparity - 1e-4, "{} left ({x}, {y})", NAMES[index]);
            let right = world.look(View::Right, x, y);
            assert!(close(right.x - right.disparity, x, 1e-4));
            let across = world.look(View::Left, right.x, y);
            assert!(across.disparity > right.disparity - 1e-4, "{} right ({x}, {y})", NAMES[index]);
        }
    }
}

#[test]
fn both_maps_agree_where_visible_and_the_right_one_is_nearer_where_hidden() {
    for (index, world) in worlds() {
        let size = reduced(SIZES[index], 3);
        let [left, right] = [View::Left, View::Right].map(|view| truth(&world, view, size, 3));
        let (mut agree, mut shown, mut nearer, mut covered) = (0, 0, 0, 0);
        for (i, &seen) in visible(&world, size, 3).iter().enumerate() {
            let d = left.values()[i];
            let place = (i % size.width) as f32 - d;
            if place < 0.0 {
                assert!(!seen);
                continue;
            }
            let at = |x: f32| right.values()[i / size.width * size.width + x as usize];
            let (a, b) = (at(place.floor()), at(place.ceil()));
            if !seen {
                (covered, nearer) = (covered + 1, nearer + u32::from(a.max(b) > d));
            } else if (a - b).abs() < 0.8 {
                (shown, agree) = (shown + 1, agree + u32::from(a.min(b) - 0.1 <= d && d <= a.max(b) + 0.1));
            }
        }
        assert!(agree * 100 > shown * 99, "{}: {agree} of {shown} visible", NAMES[index]);
        assert!(nearer * 100 > covered * 98, "{}: {nearer} of {covered} hidden", NAMES[index]);
    }
}

#[test]
fn a_fair_share_of_pixels_is_hidden_from_the_right_camera() {
    for (index, world) in worlds() {
        let visible = visible(&world, reduced(SIZES[index], 4), 4);
        let hidden = visible.iter().filter(|&&seen| !seen).count() as f64 / visible.len() as f64;
        assert!((0.05..0.3).contains(&hidden), "{}: {hidden}", NAMES[index]);
    }
}

#[test]
fn the_views_differ_by_noise_and_exposure_only() {
    let (index, size) = (2, Size { width: 300, height: 8 });
    let world = scenes::world(index);
    let [left, right] = [View::Left, View::Right].map(|view| world.photograph(view, size, 1));
    let [_, exposure] = exposures(index, 1);
    let bright = exposure.develop(&right);
    let (mut unlike, mut noise, mut count) = (0.0, 0.0, 0.0);
    for (i, colour) in left.iter().enumerate() {
        let place = (i % size.width) as f64
            - world.look(View::Left, (i % size.width) as f64, (i / size.width) as f64).disparity;
        if place < 0.0 {
            continue;
        }
        let (j, share) = (i / size.width * size.width + place as usize, place - place.floor());
        let between = right[j][1] * (1.0 - share) + right[j + 1][1] * share;
        unlike += (between - colour[1]).abs();
        noise += (f64::from(bright[j][1]) - exposure.gain * right[j][1] - exposure.offset).abs();
        count += 1.0;
    }
    assert!(count > 1000.0 && unlike / count < 2.5, "{}", unlike / count);
    assert!((1.0..1.8).contains(&(noise / count)), "{}", noise / count);
}

/// The bits must not depend on machine, compiler or optimisation, since results of different machines are compared.
#[test]
fn the_bits_stay_the_same() {
    let scene = scene(4, 3);
    let images = [scene.pair.left(), scene.pair.right()];
    let colours = images.into_iter().flat_map(|image| image.pixels().as_flattened().to_vec());
    let truths = scene.truth_left.values().iter().chain(scene.truth_right.values()).flat_map(|d| d.to_le_bytes());
    let bytes = colours.chain(truths).chain(scene.visible.iter().map(|&seen| u8::from(seen)));
    let checksum =
        bytes.fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| (sum ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
    assert_eq!(checksum, 0xc9c4_d3aa_3ac0_2999, "{checksum:#x}");
}
