//! What all decoders share: the memory they may take, and how files end too early.

use std::path::Path;

use crate::{Error, Limits};

/// Bytes by which a strip or tile of a TIFF may be larger than its image.
pub(crate) const TILE: u64 = 4 << 20;

/// Why most broken files cannot be decoded.
pub(crate) const ENDS_EARLY: &str = "the file ends too early or is broken";

/// A decoded image: its pixels, its bytes, those of one value, and how many channels are kept of it.
pub(crate) struct Decoded {
    pub(crate) pixels: u64,
    pub(crate) total: u64,
    pub(crate) value_bytes: u64,
    pub(crate) channels: u64,
}

/// Refuses an image whose file, decoding and conversion to 8 bits exceed the memory. The decoder holds `meanwhile`
/// bytes besides the image.
pub(crate) fn check_memory(
    path: &Path,
    limit: Limits,
    file: u64,
    image: &Decoded,
    meanwhile: u64,
) -> Result<(), Error> {
    let &Decoded { pixels, total, value_bytes, channels } = image;
    // First a copy in the kept channels of as many bits, then their 8-bit values.
    let kept = channels * pixels * value_bytes;
    let conversion = kept + total.max(channels * pixels);
    limit.check_memory(path, file.saturating_add(conversion.max(total.saturating_add(meanwhile))))
}
