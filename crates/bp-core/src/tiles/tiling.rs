//! How a plan is cut into tiles. This is decided before anything runs.

use super::{
    around::{Around, HALO, align, reach},
    join,
    tile::{Halo, Span, Tile, spans},
};
use crate::{Error, Plan, Size};

/// Writing so many bytes for the first time takes about as long as matching a pixel of an ordinary pair, because the system has to
/// find and clear the memory.
const BYTES_PER_PIXEL: f64 = 128.0;

/// Tiles match so many columns more on the left, rather than have them of their right image only. Then all tiles have one plan,
/// and its memory is prepared once.
const MOST_MATCHED: usize = 256;

/// A plan, and the tiles that it runs on. One tile gives the image's answer to the bit. Several give nearly the same one, which is
/// as accurate: pixels beyond the halo have no influence, and under [`Schedule::Sweep`](crate::Schedule::Sweep) bands also
/// begin at the first row of each tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tiling {
    plan: Plan,
    columns: Vec<Span>,
    rows: Vec<Span>,
    /// The columns on each side of those that are kept which have the whole image's costs.
    halo: usize,
    /// How far to the left labels match, if tiles do not match all these columns.
    reach: usize,
    likely: Option<Likely>,
}

/// Tiles that run within some bytes unless label sets turn out larger than usual.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Likely {
    bytes: u64,
    /// Tiles that do in any case.
    certain: Box<Tiling>,
}

impl Tiling {
    /// One tile: the image.
    #[must_use]
    pub fn whole(plan: Plan) -> Self {
        let Size { width, height } = plan.image_size();
        let whole = |length| spans(length, length, 1, Halo::default());
        Self { plan, columns: whole(width), rows: whole(height), halo: 0, reach: 0, likely: None }
    }

    /// Tiles that keep `kept` columns and rows, both rounded up to multiples of 32 (with label sets, of 128 and 64), with at least `halo` columns and rows
    /// around them. All their pixels have the same costs as in the whole image. If labels match to the left, a tile extends further left by
    /// the largest disparity, or, if that is far, its right image alone does; likewise the tile on the right. [`Around`] says what
    /// halos have under each schedule. Under some the image is one tile.
    #[must_use]
    pub fn cut(plan: Plan, kept: Size, halo: usize) -> Self {
        let [left, right] = reach(&plan);
        let (matched, reach) = if left > MOST_MATCHED { (0, left) } else { (left, 0) };
        let Some(around) = Around::with(&plan, halo, [matched, right]) else { return Self::whole(plan) };
        let (Size { width, height }, align) = (plan.image_size(), around.align);
        let beside = Halo { before: around.left, after: around.right };
        let beyond = Halo { before: around.rows, after: around.rows };
        let columns = spans(width, kept.width.next_multiple_of(align.width), align.width, beside);
        let rows = spans(height, kept.height.next_multiple_of(align.height), align.height, beyond);
        Self { plan, columns, rows, halo, reach, likely: None }
    }

    /// The tiling that runs within `bytes`: the whole image, or else the tiles with a halo of [`HALO`] that probably take the least
    /// time. `needed` returns the most bytes that a device needs for a plan, or why it cannot run it. `likely` returns
    /// fewer, if it probably needs no more. Tiles that only probably fit are replaced by others if they do not, see
    /// [`Tiling::certain`].
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] with the bytes that the smallest tiles need, or the reason why they cannot run.
    pub fn within(plan: &Plan, bytes: u64, needed: &Needed<'_>, likely: &Needed<'_>) -> Result<Self, Error> {
        let fits = |tiling: &Self, needed: &Needed<'_>| tiling.bytes(needed).is_ok_and(|needed| needed <= bytes);
        let whole = Self::whole(plan.clone());
        if fits(&whole, needed) {
            return Ok(whole);
        }
        let best = |needed: &Needed<'_>| {
            let tiles = heights(plan).flat_map(|height| of_height(plan, height, |tiling| fits(tiling, needed)));
            let tiles = tiles.filter(|tiling| !tiling.is_whole()).map(|tiling| (tiling.cost(needed), tiling));
            tiles.min_by(|(a, _), (b, _)| a.total_cmp(b))
        };
        let Some((cost, certain)) = best(needed) else {
            let smallest = Self::cut(plan.clone(), Size { width: 1, height: 1 }, HALO);
            let needed = smallest.bytes(needed)?;
            return Err(Error::OutOfMemory { what: "the smallest tiles", needed, available: Some(bytes) });
        };
        let tiling = best(likely).filter(|&(likely, _)| likely < cost);
        Ok(match tiling {
            Some((_, tiling)) => Self { likely: Some(Likely { bytes, certain: Box::new(certain) }), ..tiling },
            None => certain,
        })
    }

    /// The tiling to use if these tiles need more memory than is there. `None` if they cannot.
    #[must_use]
    pub fn certain(&self) -> Option<&Self> {
        self.likely.as_ref().map(|likely| &*likely.certain)
    }

    /// The bytes that matching a tile must not exceed, if it could.
    pub(super) fn limit(&self, tile: &Tile) -> Option<u64> {
        self.likely.as_ref().map(|likely| likely.bytes.saturating_sub(self.bytes_beside(tile)))
    }

    /// The plan of the whole image.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// All tiles, grouped by size and margin, the largest first.
    #[must_use]
    pub fn tiles(&self) -> Vec<Tile> {
        let of_columns = |columns| self.rows.iter().map(move |rows| self.tile(columns, rows));
        let mut tiles: Vec<_> = self.columns.iter().flat_map(of_columns).collect();
        tiles.sort_by_key(|tile| std::cmp::Reverse((tile.size().pixels(), tile.size().width, tile.margin)));
        tiles
    }

    fn tile(&self, columns: &Span, rows: &Span) -> Tile {
        Tile { columns: columns.clone(), rows: rows.clone(), margin: self.margin(columns) }
    }

    /// The columns to the left of these that their pixels match; none if the pixels that count match these columns only.
    fn margin(&self, columns: &Span) -> usize {
        let start = columns.all.start;
        if columns.kept.start.saturating_sub(self.halo + self.reach) >= start { 0 } else { start.min(self.reach) }
    }

    /// The number of tiles across and down.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.columns.len(), self.rows.len())
    }

    /// The most columns and the most rows that a tile matches.
    #[must_use]
    pub fn tile_size(&self) -> Size {
        let longest = |spans: &[Span]| spans.iter().map(|span| span.all.len()).max().unwrap_or(1);
        Size { width: longest(&self.columns), height: longest(&self.rows) }
    }

    /// Whether the image is one tile.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.counts() == (1, 1)
    }

    /// The message entries that all tiles compute.
    #[must_use]
    pub fn message_updates(&self) -> u64 {
        self.sum_of_updates(Plan::message_updates)
    }

    /// The message entries that all tiles compute at half the resolution; see [`Plan::halved`].
    #[must_use]
    pub fn halved_updates(&self) -> u64 {
        self.sum_of_updates(Plan::halved_updates)
    }

    pub(super) fn sum_of_updates(&self, updates: impl Fn(&Plan) -> u64) -> u64 {
        let plans = self.tiles().into_iter().filter_map(|tile| tile.plan(&self.plan).ok());
        plans.fold(0, |sum: u64, plan| sum.saturating_add(updates(&plan)))
    }

    /// The most bytes that [`crate::Tiled`] needs: for the largest tile, for a copy of its part of the pair, and for the
    /// labels of all tiles.
    ///
    /// # Errors
    /// Those of `needed`.
    pub fn bytes(&self, needed: &Needed<'_>) -> Result<u64, Error> {
        if self.is_whole() {
            return needed(&self.plan);
        }
        let mut most = 0;
        for columns in distinct(&self.columns, |columns| (columns.all.len(), self.margin(columns))) {
            for rows in distinct(&self.rows, |rows| rows.all.len()) {
                let tile = self.tile(columns, rows);
                let bytes = needed(&tile.plan(&self.plan)?)?;
                most = most.max(bytes.saturating_add(self.bytes_beside(&tile)));
            }
        }
        Ok(self.likely.as_ref().map_or(most, |likely| most.min(likely.bytes)))
    }

    /// The bytes beside those of a tile's driver: a copy of its part of the pair, joining it, and the labels of all tiles.
    fn bytes_beside(&self, tile: &Tile) -> u64 {
        let (profile, pixels) = (self.plan.model().profile(), self.plan.image_size().pixels());
        tile.pair_bytes(profile) + join::bytes(tile.size()) + 2 * pixels as u64
    }

    /// The number of matched pixels.
    fn matched_pixels(&self) -> f64 {
        let matched = |spans: &[Span]| spans.iter().map(|span| span.all.len()).sum::<usize>() as f64;
        matched(&self.columns) * matched(&self.rows)
    }

    /// About how long it takes, in matched pixels. Tiles use the same memory, one after another.
    fn cost(&self, needed: &Needed<'_>) -> f64 {
        self.matched_pixels() + self.bytes(needed).unwrap_or(u64::MAX) as f64 / BYTES_PER_PIXEL
    }
}

/// The first span of each kind.
fn distinct<Kind: PartialEq>(spans: &[Span], kind: impl Fn(&Span) -> Kind) -> impl Iterator<Item = &Span> {
    let first = move |index: usize| spans.iter().position(|span| kind(span) == kind(&spans[index])) == Some(index);
    spans.iter().enumerate().filter(move |&(index, _)| first(index)).map(|(_, span)| span)
}

/// Tiles of a height are tried in so many widths, each half as wide as the one before.
const NARROWER: usize = 5;

/// Returns how many bytes a device needs for a plan, or why it cannot run it.
pub type Needed<'a> = dyn Fn(&Plan) -> Result<u64, Error> + 'a;

/// Heights of tiles to try, the tallest first.
fn heights(plan: &Plan) -> impl Iterator<Item = usize> + use<> {
    let align = align(plan).height;
    let highest = plan.image_size().height.next_multiple_of(align);
    std::iter::successors(Some(highest), move |&rows| (rows > align).then(|| rows.div_ceil(2).next_multiple_of(align)))
}

/// The widest tiles of a height that fit, and some narrower ones.
fn of_height(plan: &Plan, height: usize, fits: impl Fn(&Tiling) -> bool) -> impl Iterator<Item = Tiling> {
    let align = align(plan).width;
    let tiles = move |blocks: usize| Tiling::cut(plan.clone(), Size { width: blocks * align, height }, HALO);
    let blocks = plan.image_size().width.div_ceil(align);
    let widest = evenly(blocks, |blocks| fits(&tiles(blocks)));
    std::iter::successors(widest, |&blocks| (blocks > 1).then(|| blocks.div_ceil(2))).take(NARROWER).map(tiles)
}

/// Divides `units` into the fewest parts that fit, as evenly as possible, and returns the units of a part. If a part
/// fits, every smaller part must fit too. `None` if not even one unit fits.
fn evenly(units: usize, fits: impl Fn(usize) -> bool) -> Option<usize> {
    let (mut most, mut too_many) = (0, units + 1);
    while most + 1 < too_many {
        let middle = most.midpoint(too_many);
        if fits(middle) {
            most = middle;
        } else {
            too_many = middle;
        }
    }
    (most > 0).then(|| units.div_ceil(units.div_ceil(most)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Algorithm, Cut, Image, Model, Profile, Schedule, StereoPair, tiles::around::ALIGN};

    fn plan((width, height): (usize, usize), labels: usize, algorithm: Algorithm) -> Plan {
        let size = Size { width, height };
        let settings = algorithm.settings(size, 8, 2, Schedule::Sync);
        Plan::new(size, Model::new(Profile::Census, labels).unwrap(), settings).unwrap()
    }

    fn needed(plan: &Plan) -> Result<u64, Error> {
        Ok(plan.bytes())
    }

    fn within(plan: &Plan, bytes: u64) -> Tiling {
        let tiling = Tiling::within(plan, bytes, &needed, &needed).unwrap();
        assert!(tiling.bytes(&needed).unwrap() <= bytes, "{:?}", tiling.counts());
        tiling
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn less_memory_means_smaller_tiles_then_an_error_that_names_the_least() {
        let plan = plan((1500, 3000), 64, Algorithm::Sweep);
        let whole = plan.bytes();
        assert!(within(&plan, whole).is_whole());
        let tilings = [whole - 1, whole / 5, whole / 10, whole / 20].map(|bytes| within(&plan, bytes));
        assert_eq!(tilings.each_ref().map(Tiling::counts), [(1, 8), (1, 8), (3, 8), (5, 16)]);
        assert!(tilings.is_sorted_by(|a, b| a.matched_pixels() <= b.matched_pixels()));
        let Err(Error::OutOfMemory { needed: least, available, .. }) = Tiling::within(&plan, 1, &needed, &needed)
        else {
            panic!()
        };
        assert_eq!(available, Some(1));
        assert!(!within(&plan, least).is_whole());
        assert!(Tiling::within(&plan, least - 1, &needed, &needed).is_err());
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn tiles_that_probably_fit_are_larger_and_know_those_that_certainly_do() {
        let plan = plan((1500, 3000), 64, Algorithm::Sweep);
        let bytes = plan.bytes() / 5;
        let certain = within(&plan, bytes);
        let likely = |plan: &Plan| Ok(plan.bytes() / 2);
        let tiling = Tiling::within(&plan, bytes, &needed, &likely).unwrap();
        assert!(tiling.matched_pixels() < certain.matched_pixels() && tiling.bytes(&needed).unwrap() == bytes);
        assert_eq!((tiling.certain(), certain.certain()), (Some(&certain), None));
        let whole = likely(&plan).unwrap();
        assert!(!Tiling::within(&plan, whole, &needed, &likely).unwrap().is_whole());
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn other_schedules_are_tiled_both_ways() {
        for algorithm in [Algorithm::Cfbp, Algorithm::Ctbp] {
            let plan = plan((1500, 3000), 16, algorithm);
            let tiling = within(&plan, plan.bytes() / 4);
            let share = tiling.matched_pixels() / plan.image_size().pixels() as f64;
            assert!(!tiling.is_whole() && share < 1.45, "{:?} {share}", tiling.counts());
        }
    }

    /// The largest tiles that fit would compute least, but the system would take longer to hand out their memory.
    #[test]
    fn no_more_memory_is_taken_than_pays() {
        let plan = plan((8000, 8000), 16, Algorithm::Sweep);
        let needed = |plan: &Plan| Ok(150 * plan.image_size().pixels() as u64);
        let tiling = Tiling::within(&plan, 8_000_000_000, &needed, &needed).unwrap();
        let bytes = tiling.bytes(&needed).unwrap();
        assert!(bytes < 2_000_000_000, "{:?} {bytes}", tiling.counts());
        assert!(tiling.matched_pixels() < 1.2 * 64e6, "{:?}", tiling.counts());
    }

    #[test]
    fn what_a_device_cannot_run_is_tiled_too() {
        let plan = plan((900, 600), 16, Algorithm::Sweep);
        let narrow = |plan: &Plan| match plan.image_size() {
            Size { width: 0..=400, .. } => needed(plan),
            _ => Err(Error::Plan("too wide")),
        };
        let tiling = Tiling::within(&plan, u64::MAX, &narrow, &narrow).unwrap();
        assert!(tiling.tile_size().width <= 400);
        let nothing = |_: &Plan| Err(Error::Plan("too small"));
        assert_eq!(Tiling::within(&plan, u64::MAX, &nothing, &nothing), Err(Error::Plan("too small")));
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn tiles_share_the_image_and_see_all_that_labels_match() {
        let black = Image::from_grey(333, 222, vec![0; 333 * 222]).unwrap();
        let pair = StereoPair::new(black.clone(), black).unwrap();
        for (min_disparity, reach, right) in
            [(0, 15, 64), (-40, 0, 64 + 40), (100, 115, 64), (270, 285, 64), (-9999, 0, 9999)]
        {
            let plan = plan((333, 222), 16, Algorithm::Cfbp);
            let model = plan.model().with_min_disparity(min_disparity).unwrap();
            let plan = Plan::new(plan.image_size(), model, *plan.settings()).unwrap();
            let tiling = Tiling::cut(plan, Size { width: 60, height: 100 }, 64);
            let mut kept = vec![0; 333 * 222];
            for tile in tiling.tiles() {
                let Tile { columns, rows, margin } = &tile;
                let pixels = rows.kept.clone().flat_map(|y| columns.kept.clone().map(move |x| (x, y)));
                pixels.for_each(|(x, y)| kept[y * 333 + x] += 1);
                assert!(columns.all.start == 0 || columns.all.start + 64 <= columns.kept.start, "{columns:?}");
                assert!(columns.all.start - margin <= columns.kept.start.saturating_sub(64 + reach), "{tile:?}");
                assert_eq!(tile.pair(&pair).size().width, margin + columns.all.len());
                assert!(columns.all.end == 333 || columns.kept.end + right <= columns.all.end, "{columns:?}");
                assert!(columns.all.start.is_multiple_of(ALIGN) && rows.all.start.is_multiple_of(ALIGN));
            }
            assert_eq!(kept, [1; 333 * 222]);
        }
    }

    #[test]
    fn a_cut_goes_where_its_tiles_are() {
        let plan = plan((200, 100), 1, Algorithm::Ctbp);
        let tiling = Tiling::cut(plan, Size { width: 64, height: 64 }, 0);
        let cuts: Vec<_> = tiling
            .tiles()
            .iter()
            .map(|tile| (tile.columns.all.start, tile.rows.all.start, tile.plan(tiling.plan()).unwrap().settings().cut))
            .collect();
        let cut = |x, y, seed_start| Some(Cut { x, y, seed_start });
        assert!(cuts.contains(&(64, 0, cut(36, 50, true))));
        assert!(cuts.contains(&(64, 64, cut(36, 0, false))));
        assert!(cuts.contains(&(0, 0, cut(0, 50, false))));
        assert!(cuts.contains(&(0, 64, None)));
    }
}
