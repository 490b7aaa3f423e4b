//! The rows of bands one after another in one dispatch, for the shape [`crate::Shape::Slices`].

use std::ops::Range;

use bp_core::Side;

use super::{
    composer::{Composer, PARAMETERS_ALIGNMENT, Work},
    recorder::PartRecorder,
    sweep::{BandRow, Bands, Direction, Pass},
};
use crate::{
    BindGroup, Command, Kernel, Parameters, Pipeline,
    group::{Group, PASSED_QUADS},
    segment,
};

impl Composer<'_> {
    /// Records a pass through rows of bands.
    pub(super) fn pass_rows(&mut self, part: &mut PartRecorder, pass: &Pass) {
        let (leading, ahead, back) = match pass.direction {
            Direction::Forward => (0, Side::Down, Side::Up),
            Direction::Backward => (1, Side::Up, Side::Down),
        };
        let following = 1 - leading;
        let constants = vec![self.saturates_sent(), self.finds_levels()];
        let Some(own) = self.buffers.own else { return };
        let at = BandRow { grid: pass.grid, bands: pass.bands, colour: leading, row: pass.rows.start };
        for (nodes, rows) in self.rows_of_bands(at, pass.rows.len()) {
            let mut work = self.work(nodes, rows);
            work.parameters.backward = (pass.direction == Direction::Backward).into();
            work.parameters.across = pass.across.into();
            let strip = self.strip(nodes);
            let sent = |side: Side, colour: usize| strip.sent[0][side as usize][colour];
            let bound = vec![
                strip.cost[leading],
                strip.cost[following],
                sent(Side::Left, following),
                sent(Side::Right, following),
                sent(back, following),
                sent(Side::Left, leading),
                sent(Side::Right, leading),
                sent(ahead, leading),
                sent(ahead, following),
                own,
                self.edges_read(nodes),
            ];
            let most = self.buffers.list[own].bytes / segment::own_bytes(&self.grids[nodes.grid]);
            let pipeline = Pipeline { kernel: Kernel::PassRows, constants: constants.clone() };
            self.dispatch_segments(part, pipeline, bound, &work, most as usize);
        }
    }

    /// Records the labels of all bands, or those that are decided for seams.
    pub(super) fn decide_rows(&mut self, part: &mut PartRecorder, grid: usize, bands: Bands, of_band: &Range<usize>) {
        let seams = matches!(bands, Bands::AboveSeams);
        let Some(seam_labels) = self.buffers.seam_labels else { return };
        for (nodes, rows) in self.rows_of_bands(BandRow { grid, bands, colour: 0, row: of_band.start }, of_band.len()) {
            let mut work = self.work(nodes, rows);
            work.parameters.seams = seams.into();
            let strip = self.strip(nodes);
            let [left, right, up, _] = strip.sent[0];
            let bound = vec![
                strip.cost[0],
                strip.cost[1],
                left[1],
                right[1],
                up[0],
                up[1],
                self.buffers.labels[grid],
                seam_labels,
                self.greys_read(nodes),
            ];
            let constants = vec![self.saturates_belief(), self.finds_levels()];
            let pipeline = Pipeline { kernel: Kernel::DecideRows, constants };
            self.dispatch_segments(part, pipeline, bound, &work, usize::MAX);
        }
    }

    /// Records a kernel for all segments of these bands, at most so many in a dispatch.
    fn dispatch_segments(
        &mut self,
        part: &mut PartRecorder,
        mut pipeline: Pipeline,
        buffers: Vec<usize>,
        work: &Work,
        most: usize,
    ) {
        let kernel = pipeline.kernel;
        let group = Group::of(kernel, self.plan, self.limits);
        pipeline.constants.extend([("GROUP_WORDS", group.words), ("SLICES", group.slices)]);
        pipeline.constants.extend([("MOST_WORDS", segment::MOST_WORDS as u32)]);
        if kernel == Kernel::PassRows {
            let size = [("INVOCATIONS", group.words * group.slices), ("SLICE_QUADS", PASSED_QUADS as u32)];
            pipeline.constants.extend(size);
        }
        let pipeline = self.pipelines.insert_full(pipeline).0;
        let bind_group = self.bind_groups.insert_full(BindGroup { kernel, buffers }).0;
        let entries = segment::MOST_WORDS as u64 * 16 * work.rows.span as u64 * self.plan.model().labels() as u64;
        let by_time = usize::try_from(self.limits.dispatch_entries / entries).unwrap_or(usize::MAX);
        let most = most.min(by_time).min(self.limits.workgroups as usize).max(1);
        let kept = segment::kept_words(work.rows.count, work.row_items);
        let segments = work.rows.count * work.row_items.div_ceil(kept);
        for first in (0..segments).step_by(most) {
            let count = most.min(segments - first);
            let [row, row_step, rows, span] =
                [work.rows.first, work.rows.step, work.rows.count, work.rows.span].map(|n| n as u32);
            let block = Parameters {
                row,
                row_step,
                rows,
                span,
                first_segment: first as u32,
                kept_words: kept as u32,
                ..work.parameters
            };
            let parameters = (self.parameters.insert_full(block).0 * PARAMETERS_ALIGNMENT) as u32;
            part.push(
                Command::Dispatch { pipeline, bind_group, parameters, workgroups: count as u32 },
                count as u64 * entries,
            );
            // The next ones keep their messages in the same place.
            part.push_short(Command::Barrier);
        }
    }
}
