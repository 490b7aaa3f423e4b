//! The buffers and constants of the kernels that read messages: `update_messages` and `select_labels`.

use bp_core::Schedule;

use super::{
    composer::{Composer, Nodes, Work},
    recorder::PartRecorder,
};
use crate::{Kernel, Pipeline, Shape, group::Group};

impl Composer<'_> {
    /// The buffer of the grid's grey values. If all edges have the same cost, no kernel reads it, and a buffer of costs is bound.
    pub(super) fn greys_read(&self, nodes: Nodes) -> usize {
        self.buffers.greys.as_ref().map_or(self.strip(nodes).cost[nodes.colour], |greys| greys[nodes.grid])
    }

    /// The constant that tells kernels to find the levels of edges.
    fn finds_levels(&self) -> (&'static str, u32) {
        ("LEVELS", self.buffers.greys.is_some().into())
    }

    /// The kernel that sends to this many sides. `selective` says that the parameters name them.
    pub(super) fn update_pipeline(&self, sides: usize, selective: bool) -> Pipeline {
        let saturating = ("SATURATING", self.saturates(3, self.plan.model().smoothness().step()));
        match self.limits.shape {
            Shape::Words => {
                let constants = vec![saturating, self.finds_levels(), ("SELECTIVE", selective.into())];
                Pipeline { kernel: Kernel::UpdateMessages, constants }
            }
            Shape::Slices => {
                let (kernel, sides) = (Kernel::UpdateMessagesOfSlice, sides as u32);
                let Group { words, slices, .. } = Group::of(kernel, self.plan, self.limits);
                let size = [("SIDES", sides), ("INVOCATIONS", words * slices * sides)];
                Pipeline { kernel, constants: [&[saturating, self.finds_levels()], size.as_slice()].concat() }
            }
        }
    }

    /// The buffers of the data costs, of the messages from the other colour, of the messages that these nodes send, and
    /// of the grey values.
    pub(super) fn messages(&self, nodes: Nodes, read: usize, written: usize) -> Vec<usize> {
        let strip = self.strip(nodes);
        let received = strip.sent[read].map(|side| side[1 - nodes.colour]);
        let sent = strip.sent[written].map(|side| side[nodes.colour]);
        [&[strip.cost[nodes.colour]], received.as_slice(), &sent, &[self.greys_read(nodes)]].concat()
    }

    /// 1 if a stored data cost plus this many messages plus `more` may exceed 255, otherwise 0.
    fn saturates(&self, messages: u32, more: u8) -> u32 {
        let (clip, truncation) = (self.plan.model().clip(), self.plan.model().truncation());
        // The labels that a set lacks cost 255.
        let clip = if self.buffers.label_sets.is_some() { u8::MAX } else { clip };
        (u32::from(clip) + messages * u32::from(truncation) + u32::from(more) > 255).into()
    }

    pub(super) fn select(&mut self, part: &mut PartRecorder, nodes: Nodes, work: Work) {
        let sweep = self.plan.settings().schedule == Schedule::Sweep;
        let constants = vec![("SATURATING", self.saturates(4, 0)), ("SWEEP", sweep.into()), self.finds_levels()];
        let pipeline = Pipeline { kernel: Kernel::SelectLabels, constants };
        let set = self.set(self.plan.settings().steps);
        let strip = self.strip(nodes);
        let received = strip.sent[set].map(|side| side[1 - nodes.colour]);
        let bound = [
            &[strip.cost[nodes.colour]],
            received.as_slice(),
            &[self.buffers.labels[nodes.grid], self.greys_read(nodes)],
        ]
        .concat();
        self.dispatch(part, pipeline, bound, work);
    }
}
