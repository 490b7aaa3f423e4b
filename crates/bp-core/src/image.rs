//! Images.

use std::{borrow::Cow, ops::Range};

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::{Error, Size, limits::MAX_SIDE, memory::Buffer};

mod plane;
mod samples;
mod shades;

use plane::{Plane, mirrored, part_of};

pub use samples::{Samples, Stretch};
pub use shades::{NotAShade, common_factor, factor_to_8_bits, narrow, scaled};

/// The most rows of an apron (see [`Image::strip`]): no data cost reads rows further up or down.
pub const APRON: usize = 4;

impl Size {
    /// A size.
    ///
    /// # Errors
    /// [`Error::Empty`] if a side is 0, [`Error::TooLarge`] if one exceeds [`MAX_SIDE`].
    pub fn new(width: usize, height: usize) -> Result<Self, Error> {
        let size = Self { width, height };
        if width == 0 || height == 0 {
            return Err(Error::Empty { size });
        }
        if width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::TooLarge { size });
        }
        Ok(size)
    }
}

/// An image of 8-bit values, grey or colour, `[height][width]`, rows from top to bottom. A grey image has three equal channels.
///
/// A strip of a larger image may have an *apron*: up to [`APRON`] rows of the larger image above and below it. These
/// rows are not part of the strip, but data costs that read neighbouring rows use them.
#[derive(Clone)]
pub struct Image {
    size: Size,
    /// The rows of the apron above and below the image.
    above: usize,
    below: usize,
    /// Grey values `[above + height + below][width]`.
    greys: Plane,
    /// Colours, in the same order; `None` if all pixels are grey.
    colours: Option<Plane>,
}

impl Image {
    /// Bytes per pixel of a grey image, and of one with colours.
    pub const GREY_BYTES: u64 = 1;
    /// See [`Image::GREY_BYTES`].
    pub const COLOUR_BYTES: u64 = 4;

    /// An image from its colours, `[height][width]`.
    ///
    /// # Errors
    /// As [`Size::new`]; [`Error::PixelCount`] if `pixels` does not hold `width * height` colours, [`Error::OutOfMemory`].
    pub fn from_rgb(width: usize, height: usize, pixels: Vec<[u8; 3]>) -> Result<Self, Error> {
        Self::of_colours(width, height, pixels)
    }

    /// An image of colours in the caller's memory, three bytes a pixel, `[height][width][3]`. They are read there for as long as the
    /// image or a clone lives, and must not change meanwhile.
    ///
    /// # Errors
    /// As [`Image::from_rgb`].
    pub fn lent_rgb(width: usize, height: usize, bytes: impl AsRef<[u8]> + Send + 'static) -> Result<Self, Error> {
        Self::of_colours(width, height, Plane::lent(bytes))
    }

    /// An image of colours, `[height][width]`.
    pub(crate) fn of_colours(width: usize, height: usize, colours: impl Into<Plane>) -> Result<Self, Error> {
        let colours = colours.into();
        let (size, pixels) = (Size::new(width, height)?, colours.colours());
        if colours.len() != 3 * size.pixels() {
            return Err(Error::PixelCount { size, found: colours.len().div_ceil(3) });
        }
        let mut greys = Buffer::filled("grey values", pixels.len(), 0)?;
        let parts = greys.par_chunks_mut(TOGETHER).zip(pixels.par_chunks(TOGETHER));
        let is_grey = parts.map(|(greys, pixels)| write_greys(pixels, greys)).reduce(|| true, |a, b| a && b);
        let colours = (!is_grey).then_some(colours);
        Ok(Self { size, above: 0, below: 0, greys: greys.into(), colours })
    }

    /// An image from grey values, `[height][width]`, in a vector or a slice, which is copied.
    ///
    /// # Errors
    /// As [`Image::from_rgb`].
    pub fn from_grey(width: usize, height: usize, values: impl Into<Vec<u8>>) -> Result<Self, Error> {
        Self::of_greys(width, height, values.into())
    }

    /// An image of grey values in the caller's memory, `[height][width]`. They are read there for as long as the image or a clone
    /// lives, and must not change meanwhile.
    ///
    /// # Errors
    /// As [`Image::from_grey`].
    pub fn lent_grey(width: usize, height: usize, bytes: impl AsRef<[u8]> + Send + 'static) -> Result<Self, Error> {
        Self::of_greys(width, height, Plane::lent(bytes))
    }

    /// An image of grey values, `[height][width]`.
    pub(crate) fn of_greys(width: usize, height: usize, greys: impl Into<Plane>) -> Result<Self, Error> {
        let greys = greys.into();
        let size = Size::new(width, height)?;
        if greys.len() != size.pixels() {
            return Err(Error::PixelCount { size, found: greys.len() });
        }
        Ok(Self { size, above: 0, below: 0, greys, colours: None })
    }

    /// The image mirrored left to right.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let width = self.size.width;
        let colours = self.colours.as_ref().map(|colours| mirrored(width, colours.colours()).into());
        Self { greys: mirrored(width, &self.greys).into(), colours, ..*self }
    }

    /// The image in grey.
    #[must_use]
    pub fn without_colours(self) -> Self {
        Self { colours: None, ..self }
    }

    /// Width and height.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// The bytes held, which clones share, without those that the caller lent.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.greys.held() + self.colours.as_ref().map_or(0, Plane::held)
    }

    /// Whether the image has no colours.
    #[must_use]
    pub fn is_grey(&self) -> bool {
        self.colours.is_none()
    }

    /// All grey values, `[height][width]`, without those of an apron.
    #[must_use]
    pub fn greys(&self) -> &[u8] {
        &self.greys[self.above * self.size.width..][..self.size.pixels()]
    }

    /// All colours, `[height][width]`, without those of an apron; `None` if all pixels are grey.
    #[must_use]
    pub fn colours(&self) -> Option<&[[u8; 3]]> {
        let colours = self.colours.as_ref()?.colours();
        Some(&colours[self.above * self.size.width..][..self.size.pixels()])
    }

    /// The channels of all pixels, `[height][width]`, without those of an apron.
    #[must_use]
    pub fn pixels(&self) -> Cow<'_, [[u8; 3]]> {
        self.colours().map_or_else(|| self.greys().iter().map(|&grey| [grey; 3]).collect(), Cow::from)
    }

    /// The grey values of row `y`, `[width]`. Outside the image they come from the apron, and beyond the apron from the
    /// last row in that direction.
    #[must_use]
    pub fn greys_near(&self, y: isize) -> &[u8] {
        &self.greys[self.row_near(y)]
    }

    /// As [`Image::greys_near`], the colours; `None` if all pixels are grey.
    #[must_use]
    pub fn colours_near(&self, y: isize) -> Option<&[[u8; 3]]> {
        self.colours.as_ref().map(|colours| &colours.colours()[self.row_near(y)])
    }

    fn row_near(&self, y: isize) -> Range<usize> {
        let last = self.above + self.size.height + self.below - 1;
        let row = y.saturating_add_unsigned(self.above).clamp(0, last as isize) as usize;
        row * self.size.width..(row + 1) * self.size.width
    }

    /// The grey value at column `x`, row `y`. Outside the image, border columns repeat, and rows come from
    /// [`Image::greys_near`].
    #[must_use]
    pub fn grey_near(&self, x: isize, y: isize) -> u8 {
        self.greys_near(y)[self.column_near(x)]
    }

    /// As [`Image::grey_near`], the channels.
    #[must_use]
    pub fn rgb_near(&self, x: isize, y: isize) -> [u8; 3] {
        self.colours_near(y).map_or_else(|| [self.grey_near(x, y); 3], |row| row[self.column_near(x)])
    }

    fn column_near(&self, x: isize) -> usize {
        x.clamp(0, self.size.width as isize - 1) as usize
    }

    /// Copies some rows to a new image; see [`Image::part`].
    ///
    /// # Panics
    /// If `rows` is empty or lies outside the image.
    #[must_use]
    pub fn strip(&self, rows: Range<usize>) -> Self {
        self.part(0..self.size.width, rows)
    }

    /// Copies some columns and rows to a new image. Its apron holds the rows above and below them, so the data costs of whole
    /// rows equal those of the whole image. Other columns are not kept.
    ///
    /// # Panics
    /// If `columns` or `rows` is empty or lies outside the image.
    #[must_use]
    pub fn part(&self, columns: Range<usize>, rows: Range<usize>) -> Self {
        let Size { width, height } = self.size;
        assert!(rows.start < rows.end && rows.end <= height, "rows {rows:?} of an image of {}", self.size);
        assert!(
            columns.start < columns.end && columns.end <= width,
            "columns {columns:?} of an image of {}",
            self.size
        );
        let (above, below) = (rows.start + self.above, height - rows.end + self.below);
        let (above, below) = (above.min(APRON), below.min(APRON));
        let known = rows.start + self.above - above..rows.end + self.above + below;
        Self {
            size: Size { width: columns.len(), height: rows.len() },
            above,
            below,
            greys: part_of(&self.greys, width, &columns, &known).into(),
            colours: self.colours.as_ref().map(|colours| part_of(colours.colours(), width, &columns, &known).into()),
        }
    }

    /// The channels at column `x`, row `y`.
    ///
    /// # Panics
    /// If (x, y) lies outside the image.
    #[must_use]
    pub fn rgb(&self, x: usize, y: usize) -> [u8; 3] {
        self.colours().map_or_else(|| [self.grey(x, y); 3], |colours| colours[y * self.size.width + x])
    }

    /// The grey value at column `x`, row `y`.
    ///
    /// # Panics
    /// If (x, y) lies outside the image.
    #[must_use]
    #[inline]
    pub fn grey(&self, x: usize, y: usize) -> u8 {
        self.greys()[y * self.size.width + x]
    }
}

/// Images are equal if their pixels and aprons are.
impl PartialEq for Image {
    fn eq(&self, other: &Self) -> bool {
        let shape = |image: &Self| (image.size, image.above, image.below);
        // A part of a coloured image may be grey, and still hold colours.
        let rows = -(self.above as isize)..(self.size.height + self.below) as isize;
        let is_same = |y: isize| (0..self.size.width as isize).all(|x| self.rgb_near(x, y) == other.rgb_near(x, y));
        shape(self) == shape(other)
            && *self.greys == *other.greys
            && (self.colours.as_deref() == other.colours.as_deref() || rows.into_iter().all(is_same))
    }
}

impl Eq for Image {}

/// Pixels whose grey values one thread computes together.
const TOGETHER: usize = 1 << 16;

/// Writes the grey values of colours, and returns whether these are grey.
fn write_greys(pixels: &[[u8; 3]], greys: &mut [u8]) -> bool {
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || {
            let mut differing = 0;
            for (out, &[red, green, blue]) in greys.iter_mut().zip(pixels) {
                *out = grey([red, green, blue]);
                differing |= (red ^ green) | (green ^ blue);
            }
            differing == 0
        },
    ))
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Image({})", self.size)
    }
}

/// The luma of a colour, in integers with the weights of ITU-R BT.601. Equal channels keep their value.
#[must_use]
#[inline(always)]
pub fn grey([r, g, b]: [u8; 3]) -> u8 {
    let sum = 299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b);
    ((sum + 500) / 1000) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_keeps_grey_and_rounds_the_weights() {
        assert!((0..=255).all(|v| grey([v; 3]) == v));
        assert_eq!([grey([255, 0, 0]), grey([0, 255, 0]), grey([0, 0, 255])], [76, 150, 29]);
    }

    #[test]
    fn an_image_holds_colours_only_if_it_has_some() {
        let [equal, red] = [[[7; 3], [9; 3]].as_slice(), [[7; 3], [9; 3], [255, 0, 0]].as_slice()];
        let (grey, equal) = (Image::from_grey(2, 1, [7, 9]).unwrap(), Image::from_rgb(2, 1, equal.to_vec()).unwrap());
        assert!(grey == equal && equal.is_grey() && equal.bytes() == 2 && equal.rgb(1, 0) == [9; 3]);
        let coloured = Image::from_rgb(3, 1, red.to_vec()).unwrap();
        assert_eq!((coloured.greys(), coloured.colours()), ([7, 9, 76].as_slice(), Some(red)));
        // A part that happens to be grey is the same image.
        assert_eq!(coloured.part(0..2, 0..1), grey);
        let without = coloured.clone().without_colours();
        assert!(without != coloured && without.bytes() < coloured.bytes() && *without.pixels() != *red);
        // Another colour of the same grey.
        let other = Image::from_rgb(3, 1, vec![[7; 3], [9; 3], [254, 0, 0]]).unwrap();
        assert!(other.greys() == coloured.greys() && other != coloured);
    }

    #[test]
    fn lent_values_are_read_where_they_lie() {
        let values = vec![7, 9, 76, 1, 2, 3];
        let place = values.as_ptr();
        let grey = Image::lent_grey(3, 2, values.clone()).unwrap();
        assert_eq!((&grey, grey.bytes()), (&Image::from_grey(3, 2, values.clone()).unwrap(), 0));
        let coloured = Image::lent_rgb(1, 2, values).unwrap();
        assert_eq!(coloured, Image::from_rgb(1, 2, vec![[7, 9, 76], [1, 2, 3]]).unwrap());
        assert_eq!((coloured.colours().unwrap().as_ptr().cast(), coloured.bytes()), (place, 2));
        let clone = coloured.clone();
        drop(coloured);
        assert_eq!(clone.colours_near(0).unwrap().as_ptr().cast(), place);
        // Copies are ours.
        assert_eq!([clone.mirrored().bytes(), clone.strip(1..2).bytes()], [8, 8]);
        for wrong in [Image::lent_rgb(2, 1, [0; 7]), Image::lent_grey(2, 1, [0; 3])] {
            assert!(matches!(wrong, Err(Error::PixelCount { .. })));
        }
    }

    /// Seven rows, each filled with its own index.
    fn rows() -> Image {
        Image::from_grey(2, 7, (0..14).map(|i| i / 2).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_strip_knows_the_rows_around_it() {
        let near = |image: &Image| (-6..8).map(|y| image.grey_near(0, y)).collect::<Vec<_>>();
        assert_eq!(near(&rows()), [0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 6]);
        let strip = rows().strip(5..6);
        assert_eq!((strip.size().height, strip.greys()), (1, [5; 2].as_slice()));
        assert_eq!(near(&strip), [1, 1, 1, 2, 3, 4, 5, 6, 6, 6, 6, 6, 6, 6]);
        // Rows beyond the apron are lost.
        assert_eq!(near(&rows().strip(0..2)), [0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 5, 5]);
        assert_eq!(strip.grey_near(isize::MIN, isize::MIN), 1);
        assert_eq!(strip.grey_near(isize::MAX, isize::MAX), 6);
    }

    #[test]
    fn a_strip_of_a_strip_is_a_strip_of_the_image() {
        assert_eq!(rows().strip(1..4).strip(0..2), rows().strip(1..3));
        assert_eq!(rows().strip(0..7), rows());
        assert_ne!(rows().strip(1..2), Image::from_grey(2, 1, [1, 1]).unwrap());
    }

    #[test]
    fn bad_sizes_are_refused() {
        assert!(matches!(Image::from_grey(0, 3, []), Err(Error::Empty { .. })));
        assert!(matches!(Image::from_grey(2, 2, [1, 2, 3]), Err(Error::PixelCount { found: 3, .. })));
        assert!(matches!(Size::new(MAX_SIDE + 1, 1), Err(Error::TooLarge { .. })));
    }
}
