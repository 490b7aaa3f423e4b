//! Errors, sorted by who can fix them.

use bytesize::ByteSize;

use crate::{
    limits::{MAX_LABELS, MAX_SIDE, MAX_TRUNCATION},
    size::Size,
};

/// An error of the model, a plan, a backend or the driver.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An image without pixels.
    #[error("an image of {size} pixels is empty")]
    Empty {
        /// The requested size.
        size: Size,
    },
    /// An image with a side longer than [`MAX_SIDE`].
    #[error("an image of {size} pixels is too large: a side holds at most {MAX_SIDE}")]
    TooLarge {
        /// The requested size.
        size: Size,
    },
    /// Too few or too many values for an image.
    #[error("{found} values for {size} pixels")]
    PixelCount {
        /// The requested size.
        size: Size,
        /// How many values were given.
        found: usize,
    },
    /// Two images of a pair that differ in size.
    #[error("the left image has {left} pixels and the right one {right}: a rectified pair has one size")]
    SizesDiffer {
        /// Size of the left image.
        left: Size,
        /// Size of the right image.
        right: Size,
    },
    /// Something whose size differs from the expected one.
    #[error("{what} has {found} pixels where {expected} were expected")]
    WrongSize {
        /// The thing that has the wrong size.
        what: &'static str,
        /// Its size.
        found: Size,
        /// The expected size.
        expected: Size,
    },
    /// No labels, or more than [`MAX_LABELS`].
    #[error("{labels} labels: from 1 to {MAX_LABELS} are possible")]
    Labels {
        /// The requested number of labels.
        labels: usize,
    },
    /// A least disparity with which no pixel of any image could match.
    #[error("a least disparity of {min_disparity} px is beyond any image: from {low} to {high} are possible", low = -(MAX_SIDE as i64), high = MAX_SIDE)]
    MinDisparity {
        /// The requested least disparity.
        min_disparity: i32,
    },
    /// A truncation K above the largest with which 8-bit messages are exact.
    #[error("a truncation of {truncation} is above {MAX_TRUNCATION}, the most with which 8-bit messages are exact")]
    Truncation {
        /// The requested truncation.
        truncation: u8,
    },
    /// Edge levels in the wrong order.
    #[error("the edge levels' grey differences must ascend to 255, and their slopes and truncations must not rise")]
    EdgeLevels,
    /// A calibration that no pair of cameras can have.
    #[error("{0}")]
    Calibration(&'static str),
    /// Settings that contradict each other.
    #[error("{0}")]
    Plan(&'static str),
    /// More memory is needed than is available.
    #[error("out of memory: {} needed for {what}{}", amount(*needed), but_only(*available))]
    OutOfMemory {
        /// The purpose of the memory.
        what: &'static str,
        /// Bytes needed; 0 if they are not known.
        needed: u64,
        /// Bytes available, if known.
        available: Option<u64>,
    },
    /// A device that does not exist or cannot be opened.
    #[error("backend {backend} has no device {device}: {reason}")]
    Unavailable {
        /// Name of the backend.
        backend: &'static str,
        /// Index of the device.
        device: usize,
        /// The reason.
        reason: String,
    },
    /// A plan that exceeds the limits of a device, although its memory would suffice.
    #[error("{device} cannot run this plan: {reason}")]
    Unsupported {
        /// Name of the device.
        device: String,
        /// The limit, and what exceeds it.
        reason: String,
    },
    /// A device that disappeared or was reset while it was working. Everything prepared on it is lost.
    #[error("{device} was lost: {reason}")]
    DeviceLost {
        /// Name of the device.
        device: String,
        /// The message of its driver.
        reason: String,
    },
    /// A device that did not answer in time. Everything prepared on it is lost.
    #[error("{device} did not answer within {seconds} s")]
    Timeout {
        /// Name of the device.
        device: String,
        /// The time limit.
        seconds: u64,
    },
    /// Any other failure of a device or its driver.
    #[error("{device}: {reason}")]
    Device {
        /// Name of the device.
        device: String,
        /// A description of the failure.
        reason: String,
    },
    /// The observer asked to stop.
    #[error("interrupted")]
    Stopped,
}

/// Formats a number of bytes with a readable unit.
fn iec(bytes: u64) -> String {
    ByteSize(bytes).display().iec().to_string()
}

fn amount(needed: u64) -> String {
    if needed == 0 { "more".to_owned() } else { iec(needed) }
}

fn but_only(available: Option<u64>) -> String {
    available.map_or_else(String::new, |bytes| format!(", but only {} is available", iec(bytes)))
}
