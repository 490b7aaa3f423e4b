//! First messages of a swept grid: interpolated between those of the coarser grid, see [`bp_core::Schedule::Sweep`].
//!
//! The messages of a coarse row are first brought into the order of columns and to the labels of the finer patch. There, lane
//! i is the parent of lane i of both planes of the finer patch, and lanes -1 and 32 lie beside the parents. Then every first
//! message is a mean of such lanes. Three coarse rows are kept at a time.

use std::{array, cmp::Ordering, hint::black_box};

use bp_core::{BAND_ROWS, EdgeLevels, Error, MAX_TRUNCATION, memory::Buffer};
use fearless_simd::{Simd, SimdBase, SimdCombine, SimdInt, u8x16};

use super::{
    Band,
    coarser::Coarser,
    lists::Lists,
    messages::{Around, Held, Place},
    padded::Padded,
    routes::{self, Route, Routes},
};
use crate::block::{Block, Bytes, LANES};

/// The coarse rows that a finer row is interpolated between lie within this number of rows.
const ROWS: usize = 3;

/// Half a block. A finer patch has as many columns as half a coarser one.
const HALF: usize = LANES / 2;

/// From which side messages come: left, right or below.
const SIDES: usize = 3;
const LEFT: usize = 0;
const RIGHT: usize = 1;
const BELOW: usize = 2;

/// The messages of a few coarse rows, for the lists of finer rows: `[row mod 3][side][entry]`.
#[derive(Default)]
pub(crate) struct CoarseRows {
    values: Buffer<Padded>,
    /// To the lists of the coarser patch, and of those to its left and right.
    routes: [Routes; 3],
    /// The coarse rows that are held, and the band that the routes belong to.
    rows: [Option<usize>; ROWS],
    band: Option<usize>,
}

/// The bytes for so many entries.
pub(crate) fn bytes(entries: usize) -> u64 {
    let values = (entries as u64).saturating_mul((ROWS * SIDES * size_of::<Padded>()) as u64);
    values.saturating_add(routes::bytes(entries).saturating_mul(3))
}

/// A coarse row to be read for one finer patch.
struct Reading<'a> {
    band: &'a Band,
    width: usize,
    row: usize,
    y: usize,
    /// The finer patch.
    patch: usize,
}

impl CoarseRows {
    /// Makes room for so many entries.
    pub(crate) fn fit(&mut self, entries: usize) -> Result<(), Error> {
        self.values.grow("messages", (ROWS * SIDES).saturating_mul(entries), Padded::ZERO)?;
        self.routes.iter_mut().try_for_each(|routes| routes.fit(entries))
    }

    /// Forgets everything, before other rows of a grid.
    pub(crate) fn clear(&mut self) {
        (self.rows, self.band) = ([None; ROWS], None);
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.values.bytes() + self.routes.iter().map(Routes::bytes).sum::<u64>()
    }

    /// Reads the coarse rows that a finer row is interpolated between.
    #[inline(always)]
    pub(crate) fn read<S: Simd>(&mut self, simd: S, coarser: Coarser<'_>, lists: &Lists, y: usize) {
        let near = y / 2;
        for row in [near.checked_sub(1 - y % 2), Some(near + y % 2)].into_iter().flatten() {
            if row < coarser.layout.size.height && self.rows[row % ROWS] != Some(row) {
                self.read_row(simd, coarser, lists, row);
                self.rows[row % ROWS] = Some(row);
            }
        }
    }

    #[inline(always)]
    fn read_row<S: Simd>(&mut self, simd: S, coarser: Coarser<'_>, lists: &Lists, y: usize) {
        let index = y / BAND_ROWS;
        let band = coarser.band(index);
        if self.band != Some(index) {
            self.find_routes(coarser.edges, band, lists);
            self.band = Some(index);
        }
        let (width, truncation) = (coarser.layout.size.width, coarser.edges.usual().truncation);
        for patch in 0..lists.patches() {
            let reading = Reading { band, width, row: y % BAND_ROWS, y, patch };
            let range = lists.range(patch);
            let routes = self.routes.each_ref().map(|routes| routes.of(range.clone()));
            for side in 0..SIDES {
                let start = ((y % ROWS) * SIDES + side) * lists.entries();
                let values = &mut self.values[start + range.start..start + range.end];
                match side {
                    LEFT => reading.read::<_, LEFT>(simd, truncation, routes, values),
                    RIGHT => reading.read::<_, RIGHT>(simd, truncation, routes, values),
                    _ => reading.read::<_, BELOW>(simd, truncation, routes, values),
                }
            }
        }
    }

    fn find_routes(&mut self, edges: &EdgeLevels, band: &Band, lists: &Lists) {
        for patch in 0..lists.patches() {
            let own = patch / 2;
            // A finer patch is the left or the right half of a coarser one.
            let is_left = patch % 2 == 0;
            let left = own.checked_sub(1).filter(|_| is_left);
            let right = Some(own + 1).filter(|&next| !is_left && next < band.lists.patches());
            let patches = [Some(own), left, right];
            for (routes, from) in self.routes.iter_mut().zip(patches) {
                if let Some(from) = from {
                    routes.find(lists.range(patch), lists.list(patch).labels, band.lists.list(from).labels, edges);
                }
            }
        }
    }

    /// Writes the first messages of the nodes of `plane` of a patch in row y: those from the sides and from below.
    #[inline(always)]
    pub(crate) fn interpolate<S: Simd>(&self, simd: S, at: &At<'_>, sides: bool, below: bool, to: &mut Around<'_>) {
        if at.plane == 0 {
            self.interpolate_of::<_, -1, -1>(simd, at, sides, below, to);
        } else {
            self.interpolate_of::<_, 1, 0>(simd, at, sides, below, to);
        }
    }

    #[inline(always)]
    fn interpolate_of<S: Simd, const ASIDE: isize, const NEXT: isize>(
        &self,
        simd: S,
        at: &At<'_>,
        sides: bool,
        below: bool,
        to: &mut Around<'_>,
    ) {
        let (near, far) = (at.y / 2, if at.y % 2 == 1 { Some(at.y / 2 + 1) } else { (at.y / 2).checked_sub(1) });
        let height = at.coarser_height;
        let range = at.lists.range(at.patch);
        let row = |y: usize, side: usize| {
            let start = ((y % ROWS) * SIDES + side) * at.lists.entries();
            &self.values[start + range.start..start + range.end]
        };
        let both = |side: usize, rows: usize| {
            let far = far.filter(|&far| far < rows).unwrap_or(near);
            row(near, side).iter().zip(row(far, side))
        };
        if sides {
            // The left neighbour of plane 1 and the right one of plane 0 lie in the same pair of columns.
            let (same, next) = if ASIDE == 1 { (LEFT, RIGHT) } else { (RIGHT, LEFT) };
            for (out, (near, far)) in to.same.iter_mut().zip(both(same, height)) {
                out.store(nearer(simd, near.load::<S, 0>(simd), far.load::<S, 0>(simd)));
            }
            for (out, (near, far)) in to.next.iter_mut().zip(both(next, height)) {
                out.store::<S, NEXT>(nearer(simd, near.load::<S, 0>(simd), far.load::<S, 0>(simd)));
            }
        }
        // The last row receives nothing from below.
        if below && near + 1 < height {
            // Out of the compiler's sight: it would make the lanes aside from the others, which takes longer than loading them.
            let aside = black_box(both(BELOW, height - 1));
            let own = both(BELOW, height - 1);
            for ((out, (near, far)), aside) in to.below.iter_mut().zip(own).zip(aside) {
                let own = nearer(simd, near.load::<S, 0>(simd), far.load::<S, 0>(simd));
                let aside = nearer(simd, aside.0.load::<S, ASIDE>(simd), aside.1.load::<S, ASIDE>(simd));
                out.store(nearer(simd, own, aside));
            }
        } else if below {
            to.below.fill(Block::ZERO);
        }
    }
}

/// The nodes whose first messages are made.
pub(crate) struct At<'a> {
    pub(crate) lists: &'a Lists,
    pub(crate) patch: usize,
    pub(crate) plane: usize,
    pub(crate) y: usize,
    pub(crate) coarser_height: usize,
}

impl Reading<'_> {
    /// Reads the messages from one side, in the order of columns. Those of columns that other patches hold are arbitrary at
    /// first.
    #[inline(always)]
    fn read<S: Simd, const SIDE: usize>(&self, simd: S, truncation: u8, routes: [Route<'_>; 3], values: &mut [Padded]) {
        let columns = Columns::<S, SIDE>::new(simd, self);
        let most = Bytes::splat(simd, truncation);
        for (to, from) in routes[0].runs() {
            for (entry, out) in from.zip(&mut values[to]) {
                out.store::<S, 0>(columns.of(entry));
            }
        }
        for (entry, source) in routes[0].between() {
            let [(below, cost), (above, cost_above)] = source.nearest(0);
            let below = columns.of(below).saturating_add(Bytes::splat(simd, cost));
            let above = columns.of(above).saturating_add(Bytes::splat(simd, cost_above));
            values[entry].store::<S, 0>(below.min(above).min(most));
        }
        self.read_borders::<SIDE>(truncation, routes, values);
    }

    /// The messages that the nodes of the coarser patch hold.
    fn held(&self, plane: usize) -> Held<'_> {
        let Band { lists, messages, .. } = self.band;
        let range = lists.range(self.patch / 2);
        messages.at(&Place { entries: lists.entries(), row: self.row, plane, range: &range })
    }

    /// Reads the columns that the coarse patches on the left and right hold. Where there is no such column, that at the border takes
    /// its place in messages from below, and others are zeros.
    #[inline(always)]
    fn read_borders<const SIDE: usize>(&self, truncation: u8, routes: [Route<'_>; 3], values: &mut [Padded]) {
        let first = LANES * self.patch;
        // Of messages from the side, only the sides' own columns can lie in another patch.
        let columns: [isize; 2] = match (SIDE, self.y % 2) {
            (BELOW, _) => [-1, LANES as isize],
            (LEFT, 1) => [0, 0],
            (RIGHT, 0) => [LANES as isize - 1; 2],
            _ => [0, -1],
        };
        let wanted = if SIDE == BELOW { &columns[..] } else { &columns[..usize::from(columns[0] == columns[1])] };
        for &column in wanted {
            let holder = usize::try_from(first as isize + column).ok().and_then(|x| self.holder::<SIDE>(x));
            match holder {
                Some(x) => self.read_column::<SIDE>(truncation, routes, x, column, values),
                None => values.iter_mut().for_each(|out| *out.lane_mut(column) = 0),
            }
        }
        let last = self.width as isize - 1 - first as isize;
        if SIDE == BELOW && first == 0 {
            values.iter_mut().for_each(|out| *out.lane_mut(-1) = out.lane(0));
        }
        if SIDE == BELOW && (-1..LANES as isize).contains(&last) {
            values.iter_mut().for_each(|out| *out.lane_mut(last + 1) = out.lane(last));
        }
        // Zeros for all labels, where nothing was received: by the even node at the border, or next to it by none.
        for column in self.without_message::<SIDE>().filter(|column| (0..LANES as isize).contains(column)) {
            values.iter_mut().for_each(|out| *out.lane_mut(column) = 0);
        }
    }

    /// The lanes of the columns for which nothing was received from a side: that at the border and, if its node is even, the
    /// next one, which would take over what that node received.
    fn without_message<const SIDE: usize>(&self) -> impl Iterator<Item = isize> + use<SIDE> {
        let (first, last) = (-((LANES * self.patch) as isize), self.width as isize - 1 - (LANES * self.patch) as isize);
        let is_even = |x: usize| isize::from((x + self.y).is_multiple_of(2));
        match SIDE {
            LEFT => first..first + 1 + is_even(0),
            RIGHT => last - is_even(self.width - 1)..last + 1,
            _ => 0..0,
        }
    }

    /// The column of the node that holds the message from a side of coarse column x, if there are both.
    fn holder<const SIDE: usize>(&self, x: usize) -> Option<usize> {
        let is_odd = (x + self.y) % 2 == 1;
        let holder = match SIDE {
            LEFT if is_odd => x.checked_sub(1)?,
            RIGHT if is_odd => x + 1,
            _ => x,
        };
        (x < self.width && holder < self.width).then_some(holder)
    }

    /// Writes the messages that column x holds, which may belong to any patch, to a lane.
    fn read_column<const SIDE: usize>(
        &self,
        truncation: u8,
        routes: [Route<'_>; 3],
        x: usize,
        lane: isize,
        values: &mut [Padded],
    ) {
        let (own, patch) = (self.patch / 2, x / (2 * LANES));
        let index = match patch.cmp(&own) {
            Ordering::Equal => 0,
            Ordering::Less => 1,
            Ordering::Greater => 2,
        };
        let (lists, messages) = (&self.band.lists, &self.band.messages);
        let (entries, range) = (lists.entries(), lists.range(patch));
        let inside = self.row * entries + range.start..self.row * entries + range.end;
        let (plane, from) = (x % 2, x / 2 % LANES);
        let in_pair = (SIDE == LEFT) == (plane == 1);
        if SIDE == BELOW {
            let below = &messages.vertical[(2 * self.row + 2 + plane) * entries..][range];
            routes[index].carry(0, truncation, below, |block| block.0[from], values, lane);
        } else if in_pair {
            let same = &messages.same[inside];
            routes[index].carry(0, truncation, same, |block| block.0[from], values, lane);
        } else {
            let (next, from) = (&messages.next[inside], from as isize - isize::from(plane == 0));
            routes[index].carry(0, truncation, next, |block| block.lane(from), values, lane);
        }
    }
}

/// The messages from one side to the columns of a finer patch, by entry of the coarser one. Those of columns that other patches
/// hold are arbitrary.
struct Columns<'a, S: Simd, const SIDE: usize> {
    simd: S,
    /// By plane.
    held: [Held<'a>; 2],
    is_odd: bool,
    /// The first lane.
    half: usize,
    /// The lanes after or before those of half a block. There is none beyond the block; an end takes its place.
    moved: u8x16<S>,
}

impl<'a, S: Simd, const SIDE: usize> Columns<'a, S, SIDE> {
    #[inline(always)]
    fn new(simd: S, reading: &'a Reading<'_>) -> Self {
        let half = (reading.patch % 2) * HALF;
        let by = if SIDE == LEFT { -1 } else { 1 };
        let moved = array::from_fn(|i| (i as isize + by).clamp(0, HALF as isize - 1) as u8);
        let held = [0, 1].map(|plane| reading.held(plane));
        Self { simd, held, is_odd: reading.y % 2 == 1, half, moved: u8x16::load_array(simd, moved) }
    }

    #[inline(always)]
    fn of(&self, entry: usize) -> Bytes<S> {
        let Self { held: [held, below_odd], half, .. } = self;
        let block = |block: &Block| u8x16::from_slice(self.simd, &block.0[*half..half + HALF]);
        let [even, odd] = match (SIDE, self.is_odd) {
            (BELOW, _) => [block(&held.below[entry]), block(&below_odd.below[entry])],
            (LEFT, false) => [u8x16::from_slice(self.simd, held.next[entry].half(*half as isize - 1)); 2],
            (LEFT, true) => [self.moved(&held.same[entry]), block(&held.same[entry])],
            (_, false) => [block(&held.same[entry]), self.moved(&held.same[entry])],
            (_, true) => [u8x16::from_slice(self.simd, held.next[entry].half(*half as isize)); 2],
        };
        even.zip_low(odd).combine(even.zip_high(odd))
    }

    /// The lanes of the pairs of columns beside.
    #[inline(always)]
    fn moved(&self, block: &Block) -> u8x16<S> {
        // The second half has lanes to its left, the first one to its right.
        let whole =
            if SIDE == LEFT { self.half.checked_sub(1) } else { Some(self.half + 1).filter(|_| self.half == 0) };
        let first = whole.unwrap_or(self.half);
        let lanes = u8x16::from_slice(self.simd, &block.0[first..first + HALF]);
        if whole.is_some() { lanes } else { lanes.swizzle_dyn_within_blocks(self.moved) }
    }
}

/// Three quarters of `near` and one of `far`, as two means that are rounded up.
#[inline(always)]
fn nearer<S: Simd>(simd: S, near: Bytes<S>, far: Bytes<S>) -> Bytes<S> {
    // No message exceeds this. But an operation on whole vectors keeps the compiler from gathering single bytes of many
    // entries into a vector.
    mean(simd, mean(simd, near, far), near).min(Bytes::splat(simd, MAX_TRUNCATION))
}

/// The mean, rounded up.
#[inline(always)]
fn mean<S: Simd>(simd: S, a: Bytes<S>, b: Bytes<S>) -> Bytes<S> {
    let (a, b) = (a.as_slice(), b.as_slice());
    // Compilers know this as one instruction.
    Bytes::from_fn(
        simd,
        #[inline(always)]
        |i| ((u16::from(a[i]) + u16::from(b[i]) + 1) >> 1) as u8,
    )
}
