//! Matching of pairs.

use std::{
    mem::ManuallyDrop,
    process,
    sync::{Mutex, MutexGuard, TryLockError},
};

use bp_stereo::{Disparity, ReadPair, Start, description};
use numpy::PyArray2;
use pyo3::{exceptions::PyRuntimeError, prelude::*, types::PyDict};
use pythonize::pythonize;

use crate::{
    arrays::{fill, pair, plane, reading_bytes, stretched_pair, target},
    attended::attended,
    errors::{PairWarning, raised},
    options::options,
};

/// The disparity map of a rectified pair: float32 [height][width] in pixels, NaN where it is unknown.
///
/// The pixel (x, y) of `left` and the pixel (x - d, y) of `right` show the same point. Both images are arrays
/// [height][width] or [height][width][3] (red, green, blue) of uint8, uint16 or float32 (0 to 1, or 0 to 255), with any
/// strides. The options are those of `Matcher`. Possible problems with the pair become warnings of the category
/// `PairWarning`.
///
/// >>> disparity = bpstereo.match(left, right, labels=16)
/// >>> disparity.shape == left.shape, disparity.dtype
/// (True, dtype('float32'))
/// >>> float(numpy.nanmedian(disparity[:, 16:]).round())
/// 3.0
#[pyfunction]
#[pyo3(name = "match", signature = (left, right, *, progress = None, **options))]
pub(crate) fn match_pair<'py>(
    py: Python<'py>,
    left: &Bound<'py, PyAny>,
    right: &Bound<'py, PyAny>,
    progress: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let matcher = Matcher::new(py, options)?;
    let map = matcher.compute(py, left, right, None, false, progress)?;
    let category = py.get_type::<PairWarning>();
    for text in matcher.warnings()? {
        py.import("warnings")?.call_method1("warn", (text, &category, 1))?;
    }
    Ok(map)
}

/// Matches pairs, for example the frames of a video. It opens its device once and keeps what it prepared for the next pair
/// of the same size.
///
/// Options, all with a default: `algorithm` ("sweep", or one of the thesis, such as "cfbp"), `quality` ("fast",
/// "balanced" or "best"), `profile`, `slope`, `truncation`, `edge_threshold`, `stretch`, `align` ("auto" or "off"), `labels`
/// ("auto", "quarter_of_width" or a number), `min_disparity`, `check`, `unique`, `speckle`, `fill`, `median`, `subpixel`,
/// `confidence`, `energy`, `backend` ("rayon", "scalar", "vulkan" or "wgpu"), `device`, `threads` and `max_memory` (bytes).
/// The library's documentation describes them; `options` shows their values. With `stretch`, the values of both images have any
/// range: by one scale, the 0.5 % darkest become black and the 0.5 % brightest white, and where `left` is NaN, so is the map.
///
/// >>> matcher = bpstereo.Matcher(labels=16, confidence=True)
/// >>> disparity = matcher.compute(left, right)
/// >>> matcher.confidence.shape == disparity.shape
/// True
///
/// A matcher works for one thread at a time; several threads need one each.
#[pyclass(frozen, module = "bpstereo")]
pub(crate) struct Matcher(Mutex<State>);

struct State {
    matcher: ManuallyDrop<bp_stereo::Matcher>,
    /// The process that opened the device. Threads do not survive a fork.
    process: u32,
    answer: Option<Answer>,
}

/// What is known of the last pair.
struct Answer {
    confidence: Option<Py<PyArray2<f32>>>,
    described: description::Answer,
}

#[pymethods]
impl Matcher {
    #[new]
    #[pyo3(signature = (**options))]
    fn new(py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let options = self::options(options)?;
        let matcher = py.detach(|| bp_stereo::Matcher::new(&options)).map_err(raised)?;
        Ok(Self(Mutex::new(State { matcher: ManuallyDrop::new(matcher), process: process::id(), answer: None })))
    }

    /// The disparity map of a pair, as `match` returns it.
    ///
    /// It is written to `out`, if that is given: a float32 array [height][width]. With `warm`, messages start as those of
    /// the previous pair ended, which suits the next frame of a video. `progress(done, total)` is called from time to
    /// time; an exception that it raises stops the match, as Ctrl-C does.
    #[pyo3(signature = (left, right, out = None, *, warm = false, progress = None))]
    fn compute<'py>(
        &self,
        py: Python<'py>,
        left: &Bound<'py, PyAny>,
        right: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        warm: bool,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut state = self.state()?;
        let state = &mut *state;
        state.answer = None;
        let ReadPair { pair, valid } = state.pair(left, right)?;
        out.map_or(Ok(()), |out| target(out, pair.size()).map(drop))?;
        state.reopen_after_fork(py)?;
        let (matcher, start) = (&mut state.matcher, if warm { Start::Warm } else { Start::Cold });
        let mut solved = attended(py, progress, |watch, attend| matcher.compute_attended(&pair, start, watch, attend))?;
        valid.iter().for_each(|valid| solved.restrict(valid));
        let described = description::Answer::from(&solved);
        let Disparity { map, confidence, .. } = solved;
        let confidence = confidence.map(|values| plane(py, pair.size(), &values)).transpose()?.map(Bound::unbind);
        state.answer = Some(Answer { confidence, described });
        let map = match out {
            // Looked at again: a callback may have changed its shape.
            Some(out) => target(out, map.size()).and_then(|out| fill(&out, &map).map(|()| out))?,
            None => plane(py, pair.size(), map.values())?,
        };
        Ok(map.into_any())
    }

    /// The most bytes that matching this pair is predicted to take, with 25 MiB for the library itself, but without Python's
    /// own and the arrays. Nothing is matched. MemoryError if it does not fit.
    fn peak_bytes(&self, py: Python<'_>, left: &Bound<'_, PyAny>, right: &Bound<'_, PyAny>) -> PyResult<u64> {
        let mut state = self.state()?;
        let ReadPair { pair, .. } = state.pair(left, right)?;
        let reading = reading_bytes(state.matcher.options(), left, right)?;
        state.reopen_after_fork(py)?;
        // A matcher may go to another thread, but not be shared with one.
        let matcher = &mut *state.matcher;
        let peak = py.detach(move || matcher.peak_bytes(&pair)).map_err(raised)?;
        Ok(peak.max(reading))
    }

    /// The confidence of the last map, 0 to 1: float32 [height][width]. None unless the option `confidence` is set.
    #[getter]
    fn confidence(&self, py: Python<'_>) -> PyResult<Option<Py<PyArray2<f32>>>> {
        let state = self.state()?;
        Ok(state.answer.as_ref().and_then(|answer| answer.confidence.as_ref().map(|array| array.clone_ref(py))))
    }

    /// Seconds that the last pair took: "planning", "matching", "finishing", and their sum "total".
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.part(|answer| Ok(pythonize(py, &answer.times)?))
    }

    /// Possible problems with the last pair, as sentences.
    #[getter]
    fn warnings(&self) -> PyResult<Vec<String>> {
        Ok(self.part(|answer| Ok(answer.warnings.clone()))?.unwrap_or_default())
    }

    /// The energy of the last labels: "total", "data" and "smoothness". None unless the option `energy` is set.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.part(|answer| Ok(pythonize(py, &answer.energy)?))
    }

    /// The settings that were run for the last pair, such as the labels that were found.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.part(|answer| Ok(pythonize(py, &answer.settings)?))
    }

    /// All options with their values.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, self.state()?.matcher.options())?)
    }

    /// The device: its name, kind, driver and number of threads.
    #[getter]
    fn device<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &description::Device::from(self.state()?.matcher.device()))?)
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("<bpstereo.Matcher on {}>", self.state()?.matcher.device().name))
    }
}

impl Matcher {
    /// A part of the last answer, if there is one.
    fn part<T>(&self, of: impl FnOnce(&description::Answer) -> PyResult<T>) -> PyResult<Option<T>> {
        self.state()?.answer.as_ref().map(|answer| of(&answer.described)).transpose()
    }

    /// The state, unless another thread, or a callback of this one, works with it.
    fn state(&self) -> PyResult<MutexGuard<'_, State>> {
        self.0.try_lock().map_err(|error| {
            PyRuntimeError::new_err(match error {
                TryLockError::WouldBlock => {
                    "this Matcher is at work: use one for each thread, and not its own in a callback"
                }
                TryLockError::Poisoned(_) => "this Matcher failed in an unforeseen way: make a new one",
            })
        })
    }
}

impl State {
    /// The pair that two arrays hold.
    fn pair(&self, left: &Bound<'_, PyAny>, right: &Bound<'_, PyAny>) -> PyResult<ReadPair> {
        let options = self.matcher.options();
        if options.stretch { stretched_pair(options, left, right) } else { pair(left, right).map(Into::into) }
    }

    /// In a child process, opens the device again: its threads have stayed with the parent.
    fn reopen_after_fork(&mut self, py: Python<'_>) -> PyResult<()> {
        if self.process == process::id() {
            return Ok(());
        }
        let options = self.matcher.options().clone();
        self.matcher = ManuallyDrop::new(py.detach(|| bp_stereo::Matcher::new(&options)).map_err(raised)?);
        self.process = process::id();
        Ok(())
    }
}

/// A device of another process is left alone: its driver could wait for threads that stayed there.
impl Drop for State {
    #[expect(unsafe_code, reason = "a value that is dropped here or never")]
    fn drop(&mut self) {
        if self.process == process::id() {
            // SAFETY: the state is not used again.
            unsafe { ManuallyDrop::drop(&mut self.matcher) };
        }
    }
}
