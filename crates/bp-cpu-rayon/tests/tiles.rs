//! Compares tiles with the whole image.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::{
    ops::ControlFlow,
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
};

use bp_core::{
    Algorithm, Backend, Cut, Device, Driver, Error, HALO, IsStopped, MessageStart, Model, Plan, Profile, Progress,
    Schedule, Settings, Side, Size, Solver, StereoPair, Tiled, Tiling,
};
use bp_cpu_rayon::Rayon;
use bp_cpu_scalar::Scalar;
use bp_testkit::{noise_pair, stepped_pair, synthetic};

fn whole(device: &dyn Device, pair: &StereoPair, plan: &Plan) -> Vec<u16> {
    let mut driver = Driver::new(device, plan.clone()).unwrap();
    driver.solve(pair).unwrap();
    driver.labels().to_vec()
}

fn tiled(device: &dyn Device, pair: &StereoPair, tiling: Tiling) -> Vec<u16> {
    let mut tiled = Tiled::new(device, tiling).unwrap();
    tiled.solve(device, pair).unwrap();
    tiled.labels().to_vec()
}

/// The percentage of pixels whose labels differ.
fn differing(a: &[u16], b: &[u16]) -> f64 {
    100.0 * a.iter().zip(b).filter(|(a, b)| a != b).count() as f64 / a.len() as f64
}

fn swept(grids: u32, steps: u32) -> Settings {
    let (schedule, message_start) = (Schedule::Sweep, MessageStart::Receiver);
    Settings { grids, steps, schedule, message_start, cut: None, coarse_clip: true, label_sets: false }
}

/// Checks the claim of docs/big-images.md about real images on a synthetic one.
#[test]
fn tiles_with_a_halo_are_nearly_the_whole_image() {
    let scene = synthetic::scene(0, 2);
    let size = scene.pair.size();
    let device = Rayon.open(0).unwrap();
    let mut coarse_to_fine = Algorithm::Cfbp.settings(size, 1, 2, Schedule::Checkerboard);
    (coarse_to_fine.grids, coarse_to_fine.steps) = (5, 10);
    let cut = Algorithm::Ctbp.settings(size, 20, 2, Schedule::Sync);
    for (settings, most) in [(swept(5, 1), 0.1), (coarse_to_fine, 0.1), (cut, 0.1)] {
        let plan = Plan::new(size, Model::new(Profile::Census, 56).unwrap(), settings).unwrap();
        let expected = whole(device.as_ref(), &scene.pair, &plan);
        let with = |halo| {
            let tiling = Tiling::cut(plan.clone(), Size { width: 64, height: 512 }, halo);
            assert!(tiling.counts().0 > 3);
            differing(&tiled(device.as_ref(), &scene.pair, tiling), &expected)
        };
        let (without, share) = (with(0), with(HALO));
        assert!(share <= most && without > share, "{settings:?}: {share} % with halo, {without} % without");
    }
}

#[test]
fn a_match_to_the_right_is_seen_by_tiles_too() {
    let scene = synthetic::scene(1, 2);
    let swapped = StereoPair::new(scene.pair.right().clone(), scene.pair.left().clone()).unwrap();
    let model = Model::new(Profile::Census, 64).unwrap().with_min_disparity(-63).unwrap();
    let plan = Plan::new(swapped.size(), model, swept(5, 1)).unwrap();
    let device = Rayon.open(0).unwrap();
    let tiling = Tiling::cut(plan.clone(), Size { width: 64, height: 512 }, HALO);
    let share = differing(&tiled(device.as_ref(), &swapped, tiling), &whole(device.as_ref(), &swapped, &plan));
    assert!(share <= 0.1, "{share} %");
}

#[test]
fn one_tile_is_the_matcher_itself() {
    let pair = noise_pair(50, 40, 3);
    let plan = Plan::new(pair.size(), Model::new(Profile::Census, 9).unwrap(), swept(3, 1)).unwrap();
    let device = Scalar.open(0).unwrap();
    let mut driver = Driver::new(device.as_ref(), plan.clone()).unwrap();
    driver.solve(&pair).unwrap();
    let mut tiled = Tiled::new(device.as_ref(), Tiling::whole(plan)).unwrap();
    tiled.solve(device.as_ref(), &pair).unwrap();
    tiled.free_tiles();
    assert_eq!(tiled.labels(), driver.labels());
    assert_eq!(tiled.allocated_bytes(), driver.allocated_bytes());
    assert!(tiled.messages(Side::Left).unwrap() == driver.messages(Side::Left).unwrap());
}

/// Wants to stop when it prepares its second tile.
struct Impatient {
    device: Box<dyn Device>,
    prepared: AtomicUsize,
    wants_to_stop: AtomicBool,
}

impl Device for Impatient {
    fn prepare(&self, plan: &Plan, is_stopped: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        let is_second = self.prepared.fetch_add(1, Ordering::Relaxed) == 1;
        self.wants_to_stop.store(is_second, Ordering::Relaxed);
        let prepared = self.device.prepare(plan, is_stopped);
        assert_eq!(prepared.as_ref().err(), is_second.then_some(&Error::Stopped));
        prepared
    }
}

/// Some systems take seconds to hand out memory.
#[test]
fn preparing_a_tile_can_be_stopped() {
    let pair = noise_pair(90, 140, 3);
    let plan = Plan::new(pair.size(), Model::new(Profile::Census, 9).unwrap(), swept(3, 1)).unwrap();
    for device in [Scalar.open(0).unwrap(), Rayon.open(0).unwrap()] {
        let device = Impatient { device, prepared: AtomicUsize::default(), wants_to_stop: AtomicBool::default() };
        let tiling = Tiling::cut(plan.clone(), Size { width: 32, height: 32 }, 32);
        let mut tiled = Tiled::new(&device, tiling).unwrap();
        let observer = &mut |_| {
            if device.wants_to_stop.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        assert_eq!(tiled.solve_observed(&device, &pair, observer).err(), Some(Error::Stopped));
        assert_eq!(device.prepared.load(Ordering::Relaxed), 2);
    }
}

#[test]
fn progress_is_of_all_tiles_and_the_answer_outlives_them() {
    let pair = noise_pair(90, 140, 3);
    let cut = Some(Cut { x: 45, y: 70, seed_start: true });
    let settings = Settings { cut, schedule: Schedule::Sync, ..swept(1, 3) };
    let plan = Plan::new(pair.size(), Model::new(Profile::Census, 9).unwrap(), settings).unwrap();
    let device = Scalar.open(0).unwrap();
    let tiling = Tiling::cut(plan, Size { width: 32, height: 32 }, 32);
    let total = tiling.message_updates();
    let mut tiled = Tiled::new(device.as_ref(), tiling).unwrap();
    let mut seen = vec![];
    let observer = &mut |progress: Progress| {
        seen.push((progress.done, progress.total));
        ControlFlow::Continue(())
    };
    let times = tiled.solve_observed(device.as_ref(), &pair, observer).unwrap();
    assert!(seen.is_sorted() && seen.last() == Some(&(total, total)));
    assert!(times.wall.iter().sum::<std::time::Duration>() <= times.total);
    tiled.free_tiles();
    assert!(tiled.labels().len() == 90 * 140 && tiled.labels().iter().any(|&label| label > 0));
    assert!(tiled.messages(Side::Left).is_err());
}

/// Label sets that need more memory than expected are matched in smaller tiles instead.
#[test]
fn tiles_stay_within_the_limit_whatever_the_label_sets() {
    let (size, labels) = (Size { width: 1000, height: 900 }, 200);
    let device = Rayon.open(0).unwrap();
    let settings = Settings { label_sets: true, ..Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep) };
    let plan = Plan::new(size, Model::new(Profile::Census, labels).unwrap(), settings).unwrap();
    let pair = stepped_pair(size.width, size.height, labels);
    let within = |percent: u64, share: u64| {
        let limit = device.planned_bytes(&plan) * percent / 100;
        let needed = |plan: &Plan| Ok(device.planned_bytes(plan));
        let likely = |plan: &Plan| Ok(device.likely_bytes(plan) / share);
        let tiling = Tiling::within(&plan, limit, &needed, &likely).unwrap();
        let mut tiled = Tiled::new(device.as_ref(), tiling.clone()).unwrap();
        tiled.solve(device.as_ref(), &pair).unwrap();
        assert!(tiled.allocated_bytes() <= limit, "{} of {limit}", tiled.allocated_bytes());
        (tiling, tiled)
    };
    let (expected, tiled) = within(50, 1);
    assert!(expected.certain().is_some() && *tiled.tiling() == expected);
    let (hoped_for, tiled) = within(42, 8);
    let certain = hoped_for.certain().unwrap();
    assert_eq!(tiled.tiling(), certain);
    let mut small = Tiled::new(device.as_ref(), certain.clone()).unwrap();
    small.solve(device.as_ref(), &pair).unwrap();
    assert_eq!(tiled.labels(), small.labels());
}
