//! Renders the sample pair: `cargo run -p bp-testkit --example sample_pair -- bench-data/sample`.
//!
//! The pair is the project's own, so anybody may use it for anything. It is the synthetic scene "doll" at half size,
//! with its ground truth and a calibration. The files are the same on every machine.

use std::{env, error::Error, fs, path::Path};

use bp_core::Size;
use bp_testkit::synthetic;
use image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};

const DOLL: usize = 0;
const HALF: usize = 2;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args_os().nth(1).ok_or("name the folder to write to")?;
    let folder = Path::new(&folder);
    fs::create_dir_all(folder)?;
    let scene = synthetic::scene(DOLL, HALF);
    let size = scene.pair.size();
    for (name, image) in [("left.png", scene.pair.left()), ("right.png", scene.pair.right())] {
        let colours: Vec<u8> = image.pixels().iter().flatten().copied().collect();
        write_png(&folder.join(name), size, ExtendedColorType::Rgb8, &colours)?;
    }
    // KITTI's format, which `bp evaluate` expects in 16-bit files: 256 times the disparity.
    let truth = scene.truth_left.values().iter().map(|disparity| (disparity * 256.0).round() as u16);
    let truth: Vec<u8> = truth.flat_map(u16::to_ne_bytes).collect();
    write_png(&folder.join("truth.png"), size, ExtendedColorType::L16, &truth)?;
    let mask: Vec<u8> = scene.visible.iter().map(|&seen_by_both| 255 * u8::from(seen_by_both)).collect();
    write_png(&folder.join("mask.png"), size, ExtendedColorType::L8, &mask)?;
    fs::write(folder.join("calib.txt"), calibration(size))?;
    Ok(())
}

fn write_png(path: &Path, size: Size, colours: ExtendedColorType, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    let file = fs::File::create(path)?;
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    Ok(encoder.write_image(bytes, size.width as u32, size.height as u32, colours)?)
}

/// A calibration in Middlebury's format. The scene fixes disparities only, so its cameras are ours to choose. With
/// these, the doll is half a metre tall, sits 80 cm away, and is as deep as it looks round.
fn calibration(size: Size) -> String {
    let Size { width, height } = size;
    let (focal, doffs, baseline, labels) = (400, 60, 160, 40);
    let [column, row] = [width, height].map(|side| (side as f64 - 1.0) / 2.0);
    let right_column = column + f64::from(doffs);
    format!(
        "cam0=[{focal} 0 {column}; 0 {focal} {row}; 0 0 1]\n\
         cam1=[{focal} 0 {right_column}; 0 {focal} {row}; 0 0 1]\n\
         doffs={doffs}\nbaseline={baseline}\nwidth={width}\nheight={height}\nndisp={labels}\n"
    )
}
