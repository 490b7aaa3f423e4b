//! OpenCV's files. They have no fixed names; these are the ones of its own programs and their usual variants.

use bp_core::{Lens, Size};

use super::{CalibrationFile, Cameras, Geometry, Optics, Raw, Rectified, tree::Tree};
use crate::Error;

const MATRICES: [&[&str]; 2] = [
    &["M1", "K1", "cameraMatrix1", "camera_matrix_1", "camera_matrix1", "K_l", "K_left"],
    &["M2", "K2", "cameraMatrix2", "camera_matrix_2", "camera_matrix2", "K_r", "K_right"],
];
const DISTORTIONS: [&[&str]; 2] = [
    &["D1", "distCoeffs1", "dist_coeffs_1", "dist_coeffs1", "distortion_coefficients_1", "D_l", "D_left"],
    &["D2", "distCoeffs2", "dist_coeffs_2", "dist_coeffs2", "distortion_coefficients_2", "D_r", "D_right"],
];
const SIZES: &[&str] = &["imageSize", "image_size", "img_size", "size"];

/// The cameras of one file, or of one for intrinsic and one for extrinsic parameters.
pub(super) fn cameras(trees: &[Tree<'_>]) -> Result<Cameras, Error> {
    let with = |names: &[&str]| trees.iter().find(|tree| tree.has(names));
    let size = size(trees)?;
    let geometry =
        with(&["P1"]).map(|tree| projected(tree, size)).or_else(|| with(&["Q"]).map(|tree| reprojected(tree, size)));
    let geometry = geometry.transpose()?;
    let parts = [with(MATRICES[0]), with(MATRICES[1]), with(&["R"]), with(&["T"])];
    let raw = match parts {
        [Some(left), Some(right), Some(turned), Some(moved)] => Some(Raw {
            lenses: [optics(left, 0)?, optics(right, 1)?],
            rotation: turned.matrix(&["R"])?,
            translation: moved.vector(&["T"])?,
            size,
            rectification: match (with(&["R1"]), &geometry) {
                (Some(tree), Some(geometry)) if with(&["P1"]).is_some() => Some(Rectified {
                    rotations: [tree.matrix(&["R1"])?, tree.matrix(&["R2"])?],
                    geometry: geometry.clone(),
                    size,
                }),
                _ => None,
            },
        }),
        _ => None,
    };
    if raw.is_none() && geometry.is_none() {
        let what = "not a calibration that is known: a pair in OpenCV's format has M1, D1, M2, D2, R and T, or P1 and P2, or Q; \
                    intrinsic and extrinsic parameters may be two files";
        return Err(trees[0].failed(what));
    }
    Ok(Cameras { path: trees[0].path.to_owned(), geometry, raw })
}

fn size(trees: &[Tree<'_>]) -> Result<Option<Size>, Error> {
    for tree in trees {
        if let Some(size) = tree.size(SIZES)? {
            return Ok(Some(size));
        }
        if let (Ok(width), Ok(height)) = (tree.numbers(&["image_width"]), tree.numbers(&["image_height"])) {
            return tree.checked_size(width.iter().sum(), height.iter().sum()).map(Some);
        }
    }
    Ok(None)
}

/// The geometry of the projections P1 and P2.
fn projected(tree: &Tree<'_>, size: Option<Size>) -> Result<Geometry, Error> {
    tree.geometry([tree.projection(&["P1"])?, tree.projection(&["P2"])?], 1.0, size)
}

/// The geometry of the matrix Q.
fn reprojected(tree: &Tree<'_>, size: Option<Size>) -> Result<Geometry, Error> {
    let [[_, _, _, column], [_, _, _, row], [_, _, _, focal], [_, _, inverse, offset]] = tree.square(&["Q"])?;
    let baseline = (1.0 / inverse).abs();
    let file = Some(CalibrationFile { path: tree.path.to_owned(), size });
    let doffs = offset / inverse;
    let geometry = Geometry { focal, baseline, doffs, principal_point: Some([-column, -row]), file };
    geometry.possible().map_err(|error| tree.failed(&format!("Q: {error}")))?;
    Ok(geometry)
}

fn optics(tree: &Tree<'_>, index: usize) -> Result<Optics, Error> {
    let fisheye = tree.word(&["distortion_model", "camera_model", "model"]).is_some_and(|word| is_fisheye(&word));
    let coefficients = if tree.has(DISTORTIONS[index]) { tree.numbers(DISTORTIONS[index])? } else { Vec::new() };
    super::opencv::camera(tree, tree.matrix(MATRICES[index])?, &coefficients, fisheye)
}

/// Whether a distortion model is that of fisheyes.
pub(super) fn is_fisheye(word: &str) -> bool {
    ["fisheye", "equidistant", "kannala"].iter().any(|name| word.contains(name))
}

/// A camera from a camera matrix and distortion coefficients in OpenCV's order.
pub(super) fn camera(
    tree: &Tree<'_>,
    matrix: [[f64; 3]; 3],
    coefficients: &[f64],
    fisheye: bool,
) -> Result<Optics, Error> {
    let [[across, skew, column], [_, down, row], _] = matrix;
    if skew != 0.0 {
        return Err(tree.failed("a camera matrix has skew, which is not supported"));
    }
    let lens = lens(coefficients, fisheye).ok_or_else(|| {
        let most = if fisheye { "a fisheye has 4" } else { "4, 5 and 8 are supported (no thin prisms, no tilt)" };
        tree.failed(&format!("{} distortion coefficients: {most}", coefficients.len()))
    })?;
    Ok(Optics { focal: [across, down], principal_point: [column, row], lens })
}

fn lens(coefficients: &[f64], fisheye: bool) -> Option<Lens> {
    let used = coefficients.iter().rposition(|value| *value != 0.0).map_or(0, |last| last + 1);
    let mut all = [0.0; 8];
    all.get_mut(..used)?.copy_from_slice(&coefficients[..used]);
    let [k1, k2, p1, p2, k3, k4, k5, k6] = all;
    match fisheye {
        true => (used <= 4).then_some(Lens::Fisheye([k1, k2, p1, p2])),
        false => Some(Lens::Brown { radial: [k1, k2, k3, k4, k5, k6], tangential: [p1, p2] }),
    }
}
