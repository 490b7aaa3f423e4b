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
//! Here one lane of a vector is one pixel, so a label is a shift of the right image's lanes. `patch` does this for costs that fit
//! 8 bits, also for coarser grids.

mod patch;

use std::array;

use bp_core::{MAX_LABELS, Plan, Seed};
use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::{
    block::{Block, LANES},
    costs::{self, Costs, Kept, clip_above, copy_clipped},
    features::Features,
    layout::Layout,
    shape::{PlaneRow, WIDEST},
    stored::is_narrow,
};

pub(crate) use patch::PatchRow;

/// The inputs of the data costs of a pair.
pub(crate) struct Matching<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    /// That of grid 0.
    pub(crate) layout: &'a Layout,
    pub(crate) features: &'a Features,
    pub(crate) seed: Option<Seed>,
}

/// The list that has every label of a grid.
pub(crate) fn all_labels(layout: &Layout) -> &'static [u16] {
    static ALL: [u16; MAX_LABELS] = {
        let mut all = [0; MAX_LABELS];
        let mut label = 0;
        while label < MAX_LABELS {
            all[label] = label as u16;
            label += 1;
        }
        all
    };
    &ALL[..layout.labels]
}

/// Computes the costs of grid 0.
pub(crate) fn match_cost(matching: &Matching<'_>, costs: &mut Costs) {
    if is_narrow(matching.plan) {
        return matching.narrow_rows(0, matching.layout, costs);
    }
    let Costs { stored, sums } = costs;
    costs::rows(matching.layout, stored, u16::of(sums))
        .for_each(|(y, stored, sums)| matching.wide_row(y, stored, sums));
}

impl Matching<'_> {
    /// Stores the costs of grid 0, 1 or 2, made from the images. They must fit 8 bits.
    pub(crate) fn narrow_rows(&self, grid: usize, layout: &Layout, costs: &mut Costs) {
        let labels = all_labels(layout);
        let Costs { stored, sums } = costs;
        costs::rows(layout, stored, u8::of(sums)).for_each(|(y, stored, mut keep)| {
            for patch in 0..layout.blocks {
                let at = PatchRow { grid, patch, y };
                let stored = layout.blocks_of(stored, patch);
                if let Some(keep) = &mut keep {
                    let [even, odd] = layout.blocks_of(keep, patch);
                    let least = self.unclipped(at, labels, [&mut *even, &mut *odd]);
                    self.store_clipped(at, &least, [even, odd], stored);
                } else {
                    dispatch!(self.level, simd => self.patch(simd, at, labels, stored));
                }
            }
        });
    }

    /// Writes the costs of both planes of a patch of grid 0, 1 or 2 for these labels, `[entry]`. They must fit 8 bits.
    #[inline(always)]
    pub(crate) fn patch<S: Simd>(&self, simd: S, at: PatchRow, labels: &[u16], [even, odd]: [&mut [Block]; 2]) {
        let least = self.unclipped(at, labels, [&mut *even, &mut *odd]);
        if at.grid > 0 || !self.fits() {
            let clip = self.plan.clip(at.grid);
            clip_above(simd, &least[0], clip, even);
            clip_above(simd, &least[1], clip, odd);
        }
        self.fix(at, labels, [even, odd]);
    }

    /// Stores the costs of both planes of a patch, given unclipped ones and the least of each node.
    pub(crate) fn store_clipped(&self, at: PatchRow, least: &[Block; 2], costs: [&[Block]; 2], to: [&mut [Block]; 2]) {
        let clip = self.plan.clip(at.grid);
        for ((least, costs), to) in least.iter().zip(costs).zip(to) {
            dispatch!(self.level, simd => copy_clipped(simd, least, clip, costs, to));
        }
    }

    /// Whether unclipped costs need not be normalised and clipped. That never changes a message. It keeps sums within 8 bits.
    fn fits(&self) -> bool {
        let model = self.plan.model();
        model.max_cost(0) + 4 * u64::from(model.truncation()) < u8::MAX.into()
    }

    /// Stores the costs of a row of a profile whose costs do not fit 8 bits.
    fn wide_row(&self, y: usize, stored: &mut [Block], keep: Option<&mut [Block<u16>]>) {
        let layout = self.layout;
        dispatch!(self.level, simd => costs::store(
            simd,
            layout,
            self.plan.clip(0),
            #[inline(always)]
            |block, label| [0, 1].map(|plane| self.sums_of_differences(PlaneRow { plane, y }, LANES * block, label)),
            &mut *stored,
            keep,
        ));
        for patch in 0..layout.blocks {
            self.fix(PatchRow { grid: 0, patch, y }, all_labels(layout), layout.blocks_of(stored, patch));
        }
    }

    /// Sets the costs of the nodes around a known match; see [`Seed`]. It does not change sums: a plan with a cut has
    /// one grid, which needs none.
    fn fix(&self, at: PatchRow, labels: &[u16], costs: [&mut [Block]; 2]) {
        let Some(seed) = self.seed.filter(|_| at.grid == 0) else { return };
        // The cost of labels far from that of the match.
        let dear = self.plan.model().profile().max_cost().min(self.plan.clip(0).into()) as u8;
        for (plane, costs) in costs.into_iter().enumerate() {
            for lane in (0..LANES).filter(|lane| seed.touches(2 * (LANES * at.patch + lane) + plane, at.y)) {
                let cost = |&label: &u16| if label.abs_diff(seed.label) <= 1 { 0 } else { dear };
                labels.iter().zip(&mut *costs).for_each(|(label, block)| block.0[lane] = cost(label));
            }
        }
    }

    /// For a block of nodes, the differences of a pixel and its match, summed over the colour channels.
    #[inline(always)]
    fn sums_of_differences(&self, PlaneRow { plane, y }: PlaneRow, first: usize, label: usize) -> [u16; LANES] {
        let Matching { features, plan, .. } = self;
        let (own, moved) = self.own(plane);
        // Left column 2i + p, with p = plane + margin, matches right column 2i + p - d, which is lane i + (p - d) div 2.
        let shift = (plan.margin() + plane) as i64 - i64::from(plan.model().disparity(label as u16));
        let (parity, columns) = ((shift & 1) as usize, plan.pair_size().width as i64);
        let start = (first as i64 + (shift >> 1)).clamp(-(WIDEST as i64), (columns + 1 - parity as i64) / 2);
        let start = (start + WIDEST as i64) as usize;
        let mut sums = [0; LANES];
        for channel in 0..3 {
            let left = &features.left(y, channel, own)[first + moved..][..LANES];
            let right = &features.right(y, channel, parity)[start..][..LANES];
            let both = left.iter().zip(right);
            sums.iter_mut().zip(both).for_each(|(sum, (&left, &right))| *sum += u16::from(left.abs_diff(right)));
        }
        let inside = &features.inside(parity)[start..][..LANES];
        let node = &features.inside(own)[first + moved + WIDEST..][..LANES];
        let outside = plan.model().profile().out_of_range_cost();
        array::from_fn(|i| match (inside[i], node[i]) {
            (_, 0) => 0,
            (0, _) => outside,
            _ => sums[i],
        })
    }

    /// Where lane 0 of a plane is in the features of a row: the parity of its column in the pair, and the lane there.
    #[inline(always)]
    fn own(&self, plane: usize) -> (usize, usize) {
        let column = self.plan.margin() + plane;
        (column % 2, column / 2)
    }
}
