//! The schedule `sweep`, sentence by sentence as its definition reads.

use std::ops::Range;

use bp_core::{BAND_ROWS, Side};

use super::state::State;

const EVEN: usize = 0;
const ODD: usize = 1;

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

    /// The even or odd nodes of row y send to `sides`, all messages computed before any is sent.
    fn send_row(&mut self, grid: usize, y: usize, parity: usize, sides: &[Side]) {
        let width = self.plan.size(grid).width;
        let received = &self.grids[grid].received;
        let mut messages = Vec::new();
        for x in (0..width).filter(|x| (x + y) % 2 == parity) {
            for &to in sides {
                messages.push((x, to, self.message(grid, (x, y), &received[y * width + x], to)));
            }
        }
        for (x, to, message) in messages {
            if let Some((to_x, to_y)) = self.plan.neighbour(grid, (x, y), to) {
                self.drop_edge(grid, (x, y), to);
                self.grids[grid].received[to_y * width + to_x][to.opposite() as usize] = message;
            }
        }
    }

    /// Sets what the edge from (x, y) to that side holds, whichever way it went, to zeros.
    fn drop_edge(&mut self, grid: usize, (x, y): (usize, usize), side: Side) {
        let width = self.plan.size(grid).width;
        if let Some((other_x, other_y)) = self.plan.neighbour(grid, (x, y), side) {
            self.grids[grid].received[y * width + x][side as usize].fill(0);
            self.grids[grid].received[other_y * width + other_x][side.opposite() as usize].fill(0);
        }
    }

    /// The first message that the node at (x, y) holds from `side`, where it has a neighbour.
    pub(super) fn first_sweep_message(&self, grid: usize, (x, y): (usize, usize), side: Side) -> Option<Vec<i64>> {
        let (parent_x, parent_y) = (x / 2, y / 2);
        let even_parent = (parent_x + parent_y).is_multiple_of(2);
        let coarse = self.plan.size(grid + 1);
        let receiver_x = match side {
            Side::Up => return None,
            Side::Down => parent_x,
            Side::Left | Side::Right if !(x + y).is_multiple_of(2) => return None,
            Side::Left | Side::Right if even_parent => parent_x,
            Side::Left => parent_x.checked_sub(1)?,
            Side::Right => Some(parent_x + 1).filter(|&x| x < coarse.width)?,
        };
        Some(self.grids[grid + 1].received[parent_y * coarse.width + receiver_x][side as usize].clone())
    }

    /// Decides labels one after another.
    pub(super) fn decode(&self, labels: &mut [u16]) {
        let width = self.plan.image_size().width;
        for rows in self.bands(0) {
            for y in rows.clone() {
                for parity in [EVEN, ODD] {
                    for x in (0..width).filter(|x| (x + y) % 2 == parity) {
                        labels[y * width + x] = self.decide((x, y), y == rows.start, labels);
                    }
                }
            }
        }
    }

    /// The smallest best label of (x, y), given those decided before.
    fn decide(&self, (x, y): (usize, usize), first_row: bool, labels: &[u16]) -> u16 {
        let even = (x + y).is_multiple_of(2);
        let messages: &[Side] = if even { &[Side::Left, Side::Right, Side::Down] } else { &[Side::Down] };
        let decided: &[Side] = if even { &[Side::Up] } else { &[Side::Up, Side::Left, Side::Right] };
        let width = self.plan.image_size().width;
        let node = y * width + x;
        let sum = |d: &u16| {
            let mut sum = self.grids[0].costs[node][usize::from(*d)];
            for &side in messages {
                sum += self.grids[0].received[node][side as usize][usize::from(*d)];
            }
            for &side in decided.iter().filter(|&&side| !(first_row && side == Side::Up)) {
                if let Some((other_x, other_y)) = self.plan.neighbour(0, (x, y), side) {
                    let other = usize::from(labels[other_y * width + other_x]);
                    sum += self.smoothness(0, (x, y), side)(usize::from(*d), other);
                }
            }
            sum
        };
        (0..self.plan.model().labels() as u16).min_by_key(sum).unwrap_or(0)
    }
}
