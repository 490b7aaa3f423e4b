//! Six synthetic stereo scenes with exact ground truth. Every machine renders the same bits.
//!
//! They replace six Middlebury scenes that need a download. They resemble those in size, range of disparity, content
//! and difficulty, but show other things. A scene is a list of surfaces over the left image. Each surface knows which
//! pixels it covers, its disparity there as a continuous function, and its texture. Both views show the same surfaces,
//! so the truth is exact to single precision, even for occluded pixels.

mod render;
mod scenes;
mod spot;
mod surface;
#[cfg(test)]
mod tests;
mod texture;

use bp_core::{DisparityMap, Image, Size, StereoPair};
use render::{Exposure, World};
use surface::View;

/// The names of the scenes, by the index of [`scene`].
pub const NAMES: [&str; 6] = ["doll", "leaves", "cloth", "pots", "bowling", "books"];

/// The width and height of the scenes in pixels at full size, in the order of [`NAMES`].
pub const SIZES: [[usize; 2]; 6] = [[620, 555], [641, 555], [626, 555], [656, 555], [665, 555], [695, 555]];

/// No true disparity of either view exceeds this many pixels at full size.
pub const MAX_DISPARITY: f64 = 111.0;

/// A stereo pair with its ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What the scene shows, one of [`NAMES`].
    pub name: &'static str,
    /// The two views, with different noise and slightly different exposures.
    pub pair: StereoPair,
    /// The true disparity of each left pixel, in pixels of this scene's size. It is known everywhere.
    pub truth_left: DisparityMap,
    /// The true disparity of each right pixel, in pixels of this scene's size. It is known everywhere.
    pub truth_right: DisparityMap,
    /// Whether a left pixel is non-occluded: the right camera sees the same point. `[height][width]`.
    pub visible: Vec<bool>,
}

/// The scene `NAMES[index]` with both sides and all disparities divided by `divisor`, sides rounded up.
///
/// # Panics
/// If `index` is not below 6 or `divisor` is 0.
#[must_use]
pub fn scene(index: usize, divisor: usize) -> Scene {
    let size = reduced(SIZES[index], divisor);
    let world = scenes::world(index);
    let [left, right] = exposures(index, divisor);
    let image = |view, exposure: Exposure| {
        let colours = exposure.develop(&world.photograph(view, size, divisor));
        Image::from_rgb(size.width, size.height, colours).expect("one colour a pixel was rendered")
    };
    let pair = StereoPair::new(image(View::Left, left), image(View::Right, right)).expect("both views have one size");
    let truth = |view| truth(&world, view, size, divisor);
    Scene {
        name: NAMES[index],
        pair,
        truth_left: truth(View::Left),
        truth_right: truth(View::Right),
        visible: visible(&world, size, divisor),
    }
}

/// The size of a scene at one `divisor`-th.
fn reduced([width, height]: [usize; 2], divisor: usize) -> Size {
    Size { width: width.div_ceil(divisor), height: height.div_ceil(divisor) }
}

/// The full-size coordinate of a reduced pixel's centre.
fn centre(i: usize, divisor: usize) -> f64 {
    (i as f64 + 0.5) * divisor as f64 - 0.5
}

/// One value per pixel, from its centre in full-size coordinates, `[height][width]`.
fn per_pixel<T>(size: Size, divisor: usize, value: impl Fn(f64, f64) -> T) -> Vec<T> {
    let pixels = 0..size.pixels();
    pixels.map(|i| value(centre(i % size.width, divisor), centre(i / size.width, divisor))).collect()
}

fn truth(world: &World, view: View, size: Size, divisor: usize) -> DisparityMap {
    let values = per_pixel(size, divisor, |x, y| (world.look(view, x, y).disparity / divisor as f64) as f32);
    DisparityMap::new(size, values).expect("one value a pixel was computed")
}

fn visible(world: &World, size: Size, divisor: usize) -> Vec<bool> {
    let columns = centre(0, divisor)..=centre(size.width - 1, divisor);
    per_pixel(size, divisor, |x, y| world.is_shared(x, y, &columns))
}

/// The exposures of both views. They differ like two shots with one camera. Shrinking an image averages its noise.
fn exposures(index: usize, divisor: usize) -> [Exposure; 2] {
    let (gain, offset) = [(1.02, -1.0), (0.98, 1.5), (1.03, 0.5), (0.985, 0.5), (1.01, 0.5), (0.985, -1.0)][index];
    let (noise, seed) = (1.6 / divisor as f64, 2 * index as u32);
    [Exposure { gain: 1.0, offset: 0.0, noise, seed }, Exposure { gain, offset, noise, seed: seed + 1 }]
}
