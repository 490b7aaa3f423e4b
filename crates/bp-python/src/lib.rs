//! The Python package `bpstereo`: [`bp_stereo`] with NumPy arrays in place of images and maps.
//!
//! Options, defaults, messages and file formats are those of the library. This crate converts arguments and results, lets
//! other Python threads run meanwhile, and passes Ctrl-C on.

mod arrays;
mod attended;
mod blocks;
mod calibration;
mod errors;
mod files;
mod lent;
mod matcher;
mod options;
mod rectifier;
mod threads;

use bp_stereo::{description::Device, devices::ALL};
use pyo3::{prelude::*, types::PyList};

/// The native part of `bpstereo`.
#[pymodule(gil_used = false)]
mod _bpstereo {
    #[pymodule_export]
    use super::{
        arrays::_read_at,
        blocks::{_around, _border},
        calibration::Calibration,
        devices,
        errors::{BackendUnavailable, DeviceError, PairWarning},
        files::{read_image, read_map, write_map, write_picture, write_points},
        matcher::{Matcher, match_pair},
        rectifier::Rectifier,
    };

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name that Python uses")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}

/// The devices of all backends, with the names that the option `backend` takes.
///
/// The first device of the backend "rayon", which is the default, has the widest instructions of this processor.
///
/// >>> bpstereo.devices()[0]["backend"]
/// 'scalar'
#[pyfunction]
fn devices(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    let found = threads::together(py, || ALL.iter().map(|backend| (*backend, backend.devices())).collect::<Vec<_>>())?;
    for (backend, devices) in found {
        for (index, device) in devices.iter().enumerate() {
            let described = pythonize::pythonize(py, &Device::from(device))?;
            described.set_item("backend", bp_stereo::devices::device_name(backend, index))?;
            list.append(described)?;
        }
    }
    Ok(list)
}
