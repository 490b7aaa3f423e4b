//! Pairs of noise.

use bp_core::{Image, StereoPair};

/// A pair of coloured noise, the same for the same arguments. Blocks of 4x4 pixels are shifted by 0, 1 or 2, so that
/// children of a coarse node disagree strongly; every fifth pixel matches nothing.
///
/// # Panics
/// If no image can have this size.
#[must_use]
pub fn noise_pair(width: usize, height: usize, seed: u64) -> StereoPair {
    shifted(width, height, seed, |x, y| (x / 4 + y / 4) % 3)
}

/// A pair of coloured noise with surfaces far apart: blocks of 48x24 pixels are shifted by a multiple of 7 below
/// `labels`, so that most of them make the labels of others impossible.
///
/// # Panics
/// If no image can have this size.
#[must_use]
pub fn stepped_pair(width: usize, height: usize, labels: usize) -> StereoPair {
    shifted(width, height, labels as u64, |x, y| (7 * (x / 48 + 3 * (y / 24))) % labels)
}

fn shifted(width: usize, height: usize, seed: u64, shift: impl Fn(usize, usize) -> usize) -> StereoPair {
    let hash = |i: u64| {
        let mut z = (seed << 32 ^ i).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z ^ (z >> 27)
    };
    let view = |right: bool| {
        let pixel = |i: usize| {
            let shift = if right { shift(i % width, i / width) } else { 0 };
            let unmatched = right && i.is_multiple_of(5);
            let [r, g, b, ..] = hash(if unmatched { !(i as u64) } else { (i + shift) as u64 }).to_le_bytes();
            [r, g, b]
        };
        Image::from_rgb(width, height, (0..width * height).map(pixel).collect())
    };
    let pair = view(false).and_then(|left| StereoPair::new(left, view(true)?));
    pair.unwrap_or_else(|error| panic!("{error}"))
}
