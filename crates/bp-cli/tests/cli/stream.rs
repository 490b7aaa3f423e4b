//! Frames that come through pipes.

use std::{
    fs,
    io::{Read as _, Write as _},
    process::Stdio,
};

use bp_core::Size;
use bp_testkit::synthetic;

use super::{
    folder::{Folder, text},
    rectify::calibration,
};

/// Frames that hold both views of a scene, and the views themselves as grey images.
fn views(frames: usize) -> (Folder, Vec<u8>, Size) {
    let folder = Folder::new();
    let pair = synthetic::scene(0, 2).pair;
    let Size { width, height } = pair.size();
    let [left, right] = [pair.left(), pair.right()]
        .map(|image| (0..width * height).map(|i| image.grey(i % width, i / width)).collect::<Vec<u8>>());
    for (name, grey) in [("l.png", &left), ("r.png", &right)] {
        image::GrayImage::from_raw(width as u32, height as u32, grey.clone()).unwrap().save(folder.path(name)).unwrap();
    }
    let rows = left.chunks(width).zip(right.chunks(width)).flat_map(|(left, right)| [left, right]);
    let frame = [b"FRAME\n".to_vec(), rows.flatten().copied().collect()].concat();
    let header = format!("YUV4MPEG2 W{} H{height} F30:1 Cmono\n", 2 * width);
    (folder, [header.into_bytes(), frame.repeat(frames)].concat(), pair.size())
}

/// What the program writes if these frames come through its standard input.
fn piped(folder: &Folder, arguments: &str, frames: &[u8]) -> (Option<i32>, Vec<u8>, String) {
    let mut command = folder.command(arguments);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (mut stdin, frames) = (child.stdin.take().unwrap(), frames.to_vec());
    let writer = std::thread::spawn(move || drop(stdin.write_all(&frames)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    (output.status.code(), output.stdout, text(&output.stderr))
}

#[test]
fn frames_give_the_maps_of_their_images() {
    let (folder, frames, size) = views(3);
    let options = "--labels 24 --align off";
    assert!(folder.run(&format!("match l.png r.png {options} -o map.pfm")).status.success());
    let map = fs::read(folder.path("map.pfm")).unwrap();
    let (code, maps, told) = piped(&folder, &format!("match --video - -o - {options}"), &frames);
    assert_eq!((code, maps == map.repeat(3)), (Some(0), true), "{told}");
    assert!(told.contains("3 frames in") && told.contains("frames/s"), "{told}");
    // A file is as good as a pipe. A video has a header, and three planes a frame.
    fs::write(folder.path("frames.y4m"), &frames).unwrap();
    let video = folder.run(&format!("match --video frames.y4m -o - --format y4m {options}")).stdout;
    let header = format!("YUV4MPEG2 W{} H{} F30:1", size.width, size.height);
    assert!(video.starts_with(header.as_bytes()));
    let line = video.iter().position(|&byte| byte == b'\n').unwrap() + 1;
    assert_eq!(video.len(), line + 3 * (b"FRAME\n".len() + 3 * size.pixels()));
    // Frames of 2w x h pixels are those of w x 2h pixels row by row: halves are found in either.
    let upright =
        String::from_utf8_lossy(&frames[..frames.iter().position(|&byte| byte == b'\n').unwrap()]).into_owned();
    let upright = upright.replace(&format!("W{}", 2 * size.width), &format!("W{}", size.width));
    let upright = upright.replace(&format!("H{}", size.height), &format!("H{}", 2 * size.height));
    let top = [upright.as_bytes(), &frames[frames.iter().position(|&byte| byte == b'\n').unwrap()..]].concat();
    let (code, other, told) = piped(&folder, &format!("match --video - --layout top-bottom -o - {options}"), &top);
    assert_eq!((code, other.len()), (Some(0), maps.len()), "{told}");
}

/// One comes through a pipe, the other is a file.
#[test]
fn a_stream_for_each_camera_gives_the_maps_of_frames_with_both() {
    let (folder, both, size) = views(2);
    let alone = |name: &str| {
        let grey = image::open(folder.path(name)).unwrap().into_luma8().into_raw();
        let header = format!("YUV4MPEG2 W{} H{} F30:1 Cmono\n", size.width, size.height);
        [header.into_bytes(), [b"FRAME\n".as_slice(), &grey].concat().repeat(2)].concat()
    };
    fs::write(folder.path("right.y4m"), alone("r.png")).unwrap();
    let options = "--labels 24 --align off -o -";
    let (code, maps, told) = piped(&folder, &format!("match --video - right.y4m {options}"), &alone("l.png"));
    let (_, expected, _) = piped(&folder, &format!("match --video - {options}"), &both);
    assert_eq!((code, maps == expected, maps.is_empty()), (Some(0), true, false), "{told}");
}

#[test]
fn frames_are_rectified_as_pairs_are() {
    let (folder, frames, size) = views(2);
    calibration(&folder, [size.width / 2, size.height / 2]);
    let options = "--labels 24 --calib raw.yml --rectify";
    assert!(folder.run(&format!("match l.png r.png {options} -o map.pfm")).status.success());
    let (code, maps, told) = piped(&folder, &format!("match --video - {options} -o -"), &frames);
    let map = fs::read(folder.path("map.pfm")).unwrap();
    assert_eq!((code, maps == map.repeat(2)), (Some(0), true), "{told}");
    let (_, other, _) = piped(&folder, "match --video - --labels 24 -o -", &frames);
    assert!(other != maps);
}

#[test]
fn rows_of_all_frames_are_aligned_as_those_of_the_first() {
    let (folder, frames, _) = views(2);
    assert!(folder.run("match l.png r.png --labels 24 --align pair.json -o map.pfm").status.success());
    let (code, maps, told) = piped(&folder, "match --video - --labels 24 --align stream.json -o -", &frames);
    assert_eq!(code, Some(0), "{told}");
    let read = |name: &str| fs::read(folder.path(name)).unwrap();
    assert!(read("stream.json") == read("pair.json") && maps == read("map.pfm").repeat(2));
    // The file serves the next video.
    let (_, again, _) = piped(&folder, "match --video - --labels 24 --align stream.json -o -", &frames);
    assert!(again == maps);
}

#[test]
fn a_map_comes_before_the_next_frame_is_there() {
    let (folder, frames, size) = views(2);
    let mut command = folder.command("match --video - -o - --labels 24 --quiet");
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let (mut stdin, mut stdout) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
    let first = frames.len() - (b"FRAME\n".len() + 2 * size.pixels());
    stdin.write_all(&frames[..first]).unwrap();
    let mut map = vec![0; 4 * size.pixels()];
    stdout.read_exact(&mut map).unwrap();
    drop(stdin);
    assert!(child.wait().unwrap().success());
}

#[test]
fn what_cannot_be_a_stream_is_refused_with_what_to_do() {
    let (folder, frames, _) = views(1);
    fs::write(folder.path("frames.y4m"), &frames).unwrap();
    for (arguments, code, words) in [
        ("--video l.png r.png -o -", 3, ["l.png", "ffmpeg"]),
        ("--video none.y4m -o -", 3, ["none.y4m", "No such file"]),
        ("--video frames.y4m -o out", 2, ["--output -", "%04d"]),
        ("--video - - -o -", 2, ["standard input", "once"]),
        ("--video a.y4m b.y4m -o - --layout top-bottom", 2, ["--layout", "both"]),
        ("--video l%d.png r%d.png -o out --layout top-bottom", 2, ["--layout", "both"]),
        ("--video l%d.png r%d.png -o -", 2, ["--output -", "patterns"]),
        ("--video frames.y4m -o - --format tif", 2, ["--format tif", "y4m"]),
        ("--video frames.y4m -o - --also picture", 2, ["--format y4m", "--warm-start"]),
        ("--video frames.y4m -o - --json", 2, ["--output -", "--json"]),
        ("--video frames.y4m -o - --colours jet", 2, ["--colours", "--picture"]),
        ("--video frames.y4m -o - --max-megapixels 0", 3, ["frames.y4m", "--max-megapixels"]),
    ] {
        folder.fails(&format!("match {arguments}"), code, &words);
    }
    let (code, maps, told) = piped(&folder, "match --video - -o - --labels 8", &frames[..frames.len() - 1]);
    assert_eq!((code, maps.len()), (Some(3), 0));
    assert!(told.contains("standard input: frame 1: it ends within the frame"), "{told}");
}
