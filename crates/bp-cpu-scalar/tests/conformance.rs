//! Compares the reference backend with unbounded integers.

use bp_cpu_scalar::Scalar;
use bp_testkit::{Difference, Oracle, compare, conform, outward_cases};

#[test]
fn scalar_equals_the_oracle_on_every_kind_of_plan() -> Result<(), Difference> {
    conform(&Oracle, &Scalar)
}

#[test]
fn passing_outward_equals_the_oracle() -> Result<(), Difference> {
    outward_cases().try_for_each(|case| compare(&Oracle, &Scalar, &case))
}
