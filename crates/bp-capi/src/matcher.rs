//! The matcher.

use std::{
    ffi::{CStr, CString, c_char},
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    ptr,
    sync::{Mutex, MutexGuard, PoisonError, TryLockError},
};

use bp_core::{DisparityMap, StereoPair, image::common_factor};
use bp_stereo::{Event, Matcher, Options, ReadPair, Start, Stop, Watch, check_stretching, description};

use crate::{
    BpstereoImage, BpstereoStatus,
    rows::Rows,
    status::{Failure, status},
};

/// A matcher: a device, opened once, and what it prepared for pairs of the last size. It matches one pair at a time.
pub struct BpstereoMatcher {
    work: Mutex<Work>,
    /// The stop of the match that runs, or of the next one.
    stop: Mutex<Stop>,
}

struct Work {
    matcher: Matcher,
    /// The last answer without its map, as JSON.
    answer: CString,
}

/// Threads of C share a matcher by its address.
const _: fn() = || {
    fn shared<T: Send + Sync>() {}
    shared::<BpstereoMatcher>();
};

impl BpstereoMatcher {
    fn work(&self) -> Result<MutexGuard<'_, Work>, Failure> {
        self.work.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => Failure::input("this matcher is at work: use one for each thread"),
            TryLockError::Poisoned(_) => {
                Failure(BpstereoStatus::Defect, "this matcher failed before: close it".to_owned())
            }
        })
    }

    fn stop(&self) -> MutexGuard<'_, Stop> {
        self.stop.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Opens a matcher.
///
/// `options` is a JSON object of the library's options in UTF-8, such as {"labels": {"count": 64}, "check": true}; null or
/// "" means all defaults. Stores the matcher in `*matcher`, or null if it fails.
///
/// # Safety
/// `options` must be null or a string that ends in 0, and `matcher` null or a valid place for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bpstereo_open(options: *const c_char, matcher: *mut *mut BpstereoMatcher) -> BpstereoStatus {
    status(|| {
        if matcher.is_null() {
            return Err(Failure::input("`matcher` is null"));
        }
        // SAFETY: the caller's promise.
        unsafe { matcher.write(ptr::null_mut()) };
        // SAFETY: the caller's promise.
        let text = if options.is_null() { c"" } else { unsafe { CStr::from_ptr(options) } };
        let work = Work { matcher: Matcher::new(&parsed(text)?)?, answer: CString::default() };
        let opened = BpstereoMatcher { work: Mutex::new(work), stop: Mutex::default() };
        // SAFETY: the caller's promise.
        unsafe { matcher.write(Box::into_raw(Box::new(opened))) };
        Ok(())
    })
}

fn parsed(text: &CStr) -> Result<Options, Failure> {
    let failed = |error: String| Failure(BpstereoStatus::Options, format!("options: {error}"));
    match text.to_str().map_err(|error| failed(error.to_string()))? {
        "" => Ok(Options::default()),
        text => serde_json::from_str(text).map_err(|error| failed(error.to_string())),
    }
}

/// Matches a rectified pair of images of one size.
///
/// Writes the disparities of the left image in pixels to `disparity`, `[height][width]`, NaN where they are unknown; its rows
/// are `stride` bytes apart. Writes the confidence of each pixel, 0 to 1, to `confidence` in the same way. This needs the option
/// "confidence"; without it, `confidence` must be null.
///
/// # Safety
/// `matcher` must be null or come from `bpstereo_open`. The images must be readable, and the buffers writable, as described.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bpstereo_compute(
    matcher: *const BpstereoMatcher,
    left: *const BpstereoImage,
    right: *const BpstereoImage,
    disparity: *mut f32,
    confidence: *mut f32,
    stride: isize,
) -> BpstereoStatus {
    status(|| {
        // SAFETY: the caller's promise.
        let (matcher, left, right) = unsafe { (matcher.as_ref(), left.as_ref(), right.as_ref()) };
        let (Some(matcher), Some(left), Some(right)) = (matcher, left, right) else {
            return Err(Failure::input("`matcher`, `left` and `right` must not be null"));
        };
        let mut work = matcher.work()?;
        work.answer = CString::default();
        // SAFETY: the caller's promise.
        let read = unsafe {
            if work.matcher.options().stretch {
                check_stretching(work.matcher.options(), left.size("left")?, left.channels.max(right.channels))?;
                ReadPair::stretched(left.samples("left")?, right.samples("right")?)?
            } else {
                pair(left, right)?.into()
            }
        };
        let ReadPair { pair, valid } = read;
        let map = Rows::new("disparity", disparity.cast_const(), stride, pair.size(), 1)?;
        let trust = if confidence.is_null() {
            None
        } else if work.matcher.options().confidence {
            Some(Rows::new("confidence", confidence.cast_const(), stride, pair.size(), 1)?)
        } else {
            return Err(Failure(
                BpstereoStatus::Options,
                "`confidence` needs the option \"confidence\": true".to_owned(),
            ));
        };
        let stop = matcher.stop().clone();
        let watch = Watch::new(&|_: Event<'_>| (), &stop);
        let solved = work.matcher.compute_watched(&pair, Start::Cold, &watch);
        // A stop ends one match.
        mem::take(&mut *matcher.stop());
        let mut answer = solved?;
        valid.iter().for_each(|valid| answer.restrict(valid));
        let known = |&value: &f32| if value == DisparityMap::UNKNOWN { f32::NAN } else { value };
        // SAFETY: the caller's promise.
        unsafe { map.write(answer.map.values().iter().map(known)) };
        if let (Some(rows), Some(values)) = (trust, &answer.confidence) {
            // SAFETY: the caller's promise.
            unsafe { rows.write(values.iter().copied()) };
        }
        let described = serde_json::to_string(&description::Answer::from(&answer)).unwrap_or_default();
        work.answer = CString::new(described).unwrap_or_default();
        Ok(())
    })
}

/// Copies a pair. Floats of both images have one scale.
///
/// # Safety
/// That of [`BpstereoImage::copied`], for both.
unsafe fn pair(left: &BpstereoImage, right: &BpstereoImage) -> Result<StereoPair, Failure> {
    // SAFETY: the caller's promise.
    unsafe {
        let factor = common_factor([left.factor("left")?, right.factor("right")?]);
        Ok(StereoPair::new(left.copied("left", factor)?, right.copied("right", factor)?)?)
    }
}

/// The last answer without its map, as a JSON object: "times" in seconds, "energy" (null unless the option "energy" is true),
/// "settings" and "warnings". Valid until the matcher is used again; empty before the first match, after one that failed,
/// and while the matcher is at work.
///
/// # Safety
/// `matcher` must be null or come from `bpstereo_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bpstereo_answer(matcher: *const BpstereoMatcher) -> *const c_char {
    // SAFETY: the caller's promise.
    let work = unsafe { matcher.as_ref() }.and_then(|matcher| matcher.work.try_lock().ok());
    work.map_or(c"".as_ptr(), |work| work.answer.as_ptr())
}

/// Ends the match that runs at its next step, or the next one at its beginning, with `BPSTEREO_STATUS_STOPPED`. May be called
/// from any thread.
///
/// # Safety
/// `matcher` must be null or come from `bpstereo_open`, and not be closed meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bpstereo_stop(matcher: *const BpstereoMatcher) {
    // SAFETY: the caller's promise.
    if let Some(matcher) = unsafe { matcher.as_ref() } {
        matcher.stop().stop();
    }
}

/// Closes a matcher and its device. Null is ignored.
///
/// # Safety
/// `matcher` must be null or come from `bpstereo_open`, and not be used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bpstereo_close(matcher: *mut BpstereoMatcher) {
    if !matcher.is_null() {
        // SAFETY: the caller's promise.
        let matcher = unsafe { Box::from_raw(matcher) };
        // A driver that panics must not end the caller's program.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(matcher)));
    }
}
