//! The values of an image in memory.

use std::ops::Deref;

use bytes::Bytes;

use crate::memory;

/// Bytes of all pixels, in memory of the image's own or lent by its caller. Clones share them.
#[derive(Clone)]
pub(super) struct Plane {
    bytes: Bytes,
    /// Those of our own memory.
    held: u64,
}

impl Plane {
    /// Bytes that lie in another's memory, which keeps them there.
    pub(super) fn lent(owner: impl AsRef<[u8]> + Send + 'static) -> Self {
        Self { bytes: Bytes::from_owner(owner), held: 0 }
    }

    /// The bytes held, without lent ones.
    pub(super) fn held(&self) -> u64 {
        self.held
    }

    /// The bytes as colours.
    pub(super) fn colours(&self) -> &[[u8; 3]] {
        self.bytes.as_chunks().0
    }
}

impl From<Vec<u8>> for Plane {
    fn from(values: Vec<u8>) -> Self {
        Self { held: memory::bytes(&values), bytes: values.into() }
    }
}

impl From<Vec<[u8; 3]>> for Plane {
    fn from(colours: Vec<[u8; 3]>) -> Self {
        colours.into_flattened().into()
    }
}

impl Deref for Plane {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}
