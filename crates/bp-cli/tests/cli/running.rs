//! Threads, repeats and memory of `bp match`.

use std::fs;

use crate::folder::{Folder, MATCH, text};

#[test]
fn a_memory_limit_is_kept_by_tiles_or_refused() {
    let folder = Folder::new();
    for (name, shift) in [("high-left.png", 0), ("high-right.png", 5)] {
        let noise = |x: u32, y: u32| ((x + shift) * (x + shift) * 7 + (x + shift) * y * 13 + y * 31) as u8;
        image::GrayImage::from_fn(430, 600, |x, y| image::Luma([noise(x, y)])).save(folder.path(name)).unwrap();
    }
    let run = |options: &str| folder.json(&format!("match high-left.png high-right.png --labels 8 --json {options}"));
    let peak = |report: &serde_json::Value| report["peak_bytes"].as_u64().unwrap();
    let map = |name: &str| fs::read(folder.path(name)).unwrap();
    let whole = run("--output whole.pfm");
    assert!(whole["tiles"].is_null());
    assert_eq!(run(&format!("--output a.pfm --max-memory {}", peak(&whole)))["tiles"], whole["tiles"]);
    let tiles = run(&format!("--output tiles.pfm --max-memory {}", peak(&whole) - 1));
    assert_eq!(
        (&tiles["tiles"]["rows"], &tiles["tiles"]["answer"]),
        (&2.into(), &"nearly the whole image's answer".into())
    );
    let planned = tiles["settings"]["planned_bytes"].as_u64().unwrap();
    assert!(peak(&tiles) < peak(&whole) && tiles["allocated_bytes"].as_u64().unwrap() <= planned);
    let (all, parts) = (map("whole.pfm"), map("tiles.pfm"));
    let differing = all.chunks(4).zip(parts.chunks(4)).filter(|(whole, tiled)| whole != tiled).count();
    assert!(all.len() == parts.len() && differing * 100 < all.len() / 4, "{differing} pixels differ");
    let again = format!("match high-left.png high-right.png --labels 8 -o b.pfm --max-memory {}", peak(&tiles) - 1);
    let output = folder.run(&again);
    let (told, report) = (text(&output.stderr), text(&output.stdout));
    assert!(told.contains("tiles of up to") && report.contains("nearly the whole image's answer"), "{told}{report}");
    folder.fails(&format!("{again} --messages-hash"), 6, &["--messages-hash"]);
    // Tiles keep no messages for the next frame.
    for (from, to) in [("high-left.png", "l1.png"), ("high-right.png", "r1.png")] {
        fs::copy(folder.path(from), folder.path(to)).unwrap();
    }
    let video = "--algorithm cfbp --half-steps 2";
    let limit = peak(&run(&format!("--output d.pfm {video}"))) - 1;
    let video = format!("match --video l%d.png r%d.png --output video {video} --labels 8 --max-memory {limit}");
    folder.json(&format!("{video} --json"));
    folder.fails(&format!("{video} --warm-start"), 3, &["--warm-start needs the whole image"]);
    let words = ["at least", "97.7 KiB is allowed by --max-memory", "--labels"];
    folder.fails("match high-left.png high-right.png --labels 8 -o c.pfm --max-memory 99999", 6, &words);
    folder.fails(
        "match high-left.png high-right.png --algorithm cfbp -o c.pfm --max-memory 9M",
        6,
        &["--algorithm sweep", "8.6 MiB"],
    );
}

#[test]
fn every_backend_and_number_of_threads_gives_the_same_map_and_messages() {
    let folder = Folder::new();
    for algorithm in ["sweep", "cfcsbp", "ctbp"] {
        let run = |options: &str| {
            let report =
                folder.json(&format!("{MATCH} a.pfm --json --messages-hash --algorithm {algorithm} {options}"));
            let same =
                (report["messages_sha256"].clone(), report["energy"].clone(), fs::read(folder.path("a.pfm")).unwrap());
            (report["device"]["workers"].as_u64().unwrap(), same)
        };
        let (workers, reference) = run("--backend scalar");
        assert_eq!(workers, 1);
        for threads in [1, 3] {
            assert_eq!(
                run(&format!("--backend rayon --threads {threads}")),
                (threads, reference.clone()),
                "{algorithm}"
            );
        }
        assert_eq!(run("--threads 2"), (2, reference), "rayon is the default");
    }
}

#[test]
fn a_repeated_match_tells_every_time() {
    let folder = Folder::new();
    let report = folder.json(&format!("{MATCH} a.pfm --json --repeat 4"));
    let mut samples: Vec<f64> =
        report["samples_ms"].as_array().unwrap().iter().map(|ms| ms.as_f64().unwrap()).collect();
    samples.sort_by(f64::total_cmp);
    assert_eq!((samples.len(), samples[1]), (4, report["total_ms"].as_f64().unwrap()));
    let text = text(&folder.run(&format!("{MATCH} a.pfm --repeat 3")).stdout);
    assert!(text.contains("median of 3 from"), "{text}");
    assert_eq!(folder.json(&format!("{MATCH} a.pfm --json"))["samples_ms"].as_array().unwrap().len(), 1);
}
