//! `bp rectify`: turns a pair of raw images into a rectified pair.

use std::path::{Path, PathBuf};

use bp_core::{Rectification, Rectifier};
use bp_io::{Files, check_distinct, create_folder, write_image};
use bp_stereo::{Rectifying, read_pair};
use serde::Serialize;

use crate::{args::RectifyArgs, failure::Failure, interrupt};

/// The matrices of a rectification, by the names that OpenCV's documentation gives them.
#[derive(Serialize)]
#[expect(non_snake_case, reason = "the matrices' names")]
struct Matrices {
    width: usize,
    height: usize,
    R1: [[f64; 3]; 3],
    R2: [[f64; 3]; 3],
    P1: [[f64; 4]; 3],
    P2: [[f64; 4]; 3],
    Q: [[f64; 4]; 4],
}

/// Runs the command.
pub(crate) fn rectify(args: &RectifyArgs) -> Result<(), Failure> {
    let rectifying = Rectifying::read(&args.calib)?;
    let outputs = ["left.png", "right.png", "calib.txt", "rectification.json"].map(|name| args.output.join(name));
    for input in [&args.left, &args.right].into_iter().chain(&args.calib) {
        outputs.iter().try_for_each(|output| check_distinct(input, output, "is read, and would be overwritten"))?;
    }
    let raw = read_pair([args.left.as_path(), &args.right], args.max_megapixels, None)?;
    interrupt::listen()?;
    let rectifier = rectifying.rectifier(raw.size())?;
    let pair = rectifying.rectified(&raw)?;
    create_folder(&args.output)?;
    let ([left, right, calib, matrices], files) = (outputs, Files::default());
    write_image(&files, &left, pair.left())?;
    write_image(&files, &right, pair.right())?;
    files.text(&calib, &calib_txt(&rectifier))?;
    files.json(&matrices, &Matrices::of(rectifier.rectification()))?;
    super::print(&told(&args.output, &rectifier))
}

impl Matrices {
    fn of(rectification: &Rectification) -> Self {
        let Rectification { rotations: [left, right], size, .. } = *rectification;
        let [one, other] = rectification.projections();
        Self { width: size.width, height: size.height, R1: left, R2: right, P1: one, P2: other, Q: rectification.q() }
    }
}

/// The geometry in Middlebury's format, for --calib.
fn calib_txt(rectifier: &Rectifier) -> String {
    let Rectification { size, focal, principal_points, baseline, .. } = *rectifier.rectification();
    let [one, other] = principal_points.map(|[column, row]| format!("[{focal} 0 {column}; 0 {focal} {row}; 0 0 1]"));
    let doffs = rectifier.calibration().doffs();
    format!(
        "cam0={one}\ncam1={other}\ndoffs={doffs}\nbaseline={baseline}\nwidth={}\nheight={}\n",
        size.width, size.height
    )
}

fn told(folder: &Path, rectifier: &Rectifier) -> String {
    let Rectification { size, focal, baseline, .. } = *rectifier.rectification();
    let names: Vec<PathBuf> = ["left.png", "right.png", "calib.txt"].map(|name| folder.join(name)).into();
    format!(
        "{size} pixels, focal length {focal:.1} px, baseline {baseline:.1} mm\nmatch it: bp match {} {} --calib {} --depth MAP --output MAP\n",
        names[0].display(),
        names[1].display(),
        names[2].display()
    )
}
