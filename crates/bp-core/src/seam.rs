//! The seams between the bands of [`Schedule::Sweep`](crate::Schedule::Sweep).

use std::ops::Range;

use crate::BAND_ROWS;

/// A seam between two bands of a grid under [`Schedule::Sweep`](crate::Schedule::Sweep).
///
/// If nothing crossed a seam, surfaces would break there: at every multiple of [`BAND_ROWS`], a row of the map would differ
/// from the row above in ten times as many pixels as other rows do. So a seam is prepared before the first loop on its grid,
/// from the rows around it, [`Seam::rows`]. They start with their first messages. All that they compute is then forgotten,
/// except for these results:
///
/// 1. Forward over all these rows, as in a loop over a band; the last row sends nothing down. The messages that the row above
///    the seam sends down are what the row below the seam holds from above, in all loops.
/// 2. Backward over [`Seam::rows_below`]. The messages that the first of them sends up are what the row above the seam holds
///    from below, in all loops.
/// 3. On grids whose labels are decided ([`Plan::decides_labels`](crate::Plan::decides_labels)), backward over [`Seam::label_rows`], all of which send up. Then the labels of these rows are
///    decided, as in a band that begins with them and has nothing above it. The labels of the row above the seam are f_up for
///    the row below it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seam {
    /// The first row below it.
    pub below: usize,
    height: usize,
}

impl Seam {
    /// The number of rows above a seam that prepare it.
    pub const ROWS_ABOVE: usize = 12;

    /// The number of rows below a seam that prepare it. The last band may have fewer.
    pub const ROWS_BELOW: usize = 4;

    /// The number of rows above a seam whose labels are decided in advance.
    pub const LABEL_ROWS: usize = 6;

    /// The seams of a grid with this many rows, from top to bottom.
    pub fn all(height: usize) -> impl ExactSizeIterator<Item = Self> {
        (1..height.div_ceil(BAND_ROWS).max(1)).map(move |band| Self::below_band(band - 1, height))
    }

    /// The seam below a band, which is not the last one, of a grid with this many rows.
    #[must_use]
    pub fn below_band(band: usize, height: usize) -> Self {
        Self { below: (band + 1) * BAND_ROWS, height }
    }

    /// The rows that prepare it.
    #[must_use]
    pub fn rows(self) -> Range<usize> {
        self.below - Self::ROWS_ABOVE..self.rows_below().end
    }

    /// The rows below it that prepare it.
    #[must_use]
    pub fn rows_below(self) -> Range<usize> {
        self.below..self.height.min(self.below + Self::ROWS_BELOW)
    }

    /// The rows above it whose labels are decided in advance.
    #[must_use]
    pub fn label_rows(self) -> Range<usize> {
        self.below - Self::LABEL_ROWS..self.below
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_lie_between_bands() {
        assert_eq!([1, 32, 33, 64, 65].map(|height| Seam::all(height).len()), [0, 0, 1, 1, 2]);
        let rows = |seam: Seam| (seam.rows(), seam.rows_below(), seam.label_rows());
        let seams: Vec<_> = Seam::all(97).map(rows).collect();
        assert_eq!(seams[0], (20..36, 32..36, 26..32));
        assert_eq!(seams[2], (84..97, 96..97, 90..96));
    }
}
