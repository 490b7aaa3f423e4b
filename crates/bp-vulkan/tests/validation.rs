//! Runs plans under the Khronos validation layer, including its synchronisation checks. It must report nothing.

use bp_core::{Algorithm, Backend, Model, Plan, Profile, Schedule};
use bp_testkit::{Case, noise_pair, solve};
use bp_vulkan::{
    Vulkan,
    validation::{self, Messages},
};

#[test]
fn the_validation_layer_has_nothing_to_say() {
    validation::turn_on();
    if !validation::is_installed() || Vulkan.devices().is_empty() {
        let missing = "there is no validation layer (Debian: vulkan-validationlayers) or no device";
        assert!(std::env::var_os("BP_REQUIRE_GPU").is_none(), "{missing}");
        eprintln!("skipped: {missing}");
        return;
    }
    let device = Vulkan.open(0).unwrap();
    // A device with small buffers, which cuts images into strips.
    let small = Vulkan.open_with(0, |limits| limits.binding_bytes = 17_000).unwrap();
    let pair = noise_pair(21, 97, 5);
    for (algorithm, schedule) in Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|s| (a, s))) {
        let settings = algorithm.settings(pair.size(), 3, 2, schedule);
        let plan = Plan::new(pair.size(), Model::new(Profile::Census, 19).unwrap(), settings).unwrap();
        let case = Case { pair: pair.clone(), plan };
        assert!(solve(device.as_ref(), &case).unwrap() == solve(small.as_ref(), &case).unwrap());
    }
    drop((device, small));
    assert_eq!(validation::messages(), Messages::default());
}
