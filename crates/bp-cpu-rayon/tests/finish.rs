//! Checks that the operations on maps improve them, on synthetic scenes with exact ground truth.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use bp_core::{
    Algorithm, Backend, DisparityMap, Driver, GroundTruth, MapErrors, Model, Plan, Profile, Schedule, StereoPair,
    finish::{self, Finish},
    never,
};
use bp_cpu_rayon::Rayon;
use bp_testkit::synthetic::{self, Scene};

/// The scenes at a third of the full size have disparities up to 37.
const LABELS: usize = 48;

/// Both images' maps, straight from the labels.
fn both(pair: &StereoPair) -> [DisparityMap; 2] {
    let settings = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
    let plan = Plan::new(pair.size(), Model::new(Profile::Census, LABELS).unwrap(), settings).unwrap();
    let mut driver = Driver::new(Rayon.open(0).unwrap().as_ref(), plan).unwrap();
    let mut map = |pair: &StereoPair| {
        driver.solve(pair).unwrap();
        driver.disparities().unwrap()
    };
    [map(pair), map(&pair.mirrored()).mirrored()]
}

fn errors(scene: &Scene, map: &DisparityMap) -> MapErrors {
    let truth = GroundTruth::with_mask(scene.truth_left.clone(), scene.visible.clone()).unwrap();
    truth.errors(map).unwrap().all
}

/// Sums the figures over all scenes.
fn over_scenes<const N: usize>(figures: impl Fn(&Scene) -> [f64; N]) -> [f64; N] {
    let scenes = (0..synthetic::NAMES.len()).map(|index| synthetic::scene(index, 3));
    scenes.fold([0.0; N], |sums, scene| {
        let figures = figures(&scene);
        std::array::from_fn(|i| sums[i] + figures[i])
    })
}

#[test]
fn the_mirrored_pair_gives_the_right_images_map() {
    let [raw, by_left_truth] = over_scenes(|scene| {
        let [_, right] = both(&scene.pair);
        let bad = |truth: &DisparityMap| GroundTruth::new(truth.clone()).errors(&right).unwrap().all.bad[1];
        [bad(&scene.truth_right), bad(&scene.truth_left)]
    });
    assert!(2.0 * raw < by_left_truth, "{raw} % against {by_left_truth} %");
}

#[test]
fn what_passes_the_check_is_mostly_right_and_filling_lowers_errors() {
    let [raw, checked, filled] = over_scenes(|scene| {
        let [left, right] = both(&scene.pair);
        let finished = |fill| {
            Finish { check: true, fill, ..Finish::default() }
                .apply(&scene.pair, left.clone(), Some(&right), &never)
                .unwrap()
        };
        [&left, &finished(false), &finished(true)].map(|map| errors(scene, map).bad[1])
    });
    assert!(checked < 0.6 * raw, "{checked} % of checked pixels against {raw} %");
    assert!(filled < raw, "{filled} % after filling against {raw} %");
}

#[test]
fn trusted_pixels_are_right_more_often() {
    let [trusted, all] = over_scenes(|scene| {
        let [left, right] = both(&scene.pair);
        let trust = finish::confidence(&left, &right, &never).unwrap();
        let mut sorted = trust.clone();
        sorted.sort_by(f32::total_cmp);
        let median = sorted[sorted.len() / 2];
        let kept = left.values().iter().zip(&trust).map(|(&d, &trust)| if trust < median { f32::NAN } else { d });
        let kept = DisparityMap::new(left.size(), kept.collect()).unwrap();
        [errors(scene, &kept).bad[1], errors(scene, &left).bad[1]]
    });
    assert!(4.0 * trusted < all, "{trusted} % of the more trusted half against {all} %");
}

#[test]
fn fractions_are_nearer_to_the_truth_than_labels() {
    let [fractions, labels] = over_scenes(|scene| {
        let [left, _] = both(&scene.pair);
        [&finish::subpixel(&scene.pair, left.clone(), false, &never).unwrap(), &left]
            .map(|map| errors(scene, map).bad[0])
    });
    assert!(fractions < 0.9 * labels, "{fractions} % wrong by more than half a pixel against {labels} %");
}
