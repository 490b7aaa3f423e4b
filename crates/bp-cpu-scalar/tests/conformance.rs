//! Compares the reference backend with unbounded integers.

use bp_cpu_scalar::Scalar;
use bp_testkit::{Difference, Oracle, conform, conform_outward};

#[test]
fn scalar_equals_the_oracle_on_every_kind_of_plan() -> Result<(), Difference> {
    conform(&Oracle, &Scalar)
}

#[test]
fn passing_outward_equals_the_oracle() -> Result<(), Difference> {
    conform_outward(&Oracle, &Scalar)
}
