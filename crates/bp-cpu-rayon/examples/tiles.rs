//! Measures how much the result of tiles differs from that of the whole image. Prints the table of docs/big-images.md.
//!
//! `cargo run --release -p bp-cpu-rayon --example tiles -- DATA`, where DATA is a folder with the Middlebury pairs of
//! 2006 at full and half size.

use std::{error::Error, path::Path};

use bp_core::{
    Algorithm, Backend, Device, DisparityMap, Energy, GroundTruth, Image, Model, Plan, Profile, Schedule, Settings,
    Size, StereoPair, Tiled, Tiling,
};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Folder, scene, labels, and the divisor of the stored ground truth.
const SCENES: [(&str, &str, usize, f32); 3] = [
    ("middlebury2006-fullsize", "Books", 240, 1.0),
    ("middlebury2006", "Aloe", 112, 2.0),
    ("middlebury2006", "Baby1", 112, 2.0),
];

/// The columns and rows that a tile keeps, and the halo. `ALL` exceeds the width of every image here.
const TILES: [(usize, usize, usize); 11] = [
    (ALL, 512, 0),
    (256, 512, 0),
    (256, 512, 32),
    (256, 512, 64),
    (256, 512, 96),
    (128, 512, 96),
    (256, 256, 96),
    (ALL, 256, 96),
    (ALL, 128, 96),
    (ALL, 64, 96),
    (ALL, 32, 96),
];

const ALL: usize = 1 << 16;

struct Scene {
    name: &'static str,
    pair: StereoPair,
    truth: GroundTruth,
}

/// The measured properties of a result.
struct Run {
    labels: Vec<u16>,
    bad: f64,
    energy: f64,
    updates: f64,
    bytes: u64,
}

fn main() -> Result<()> {
    let data = std::env::args().nth(1).ok_or("usage: tiles DATA")?;
    let device = bp_cpu_rayon::Rayon.open(0)?;
    println!("| scene | plan | kept | halo | other labels | B visible | energy | updates | bytes |");
    println!("|---|---|---|---:|---:|---:|---:|---:|---:|");
    for (folder, name, labels, scale) in SCENES {
        let scene = scene(&Path::new(&data).join(folder).join(name), name, scale)?;
        let size = scene.pair.size();
        let model = Model::new(Profile::Census, labels)?;
        let sweep = Algorithm::Sweep.settings(size, 1, 2, Schedule::Sweep);
        let cfbp = Algorithm::Cfbp.settings(size, 10, 2, Schedule::Checkerboard);
        let whole = |settings| Ok::<_, Box<dyn Error>>(Tiling::whole(Plan::new(size, model, settings)?));
        for (name, settings) in [("sweep", sweep), ("cfbp 5x10", Settings { grids: 5, steps: 10, ..cfbp })] {
            let all = solve(device.as_ref(), &scene, whole(settings)?)?;
            print(&scene, (name, "all", 0), &all, &all);
            for (width, height, halo) in TILES {
                let tiling = Tiling::cut(Plan::new(size, model, settings)?, Size { width, height }, halo);
                let tiled = solve(device.as_ref(), &scene, tiling)?;
                let width = if width == ALL { "all".to_owned() } else { width.to_string() };
                print(&scene, (name, &format!("{width} x {height}"), halo), &tiled, &all);
            }
            for grids in [3, 2, 1] {
                let fewer = solve(device.as_ref(), &scene, whole(Settings { grids, ..settings })?)?;
                print(&scene, (&format!("{name}, {grids} grids"), "all", 0), &fewer, &all);
            }
        }
    }
    Ok(())
}

fn solve(device: &dyn Device, scene: &Scene, tiling: Tiling) -> Result<Run> {
    let updates = tiling.message_updates() as f64;
    let mut tiled = Tiled::new(device, tiling)?;
    tiled.solve(device, &scene.pair)?;
    let labels = tiled.labels().to_vec();
    let energy = Energy::of(&scene.pair, tiled.plan().model(), &labels)?.total() as f64;
    let bad = scene.truth.errors(&tiled.disparities()?)?.visible.map_or(f64::NAN, |visible| visible.bad[1]);
    Ok(Run { labels, bad, energy, updates, bytes: tiled.allocated_bytes() })
}

fn print(scene: &Scene, (plan, kept, halo): (&str, &str, usize), run: &Run, whole: &Run) {
    let other = run.labels.iter().zip(&whole.labels).filter(|(a, b)| a != b).count();
    let other = 100.0 * other as f64 / run.labels.len() as f64;
    let (energy, updates) = (run.energy / whole.energy, run.updates / whole.updates);
    let (name, bytes) = (scene.name, run.bytes as f64 / whole.bytes as f64);
    println!(
        "| {name} | {plan} | {kept} | {halo} | {other:.3} % | {:.2} % | {energy:.4} | {updates:.2} | {bytes:.2} |",
        run.bad
    );
}

fn scene(folder: &Path, name: &'static str, scale: f32) -> Result<Scene> {
    let file = |name: &str| folder.join(name);
    let pair = StereoPair::new(image(&file("view1.png"))?, image(&file("view5.png"))?)?;
    let truth = GroundTruth::with_right(map(&file("disp1.png"), scale)?, &map(&file("disp5.png"), scale)?)?;
    Ok(Scene { name, pair, truth })
}

fn image(path: &Path) -> Result<Image> {
    let read = image::ImageReader::open(path)?.decode()?.to_rgb8();
    let pixels = read.pixels().map(|pixel| pixel.0).collect();
    Ok(Image::from_rgb(read.width() as usize, read.height() as usize, pixels)?)
}

/// Reads a map whose stored values are `scale` times the disparity, or 0 if it is unknown.
fn map(path: &Path, scale: f32) -> Result<DisparityMap> {
    let stored = image(path)?;
    let disparity = |&[value, ..]: &[u8; 3]| if value == 0 { DisparityMap::UNKNOWN } else { f32::from(value) / scale };
    Ok(DisparityMap::new(stored.size(), stored.pixels().iter().map(disparity).collect())?)
}
