//! Holds the first device against the scalar backend, also with limits that split what a small image does not.
//!
//! Skipped where there is no device, unless `BP_REQUIRE_GPU` is set.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::time::Duration;

use bp_core::{
    Algorithm, Backend, Device, Error, Matcher, MessageStart, Model, Plan, Profile, Schedule, Settings,
    conformance::{Case, assert_conforms, assert_same, noise_pair},
};
use bp_cpu_scalar::Scalar;
use bp_shaders::Limits;
use bp_wgpu::Wgpu;

/// The first device with its limits changed, if there is one.
fn device(change: impl FnOnce(&mut Limits)) -> Option<Box<dyn Device>> {
    match Wgpu.open_with(0, change) {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("BP_REQUIRE_GPU").is_none() => {
            eprintln!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// An image of several bands and some 40 KB a band of 64 labels, to be solved on three grids.
fn case(schedule: Schedule, message_start: MessageStart) -> Case {
    let pair = noise_pair(37, 110, 3);
    let settings = Algorithm::Cfbp.settings(pair.size(), 4, 2, schedule);
    let settings = Settings { grids: 3, message_start, ..settings };
    let plan = Plan::new(pair.size(), Model::new(Profile::Census, 64).unwrap(), settings).unwrap();
    Case { pair, plan }
}

fn cases() -> Vec<Case> {
    let starts = Schedule::ALL.into_iter().flat_map(|schedule| MessageStart::ALL.map(|start| (schedule, start)));
    let possible = starts.filter(|&(schedule, start)| schedule != Schedule::Sweep || start == MessageStart::Receiver);
    possible.map(|(schedule, start)| case(schedule, start)).collect()
}

fn assert_cases(change: impl FnOnce(&mut Limits)) {
    let Some(device) = device(change) else { return };
    cases().iter().for_each(|case| assert_same(&Scalar, device.as_ref(), case));
}

#[test]
fn conforms() {
    if let Some(device) = device(|_| ()) {
        assert_conforms(&Scalar, device.as_ref());
    }
}

#[test]
fn strips_change_nothing() {
    assert_cases(|limits| limits.binding_bytes = 46 << 10);
}

#[test]
fn small_dispatches_change_nothing() {
    assert_cases(|limits| (limits.dispatch_entries, limits.workgroups) = (5000, 7));
}

#[test]
fn what_cannot_run_is_refused() {
    let prepare = |change: fn(&mut Limits)| Some(Matcher::new(device(change)?.as_ref(), cases()[0].plan.clone()).err());
    let short_bindings = prepare(|limits| limits.binding_bytes = 8 << 10);
    assert!(matches!(short_bindings, None | Some(Some(Error::Unsupported { .. }))), "{short_bindings:?}");
    let little_memory = prepare(|limits| limits.memory_bytes = Some(100_000));
    assert!(matches!(little_memory, None | Some(Some(Error::OutOfMemory { .. }))), "{little_memory:?}");
    let few_bindings = Wgpu.open_with(0, |limits| limits.bindings = 4).err();
    assert!(matches!(few_bindings, Some(Error::Unavailable { .. })), "{few_bindings:?}");
}

#[test]
fn times_of_the_device_add_up() {
    let Some(device) = device(|_| ()) else { return };
    for Case { pair, plan } in cases() {
        let times = Matcher::new(device.as_ref(), plan).unwrap().solve(&pair).unwrap();
        // A device may have no clock.
        let Some(stages) = times.device else { continue };
        assert!(stages.iter().sum::<Duration>() <= times.total, "{times:?}");
    }
}

#[test]
fn an_index_beyond_the_devices_is_told() {
    let count = Wgpu.devices().len();
    let error = Wgpu.open(count).err().unwrap();
    assert!(matches!(&error, Error::Unavailable { backend: "wgpu", device, .. } if *device == count), "{error}");
}

/// Runs itself again where no driver can be found.
#[test]
fn without_a_driver_there_is_a_reason() {
    const NOWHERE: &str = "/nonexistent/icd.json";
    if std::env::var("VK_DRIVER_FILES").is_ok_and(|files| files == NOWHERE) {
        assert_eq!(Wgpu.devices(), []);
        let error = Wgpu.open(0).err().unwrap().to_string();
        assert!(error.contains("mesa-vulkan-drivers") && error.contains(NOWHERE), "{error}");
        return;
    }
    let mut again = std::process::Command::new(std::env::current_exe().unwrap());
    again.args(["--exact", "without_a_driver_there_is_a_reason"]).env("VK_DRIVER_FILES", NOWHERE);
    let output = again.env("VK_ICD_FILENAMES", NOWHERE).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}
