//! The geometry of the cameras, for depth and points.

use std::path::PathBuf;

use bp_core::{Size, depth_map};
use bp_stereo::io::Geometry;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::{
    arrays::{map, plane},
    errors::{raised, there},
};

/// The geometry of a rectified pair: the focal length in pixels, the distance of the cameras (depth has its unit), the
/// column of the right principal point minus that of the left one, and the left principal point (column, row). None
/// means the centre of the image.
///
/// >>> calibration = bpstereo.Calibration(focal=100.0, baseline=50.0)
/// >>> calibration.depth(numpy.array([[1, 2, numpy.nan]], dtype=numpy.float32))
/// array([[5000., 2500.,   nan]], dtype=float32)
#[pyclass(frozen, module = "bpstereo")]
pub(crate) struct Calibration(pub(crate) Geometry);

#[pymethods]
impl Calibration {
    #[new]
    #[pyo3(signature = (focal, baseline, doffs = 0.0, principal_point = None))]
    fn new(focal: f64, baseline: f64, doffs: f64, principal_point: Option<[f64; 2]>) -> PyResult<Self> {
        let geometry = Geometry { focal, baseline, doffs, principal_point, file: None };
        geometry.of(Size { width: 1, height: 1 }).map_err(raised)?;
        Ok(Self(geometry))
    }

    /// Reads the calibration of a rectified pair, by Middlebury, OpenCV, ROS (two files) or KITTI. Its baseline is in
    /// millimetres; lengths in OpenCV's files are taken as that.
    #[staticmethod]
    #[pyo3(signature = (*paths))]
    fn read(paths: Vec<PathBuf>) -> PyResult<Self> {
        paths.iter().try_for_each(|path| there(path))?;
        Geometry::read(&paths).map(Self).map_err(raised)
    }

    /// The depths of a map: float32 [height][width] in the unit of the baseline, NaN where unknown.
    fn depth<'py>(&self, py: Python<'py>, disparity: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let map = map("disparity", disparity)?;
        let calibration = self.0.of(map.size()).map_err(raised)?;
        plane(py, map.size(), &depth_map(&map, &calibration))
    }

    /// The points that the pixels show: float32 [height][width][3], x to the right, y down and z forward from the
    /// left camera in the unit of the baseline; NaN where unknown.
    fn points<'py>(&self, py: Python<'py>, disparity: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let map = map("disparity", disparity)?;
        let Size { width, height } = map.size();
        let calibration = self.0.of(map.size()).map_err(raised)?;
        let depths = depth_map(&map, &calibration);
        let point = |(index, &depth): (usize, &f32)| match depth.is_finite() {
            true => calibration.position(index % width, index / width, depth),
            false => [f32::NAN; 3],
        };
        let values: Vec<f32> = depths.iter().enumerate().flat_map(point).collect();
        PyArray1::from_vec(py, values).reshape([height, width, 3])
    }

    /// The focal length in pixels.
    #[getter]
    fn focal(&self) -> f64 {
        self.0.focal
    }

    /// The distance of the cameras.
    #[getter]
    fn baseline(&self) -> f64 {
        self.0.baseline
    }

    /// The column of the right principal point minus that of the left one.
    #[getter]
    fn doffs(&self) -> f64 {
        self.0.doffs
    }

    /// Column and row of the left principal point; None means the centre of the image.
    #[getter]
    fn principal_point(&self) -> Option<(f64, f64)> {
        self.0.principal_point.map(|[column, row]| (column, row))
    }

    fn __repr__(&self) -> String {
        let Geometry { focal, baseline, doffs, .. } = self.0;
        format!("<bpstereo.Calibration focal={focal} baseline={baseline} doffs={doffs}>")
    }
}
