//! The sample pair that comes with the project.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::path::PathBuf;

use bp_testkit::synthetic;
use image::DynamicImage;

fn open(name: &str) -> DynamicImage {
    image::open(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../bench-data/sample").join(name)).unwrap()
}

#[test]
fn the_sample_is_the_doll_at_half_size_to_the_pixel() {
    let scene = synthetic::scene(0, 2);
    let again = "run: cargo run -p bp-testkit --example sample_pair -- bench-data/sample";
    for (name, image) in [("left.png", scene.pair.left()), ("right.png", scene.pair.right())] {
        assert!(open(name).into_rgb8().into_raw() == image.pixels().as_flattened(), "{name}; {again}");
    }
    let truth: Vec<u16> =
        scene.truth_left.values().iter().map(|disparity| (disparity * 256.0).round() as u16).collect();
    assert!(open("truth.png").into_luma16().into_raw() == truth, "truth.png; {again}");
    let mask: Vec<u8> = scene.visible.iter().map(|&seen_by_both| 255 * u8::from(seen_by_both)).collect();
    assert!(open("mask.png").into_luma8().into_raw() == mask, "mask.png; {again}");
}
