//! The `camera_info` files of ROS, one for each camera. They hold the rectification too.

use super::{Cameras, Optics, Raw, Rectified, opencv, tree::Tree};
use crate::Error;

const MATRIX: &[&str] = &["camera_matrix", "K"];
const DISTORTION: &[&str] = &["distortion_coefficients", "D"];
const MODEL: &[&str] = &["distortion_model"];
const ROTATION: &[&str] = &["rectification_matrix", "R"];
const PROJECTION: &[&str] = &["projection_matrix", "P"];

/// Metres in millimetres.
const METRE: f64 = 1e3;

pub(super) fn is_it(tree: &Tree<'_>) -> bool {
    tree.has(MODEL) && tree.has(PROJECTION) && tree.has(ROTATION)
}

pub(super) fn cameras(left: &Tree<'_>, right: Option<&Tree<'_>>) -> Result<Cameras, Error> {
    let missing =
        || left.failed("a camera_info describes one camera: give the files of both, that of the left one first");
    let right = right.filter(|right| is_it(right)).ok_or_else(missing)?;
    let number = |name: &str| Ok::<_, Error>(left.numbers(&[name])?.iter().sum());
    let size = match (left.has(&["image_width"]), left.has(&["width"])) {
        (true, _) => Some(left.checked_size(number("image_width")?, number("image_height")?)?),
        (false, true) => Some(left.checked_size(number("width")?, number("height")?)?),
        _ => None,
    };
    let geometry = left.geometry([left.projection(PROJECTION)?, right.projection(PROJECTION)?], METRE, size)?;
    let rotations = [left.matrix(ROTATION)?, right.matrix(ROTATION)?];
    let [one, other] = rotations;
    // A point of the rectified left camera lies one baseline further left in the rectified right one.
    let rotation = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| other[k][i] * one[k][j]).sum()));
    let translation = [0, 1, 2].map(|i| -geometry.baseline * other[0][i]);
    let lenses = [optics(left)?, optics(right)?];
    let rectification = Some(Rectified { rotations, geometry: geometry.clone(), size });
    let raw = Some(Raw { lenses, rotation, translation, size, rectification });
    Ok(Cameras { path: left.path.to_owned(), geometry: Some(geometry), raw })
}

fn optics(tree: &Tree<'_>) -> Result<Optics, Error> {
    let fisheye = tree.word(MODEL).is_some_and(|word| opencv::is_fisheye(&word));
    let coefficients = if tree.has(DISTORTION) { tree.numbers(DISTORTION)? } else { Vec::new() };
    opencv::camera(tree, tree.matrix(MATRIX)?, &coefficients, fisheye)
}
