//! The C interface of [`bp_stereo`]: open a matcher with options as JSON, compute maps on buffers of the caller, close it.
//!
//! `include/bpstereo.h` is made from these files (`BLESS=1 cargo test -p bp-capi --test header`), and `examples/` has programs
//! in C and C++.
#![expect(unsafe_code, reason = "C is unsafe")]
#![deny(clippy::undocumented_unsafe_blocks)]

mod image;
mod matcher;
mod rows;
mod status;

pub use image::{BpstereoImage, BpstereoValue};
pub use matcher::{BpstereoMatcher, bpstereo_answer, bpstereo_close, bpstereo_compute, bpstereo_open, bpstereo_stop};
pub use status::{BpstereoStatus, bpstereo_last_error, bpstereo_version};
