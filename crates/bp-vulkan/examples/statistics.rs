//! What the compiler of a GPU's driver says of the kernels, as a table in Markdown. `scripts/gpu-statistics` runs it for GPUs that are
//! not there.
//!
//! `cargo run --release -p bp-vulkan --example statistics -- DEVICE`, where DEVICE is an index of `bp devices`.

use std::error::Error;

use bp_core::{Algorithm, Backend, Model, Plan, Profile, Schedule, Settings, Size};
use bp_gpu::Shape;
use bp_vulkan::{Statistics, Vulkan, statistics};

/// The names that Mesa's RADV gives its figures.
const FIGURES: [&str; 5] = ["Instructions", "VGPRs", "Subgroups per SIMD", "Latency", "Inverse Throughput"];

fn main() -> Result<(), Box<dyn Error>> {
    let device = std::env::args().nth(1).map_or(Ok(0), |index| index.parse())?;
    let info = Vulkan.devices().into_iter().nth(device).ok_or("there is no device of this index")?;
    println!("## {}\n\n{}\n", info.name, info.driver.unwrap_or_default());
    println!("| plan | kernel | {} |\n|---|---|{}", FIGURES.join(" | "), "---:|".repeat(FIGURES.len()));
    let mut known = Vec::new();
    for (name, plan) in plans()? {
        for shape in [Shape::Words, Shape::Slices] {
            for of in statistics(device, &plan, shape)?.into_iter().filter(|of| !of.figures.is_empty()) {
                if !known.contains(&of.pipeline) {
                    println!(
                        "| {name} | `{}` | {} |",
                        of.pipeline,
                        FIGURES.map(|figure| value(&of, figure)).join(" | ")
                    );
                    known.push(of.pipeline);
                }
            }
        }
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
