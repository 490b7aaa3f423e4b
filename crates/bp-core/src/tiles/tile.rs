//! A tile: some columns and rows of an image, and the plan and the pair that they are matched with.

use std::ops::Range;

use crate::{Cut, Error, Plan, Settings, Size, StereoPair, image::APRON};

/// Of the columns or rows of an image: those that a tile matches, and those of them whose answer is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// All that are matched.
    pub all: Range<usize>,
    /// What is kept. The spans of an image share all its columns, or rows, among them.
    pub kept: Range<usize>,
}

/// A part of an image that is matched by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Its columns.
    pub columns: Span,
    /// Its rows.
    pub rows: Span,
}

impl Tile {
    /// Pixels that are matched.
    #[must_use]
    pub fn size(&self) -> Size {
        Size { width: self.columns.all.len(), height: self.rows.all.len() }
    }

    /// The plan of the tile: the whole image's, with the cut where the tile meets it.
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

    /// A copy of the tile's part of a pair.
    ///
    /// # Panics
    /// Where the tile lies outside.
    #[must_use]
    pub fn pair(&self, pair: &StereoPair) -> StereoPair {
        let strip = pair.strip(self.rows.all.clone());
        if self.columns.all.len() == pair.size().width { strip } else { strip.columns(self.columns.all.clone()) }
    }

    /// Bytes of such copies, of the tile and of the rows that it is cut from.
    pub(super) fn pair_bytes(&self, image: Size) -> u64 {
        let width = self.columns.all.len();
        let columns = if width == image.width { width } else { width + image.width };
        2 * 3 * (columns * (self.rows.all.len() + 2 * APRON)) as u64
    }
}

/// The parts of `len` columns or rows of which so many are kept each, with so many more before and after where there are
/// any.
pub(super) fn spans(len: usize, kept: usize, (before, after): (usize, usize)) -> Vec<Span> {
    let span = |start: usize| {
        let end = (start + kept).min(len);
        Span { all: start.saturating_sub(before)..(end + after).min(len), kept: start..end }
    };
    (0..len).step_by(kept).map(span).collect()
}

/// One span of each length.
pub(super) fn distinct(spans: &[Span]) -> impl Iterator<Item = &Span> {
    let first = |index: usize| spans.iter().position(|span| span.all.len() == spans[index].all.len()) == Some(index);
    spans.iter().enumerate().filter(move |&(index, _)| first(index)).map(|(_, span)| span)
}
