//! The Vulkan backend against the reference, on the first device there is.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use bp_core::{
    Algorithm, Backend, Error, Model, Plan, Profile, Schedule,
    conformance::{Case, assert_conforms, assert_same, noise_pair},
};
use bp_cpu_scalar::Scalar;
use bp_shaders::Limits;
use bp_vulkan::{Vulkan, VulkanDevice};

/// The first device, with changed limits; `BP_REQUIRE_GPU` makes it an error that there is none.
fn open_with(change: impl FnOnce(&mut Limits)) -> Option<VulkanDevice> {
    match Vulkan.open_with(0, change) {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("BP_REQUIRE_GPU").is_none() => {
            eprintln!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn the_first_device_conforms() {
    let Some(device) = open_with(|_| {}) else { return };
    bp_shaders::check(&device).unwrap();
    assert_conforms(&Scalar, &device);
}

/// Every algorithm under every schedule, on an image of several bands.
fn assert_all_the_same(device: &VulkanDevice) {
    let pair = noise_pair(21, 97, 3);
    for (algorithm, schedule) in Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|s| (a, s))) {
        let model = Model::new(Profile::Census, 19).unwrap();
        let plan = Plan::new(pair.size(), model, algorithm.settings(pair.size(), 7, 2, schedule)).unwrap();
        assert_same(&Scalar, device, &Case { pair: pair.clone(), plan });
    }
}

#[test]
fn cut_into_strips_an_image_gives_the_same() {
    let lower = |limits: &mut Limits| (limits.binding_bytes, limits.buffer_bytes) = (17_000, 17_000);
    let Some(device) = open_with(lower) else { return };
    assert_all_the_same(&device);
}

#[test]
fn cut_into_parts_dispatches_give_the_same() {
    let lower = |limits: &mut Limits| (limits.workgroups, limits.dispatch_entries) = (3, 1 << 10);
    let Some(device) = open_with(lower) else { return };
    assert_all_the_same(&device);
}

/// They share its queue and its kernels.
#[test]
fn plans_on_one_device_run_at_once() {
    let Some(device) = open_with(|_| {}) else { return };
    std::thread::scope(|scope| {
        for labels in [3, 9, 30] {
            let device = &device;
            scope.spawn(move || {
                let pair = noise_pair(40, 30, labels as u64);
                let settings = Algorithm::Cfbp.settings(pair.size(), 20, 2, Schedule::Checkerboard);
                let plan = Plan::new(pair.size(), Model::new(Profile::Thesis, labels).unwrap(), settings).unwrap();
                let case = Case { pair, plan };
                (0..5).for_each(|_| assert_same(&Scalar, device, &case));
            });
        }
    });
}

#[test]
fn a_plan_beyond_memory_is_refused() {
    let Some(device) = open_with(|limits| limits.memory_bytes = Some(1 << 16)) else { return };
    let pair = noise_pair(61, 47, 3);
    let settings = Algorithm::Bp.settings(pair.size(), 1, 1, Schedule::Sync);
    let plan = Plan::new(pair.size(), Model::new(Profile::Census, 19).unwrap(), settings).unwrap();
    let error = bp_core::Matcher::new(&device, plan).err().unwrap();
    assert!(matches!(error, Error::OutOfMemory { available: Some(65_536), .. }), "{error}");
}

#[test]
fn a_device_that_is_not_there_is_refused() {
    let error = Vulkan.open(99).err().unwrap();
    assert!(matches!(&error, Error::Unavailable { backend: "vulkan", device: 99, .. }), "{error}");
    let count = Vulkan.devices().len();
    assert!(count == 0 || error.to_string().contains(&format!("{count} device")), "{error}");
}
