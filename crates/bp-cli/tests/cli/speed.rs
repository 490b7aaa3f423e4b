//! Comparing the speed of devices.

use std::fs;

use serde_json::Value;

use crate::folder::{Folder, text};

/// The fastest possible run.
const QUICK: &str = "speed --quick --problem sweep --backend scalar,rayon --threads 2";

#[test]
fn a_run_writes_a_page_and_every_sample_once() {
    let folder = Folder::new();
    let output = folder.run(&format!("{QUICK} --rounds 3 --output new/folder"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    let page = fs::read_to_string(folder.path("new/folder/speed.md")).unwrap();
    assert_eq!(page, text(&output.stdout));
    let words = ["a quick run", "`sweep`: 207x185", "| sweep | scalar | 3 |", "as long as scalar", "coarsen"];
    assert!(words.iter().all(|word| page.contains(word)), "{page}");
    let record: Value = serde_json::from_slice(&fs::read(folder.path("new/folder/speed.json")).unwrap()).unwrap();
    assert_eq!((&record["schema_version"], &record["threads"]), (&Value::from(1), &Value::from(2)));
    let contests = record["contests"].as_array().unwrap();
    assert!(contests.len() == 1 && contests[0]["labels_sha256"].is_string(), "{record}");
    for (entry, name) in contests[0]["entries"].as_array().unwrap().iter().zip(["scalar", "rayon"]) {
        let measured = &entry["outcome"]["measured"];
        assert_eq!((&entry["contestant"], measured["samples"].as_array().unwrap().len()), (&Value::from(name), 3));
        assert!(measured["samples"][0]["clocks"][0]["stages"]["update_messages_ms"].as_f64().unwrap() > 0.0);
    }
    folder.fails(&format!("{QUICK} --output new/folder"), 1, &["speed.md", "overwritten"]);
    assert_eq!(fs::read_to_string(folder.path("new/folder/speed.md")).unwrap(), page);
}

/// Each family has a chart and a table. Another chart shows the throughput of the kernels beside that of copying.
#[test]
fn families_of_problems_are_drawn() {
    let folder = Folder::new();
    let run = "speed --quick --problem loops,labels --backend scalar,rayon --threads 2 --rounds 3 --output out";
    let output = folder.run(run);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let page = text(&output.stdout);
    let words =
        ["| problem | loops | scalar, ms | rayon, ms |", "| labels-256 | 256 | ", "![Time against loops](loops.svg)"];
    assert!(words.iter().all(|word| page.contains(word)) && !page.contains("## Times"), "{page}");
    for name in ["loops", "labels"] {
        let svg = fs::read_to_string(folder.path(&format!("out/{name}.svg"))).unwrap();
        let shown = ["scalar", "rayon", "milliseconds from images to labels, logarithmic axis"];
        assert!(shown.iter().all(|text| svg.contains(&format!(">\n{text}\n<"))), "{svg}");
        assert_eq!(image::image_dimensions(folder.path(&format!("out/{name}.png"))).unwrap().0, 1800);
    }
    assert!(!folder.path("out/pixels.svg").exists());
    let roofline = fs::read_to_string(folder.path("out/roofline.svg")).unwrap();
    for text in ["scalar: copying", "rayon: copying", "update_messages"] {
        assert!(roofline.contains(text), "{text} is missing from {roofline}");
    }
    fs::create_dir(folder.path("taken")).unwrap();
    fs::write(folder.path("taken/loops.png"), "mine").unwrap();
    folder.fails(&run.replace(" out", " taken"), 1, &["loops.png", "overwritten"]);
}

#[test]
fn what_cannot_be_run_is_told() {
    let folder = Folder::new();
    folder.fails("speed --problem chess", 2, &["chess", "update", "published", "pixels"]);
    folder.fails("speed --quick --backend rayon,rayon:0", 2, &["rayon twice"]);
    folder.fails("speed --quick --backend magic", 5, &["magic", "scalar"]);
}

/// Hides all drivers of this machine.
#[cfg(feature = "vulkan")]
#[test]
fn a_device_that_is_not_there_does_not_keep_others_from_running() {
    let folder = Folder::new();
    let without = |arguments: &str| {
        let mut command = folder.command(arguments);
        command.env("VK_DRIVER_FILES", "/nonexistent").env_remove("VK_ICD_FILENAMES");
        command
    };
    let output = without("speed --quick --problem sweep --backend vulkan,rayon").output().unwrap();
    let page = text(&output.stdout);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(page.contains("Backend vulkan: unavailable: ") && page.contains("| sweep | rayon | 1 |"), "{page}");
    let words = ["vulkan: unavailable", "none is available"];
    folder.command_fails(&mut without("speed --quick --backend vulkan --output out"), 5, &words);
}
