//! A prepared `Driver` matches pair after pair without allocating on the host. Memory of the GPU driver is not counted.

use std::alloc::System;

use bp_core::{Algorithm, Backend, Driver, Error, Model, Plan, Profile, Schedule};
use bp_testkit::noise_pair;
use bp_vulkan::Vulkan;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

#[test]
fn matching_allocates_nothing() -> Result<(), Error> {
    if Vulkan.devices().is_empty() && std::env::var_os("BP_REQUIRE_GPU").is_none() {
        eprintln!("skipped: there is no device");
        return Ok(());
    }
    // One that submits once per solve, and one that submits after every step, on strips.
    let devices = [
        Vulkan.open(0)?,
        Vulkan.open_with(0, |limits| (limits.binding_bytes, limits.dispatch_entries) = (17_000, 1 << 10))?,
    ];
    let pairs = [1, 2, 3].map(|seed| noise_pair(24, 97, seed));
    for (algorithm, schedule) in Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|s| (a, s))) {
        let settings = algorithm.settings(pairs[0].size(), 6, 2, schedule);
        let plan = Plan::new(pairs[0].size(), Model::new(Profile::Census, 17)?, settings)?;
        for device in &devices {
            let mut driver = Driver::new(device.as_ref(), plan.clone())?;
            (0..2).try_for_each(|_| driver.solve(&pairs[0]).map(drop))?;
            let region = Region::new(ALLOCATOR);
            let solved = pairs.iter().try_for_each(|pair| driver.solve(pair).map(drop));
            let change = region.change();
            solved?;
            assert_eq!((change.allocations, change.reallocations), (0, 0), "{plan:?}");
        }
    }
    Ok(())
}
