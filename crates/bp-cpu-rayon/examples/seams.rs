//! How visible the borders of bands, of coarse nodes and of tiles are in maps of `sweep`, with all labels and with label sets: prints
//! each scene, and the means that docs/algorithms.md and docs/big-images.md show.
//!
//! `cargo run --release -p bp-cpu-rayon --example seams -- DATA`, where DATA has the Middlebury pairs of 2006 at half size and
//! those of version 3 at a quarter of their size.

use std::{error::Error, path::Path};

use bp_core::{
    Algorithm, Backend, Device, DisparityMap, Energy, GroundTruth, HALO, Image, Model, Plan, Profile, Schedule,
    Settings, Size, StereoPair, Tiled, Tiling,
};
use bp_testkit::jumps;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Scenes at half size. Their truth is stored as twice the disparity.
const HALF: [&str; 6] = ["Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books"];

/// Scenes of version 3, and their labels.
const VERSION_3: [(&str, usize); 8] = [
    ("ArtL", 64),
    ("Motorcycle", 72),
    ("MotorcycleE", 72),
    ("Piano", 68),
    ("Playroom", 84),
    ("Playtable", 76),
    ("Recycle", 68),
    ("Teddy", 64),
];

/// Every so many rows or columns.
const PERIODS: [usize; 4] = [16, 32, 64, 128];

/// The columns and rows that a tile keeps, so that its borders are at the last of the periods.
const TILE: Size = Size { width: 128, height: 128 };

/// The profile, and whether with label sets and in tiles.
const PLANS: [(Profile, bool, bool); 4] = [
    (Profile::Census, false, false),
    (Profile::Census, false, true),
    (Profile::Census16, true, false),
    (Profile::Census16, true, true),
];

fn main() -> Result<()> {
    let data = std::env::args().nth(1).ok_or("usage: seams DATA")?;
    let device = bp_cpu_rayon::Rayon.open(0)?;
    let periods = PERIODS.map(|period| format!(" every {period} |")).concat();
    for (profile, label_sets, tiles) in PLANS {
        let [sets, image] =
            [["off", "on"][usize::from(label_sets)], ["the whole image", "tiles of 128x128"][usize::from(tiles)]];
        println!("Profile {}, label sets {sets}, {image}:\n", profile.name());
        println!("| scene | rows:{periods} columns:{periods} bad-1.0 non-occluded | bad-1.0 all | RMSE | energy |");
        println!("|---|{}", "---:|".repeat(12));
        print_scenes(&Plans { device: device.as_ref(), profile, label_sets, tiles }, Path::new(&data))?;
        println!();
    }
    Ok(())
}

/// Prints each scene and the means.
fn print_scenes(plans: &Plans<'_>, data: &Path) -> Result<()> {
    let mut sums = vec![];
    for name in HALF {
        let file = |name: &str| data.join("middlebury2006").join(name);
        let (truth, right) = (map(&file(name).join("disp1.png"))?, map(&file(name).join("disp5.png"))?);
        let pair = pair(&file(name).join("view1.png"), &file(name).join("view5.png"))?;
        let truth = GroundTruth::with_right(truth, &right)?;
        sums.push(row(name, &plans.solve(&pair, 112)?, Some(&truth))?);
    }
    for (name, labels) in VERSION_3 {
        let folder = data.join("middlebury-v3-quarter").join(name);
        let pair = pair(&folder.join("im0.png"), &folder.join("im1.png"))?;
        sums.push(row(name, &plans.solve(&pair, labels)?, None)?);
    }
    let mean = |of: &[Vec<f64>], i: usize| of.iter().map(|row| row[i]).sum::<f64>() / of.len() as f64;
    let (half, all) = (&sums[..HALF.len()], &sums);
    let ratios: Vec<f64> = (0..8).map(|i| mean(all, i)).collect();
    let errors: Vec<f64> = (8..12).map(|i| mean(half, i)).collect();
    println!("{}", cells("mean", &[ratios, errors].concat()));
    Ok(())
}

struct Solved {
    map: DisparityMap,
    labels: Vec<u16>,
    energy: f64,
}

/// What all pairs are matched by.
struct Plans<'a> {
    device: &'a dyn Device,
    profile: Profile,
    label_sets: bool,
    tiles: bool,
}

impl Plans<'_> {
    fn solve(&self, pair: &StereoPair, labels: usize) -> Result<Solved> {
        let model = Model::new(self.profile, labels)?;
        let settings = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
        let settings = Settings { label_sets: self.label_sets, ..settings };
        let plan = Plan::new(pair.size(), model, settings)?;
        let tiling = if self.tiles { Tiling::cut(plan, TILE, HALO) } else { Tiling::whole(plan) };
        let mut tiled = Tiled::new(self.device, tiling)?;
        tiled.solve(self.device, pair)?;
        let energy = Energy::of(pair, &model, tiled.labels())?.total() as f64;
        Ok(Solved { map: tiled.disparities()?, labels: tiled.labels().to_vec(), energy })
    }
}

/// Prints a row, and returns its numbers.
fn row(name: &str, solved: &Solved, truth: Option<&GroundTruth>) -> Result<Vec<f64>> {
    let (labels, size) = (&solved.labels, solved.map.size());
    let jumps = [jumps::between_rows(labels, size), jumps::between_columns(labels, size)];
    let mut numbers: Vec<f64> =
        jumps.iter().flat_map(|jumps| PERIODS.map(|period| jumps::ratio(jumps, period))).collect();
    if let Some(truth) = truth {
        let errors = truth.errors(&solved.map)?;
        numbers.extend([errors.visible.map_or(f64::NAN, |e| e.bad[1]), errors.all.bad[1], errors.all.rmse]);
        numbers.push(solved.energy);
    }
    let unknown = if truth.is_some() { "" } else { " - | - | - | - |" };
    println!("{}{unknown}", cells(name, &numbers));
    Ok(numbers)
}

fn cells(name: &str, numbers: &[f64]) -> String {
    numbers.iter().fold(format!("| {name} |"), |text, number| format!("{text} {number:.2} |"))
}

fn pair(left: &Path, right: &Path) -> Result<StereoPair> {
    Ok(StereoPair::new(image(left)?, image(right)?)?)
}

fn image(path: &Path) -> Result<Image> {
    let read = image::ImageReader::open(path)?.decode()?.to_rgb8();
    Ok(Image::from_rgb(read.width() as usize, read.height() as usize, read.pixels().map(|pixel| pixel.0).collect())?)
}

/// A map of stored values that are twice the disparity, 0 where it is unknown.
fn map(path: &Path) -> Result<DisparityMap> {
    let stored = image(path)?;
    let disparity = |&[value, ..]: &[u8; 3]| if value == 0 { DisparityMap::UNKNOWN } else { f32::from(value) / 2.0 };
    Ok(DisparityMap::new(stored.size(), stored.pixels().iter().map(disparity).collect())?)
}
