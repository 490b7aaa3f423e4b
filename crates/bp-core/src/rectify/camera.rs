//! Two cameras, as calibration programs describe them.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use crate::Size;

/// As many steps as OpenCV takes to find the ray of a point, so that both choose the same view.
const STEPS: usize = 5;

/// More steps of Newton's method change nothing.
const MOST_STEPS: usize = 20;

/// How a lens bends rays. A ray is a point (x, y) of the plane at distance 1 in front of the camera, and r its distance from the
/// axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Brown (1966). The ray is lengthened by `(1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)`, and moved sideways by
    /// two tangential terms. Most calibrations have k4 to k6 = 0.
    Brown {
        /// k1 to k6.
        radial: [f64; 6],
        /// p1 and p2.
        tangential: [f64; 2],
    },
    /// Kannala and Brandt (2006), for fisheyes: a ray at the angle t from the axis meets the image at the distance
    /// `t + k1 t³ + k2 t⁵ + k3 t⁷ + k4 t⁹`.
    Fisheye(
        /// k1 to k4.
        [f64; 4],
    ),
}

impl Lens {
    /// A lens that bends nothing.
    pub const NONE: Self = Self::Brown { radial: [0.0; 6], tangential: [0.0; 2] };

    /// Where the lens shows a ray, in focal lengths from the principal point.
    fn bent(self, ray: DVec2) -> DVec2 {
        match self {
            Self::Brown { radial, tangential } => ray * lengthened(radial, ray) + sideways(tangential, ray),
            Self::Fisheye(k) => {
                let angle = libm::atan(ray.length());
                if ray == DVec2::ZERO { ray } else { ray * (distance(k, angle) / ray.length()) }
            }
        }
    }

    /// The ray that the lens shows at a point. `None` if there is none in front of the camera.
    fn straightened(self, point: DVec2) -> Option<DVec2> {
        match self {
            Self::Brown { radial, tangential } => searched(radial, tangential, point),
            Self::Fisheye(_) if point == DVec2::ZERO => Some(point),
            Self::Fisheye(k) => {
                let angle = angle(k, point.length());
                (angle.abs() < FRAC_PI_2).then(|| point * (libm::tan(angle) / point.length()))
            }
        }
    }
}

/// The ray of a point, by fixed-point steps. Where its polynomial ends, the lens model says nothing; there the point is
/// taken as its own ray, as in OpenCV.
fn searched(radial: [f64; 6], tangential: [f64; 2], point: DVec2) -> Option<DVec2> {
    let mut ray = point;
    for _ in 0..STEPS {
        let factor = lengthened(radial, ray);
        if factor < 0.0 {
            return Some(point);
        }
        ray = (point - sideways(tangential, ray)) / factor;
    }
    ray.is_finite().then_some(ray)
}

fn lengthened([k1, k2, k3, k4, k5, k6]: [f64; 6], ray: DVec2) -> f64 {
    let square = ray.length_squared();
    (1.0 + ((k3 * square + k2) * square + k1) * square) / (1.0 + ((k6 * square + k5) * square + k4) * square)
}

fn sideways([p1, p2]: [f64; 2], ray: DVec2) -> DVec2 {
    let (square, both) = (ray.length_squared(), 2.0 * ray.x * ray.y);
    DVec2::new(p1 * both + p2 * (square + 2.0 * ray.x * ray.x), p1 * (square + 2.0 * ray.y * ray.y) + p2 * both)
}

/// The distance from the principal point at which a fisheye shows an angle.
fn distance([k1, k2, k3, k4]: [f64; 4], angle: f64) -> f64 {
    let square = angle * angle;
    angle * (1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4))))
}

/// The angle that a fisheye shows at a distance.
fn angle(k: [f64; 4], wanted: f64) -> f64 {
    let [k1, k2, k3, k4] = k;
    let slope = |square: f64| 1.0 + square * (3.0 * k1 + square * (5.0 * k2 + square * (7.0 * k3 + square * 9.0 * k4)));
    (0..MOST_STEPS).fold(wanted.min(FRAC_PI_2), |angle, _| angle - (distance(k, angle) - wanted) / slope(angle * angle))
}

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The size of its images.
    pub size: Size,
    /// The focal length in pixels, across and down.
    pub focal: [f64; 2],
    /// Column and row of the principal point, where (0, 0) is the centre of the first pixel.
    pub principal_point: [f64; 2],
    /// Its lens.
    pub lens: Lens,
}

impl Camera {
    /// The pixel that shows a point in the camera's own coordinates: x right, y down, z forward. `None` if it lies behind.
    #[must_use]
    pub fn pixel(&self, point: [f64; 3]) -> Option<[f64; 2]> {
        let point = DVec3::from(point);
        let bent = self.lens.bent(point.truncate() / point.z);
        (point.z > 0.0 && bent.is_finite())
            .then(|| (bent * DVec2::from(self.focal) + DVec2::from(self.principal_point)).to_array())
    }

    /// The ray that a pixel shows. `None` if there is none in front of the camera.
    pub(super) fn ray(&self, pixel: DVec2) -> Option<DVec3> {
        let point = (pixel - DVec2::from(self.principal_point)) / DVec2::from(self.focal);
        Some(self.lens.straightened(point)?.extend(1.0))
    }

    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        let lens: Vec<f64> = match self.lens {
            Lens::Brown { radial, tangential } => [&radial[..], &tangential[..]].concat(),
            Lens::Fisheye(k) => k.to_vec(),
        };
        self.focal.into_iter().chain(self.principal_point).chain(lens)
    }
}

/// Two cameras that are fixed to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig {
    /// The left camera and the right one.
    pub cameras: [Camera; 2],
    /// Turns a point in the left camera's coordinates into the right one's directions, row by row.
    pub rotation: [[f64; 3]; 3],
    /// Where the right camera sees the left one, in millimetres: a point X of the left camera is `rotation X + translation` in
    /// the right one.
    pub translation: [f64; 3],
}
