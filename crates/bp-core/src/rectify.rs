//! Rectification: from the images of two calibrated cameras to a pair whose rows match.
//!
//! A [`Rig`] describes the two cameras as calibration programs do. [`Rectification::of`] turns both to look in one direction,
//! at right angles to the line between them, through one focal length: a point then lies in the same row of both images.
//! [`Rectifier`] resamples images accordingly.
//!
//! The turn is Bouguet's (Camera Calibration Toolbox, 2004), and the view is chosen as OpenCV chooses it, so that both give the
//! same pair. All functions are those of `libm`, so that they give it on every machine.

mod camera;
mod rectifier;
mod view;

pub use camera::{Camera, Lens, Rig};
pub use rectifier::Rectifier;
pub use view::Rectification;
