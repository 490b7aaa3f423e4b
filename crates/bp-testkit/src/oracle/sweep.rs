//! The schedule `sweep`, which follows its definition sentence by sentence.

use std::ops::Range;

use bp_core::{BAND_ROWS, Node, Seam, Side};

use super::state::State;

const EVEN: usize = 0;
const ODD: usize = 1;

/// The even or odd nodes of row y.
fn row_nodes(width: usize, y: usize, parity: usize) -> impl Iterator<Item = Node> {
    (0..width).filter(move |x| (x + y) % 2 == parity).map(move |x| Node { x, y })
}

impl State {
    /// Prepares all seams; see [`Seam`].
    pub(super) fn prepare_seams(&mut self, grid: usize) {
        for seam in Seam::all(self.plan.size(grid).height) {
            let first_messages = self.grids[grid].received.clone();
            self.restrict(grid, seam.rows());
            self.forward(grid, seam.rows());
            let down = self.row(grid, seam.below, Side::Up);
            self.backward(grid, seam.rows_below(), Some(Side::Up));
            let up = self.row(grid, seam.below - 1, Side::Down);
            if self.plan.decides_labels(grid) {
                self.backward(grid, seam.label_rows(), Some(Side::Up));
                let mut labels = std::mem::take(&mut self.above_seams);
                self.decide_rows(grid, seam.label_rows(), false, &mut labels);
                self.above_seams = labels;
            }
            self.grids[grid].received = first_messages;
            self.set_row(grid, seam.below, Side::Up, down);
            self.set_row(grid, seam.below - 1, Side::Down, up);
        }
        self.bands(grid).into_iter().for_each(|rows| self.restrict(grid, rows));
    }

    /// The messages that row y received from a side.
    fn row(&self, grid: usize, y: usize, side: Side) -> Vec<Vec<i64>> {
        let nodes = (0..self.plan.size(grid).width).map(|x| Node { x, y });
        let message = |node| &self.grids[grid].received[self.index(grid, node)][side as usize];
        nodes.map(|node| self.extended(grid, node, message(node))).collect()
    }

    fn set_row(&mut self, grid: usize, y: usize, side: Side, messages: Vec<Vec<i64>>) {
        for (x, message) in messages.into_iter().enumerate() {
            let node = self.index(grid, Node { x, y });
            self.grids[grid].received[node][side as usize] = message;
        }
    }

    /// One loop of [`bp_core::Schedule::Sweep`].
    pub(super) fn sweep(&mut self, grid: usize) {
        for rows in self.bands(grid) {
            self.forward(grid, rows.clone());
            self.backward(grid, rows.start + 1..rows.end, Some(Side::Up));
            self.backward(grid, rows.start..rows.start + 1, None);
        }
    }

    /// Forgets the downward messages of seams, after the last loop.
    pub(super) fn forget_downward(&mut self, grid: usize) {
        for received in &mut self.grids[grid].received {
            received[Side::Up as usize].fill(0);
        }
    }

    /// The rows of all bands.
    fn bands(&self, grid: usize) -> Vec<Range<usize>> {
        let height = self.plan.size(grid).height;
        (0..height.div_ceil(BAND_ROWS)).map(|b| BAND_ROWS * b..height.min(BAND_ROWS * b + BAND_ROWS)).collect()
    }

    /// Forward over rows, of which the last sends nothing down.
    fn forward(&mut self, grid: usize, rows: Range<usize>) {
        for y in rows.clone() {
            if y + 1 < rows.end {
                self.send_row(grid, y, EVEN, &[Side::Left, Side::Right, Side::Down]);
                self.send_row(grid, y, ODD, &[Side::Down]);
            } else {
                self.send_row(grid, y, EVEN, &[Side::Left, Side::Right]);
            }
        }
    }

    /// Backward over rows, which also send `onward`.
    fn backward(&mut self, grid: usize, rows: Range<usize>, onward: Option<Side>) {
        let sides: Vec<_> = [Side::Left, Side::Right].into_iter().chain(onward).collect();
        for y in rows.rev() {
            self.send_row(grid, y, ODD, &sides);
            self.send_row(grid, y, EVEN, onward.as_slice());
        }
    }

    /// Sends the messages of the even or odd nodes of row y to `sides`. All are computed before any is sent.
    fn send_row(&mut self, grid: usize, y: usize, parity: usize, sides: &[Side]) {
        let width = self.plan.size(grid).width;
        let received = &self.grids[grid].received;
        let mut messages = Vec::new();
        for node in row_nodes(width, y, parity) {
            for &to in sides {
                messages.push((node, to, self.message(grid, node, &received[self.index(grid, node)], to)));
            }
        }
        for (node, to, message) in messages {
            if let Some(receiver) = self.plan.neighbour(grid, node, to) {
                self.drop_edge(grid, node, to);
                let receiver = self.index(grid, receiver);
                self.grids[grid].received[receiver][to.opposite() as usize] = message;
            }
        }
    }

    /// Sets both messages of the edge from `node` to that side to zeros.
    fn drop_edge(&mut self, grid: usize, node: Node, side: Side) {
        if let Some(other) = self.plan.neighbour(grid, node, side) {
            let [node, other] = [node, other].map(|node| self.index(grid, node));
            self.grids[grid].received[node][side as usize].fill(0);
            self.grids[grid].received[other][side.opposite() as usize].fill(0);
        }
    }

    /// The first message that a node holds from `side`, where it has a neighbour.
    pub(super) fn first_sweep_message(&self, grid: usize, node: Node, side: Side) -> Option<Vec<i64>> {
        if side == Side::Up || (side != Side::Down && !node.is_even()) {
            return None;
        }
        let Node { x, y } = node.parent();
        let (other_x, other_y) = (beside(x, node.x), beside(y, node.y));
        let at = |x: Option<usize>, y: Option<usize>| self.coarse_message(grid + 1, Node { x: x?, y: y? }, side);
        let between_rows = |x: Option<usize>| Some(nearer(at(x, Some(y))?, at(x, other_y)));
        let near = between_rows(Some(x))?;
        Some(if side == Side::Down { nearer(near, between_rows(other_x)) } else { near })
    }

    /// M(Q) of the definition, for all labels. `None` if there is no such node, or its row receives nothing from that side.
    fn coarse_message(&self, grid: usize, node: Node, side: Side) -> Option<Vec<i64>> {
        let size = self.plan.size(grid);
        if node.x >= size.width || node.y >= size.height {
            return None;
        }
        let received = |node| self.plan.neighbour(grid, node, side).map(|_| node);
        let receiver = match side {
            Side::Left | Side::Right if !node.is_even() => self.plan.neighbour(grid, node, side).and_then(received),
            Side::Left | Side::Right => received(node),
            Side::Up | Side::Down => Some(received(node)?),
        };
        let zeros = || vec![0; self.plan.model().labels()];
        Some(receiver.map_or_else(zeros, |node| {
            self.extended(grid, node, &self.grids[grid].received[self.index(grid, node)][side as usize])
        }))
    }

    /// Decides the labels of a grid one after another.
    pub(super) fn decide_labels(&mut self, grid: usize) {
        let (width, mut labels) = (self.plan.size(grid).width, std::mem::take(&mut self.grids[grid].decided));
        for rows in self.bands(grid) {
            let above = rows.start.saturating_sub(1) * width..rows.start * width;
            let decided = labels[above.clone()].to_vec();
            labels[above.clone()].copy_from_slice(&self.above_seams[above.clone()]);
            self.decide_rows(grid, rows, true, &mut labels);
            labels[above].copy_from_slice(&decided);
        }
        self.grids[grid].decided = labels;
    }

    /// Decides the labels of rows, which may have decided labels above them.
    fn decide_rows(&self, grid: usize, rows: Range<usize>, has_above: bool, labels: &mut [u16]) {
        for y in rows.clone() {
            for parity in [EVEN, ODD] {
                for node in row_nodes(self.plan.size(grid).width, y, parity) {
                    labels[self.index(grid, node)] = self.decide(grid, node, has_above || y > rows.start, labels);
                }
            }
        }
    }

    /// The smallest best label of a node, given the labels decided before.
    fn decide(&self, grid: usize, node: Node, has_above: bool, labels: &[u16]) -> u16 {
        let even = node.is_even();
        let messages: &[Side] = if even { &[Side::Left, Side::Right, Side::Down] } else { &[Side::Down] };
        let decided: &[Side] = if even { &[Side::Up] } else { &[Side::Up, Side::Left, Side::Right] };
        let index = self.index(grid, node);
        let sum = |d: &u16| {
            let mut sum = self.grids[grid].costs[index][usize::from(*d)];
            for &side in messages {
                sum += self.grids[grid].received[index][side as usize][usize::from(*d)];
            }
            for &side in decided.iter().filter(|&&side| has_above || side != Side::Up) {
                if let Some(other) = self.plan.neighbour(grid, node, side) {
                    let other = usize::from(labels[self.index(grid, other)]);
                    sum += self.smoothness(grid, node, side)(usize::from(*d), other);
                }
            }
            sum
        };
        (0..self.plan.model().labels() as u16).min_by_key(sum).unwrap_or(0)
    }
}

/// The coarse row or column beside a parent's, on the side where its child lies.
fn beside(parent: usize, child: usize) -> Option<usize> {
    if child.is_multiple_of(2) { parent.checked_sub(1) } else { Some(parent + 1) }
}

/// w(a, b) of the definition; a if there is no b.
fn nearer(a: Vec<i64>, b: Option<Vec<i64>>) -> Vec<i64> {
    let Some(b) = b else { return a };
    a.iter().zip(b).map(|(&a, b)| ((a + b + 1) / 2 + a + 1) / 2).collect()
}
