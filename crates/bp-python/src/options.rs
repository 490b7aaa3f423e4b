//! Keywords as options.

use bp_stereo::Options;
use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
    types::{PyBool, PyDict, PyInt, PyString},
};
use pythonize::depythonize;

/// The options that are true or false. Python would take every other value for one of both.
const FLAGS: [&str; 7] = ["stretch", "check", "unique", "fill", "subpixel", "confidence", "energy"];

/// The options that keywords name. Two of them have a short form: `labels=64`, and `algorithm="cfbp"`.
pub(crate) fn options(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Options> {
    let Some(keywords) = keywords else { return Ok(Options::default()) };
    let given = PyDict::new(keywords.py());
    for (key, value) in keywords {
        let name: String = key.extract()?;
        let alone = PyDict::new(keywords.py());
        alone.set_item(&key, in_full(&name, value)?)?;
        // One by one, so that the message names the option.
        parsed(&alone).map_err(|error| PyValueError::new_err(format!("`{name}`: {error}")))?;
        given.update(alone.as_mapping())?;
    }
    parsed(&given)
}

fn parsed(given: &Bound<'_, PyDict>) -> PyResult<Options> {
    depythonize(given).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// The value of an option, as the library's serde form has it.
fn in_full<'py>(name: &str, value: Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let is_bool = value.is_instance_of::<PyBool>();
    if FLAGS.contains(&name) && !is_bool && !value.is_none() {
        let kind = value.get_type().name()?;
        return Err(PyTypeError::new_err(format!("`{name}` is True, False or None, not of type {kind}")));
    }
    let is_count = value.is_instance_of::<PyInt>() || value.get_type().hasattr("__index__")?;
    let key = match name {
        "labels" if is_count && !is_bool => "count",
        "algorithm" if value.is_instance_of::<PyString>() => "name",
        _ => return Ok(value),
    };
    let full = PyDict::new(value.py());
    full.set_item(key, value)?;
    Ok(full.into_any())
}
