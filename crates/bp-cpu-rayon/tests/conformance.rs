//! Compares the rayon backend with the reference, on every instruction set of this CPU.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use bp_core::{
    Algorithm, Backend, Driver, Image, Model, Node, Plan, Profile, Schedule, Settings, Side, Size, StereoPair,
};
use bp_cpu_rayon::Rayon;
use bp_cpu_scalar::Scalar;
use bp_testkit::{
    Answer, Case, Difference, compare, compare_at_random, conform, conform_outward, noise_pair, random_case, solve,
    stepped_pair,
};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{collections::BTreeSet, ops::Range, sync::LazyLock};

const THREADS: [usize; 4] = [1, 2, 3, 8];

static POOLS: LazyLock<[ThreadPool; 4]> =
    LazyLock::new(|| THREADS.map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().unwrap()));

/// Solves a case on an instruction set, in one of the pools.
fn solve_on(device: usize, pool: usize, case: &Case) -> Answer {
    POOLS[pool].install(|| solve(Rayon.open(device).unwrap().as_ref(), case)).unwrap()
}

#[test]
fn every_instruction_set_conforms() -> Result<(), Difference> {
    (0..Rayon.devices().len())
        .try_for_each(|device| POOLS[device % 4].install(|| conform(&Scalar, Rayon.open(device).unwrap().as_ref())))
}

#[test]
fn passing_outward_equals_the_reference() -> Result<(), Difference> {
    let device = Rayon.open(0).unwrap();
    POOLS.iter().try_for_each(|pool| pool.install(|| conform_outward(&Scalar, device.as_ref())))
}

#[test]
fn rayon_equals_scalar_with_any_number_of_threads() {
    let devices = Rayon.devices().len();
    for seed in 0..300 {
        let (device, pool) = (seed as usize % devices, seed as usize / devices % 4);
        let opened = Rayon.open(device).unwrap();
        let refused = POOLS[pool].install(|| compare_at_random(&Scalar, &[opened.as_ref()], [seed]));
        assert_eq!(refused, Ok(0), "{seed}");
        // The second time, threads may run in a different order.
        let case = random_case(seed);
        assert!(solve_on(device, pool, &case) == solve_on(device, pool, &case), "{seed} {:?}", case.plan);
    }
}

/// Covers bands, windows and seams of a larger image, also with more threads than CPU cores.
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

/// Bands of a high image take the memory of those above, on all grids but the coarsest. That holds for pair after pair.
#[test]
fn a_high_image_equals_the_reference() -> Result<(), Difference> {
    let (height, labels) = (1090, 40);
    let pairs = [stepped_pair(40, height, labels), noise_pair(40, height, 5)];
    let [scalar, rayon] = [Scalar.open(0).unwrap(), Rayon.open(0).unwrap()];
    for label_sets in [true, false] {
        let settings = Algorithm::Sweep.settings(pairs[0].size(), 1, 1, Schedule::Sweep);
        let settings = Settings { label_sets, ..settings };
        let case = Case::new(pairs[0].clone(), Model::new(Profile::Census, labels).unwrap(), settings).unwrap();
        let other = Case { pair: pairs[1].clone(), plan: case.plan.clone() };
        let expected = [&case, &other].map(|case| solve(scalar.as_ref(), case).unwrap().labels);
        for pool in &*POOLS {
            pool.install(|| compare(scalar.as_ref(), rayon.as_ref(), &case))?;
            let mut driver = pool.install(|| Driver::new(rayon.as_ref(), case.plan.clone())).unwrap();
            for (pair, expected) in pairs.iter().zip(&expected).cycle().take(4) {
                pool.install(|| driver.solve(pair)).unwrap();
                assert!(driver.labels() == expected, "label sets: {label_sets}");
            }
            let updates = driver.message_updates();
            pool.install(|| driver.messages(Side::Up)).unwrap();
            assert_eq!(driver.message_updates(), updates, "reading messages is no solve");
            assert!(driver.allocated_bytes() <= pool.install(|| rayon.planned_bytes(&case.plan)));
        }
    }
    Ok(())
}

/// Surfaces 31 pixels apart in blocks of 4x4, the nearer ones of which lie just after label 130: there a chunk begins, if the slope is 1
/// and the truncation 63.
fn pair_with_jumps(size: Size) -> StereoPair {
    let grey = |x: usize, y: usize| (x * x * 31 + y * y * 17 + x * y * 7) % 251;
    let view = |shift: &dyn Fn(usize, usize) -> usize| {
        let greys: Vec<u8> = size.nodes().map(|Node { x, y }| grey(x + shift(x, y), y) as u8).collect();
        Image::from_grey(size.width, size.height, greys).unwrap()
    };
    StereoPair::new(view(&|_, _| 0), view(&|x, y| 100 + 31 * ((x / 4 + y / 4) % 2))).unwrap()
}

/// Labels are decided in chunks. With small steps and large truncations, those of neighbours lie far outside a chunk and still count.
#[test]
fn labels_of_neighbours_far_from_a_chunk_equal_the_reference() -> Result<(), Difference> {
    let labels = 300;
    let [scalar, rayon] = [Scalar.open(0).unwrap(), Rayon.open(0).unwrap()];
    let jumps = pair_with_jumps(Size { width: 400, height: 20 });
    for pair in [noise_pair(130, 40, 6), stepped_pair(400, 40, labels), jumps] {
        let settings = Settings { grids: 2, ..Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep) };
        for (slope, truncation) in [(1, 63), (2, 63), (1, 40), (0, 63), (200, 5)] {
            let model = Model::new(Profile::Census, labels).unwrap().with_smoothness(slope, truncation).unwrap();
            let case = Case::new(pair.clone(), model, settings).unwrap();
            POOLS[0].install(|| compare(scalar.as_ref(), rayon.as_ref(), &case))?;
        }
    }
    Ok(())
}

/// Eight threads sweep a plan that was prepared for one thread, and vice versa.
#[test]
fn a_matcher_may_move_to_another_pool() {
    let pair = noise_pair(90, 200, 4);
    let model = Model::new(Profile::Thesis, 9).unwrap();
    let settings = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
    let case = Case { plan: Plan::new(pair.size(), model, settings).unwrap(), pair };
    let expected = solve(&Scalar, &case).unwrap().labels;
    let device = Rayon.open(0).unwrap();
    for (prepared, used) in [(0, 3), (3, 0)] {
        let mut driver = POOLS[prepared].install(|| Driver::new(device.as_ref(), case.plan.clone())).unwrap();
        POOLS[used].install(|| driver.solve(&case.pair)).unwrap();
        assert_eq!(driver.labels(), expected);
    }
}

#[test]
fn a_device_that_is_not_there_is_refused() {
    let error = Rayon.open(99).err().unwrap();
    assert!(error.to_string().contains("instruction sets"), "{error}");
}

/// On surfaces far apart, label sets leave out most labels, and with them most of the work and memory.
#[test]
fn label_sets_save_work_and_memory() {
    let pair = stepped_pair(400, 200, 100);
    let model = Model::new(Profile::Census, 100).unwrap();
    let ours = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
    let device = Rayon.open(0).unwrap();
    let solved = |label_sets| {
        let plan = Plan::new(pair.size(), model, Settings { label_sets, ..ours }).unwrap();
        POOLS[1].install(|| {
            let mut driver = Driver::new(device.as_ref(), plan.clone()).unwrap();
            driver.solve(&pair).unwrap();
            assert!(driver.allocated_bytes() <= device.planned_bytes(&plan) + 2 * plan.image_size().pixels() as u64);
            (driver.message_updates(), driver.allocated_bytes(), plan.message_updates())
        })
    };
    let ((all, bytes, planned), (left, fewer_bytes, most)) = (solved(false), solved(true));
    assert_eq!(all, planned);
    assert!(left < most / 2 && fewer_bytes < bytes * 2 / 3, "{left} of {most}, {fewer_bytes} of {bytes} bytes");
}

/// The memory held after a solve is the same whichever thread swept which rows.
#[test]
fn memory_with_label_sets_does_not_depend_on_the_order_of_threads() {
    let pair = stepped_pair(400, 500, 100);
    let settings = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
    let model = Model::new(Profile::Census, 100).unwrap();
    let plan = Plan::new(pair.size(), model, Settings { label_sets: true, ..settings }).unwrap();
    let device = Rayon.open(0).unwrap();
    let bytes = |_| {
        POOLS[2].install(|| {
            let mut driver = Driver::new(device.as_ref(), plan.clone()).unwrap();
            driver.solve(&pair).unwrap();
            driver.allocated_bytes()
        })
    };
    let all: BTreeSet<u64> = (0..20).map(bytes).collect();
    assert_eq!(all.len(), 1, "{all:?}");
}

/// With more labels than columns to the left, most nodes are matched partly outside the right image; rows end inside a vector.
#[test]
fn borders_of_the_right_image_are_exact() {
    let cases = [
        ((300, 39), 240, 0),
        ((258, 39), 200, -90),
        ((130, 38), 255, 3),
        ((641, 37), 64, -64),
        ((513, 40), 40, 200),
        ((1100, 39), 450, 0),
        ((100, 2), 450, 0),
    ];
    for ((width, height), labels, min_disparity) in cases {
        let pair = noise_pair(width, height, width as u64);
        for (device, profile) in
            [Profile::Census, Profile::Gradient, Profile::Census16, Profile::Thesis].into_iter().enumerate()
        {
            let model = Model::new(profile, labels).unwrap().with_min_disparity(min_disparity).unwrap();
            let settings = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
            let plan = Plan::new(pair.size(), model, Settings { label_sets: true, ..settings }).unwrap();
            let case = Case { plan, pair: pair.clone() };
            let device = device % Rayon.devices().len();
            assert!(solve_on(device, 1, &case) == solve(&Scalar, &case).unwrap(), "{width} {labels} {profile:?}");
        }
    }
}

/// Compares tiny pairs on all instruction sets and two threads, each with another profile and algorithm.
fn compare_tiny_pairs(indices: Range<usize>) {
    let pool = ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    for index in indices {
        let pair = noise_pair([9, 1, 17][index % 3], 3 + index % 2, index as u64);
        let algorithm = Algorithm::ALL[(index + 5) % Algorithm::ALL.len()];
        let schedule = if algorithm == Algorithm::Sweep { Schedule::Sweep } else { Schedule::ALL[index % 2] };
        let mut settings = algorithm.settings(pair.size(), 4, 2, schedule);
        settings.label_sets = algorithm == Algorithm::Sweep;
        let case = Case::new(pair, Model::new(Profile::ALL[index], 5).unwrap(), settings).unwrap();
        let expected = solve(&Scalar, &case).unwrap();
        for device in 0..Rayon.devices().len() {
            let opened = Rayon.open(device).unwrap();
            let found = pool.install(|| solve(opened.as_ref(), &case)).unwrap();
            assert!(found == expected, "{algorithm:?} {index} on {device}");
        }
    }
}

/// For Miri, which is too slow for the other tests (scripts/miri): every algorithm, every profile, label sets, odd and single columns.
#[test]
fn tiny_pairs_equal_the_reference() {
    compare_tiny_pairs(0..Profile::ALL.len());
}

/// For the minute that Miri has in continuous integration.
#[test]
fn a_tiny_pair_equals_the_reference() {
    compare_tiny_pairs(0..1);
}
