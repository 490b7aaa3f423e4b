//! The buffers and constants of the kernels that read messages: `update_messages` and `select_labels`.

use bp_core::{Schedule, Side};

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

    /// The same for the costs of its edges.
    pub(super) fn edges_read(&self, nodes: Nodes) -> usize {
        self.buffers.edges.as_ref().map_or(self.strip(nodes).cost[nodes.colour], |edges| edges[nodes.grid])
    }

    /// The constant that tells kernels to find the levels of edges.
    pub(super) fn finds_levels(&self) -> (&'static str, u32) {
        ("LEVELS", self.buffers.greys.is_some().into())
    }

    /// The kernel that passes messages. `selective` says that the parameters name the sides.
    pub(super) fn update_pipeline(&self, selective: bool) -> Pipeline {
        let constants = vec![self.saturates_sent(), self.finds_levels()];
        match self.limits.shape {
            Shape::Words => {
                let constants = [constants, vec![("SELECTIVE", selective.into())]].concat();
                Pipeline { kernel: Kernel::UpdateMessages, constants }
            }
            Shape::Slices => {
                let kernel = Kernel::UpdateMessagesOfSlice;
                let Group { words, slices, .. } = Group::of(kernel, self.plan, self.limits);
                let invocations = ("INVOCATIONS", words * slices * Side::ALL.len() as u32);
                Pipeline { kernel, constants: [constants, vec![invocations]].concat() }
            }
        }
    }

    /// The buffers of the data costs, of the messages from the other colour, of the messages that these nodes send, and
    /// of the grey values or the costs of edges.
    pub(super) fn messages(&self, nodes: Nodes, read: usize, written: usize) -> Vec<usize> {
        let strip = self.strip(nodes);
        let received = strip.sent[read].map(|side| side[1 - nodes.colour]);
        let sent = strip.sent[written].map(|side| side[nodes.colour]);
        let edges = match self.limits.shape {
            Shape::Words => self.greys_read(nodes),
            Shape::Slices => self.edges_read(nodes),
        };
        [&[strip.cost[nodes.colour]], received.as_slice(), &sent, &[edges]].concat()
    }

    /// 1 if a stored data cost plus this many messages plus `more` may exceed 255, otherwise 0.
    fn saturates(&self, messages: u32, more: u8) -> u32 {
        let (clip, truncation) = (self.plan.model().clip(), self.plan.model().truncation());
        // The labels that a set lacks cost 255.
        let clip = if self.buffers.label_sets.is_some() { u8::MAX } else { clip };
        (u32::from(clip) + messages * u32::from(truncation) + u32::from(more) > 255).into()
    }

    /// The constant that tells kernels that send whether their sums may exceed 255.
    pub(super) fn saturates_sent(&self) -> (&'static str, u32) {
        ("SATURATING", self.saturates(3, self.plan.model().smoothness().step()))
    }

    /// The same for kernels that decide labels.
    pub(super) fn saturates_belief(&self) -> (&'static str, u32) {
        ("SATURATING", self.saturates(4, 0))
    }

    pub(super) fn select(&mut self, part: &mut PartRecorder, nodes: Nodes, work: Work) {
        let sweep = self.plan.settings().schedule == Schedule::Sweep;
        let constants = vec![self.saturates_belief(), ("SWEEP", sweep.into()), self.finds_levels()];
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
