//! NumPy arrays as images and maps, and maps as arrays.

use bp_core::{
    DisparityMap, Image, Size, StereoPair,
    image::{Samples, common_factor, factor_to_8_bits, narrow, scaled},
};
use bp_stereo::{Options, ReadPair, check_stretching, stretching_bytes};
use numpy::{
    Element, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods,
    ndarray::{ArrayView2, Axis, Ix3},
};
use pyo3::{
    exceptions::{PyMemoryError, PyTypeError, PyValueError},
    prelude::*,
};

use crate::{errors::raised, lent::Lent, threads::together};

/// A pair of images from arrays `[height][width]`, `[height][width][1]` or `[height][width][3]` (red, green, blue) of uint8,
/// uint16 or float32 with any strides. Bytes without gaps stay where they are; others are converted. Floats of both images have one
/// scale.
pub(crate) fn pair(left: &Bound<'_, PyAny>, right: &Bound<'_, PyAny>) -> PyResult<StereoPair> {
    let (py, left, right) = (left.py(), Pixels::of("left", left)?, Pixels::of("right", right)?);
    let factor = common_factor([left.factor()?, right.factor()?]);
    let planes = [left.planes(factor)?, right.planes(factor)?];
    let sizes = [left.size, right.size];
    together(py, move || {
        let [left, right] = planes;
        StereoPair::new(left.image(sizes[0])?, right.image(sizes[1])?)
    })?
    .map_err(raised)
}

/// A pair from such arrays whose values have any range, by one scale for both images; within the memory that the options allow.
pub(crate) fn stretched_pair(
    options: &Options,
    left: &Bound<'_, PyAny>,
    right: &Bound<'_, PyAny>,
) -> PyResult<ReadPair> {
    let (py, left, right) = (left.py(), Pixels::of("left", left)?, Pixels::of("right", right)?);
    check_stretching(options, left.size, left.channels.max(right.channels)).map_err(raised)?;
    let (left, right) = (left.samples()?, right.samples()?);
    together(py, move || ReadPair::stretched(left, right))?.map_err(raised)
}

/// The most bytes that stretching the values of such arrays takes, beside the arrays. 0 without the option: the prediction of the match
/// includes reading.
pub(crate) fn reading_bytes(options: &Options, left: &Bound<'_, PyAny>, right: &Bound<'_, PyAny>) -> PyResult<u64> {
    let (left, right) = (Pixels::of("left", left)?, Pixels::of("right", right)?);
    let channels = left.channels.max(right.channels);
    Ok(if options.stretch { stretching_bytes(left.size, channels) } else { 0 })
}

/// The address at which the values of an image are read: the array's own, unless they are copied. For tests.
#[pyfunction]
pub(crate) fn _read_at(image: &Bound<'_, PyAny>) -> PyResult<usize> {
    let image = self::image("image", image)?;
    Ok(image.colours().map_or_else(|| image.greys().as_ptr(), |colours| colours.as_ptr().cast()).addr())
}

/// One image from such an array. `name` is the argument, for messages.
pub(crate) fn image(name: &'static str, object: &Bound<'_, PyAny>) -> PyResult<Image> {
    let pixels = Pixels::of(name, object)?;
    let (size, planes) = (pixels.size, pixels.planes(common_factor([pixels.factor()?]))?);
    together(object.py(), move || planes.image(size))?.map_err(raised)
}

/// The values of an image in 8 bits.
enum Planes {
    Lent(Lent),
    Greys(Vec<u8>),
    Colours(Vec<[u8; 3]>),
}

impl Planes {
    fn image(self, Size { width, height }: Size) -> Result<Image, bp_core::Error> {
        match self {
            Self::Lent(bytes) if bytes.as_ref().len() == width * height => Image::lent_grey(width, height, bytes),
            Self::Lent(bytes) => Image::lent_rgb(width, height, bytes),
            Self::Greys(greys) => Image::from_grey(width, height, greys),
            Self::Colours(colours) => Image::from_rgb(width, height, colours),
        }
    }
}

/// An array that holds an image.
struct Pixels<'py> {
    name: &'static str,
    size: Size,
    channels: usize,
    values: Values<'py>,
}

enum Values<'py> {
    Bytes(Bound<'py, PyArrayDyn<u8>>),
    Words(Bound<'py, PyArrayDyn<u16>>),
    Floats(Bound<'py, PyArrayDyn<f32>>),
}

const NEEDED: &str = "an array of uint8, uint16 or float32 is needed";

impl<'py> Pixels<'py> {
    fn of(name: &'static str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let array = array(name, object)?;
        let [height, width, channels] = match *array.shape() {
            [height, width] => [height, width, 1],
            [height, width, channels @ (1 | 3)] => [height, width, channels],
            _ => {
                let what = "an image is [height][width] or [height][width][3]";
                return Err(PyValueError::new_err(format!("{name} has the shape {:?}; {what}", array.shape())));
            }
        };
        let size = Size::new(width, height).map_err(|error| raised(bp_stereo::Error::from(error).of(name)))?;
        let values = if let Ok(array) = array.cast() {
            Values::Bytes(array.clone())
        } else if let Ok(array) = array.cast() {
            Values::Words(array.clone())
        } else if let Ok(array) = array.cast() {
            Values::Floats(array.clone())
        } else {
            return Err(PyTypeError::new_err(format!("{name} holds {}; {NEEDED}", array.dtype())));
        };
        Ok(Self { name, size, channels, values })
    }

    /// The factor that makes 8-bit values of floats. Fails at values that no image has.
    fn factor(&self) -> PyResult<Option<f32>> {
        let Values::Floats(array) = &self.values else { return Ok(None) };
        let mut factor = f32::INFINITY;
        for_each_row(array, |row| {
            let of_row = factor_to_8_bits(row.iter().copied());
            factor = factor.min(of_row.map_err(|wrong| PyValueError::new_err(format!("{}: {wrong}", self.name)))?);
            Ok(())
        })?;
        Ok(Some(factor))
    }

    /// The values as floats.
    fn samples(&self) -> PyResult<Samples> {
        match &self.values {
            Values::Bytes(array) => self.gathered(array, f32::from),
            Values::Words(array) => self.gathered(array, f32::from),
            Values::Floats(array) => self.gathered(array, |value| value),
        }
    }

    fn gathered<T: Element + Copy + Default>(
        &self,
        array: &Bound<'_, PyArrayDyn<T>>,
        float: impl Fn(T) -> f32,
    ) -> PyResult<Samples> {
        let mut values = self.room(array.len())?;
        for_each_row(array, |row| {
            values.extend(row.iter().map(|&value| float(value)));
            Ok(())
        })?;
        Samples::new(self.size, values).map_err(raised)
    }

    fn planes(&self, factor: f32) -> PyResult<Planes> {
        match &self.values {
            Values::Bytes(array) if array.is_c_contiguous() => Ok(Planes::Lent(Lent::of(array))),
            Values::Bytes(array) => self.converted(array, |value| value),
            Values::Words(array) => self.converted(array, narrow),
            Values::Floats(array) => self.converted(array, |value| scaled(value, factor)),
        }
    }

    /// The planes, with `stored` as the 8-bit value of each value.
    fn converted<T: Element + Copy + Default>(
        &self,
        array: &Bound<'_, PyArrayDyn<T>>,
        stored: impl Fn(T) -> u8,
    ) -> PyResult<Planes> {
        if self.channels == 3 {
            let mut colours = self.room(self.size.pixels())?;
            for_each_row(array, |row| {
                colours.extend(row.as_chunks().0.iter().map(|pixel: &[T; 3]| pixel.map(&stored)));
                Ok(())
            })?;
            return Ok(Planes::Colours(colours));
        }
        let mut greys = self.room(self.size.pixels())?;
        for_each_row(array, |row| {
            greys.extend(row.iter().map(|&value| stored(value)));
            Ok(())
        })?;
        Ok(Planes::Greys(greys))
    }

    /// An empty vector with room for so many elements.
    fn room<T>(&self, len: usize) -> PyResult<Vec<T>> {
        let mut values = Vec::new();
        match values.try_reserve_exact(len) {
            Ok(()) => Ok(values),
            Err(_) => Err(PyMemoryError::new_err(format!("{}: no memory for {} pixels", self.name, self.size))),
        }
    }
}

/// The values between two looks at signals and at other Python threads.
const PATIENCE: usize = 1 << 22;

/// Calls `each` with the values of every row, side by side: those of the array, or copies where they do not lie so.
fn for_each_row<T: Element + Copy + Default>(
    array: &Bound<'_, PyArrayDyn<T>>,
    mut each: impl FnMut(&[T]) -> PyResult<()>,
) -> PyResult<()> {
    let guard = array.try_readonly()?;
    let mut view = guard.as_array();
    if view.ndim() == 2 {
        view = view.insert_axis(Axis(2));
    }
    let Ok(view) = view.into_dimensionality::<Ix3>() else { return Ok(()) };
    let (mut copy, mut read) = (Vec::new(), 0);
    for row in view.outer_iter() {
        match row.as_slice() {
            Some(values) => each(values)?,
            None => each(side_by_side(row, &mut copy))?,
        }
        read += row.len();
        if read >= PATIENCE {
            read = 0;
            array.py().check_signals()?;
            array.py().detach(|| ());
        }
    }
    Ok(())
}

/// A row `[width][channels]` without gaps, in `copy`. Walking along each channel is faster than from pixel to pixel.
fn side_by_side<'copy, T: Copy + Default>(row: ArrayView2<'_, T>, copy: &'copy mut Vec<T>) -> &'copy [T] {
    copy.resize(row.len(), T::default());
    // OpenCV's colours the other way round (`image[..., ::-1]`) lie side by side.
    let mut turned = row;
    turned.invert_axis(Axis(1));
    match turned.to_slice() {
        Some(values) if row.ncols() == 3 => {
            let pixels = copy.as_chunks_mut::<3>().0.iter_mut().zip(values.as_chunks::<3>().0);
            pixels.for_each(|(to, &[blue, green, red])| *to = [red, green, blue]);
        }
        _ => {
            for (channel, values) in row.axis_iter(Axis(1)).enumerate() {
                let to = copy.iter_mut().skip(channel).step_by(row.ncols());
                to.zip(values).for_each(|(to, &value)| *to = value);
            }
        }
    }
    copy
}

/// The object as an array: itself, or what it turns into, as images of other libraries do. Values that lie at odd
/// addresses are copied.
fn array<'py>(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = object.cast::<PyUntypedArray>() {
        let is_aligned: bool = array.getattr("flags")?.getattr("aligned")?.extract()?;
        return if is_aligned { Ok(array.clone()) } else { Ok(array.call_method0("copy")?.cast_into()?) };
    }
    if !object.hasattr("__array__")? && !object.hasattr("__array_interface__")? {
        return Err(PyTypeError::new_err(format!("{name} is of type {}; {NEEDED}", object.get_type().name()?)));
    }
    let array = object.py().import("numpy")?.call_method1("require", (object, object.py().None(), "A"))?;
    Ok(array.cast_into()?)
}

/// The map in an array `[height][width]` of float32, where values that are not finite are unknown.
pub(crate) fn map(name: &str, object: &Bound<'_, PyAny>) -> PyResult<DisparityMap> {
    let array = array(name, object)?;
    let Ok(array) = array.cast::<PyArray2<f32>>() else {
        let what = "a map is [height][width] of float32";
        return Err(PyTypeError::new_err(format!("{name} is {:?} of {}; {what}", array.shape(), array.dtype())));
    };
    let array = array.try_readonly()?;
    let (height, width) = array.as_array().dim();
    let size = Size::new(width, height).map_err(raised)?;
    DisparityMap::new(size, array.as_array().iter().copied().collect()).map_err(raised)
}

/// A new array `[height][width]`, with NaN where the value is not finite.
pub(crate) fn plane<'py>(py: Python<'py>, size: Size, values: &[f32]) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let finite = values.iter().map(|&value| if value.is_finite() { value } else { f32::NAN });
    PyArray1::from_vec(py, finite.collect()).reshape([size.height, size.width])
}

/// The array that the caller gave for a map of this size.
pub(crate) fn target<'py>(object: &Bound<'py, PyAny>, size: Size) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let needed = || format!("`out` must be a float32 array of the shape {:?}", [size.height, size.width]);
    let array = object.cast::<PyArray2<f32>>().map_err(|_| PyTypeError::new_err(needed()))?;
    if *array.shape() != [size.height, size.width] {
        return Err(PyValueError::new_err(format!("{}, not {:?}", needed(), array.shape())));
    }
    let flags = array.getattr("flags")?;
    for flag in ["writeable", "aligned"] {
        if !flags.getattr(flag)?.extract::<bool>()? {
            return Err(PyValueError::new_err(format!("`out` must be {flag}")));
        }
    }
    Ok(array.clone())
}

/// Writes a map into an array of its size, with NaN where it is unknown.
pub(crate) fn fill(array: &Bound<'_, PyArray2<f32>>, map: &DisparityMap) -> PyResult<()> {
    let mut array = array.try_readwrite()?;
    let mut view = array.as_array_mut();
    for (mut to, values) in view.rows_mut().into_iter().zip(map.values().chunks_exact(map.size().width)) {
        match to.as_slice_mut() {
            Some(to) => to.iter_mut().zip(values).for_each(written),
            None => to.iter_mut().zip(values).for_each(written),
        }
    }
    Ok(())
}

/// Writes one value of a map.
fn written((to, &value): (&mut f32, &f32)) {
    *to = if value.is_finite() { value } else { f32::NAN };
}
