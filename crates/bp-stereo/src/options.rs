//! Everything that a caller can choose.

use bp_core::{
    Profile,
    finish::{Finish, MEDIANS},
};
use serde::{Deserialize, Serialize};

use crate::{Algorithm, Error, devices};

/// What is matched, how, and on which device. The default is our own algorithm on the fast backend.
///
/// ```
/// use bp_stereo::{Algorithm, Labels, Options};
///
/// let options = Options::default().with_labels(64).with_check(true).with_median(3);
/// assert_eq!(options.labels, Labels::Count(64));
/// let text = r#"{ "algorithm": { "name": "cfbp", "loops": { "half_steps": 10 } }, "labels": "auto" }"#;
/// let options: Options = serde_json::from_str(text).unwrap();
/// assert!(matches!(options.algorithm, Algorithm::Cfbp { .. }));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// What is run.
    pub algorithm: Algorithm,
    /// Data cost, with the smoothness that goes with it.
    pub profile: Profile,
    /// Slope of the smoothness cost in units of the data cost; none for the profile's.
    pub slope: Option<u8>,
    /// Truncation K of the smoothness cost, at most [`bp_core::MAX_TRUNCATION`]; none for the profile's.
    pub truncation: Option<u8>,
    /// Weak edges: half slope and truncation where neighbouring grey values of the left image differ by more.
    pub edge_threshold: Option<u8>,
    /// The labels.
    pub labels: Labels,
    /// Disparity of the first label in pixels; may be negative. None for 0, or with [`Labels::Auto`] what the images need.
    pub min_disparity: Option<i32>,
    /// Whether the right image is matched too, and what the two maps do not agree on becomes unknown.
    pub check: bool,
    /// Surfaces of fewer pixels become unknown.
    pub speckle: Option<usize>,
    /// Whether pixels that the check or the speckle filter made unknown are filled from their row.
    pub fill: bool,
    /// Side of a median filter's window: 3, 5 or 7.
    pub median: Option<usize>,
    /// Whether disparities get fractions.
    pub subpixel: bool,
    /// Whether each pixel gets a confidence from 0 to 1; matches the right image too.
    pub confidence: bool,
    /// Backend: "rayon", "scalar", "vulkan" or "wgpu", or "NAME:DEVICE".
    pub backend: String,
    /// Device of the backend: its index, a part of its name or the beginning of its UUID; none for its first.
    pub device: Option<String>,
    /// Threads of the backend rayon; none for RAYON_NUM_THREADS, else one for each processor.
    pub threads: Option<usize>,
    /// Most bytes that the program may hold, images and answer included: larger pairs are matched in strips or tiles. None for
    /// what is free.
    pub max_memory: Option<u64>,
}

/// The labels of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Labels {
    /// A quarter of the width, rounded up to a multiple of 16, as OpenCV recommends for belief propagation.
    #[default]
    QuarterOfWidth,
    /// As many as a coarse look at the images finds.
    Auto,
    /// So many.
    Count(usize),
}

impl Default for Options {
    fn default() -> Self {
        Self {
            algorithm: Algorithm::default(),
            profile: Profile::Census,
            slope: None,
            truncation: None,
            edge_threshold: None,
            labels: Labels::default(),
            min_disparity: None,
            check: false,
            speckle: None,
            fill: true,
            median: None,
            subpixel: false,
            confidence: false,
            backend: devices::DEFAULT.to_owned(),
            device: None,
            threads: None,
            max_memory: None,
        }
    }
}

/// Sets one option after another.
macro_rules! setters {
    ($($(#[$doc:meta])+ $name:ident: $type:ty => $field:ident = $value:expr;)+) => {
        impl Options {
            $($(#[$doc])+
            #[must_use]
            pub fn $name(mut self, value: $type) -> Self {
                self.$field = $value(value);
                self
            })+
        }
    };
}

setters! {
    /// With [`Options::algorithm`].
    with_algorithm: Algorithm => algorithm = std::convert::identity;
    /// With [`Options::profile`].
    with_profile: Profile => profile = std::convert::identity;
    /// With so many labels, see [`Options::labels`].
    with_labels: usize => labels = Labels::Count;
    /// With [`Options::min_disparity`].
    with_min_disparity: i32 => min_disparity = Some;
    /// With [`Options::edge_threshold`].
    with_edge_threshold: u8 => edge_threshold = Some;
    /// With [`Options::check`].
    with_check: bool => check = std::convert::identity;
    /// With [`Options::speckle`].
    with_speckle: usize => speckle = Some;
    /// With [`Options::median`].
    with_median: usize => median = Some;
    /// With [`Options::subpixel`].
    with_subpixel: bool => subpixel = std::convert::identity;
    /// With [`Options::confidence`].
    with_confidence: bool => confidence = std::convert::identity;
    /// With [`Options::backend`].
    with_backend: &str => backend = str::to_owned;
    /// With [`Options::threads`].
    with_threads: usize => threads = Some;
    /// With [`Options::max_memory`].
    with_max_memory: u64 => max_memory = Some;
}

impl Options {
    /// Fails where options contradict each other or nothing can follow them.
    ///
    /// # Errors
    /// [`Error::Options`], which names them.
    pub fn check(&self) -> Result<(), Error> {
        self.algorithm.check()?;
        match self.median {
            Some(side) if !MEDIANS.contains(&side) => Err(Error::Options(format!("`median` is 3, 5 or 7, not {side}"))),
            _ => Ok(()),
        }
    }

    /// What is done to a map after matching.
    #[must_use]
    pub fn finish(&self) -> Finish {
        Finish {
            check: self.check,
            speckles: self.speckle,
            fill: self.fill && (self.check || self.speckle.is_some()),
            median: self.median,
            subpixel: self.subpixel,
        }
    }

    /// Whether the right image is matched too.
    #[must_use]
    pub fn needs_right(&self) -> bool {
        self.check || self.confidence
    }
}
