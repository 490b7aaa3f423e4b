//! A tile: some columns and rows of an image, with the plan and the part of the pair used to match them.

use std::ops::Range;

use crate::{Cut, Error, Plan, Profile, Settings, Size, StereoPair, image::APRON};

/// The columns or the rows of a tile: all that it matches, and those whose labels are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// All columns or rows that are matched.
    pub all: Range<usize>,
    /// Those whose labels are kept, but for borders that leave the middle of what two tiles share. Together, the spans of an
    /// image keep each column, or row, exactly once.
    pub kept: Range<usize>,
}

impl Span {
    /// Those that are kept, and around them those that may be kept in place of a neighbour's.
    pub(super) fn shared(&self) -> Range<usize> {
        let Self { all, kept } = self;
        let [before, after] =
            [kept.start - all.start, all.end - kept.end].map(|halo| SHARED.min(halo * 3 / 4).min(kept.len() / 2));
        kept.start - before..kept.end + after
    }
}

/// A part of an image that is matched on its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Its columns.
    pub columns: Span,
    /// Its rows.
    pub rows: Span,
    /// The columns to the left of these, of which only the right image is needed: the tile's pixels match them.
    pub margin: usize,
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
        Plan::new(self.size(), *whole.model(), Settings { cut, ..*whole.settings() })?.with_margin(self.margin)
    }

    fn cut(&self, Cut { x, y, seed_start }: Cut) -> Option<Cut> {
        let inside = |span: &Span, at: usize| span.all.contains(&at).then(|| at - span.all.start);
        let (x, y) = (inside(&self.columns, x), inside(&self.rows, y));
        let seed_start = seed_start && x.is_some() && y.is_some();
        (x.is_some() || y.is_some()).then(|| Cut { x: x.unwrap_or(0), y: y.unwrap_or(0), seed_start })
    }

    /// Copies the tile's part of a pair, with the margin.
    ///
    /// # Panics
    /// If the tile lies outside.
    #[must_use]
    pub fn pair(&self, pair: &StereoPair) -> StereoPair {
        let Range { start, end } = self.columns.all;
        pair.part(start - self.margin..end, self.rows.all.clone())
    }

    /// The bytes of such a copy of what a profile compares.
    pub(super) fn pair_bytes(&self, profile: Profile) -> u64 {
        let columns = self.margin + self.columns.all.len();
        2 * profile.image_bytes() * (columns * (self.rows.all.len() + 2 * APRON)) as u64
    }
}

/// Tiles share at most so many columns or rows on either side of the middle of a border, at most half of those that they keep, so
/// that borders do not cross, and at most three quarters of the halo: what
/// lies further out knows less of the image.
pub(super) const SHARED: usize = 48;

/// The number of extra columns or rows that a tile has before and after those that it keeps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Halo {
    pub(super) before: usize,
    pub(super) after: usize,
}

/// Splits `len` columns or rows into spans that keep `kept` each and begin at multiples of `align`. A span also has the halo,
/// clipped to the image. If they can have one length at little cost, they do: then one driver matches all of them.
pub(super) fn spans(len: usize, kept: usize, align: usize, Halo { before, after }: Halo) -> Vec<Span> {
    let span = |start: usize| {
        let end = (start + kept).min(len);
        Span { all: start.saturating_sub(before)..(end + after).min(len), kept: start..end }
    };
    let spans: Vec<_> = (0..len).step_by(kept).map(span).collect();
    let longest = spans.iter().map(|span| span.all.len()).max().unwrap_or(0);
    let last = len.saturating_sub(longest) / align * align;
    let lengthened = |span: &Span| {
        let start = span.all.start.min(last);
        Span { all: start..start + (len - last), kept: span.kept.clone() }
    };
    let matched = |spans: &[Span]| spans.iter().map(|span| span.all.len()).sum::<usize>();
    let equal: Vec<_> = spans.iter().map(lengthened).collect();
    if matched(&equal) <= matched(&spans) + matched(&spans) / MOST_LENGTHENED { equal } else { spans }
}

/// Spans are made equal if this adds no more than this part of their sum. Tiles of another size need other memory, which takes
/// the system about as long to hand out as half a tile takes to match.
const MOST_LENGTHENED: usize = 12;
