//! The values of an image in memory.

use std::ops::{Deref, Range};

use bytes::Bytes;

use crate::memory::{self, Buffer};

/// Bytes of all pixels, in memory of the image's own or lent by its caller. Clones share them.
#[derive(Clone)]
pub(crate) struct Plane {
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

impl From<Buffer<u8>> for Plane {
    fn from(values: Buffer<u8>) -> Self {
        Self { held: values.bytes(), bytes: Bytes::from_owner(values) }
    }
}

impl<const CHANNELS: usize> From<Buffer<[u8; CHANNELS]>> for Plane {
    fn from(pixels: Buffer<[u8; CHANNELS]>) -> Self {
        Self { held: pixels.bytes(), bytes: Bytes::from_owner(Flattened(pixels)) }
    }
}

/// All channels of all pixels, one after another.
struct Flattened<const CHANNELS: usize>(Buffer<[u8; CHANNELS]>);

impl<const CHANNELS: usize> AsRef<[u8]> for Flattened<CHANNELS> {
    fn as_ref(&self) -> &[u8] {
        self.0.as_flattened()
    }
}

impl Deref for Plane {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}

/// Values in rows of this width, mirrored left to right.
pub(super) fn mirrored<T: Copy>(width: usize, values: &[T]) -> Vec<T> {
    let mut mirrored = values.to_vec();
    mirrored.chunks_exact_mut(width).for_each(<[_]>::reverse);
    mirrored
}

/// Some columns and rows of values in rows of this width.
pub(super) fn part_of<T: Copy>(values: &[T], width: usize, columns: &Range<usize>, rows: &Range<usize>) -> Vec<T> {
    let mut part = Vec::with_capacity(rows.len() * columns.len());
    memory::ask_for_large_pages(part.spare_capacity_mut());
    let rows = values[rows.start * width..rows.end * width].chunks_exact(width);
    rows.for_each(|row| part.extend_from_slice(&row[columns.clone()]));
    part
}
