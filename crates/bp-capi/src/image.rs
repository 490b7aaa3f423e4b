//! Images in the caller's memory.

use std::ffi::c_void;

use bp_core::{
    Image, Size,
    image::{Samples, factor_to_8_bits, narrow, scaled},
};

use crate::{BpstereoStatus, rows::Rows, status::Failure};

/// The type of an image's values.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BpstereoValue {
    /// uint8_t.
    U8 = 0,
    /// uint16_t; 65535 is white.
    U16 = 1,
    /// float, from 0 to 1 or from 0 to 255.
    F32 = 2,
}

/// An image in the caller's memory. It is read during the call only.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BpstereoImage {
    /// The first value of the upper left pixel, aligned as its type needs.
    pub data: *const c_void,
    /// The type of the values: `BPSTEREO_VALUE_U8`, `BPSTEREO_VALUE_U16` or `BPSTEREO_VALUE_F32`.
    pub value_type: u32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values of a pixel, one after another: 1 for grey, 3 for red, green and blue.
    pub channels: usize,
    /// Bytes from one row to the next; negative if the last row comes first in memory. A multiple of the type's size.
    pub stride: isize,
}

impl BpstereoImage {
    pub(crate) fn size(&self, name: &str) -> Result<Size, Failure> {
        let size = Size::new(self.width, self.height);
        let size = size.map_err(|error| bp_stereo::Error::from(error).of(name))?;
        match self.channels {
            1 | 3 => Ok(size),
            other => Err(Failure::input(format!("{name} has {other} channels; 1 or 3 are needed"))),
        }
    }

    fn rows<T: Copy>(&self, name: &str) -> Result<Rows<T>, Failure> {
        Rows::new(name, self.data.cast(), self.stride, self.size(name)?, self.channels)
    }

    /// The factor that makes 8-bit values of floats; `None` for integers.
    ///
    /// # Safety
    /// That of [`Self::copied`].
    pub(crate) unsafe fn factor(&self, name: &str) -> Result<Option<f32>, Failure> {
        if self.value_type != BpstereoValue::F32 as u32 {
            return Ok(None);
        }
        let rows = self.rows::<f32>(name)?;
        let factors = (0..self.height).map(|y| {
            // SAFETY: the caller's promise.
            let row = unsafe { rows.read(y) };
            factor_to_8_bits(row).map_err(|wrong| Failure::input(format!("{name}: {wrong}")))
        });
        factors.reduce(|one, other| Ok(one?.min(other?))).transpose()
    }

    /// The values as floats.
    ///
    /// # Safety
    /// That of [`Self::copied`].
    pub(crate) unsafe fn samples(&self, name: &str) -> Result<Samples, Failure> {
        // SAFETY: the caller's promise.
        unsafe {
            match self.value_type {
                0 => self.gathered::<u8>(name, f32::from),
                1 => self.gathered::<u16>(name, f32::from),
                2 => self.gathered(name, |value: f32| value),
                other => Err(unknown(name, other)),
            }
        }
    }

    /// Gathers the values, with `float` as that of each.
    ///
    /// # Safety
    /// That of [`Self::copied`].
    unsafe fn gathered<T: Copy>(&self, name: &str, float: impl Fn(T) -> f32) -> Result<Samples, Failure> {
        let (size, rows) = (self.size(name)?, self.rows::<T>(name)?);
        let mut values = Vec::new();
        values.try_reserve_exact(size.pixels() * self.channels).map_err(|_| no_room(name, size))?;
        for y in 0..size.height {
            // SAFETY: the caller's promise.
            values.extend(unsafe { rows.read(y) }.map(&float));
        }
        Ok(Samples::new(size, values)?)
    }

    /// Copies the image. Floats are multiplied by `factor`. Messages call it `name`.
    ///
    /// # Safety
    /// `data` must be readable for `height` rows of `width * channels` values, `stride` bytes apart.
    pub(crate) unsafe fn copied(&self, name: &str, factor: f32) -> Result<Image, Failure> {
        // SAFETY: the caller's promise.
        unsafe {
            match self.value_type {
                0 => self.converted(name, |value: u8| value),
                1 => self.converted(name, narrow),
                2 => self.converted(name, |value| scaled(value, factor)),
                other => Err(unknown(name, other)),
            }
        }
    }

    /// Copies the image, with `stored` as the 8-bit value of each value.
    ///
    /// # Safety
    /// That of [`Self::copied`].
    unsafe fn converted<T: Copy>(&self, name: &str, stored: impl Fn(T) -> u8) -> Result<Image, Failure> {
        let (size, rows) = (self.size(name)?, self.rows::<T>(name)?);
        let (mut greys, mut colours) = (Vec::new(), Vec::new());
        if self.channels == 3 {
            colours.try_reserve_exact(size.pixels()).map_err(|_| no_room(name, size))?;
        } else {
            greys.try_reserve_exact(size.pixels()).map_err(|_| no_room(name, size))?;
        }
        for y in 0..size.height {
            // SAFETY: the caller's promise.
            let mut values = unsafe { rows.read(y) }.map(&stored);
            if self.channels == 3 {
                let mut next = || values.next().unwrap_or_default();
                colours.extend((0..size.width).map(|_| [next(), next(), next()]));
            } else {
                greys.extend(values);
            }
        }
        Ok(if self.channels == 3 {
            Image::from_rgb(size.width, size.height, colours)?
        } else {
            Image::from_grey(size.width, size.height, greys)?
        })
    }
}

fn unknown(name: &str, value_type: u32) -> Failure {
    Failure::input(format!("{name}: unknown value_type {value_type}"))
}

fn no_room(name: &str, size: Size) -> Failure {
    Failure(BpstereoStatus::Memory, format!("{name}: no memory for {size} pixels"))
}
