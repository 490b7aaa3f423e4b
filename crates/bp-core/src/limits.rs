//! The limits of images and models.

/// The most pixels in a row or a column. Coordinates and disparities below it can be added in `i32` without overflow.
pub const MAX_SIDE: usize = 1 << 24;

/// The most labels of a model.
pub const MAX_LABELS: usize = 1024;

/// The largest truncation K with which u8 messages are exact; see [`crate::exactness`].
pub const MAX_TRUNCATION: u8 = 63;
