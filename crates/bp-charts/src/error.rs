//! The error of a chart.

/// Why a chart could not be drawn, in words.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Error(pub(crate) String);
