//! Windows around pixels, row by row.

use crate::{DisparityMap, Error, Size, memory::Buffer};

/// A map with a frame around it, `[height + 2 frame][width + 2 frame]`, so that windows never leave it.
pub(super) struct Framed {
    width: usize,
    frame: usize,
    values: Buffer<f32>,
}

/// The contents of the frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Frame {
    /// Unknown pixels.
    Unknown,
    /// The nearest pixel of the map.
    Repeated,
}

impl Framed {
    /// Puts `values`, `[height][width]`, in a frame of this width.
    pub(super) fn new(size: Size, values: &[f32], frame: usize, kind: Frame) -> Result<Self, Error> {
        let (width, height) = (size.width + 2 * frame, size.height + 2 * frame);
        let mut framed = Buffer::filled("a map with a frame", width * height, DisparityMap::UNKNOWN)?;
        for (y, row) in framed.chunks_exact_mut(width).enumerate() {
            let inside = (frame..frame + size.height).contains(&y);
            if kind == Frame::Unknown && !inside {
                continue;
            }
            let y = y.saturating_sub(frame).min(size.height - 1);
            row[frame..frame + size.width].copy_from_slice(&values[y * size.width..][..size.width]);
            if kind == Frame::Repeated {
                row[..frame].fill(values[y * size.width]);
                row[frame + size.width..].fill(values[(y + 1) * size.width - 1]);
            }
        }
        Ok(Self { width: size.width, frame, values: framed })
    }

    /// A shifted row: entry x is the value (dx - frame) columns and (dy - frame) rows away from pixel (x, y), for dx and dy in
    /// `0..=2 frame`.
    pub(super) fn row(&self, y: usize, dx: usize, dy: usize) -> &[f32] {
        &self.values[(y + dy) * (self.width + 2 * self.frame) + dx..][..self.width]
    }
}

/// The position of each pixel of a window in its frame.
pub(super) fn window(reach: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..=2 * reach).flat_map(move |dy| (0..=2 * reach).map(move |dx| (dx, dy)))
}
