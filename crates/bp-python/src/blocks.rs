//! What `bpstereo.dask` needs to match blocks as the library matches tiles.

use bp_core::{Around, border};
use bp_stereo::around;
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{errors::raised, options::options};

/// What a block needs around it, see [`Around`]: columns on its left and right, rows above and below, multiples of columns and
/// rows at which it begins, and the columns or rows that two blocks may share out on either side of a border.
#[pyfunction]
#[pyo3(signature = (**options))]
pub(crate) fn _around(options: Option<&Bound<'_, PyDict>>) -> PyResult<([usize; 2], usize, [usize; 2], usize)> {
    let around = around(&self::options(options)?).map_err(raised)?;
    let Around { left, right, rows, align } = around
        .ok_or_else(|| PyValueError::new_err("`algorithm`: this one needs the whole image, so there are no blocks"))?;
    Ok(([left, right], rows, [align.width, align.height], Around::SHARED))
}

/// Where the second of two maps should begin on each line, see [`border`]. The maps are [along][across], the answer is [along].
#[pyfunction]
pub(crate) fn _border<'py>(
    py: Python<'py>,
    first: PyReadonlyArray2<'py, f32>,
    second: PyReadonlyArray2<'py, f32>,
) -> PyResult<Bound<'py, PyArray1<usize>>> {
    let (first, second) = (first.as_array(), second.as_array());
    if first.dim() != second.dim() {
        return Err(PyValueError::new_err(format!(
            "the maps differ in shape: {:?} and {:?}",
            first.dim(),
            second.dim()
        )));
    }
    let (along, across) = first.dim();
    let border = border(across, along, |x, y| first[[y, x]], |x, y| second[[y, x]]);
    Ok(PyArray1::from_vec(py, border.map_err(raised)?))
}
