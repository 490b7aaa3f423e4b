//! Inputs without end, pipes that nobody writes to, disks that are full, names that terminals obey.
#![cfg(unix)]

use std::{
    fs,
    io::Read as _,
    os::unix::fs::{MetadataExt, PermissionsExt, chown, symlink},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::{
    folder::{Folder, MATCH, text},
    many::{TINY, files, names},
};

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// Waits until a program handles signals, or for a second if it never does.
fn wait_for_handler(child: &mut Child) {
    let status = format!("/proc/{}/status", child.id());
    let start = Instant::now();
    let handles = || {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let caught = text.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or("0").trim();
        // SIGINT is signal 2.
        u64::from_str_radix(caught, 16).is_ok_and(|caught| caught & 2 != 0)
    };
    while start.elapsed() < Duration::from_secs(1) && !handles() {
        thread::sleep(Duration::from_millis(20));
    }
    thread::sleep(Duration::from_millis(300));
    assert!(child.try_wait().unwrap().is_none(), "it waits");
}

/// Sends a signal, such as `-INT`, to a program that waits, and returns its exit code, soon.
fn code_after(signal: &str, mut child: Child) -> Option<i32> {
    wait_for_handler(&mut child);
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(20) {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    panic!("still running");
}

#[test]
fn texts_without_end_are_refused() {
    let folder = Folder::new();
    folder.fails("match --pairs /dev/zero --output out", 3, &["/dev/zero", "more than 64 MiB"]);
    folder.fails("convert left.png --depth d.pfm --calib /dev/zero", 3, &["/dev/zero", "more than 1 MiB"]);
    folder.fails("report /dev/zero", 3, &["/dev/zero"]);
    let begun = Instant::now();
    for command in
        ["match /dev/zero right.png -o m.pfm", "convert /dev/zero --picture p.png", "evaluate /dev/zero /dev/zero"]
    {
        folder.fails(command, 3, &["/dev/zero", "not an image"]);
    }
    // A gigabyte and a half, as much as the largest image may have, takes seconds to read.
    assert!(begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
    let zero = || Stdio::from(fs::File::open("/dev/zero").unwrap());
    folder.command_fails(folder.command("match --pairs - --output out").stdin(zero()), 3, &["standard input"]);
}

#[test]
fn a_sidecar_that_is_a_pipe_or_endless_is_not_read() {
    let folder = Folder::new();
    assert!(folder.run(&format!("{MATCH} m.pfm --no-sidecar")).status.success());
    pipe(&folder.path("m.pfm.json"));
    assert!(folder.run("convert m.pfm --picture p.png").status.success());
    fs::remove_file(folder.path("m.pfm.json")).unwrap();
    symlink("/dev/zero", folder.path("m.pfm.json")).unwrap();
    assert!(folder.run("convert m.pfm --picture p.png").status.success());
}

#[test]
fn a_record_that_is_a_pipe_stops_no_other_pair() {
    let folder = Folder::new();
    fs::write(folder.path("list"), "left.png right.png a\nleft.png right.png b\n").unwrap();
    fs::create_dir_all(folder.path("out/records")).unwrap();
    pipe(&folder.path("out/records/a.json"));
    let output = folder.run(&format!("match --pairs list --output out {TINY}"));
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert_eq!(names(&folder.path("out")), ["b"]);
}

/// Of two reads, the second one could meet another image. A pipe gives its bytes once.
#[test]
fn a_record_names_the_bytes_that_were_matched() {
    let folder = Folder::new();
    let image = fs::read(folder.path("left.png")).unwrap();
    pipe(&folder.path("pipe.png"));
    fs::write(folder.path("list"), "pipe.png right.png a\n").unwrap();
    let (path, sent) = (folder.path("pipe.png"), image.clone());
    let sender = thread::spawn(move || fs::write(path, sent));
    let output = folder.run(&format!("match --pairs list --output out {TINY}"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    sender.join().unwrap().unwrap();
    let record: Value = serde_json::from_slice(&fs::read(folder.path("out/records/a.json")).unwrap()).unwrap();
    let of_bytes: String = Sha256::digest(&image).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(record["inputs"][0]["sha256"], of_bytes.as_str());
}

/// A pipe holds 64 KiB, this map takes 80.
#[test]
fn one_signal_ends_a_match_whose_standard_output_nobody_reads() {
    let folder = Folder::new();
    for name in ["l.png", "r.png"] {
        image::GrayImage::from_fn(160, 128, |x, y| image::Luma([(x * y % 251) as u8])).save(folder.path(name)).unwrap();
    }
    for arguments in ["match l.png r.png", "match --video frames.y4m"] {
        let grey = vec![7; 2 * 160 * 128];
        let frame = [b"YUV4MPEG2 W320 H128 F30:1 Cmono\nFRAME\n".as_slice(), &grey].concat();
        fs::write(folder.path("frames.y4m"), frame).unwrap();
        let mut command = folder.command(&format!("{arguments} --labels 8 --output -"));
        command.stderr(Stdio::null()).stdout(Stdio::piped());
        assert_eq!(code_after("-INT", command.spawn().unwrap()), Some(130), "{arguments}");
    }
}

#[test]
fn a_small_map_that_standard_output_does_not_take_is_an_error() {
    let folder = Folder::new();
    for name in ["l.png", "r.png"] {
        image::GrayImage::from_pixel(8, 8, image::Luma([9])).save(folder.path(name)).unwrap();
    }
    let full = Stdio::from(fs::OpenOptions::new().write(true).open("/dev/full").unwrap());
    folder.command_fails(folder.command("match l.png r.png --labels 4 --output -").stdout(full), 1, &["No space left"]);
}

#[test]
fn one_signal_ends_a_batch_that_waits_for_a_pipe() {
    let folder = Folder::new();
    pipe(&folder.path("pipe.png"));
    fs::write(folder.path("list"), "pipe.png right.png a\n").unwrap();
    for (pairs, signal) in [("list", "-TERM"), ("pipe.png", "-INT")] {
        let mut command = folder.command(&format!("match --pairs {pairs} --output out {TINY}"));
        assert_eq!(code_after(signal, command.stderr(Stdio::null()).spawn().unwrap()), Some(130), "{pairs}");
    }
    let mut frames = folder.command("match --video pipe.png --output -");
    assert_eq!(code_after("-INT", frames.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap()), Some(130));
    // What reads before it writes anything is ended by the system.
    let waiting = folder.command("convert pipe.png --picture p.png").stderr(Stdio::null()).spawn().unwrap();
    assert_eq!(code_after("-TERM", waiting), None);
}

/// First nobody opens the pipe, then somebody opens it and reads nothing, so that it is soon full.
#[test]
fn one_signal_ends_a_match_whose_output_is_a_pipe_that_nobody_reads() {
    let folder = Folder::new();
    image::GrayImage::new(200, 200).save(folder.path("large.png")).unwrap();
    pipe(&folder.path("pipe.pfm"));
    for (image, signal) in [("left.png right.png", "-TERM"), ("large.png large.png", "-INT")] {
        // Opened for both, it needs no partner.
        let open = || fs::File::options().read(true).write(true).open(folder.path("pipe.pfm")).unwrap();
        let _reader = image.starts_with("large").then(open);
        let mut command = folder.command(&format!("match {image} --labels 12 -o pipe.pfm --picture p.png"));
        assert_eq!(code_after(signal, command.stderr(Stdio::null()).spawn().unwrap()), Some(130), "{image}");
        assert!(temporaries(&folder.path("")).is_empty());
    }
}

/// A reader that comes late, and reads slowly, gets everything.
#[test]
fn a_pipe_whose_reader_is_late_and_slow_gets_the_whole_map() {
    let folder = Folder::new();
    image::GrayImage::new(200, 200).save(folder.path("large.png")).unwrap();
    pipe(&folder.path("pipe.pfm"));
    let run =
        |output: &str| folder.command(&format!("match large.png large.png --labels 12 -o {output}")).spawn().unwrap();
    let mut child = run("pipe.pfm");
    thread::sleep(Duration::from_millis(500));
    let mut file = fs::File::open(folder.path("pipe.pfm")).unwrap();
    let (mut received, mut part) = (Vec::<u8>::new(), [0; 20_000]);
    loop {
        match file.read(&mut part).unwrap() {
            0 => break,
            bytes => received.extend(&part[..bytes]),
        }
        thread::sleep(Duration::from_millis(20));
    }
    assert!(child.wait().unwrap().success() && run("file.pfm").wait().unwrap().success());
    assert_eq!(received, fs::read(folder.path("file.pfm")).unwrap());
}

#[test]
fn one_signal_ends_the_conformance_suite() {
    let folder = Folder::new();
    let mut command = folder.command("conform --backend rayon");
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    assert_eq!(code_after("-INT", child), Some(130));
}

/// The system refuses to write more than so many bytes to a file, which is as good as a full disk: first none fits, then the map
/// without its sidecar, then both.
#[test]
fn a_full_disk_changes_neither_the_map_nor_its_sidecar() {
    let folder = Folder::new();
    assert!(folder.run(&format!("{MATCH} m.png")).status.success());
    let kept = ["m.png", "m.png.json"];
    let contents = || kept.map(|name| fs::read(folder.path(name)).unwrap());
    let before = contents();
    assert!(before[0].len() < before[1].len(), "the map fits before its sidecar does");
    for blocks in 0.. {
        let run = format!(
            "ulimit -f {blocks}; exec {} match left.png right.png -o m.png --labels 5",
            env!("CARGO_BIN_EXE_bp")
        );
        let mut command = Command::new("sh");
        command.args(["-c", &run]).current_dir(folder.path(""));
        if command.output().unwrap().status.success() {
            assert!(blocks > 1 && contents()[0] != before[0], "{blocks} blocks");
            return;
        }
        folder.command_fails(&mut command, 1, &["cannot write", "m.png"]);
        assert!(contents() == before, "{blocks} blocks");
    }
}

/// The files below a folder that a run should have removed.
fn temporaries(folder: &Path) -> Vec<PathBuf> {
    let is_temporary = |path: &PathBuf| path.file_name().unwrap().as_encoded_bytes().starts_with(b".bp-");
    files(folder).into_iter().filter(is_temporary).collect()
}

/// The system's signal for a file that is too long would end the program in the middle of writing.
#[test]
fn a_file_beyond_the_systems_limit_leaves_nothing_temporary() {
    let folder = Folder::new();
    fs::write(folder.path("list"), "left.png right.png a\nright.png left.png e/b\n").unwrap();
    let batch = format!("match --pairs list --output out {TINY}");
    for (arguments, code) in [("match left.png right.png -o m.png --labels 5", 1), (batch.as_str(), 1)] {
        for blocks in [0, 1] {
            let run = format!("ulimit -f {blocks}; exec {} {arguments}", env!("CARGO_BIN_EXE_bp"));
            let output = Command::new("sh").args(["-c", &run]).current_dir(folder.path("")).output().unwrap();
            assert_eq!(output.status.code(), Some(code), "{arguments}, {blocks}: {}", text(&output.stderr));
            assert!(temporaries(&folder.path("")).is_empty(), "{:?}", temporaries(&folder.path("")));
        }
    }
}

#[test]
fn a_name_with_a_nul_is_refused_wherever_it_stands() {
    let folder = Folder::new();
    fs::write(folder.path("list"), "left.png right.png a\0b\nleft\0.png right.png c\nleft.png right.png d\n").unwrap();
    let output = folder.run(&format!("match --pairs list --output out {TINY}"));
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{told}");
    assert!(told.contains("2 of 3 pairs failed") && told.contains("a\\u{0}b") && !told.contains('\0'), "{told:?}");
    assert_eq!(names(&folder.path("out")), ["d"]);
    // A sidecar tells what its map holds, here something unknown.
    assert!(folder.run(&format!("{MATCH} m.pfm")).status.success());
    let sidecar = fs::read_to_string(folder.path("m.pfm.json")).unwrap();
    fs::write(folder.path("m.pfm.json"), sidecar.replace("\"disparity\"", "\"dis\\u0000parity\"")).unwrap();
    let output = folder.run("convert m.pfm --picture p.png");
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert!(!text(&output.stderr).contains('\0'), "{:?}", text(&output.stderr));
}

#[test]
fn a_replaced_output_keeps_its_permissions_and_owner() {
    let folder = Folder::new();
    let run = || assert!(folder.run(&format!("{MATCH} m.pfm")).status.success());
    run();
    let path = folder.path("m.pfm");
    let about = |path: &Path| {
        let about = path.metadata().unwrap();
        (about.mode() & 0o7777, about.uid(), about.gid())
    };
    let (mode, owner, group) = about(&path);
    assert_eq!(mode & 0o600, 0o600, "a new file can be read and written");
    // Only the administrator may give files away.
    let (owner, group) =
        if chown(&path, Some(12_345), Some(12_346)).is_ok() { (12_345, 12_346) } else { (owner, group) };
    for mode in [0o640, 0o604, 0o400] {
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        run();
        assert_eq!(about(&path), (mode, owner, group));
    }
}

#[test]
fn names_that_terminals_obey_are_printed_as_escapes() {
    let folder = Folder::new();
    let name = "\u{1b}]0;title\u{7}.png";
    fs::copy(folder.path("left.png"), folder.path(name)).unwrap();
    fs::write(folder.path("list"), format!("left.png\tmissing{name}\ta\nleft.png\tright.png\tb{name}\n")).unwrap();
    let output = folder.run(&format!("match --pairs list --output out {TINY}"));
    let mut single = folder.command(&format!("match left.png right.png --labels 12 -o m{name}"));
    for output in [output, single.output().unwrap()] {
        let told = text(&output.stderr) + &text(&output.stdout);
        assert!(!told.contains('\u{1b}') && !told.contains('\u{7}'), "{told:?}");
        assert!(told.contains("\\u{1b}]0;title"), "{told:?}");
    }
}

/// Of the arguments, too, which a shell may have found as names of files.
#[test]
fn terminals_find_nothing_to_obey_in_errors_of_arguments() {
    let folder = Folder::new();
    for arguments in ["match --\u{1b}]0;title\u{7}", "match a.png b.png --labels \u{9b}2J", "\u{1b}[2J"] {
        let output = folder.command(arguments).env("CLICOLOR_FORCE", "1").output().unwrap();
        let told = text(&output.stderr);
        assert!(!told.contains(['\u{1b}', '\u{7}', '\u{9b}']) && told.contains("error"), "{told:?}");
        assert_eq!(output.status.code(), Some(2));
    }
}

#[test]
fn the_number_of_threads_is_bounded_in_the_environment_too() {
    let folder = Folder::new();
    // The second one is the name that it had in old versions of Rayon, which reads it still.
    for name in ["RAYON_NUM_THREADS", "RAYON_RS_NUM_CPUS"] {
        let run = |threads: &str| folder.command(&format!("{MATCH} m.pfm")).env(name, threads).output().unwrap();
        assert_eq!(run("100000").status.code(), Some(2));
        assert!(text(&run("100000").stderr).contains(&format!("{name}=100000: at most 1024")));
        assert!(run("3").status.success() && run("many").status.success());
    }
}

/// The memory that is planned depends on the number of threads if there are several bands.
#[test]
fn sidecars_are_the_same_on_any_number_of_threads() {
    let folder = Folder::new();
    image::GrayImage::from_fn(40, 130, |x, y| image::Luma([(x * y % 251) as u8]))
        .save(folder.path("high.png"))
        .unwrap();
    let run = |threads: u32| {
        let report = folder.json(&format!("match high.png high.png --labels 12 -o m.pfm --threads {threads} --json"));
        (report["settings"]["planned_bytes"].as_u64().unwrap(), fs::read_to_string(folder.path("m.pfm.json")).unwrap())
    };
    let [(least, one), (most, three)] = [1, 3].map(run);
    assert!(least < most, "{least} {most}");
    assert_eq!(one, three);
}

/// A pipe could be empty for ever, and a program that handles signals would not end.
#[test]
fn data_of_experiments_are_regular_files() {
    let folder = Folder::new();
    for scene in ["Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books"] {
        fs::create_dir_all(folder.path("d/middlebury2006").join(scene)).unwrap();
    }
    pipe(&folder.path("d/middlebury2006/Baby1/view1.png"));
    for command in ["reproduce --results r", "scenes"] {
        let output = folder.run(&format!("{command} --data d"));
        let told = text(&output.stderr) + &text(&output.stdout);
        assert!(output.status.code() == Some(3) && told.contains("not a regular file"), "{command}: {told}");
    }
}

/// A device without end, a pipe with something else than an image, and a file that is too long to be one.
#[test]
fn images_that_are_none_stop_no_other_pair() {
    let folder = Folder::new();
    pipe(&folder.path("pipe.png"));
    fs::File::create(folder.path("long.png")).unwrap().set_len(1 << 38).unwrap();
    let bad = ["/dev/zero right.png a", "left.png pipe.png b", "long.png right.png c", "left.png right.png d"];
    fs::write(folder.path("list"), bad.join("\n")).unwrap();
    let writer = folder.path("pipe.png");
    thread::spawn(move || fs::write(writer, "no image"));
    for options in ["", "--max-memory 100MB"] {
        if !options.is_empty() {
            fs::write(folder.path("list"), [bad[0], bad[2], bad[3]].join("\n")).unwrap();
        }
        let output = folder.run(&format!("match --pairs list --output out --force {TINY} {options}"));
        assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
        assert_eq!(names(&folder.path("out")), ["d"]);
    }
}

/// The link stays, and so does what it leads to if the map cannot be replaced.
#[test]
fn a_sidecar_that_is_a_link_stays_one() {
    let folder = Folder::new();
    fs::create_dir(folder.path("store")).unwrap();
    let run =
        |labels: u32| folder.run(&format!("match left.png right.png --labels {labels} -o m.pfm")).status.success();
    assert!(run(12));
    fs::rename(folder.path("m.pfm.json"), folder.path("store/m.json")).unwrap();
    symlink(folder.path("store/m.json"), folder.path("m.pfm.json")).unwrap();
    let before = fs::read(folder.path("store/m.json")).unwrap();
    assert!(run(9));
    assert!(folder.path("m.pfm.json").is_symlink());
    let after = fs::read(folder.path("m.pfm.json")).unwrap();
    assert!(after != before && fs::read(folder.path("store/m.json")).unwrap() == after);
}
