//! Data costs of the image.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes:
//!
//! ```text
//! for each pixel (x, y):
//!     for each label d:   raw(d) = D(left(x, y), right(x - disparity(d), y)), or the out-of-range cost
//!     least = min over d of raw(d)
//!     for each label d:   cost(d) = min(raw(d) - least, clip)
//! ```
//!
//! Here one lane of a vector is one pixel, so a label is a shift of the right image's lanes.

use bp_core::{Plan, Schedule, Seed};
use fearless_simd::{Level, Simd, SimdBase, dispatch};

use crate::{
    compare::compare_by,
    costs::{self, Costs, Sums, block},
    features::Features,
    layout::Layout,
    shape::{BLOCK, BlockStart, Column, STRIP, Strip},
};

/// The inputs of the data costs of a pair.
pub(crate) struct Matching<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) layout: &'a Layout,
    pub(crate) features: &'a Features,
    pub(crate) seed: Option<Seed>,
}

/// Whether the costs of a grid are stored. Under `sweep`, those of grid 0 are computed when needed if they fit 8 bits, and so
/// are those of grid 1 if it has label sets and the sums of grid 2 fit too, and those of grid 2 if it has label sets, two of its
/// sums fit 8 bits together, and four 16 bits.
pub(crate) fn is_stored(plan: &Plan, grid: usize) -> bool {
    match grid {
        0 => plan.settings().schedule != Schedule::Sweep || !is_narrow(plan),
        1 => !plan.has_label_sets(1) || plan.sum_bytes(2) > 1,
        2 => !plan.has_label_sets(2) || 2 * plan.model().max_cost(2) > u8::MAX.into() || plan.sum_bytes(3) != 2,
        _ => true,
    }
}

/// Whether all costs of grid 0 fit 8 bits.
fn is_narrow(plan: &Plan) -> bool {
    plan.sum_bytes(0) == 1
}

/// Computes the costs of grid 0.
pub(crate) fn match_cost(matching: &Matching<'_>, costs: &mut Costs) {
    let (layout, Costs { stored, sums }) = (matching.layout, costs);
    match sums {
        Sums::U8(sums) => {
            costs::rows(layout, stored, Some(sums), |y, stored, sums| matching.narrow_row(y, stored, sums));
        }
        Sums::U16(sums) => {
            costs::rows(layout, stored, Some(sums), |y, stored, sums| matching.wide_row(y, stored, sums));
        }
        _ if is_narrow(matching.plan) => costs::rows(layout, stored, None, |y, stored, _: Option<&mut [u8]>| {
            matching.narrow_row(y, stored, None);
        }),
        _ => costs::rows(layout, stored, None, |y, stored, _: Option<&mut [u16]>| matching.wide_row(y, stored, None)),
    }
}

impl Matching<'_> {
    /// Stores the costs of a row of a narrow profile. Also stores the unclipped costs if `sums` has room for them.
    pub(crate) fn narrow_row(&self, y: usize, stored: &mut [u8], sums: Option<&mut [u8]>) {
        let row = Row { matching: self, y };
        if self.fits() && sums.is_none() {
            dispatch!(self.level, simd => row.unclipped(simd, stored));
        } else {
            dispatch!(self.level, simd => row.narrow(simd, stored, sums));
        }
        self.fix(y, stored);
    }

    /// Whether unclipped costs need not be normalised and clipped. That never changes a message. It keeps sums within 8 bits.
    pub(crate) fn fits(&self) -> bool {
        let model = self.plan.model();
        model.max_cost(0) + 4 * u64::from(model.truncation()) < u8::MAX.into()
    }

    /// The cost of labels far from that of a known match.
    pub(crate) fn dear(&self) -> u8 {
        self.plan.model().profile().max_cost().min(self.plan.clip(0).into()) as u8
    }

    fn wide_row(&self, y: usize, stored: &mut [u8], sums: Option<&mut [u16]>) {
        let row = Row { matching: self, y };
        let row = &row;
        dispatch!(self.level, simd => costs::store(
            simd,
            self.layout,
            self.plan.clip(0),
            #[inline(always)]
            |lane, label| [0, 1].map(|plane| row.sum_of_differences(BlockStart { plane, lane }, label)),
            stored,
            sums,
        ));
        self.fix(y, stored);
    }

    /// Sets the costs of the nodes around a known match; see [`Seed`]. It does not change sums: a plan with a cut has
    /// one grid, which needs none.
    fn fix(&self, y: usize, row: &mut [u8]) {
        let Some(seed) = self.seed else { return };
        let layout = self.layout;
        for Column { plane, lane, .. } in layout.columns().filter(|column| seed.touches(column.x, y)) {
            for label in 0..layout.labels {
                let near = (label as u16).abs_diff(seed.label) <= 1;
                row[plane * layout.plane() + label * layout.lanes + lane] = if near { 0 } else { self.dear() };
            }
        }
    }
}

/// A row that is being matched.
struct Row<'a> {
    matching: &'a Matching<'a>,
    y: usize,
}

impl Row<'_> {
    /// Stores the costs of both planes, for profiles whose costs fit 8 bits.
    #[inline(always)]
    fn narrow<S: Simd>(&self, simd: S, stored: &mut [u8], mut keep: Option<&mut [u8]>) {
        simd.vectorize(
            #[inline(always)]
            || {
                let bytes = self.matching.layout.plane();
                for (plane, stored) in stored.chunks_exact_mut(bytes).enumerate() {
                    let mut keep = keep.as_mut().map(|keep| &mut keep[plane * bytes..][..bytes]);
                    for strip in self.matching.layout.strips(plane) {
                        let raw = keep.as_deref_mut().unwrap_or(&mut *stored);
                        let least = self.costs(simd, plane, strip, raw);
                        let clip = self.matching.plan.clip(0);
                        costs::normalise(simd, self.matching.layout, strip, clip, &least, keep.as_deref(), stored);
                    }
                }
            },
        );
    }

    /// Writes the unclipped costs of both planes.
    #[inline(always)]
    fn unclipped<S: Simd>(&self, simd: S, raw: &mut [u8]) {
        simd.vectorize(
            #[inline(always)]
            || {
                for (plane, raw) in raw.chunks_exact_mut(self.matching.layout.plane()).enumerate() {
                    for strip in self.matching.layout.strips(plane) {
                        self.costs(simd, plane, strip, raw);
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn costs<S: Simd>(&self, simd: S, plane: usize, strip: Strip, raw: &mut [u8]) -> [u8; STRIP] {
        compare_by!(self.matching.plan.model().profile(), S::u8s, self.strip(simd, plane, strip, raw))
    }

    /// Computes the costs of a strip of nodes by comparing `CHANNELS` channels. Returns the least cost of each node.
    #[inline(always)]
    fn strip<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        plane: usize,
        strip: Strip,
        raw: &mut [u8],
        cost: impl Fn([S::u8s; CHANNELS], [S::u8s; CHANNELS]) -> S::u8s,
    ) -> [u8; STRIP] {
        let Matching { features, layout, plan, .. } = self.matching;
        let outside = S::u8s::splat(simd, plan.model().profile().out_of_range_cost() as u8);
        let (own, offset) = self.own(plane);
        let left = channels::<CHANNELS>(|channel| strip.of(&features.left(self.y, channel, own)[offset..]));
        let node = strip.of(&features.inside(own)[BLOCK + offset..]);
        let right = [0, 1].map(|parity| {
            let right = channels::<CHANNELS>(|channel| features.right(self.y, channel, parity));
            (right, features.inside(parity))
        });
        let mut least = [u8::MAX; STRIP];
        for label in 0..layout.labels {
            let raw = &mut raw[label * layout.lanes + strip.first..][..strip.lanes];
            let shift = self.shift(plane, label);
            let (right, inside) = &right[shift.parity];
            for lane in (0..strip.lanes).step_by(S::u8s::LEN) {
                let load = |lanes: &[u8], at: usize| S::u8s::from_slice(simd, &lanes[at..at + S::u8s::LEN]);
                let start = shift.start(strip.first + lane);
                let cost = cost(left.map(|left| load(left, lane)), right.map(|right| load(right, start)));
                let inside = load(inside, start);
                let cost = (cost & inside | outside & !inside) & load(node, lane);
                cost.store_slice(&mut raw[lane..lane + S::u8s::LEN]);
                cost.min(load(&least, lane)).store_slice(&mut least[lane..lane + S::u8s::LEN]);
            }
        }
        least
    }

    /// The sum of the differences over the colour channels.
    #[inline(always)]
    fn sum_of_differences(&self, start: BlockStart, label: usize) -> [u16; BLOCK] {
        let outside = self.matching.plan.model().profile().out_of_range_cost();
        let mut sum = [0; BLOCK];
        for channel in 0..3 {
            let Block { left, right, .. } = self.block(start, label, channel);
            for i in 0..BLOCK {
                sum[i] += u16::from(left[i].abs_diff(right[i]));
            }
        }
        let Block { inside, node, .. } = self.block(start, label, 0);
        std::array::from_fn(|i| match (inside[i], node[i]) {
            (_, 0) => 0,
            (0, _) => outside,
            _ => sum[i],
        })
    }

    /// Where the nodes of a plane match under a label.
    #[inline(always)]
    fn shift(&self, plane: usize, label: usize) -> Shift {
        let Matching { plan, .. } = self.matching;
        // Left column 2i + p, with p = plane + margin, matches right column 2i + p - d, which is lane i + (p - d) div 2.
        let shift = (plan.margin() + plane) as i64 - i64::from(plan.model().disparity(label as u16));
        let (parity, shift) = ((shift & 1) as usize, shift >> 1);
        Shift { parity, lanes: shift, nodes: (plan.pair_size().width + 1 - parity) as i64 / 2 }
    }

    /// Where lane 0 of a plane is in the features of a row: the parity of its column in the pair, and the lane there.
    #[inline(always)]
    fn own(&self, plane: usize) -> (usize, usize) {
        let column = self.matching.plan.margin() + plane;
        (column % 2, column / 2)
    }

    /// The features that a block of nodes of a plane compares under a label.
    #[inline(always)]
    fn block(&self, at: BlockStart, label: usize, channel: usize) -> Block<'_> {
        let BlockStart { plane, lane } = at;
        let shift = self.shift(plane, label);
        let (parity, start) = (shift.parity, shift.start(lane));
        let (own, offset) = self.own(plane);
        Block {
            left: block(self.matching.features.left(self.y, channel, own), lane + offset),
            right: block(self.matching.features.right(self.y, channel, parity), start),
            inside: block(self.matching.features.inside(parity), start),
            node: block(self.matching.features.inside(own), lane + offset + BLOCK),
        }
    }
}

/// The lanes of the right image that match the nodes of a plane under a label.
#[derive(Clone, Copy)]
struct Shift {
    /// The parity of their columns.
    parity: usize,
    /// By how many lanes they lie further right.
    lanes: i64,
    /// The number of the right image's columns of this parity.
    nodes: i64,
}

impl Shift {
    /// Where the lanes that match those from `lane` on start in [`Features::right`].
    #[inline(always)]
    fn start(self, lane: usize) -> usize {
        ((lane as i64 + self.lanes).clamp(-(BLOCK as i64), self.nodes) + BLOCK as i64) as usize
    }
}

/// Calls `lanes` for every channel and collects the results.
#[inline(always)]
pub(crate) fn channels<'a, const CHANNELS: usize>(lanes: impl Fn(usize) -> &'a [u8]) -> [&'a [u8]; CHANNELS] {
    let mut all = [[].as_slice(); CHANNELS];
    all.iter_mut().enumerate().for_each(|(channel, of)| *of = lanes(channel));
    all
}

struct Block<'a> {
    left: &'a [u8; BLOCK],
    right: &'a [u8; BLOCK],
    /// 255 where the right image has a column, otherwise 0.
    inside: &'a [u8; BLOCK],
    /// 255 where the left image has a column, otherwise 0.
    node: &'a [u8; BLOCK],
}
