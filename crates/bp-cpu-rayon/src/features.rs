//! Features: the few bytes of each pixel that a profile compares.

use bp_core::{
    Error, Image, Node, Plan, Profile, Size, StereoPair,
    census::{INNER, Neighbours, OUTER},
    image::APRON,
    memory::{self, Buffer},
};
use fearless_simd::{Level, Select, Simd, SimdBase, dispatch};
use rayon::prelude::*;

use crate::shape::{MIN_ROWS, Piece, WIDEST, deal};

/// Bytes behind the last neighbours' values: whole pieces of them are read.
const BEHIND: usize = size_of::<Piece>();

/// The features of both images of a pair, `[height][channel][parity][lane]`. The parity is that of the column.
pub(crate) struct Features {
    profile: Profile,
    lanes: usize,
    left: Buffer<u8>,
    /// Every row of lanes has [`WIDEST`] lanes of padding on both sides.
    right: Buffer<u8>,
    /// 255 where the right image has a column, otherwise 0: `[parity][lane]`, with the same padding as `right`.
    inside: [Vec<u8>; 2],
    /// Values of both images and around them (see [`Image::grey_near`]), `[height][plane][width]` with [`APRON`] more rows
    /// and columns on every side. Only profiles that compare neighbours need them; see [`padded_planes`].
    padded: [Buffer<u8>; 2],
}

impl Features {
    /// Allocates room for the pairs of a plan.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let (size, profile, lanes) = (plan.pair_size(), plan.model().profile(), lanes(plan));
        let rows = 2 * profile.channels() * size.height;
        let padded = || Buffer::filled("neighbours' values", padded_bytes(size, profile), 0);
        let inside = |parity: usize| {
            let nodes = (size.width + 1 - parity) / 2;
            let lane = |lane: usize| if (WIDEST..WIDEST + nodes).contains(&lane) { u8::MAX } else { 0 };
            (0..lanes + 2 * WIDEST).map(lane).collect()
        };
        Ok(Self {
            profile,
            lanes,
            left: Buffer::filled("images", rows * lanes, 0)?,
            right: Buffer::filled("images", rows * (lanes + 2 * WIDEST), 0)?,
            inside: [inside(0), inside(1)],
            padded: [padded()?, padded()?],
        })
    }

    /// Loads a pair.
    pub(crate) fn load(&mut self, level: Level, pair: &StereoPair) {
        let Self { profile, lanes, left, right, padded, .. } = self;
        let [left_padded, right_padded] = padded;
        let right = Rows { values: right, lanes: *lanes + 2 * WIDEST, offset: WIDEST };
        let left = Rows { values: left, lanes: *lanes, offset: 0 };
        rayon::join(
            || load_image(level, *profile, pair.left(), left_padded, left),
            || load_image(level, *profile, pair.right(), right_padded, right),
        );
    }

    /// The features of a row of the left image, `[lane]`.
    pub(crate) fn left(&self, y: usize, channel: usize, parity: usize) -> &[u8] {
        &self.left[((y * self.profile.channels() + channel) * 2 + parity) * self.lanes..][..self.lanes]
    }

    /// The features of a row of the right image, starting [`WIDEST`] lanes before lane 0.
    pub(crate) fn right(&self, y: usize, channel: usize, parity: usize) -> &[u8] {
        let lanes = self.lanes + 2 * WIDEST;
        &self.right[((y * self.profile.channels() + channel) * 2 + parity) * lanes..][..lanes]
    }

    /// 255 where [`Features::right`] has a pixel.
    pub(crate) fn inside(&self, parity: usize) -> &[u8] {
        &self.inside[parity]
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let buffers = [&self.left, &self.right].into_iter().chain(&self.padded).map(Buffer::bytes);
        buffers.chain(self.inside.iter().map(memory::bytes)).sum()
    }
}

/// Writes the features of an image.
fn load_image(level: Level, profile: Profile, image: &Image, padded: &mut [u8], out: Rows<'_>) {
    let end = padded.len().saturating_sub(BEHIND);
    let rows = padded[..end].par_chunks_mut(image.size().width + 2 * APRON).with_min_len(MIN_ROWS).enumerate();
    rows.for_each(|(index, row)| dispatch!(level, simd => pad_row(simd, profile, image, index, row)));
    let Rows { values, lanes, offset } = out;
    let rows = values.par_chunks_mut(2 * lanes * profile.channels()).with_min_len(MIN_ROWS).enumerate();
    let view = View { profile, image, padded, lanes, offset };
    rows.for_each(|(y, rows)| dispatch!(level, simd => view.fill(simd, y, rows)));
}

/// The lanes of a row. Behind a margin, the first node may lie anywhere, and vectors still end inside the row.
fn lanes(plan: &Plan) -> usize {
    let lanes = plan.pair_size().width.div_ceil(2).next_multiple_of(WIDEST);
    lanes + if plan.margin() > 0 { WIDEST } else { 0 }
}

/// The bytes that [`Features`] will hold.
pub(crate) fn bytes(plan: &Plan) -> u64 {
    let (size, lanes, profile) = (plan.pair_size(), lanes(plan), plan.model().profile());
    let rows = 2 * profile.channels() * size.height;
    (rows * (2 * lanes + 2 * WIDEST) + 2 * (lanes + 2 * WIDEST) + 2 * padded_bytes(size, profile)) as u64
}

fn padded_bytes(size: Size, profile: Profile) -> usize {
    let planes = padded_planes(profile);
    planes * (size.height + 2 * APRON) * (size.width + 2 * APRON) + if planes > 0 { BEHIND } else { 0 }
}

/// The number of planes in which a profile compares neighbours: one of grey values, or one per colour channel and one of grey values.
fn padded_planes(profile: Profile) -> usize {
    match profile {
        Profile::Thesis | Profile::Mrf => 0,
        Profile::Census | Profile::Gradient | Profile::BirchfieldTomasi | Profile::Census16 => 1,
        Profile::Census32 => 4,
    }
}

/// Fills the given row of [`Features::padded`].
#[inline(always)]
fn pad_row<S: Simd>(simd: S, profile: Profile, image: &Image, index: usize, row: &mut [u8]) {
    let width = image.size().width;
    let (y, plane) = (index / padded_planes(profile), index % padded_planes(profile));
    let y = y as isize - APRON as isize;
    let (before, rest) = row.split_at_mut(APRON);
    let (own, after) = rest.split_at_mut(width);
    match image.colours_near(y).filter(|_| profile == Profile::Census32 && plane < 3) {
        Some(colours) => simd.vectorize(
            #[inline(always)]
            || own.iter_mut().zip(colours).for_each(|(out, pixel)| *out = pixel[plane]),
        ),
        None => own.copy_from_slice(image.greys_near(y)),
    }
    before.fill(own[0]);
    after.fill(own[width - 1]);
}

/// Rows of features to be written.
struct Rows<'a> {
    values: &'a mut [u8],
    /// The distance from one row of lanes to the next.
    lanes: usize,
    /// The position of lane 0 in a row of lanes.
    offset: usize,
}

/// An image whose features are being computed.
struct View<'a> {
    profile: Profile,
    image: &'a Image,
    /// See [`Features::padded`].
    padded: &'a [u8],
    /// See [`Rows::lanes`].
    lanes: usize,
    /// See [`Rows::offset`].
    offset: usize,
}

impl View<'_> {
    /// Writes the features of row `y`.
    #[inline(always)]
    fn fill<S: Simd>(&self, simd: S, y: usize, rows: &mut [u8]) {
        let (lanes, offset) = (self.lanes, self.offset);
        let width = self.image.size().width;
        for (channel, out) in rows.chunks_exact_mut(2 * lanes).enumerate() {
            let (even, odd) = out.split_at_mut(lanes);
            let (even, odd) = (&mut even[offset..][..width.div_ceil(2)], &mut odd[offset..][..width / 2]);
            simd.vectorize(
                #[inline(always)]
                || {
                    deal(
                        simd,
                        even,
                        odd,
                        #[inline(always)]
                        |x, columns, out| self.piece(simd, channel, Node { x, y }, columns, out),
                    );
                },
            );
        }
    }

    /// Computes the features of so many pixels from `at` on.
    #[inline(always)]
    fn piece<S: Simd>(&self, simd: S, channel: usize, at: Node, columns: usize, out: &mut Piece) {
        let (plain, first) = (&mut out[..columns], at.y * self.image.size().width + at.x);
        match self.profile {
            Profile::Thesis | Profile::Mrf => match self.image.colours().filter(|_| self.profile == Profile::Mrf) {
                Some(colours) => plain.iter_mut().zip(&colours[first..]).for_each(|(out, pixel)| *out = pixel[channel]),
                None => plain.copy_from_slice(&self.image.greys()[first..][..columns]),
            },
            Profile::Gradient => self.gradient(channel, at, plain),
            Profile::BirchfieldTomasi => self.half_samples(channel, at, plain),
            Profile::Census => self.census(simd, &INNER, 0, at, out),
            Profile::Census16 => self.census(simd, [&INNER, &OUTER][channel], 0, at, out),
            Profile::Census32 => {
                self.census(simd, [&INNER, &INNER, &INNER, &OUTER][channel], channel, at, out);
            }
        }
    }

    /// The values of a plane `dx` columns and `dy` rows away from consecutive pixels, starting at `at`.
    #[inline(always)]
    fn near(&self, plane: usize, at: Node, (dx, dy): (isize, isize), columns: usize) -> &[u8] {
        let width = self.image.size().width + 2 * APRON;
        let [column, row] = [(at.x, dx), (at.y, dy)].map(|(at, by)| (at + APRON).wrapping_add_signed(by));
        &self.padded[(row * padded_planes(self.profile) + plane) * width + column..][..columns]
    }

    /// Computes a byte of the census codes of pixels from `at` on, from the values of a plane; see [`bp_core::census`]. Behind the
    /// end of a row, it is computed from what happens to follow.
    #[inline(always)]
    fn census<S: Simd>(&self, simd: S, neighbours: &Neighbours, plane: usize, at: Node, codes: &mut Piece) {
        let middle = self.near(plane, at, (0, 0), codes.len());
        let near = neighbours.map(|offset| self.near(plane, at, offset, codes.len()));
        let [none, one] = [0, 1].map(|bit| S::u8s::splat(simd, bit));
        for (x, codes) in (0..).step_by(S::u8s::LEN).zip(codes.chunks_exact_mut(S::u8s::LEN)) {
            let load = |values: &[u8]| S::u8s::from_slice(simd, &values[x..x + S::u8s::LEN]);
            let (middle, mut code) = (load(middle), none);
            for near in near {
                code = (code + code) | load(near).simd_gt(middle).select(one, none);
            }
            code.store_slice(codes);
        }
    }

    /// The features of [`Profile::Gradient`]: the grey value, then the gradient.
    #[inline(always)]
    fn gradient(&self, channel: usize, at: Node, out: &mut [u8]) {
        let [before, middle, after] = self.row_near(at, out.len());
        if channel == 0 {
            out.copy_from_slice(middle);
            return;
        }
        for ((out, &before), &after) in out.iter_mut().zip(before).zip(after) {
            // The same as (256 + after - before) div 2.
            *out = mean(after, !before);
        }
    }

    /// The features of [`Profile::BirchfieldTomasi`]: the grey value, then the least and the greatest around it.
    #[inline(always)]
    fn half_samples(&self, channel: usize, at: Node, out: &mut [u8]) {
        let [before, middle, after] = self.row_near(at, out.len());
        for (((out, &before), &middle), &after) in out.iter_mut().zip(before).zip(middle).zip(after) {
            let (left, right) = (mean(before, middle), mean(middle, after));
            *out = match channel {
                0 => middle,
                1 => middle.min(left).min(right),
                _ => middle.max(left).max(right),
            };
        }
    }

    /// The grey values for pixels from `at` on: of their left neighbours, of the pixels, and of their right neighbours.
    #[inline(always)]
    fn row_near(&self, at: Node, columns: usize) -> [&[u8]; 3] {
        [-1, 0, 1].map(|dx| self.near(0, at, (dx, 0), columns))
    }
}

/// Half the sum, rounded up.
#[inline(always)]
fn mean(a: u8, b: u8) -> u8 {
    (u16::from(a) + u16::from(b)).div_ceil(2) as u8
}
