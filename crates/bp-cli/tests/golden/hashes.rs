//! Maps and messages of several plans, which must be the same on every backend.

use std::{fs, path::Path};

use sha2::{Digest, Sha256};

use crate::{check, folder, json, run_in};

/// Options of `bp match`.
const PLANS: [&str; 20] = [
    "",
    "--profile census",
    "--profile census32",
    "--loops 3 --grids 4",
    "--labels 40 --label-sets on",
    "--profile census32 --edge-threshold 10",
    "--profile mrf --labels 16 --min-disparity -3",
    "--profile gradient --coarse-clip off",
    "--algorithm bp --profile thesis --loops 12",
    "--algorithm bp --profile census --loops 5 --schedule checkerboard",
    "--algorithm cfbp --profile thesis",
    "--algorithm cfbp --profile census --grids 5 --half-steps 10",
    "--algorithm cfbp --profile mrf --grids 3 --loops 2 --message-start sender",
    "--algorithm cfbp --profile census16 --loops 20 --schedule sweep",
    "--algorithm ctbp --profile census16 --loops 4",
    "--algorithm cfcsbp --profile thesis --z 3",
    "--algorithm cfcsbp --profile birchfield-tomasi --grids 5 --half-steps 3 --coarse-clip on",
    "--algorithm ctbp --profile thesis --loops 9",
    "--algorithm ctcsbp --profile thesis --z 4 --seed-start off",
    "--algorithm ctcsbp --profile census --edge-threshold 20 --slope 3 --truncation 17",
];

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn hashes(folder: &Path, backend: &str) -> String {
    let line = |plan: &str| {
        let labels = if plan.contains("--labels") { "" } else { "--labels 12" };
        let run =
            format!("match left.png right.png -o map.pfm --json --messages-hash {labels} {plan} --backend {backend}");
        let report = json(&run_in(folder, &run));
        let map = hash(&fs::read(folder.join("map.pfm")).unwrap());
        format!("{labels} {plan}\n    map      {map}\n    messages {}\n", report["messages_sha256"].as_str().unwrap())
    };
    PLANS.map(line).concat()
}

/// Skips backends without a device. With BP_REQUIRE_GPU=1, such a backend is a failure.
#[test]
fn maps_and_messages_on_every_backend() {
    let folder = folder();
    let listed = json(&run_in(folder.path(), "devices --json"));
    let required = std::env::var_os("BP_REQUIRE_GPU").is_some_and(|value| value == "1");
    for backend in listed.as_array().unwrap() {
        let is_here = backend["unavailable"].is_null();
        assert!(is_here || !required, "{backend}");
        if is_here {
            check("hashes.txt", &hashes(folder.path(), backend["backend"].as_str().unwrap()));
        }
    }
}
