//! Which of the pixels that match the same column of the right image is the best one.

use fearless_simd::{Select, Simd, SimdBase, SimdCvtTruncate, SimdFloat, f32x8, i32x8};

use super::{check::AGREE, variances::LANES};
use crate::{DisparityMap, Error, memory::Buffer};

/// A nearer pixel hides a farther one with the same match, unless its variance is more than this many times as large.
pub(super) const LIKELIER: f32 = 2.0;

/// The best of the pixels that match a column of the right image: its variance and its disparity.
type Claim = (f32, f32);

/// The columns that the pixels of a row match.
pub(super) struct Claims {
    /// See [`write_matches`]; by column of the left image.
    matches: Buffer<i32>,
    /// By column of the right image, and one for all pixels without a match.
    best: Buffer<Claim>,
}

impl Claims {
    pub(super) fn new(width: usize) -> Result<Self, Error> {
        Ok(Self {
            matches: Buffer::filled("matching columns", width.next_multiple_of(LANES), 0)?,
            best: Buffer::filled("matched columns", width + 1, (0.0, 0.0))?,
        })
    }

    /// The bytes that they take for rows of this width.
    pub(super) fn bytes(width: usize) -> u64 {
        (width.next_multiple_of(LANES) * size_of::<i32>() + (width + 1) * size_of::<Claim>()) as u64
    }

    /// Makes the pixels of a row unknown that do not agree with the best one of those with their match, and pixels whose match lies
    /// outside the image. `variances` are those of grey differences around each pixel.
    #[inline(always)]
    pub(super) fn drop_hidden<S: Simd>(&mut self, simd: S, variances: &[f32], disparities: &mut [f32]) {
        simd.vectorize(
            #[inline(always)]
            || {
                write_matches(simd, disparities, &mut self.matches);
                let (matches, best) = (&self.matches[..disparities.len()], &mut self.best[..]);
                best.fill((f32::INFINITY, DisparityMap::UNKNOWN));
                // A nearer pixel comes later: its disparity is larger, so it lies farther right. There are no branches, because
                // which pixel is better can hardly be predicted.
                for ((&variance, &disparity), &column) in variances.iter().zip(&*disparities).zip(matches) {
                    let held = &mut best[column as usize];
                    let is_better = variance <= LIKELIER * held.0;
                    held.0 = if is_better { variance } else { held.0 };
                    held.1 = if is_better { disparity } else { held.1 };
                }
                best[disparities.len()].1 = DisparityMap::UNKNOWN;
                for (disparity, &column) in disparities.iter_mut().zip(matches) {
                    let agrees = (best[column as usize].1 - *disparity).abs() <= AGREE;
                    *disparity = if agrees { *disparity } else { DisparityMap::UNKNOWN };
                }
            },
        );
    }
}

/// Writes the columns that the pixels of a row match in the right image, or the width where that lies outside. `matches` has columns up
/// to a multiple of [`LANES`].
#[inline(always)]
pub(super) fn write_matches<S: Simd>(simd: S, disparities: &[f32], matches: &mut [i32]) {
    let (matches, _) = matches.as_chunks_mut::<LANES>();
    let columns = f32x8::from_fn(simd, |lane| lane as f32 + 0.5);
    let [none, outside] = [0.0, disparities.len() as f32].map(|value| f32x8::splat(simd, value));
    for (x, (matches, disparities)) in (0..).step_by(LANES).zip(matches.iter_mut().zip(disparities.chunks(LANES))) {
        let column = (columns + x as f32 - lanes(simd, disparities)).floor();
        // Unknown disparities are infinite.
        let inside = column.simd_ge(none).select(column, outside).min(outside);
        *matches = i32x8::truncate_from(inside).into();
    }
}

/// At most [`LANES`] values, and zeros where there are fewer.
#[inline(always)]
fn lanes<S: Simd>(simd: S, values: &[f32]) -> f32x8<S> {
    match values.first_chunk() {
        Some(values) => f32x8::load_array(simd, *values),
        None => f32x8::from_fn(simd, |lane| values.get(lane).copied().unwrap_or(0.0)),
    }
}
