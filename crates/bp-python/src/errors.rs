//! Python's exceptions for the library's errors.

use std::{fs, io::ErrorKind, path::Path};

use bp_stereo::{Cause, Error, io};
use pyo3::{
    PyErr, PyResult, create_exception,
    exceptions::{
        PyFileNotFoundError, PyKeyboardInterrupt, PyMemoryError, PyOSError, PyRuntimeError, PyUserWarning, PyValueError,
    },
};

create_exception!(
    bpstereo,
    BackendUnavailable,
    PyRuntimeError,
    "A backend or device that does not exist or cannot be opened."
);
create_exception!(
    bpstereo,
    DeviceError,
    PyRuntimeError,
    "A device that failed or was lost during the work, or is too small for it."
);
create_exception!(bpstereo, PairWarning, PyUserWarning, "A possible problem with a pair of images or its labels.");

/// The exception for an error.
pub(crate) fn raised(error: impl Into<Error>) -> PyErr {
    let error = error.into();
    let message = error.to_string();
    match error {
        Error::File(io::Error::MissingFolder { .. }) => return PyFileNotFoundError::new_err(message),
        Error::Core(bp_core::Error::Device { .. }) => return DeviceError::new_err(message),
        _ => (),
    }
    match error.cause() {
        Cause::Options | Cause::Input => PyValueError::new_err(message),
        Cause::Unavailable => BackendUnavailable::new_err(message),
        Cause::Unsupported | Cause::DeviceLost => DeviceError::new_err(message),
        Cause::Memory => PyMemoryError::new_err(message),
        Cause::System => PyOSError::new_err(message),
        Cause::Stopped => PyKeyboardInterrupt::new_err(()),
    }
}

/// Fails as Python's `open` does where there is no such file, or none that may be read.
pub(crate) fn there(path: &Path) -> PyResult<()> {
    let about = |error: std::io::Error| std::io::Error::new(error.kind(), format!("{}: {error}", path.display()));
    let what = fs::metadata(path).map_err(about)?;
    if what.is_dir() {
        return Err(about(ErrorKind::IsADirectory.into()).into());
    }
    // A pipe can be opened once only.
    if what.is_file() { fs::File::open(path).map(drop).map_err(|error| about(error).into()) } else { Ok(()) }
}
