//! Stereo matching by belief propagation: two rectified images in, a disparity map out.
//!
//! ```
//! use bp_stereo::{Image, Matcher, Options};
//!
//! # fn main() -> Result<(), bp_stereo::Error> {
//! # let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729 + x * x * 31 + x * y * 17) % 251) as u8;
//! # let view = |shift| (0..64 * 48).map(|i| noise(i % 64 + shift, i / 64)).collect::<Vec<u8>>();
//! # let (grey_left, grey_right) = (view(0), view(3));
//! let left = Image::from_grey(64, 48, grey_left)?;
//! let right = Image::from_grey(64, 48, grey_right)?;
//! let mut matcher = Matcher::new(&Options::default().with_labels(16).with_check(true))?;
//! let disparity = matcher.compute(&left, &right)?;
//! assert!(disparity.map.at(40, 20).is_some_and(|pixels| (pixels - 3.0).abs() < 0.1));
//! println!("{:?} on {}", disparity.times.total(), matcher.device().name);
//! # Ok(())
//! # }
//! ```
//!
//! [`Options`] selects the algorithm, labels and device; every option has a default. A [`Matcher`] opens a device once
//! and matches any number of pairs on it. A [`Disparity`] holds the map, its confidence, times, energy, memory use and
//! [`Warning`]s. [`Watch`] follows and stops long work. [`batch`] matches folders, lists and videos, and resumes where
//! it was stopped. [`Outputs`] writes maps, pictures, depth and points. [`Error::cause`] says who can fix an error.
//!
//! This crate prints nothing, has no global state and does not change the panic hook.

mod algorithm;
mod alignment;
pub mod batch;
pub mod description;
pub mod devices;
mod disparity;
mod error;
mod finishing;
mod matcher;
mod memory;
mod options;
mod outputs;
pub mod pairs;
mod plan;
mod reading;
mod rectifying;
pub mod stream;
mod system;
mod tiles;
mod warning;
mod watch;

pub use algorithm::{Algorithm, Hierarchy, Loops};
pub use alignment::align_camera;
pub use bp_core::{Alignment, DisparityMap, Energy, Image, Profile, Schedule, Size, StereoPair};
pub use bp_io as io;
pub use disparity::Disparity;
pub use error::{Cause, Error};
pub use finishing::AnswerTimes;
pub use matcher::{Matcher, Planned, Start};
pub use memory::Beside;
pub use options::{Align, Labels, Options, Quality};
pub use outputs::{Content, Making, Outputs};
pub use plan::around;
pub use reading::{
    ReadPair, check_stretching, read_beside, read_pair, read_raw_pair, read_stretched_pair, reading_limits,
    stretching_bytes,
};
pub use rectifying::Rectifying;
pub use system::{Memory, thread_pool};
pub use tiles::Tiles;
pub use warning::{Beyond, Unused, Warning};
pub use watch::{Ending, Event, Stop, Stopped, Watch};

/// Compiles the examples of the project's pages.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../../../README.md")]
    struct Readme;
    #[doc = include_str!("../../../docs/library.md")]
    struct Library;
}
