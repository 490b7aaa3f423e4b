//! The rayon backend against the reference, on every instruction set that this processor has.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use bp_core::{
    Algorithm, Backend, Cut, MAX_GRIDS, Matcher, MessageStart, Model, Plan, Profile, Schedule, Settings,
    conformance::{Answer, Case, assert_conforms, assert_same, noise_pair, solve},
};
use bp_cpu_rayon::Rayon;
use bp_cpu_scalar::Scalar;
use proptest::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::LazyLock;

const THREADS: [usize; 4] = [1, 2, 3, 8];

static POOLS: LazyLock<[ThreadPool; 4]> =
    LazyLock::new(|| THREADS.map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().unwrap()));

/// Solves a case on an instruction set, in one of the pools.
fn solve_on(device: usize, pool: usize, case: &Case) -> Answer {
    POOLS[pool].install(|| solve(Rayon.open(device).unwrap().as_ref(), case)).unwrap()
}

#[test]
fn every_instruction_set_conforms() {
    for device in 0..Rayon.devices().len() {
        POOLS[device % 4].install(|| assert_conforms(&Scalar, Rayon.open(device).unwrap().as_ref()));
    }
}

fn any_model() -> impl Strategy<Value = Model> {
    let labels = prop_oneof![1..40_usize, Just(127), Just(129), Just(300), Just(512), Just(1024)];
    let smoothness = prop::option::of((any::<u8>(), prop_oneof![0..=63_u8, Just(63)]));
    let min = prop_oneof![8 => -40..60_i32, 1 => Just(1 << 24), 1 => Just(-(1 << 24))];
    (prop::sample::select(Profile::ALL.to_vec()), labels, smoothness, min).prop_map(
        |(profile, labels, smoothness, min)| {
            let model = Model::new(profile, labels).unwrap().with_min_disparity(min).unwrap();
            smoothness.map_or(model, |(slope, truncation)| model.with_smoothness(slope, truncation).unwrap())
        },
    )
}

fn any_settings(width: usize, height: usize) -> impl Strategy<Value = Settings> {
    let schedule = prop::sample::select(Schedule::ALL.to_vec());
    let start = prop::sample::select(MessageStart::ALL.to_vec());
    let cut = prop::option::weighted(0.3, (0..width, 0..height, any::<bool>()));
    let grids = prop_oneof![8 => 1..6_usize, 1 => Just(13), 1 => Just(MAX_GRIDS)];
    (grids, 1..25_u32, schedule, start, cut, any::<bool>()).prop_map(
        |(grids, steps, schedule, start, cut, coarse_clip)| {
            let cut = cut.map(|(x, y, seed_start)| Cut { x, y, seed_start });
            let sweep = schedule == Schedule::Sweep;
            let message_start = if sweep { MessageStart::Receiver } else { start };
            let (grids, steps) = (if cut.is_some() { 1 } else { grids }, if sweep { 1 + steps % 3 } else { steps });
            Settings { grids, steps, schedule, message_start, cut, coarse_clip }
        },
    )
}

/// Sizes around one and several vectors, blocks, strips and bands; fewer nodes where there are many labels.
fn any_case() -> impl Strategy<Value = Case> {
    let width = prop_oneof![1..20_usize, 60..70_usize, 120..135_usize, 250..300_usize, Just(1100)];
    (width, 1..80_usize, any::<u32>(), any_model()).prop_flat_map(|(width, height, seed, model)| {
        let height = height.min(1 + 60_000 / (width * model.labels()));
        any_settings(width, height).prop_map(move |settings| {
            let pair = noise_pair(width, height, seed.into());
            Case { plan: Plan::new(pair.size(), model, settings).unwrap(), pair }
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rayon_equals_scalar_with_any_number_of_threads(case in any_case(), device in any::<usize>(), pool in 0..4_usize) {
        let device = device % Rayon.devices().len();
        POOLS[pool].install(|| assert_same(&Scalar, Rayon.open(device).unwrap().as_ref(), &case));
        // Threads may take turns differently the second time.
        prop_assert_eq!(solve_on(device, pool, &case), solve_on(device, pool, &case));
    }
}

/// Bands, windows and seams of images as large as real ones, with more threads than processors.
#[test]
fn a_large_image_is_the_same_on_any_number_of_threads() {
    let pair = noise_pair(333, 277, 9);
    let model = Model::new(Profile::Census, 19).unwrap();
    for (algorithm, schedule) in [
        (Algorithm::Sweep, Schedule::Sweep),
        (Algorithm::Cfbp, Schedule::Checkerboard),
        (Algorithm::Ctcsbp, Schedule::Sync),
    ] {
        let plan = Plan::new(pair.size(), model, algorithm.settings(pair.size(), 40, 2, schedule)).unwrap();
        let case = Case { pair: pair.clone(), plan };
        let expected = solve(&Scalar, &case).unwrap();
        for (device, pool) in (0..Rayon.devices().len()).flat_map(|device| (0..4).map(move |pool| (device, pool))) {
            assert!(solve_on(device, pool, &case) == expected, "{device} {pool} {:?}", case.plan.settings());
        }
    }
}

/// What was prepared for one thread is swept by eight, and the other way round.
#[test]
fn a_matcher_may_move_to_another_pool() {
    let pair = noise_pair(90, 200, 4);
    let model = Model::new(Profile::Thesis, 9).unwrap();
    let settings = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
    let case = Case { plan: Plan::new(pair.size(), model, settings).unwrap(), pair };
    let expected = solve(&Scalar, &case).unwrap().labels;
    let device = Rayon.open(0).unwrap();
    for (prepared, used) in [(0, 3), (3, 0)] {
        let mut matcher = POOLS[prepared].install(|| Matcher::new(device.as_ref(), case.plan.clone())).unwrap();
        POOLS[used].install(|| matcher.solve(&case.pair)).unwrap();
        assert_eq!(matcher.labels(), expected);
    }
}

#[test]
fn a_device_that_is_not_there_is_refused() {
    let error = Rayon.open(99).err().unwrap();
    assert!(error.to_string().contains("instruction sets"), "{error}");
}
