//! Values of arguments that have parsers of their own.

use std::path::PathBuf;

use bp_io::read_alignment;
use bp_stereo::{Align, Labels};

use crate::failure::Failure;

/// The value of --align.
#[derive(Clone, Debug)]
pub(crate) enum AlignArg {
    Off,
    Auto,
    /// The alignment of a camera, in a file that may be missing.
    File(PathBuf),
}

impl AlignArg {
    pub(crate) fn file(&self) -> Option<&PathBuf> {
        if let Self::File(path) = self { Some(path) } else { None }
    }

    /// The library's option.
    pub(super) fn meaning(&self) -> Result<Align, Failure> {
        match self {
            Self::Off => Ok(Align::Off),
            Self::File(path) if path.exists() => Ok(Align::Known(read_alignment(path)?)),
            Self::Auto | Self::File(_) => Ok(Align::Auto),
        }
    }
}

/// Parses the value of --align.
pub(super) fn align(text: &str) -> Result<AlignArg, String> {
    match text {
        "off" => Ok(AlignArg::Off),
        "auto" => Ok(AlignArg::Auto),
        "" => Err("must be auto, off or a file".to_owned()),
        path => Ok(AlignArg::File(path.into())),
    }
}

/// Parses the value of --labels.
pub(super) fn labels(text: &str) -> Result<Labels, String> {
    let most = bp_core::MAX_LABELS;
    let count = || text.parse().ok().filter(|count| (1..=most).contains(count));
    let labels = if text == "auto" { Some(Labels::Auto) } else { count().map(Labels::Count) };
    labels.ok_or_else(|| format!("must be auto or a number from 1 to {most}"))
}
