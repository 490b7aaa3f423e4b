//! The rayon backend against the reference, on every instruction set that this processor has.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use bp_core::{Backend, conformance::assert_conforms};
use bp_cpu_rayon::Rayon;
use bp_cpu_scalar::Scalar;
use rayon::ThreadPoolBuilder;

#[test]
fn rayon_equals_scalar_on_every_instruction_set_and_with_any_number_of_threads() {
    for (device, threads) in (0..Rayon.devices().len()).zip([1, 2, 3, 8].into_iter().cycle()) {
        let tested = Rayon.open(device).unwrap();
        let _ = tested;
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| assert_conforms(&Scalar, Rayon.open(device).unwrap().as_ref()));
    }
}
