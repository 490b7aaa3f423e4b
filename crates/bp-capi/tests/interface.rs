//! The functions that C calls: strides, types, wrong arguments, stops.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]
#![expect(unsafe_code, reason = "as C calls them")]

use std::{
    ffi::{CStr, CString},
    ptr, thread,
    time::{Duration, Instant},
};

use bp_stereo::{Image, Matcher, Options};
use bpstereo::{
    BpstereoImage, BpstereoMatcher, BpstereoStatus, BpstereoValue, bpstereo_answer, bpstereo_close, bpstereo_compute,
    bpstereo_last_error, bpstereo_open, bpstereo_stop,
};

const WIDTH: usize = 70;
const HEIGHT: usize = 50;

fn view(shift: usize) -> Vec<u8> {
    let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729 + x * x * 31 + x * y * 17) % 251) as u8;
    (0..WIDTH * HEIGHT).map(|index| noise(index % WIDTH + shift, index / WIDTH)).collect()
}

/// An image whose rows lie `stride` values apart; negative strides begin with the last row.
fn laid_out<T: Copy>(values: &[T], stride: isize, filling: T) -> (Vec<T>, usize) {
    let mut rows = vec![filling; stride.unsigned_abs() * HEIGHT];
    for (y, row) in values.chunks_exact(WIDTH).enumerate() {
        let place = if stride < 0 { HEIGHT - 1 - y } else { y };
        rows[place * stride.unsigned_abs()..][..WIDTH].copy_from_slice(row);
    }
    (rows, if stride < 0 { (HEIGHT - 1) * stride.unsigned_abs() } else { 0 })
}

fn image<T>((rows, first): &(Vec<T>, usize), value: BpstereoValue, stride: isize) -> BpstereoImage {
    let stride = stride * size_of::<T>() as isize;
    let data = rows[*first..].as_ptr().cast();
    BpstereoImage { data, value_type: value as u32, width: WIDTH, height: HEIGHT, channels: 1, stride }
}

fn open(options: &str) -> Result<*mut BpstereoMatcher, (BpstereoStatus, String)> {
    let (options, mut matcher) = (CString::new(options).unwrap(), ptr::null_mut());
    // SAFETY: the arguments are valid.
    match unsafe { bpstereo_open(options.as_ptr(), &mut matcher) } {
        BpstereoStatus::Ok => Ok(matcher),
        status => Err((status, last_error())),
    }
}

fn last_error() -> String {
    // SAFETY: the message is valid until the next failure.
    unsafe { CStr::from_ptr(bpstereo_last_error()) }.to_str().unwrap().to_owned()
}

/// The map in rows of `stride` floats.
fn computed(
    matcher: *mut BpstereoMatcher,
    images: [&BpstereoImage; 2],
    stride: usize,
) -> Result<Vec<f32>, (BpstereoStatus, String)> {
    let mut map = vec![-1.0_f32; stride * HEIGHT];
    let bytes = (stride * size_of::<f32>()) as isize;
    // SAFETY: the buffers are as they are described.
    match unsafe { bpstereo_compute(matcher, images[0], images[1], map.as_mut_ptr(), ptr::null_mut(), bytes) } {
        BpstereoStatus::Ok => Ok(map),
        status => Err((status, last_error())),
    }
}

#[test]
fn every_type_and_stride_gives_the_librarys_map() {
    let [left, right] = [view(0), view(3)];
    let [one, other] = [&left, &right].map(|grey| Image::from_grey(WIDTH, HEIGHT, grey.clone()).unwrap());
    let expected = Matcher::new(&Options::default().with_labels(16)).unwrap().compute(&one, &other).unwrap().map;
    let same = |map: &[f32], stride: usize| {
        let rows = map.chunks_exact(stride).zip(expected.values().chunks_exact(WIDTH));
        rows.flat_map(|(row, expected)| row[..WIDTH].iter().zip(expected))
            .all(|(a, b)| a == b || a.is_nan() && b.is_infinite())
    };
    let matcher = open(r#"{"labels": {"count": 16}}"#).unwrap();
    for stride in [WIDTH as isize, WIDTH as isize + 9, -(WIDTH as isize) - 2] {
        let bytes = [&left, &right].map(|grey| laid_out(grey, stride, 7));
        let words = bytes.clone().map(|(rows, first)| (rows.iter().map(|&v| u16::from(v) * 257).collect(), first));
        let floats = bytes.clone().map(|(rows, first)| (rows.iter().map(|&v| f32::from(v)).collect(), first));
        let of_bytes = bytes.each_ref().map(|rows| image(rows, BpstereoValue::U8, stride));
        let of_words = words.each_ref().map(|rows: &(Vec<u16>, _)| image(rows, BpstereoValue::U16, stride));
        let of_floats = floats.each_ref().map(|rows: &(Vec<f32>, _)| image(rows, BpstereoValue::F32, stride));
        for images in [of_bytes, of_words, of_floats] {
            let map = computed(matcher, images.each_ref(), WIDTH + 4).unwrap();
            assert!(same(&map, WIDTH + 4) && map[WIDTH..WIDTH + 4] == [-1.0; 4], "{stride} {}", images[0].value_type);
        }
    }
    // SAFETY: the matcher is open.
    let answer = unsafe { CStr::from_ptr(bpstereo_answer(matcher)) }.to_str().unwrap();
    assert!(answer.contains("\"labels\":16") && answer.contains("\"warnings\""), "{answer}");
    // SAFETY: it is not used again.
    unsafe { bpstereo_close(matcher) };
}

#[test]
fn wrong_arguments_are_named() {
    for (options, status, word) in [
        ("{", BpstereoStatus::Options, "EOF"),
        (r#"{"labls": 3}"#, BpstereoStatus::Options, "labls"),
        (r#"{"median": 4}"#, BpstereoStatus::Options, "median"),
        (r#"{"backend": "cuda"}"#, BpstereoStatus::Unavailable, "cuda"),
    ] {
        let (found, message) = open(options).unwrap_err();
        assert!(found == status && message.contains(word), "{options}: {found:?} {message}");
    }
    let matcher = open("").unwrap();
    let rows = laid_out(&view(0), WIDTH as isize, 0);
    let good = image(&rows, BpstereoValue::U8, WIDTH as isize);
    for (wrong, word) in [
        (BpstereoImage { data: ptr::null(), ..good }, "null"),
        (BpstereoImage { value_type: 9, ..good }, "value_type 9"),
        (BpstereoImage { channels: 2, ..good }, "2 channels"),
        (BpstereoImage { width: 0, ..good }, "left"),
        (BpstereoImage { width: usize::MAX, ..good }, "left"),
        (BpstereoImage { stride: 3, ..good }, "stride 3"),
        (BpstereoImage { stride: isize::MAX, ..good }, "stride"),
        (BpstereoImage { stride: isize::MIN, ..good }, "stride"),
        (BpstereoImage { height: HEIGHT - 1, ..good }, "70x49"),
        (BpstereoImage { value_type: 2, stride: WIDTH as isize * 4 + 1, ..good }, "multiples of 4"),
    ] {
        let (status, message) = computed(matcher, [&wrong, &good], WIDTH).unwrap_err();
        assert!(status == BpstereoStatus::Input && message.contains(word), "{word}: {status:?} {message}");
    }
    // SAFETY: null is allowed, and refused.
    unsafe {
        let null = ptr::null_mut();
        assert_eq!(bpstereo_compute(matcher, &good, &good, null, null, 0), BpstereoStatus::Input);
        assert_eq!(bpstereo_compute(ptr::null(), &good, &good, null, null, 0), BpstereoStatus::Input);
        assert_eq!(bpstereo_open(ptr::null(), ptr::null_mut()), BpstereoStatus::Input);
        bpstereo_stop(ptr::null());
        bpstereo_close(ptr::null_mut());
        bpstereo_close(matcher);
    }
}

#[test]
fn colours_and_confidence_are_those_of_the_library() {
    let colours = |shift| -> Vec<[u8; 3]> { view(shift).iter().map(|&v| [v, v.wrapping_mul(3), 255 - v]).collect() };
    let [left, right] = [colours(0), colours(2)];
    let [one, other] = [&left, &right].map(|pixels| Image::from_rgb(WIDTH, HEIGHT, pixels.clone()).unwrap());
    let options = Options::default().with_labels(8).with_confidence(true);
    let expected = Matcher::new(&options).unwrap().compute(&one, &other).unwrap();
    let of = |pixels: &[[u8; 3]]| BpstereoImage {
        data: pixels.as_ptr().cast(),
        value_type: BpstereoValue::U8 as u32,
        width: WIDTH,
        height: HEIGHT,
        channels: 3,
        stride: 3 * WIDTH as isize,
    };
    let matcher = open(r#"{"labels": {"count": 8}, "confidence": true}"#).unwrap();
    let (mut map, mut trust) = (vec![0.0_f32; WIDTH * HEIGHT], vec![0.0_f32; WIDTH * HEIGHT]);
    let row = (WIDTH * size_of::<f32>()) as isize;
    let last = (HEIGHT - 1) * WIDTH;
    // The last row comes first in memory.
    // SAFETY: the buffers are as they are described.
    let status = unsafe {
        let (map, trust) = (map.as_mut_ptr().add(last), trust.as_mut_ptr().add(last));
        bpstereo_compute(matcher, &of(&left), &of(&right), map, trust, -row)
    };
    assert_eq!(status, BpstereoStatus::Ok, "{}", last_error());
    let turned = |rows: &[f32]| rows.chunks_exact(WIDTH).rev().flatten().copied().collect::<Vec<_>>();
    assert_eq!(turned(&trust), *expected.confidence.as_ref().unwrap());
    assert!(turned(&map).iter().zip(expected.map.values()).all(|(a, b)| a == b || a.is_nan() && b.is_infinite()));
    // SAFETY: it is not used again.
    unsafe { bpstereo_close(matcher) };

    let matcher = open("").unwrap();
    // SAFETY: the buffers are as they are described.
    let status =
        unsafe { bpstereo_compute(matcher, &of(&left), &of(&right), map.as_mut_ptr(), trust.as_mut_ptr(), row) };
    assert!(status == BpstereoStatus::Options && last_error().contains("confidence"), "{}", last_error());
    // SAFETY: it is not used again.
    unsafe { bpstereo_close(matcher) };
}

#[test]
fn another_thread_can_stop_a_match() {
    struct Shared(*mut BpstereoMatcher);
    // SAFETY: `bpstereo_stop` may be called from any thread.
    unsafe impl Send for Shared {}
    let loops = r#"{"on_each_grid": {"loops": 100000, "schedule": "sync"}}"#;
    let matcher =
        open(&format!(r#"{{"algorithm": {{"name": "bp", "loops": {loops}}}, "labels": {{"count": 32}}}}"#)).unwrap();
    let rows = laid_out(&view(0), WIDTH as isize, 0);
    let one = image(&rows, BpstereoValue::U8, WIDTH as isize);
    let shared = Shared(matcher);
    let stopper = thread::spawn(move || {
        let shared = shared;
        thread::sleep(Duration::from_millis(300));
        // SAFETY: the matcher is freed after this thread has ended.
        unsafe { bpstereo_stop(shared.0) };
    });
    let begin = Instant::now();
    let (status, _) = computed(matcher, [&one, &one], WIDTH).unwrap_err();
    assert!(status == BpstereoStatus::Stopped && begin.elapsed() < Duration::from_secs(5));
    stopper.join().unwrap();
    // A stop before a match ends that match, and only that one.
    // SAFETY: the matcher is open.
    unsafe { bpstereo_stop(matcher) };
    let begin = Instant::now();
    assert_eq!(computed(matcher, [&one, &one], WIDTH).unwrap_err().0, BpstereoStatus::Stopped);
    assert!(begin.elapsed() < Duration::from_secs(5));
    // SAFETY: it is not used again.
    unsafe { bpstereo_close(matcher) };
}
