//! Files of stereo matching: images, frames of videos, disparity maps, masks, point clouds, calibrations and the sidecars that describe
//! maps.
//!
//! Readers accept any bytes and return an [`Error`] instead of a panic. [`Limits`] bound their memory. Writers use
//! [`Files`], which writes a temporary file and renames it, so that nobody ever sees half a file.
//!
//! ```no_run
//! use bp_io::{Files, Limits, Raster, read_image, read_map};
//!
//! # fn main() -> Result<(), bp_io::Error> {
//! let limits = Limits::default();
//! let image = read_image("left.png".as_ref(), limits)?;
//! println!("{} pixels", image.size());
//! let map = read_map("map.pfm".as_ref(), None, limits)?;
//! Raster::disparities(&map).write(&Files::default(), "map.png".as_ref())?;
//! # Ok(())
//! # }
//! ```

mod alignment;
mod calibration;
mod caught;
mod colours;
mod decode;
mod decoding;
mod error;
mod folders;
mod format;
mod frames;
mod headers;
mod images;
mod limits;
mod maps;
mod npy;
mod pfm;
mod picture;
#[cfg(unix)]
mod pipe;
mod ply;
mod png;
mod raster;
mod read;
mod samples;
mod sidecar;
mod tiff;
mod write;

pub use alignment::read_alignment;
pub use calibration::{CalibrationFile, Cameras, Geometry};
pub use caught::is_caught;
pub use colours::Colours;
pub use error::Error;
pub use folders::{create_folder, is_folder};
pub use format::{MapFormat, Quantity, check_ending, check_range};
pub use frames::{FrameFormat, Frames, Layout, PairFrames};
pub use images::{StoredGrey, hex, parse_image, parse_stored_grey, pixels_sha256, read_image, write_image};
pub use limits::Limits;
pub use maps::{Mask, parse_map, parse_mask, read_map, read_mask};
pub use picture::{ColourBar, DrawBar, Picture, Pixels, encode_picture};
pub use ply::write_points;
pub use raster::Raster;
pub use read::{Contents, MOST_DESCRIPTION, MOST_TEXT, read_source, read_text};
pub use samples::parse_samples;
pub use sidecar::{Origin, put_described, sidecar_of, staged_picture_sidecar, staged_sidecar};
pub use write::{Files, Staged, check_distinct, check_new, is_stream, resolved};
