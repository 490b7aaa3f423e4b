//! A tile: some columns and rows of an image, with the plan and the part of the pair used to match them.

use std::ops::Range;

use crate::{Cut, Error, Plan, Settings, Size, StereoPair, image::APRON};

/// The columns or the rows of a tile: all that it matches, and those whose labels are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// All columns or rows that are matched.
    pub all: Range<usize>,
    /// Those whose labels are kept. Together, the spans of an image keep each column, or row, exactly once.
    pub kept: Range<usize>,
}

/// A part of an image that is matched on its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Its columns.
    pub columns: Span,
    /// Its rows.
    pub rows: Span,
}

impl Tile {
    /// The size of the part that is matched.
    #[must_use]
    pub fn size(&self) -> Size {
        Size { width: self.columns.all.len(), height: self.rows.all.len() }
    }

    /// The plan of the tile: that of the whole image, with the cut moved to the tile's own coordinates.
    ///
    /// # Errors
    /// None for a tile of that plan's [`crate::Tiling`].
    pub fn plan(&self, whole: &Plan) -> Result<Plan, Error> {
        let cut = whole.settings().cut.and_then(|cut| self.cut(cut));
        Plan::new(self.size(), *whole.model(), Settings { cut, ..*whole.settings() })
    }

    fn cut(&self, Cut { x, y, seed_start }: Cut) -> Option<Cut> {
        let inside = |span: &Span, at: usize| span.all.contains(&at).then(|| at - span.all.start);
        let (x, y) = (inside(&self.columns, x), inside(&self.rows, y));
        let seed_start = seed_start && x.is_some() && y.is_some();
        (x.is_some() || y.is_some()).then(|| Cut { x: x.unwrap_or(0), y: y.unwrap_or(0), seed_start })
    }

    /// Copies the tile's part of a pair.
    ///
    /// # Panics
    /// If the tile lies outside.
    #[must_use]
    pub fn pair(&self, pair: &StereoPair) -> StereoPair {
        let strip = pair.strip(self.rows.all.clone());
        if self.columns.all.len() == pair.size().width { strip } else { strip.columns(self.columns.all.clone()) }
    }

    /// The bytes of such a copy, and of the copy of whole rows that it is made from.
    pub(super) fn pair_bytes(&self, image: Size) -> u64 {
        let width = self.columns.all.len();
        let columns = if width == image.width { width } else { width + image.width };
        2 * 3 * (columns * (self.rows.all.len() + 2 * APRON)) as u64
    }
}

/// The number of extra columns or rows that a tile has before and after those that it keeps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Margin {
    pub(super) before: usize,
    pub(super) after: usize,
}

/// Splits `len` columns or rows into spans that keep `kept` each. A span also has the margin, clipped to the image.
pub(super) fn spans(len: usize, kept: usize, Margin { before, after }: Margin) -> Vec<Span> {
    let span = |start: usize| {
        let end = (start + kept).min(len);
        Span { all: start.saturating_sub(before)..(end + after).min(len), kept: start..end }
    };
    (0..len).step_by(kept).map(span).collect()
}

/// The first span of each length.
pub(super) fn distinct(spans: &[Span]) -> impl Iterator<Item = &Span> {
    let first = |index: usize| spans.iter().position(|span| span.all.len() == spans[index].all.len()) == Some(index);
    spans.iter().enumerate().filter(move |&(index, _)| first(index)).map(|(_, span)| span)
}
