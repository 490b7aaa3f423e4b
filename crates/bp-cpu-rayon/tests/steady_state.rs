//! A prepared driver matches pair after pair without allocating.

use std::alloc::System;

use bp_core::{Algorithm, Backend, Driver, Model, Plan, Profile, Schedule, Settings};
use bp_cpu_rayon::Rayon;
use bp_testkit::noise_pair;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

#[test]
fn matching_allocates_nothing() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let pairs = [1, 2, 3].map(|seed| noise_pair(150, 130, seed));
    let device = Rayon.open(0).unwrap();
    let mut matchers = Vec::new();
    for profile in Profile::ALL {
        for (algorithm, schedule) in Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|s| (a, s))) {
            let model = Model::new(profile, 17).unwrap();
            let model = if profile == Profile::Mrf { model } else { model.with_edges_halved_above(10) };
            let settings = algorithm.settings(pairs[0].size(), 6, 2, schedule);
            let plan = Plan::new(pairs[0].size(), model, settings).unwrap();
            matchers.push(pool.install(|| Driver::new(device.as_ref(), plan)).unwrap());
        }
    }
    // With label sets, a pair that needs no more than the one before allocates nothing, whichever thread sweeps a band.
    let model = Model::new(Profile::Census, 60).unwrap();
    let settings = Algorithm::Sweep.settings(pairs[0].size(), 1, 1, Schedule::Sweep);
    let plan = Plan::new(pairs[0].size(), model, Settings { label_sets: true, ..settings }).unwrap();
    let mut restricted = pool.install(|| Driver::new(device.as_ref(), plan)).unwrap();
    pool.install(|| {
        restricted.solve(&pairs[0]).unwrap();
        // Buffers share memory, so the allocator does not see all of them.
        let (region, held) = (Region::new(ALLOCATOR), restricted.allocated_bytes());
        (0..20).for_each(|_| _ = restricted.solve(&pairs[0]).unwrap());
        assert_eq!((region.change().bytes_allocated, restricted.allocated_bytes()), (0, held));
        assert!(restricted.allocated_bytes() < device.planned_bytes(restricted.plan()));
        // Solve once, so that the pool's own queues have grown.
        matchers.iter_mut().for_each(|driver| _ = driver.solve(&pairs[0]).unwrap());
        for driver in &mut matchers {
            let (region, held) = (Region::new(ALLOCATOR), driver.allocated_bytes());
            pairs.iter().for_each(|pair| _ = driver.solve(pair).unwrap());
            let change = region.change();
            let found = (change.allocations, change.reallocations, driver.allocated_bytes());
            assert_eq!(found, (0, 0, held), "{:?}", driver.plan());
        }
    });
}
