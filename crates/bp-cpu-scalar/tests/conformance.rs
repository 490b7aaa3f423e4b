//! The reference backend against unbounded integers.

use bp_core::conformance::{Oracle, assert_conforms};
use bp_cpu_scalar::Scalar;

#[test]
fn scalar_equals_the_oracle_on_every_kind_of_plan() {
    assert_conforms(&Oracle, &Scalar);
}
