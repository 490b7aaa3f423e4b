//! Limits of readers.

use std::path::Path;

use crate::Error;

/// Limits on the size of an image and on the memory for reading it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most pixels.
    pub pixels: u64,
    /// Most bytes of memory for reading, the file itself included, if limited.
    pub memory: Option<u64>,
}

/// [`Limits::MEGAPIXELS`] and unlimited memory.
impl Default for Limits {
    fn default() -> Self {
        Self::megapixels(Self::MEGAPIXELS)
    }
}

impl Limits {
    /// The default, in megapixels.
    pub const MEGAPIXELS: u32 = 100;

    /// A limit in megapixels, with unlimited memory.
    #[must_use]
    pub fn megapixels(megapixels: u32) -> Self {
        Self { pixels: u64::from(megapixels) * 1_000_000, memory: None }
    }

    /// The same limit of pixels with this limit of memory, in bytes.
    #[must_use]
    pub fn within(self, memory: Option<u64>) -> Self {
        Self { memory, ..self }
    }

    /// The same limits after so many bytes of the memory were taken.
    #[must_use]
    pub fn without(self, taken: u64) -> Self {
        Self { memory: self.memory.map(|memory| memory.saturating_sub(taken)), ..self }
    }

    /// Most bytes that a file within the limit may have.
    #[must_use]
    pub fn file_bytes(self) -> u64 {
        self.pixels.saturating_mul(16).saturating_add(1 << 20)
    }

    /// Refuses an image beyond the limit.
    pub(crate) fn check_size(self, path: &Path, width: u64, height: u64) -> Result<(), Error> {
        if width.saturating_mul(height) <= self.pixels {
            return Ok(());
        }
        let limit = self.pixels / 1_000_000;
        let what = format!("{width}x{height} pixels exceed the limit of {limit} megapixels; raise `max_megapixels`");
        Err(Error::reading(path, &what))
    }

    /// Refuses a file that needs more memory to read than is available.
    pub(crate) fn check_memory(self, path: &Path, needed: u64) -> Result<(), Error> {
        let refused = |available| Error::OutOfMemory { path: path.to_owned(), needed, available };
        if self.memory.is_some_and(|memory| needed > memory) {
            return Err(refused(self.memory));
        }
        // Tried here because a decoder that gets no memory, for example under `ulimit -v`, would abort the program.
        let is_there = Vec::<u8>::new().try_reserve_exact(usize::try_from(needed).unwrap_or(usize::MAX)).is_ok();
        if is_there { Ok(()) } else { Err(refused(None)) }
    }
}
