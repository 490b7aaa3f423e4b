//! Backends and devices: how they are listed, checked and chosen, and what happens if there is none.

use std::{fs, process::Command};

use sha2::{Digest, Sha256};

use crate::{
    folder::{Folder, MATCH, text},
    many::TINY,
};

#[test]
fn every_backend_is_listed_with_its_devices_or_why_it_has_none() {
    let folder = Folder::new();
    let report = folder.json("devices --json");
    let backends = report.as_array().unwrap();
    let names: Vec<_> = backends.iter().map(|backend| backend["backend"].as_str().unwrap()).collect();
    assert_eq!(names[..2], ["scalar", "rayon"]);
    assert_eq!(names.contains(&"vulkan"), cfg!(feature = "vulkan"));
    assert_eq!(names.contains(&"wgpu"), cfg!(feature = "wgpu"));
    let listed = text(&folder.run("devices").stdout);
    for backend in backends {
        let devices = backend["devices"].as_array().unwrap();
        assert_eq!(devices.is_empty(), backend["unavailable"].is_string(), "{backend}");
        for device in devices {
            let software = device["kind"] == "software rasteriser";
            assert_eq!(device["software_rasteriser"], software, "{device}");
            assert!(["option", "name", "kind"].iter().all(|key| listed.contains(device[key].as_str().unwrap())));
        }
    }
}

#[test]
fn doctor_tells_what_there_is() {
    let folder = Folder::new();
    let output = folder.run("doctor");
    let told = text(&output.stdout);
    assert!(output.status.success(), "{told}");
    let words = ["processor", "memory", "scalar", "rayon", "GPU", "data", "scripts/fetch-middlebury"];
    assert!(words.iter().all(|word| told.contains(word)), "{told}");
    let checks = folder.json("doctor --json --data nowhere");
    let data = checks.as_array().unwrap().iter().find(|check| check["what"] == "data").unwrap();
    assert!(data["state"] == "note" && data["found"].as_str().unwrap().contains("nowhere"), "{data}");
}

#[test]
fn a_device_is_chosen_by_index_or_name() {
    let folder = Folder::new();
    let devices = folder.json("devices --json")[1]["devices"].clone();
    let last = devices.as_array().unwrap().last().unwrap();
    let set = last["name"].as_str().unwrap().split(", ").nth(1).unwrap().to_lowercase();
    let index = devices.as_array().unwrap().len() - 1;
    for chosen in [format!("--backend rayon:{set}"), format!("--device {set}"), format!("--device {index}")] {
        let report = folder.json(&format!("{MATCH} a.pfm --json {chosen}"));
        assert_eq!((&report["device"]["name"], &report["backend"]), (&last["name"], &last["option"]), "{chosen}");
    }
    folder.fails(&format!("{MATCH} b.pfm --device 99"), 5, &["rayon", "\"99\"", &set.to_uppercase()]);
    folder.fails(&format!("{MATCH} b.pfm --device magic"), 5, &["\"magic\"", "threads"]);
    folder.fails(&format!("{MATCH} b.pfm --backend scalar:0 --device 0"), 2, &["--backend scalar:0", "--device 0"]);
    folder.fails("reproduce --quick --synthetic --backend rayon,rayon:magic", 5, &["rayon", "\"magic\""]);
}

#[test]
fn conform_holds_a_backend_against_the_reference() {
    let told = text(&Folder::new().run("conform --backend rayon").stdout);
    assert!(told.starts_with("rayon: ") && told.contains("cases match scalar to the bit"), "{told}");
}

/// Hides all drivers of this machine.
#[cfg(all(feature = "vulkan", feature = "wgpu"))]
#[test]
fn without_a_driver_the_gpu_backends_say_so_and_the_others_work() {
    let folder = Folder::new();
    let without = |arguments: &str| {
        let mut command = folder.command(arguments);
        command.env("VK_DRIVER_FILES", "/nonexistent").env_remove("VK_ICD_FILENAMES");
        command
    };
    for backend in ["vulkan", "wgpu", "vulkan:1", "wgpu:llvmpipe"] {
        let name = backend.split(':').next().unwrap();
        let words = [name, "driver", "VK_DRIVER_FILES", "/nonexistent"];
        folder.command_fails(&mut without(&format!("{MATCH} a.pfm --backend {backend}")), 5, &words);
        folder.command_fails(&mut without(&format!("conform --backend {backend}")), 5, &words);
    }
    let words = ["vulkan: unavailable", "wgpu: unavailable", "none is available"];
    folder.command_fails(&mut without("reproduce --quick --synthetic --backend vulkan,wgpu"), 5, &words);
    assert!(without(&format!("{MATCH} a.pfm --backend rayon")).output().unwrap().status.success());
    let doctor = without("doctor").output().unwrap();
    let told = text(&doctor.stdout);
    assert!(doctor.status.success() && told.contains("VK_DRIVER_FILES"), "{told}");
    let listed = text(&without("devices").output().unwrap().stdout);
    assert_eq!(listed.matches("unavailable").count(), 2, "{listed}");
}

/// Replaces this machine's Vulkan loader by an empty file.
#[cfg(all(feature = "vulkan", feature = "wgpu"))]
#[test]
fn without_a_loader_the_gpu_backends_say_so() {
    let folder = Folder::new();
    let hidden = tempfile::tempdir().unwrap();
    fs::write(hidden.path().join("libvulkan.so.1"), "").unwrap();
    for backend in ["vulkan", "wgpu"] {
        let mut command = folder.command(&format!("{MATCH} a.pfm --backend {backend}"));
        let words = [backend, "no Vulkan loader", "libvulkan.so.1", "libvulkan1"];
        folder.command_fails(command.env("LD_LIBRARY_PATH", hidden.path()), 5, &words);
    }
}

/// Main memory runs out while a plan is being allocated, so no check can foresee it. Skips devices with memory of their
/// own, because their drivers reserve more address space than this limit leaves.
#[cfg(unix)]
#[test]
fn too_little_memory_is_told() {
    let folder = Folder::new();
    // The plan takes 1.7 GB, and the program with a driver takes 0.5 GB.
    fs::write(folder.path("large.pgm"), [b"P5 800 600 255\n".as_slice(), &[7; 800 * 600]].concat()).unwrap();
    let plan = "--labels 512 --algorithm cfbp --grids 5 --half-steps 1";
    let limited = |kibibytes: u32, arguments: &str| {
        let mut command = Command::new("sh");
        let script = format!("ulimit -v {kibibytes}; exec \"$0\" {arguments}");
        command.args(["-c", &script, env!("CARGO_BIN_EXE_bp")]).current_dir(folder.path(""));
        // Otherwise every thread of a driver reserves address space, so that more processors need more.
        command.env("MALLOC_ARENA_MAX", "1");
        command
    };
    let listed = folder.json("devices --json");
    for backend in listed.as_array().unwrap() {
        let kind = &backend["devices"][0]["kind"];
        if kind == "processor" || kind == "software rasteriser" {
            let name = backend["backend"].as_str().unwrap();
            let arguments = format!("match large.pgm large.pgm --output a.pfm {plan} --backend {name}");
            folder.command_fails(&mut limited(1_000_000, &arguments), 6, &["out of memory", "needed for"]);
        }
    }
}

/// The GPU backends that have a device, at least one if the environment requires it.
fn gpus(folder: &Folder) -> Vec<String> {
    let backends = folder.json("devices --json").as_array().unwrap()[2..].to_vec();
    let found = backends.iter().filter(|backend| !backend["devices"].as_array().unwrap().is_empty());
    let names: Vec<String> = found.map(|backend| backend["backend"].as_str().unwrap().to_owned()).collect();
    assert!(!names.is_empty() || std::env::var_os("BP_REQUIRE_GPU").is_none(), "no GPU");
    names
}

/// Bytes of the header are changed in turn, with a checksum that fits, as another device's data would have.
#[test]
fn a_cache_of_kernels_of_another_device_is_made_anew() {
    let folder = Folder::new();
    let cache = folder.path("cache");
    for backend in gpus(&folder) {
        let mut run = folder.command(&format!("{MATCH} m.pfm --backend {backend}"));
        run.env("XDG_CACHE_HOME", &cache);
        assert!(run.output().unwrap().status.success());
        let files = walkdir::WalkDir::new(&cache).into_iter().map(|entry| entry.unwrap());
        let name = |entry: &walkdir::DirEntry| entry.file_name().to_string_lossy().into_owned();
        let file = files.into_iter().find(|entry| name(entry).starts_with(&backend)).expect("a cache");
        let stored = fs::read(file.path()).unwrap();
        let of_another = (0..stored.len() - 32).step_by(5).take(10).map(|at| {
            let mut data = stored[32..].to_vec();
            data[at] ^= 1;
            [Sha256::digest(&data).as_slice(), &data].concat()
        });
        // Without a sum that fits, and cut short.
        let mut damaged = stored.clone();
        damaged[stored.len() / 2] ^= 1;
        let broken = [damaged, stored[..stored.len() / 2].to_vec(), stored[..7].to_vec(), vec![]];
        for (index, cache) in of_another.chain(broken).enumerate() {
            fs::write(file.path(), cache).unwrap();
            let output = run.output().unwrap();
            assert!(output.status.success(), "{backend}, {index}: {}", text(&output.stderr));
        }
    }
}

#[test]
fn a_warm_start_that_a_device_cannot_do_is_refused_at_the_first_frame() {
    let folder = Folder::new();
    for frame in 1..3 {
        fs::copy(folder.path("left.png"), folder.path(&format!("l{frame}.png"))).unwrap();
        fs::copy(folder.path("right.png"), folder.path(&format!("r{frame}.png"))).unwrap();
    }
    for backend in gpus(&folder) {
        let run = |loops: u32| {
            let plan = format!("--algorithm bp --loops {loops} --warm-start {TINY} --backend {backend}");
            folder.run(&format!("match --video l%d.png r%d.png --output {backend} {plan}"))
        };
        let output = run(3);
        assert_eq!(output.status.code(), Some(5), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains("even number of loops"), "{}", text(&output.stderr));
        assert!(!folder.path(&backend).join("1.pfm").exists());
        assert!(run(4).status.success());
    }
}
