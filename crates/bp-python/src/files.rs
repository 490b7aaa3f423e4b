//! The program's file formats.

use std::path::PathBuf;

use bp_core::points;
use bp_stereo::io::{self, Files, Limits, Picture, Raster};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::{
    arrays::{image, map, plane},
    calibration::Calibration,
    errors::{raised, there},
};

/// Reads an image: PNG, JPEG, TIFF, PPM, PGM or PFM, as uint8 [height][width][3] (red, green, blue).
///
/// Larger images than `max_megapixels` are refused, so that a small file cannot take all memory.
#[pyfunction]
#[pyo3(signature = (path, max_megapixels = 100))]
pub(crate) fn read_image(py: Python<'_>, path: PathBuf, max_megapixels: u32) -> PyResult<Bound<'_, PyArray3<u8>>> {
    there(&path)?;
    let image = py.detach(|| io::read_image(&path, Limits::megapixels(max_megapixels))).map_err(raised)?;
    let size = image.size();
    PyArray1::from_slice(py, image.pixels().as_flattened()).reshape([size.height, size.width, 3])
}

/// Reads a disparity map: PFM, TIFF, NPY or KITTI's PNG, as float32 [height][width] with NaN where it is unknown.
///
/// Integers are divided by `scale`, by default 256 for 16 bits and 1 for 8 bits, and 0 means unknown. Larger maps than
/// `max_megapixels` are refused.
#[pyfunction]
#[pyo3(signature = (path, scale = None, max_megapixels = 100))]
pub(crate) fn read_map(
    py: Python<'_>,
    path: PathBuf,
    scale: Option<f32>,
    max_megapixels: u32,
) -> PyResult<Bound<'_, PyArray2<f32>>> {
    there(&path)?;
    let map = py.detach(|| io::read_map(&path, scale, Limits::megapixels(max_megapixels))).map_err(raised)?;
    plane(py, map.size(), map.values())
}

/// Writes a disparity map in the format of the path's ending: .pfm, .tif, .npy, or .png in KITTI's format.
///
/// Unknown pixels are plus infinity in PFM, NaN in TIFF and NPY, and 0 in PNG.
#[pyfunction]
pub(crate) fn write_map(py: Python<'_>, path: PathBuf, disparity: &Bound<'_, PyAny>) -> PyResult<()> {
    let map = map("disparity", disparity)?;
    let raster = Raster { nan: true, ..Raster::disparities(&map) };
    py.detach(|| raster.write(&Files::default(), &path)).map_err(raised)
}

/// Writes a coloured PNG of a disparity map.
#[pyfunction]
pub(crate) fn write_picture(py: Python<'_>, path: PathBuf, disparity: &Bound<'_, PyAny>) -> PyResult<()> {
    io::check_ending(&path, "a picture", "png").map_err(raised)?;
    let map = map("disparity", disparity)?;
    let staged = |picture: &Picture| picture.staged(&Files::default(), &path, &map)?.put();
    py.detach(|| staged(&Picture::default())).map_err(raised)
}

/// Writes the coloured points of a disparity map as a PLY in millimetres. The calibration's baseline is in millimetres.
#[pyfunction]
pub(crate) fn write_points(
    py: Python<'_>,
    path: PathBuf,
    disparity: &Bound<'_, PyAny>,
    left: &Bound<'_, PyAny>,
    calibration: &Calibration,
) -> PyResult<()> {
    io::check_ending(&path, "a point cloud", "ply").map_err(raised)?;
    let (map, left) = (map("disparity", disparity)?, image("left", left)?);
    let calibration = calibration.0.of(map.size()).map_err(raised)?;
    let points = points(&map, &left, &calibration).map_err(raised)?;
    py.detach(|| io::write_points(&Files::default(), &path, points)).map_err(raised)
}
