//! Stereo matching by min-sum belief propagation on a 4-connected grid, in exact 8-bit integers.
//!
//! Two images in, a disparity map out:
//!
//! ```
//! use bp_core::{Algorithm, Backend, Image, Driver, Model, Plan, Profile, Schedule, StereoPair};
//!
//! # fn main() -> Result<(), bp_core::Error> {
//! # let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729 + x * x * 31 + x * y * 17) % 251) as u8;
//! # let view = |shift| (0..32 * 20).map(|i| noise(i % 32 + shift, i / 32)).collect::<Vec<u8>>();
//! # let (left, right) = (view(0), view(3));
//! let pair = StereoPair::new(Image::from_grey(32, 20, left)?, Image::from_grey(32, 20, right)?)?;
//! let model = Model::new(Profile::Census, 16)?;
//! let settings = Algorithm::Cfcsbp.settings(pair.size(), 16, 2, Schedule::Checkerboard);
//! let plan = Plan::new(pair.size(), model, settings)?;
//! println!("{} message entries, {} bytes", plan.message_updates(), plan.bytes());
//! let device = bp_cpu_scalar::Scalar.open(0)?;
//! let mut driver = Driver::new(device.as_ref(), plan)?;
//! driver.solve(&pair)?;
//! assert_eq!(driver.disparities()?.at(20, 10), Some(3.0));
//! # Ok(())
//! # }
//! ```
//!
//! A [`Model`] defines what is minimised, a [`Plan`] what runs and what it will cost, and a [`Backend`] where it runs.
//! The five algorithms of the thesis and our own are [`Settings`] of one plan. Labels and messages are bit-identical on
//! all backends. [`exactness`] explains why 8 bits suffice for that, and [`worked_example`] works through a pair of 3x2
//! pixels by hand.

mod alignment;
mod backend;
pub mod census;
mod cost;
mod depth;
mod disparity_map;
mod driver;
mod energy;
mod error;
pub mod exactness;
mod features;
pub mod finish;
pub mod image;
mod label_set;
mod limits;
pub mod memory;
mod metrics;
mod model;
mod node;
mod pair;
mod parts;
mod patch;
mod plan;
mod rectify;
mod seam;
mod settings;
mod side;
mod size;
mod smoothness;
mod stage;
mod stop;
pub mod survey;
mod tiles;
pub mod worked_example;

pub use alignment::Alignment;
pub use backend::{Backend, Device, DeviceInfo, DeviceKind, Solver};
pub use census::Seed;
pub use cost::DataCost;
pub use depth::{Calibration, Point, depth_map, points};
pub use disparity_map::DisparityMap;
pub use driver::{Driver, Observer, Progress, Times};
pub use energy::{Energy, cheapest_labels};
pub use error::Error;
pub use image::Image;
pub use label_set::LabelSet;
pub use limits::{MAX_LABELS, MAX_SIDE, MAX_TRUNCATION};
pub use metrics::{Distribution, Errors, GroundTruth, MapErrors, THRESHOLDS};
pub use model::{Model, Profile};
pub use node::Node;
pub use pair::StereoPair;
pub use parts::{Part, PartDriver, Parting};
pub use patch::Patch;
pub use plan::{Buffer, MAX_GRIDS, Plan};
pub use rectify::{Camera, Lens, Rectification, Rectifier, Rig};
pub use seam::Seam;
pub use settings::{Algorithm, BAND_ROWS, Cut, MessageStart, Schedule, Settings};
pub use side::Side;
pub use size::Size;
pub use smoothness::{EdgeLevels, Smoothness};
pub use stage::Stage;
pub use stop::{IsStopped, never};
pub use tiles::{Around, HALO, Needed, Span, Tile, Tiled, Tiling, border};
