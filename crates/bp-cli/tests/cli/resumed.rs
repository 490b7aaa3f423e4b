//! Which of many pairs are matched again after changes, failures and kills.

use std::{
    fs,
    process::Stdio,
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::Value;

use crate::{
    folder::{Folder, text},
    many::{TINY, files, maps, names, place},
};

#[test]
fn only_what_changed_is_done_again() {
    let folder = Folder::new();
    place(
        &folder,
        &["in/left/1.png", "in/right/1.png", "in/left/2.png", "in/right/2.png", "in/left/3.png", "in/right/3.png"],
    );
    let done = |options: &str| {
        let report = folder.json(&format!("match --pairs in --output out --json {TINY} {options}"));
        let written = fs::read_to_string(folder.path("out/summary.json")).unwrap();
        assert_eq!(serde_json::from_str::<Value>(&written).unwrap(), report);
        3 - report["skipped"].as_u64().unwrap()
    };
    assert_eq!((done(""), done(""), done("--backend scalar"), done("--force")), (3, 0, 0, 3));
    fs::copy(folder.path("truth.png"), folder.path("in/right/2.png")).unwrap();
    assert_eq!((done(""), done("")), (1, 0));
    // Like `touch`: the same contents with a new time.
    let bytes = fs::read(folder.path("in/left/1.png")).unwrap();
    fs::write(folder.path("in/left/1.png"), bytes).unwrap();
    assert_eq!(done(""), 0);
    // Like `cp --preserve`: other contents of equal length and time.
    let (path, times) = (folder.path("in/left/3.png"), fs::metadata(folder.path("in/left/3.png")).unwrap());
    let other = fs::read(&path).unwrap().into_iter().rev().collect::<Vec<_>>();
    let whole = fs::read(&path).unwrap();
    for (contents, ended) in [(other, Some(3)), (whole, Some(0))] {
        fs::write(&path, contents).unwrap();
        fs::File::options().write(true).open(&path).unwrap().set_modified(times.modified().unwrap()).unwrap();
        assert_eq!(folder.run(&format!("match --pairs in --output out {TINY}")).status.code(), ended);
    }
    fs::remove_file(folder.path("out/left/1.pfm")).unwrap();
    fs::write(folder.path("out/left/3.pfm"), "").unwrap();
    assert_eq!((done(""), done("")), (2, 0));
    fs::write(folder.path("out/records/left/2.json"), "{").unwrap();
    assert_eq!((done(""), done("--slope 3"), done("--slope 3"), done("--slope 3 --also picture")), (1, 3, 0, 3));
    // The contents of a calibration count, not its name.
    let calibration = |focal: u32| {
        let cam = format!("cam0=[{focal} 0 10; 0 {focal} 9; 0 0 1]\ncam1=[{focal} 0 10; 0 {focal} 9; 0 0 1]\n");
        fs::write(folder.path("calib.txt"), cam + "doffs=0\nbaseline=60\n").unwrap();
    };
    let with = |file: &str| done(&format!("--slope 3 --also picture,depth --calib {file}"));
    calibration(100);
    assert_eq!((with("calib.txt"), with("./calib.txt")), (3, 0));
    calibration(101);
    assert_eq!((with("calib.txt"), done("--slope 3 --also picture")), (3, 3));
    // Giving a default explicitly changes nothing.
    assert_eq!(done("--slope 3 --also picture --colours viridis"), 0);
    fs::rename(folder.path("out"), folder.path("moved")).unwrap();
    let moved = folder.json(&format!("match --pairs in --output moved --json {TINY} --slope 3 --also picture"));
    assert_eq!(moved["skipped"], 3);
}

#[test]
fn a_pair_that_fails_is_told_recorded_and_tried_again() {
    let folder = Folder::new();
    fs::write(
        folder.path("list"),
        "left.png right.png a\nleft.png wide.png b\nno.png right.png c\nright.png left.png d\n",
    )
    .unwrap();
    let run = format!("match --pairs list --output out {TINY}");
    let output = folder.run(&run);
    assert_eq!(output.status.code(), Some(3));
    let told = text(&output.stderr);
    for words in ["b: left.png and wide.png", "c: no.png", "2 of 4 pairs failed", "summary.json"] {
        assert!(told.contains(words), "{told}");
    }
    let summary: Value = serde_json::from_slice(&fs::read(folder.path("out/summary.json")).unwrap()).unwrap();
    assert_eq!((&summary["done"], &summary["failures"][0]["name"]), (&2.into(), &"b".into()));
    assert!(summary["pairs_per_second"].as_f64().unwrap() > 0.0);
    assert_eq!(names(&folder.path("out")), ["a", "d"]);
    fs::copy(folder.path("left.png"), folder.path("no.png")).unwrap();
    fs::copy(folder.path("right.png"), folder.path("wide.png")).unwrap();
    let report = folder.json(&format!("{run} --json"));
    assert_eq!(
        (&report["done"], &report["skipped"], &report["failures"]),
        (&4.into(), &2.into(), &Value::Array(vec![]))
    );
    // Other failures leave existing outputs in place.
    fs::rename(folder.path("wide.png"), folder.path("away.png")).unwrap();
    for options in ["", "--max-memory 1k"] {
        assert_eq!(folder.run(&format!("{run} {options}")).status.code(), Some(3));
        assert_eq!(names(&folder.path("out")), ["a", "b", "c", "d"]);
    }
    fs::rename(folder.path("away.png"), folder.path("wide.png")).unwrap();
    assert_eq!(folder.json(&format!("{run} --json"))["skipped"], 4);
    // If changed images fail, the map of the earlier images is removed.
    fs::write(folder.path("no.png"), "broken").unwrap();
    assert_eq!(folder.run(&run).status.code(), Some(3));
    assert_eq!(names(&folder.path("out")), ["a", "b", "d"]);
}

#[test]
fn what_an_earlier_command_wrote_besides_is_removed() {
    let folder = Folder::new();
    fs::write(folder.path("list"), "left.png right.png a\n").unwrap();
    let written = |options: &str| {
        let output = folder.run(&format!("match --pairs list --output out {TINY} {options}"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        let written = files(&folder.path("out")).into_iter().map(|path| path.display().to_string());
        written.filter(|path| path.starts_with("a.")).collect::<Vec<_>>()
    };
    assert_eq!(written("--also picture"), ["a.pfm", "a.pfm.json", "a.picture.png", "a.picture.png.json"]);
    fs::write(folder.path("out/a.mine.png"), "").unwrap();
    assert_eq!(written("--slope 3 --format npy"), ["a.mine.png", "a.npy", "a.npy.json"]);
    assert_eq!(written("--slope 3 --format npy --no-sidecar"), ["a.mine.png", "a.npy"]);
    // The map of one pair has the name of another pair's picture.
    written("--format png --also picture");
    fs::write(folder.path("list"), "left.png right.png a.picture\nleft.png right.png a\n").unwrap();
    assert_eq!(written("--format png"), ["a.mine.png", "a.picture.png", "a.picture.png.json", "a.png", "a.png.json"]);
}

#[test]
fn a_second_process_for_the_same_pairs_is_refused() {
    let folder = Folder::new();
    let run = slow(&folder, 200);
    let mut first = folder.command(&format!("{run} --output out")).stdout(Stdio::null()).spawn().unwrap();
    wait_for(|| folder.path("out/records/p0.json").exists());
    folder.fails(&format!("match --pairs list --output out {TINY}"), 1, &["1-of-1.lock", "another process"]);
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(folder.run(&format!("match --pairs list --output out {TINY} --quiet")).status.success());
}

#[test]
fn shards_share_all_pairs_in_one_folder() {
    let folder = Folder::new();
    let list: String = (0..7).map(|index| format!("left.png right.png p{index}\n")).collect();
    fs::write(folder.path("list"), list).unwrap();
    let shards: Vec<_> = (1..=3)
        .map(|shard| {
            folder
                .command(&format!("match --pairs list --output out --json --shard {shard}/3 {TINY}"))
                .stdout(Stdio::null())
                .spawn()
                .unwrap()
        })
        .collect();
    assert!(shards.into_iter().all(|mut shard| shard.wait().unwrap().success()));
    let count = |name: &str| {
        let summary: Value = serde_json::from_slice(&fs::read(folder.path(name)).unwrap()).unwrap();
        summary["done"].as_u64().unwrap()
    };
    assert_eq!([1, 2, 3].map(|shard| count(&format!("out/summary-{shard}-of-3.json"))), [3, 2, 2]);
    let whole = folder.json(&format!("match --pairs list --output out --json {TINY}"));
    assert_eq!((&whole["done"], &whole["skipped"]), (&7.into(), &7.into()));
}

/// Pairs that take long enough to be interrupted.
fn slow(folder: &Folder, pairs: usize) -> String {
    let noise = |x: u32, y: u32| ((x * x * 7 + x * y * 13 + y * 31 + x * 5) % 251) as u8;
    for (name, shift) in [("l.pgm", 0), ("r.pgm", 3)] {
        image::GrayImage::from_fn(160, 120, |x, y| image::Luma([noise(x + shift, y)])).save(folder.path(name)).unwrap();
    }
    let list: String = (0..pairs).map(|index| format!("l.pgm r.pgm p{index}\n")).collect();
    fs::write(folder.path("list"), list).unwrap();
    "match --pairs list --labels 16 --algorithm cfbp --threads 1".to_owned()
}

fn wait_for(what: impl Fn() -> bool) {
    let start = Instant::now();
    while !what() && start.elapsed() < Duration::from_secs(60) {
        sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_batch_that_is_killed_goes_on_and_ends_as_if_it_had_not_been() {
    let folder = Folder::new();
    let run = slow(&folder, 8);
    assert!(folder.run(&format!("{run} --output whole")).status.success());
    for done in [0, 1, 3, 5] {
        let mut child = folder.command(&format!("{run} --output out")).stdout(Stdio::null()).spawn().unwrap();
        wait_for(|| folder.path(&format!("out/records/p{done}.json")).exists());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    fs::write(folder.path("out/.bp-1-of-1-left"), "half").unwrap();
    let report = folder.json(&format!("{run} --output out --json"));
    assert!(report["skipped"].as_u64().unwrap() >= 5, "{report}");
    assert_eq!(report["done"], 8);
    assert_eq!(maps(&folder.path("out")), maps(&folder.path("whole")));
    assert_eq!(files(&folder.path("out")), files(&folder.path("whole")));
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_batch_between_pairs_without_a_trace() {
    let folder = Folder::new();
    let run = slow(&folder, 200);
    for signal in ["INT", "TERM"] {
        let child = folder.command(&format!("{run} --output out")).stderr(Stdio::piped()).spawn().unwrap();
        let before = maps(&folder.path("")).len();
        wait_for(|| folder.path("out").exists() && maps(&folder.path("out")).len() > before + 2);
        let kill = std::process::Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains("the same command again"), "{}", text(&output.stderr));
        let found = files(&folder.path("out"));
        let maps = maps(&folder.path("out")).len();
        assert!(maps > 0 && maps < 200 && found.len() == 3 * maps + 1, "{found:?}");
    }
}
