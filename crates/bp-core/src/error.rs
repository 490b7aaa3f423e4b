//! What can go wrong, sorted by who can mend it.

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
        /// The size asked for.
        size: Size,
    },
    /// A side longer than [`MAX_SIDE`].
    #[error("an image of {size} pixels is too large: a side holds at most {MAX_SIDE}")]
    TooLarge {
        /// The size asked for.
        size: Size,
    },
    /// Values that do not fill their image.
    #[error("{found} values for {size} pixels")]
    PixelCount {
        /// The size asked for.
        size: Size,
        /// How many values there were.
        found: usize,
    },
    /// Two images that should be of one size.
    #[error("the left image has {left} pixels and the right one {right}: a rectified pair has one size")]
    SizesDiffer {
        /// Size of the left image.
        left: Size,
        /// Size of the right image.
        right: Size,
    },
    /// Something of another size than was prepared or compared with.
    #[error("{what} has {found} pixels where {expected} were expected")]
    WrongSize {
        /// What has the size.
        what: &'static str,
        /// Its size.
        found: Size,
        /// The size it should have.
        expected: Size,
    },
    /// No labels, or more than [`MAX_LABELS`].
    #[error("{labels} labels: from 1 to {MAX_LABELS} are possible")]
    Labels {
        /// How many were asked for.
        labels: usize,
    },
    /// A least disparity so far out that no pixel of any image could match.
    #[error("a least disparity of {min_disparity} px is beyond any image: from {low} to {high} are possible", low = -(MAX_SIDE as i64), high = MAX_SIDE)]
    MinDisparity {
        /// What was asked for.
        min_disparity: i32,
    },
    /// A truncation K with which u8 would not be exact.
    #[error("a truncation of {truncation} is above {MAX_TRUNCATION}, the most with which 8-bit messages are exact")]
    Truncation {
        /// What was asked for.
        truncation: u8,
    },
    /// A geometry that no pair of cameras has.
    #[error("{0}")]
    Calibration(&'static str),
    /// A plan setting that no run can follow.
    #[error("{0}")]
    Plan(&'static str),
    /// More memory needed than there is.
    #[error("out of memory: {needed} bytes are needed for {what}{}", available.map_or_else(String::new, |bytes| format!(" and {bytes} are available")))]
    OutOfMemory {
        /// What the memory was for.
        what: &'static str,
        /// Bytes needed.
        needed: u64,
        /// Bytes that there are, where that is known.
        available: Option<u64>,
    },
    /// A device that is not there.
    #[error("backend {backend} has no device {device}: {reason}")]
    Unavailable {
        /// Name of the backend.
        backend: &'static str,
        /// Index of the device.
        device: usize,
        /// Why.
        reason: String,
    },
    /// A plan beyond what a device is made for, though memory would do.
    #[error("{device} cannot run this plan: {reason}")]
    Unsupported {
        /// Name of the device.
        device: String,
        /// Which limit, and what would pass it.
        reason: String,
    },
    /// A device that went away or was reset while it worked; what was prepared on it is lost.
    #[error("{device} was lost: {reason}")]
    DeviceLost {
        /// Name of the device.
        device: String,
        /// What its driver says.
        reason: String,
    },
    /// A device that did not answer in time; what was prepared on it is lost.
    #[error("{device} did not answer within {seconds} s")]
    Timeout {
        /// Name of the device.
        device: String,
        /// How long it was given.
        seconds: u64,
    },
    /// Any other failure of a device or its driver.
    #[error("{device}: {reason}")]
    Device {
        /// Name of the device.
        device: String,
        /// What failed.
        reason: String,
    },
    /// The observer asked to stop.
    #[error("interrupted")]
    Stopped,
}
