//! The next coarser grid, as rows that are passed together see it.

use std::ops::RangeInclusive;

use bp_core::{BAND_ROWS, EdgeLevels, Error};

use super::{
    Band,
    slots::{Reading, Slots},
};
use crate::layout::Layout;

/// The bands of the next coarser grid that some rows depend on.
pub(super) struct CoarseBands<'a> {
    first: usize,
    /// Band `first`, and the next one if that is needed.
    band: Reading<'a, Band>,
    next: Option<Reading<'a, Band>>,
}

impl<'a> CoarseBands<'a> {
    /// Waits for these bands, of which there are one or two.
    pub(super) fn read(needed: RangeInclusive<usize>, bands: &'a Slots<Band>) -> Result<Self, Error> {
        let (first, last) = needed.into_inner();
        debug_assert!(last <= first + 1, "rows that depend on bands {first} to {last}");
        let next = if last > first { Some(bands.read(last)?) } else { None };
        Ok(Self { first, band: bands.read(first)?, next })
    }
}

/// The next coarser grid.
#[derive(Clone, Copy)]
pub(crate) struct Coarser<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) edges: &'a EdgeLevels,
    bands: &'a CoarseBands<'a>,
}

impl<'a> Coarser<'a> {
    pub(super) fn new(layout: &'a Layout, edges: &'a EdgeLevels, bands: &'a CoarseBands<'a>) -> Self {
        Self { layout, edges, bands }
    }

    /// The band of this index.
    #[inline(always)]
    pub(super) fn band(&self, index: usize) -> &'a Band {
        let CoarseBands { first, band, next } = self.bands;
        next.as_ref().filter(|_| index > *first).unwrap_or(band)
    }

    /// The labels that were decided in row y, `[width]`.
    pub(super) fn labels(&self, y: usize) -> &'a [u16] {
        let width = self.layout.size.width;
        &self.band(y / BAND_ROWS).labels[y % BAND_ROWS * width..][..width]
    }
}
