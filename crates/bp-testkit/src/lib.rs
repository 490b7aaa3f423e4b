//! Tools for tests and experiments, not for users: a suite that every backend passes, and synthetic stereo scenes.
//!
//! A backend's own test opens its device and returns the result of [`conform`]. This example compares one case only:
//!
//! ```
//! use bp_core::Backend;
//! use bp_testkit::{Difference, Oracle, compare, random_case};
//!
//! # fn main() -> Result<(), Difference> {
//! let device = bp_cpu_scalar::Scalar.open(0).expect("the reference runs everywhere");
//! compare(&Oracle, device.as_ref(), &random_case(4))
//! # }
//! ```
//!
//! The [`Oracle`] is slow and obviously right. A backend may also be compared with a device that passed the suite.

mod case;
mod cases;
mod difference;
pub mod jumps;
mod noise;
mod oracle;
mod parts;
mod random;
mod suite;
pub mod synthetic;
mod videos;

pub use case::{Answer, Case, solve};
pub use cases::cases;
pub use difference::{Difference, Fault};
pub use noise::{noise_pair, stepped_pair};
pub use oracle::Oracle;
pub use random::random_case;
pub use suite::{compare, compare_at_random, conform, conform_every, conform_outward};
