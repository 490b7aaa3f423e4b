//! The directions and the view of a rectified pair.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::camera::{Camera, Lens, Rig};
use crate::{Calibration, Error, Size};

/// A rotation matrix from a file may differ by this much from a true rotation.
const ROUNDED: f64 = 1e-3;

/// Points in a row, and rows of points, at which OpenCV measures what a view shows.
const POINTS: usize = 9;

/// How two cameras are turned, and which view the rectified images show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectification {
    /// Turn points of the left and of the right camera into the directions of the rectified pair, row by row.
    pub rotations: [[[f64; 3]; 3]; 2],
    /// The size of the rectified images.
    pub size: Size,
    /// The focal length of both rectified images in pixels.
    pub focal: f64,
    /// Columns and rows of the principal points; the rows are the same.
    pub principal_points: [[f64; 2]; 2],
    /// The distance between the cameras in millimetres.
    pub baseline: f64,
}

impl Rectification {
    /// Turns the cameras of a rig. With `kept` = 0 the images show only what both cameras have pixels for, at least for lenses that
    /// are not fisheyes; with 1 they show everything that either camera sees, and black elsewhere.
    ///
    /// # Errors
    /// [`Error::Calibration`] if no such cameras exist, if their images differ in size, or if they do not stand side by side.
    pub fn of(rig: &Rig, kept: f64) -> Result<Self, Error> {
        let [left, right] = rig.cameras;
        let (rotations, translation) = turned(rig)?;
        let size = left.size;
        let fisheye = rig.cameras.iter().any(|camera| matches!(camera.lens, Lens::Fisheye(_)));
        let cameras = [(left, rotations[0]), (right, rotations[1])];
        let view = if fisheye { fisheye_view(cameras, kept) } else { view(cameras, kept) };
        let (focal, principal_point) = view
            .filter(|(focal, point)| *focal > 0.0 && focal.is_finite() && point.is_finite())
            .ok_or(Error::Calibration("the cameras see too little in common: are their rotation and lenses right?"))?;
        let rotations = rotations.map(|rotation| rotation.transpose().to_cols_array_2d());
        let principal_points = [principal_point.to_array(); 2];
        Ok(Self { rotations, size, focal, principal_points, baseline: translation.length() })
    }

    /// The geometry of the rectified pair.
    ///
    /// # Errors
    /// [`Error::Calibration`] if no pair has it.
    pub fn calibration(&self) -> Result<Calibration, Error> {
        let [left, right] = self.principal_points;
        Calibration::new(self.focal, self.baseline, right[0] - left[0], left)
    }

    /// The projections of both rectified images, row by row, for points in millimetres.
    #[must_use]
    pub fn projections(&self) -> [[[f64; 4]; 3]; 2] {
        let Self { focal, baseline, principal_points: [left, right], .. } = *self;
        [(left, 0.0), (right, -focal * baseline)]
            .map(|([column, row], shift)| [[focal, 0.0, column, shift], [0.0, focal, row, 0.0], [0.0, 0.0, 1.0, 0.0]])
    }

    /// The matrix Q, row by row: `Q [column, row, disparity, 1]` is a point in homogeneous coordinates, in millimetres.
    #[must_use]
    pub fn q(&self) -> [[f64; 4]; 4] {
        let [[column, row], [right, _]] = self.principal_points;
        [
            [1.0, 0.0, 0.0, -column],
            [0.0, 1.0, 0.0, -row],
            [0.0, 0.0, 0.0, self.focal],
            [0.0, 0.0, 1.0 / self.baseline, (right - column) / self.baseline],
        ]
    }

    /// The ray of a camera that a rectified pixel shows.
    pub(super) fn ray(&self, camera: usize) -> impl Fn([f64; 2]) -> [f64; 3] {
        let back = DMat3::from_cols_array_2d(&self.rotations[camera]);
        let (focal, principal_point) = (self.focal, DVec2::from(self.principal_points[camera]));
        move |pixel| (back * ((DVec2::from(pixel) - principal_point) / focal).extend(1.0)).to_array()
    }
}

/// The rotations of both cameras into the directions of the rectified pair, and the translation there. Each camera takes
/// half of the turn between them; then both turn so that the line between them lies along their rows.
fn turned(rig: &Rig) -> Result<([DMat3; 2], DVec3), Error> {
    check(rig)?;
    let between = DQuat::from_mat3(&DMat3::from_cols_array_2d(&rig.rotation).transpose()).normalize();
    let half = DMat3::from_quat(DQuat::IDENTITY.slerp(between.inverse(), 0.5));
    let translation = half * DVec3::from(rig.translation);
    if translation.x.abs() <= translation.y.abs() {
        return Err(Error::Calibration(
            "the cameras do not stand side by side; if one is above the other, turn the images by 90 degrees and calibrate again",
        ));
    }
    if translation.x > 0.0 {
        return Err(Error::Calibration("the right camera stands left of the left one: exchange them"));
    }
    let level = DMat3::from_quat(DQuat::from_rotation_arc(translation.normalize(), DVec3::NEG_X));
    Ok(([level * half.transpose(), level * half], level * translation))
}

fn check(rig: &Rig) -> Result<(), Error> {
    let [left, right] = &rig.cameras;
    if left.size != right.size {
        return Err(Error::SizesDiffer { left: left.size, right: right.size });
    }
    if left.focal.iter().chain(&right.focal).any(|&focal| focal <= 0.0) {
        return Err(Error::Calibration("the focal lengths must be numbers of pixels above 0"));
    }
    let mut numbers =
        left.numbers().chain(right.numbers()).chain(rig.translation).chain(rig.rotation.into_iter().flatten());
    if !numbers.all(f64::is_finite) {
        return Err(Error::Calibration("the numbers of a calibration must be finite"));
    }
    let rotation = DMat3::from_cols_array_2d(&rig.rotation);
    if !(rotation * rotation.transpose()).abs_diff_eq(DMat3::IDENTITY, ROUNDED) || rotation.determinant() < 0.0 {
        return Err(Error::Calibration("the rotation between the cameras is no rotation matrix"));
    }
    if rig.translation == [0.0; 3] {
        return Err(Error::Calibration("the cameras stand in one place: the translation between them is 0"));
    }
    Ok(())
}

/// A camera and its rotation.
type Turned = (Camera, DMat3);

/// Where a pixel lies once its camera is turned, in focal lengths.
fn seen((camera, rotation): &Turned, pixel: DVec2) -> Option<DVec2> {
    let point = *rotation * camera.ray(pixel)?;
    (point.z > 0.0).then(|| point.truncate() / point.z)
}

/// The focal length and the principal point of both images. First their corners are centred with the mean focal length; then
/// the view is enlarged until nothing black is seen (`kept` = 0), or until nothing is cut off (1).
fn view(cameras: [Turned; 2], kept: f64) -> Option<(f64, DVec2)> {
    let focal = cameras.iter().map(|(camera, _)| camera.focal[1]).sum::<f64>() / 2.0;
    let sides = sides(cameras[0].0.size);
    let mut point = DVec2::ZERO;
    for camera in &cameras {
        let corners = [DVec2::ZERO, DVec2::new(sides.x, 0.0), DVec2::new(0.0, sides.y), sides];
        let mut sum = DVec2::ZERO;
        for corner in corners {
            sum += seen(camera, corner)?;
        }
        point += (sides / 2.0 - sum / 4.0 * focal) / 2.0;
    }
    let (mut inside, mut outside) = (0.0_f64, f64::INFINITY);
    for camera in &cameras {
        let [inner, outer] = reach(camera)?;
        let enlargements = |[low, high]: [DVec2; 2]| [point / (-low * focal), (sides - point) / (high * focal)];
        inside = enlargements(inner).iter().map(|side| side.max_element()).fold(inside, f64::max);
        outside = enlargements(outer).iter().map(|side| side.min_element()).fold(outside, f64::min);
    }
    Some((focal * (inside * (1.0 - kept) + outside * kept), point))
}

/// What a turned camera shows, in focal lengths: the largest upright rectangle inside its image, and the smallest around it, as
/// [left, top] and [right, bottom].
fn reach(camera: &Turned) -> Option<[[DVec2; 2]; 2]> {
    let last = POINTS - 1;
    let sides = sides(camera.0.size);
    let mut inner = [DVec2::NEG_INFINITY, DVec2::INFINITY];
    let mut outer = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for (x, y) in (0..POINTS * POINTS).map(|index| (index % POINTS, index / POINTS)) {
        let point = seen(camera, sides * DVec2::new(x as f64, y as f64) / last as f64)?;
        outer = [outer[0].min(point), outer[1].max(point)];
        let limit = |is_border: [bool; 2], none: f64| {
            DVec2::new(if is_border[0] { point.x } else { none }, if is_border[1] { point.y } else { none })
        };
        inner[0] = inner[0].max(limit([x == 0, y == 0], f64::NEG_INFINITY));
        inner[1] = inner[1].min(limit([x == last, y == last], f64::INFINITY));
    }
    Some([inner, outer])
}

/// As [`view`], for fisheyes: their corners may lie behind the camera, so the middles of their borders are measured.
fn fisheye_view(cameras: [Turned; 2], kept: f64) -> Option<(f64, DVec2)> {
    let mut views = [(0.0, DVec2::ZERO); 2];
    for (camera, view) in cameras.iter().zip(&mut views) {
        let [width, height] = [camera.0.size.width, camera.0.size.height].map(|side| side as f64);
        let [middle_x, middle_y] = [camera.0.size.width / 2, camera.0.size.height / 2].map(|side| side as f64);
        let mut points = [[middle_x, 0.0], [width, middle_y], [middle_x, height], [0.0, middle_y]].map(DVec2::from);
        for point in &mut points {
            *point = seen(camera, *point)?;
        }
        let aspect = camera.0.focal[0] / camera.0.focal[1];
        let upright = DVec2::new(1.0, aspect);
        let centre = points.iter().sum::<DVec2>() / 4.0 * upright;
        let points = points.map(|point| point * upright);
        let low = points.into_iter().fold(DVec2::INFINITY, DVec2::min);
        let high = points.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
        let half = DVec2::new(width, height * aspect) / 2.0;
        let focals = [half / (centre - low), half / (high - centre)];
        let most = focals[0].max(focals[1]).max_element();
        let least = focals[0].min(focals[1]).min_element();
        let focal = kept * least + (1.0 - kept) * most;
        *view = (focal / aspect, (half - centre * focal) / upright);
    }
    let [(left, one), (right, other)] = views;
    Some((left.min(right), (one + other) / 2.0))
}

/// The column and row of the last pixel.
fn sides(Size { width, height }: Size) -> DVec2 {
    DVec2::new(width as f64 - 1.0, height as f64 - 1.0)
}
