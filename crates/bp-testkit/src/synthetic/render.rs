//! Renders surfaces to two photographs and their ground truth.

use bp_core::Size;

use super::surface::{Hit, Surface, View};
use super::texture::uniform;
use std::ops::RangeInclusive;
use std::ptr;

/// The number of places probed on the way to the light.
const SHADOW_STEPS: u32 = 3;

/// The scene in front of the cameras. Of the surfaces on a line of sight, the nearest is seen.
pub(super) struct World {
    pub(super) backdrop: Surface,
    pub(super) objects: Vec<Surface>,
}

/// An exposure: how a camera turns radiance into pixel values.
#[derive(Clone, Copy)]
pub(super) struct Exposure {
    pub(super) gain: f64,
    /// In grey levels.
    pub(super) offset: f64,
    /// Standard deviation of the sensor's noise in grey levels.
    pub(super) noise: f64,
    pub(super) seed: u32,
}

/// Colours `[height][width]` of [RGB] in grey levels, not yet rounded.
struct Radiance {
    width: usize,
    height: usize,
    colours: Vec<[f64; 3]>,
}

impl World {
    /// The place that a camera sees at (x, y) of its image.
    pub(super) fn look(&self, view: View, x: f64, y: f64) -> Hit<'_> {
        let hits = self.objects.iter().filter_map(|object| object.seen_at(view, x, y));
        let behind = self.backdrop.met_at(view, x, y);
        hits.fold(behind, |best, hit| if hit.disparity > best.disparity { hit } else { best })
    }

    /// Whether the right camera sees, within `columns` of its image, the same point that the left one sees at (x, y).
    pub(super) fn is_shared(&self, x: f64, y: f64, columns: &RangeInclusive<f64>) -> bool {
        let seen = self.look(View::Left, x, y);
        let right_x = x - seen.disparity;
        columns.contains(&right_x) && ptr::eq(self.look(View::Right, right_x, y).surface, seen.surface)
    }

    /// The image of one camera before exposure, `[height][width]`, from `divisor` squared samples per pixel.
    pub(super) fn photograph(&self, view: View, size: Size, divisor: usize) -> Vec<[f64; 3]> {
        let sharp = Radiance::from_fn(size.width * divisor, size.height * divisor, |x, y| {
            let (x, y) = (x as f64, y as f64);
            let hit = self.look(view, x, y);
            let light = self.light(hit, y);
            hit.surface.colour(hit.x, y).map(|channel| channel * light)
        });
        sharp.blurred().shrunk(divisor).colours
    }

    /// The light on a surface: from the upper left and from the front.
    fn light(&self, hit: Hit<'_>, y: f64) -> f64 {
        let gain = |dx: f64, dy: f64| hit.surface.disparity(hit.x + dx, y + dy) - hit.disparity;
        let facing = gain(1.0, 0.0) + gain(0.0, 1.0);
        let blocked = (1..=SHADOW_STEPS).filter(|&step| self.blocks(hit, y, f64::from(step))).count();
        (1.0 + 0.7 * facing).clamp(0.4, 1.5) * (1.0 - 0.1 * blocked as f64)
    }

    /// Whether an object blocks the light `step` steps from a surface. Objects far in front of the surface do not
    /// count, since their shadows fall elsewhere.
    fn blocks(&self, hit: Hit<'_>, y: f64, step: f64) -> bool {
        let ray = hit.disparity + 2.0 * step;
        let (x, y) = (hit.x - 4.0 * step, y - 5.0 * step);
        let mut hits = self.objects.iter().filter_map(|object| object.seen_at(View::Left, x, y));
        hits.any(|over| !ptr::eq(over.surface, hit.surface) && (1.0..16.0).contains(&(over.disparity - ray)))
    }
}

impl Radiance {
    fn from_fn(width: usize, height: usize, colour: impl Fn(usize, usize) -> [f64; 3]) -> Self {
        let colours = (0..width * height).map(|i| colour(i % width, i / width)).collect();
        Self { width, height, colours }
    }

    /// The effect of a lens: each pixel is mixed with its neighbours, so that edges are not sharper than a camera's.
    fn blurred(&self) -> Self {
        let tent = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| [0, 1, 2].map(|i| 0.25 * (a[i] + c[i]) + 0.5 * b[i]);
        let (w, h) = (self.width, self.height);
        let rows = Self::from_fn(w, h, |x, y| {
            let row = &self.colours[y * w..(y + 1) * w];
            tent(row[x.saturating_sub(1)], row[x], row[(x + 1).min(w - 1)])
        });
        Self::from_fn(w, h, |x, y| {
            let at = |y: usize| rows.colours[y * w + x];
            tent(at(y.saturating_sub(1)), at(y), at((y + 1).min(h - 1)))
        })
    }

    /// The mean of each `divisor` by `divisor` block.
    fn shrunk(&self, divisor: usize) -> Self {
        Self::from_fn(self.width / divisor, self.height / divisor, |x, y| {
            let mut sum = [0.0; 3];
            for i in 0..divisor * divisor {
                let (column, row) = (x * divisor + i % divisor, y * divisor + i / divisor);
                let colour = self.colours[row * self.width + column];
                sum = [0, 1, 2].map(|c| sum[c] + colour[c]);
            }
            sum.map(|channel| channel / (divisor * divisor) as f64)
        })
    }
}

impl Exposure {
    /// The 8-bit image of radiances `[height][width]`.
    pub(super) fn develop(self, radiances: &[[f64; 3]]) -> Vec<[u8; 3]> {
        let pixel = |(i, colour): (usize, &[f64; 3])| {
            std::array::from_fn(|c| {
                let value = self.gain * colour[c] + self.offset + self.noise * gaussian(self.seed, i as i32, c as i32);
                (value + 0.5).floor().clamp(0.0, 255.0) as u8
            })
        };
        radiances.iter().enumerate().map(pixel).collect()
    }
}

/// A nearly Gaussian number of standard deviation 1: the sum of four uniform ones.
fn gaussian(seed: u32, pixel: i32, channel: i32) -> f64 {
    let sum: f64 = (0..4).map(|part| uniform(seed, pixel, 4 * channel + part)).sum();
    (sum - 2.0) * 1.732_050_807_568_877_2
}
