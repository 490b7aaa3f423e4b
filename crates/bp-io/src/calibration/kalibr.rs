//! Kalibr's `camchain.yaml` (Furgale et al. 2013), of pinhole cameras. cam0 is the left one.

use super::{Cameras, Optics, Raw, opencv, tree::Tree};
use crate::Error;

/// Metres in millimetres.
const METRE: f64 = 1e3;

pub(super) fn is_it(tree: &Tree<'_>) -> bool {
    tree.find(&["cam0"]).is_some_and(|camera| camera.has(&["intrinsics"]))
}

pub(super) fn cameras(tree: &Tree<'_>) -> Result<Cameras, Error> {
    let camera = |name: &str| tree.find(&[name]).ok_or_else(|| tree.failed(&format!("{name} is missing")));
    let (left, right) = (camera("cam0")?, camera("cam1")?);
    let [rows @ .., _] = right.square(&["T_cn_cnm1"])?;
    let raw = Raw {
        lenses: [optics(&left)?, optics(&right)?],
        rotation: rows.map(|[a, b, c, _]| [a, b, c]),
        translation: rows.map(|[_, _, _, metres]| METRE * metres),
        size: left.size(&["resolution"])?,
        rectification: None,
    };
    Ok(Cameras { path: tree.path.to_owned(), geometry: None, raw: Some(raw) })
}

fn optics(tree: &Tree<'_>) -> Result<Optics, Error> {
    let word = |names: &[&str], usual: &str| tree.word(names).unwrap_or_else(|| usual.to_owned());
    let (camera, lens) = (word(&["camera_model"], "pinhole"), word(&["distortion_model"], "none"));
    if camera != "pinhole" || !["radtan", "equidistant", "none"].contains(&lens.as_str()) {
        return Err(tree
            .failed(&format!("a camera is {camera}, {lens}; pinhole with radtan, equidistant or none is supported")));
    }
    let numbers = tree.numbers(&["intrinsics"])?;
    let &[across, down, column, row] = numbers.as_slice() else {
        return Err(tree.failed("intrinsics should be 4 numbers"));
    };
    let coefficients = if lens == "none" { Vec::new() } else { tree.numbers(&["distortion_coeffs"])? };
    let matrix = [[across, 0.0, column], [0.0, down, row], [0.0, 0.0, 1.0]];
    opencv::camera(tree, matrix, &coefficients, lens == "equidistant")
}
