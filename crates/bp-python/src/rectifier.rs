//! Rectifying raw pairs.

use std::{path::PathBuf, sync::Arc};

use bp_core::{Image, Rectification, Size};
use bp_stereo::{
    Rectifying,
    io::{CalibrationFile, Geometry},
};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

use crate::{
    arrays::pair,
    calibration::Calibration,
    errors::{raised, there},
    threads::together,
};

/// The maps of one image: columns and rows.
type Maps<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>);

/// A pair of images.
type Images<'py> = (Bound<'py, PyArrayDyn<u8>>, Bound<'py, PyArrayDyn<u8>>);

/// Turns pairs of raw images into rectified pairs. It is prepared once for a calibration and a size of images.
///
/// The calibration is a file by OpenCV (YAML, XML or JSON), Kalibr or KITTI, or two files: those of the left and the right camera
/// (ROS), or intrinsic and extrinsic parameters (OpenCV). Lengths in OpenCV's files are taken as millimetres.
///
/// >>> rectifier = bpstereo.Rectifier("stereo.yml", size=(640, 480))         # doctest: +SKIP
/// >>> left, right = rectifier.rectify(raw_left, raw_right)                  # doctest: +SKIP
/// >>> depth = rectifier.calibration.depth(bpstereo.match(left, right))      # doctest: +SKIP
#[pyclass(frozen, module = "bpstereo")]
pub(crate) struct Rectifier {
    rectifier: Arc<bp_core::Rectifier>,
    path: PathBuf,
}

#[pymethods]
impl Rectifier {
    /// `size` is the width and the height of the raw images.
    #[new]
    #[pyo3(signature = (*paths, size))]
    fn new(py: Python<'_>, paths: Vec<PathBuf>, size: (usize, usize)) -> PyResult<Self> {
        paths.iter().try_for_each(|path| there(path))?;
        let size = Size::new(size.0, size.1).map_err(raised)?;
        let rectifier = together(py, || Rectifying::read(&paths)?.rectifier(size))?.map_err(raised)?;
        Ok(Self { rectifier, path: paths.into_iter().next().unwrap_or_default() })
    }

    /// The rectified pair, both uint8, in colour if the raw image has colours. Pixels that a camera does not show are black.
    fn rectify<'py>(
        &self,
        py: Python<'py>,
        left: &Bound<'py, PyAny>,
        right: &Bound<'py, PyAny>,
    ) -> PyResult<Images<'py>> {
        let has_colours =
            [left, right].map(|image| image.getattr("ndim").is_ok_and(|n| n.extract().is_ok_and(|n: u8| n > 2)));
        let raw = pair(left, right)?;
        let rectified = together(py, || self.rectifier.rectified(raw.left(), raw.right()))?.map_err(raised)?;
        Ok((bytes(py, rectified.left(), has_colours[0])?, bytes(py, rectified.right(), has_colours[1])?))
    }

    /// The geometry of the rectified pairs, for depth and points. Its baseline is in millimetres.
    #[getter]
    fn calibration(&self) -> Calibration {
        let (found, size) = (self.rectifier.calibration(), self.rectifier.rectification().size);
        Calibration(Geometry {
            focal: found.focal(),
            baseline: found.baseline(),
            doffs: found.doffs(),
            principal_point: Some(found.principal_point()),
            file: Some(CalibrationFile { path: self.path.clone(), size: Some(size) }),
        })
    }

    /// Where the pixels of a rectified image, 0 for the left one and 1 for the right one, come from: columns and rows in the raw image
    /// as two float32 [height][width], NaN where the camera does not show the pixel. They fit `cv2.remap`.
    fn maps<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Maps<'py>> {
        let Size { width, height } = self.rectifier.rectification().size;
        let sources = (0..width * height).map(|i| self.rectifier.source(index, i % width, i / width));
        let (columns, rows) =
            sources.map(|source| source.map_or([f32::NAN; 2], |source| source.map(|side| side as f32)).into()).unzip();
        let plane = |values: Vec<f32>| PyArray1::from_vec(py, values).reshape([height, width]);
        Ok((plane(columns)?, plane(rows)?))
    }

    /// Turns points of the left camera into the directions of the rectified pair: float64 [3][3].
    #[getter(R1)]
    fn left_rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.rectification().rotations[0])
    }

    /// As R1, for the right camera.
    #[getter(R2)]
    fn right_rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.rectification().rotations[1])
    }

    /// The projection of the left rectified image: float64 [3][4].
    #[getter(P1)]
    fn left_projection<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.rectification().projections()[0])
    }

    /// As P1, for the right image.
    #[getter(P2)]
    fn right_projection<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.rectification().projections()[1])
    }

    /// Turns column, row, disparity and 1 into a point in homogeneous coordinates, in millimetres: float64 [4][4].
    #[getter(Q)]
    fn reprojection<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.rectification().q())
    }
}

impl Rectifier {
    fn rectification(&self) -> &Rectification {
        self.rectifier.rectification()
    }
}

fn matrix<'py, const N: usize>(py: Python<'py>, rows: &[[f64; N]]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), N])
}

/// An image as an array, [height][width][3] or [height][width].
fn bytes<'py>(py: Python<'py>, image: &Image, has_colours: bool) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
    let Size { width, height } = image.size();
    if has_colours {
        let array: Bound<'py, PyArray3<u8>> =
            PyArray1::from_slice(py, image.pixels().as_flattened()).reshape([height, width, 3])?;
        return Ok(array.to_dyn().clone());
    }
    Ok(PyArray1::from_slice(py, image.greys()).reshape([height, width])?.to_dyn().clone())
}
