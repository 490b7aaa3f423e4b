//! The schedule `sweep`, which follows its definition sentence by sentence.

use std::ops::Range;

use bp_core::{BAND_ROWS, Node, Side};

use super::state::State;

const EVEN: usize = 0;
const ODD: usize = 1;

/// The even or odd nodes of row y.
fn row_nodes(width: usize, y: usize, parity: usize) -> impl Iterator<Item = Node> {
    (0..width).filter(move |x| (x + y) % 2 == parity).map(move |x| Node { x, y })
}

impl State {
    /// One loop of [`bp_core::Schedule::Sweep`].
    pub(super) fn sweep(&mut self, grid: usize) {
        for rows in self.bands(grid) {
            self.sweep_band(grid, rows);
        }
    }

    /// The rows of all bands.
    fn bands(&self, grid: usize) -> Vec<Range<usize>> {
        let height = self.plan.size(grid).height;
        (0..height.div_ceil(BAND_ROWS)).map(|b| BAND_ROWS * b..height.min(BAND_ROWS * b + BAND_ROWS)).collect()
    }

    fn sweep_band(&mut self, grid: usize, rows: Range<usize>) {
        let (first, last) = (rows.start, rows.end - 1);
        for y in rows.clone() {
            if y < last {
                self.send_row(grid, y, EVEN, &[Side::Left, Side::Right, Side::Down]);
                self.send_row(grid, y, ODD, &[Side::Down]);
            } else {
                self.send_row(grid, y, EVEN, &[Side::Left, Side::Right]);
            }
        }
        for y in rows.rev() {
            if y > first {
                self.send_row(grid, y, ODD, &[Side::Left, Side::Right, Side::Up]);
                self.send_row(grid, y, EVEN, &[Side::Up]);
            } else {
                self.send_row(grid, y, ODD, &[Side::Left, Side::Right]);
            }
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

    /// The first message that a node holds from `side`, if it has a neighbour there.
    pub(super) fn first_sweep_message(&self, grid: usize, node: Node, side: Side) -> Option<Vec<i64>> {
        let parent = node.parent();
        let coarse = self.plan.size(grid + 1);
        let receiver_x = match side {
            Side::Up => return None,
            Side::Down => parent.x,
            Side::Left | Side::Right if !node.is_even() => return None,
            Side::Left | Side::Right if parent.is_even() => parent.x,
            Side::Left => parent.x.checked_sub(1)?,
            Side::Right => Some(parent.x + 1).filter(|&x| x < coarse.width)?,
        };
        let receiver = self.index(grid + 1, Node { x: receiver_x, y: parent.y });
        Some(self.grids[grid + 1].received[receiver][side as usize].clone())
    }

    /// Selects labels one after another.
    pub(super) fn decode(&self, labels: &mut [u16]) {
        let width = self.plan.image_size().width;
        for rows in self.bands(0) {
            for y in rows.clone() {
                for parity in [EVEN, ODD] {
                    for node in row_nodes(width, y, parity) {
                        labels[self.index(0, node)] = self.decide(node, y == rows.start, labels);
                    }
                }
            }
        }
    }

    /// The smallest best label of a node, given the labels decided before.
    fn decide(&self, node: Node, first_row: bool, labels: &[u16]) -> u16 {
        let even = node.is_even();
        let messages: &[Side] = if even { &[Side::Left, Side::Right, Side::Down] } else { &[Side::Down] };
        let decided: &[Side] = if even { &[Side::Up] } else { &[Side::Up, Side::Left, Side::Right] };
        let index = self.index(0, node);
        let sum = |d: &u16| {
            let mut sum = self.grids[0].costs[index][usize::from(*d)];
            for &side in messages {
                sum += self.grids[0].received[index][side as usize][usize::from(*d)];
            }
            for &side in decided.iter().filter(|&&side| !(first_row && side == Side::Up)) {
                if let Some(other) = self.plan.neighbour(0, node, side) {
                    let other = usize::from(labels[self.index(0, other)]);
                    sum += self.smoothness(0, node, side)(usize::from(*d), other);
                }
            }
            sum
        };
        (0..self.plan.model().labels() as u16).min_by_key(sum).unwrap_or(0)
    }
}
