//! KITTI's files: `calib_cam_to_cam.txt` of raw drives (Geiger et al. 2013), and the projections of odometry and object data.
//! Cameras 2 and 3 are in colour, 0 and 1 in grey; the colour ones are taken where both are there.

use super::{Cameras, Optics, Raw, Rectified, opencv, tree::Tree};
use crate::Error;

/// Metres in millimetres.
const METRE: f64 = 1e3;

pub(super) fn is_it(tree: &Tree<'_>) -> bool {
    tree.has(&["P_rect_00"]) || tree.has(&["P_rect_02"]) || tree.has(&["P0"]) || tree.has(&["P2"]) && tree.has(&["P3"])
}

pub(super) fn cameras(tree: &Tree<'_>) -> Result<Cameras, Error> {
    if tree.has(&["P_rect_00"]) || tree.has(&["P_rect_02"]) {
        return drive(tree, if tree.has(&["P_rect_02"]) { ["02", "03"] } else { ["00", "01"] });
    }
    let names = if tree.has(&["P2"]) { ["P2", "P3"] } else { ["P0", "P1"] };
    let geometry = tree.geometry([tree.projection(&[names[0]])?, tree.projection(&[names[1]])?], METRE, None)?;
    Ok(Cameras { path: tree.path.to_owned(), geometry: Some(geometry), raw: None })
}

fn drive(tree: &Tree<'_>, cameras: [&str; 2]) -> Result<Cameras, Error> {
    let name = |what: &str, camera: usize| format!("{what}_{}", cameras[camera]);
    let matrix = |what: &str, camera: usize| tree.matrix(&[&name(what, camera)]);
    let rectified = tree.size(&[&name("S_rect", 0)])?;
    let projections = [tree.projection(&[&name("P_rect", 0)])?, tree.projection(&[&name("P_rect", 1)])?];
    let geometry = tree.geometry(projections, METRE, rectified)?;
    // Both are given from camera 0.
    let [left, right] = [matrix("R", 0)?, matrix("R", 1)?];
    let rotation = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| right[i][k] * left[j][k]).sum()));
    let [from, to] = [tree.vector(&[&name("T", 0)])?, tree.vector(&[&name("T", 1)])?];
    let moved =
        |i: usize| to[i] - rotation[i].iter().zip(from).map(|(factor, value): (&f64, f64)| factor * value).sum::<f64>();
    let optics = |camera: usize| -> Result<Optics, Error> {
        opencv::camera(tree, matrix("K", camera)?, &tree.numbers(&[&name("D", camera)])?, false)
    };
    let rotations = [matrix("R_rect", 0)?, matrix("R_rect", 1)?];
    let raw = Raw {
        lenses: [optics(0)?, optics(1)?],
        rotation,
        translation: [0, 1, 2].map(|i| METRE * moved(i)),
        size: tree.size(&[&name("S", 0)])?,
        rectification: Some(Rectified { rotations, geometry: geometry.clone(), size: rectified }),
    };
    Ok(Cameras { path: tree.path.to_owned(), geometry: Some(geometry), raw: Some(raw) })
}
