//! Depth and 3D points from disparities and the geometry of a rectified pair.
//!
//! A point at depth Z in front of the left camera has the disparity `d = f B / Z - doffs`. Here f is the focal length
//! in pixels, B the baseline (the distance between the cameras), and doffs the number of pixels by which the right
//! principal point lies to the right of the left one. These names come from `calib.txt` of Scharstein et al. (2014).

use crate::{DisparityMap, Error, Image};

/// The geometry of a rectified pair, in pixels of its images. An image of half the size has half the focal length, doffs
/// and principal point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    focal: f64,
    baseline: f64,
    doffs: f64,
    principal_point: [f64; 2],
}

impl Calibration {
    /// A calibration from the focal length in pixels, the baseline, doffs in pixels, and the column and row of the left
    /// image's principal point, where (0, 0) is the centre of the first pixel. Depth has the unit of the baseline.
    ///
    /// # Errors
    /// [`Error::Calibration`] if a length is not above 0 or a number is not finite.
    pub fn new(focal: f64, baseline: f64, doffs: f64, principal_point: [f64; 2]) -> Result<Self, Error> {
        let is_length = |value: f64| value > 0.0 && value.is_finite();
        if !is_length(focal) {
            return Err(Error::Calibration("the focal length must be a number of pixels above 0"));
        }
        if !is_length(baseline) {
            return Err(Error::Calibration("the baseline, the distance of the cameras, must be a number above 0"));
        }
        if !doffs.is_finite() || !principal_point.iter().all(|value| value.is_finite()) {
            return Err(Error::Calibration("doffs and the principal point must be finite numbers of pixels"));
        }
        Ok(Self { focal, baseline, doffs, principal_point })
    }

    /// The focal length in pixels.
    #[must_use]
    pub fn focal(&self) -> f64 {
        self.focal
    }

    /// The distance between the cameras, in the unit of depth.
    #[must_use]
    pub fn baseline(&self) -> f64 {
        self.baseline
    }

    /// The offset that is added to disparities to compute depth, in pixels.
    #[must_use]
    pub fn doffs(&self) -> f64 {
        self.doffs
    }

    /// The column and row of the left image's principal point.
    #[must_use]
    pub fn principal_point(&self) -> [f64; 2] {
        self.principal_point
    }

    /// The depth of a disparity, `f B / (d + doffs)`. `None` if d is unknown, or if d + doffs is not above 0: no point in
    /// front of the cameras has such a disparity.
    #[must_use]
    pub fn depth(&self, disparity: f32) -> Option<f32> {
        let shift = f64::from(disparity) + self.doffs;
        let depth = (self.focal * self.baseline / shift) as f32;
        (shift > 0.0 && depth > 0.0 && depth.is_finite()).then_some(depth)
    }

    /// The position of the point that left pixel (x, y) shows at a depth: x to the right, y down, z forward from the left
    /// camera, in the unit of depth.
    #[must_use]
    pub fn position(&self, x: usize, y: usize, depth: f32) -> [f32; 3] {
        let off_axis = |pixel: usize, centre: f64| ((pixel as f64 - centre) * f64::from(depth) / self.focal) as f32;
        let [column, row] = self.principal_point;
        [off_axis(x, column), off_axis(y, row), depth]
    }
}

/// The depths of a map, `[height][width]`, in the unit of the baseline. Unknown depths are plus infinity.
#[must_use]
pub fn depth_map(map: &DisparityMap, calibration: &Calibration) -> Vec<f32> {
    map.values().iter().map(|&disparity| calibration.depth(disparity).unwrap_or(DisparityMap::UNKNOWN)).collect()
}

/// A point that the left image shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// As returned by [`Calibration::position`].
    pub position: [f32; 3],
    /// The colour of its pixel.
    pub colour: [u8; 3],
}

/// The points that the left image shows, row by row. Pixels without depth are left out.
///
/// # Errors
/// [`Error::WrongSize`] if image and map differ in size.
pub fn points(
    map: &DisparityMap,
    image: &Image,
    calibration: &Calibration,
) -> Result<impl Iterator<Item = Point> + Clone, Error> {
    let size = map.size();
    if image.size() != size {
        return Err(Error::WrongSize { what: "the image", found: image.size(), expected: size });
    }
    Ok(map.values().iter().enumerate().filter_map(move |(index, &disparity)| {
        let (depth, [x, y]) = (calibration.depth(disparity)?, [index % size.width, index / size.width]);
        Some(Point { position: calibration.position(x, y, depth), colour: image.rgb(x, y) })
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    fn calibration(doffs: f64) -> Calibration {
        Calibration::new(100.0, 20.0, doffs, [1.0, 0.5]).unwrap()
    }

    #[test]
    fn depth_and_disparity_are_each_others_inverse() {
        let calibration = Calibration::new(1870.0, 160.0, 135.0, [619.5, 554.5]).unwrap();
        for depth in [900.0_f64, 1234.5, 2200.0] {
            let disparity = 1870.0 * 160.0 / depth - 135.0;
            let found = f64::from(calibration.depth(disparity as f32).unwrap());
            assert!((found / depth - 1.0).abs() < 1e-5, "{depth}: {found}");
        }
    }

    #[test]
    fn what_lies_nowhere_before_the_cameras_has_no_depth() {
        let depths = [-3.0, -2.0, -1.0, f32::INFINITY, f32::NAN].map(|disparity| calibration(2.0).depth(disparity));
        assert_eq!(depths, [None, None, Some(2000.0), None, None]);
        assert_eq!(Calibration::new(1e300, 1e300, 0.0, [0.0; 2]).unwrap().depth(1.0), None);
    }

    #[test]
    fn points_lie_on_the_rays_of_their_pixels() {
        let size = Size { width: 3, height: 2 };
        let map = DisparityMap::new(size, vec![2.0, f32::INFINITY, 2.0, 0.0, 4.0, 1.0]).unwrap();
        let image = Image::from_grey(3, 2, [1, 2, 3, 4, 5, 6]).unwrap();
        let points: Vec<Point> = points(&map, &image, &calibration(0.0)).unwrap().collect();
        let expected =
            [([-10.0, -5.0, 1000.0], 1), ([10.0, -5.0, 1000.0], 3), ([0.0, 2.5, 500.0], 5), ([20.0, 10.0, 2000.0], 6)];
        assert_eq!(points, expected.map(|(position, grey)| Point { position, colour: [grey; 3] }));
        let other = Image::from_grey(2, 3, [0; 6]).unwrap();
        assert!(matches!(super::points(&map, &other, &calibration(0.0)), Err(Error::WrongSize { .. })));
    }

    #[test]
    fn geometries_that_no_pair_has_are_refused() {
        for (focal, baseline, doffs) in
            [(0.0, 1.0, 0.0), (f64::NAN, 1.0, 0.0), (1.0, -1.0, 0.0), (1.0, f64::INFINITY, 0.0), (1.0, 1.0, f64::NAN)]
        {
            assert!(matches!(Calibration::new(focal, baseline, doffs, [0.0; 2]), Err(Error::Calibration(_))));
        }
    }
}
