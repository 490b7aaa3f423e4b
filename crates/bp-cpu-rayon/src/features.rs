//! What a profile compares: a few bytes a pixel of each image.

use bp_core::{Error, Image, Model, Profile, Size, StereoPair, memory};
use rayon::prelude::*;

use crate::layout::{self, BLOCK};

/// Features of both images of a pair, by row, channel and column parity: `[height][channel][parity][lane]`.
pub(crate) struct Features {
    profile: Profile,
    size: Size,
    lanes: usize,
    left: Vec<u8>,
    /// With a block of padding on both sides of every row of lanes.
    right: Vec<u8>,
    /// 255 where the right image has a column, else 0: `[parity][lane]`, padded alike.
    inside: [Vec<u8>; 2],
    /// Grey values of both images with their border pixels repeated outward, `[height][width + 2]`; for `census` only.
    grey: [Vec<u8>; 2],
}

impl Features {
    /// Room for pairs of `size`.
    pub(crate) fn new(size: Size, model: &Model) -> Result<Self, Error> {
        let profile = model.profile();
        let lanes = layout::lanes(size);
        let rows = 2 * channels(profile) * size.height;
        let grey = || memory::filled("grey values", grey_bytes(size, profile), 0);
        let inside = |parity: usize| {
            let nodes = (size.width + 1 - parity) / 2;
            let lane = |lane: usize| if (BLOCK..BLOCK + nodes).contains(&lane) { u8::MAX } else { 0 };
            (0..lanes + 2 * BLOCK).map(lane).collect()
        };
        Ok(Self {
            profile,
            size,
            lanes,
            left: memory::filled("images", rows * lanes, 0)?,
            right: memory::filled("images", rows * (lanes + 2 * BLOCK), 0)?,
            inside: [inside(0), inside(1)],
            grey: [grey()?, grey()?],
        })
    }

    /// Takes in another pair.
    pub(crate) fn load(&mut self, pair: &StereoPair) {
        let Self { profile, size, lanes, left, right, grey, .. } = self;
        for (image, grey) in [pair.left(), pair.right()].into_iter().zip(grey.iter_mut()) {
            let rows = grey.par_chunks_mut(size.width + 2);
            rows.with_min_len(MIN_ROWS).enumerate().for_each(|(y, row)| grey_row(image, y, row));
        }
        let [left_grey, right_grey] = grey;
        fill(*profile, pair.left(), left_grey, left, (*lanes, 0));
        fill(*profile, pair.right(), right_grey, right, (*lanes + 2 * BLOCK, BLOCK));
    }

    /// Features of the left pixels of a row, `[lane]`.
    pub(crate) fn left(&self, y: usize, channel: usize, parity: usize) -> &[u8] {
        &self.left[((y * channels(self.profile) + channel) * 2 + parity) * self.lanes..][..self.lanes]
    }

    /// Features of the right pixels of a row, from one block before lane 0 on.
    pub(crate) fn right(&self, y: usize, channel: usize, parity: usize) -> &[u8] {
        let lanes = self.lanes + 2 * BLOCK;
        &self.right[((y * channels(self.profile) + channel) * 2 + parity) * lanes..][..lanes]
    }

    /// 255 where [`Features::right`] has a pixel.
    pub(crate) fn inside(&self, parity: usize) -> &[u8] {
        &self.inside[parity]
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        [&self.left, &self.right].into_iter().chain(&self.inside).chain(&self.grey).map(memory::bytes).sum()
    }
}

/// Fewest rows that are worth handing to another thread.
const MIN_ROWS: usize = 32;

/// Bytes that [`Features`] hold, predicted.
pub(crate) fn bytes(size: Size, model: &Model) -> u64 {
    let (lanes, profile) = (layout::lanes(size), model.profile());
    let rows = 2 * channels(profile) * size.height;
    (rows * (2 * lanes + 2 * BLOCK) + 2 * (lanes + 2 * BLOCK) + 2 * grey_bytes(size, profile)) as u64
}

/// Bytes a pixel.
fn channels(profile: Profile) -> usize {
    if profile == Profile::Mrf { 3 } else { 1 }
}

fn grey_bytes(size: Size, profile: Profile) -> usize {
    if profile == Profile::Census { size.height * (size.width + 2) } else { 0 }
}

fn grey_row(image: &Image, y: usize, row: &mut [u8]) {
    let width = image.size().width;
    for (x, grey) in row[1..=width].iter_mut().enumerate() {
        *grey = image.grey(x, y);
    }
    row[0] = row[1];
    row[width + 1] = row[width];
}

/// Writes the features of an image; lane 0 lies `offset` entries after the start of each row of `lanes`.
fn fill(profile: Profile, image: &Image, grey: &[u8], out: &mut [u8], (lanes, offset): (usize, usize)) {
    let width = image.size().width;
    let rows = out.par_chunks_mut(2 * lanes * channels(profile)).with_min_len(MIN_ROWS).enumerate();
    rows.for_each(|(y, rows)| {
        let mut channels = rows.chunks_exact_mut(2 * lanes);
        match profile {
            Profile::Thesis => channels.for_each(|out| split(out, offset, (0..width).map(|x| image.grey(x, y)))),
            Profile::Census => channels.for_each(|out| census_row(grey, (width, image.size().height), y, out, offset)),
            Profile::Mrf => {
                let pixels = &image.pixels()[y * width..][..width];
                for channel in 0..3 {
                    let Some(out) = channels.next() else { return };
                    split(out, offset, pixels.iter().map(|pixel| pixel[channel]));
                }
            }
        }
    });
}

/// Deals the values of a row to the two parities of columns.
fn split(out: &mut [u8], offset: usize, values: impl Iterator<Item = u8>) {
    let (even, odd) = out.split_at_mut(out.len() / 2);
    for (x, value) in values.enumerate() {
        let plane = if x.is_multiple_of(2) { &mut *even } else { &mut *odd };
        plane[offset + x / 2] = value;
    }
}

/// The census codes of a row, as [`bp_core::census::code`] gives them.
fn census_row(grey: &[u8], (width, height): (usize, usize), y: usize, out: &mut [u8], offset: usize) {
    let row = |y: usize| &grey[y * (width + 2)..][..width + 2];
    let [above, centre, below] = [row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1))];
    let (even, odd) = out.split_at_mut(out.len() / 2);
    for (parity, plane) in [even, odd].into_iter().enumerate() {
        let nodes = (width + 1 - parity) / 2;
        let at = |row: &[u8], lane: usize, dx: usize| row[2 * lane + parity + dx];
        for (lane, code) in plane[offset..offset + nodes].iter_mut().enumerate() {
            let middle = at(centre, lane, 1);
            let neighbours =
                [(above, 0), (above, 1), (above, 2), (centre, 0), (centre, 2), (below, 0), (below, 1), (below, 2)];
            *code = neighbours.iter().fold(0, |code, &(row, dx)| code << 1 | u8::from(at(row, lane, dx) > middle));
        }
    }
}
