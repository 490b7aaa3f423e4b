//! Row alignment: how the rows of the right image differ from those of the left one, to a fraction of a pixel.
//!
//! Cameras are seldom rectified to a tenth of a pixel: between the images, points move up and down by a smooth function of their
//! position. [`Alignment::find`] measures this at some hundred points that the survey matched, fits a quadratic to it, and
//! [`Alignment::aligned`] resamples the right image accordingly. Everything is basic arithmetic in a fixed order, so it gives
//! the same bytes on every machine.

mod fit;
mod moved;
mod resample;

use crate::{Error, MAX_SIDE, Size, StereoPair, metrics::check_size, survey::Survey};

/// Smaller differences are not corrected, in pixels.
const LEAST: f64 = 0.05;

/// Coefficients are rounded to one part in this, so that they stay the same in files.
const DIGITS: f64 = 1e6;

/// The terms of the quadratic: 1, x, y, x², xy, y².
const TERMS: usize = 6;

/// How the rows of the right image differ from those of the left one: the point of left row y lies in the right image at
/// column x and row `y + c0 + c1 X + c2 Y + c3 X² + c4 XY + c5 Y²`. X and Y are x and y, scaled such that both are -1 and 1 at the
/// borders of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "Unchecked"))]
pub struct Alignment {
    width: usize,
    height: usize,
    coefficients: [f64; TERMS],
}

/// An alignment from a file.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Unchecked {
    width: usize,
    height: usize,
    coefficients: [f64; TERMS],
}

#[cfg(feature = "serde")]
impl TryFrom<Unchecked> for Alignment {
    type Error = Error;

    fn try_from(Unchecked { width, height, coefficients }: Unchecked) -> Result<Self, Error> {
        Self::new(Size::new(width, height)?, coefficients)
    }
}

impl Alignment {
    /// The alignment of images of this size with these coefficients, c0 to c5 in pixels.
    ///
    /// # Errors
    /// [`Error::Plan`] if a coefficient is not a number or exceeds [`MAX_SIDE`].
    pub fn new(Size { width, height }: Size, coefficients: [f64; TERMS]) -> Result<Self, Error> {
        if coefficients.iter().all(|coefficient| coefficient.abs() <= MAX_SIDE as f64) {
            return Ok(Self { width, height, coefficients });
        }
        Err(Error::Plan("the coefficients of an alignment must be numbers of pixels, at most as many as images have"))
    }

    /// Measures a pair that was surveyed. `None` if too few points agree.
    #[must_use]
    pub fn find(pair: &StereoPair, survey: &Survey) -> Option<Self> {
        let size = pair.size();
        let moved = moved::measure(pair, &survey.points);
        let rounded = |coefficient: f64| (coefficient * DIGITS).round() / DIGITS;
        Self::new(size, fit::quadratic(size, &moved)?.map(rounded)).ok()
    }

    /// The coefficients c0 to c5 in pixels.
    #[must_use]
    pub fn coefficients(&self) -> [f64; TERMS] {
        self.coefficients
    }

    /// The size of the images.
    #[must_use]
    pub fn size(&self) -> Size {
        Size { width: self.width, height: self.height }
    }

    /// The difference at a column and a row of the right image, in pixels.
    #[must_use]
    pub fn rows_at(&self, x: f64, y: f64) -> f64 {
        let terms = terms(self.size(), x, y);
        self.coefficients.iter().zip(terms).map(|(coefficient, term)| coefficient * term).sum()
    }

    /// The least and the largest difference at the corners, the middles of the borders and the centre, in pixels.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let [columns, rows] =
            [self.width, self.height].map(|side| [0.0, 0.5, 1.0].map(|part| part * (side - 1) as f64));
        let at = columns.iter().flat_map(|&x| rows.iter().map(move |&y| self.rows_at(x, y)));
        at.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, largest], rows| [least.min(rows), largest.max(rows)])
    }

    /// Whether the rows differ so little that resampling would do more harm than good.
    #[must_use]
    pub fn is_negligible(&self) -> bool {
        self.range().iter().all(|rows| rows.abs() < LEAST)
    }

    /// The pair with its right image resampled, such that corresponding rows are the same.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the pair has another size than the one that was measured, [`Error::OutOfMemory`].
    pub fn aligned(&self, pair: &StereoPair) -> Result<StereoPair, Error> {
        check_size("the alignment", self.size(), pair.size())?;
        StereoPair::new(pair.left().clone(), resample::resampled(pair.right(), self)?)
    }
}

/// The terms of the quadratic at a column and a row.
fn terms(size: Size, x: f64, y: f64) -> [f64; TERMS] {
    let scaled = |at: f64, side: usize| 2.0 * at / (side.max(2) - 1) as f64 - 1.0;
    let (x, y) = (scaled(x, size.width), scaled(y, size.height));
    [1.0, x, y, x * x, x * y, y * y]
}

/// The weights of four neighbours in a cubic interpolation at t, from 0 at the second to 1 at the third (Keys 1981).
#[inline(always)]
fn weights(t: f32) -> [f32; 4] {
    [
        t * (t * (1.0 - 0.5 * t) - 0.5),
        1.0 + t * t * (1.5 * t - 2.5),
        t * (t * (2.0 - 1.5 * t) + 0.5),
        0.5 * t * t * (t - 1.0),
    ]
}
