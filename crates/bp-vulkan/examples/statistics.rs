//! What the compiler of a GPU's driver says of the kernels, as a table in Markdown. `scripts/gpu-statistics` runs it for GPUs that are
//! not there.
//!
//! `cargo run --release -p bp-vulkan --example statistics -- DEVICE`, where DEVICE is an index of `bp devices`.

use std::{collections::HashSet, error::Error};

use bp_core::{Algorithm, Backend, Model, Plan, Profile, Schedule, Settings, Size};
use bp_gpu::Shape;
use bp_vulkan::{Statistics, Vulkan, statistics};

/// The figures of Mesa's RADV that are shown. Of other drivers, all are.
const FIGURES: [&str; 5] = ["Instructions", "VGPRs", "Subgroups per SIMD", "Latency", "Inverse Throughput"];

fn main() -> Result<(), Box<dyn Error>> {
    let device = std::env::args().nth(1).map_or(Ok(0), |index| index.parse())?;
    let info = Vulkan.devices().into_iter().nth(device).ok_or("there is no device of this index")?;
    println!("## {}\n\n{}\n", info.name, info.driver.unwrap_or_default());
    let mut of_plans = Vec::new();
    for (name, plan) in plans()? {
        for shape in [Shape::Words, Shape::Slices] {
            of_plans.extend(statistics(device, &plan, shape)?.into_iter().map(|of| (name, of)));
        }
    }
    of_plans.retain(|(_, of)| !of.figures.is_empty());
    let told: Vec<_> =
        of_plans.iter().take(1).flat_map(|(_, of)| of.figures.iter().map(|(name, _)| name.as_str())).collect();
    let shown = if FIGURES.iter().all(|name| told.contains(name)) { FIGURES.to_vec() } else { told };
    println!("| plan | kernel | {} |\n|---|---|{}", shown.join(" | "), "---:|".repeat(shown.len()));
    let mut known = HashSet::new();
    for (name, of) in of_plans.iter().filter(|(_, of)| known.insert(&of.pipeline)) {
        let values: Vec<_> = shown.iter().map(|figure| value(of, figure)).collect();
        println!("| {name} | `{}` | {} |", of.pipeline, values.join(" | "));
    }
    Ok(())
}

/// The plans whose kernels are compiled: a hierarchy, the thesis's BP, and the default matcher. Kernels do not depend on size and
/// labels.
fn plans() -> Result<[(&'static str, Plan); 3], Box<dyn Error>> {
    let size = Size { width: 620, height: 555 };
    let settings = |grids, steps, schedule| Settings { grids, steps, ..Algorithm::Cfbp.settings(size, 1, 1, schedule) };
    let plan = |profile, labels, settings| Plan::new(size, Model::new(profile, labels)?, settings);
    Ok([
        ("hierarchy", plan(Profile::Census, 128, settings(5, 10, Schedule::Checkerboard))?),
        ("thesis", plan(Profile::Thesis, 112, settings(1, 112, Schedule::Sync))?),
        ("sweep", plan(Profile::Census16, 112, settings(5, 1, Schedule::Sweep))?),
    ])
}

fn value(of: &Statistics, name: &str) -> String {
    let figure = of.figures.iter().find(|(figure, _)| figure == name);
    figure.map_or_else(|| "-".to_owned(), |(_, value)| value.to_string())
}
