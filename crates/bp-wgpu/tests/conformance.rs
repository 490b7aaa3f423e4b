//! Tests the wgpu backend on the first device. Without a device the tests are skipped, unless `BP_REQUIRE_GPU` is set.

use bp_core::{Backend, Device, Error};
use bp_cpu_scalar::Scalar;
use bp_gpu::{
    Limits,
    conformance::{
        conforms, conforms_cut_up, conforms_in_segments, opened, refuses, reshape, runs_plans_at_once, tells_times,
    },
};
use bp_testkit::Difference;
use bp_wgpu::Wgpu;

/// Both GPU backends run the same programs, and the Vulkan backend's tests run all cases. What is left to find here are
/// differences between the APIs.
const EVERY: usize = 5;

fn open(change: &dyn Fn(&mut Limits)) -> Option<Box<dyn Device>> {
    opened(Wgpu.open_with(0, change))
}

/// The first device with the other shape of kernels than suits it.
fn open_reshaped(change: &dyn Fn(&mut Limits)) -> Option<Box<dyn Device>> {
    open(&|limits| {
        reshape(limits);
        change(limits);
    })
}

#[test]
fn the_other_shape_conforms() -> Result<(), Difference> {
    conforms(16 * EVERY, &Scalar, open_reshaped)
}

#[test]
fn the_other_shape_conforms_cut_up() -> Result<(), Difference> {
    conforms_cut_up(8 * EVERY, &Scalar, open_reshaped)
}

#[test]
fn sweeps_of_several_segments_conform() -> Result<(), Difference> {
    conforms_in_segments(&Scalar, open)?;
    conforms_in_segments(&Scalar, open_reshaped)
}

#[test]
fn the_first_device_conforms() -> Result<(), Difference> {
    conforms(EVERY, &Scalar, open)
}

#[test]
fn the_first_device_conforms_cut_up() -> Result<(), Difference> {
    conforms_cut_up(EVERY, &Scalar, open)
}

#[test]
fn plans_on_one_device_run_at_once() -> Result<(), Difference> {
    runs_plans_at_once(&Scalar, open)
}

#[test]
fn what_cannot_run_is_refused() {
    refuses(|change| Wgpu.open_with(0, change));
}

#[test]
fn the_device_tells_times() {
    tells_times(open);
}

#[test]
fn a_device_that_is_not_there_is_refused() {
    let error = Wgpu.open(99).err().unwrap();
    assert!(matches!(&error, Error::Unavailable { backend: "wgpu", device: 99, .. }), "{error}");
}

/// Runs itself again in an environment without a driver.
#[test]
fn without_a_driver_there_is_a_reason() {
    const NOWHERE: &str = "/nonexistent/icd.json";
    if std::env::var("VK_DRIVER_FILES").is_ok_and(|files| files == NOWHERE) {
        assert_eq!(Wgpu.devices(), []);
        let error = Wgpu.open(0).err().unwrap().to_string();
        assert!(error.contains("VK_DRIVER_FILES") && error.contains(NOWHERE), "{error}");
        return;
    }
    let mut again = std::process::Command::new(std::env::current_exe().unwrap());
    again.args(["--exact", "without_a_driver_there_is_a_reason"]).env("VK_DRIVER_FILES", NOWHERE);
    let output = again.env("VK_ICD_FILENAMES", NOWHERE).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}
