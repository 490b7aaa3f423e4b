//! The options of a match.

use bp_core::{
    Alignment, Profile, StereoPair,
    finish::{Finish, MEDIANS},
};
use serde::{Deserialize, Serialize};

use crate::{Algorithm, Error, devices};

/// How pairs are matched, and on which device. The default is our own algorithm on the fast backend.
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
    /// The algorithm.
    pub algorithm: Algorithm,
    /// What the options that are `None` stand for.
    pub quality: Quality,
    /// The data cost and its default smoothness; `None` means [`Profile::Census16`], or that of [`Options::quality`].
    pub profile: Option<Profile>,
    /// Slope of the smoothness cost in units of the data cost; `None` means the profile's. If this or the truncation is given,
    /// all edges have the same cost, unless there is an edge threshold too.
    pub slope: Option<u8>,
    /// Truncation K of the smoothness cost, at most [`bp_core::MAX_TRUNCATION`]; `None` means the profile's.
    pub truncation: Option<u8>,
    /// Halves slope and truncation where neighbouring grey values of the left image differ by more than this; 255 gives all
    /// edges the same cost. `None` means the profile's levels; see [`bp_core::EdgeLevels`].
    pub edge_threshold: Option<u8>,
    /// Whether values of any range become shades: by one scale for both images, the 0.5 % darkest black, the 0.5 % brightest white.
    /// For those who read images: files, and arrays of other languages. An [`Image`](bp_core::Image) has shades already.
    pub stretch: bool,
    /// Whether the rows of the right image are aligned with those of the left one first.
    pub align: Align,
    /// The labels.
    pub labels: Labels,
    /// Disparity of the first label in pixels; may be negative. `None` means what the images need with [`Labels::Auto`], else 0.
    pub min_disparity: Option<i32>,
    /// Whether the right image is matched too, and pixels on which the two maps disagree become unknown. `None` means no, or as
    /// [`Options::quality`] says.
    pub check: Option<bool>,
    /// Whether pixels become unknown whose match in the right image fits another pixel better; see
    /// [`check_unique`](bp_core::finish::check_unique). The right image need not be matched for that. `None` means as
    /// [`Options::quality`] says, and no with [`Options::check`].
    pub unique: Option<bool>,
    /// Surfaces with fewer pixels than this become unknown.
    pub speckle: Option<usize>,
    /// Whether pixels that a check or the speckle filter made unknown are filled from their row. At the left border, the
    /// next surface is extended with its slope.
    pub fill: bool,
    /// Side of a median filter's window: 3, 5 or 7. `None` means no filter, or that of [`Options::quality`].
    pub median: Option<usize>,
    /// Whether disparities are refined to fractions of a pixel, by the images; otherwise they are whole. `None` means yes, or as
    /// [`Options::quality`] says.
    pub subpixel: Option<bool>,
    /// Whether each pixel gets a confidence from 0 to 1; matches the right image too.
    pub confidence: bool,
    /// Whether the energy of the labels is added up.
    pub energy: bool,
    /// Backend: "rayon", "scalar", "vulkan" or "wgpu", or "NAME:DEVICE".
    pub backend: String,
    /// Device of the backend: its index, a part of its name or the beginning of its UUID; `None` means the first.
    pub device: Option<String>,
    /// Threads of the backend rayon and, on every backend, of what follows matching; `None` means RAYON_NUM_THREADS or, if that is not set, one per processor.
    pub threads: Option<usize>,
    /// Most bytes that the program may hold, including images and answer. Larger pairs are matched in tiles.
    /// `None` means the free memory, less 32 MiB.
    pub max_memory: Option<u64>,
}

/// The labels of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Labels {
    /// Those that a coarse survey of the images finds. If too little matches, [`Labels::QuarterOfWidth`].
    #[default]
    Auto,
    /// A quarter of the width, rounded up to a multiple of 16, as OpenCV recommends for belief propagation. Of images wider than
    /// 4:3, a quarter of the width of a 4:3 image with as many pixels.
    QuarterOfWidth,
    /// This number of labels.
    Count(usize),
}

/// What to trade for what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quality {
    /// Whole pixels.
    Fast,
    /// Fractions of a pixel, and a uniqueness check: most of what only the left camera sees is filled from the surface behind.
    #[default]
    Balanced,
    /// Fractions of a pixel, a left-right check, which finds more of it, and a median of 3x3. Colour images are matched in
    /// colour, with [`Profile::Census32`].
    Best,
}

impl Quality {
    /// All of them, from fast to slow.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Balanced, Self::Best];

    /// The name used in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Best => "best",
        }
    }
}

/// The alignment of rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    /// None.
    Off,
    /// Measured on the pair. Pairs whose rows agree, or on which too few points do, stay as they are.
    #[default]
    Auto,
    /// This one, measured earlier with the same camera.
    Known(Alignment),
}

impl Default for Options {
    fn default() -> Self {
        Self {
            algorithm: Algorithm::default(),
            quality: Quality::default(),
            profile: None,
            slope: None,
            truncation: None,
            edge_threshold: None,
            stretch: false,
            align: Align::default(),
            labels: Labels::default(),
            min_disparity: None,
            check: None,
            unique: None,
            speckle: None,
            fill: true,
            median: None,
            subpixel: None,
            confidence: false,
            energy: false,
            backend: devices::DEFAULT.to_owned(),
            device: None,
            threads: None,
            max_memory: None,
        }
    }
}

/// Defines builder methods for options.
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
    /// With [`Options::quality`].
    with_quality: Quality => quality = std::convert::identity;
    /// With [`Options::profile`].
    with_profile: Profile => profile = Some;
    /// With [`Options::stretch`].
    with_stretch: bool => stretch = std::convert::identity;
    /// With [`Options::align`].
    with_align: Align => align = std::convert::identity;
    /// With this number of labels; see [`Options::labels`].
    with_labels: usize => labels = Labels::Count;
    /// With [`Options::min_disparity`].
    with_min_disparity: i32 => min_disparity = Some;
    /// With [`Options::edge_threshold`].
    with_edge_threshold: u8 => edge_threshold = Some;
    /// With [`Options::check`].
    with_check: bool => check = Some;
    /// With [`Options::unique`].
    with_unique: bool => unique = Some;
    /// With [`Options::speckle`].
    with_speckle: usize => speckle = Some;
    /// With [`Options::median`].
    with_median: usize => median = Some;
    /// With [`Options::subpixel`].
    with_subpixel: bool => subpixel = Some;
    /// With [`Options::confidence`].
    with_confidence: bool => confidence = std::convert::identity;
    /// With [`Options::energy`].
    with_energy: bool => energy = std::convert::identity;
    /// With [`Options::backend`].
    with_backend: &str => backend = str::to_owned;
    /// With [`Options::threads`].
    with_threads: usize => threads = Some;
    /// With [`Options::max_memory`].
    with_max_memory: u64 => max_memory = Some;
}

impl Options {
    /// Fails if options contradict each other or are impossible.
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

    /// The operations on a map after matching.
    #[must_use]
    pub fn finish(&self) -> Finish {
        let (is_best, check) = (self.quality == Quality::Best, self.checks());
        let unique = self.unique.unwrap_or(self.quality == Quality::Balanced && !check);
        Finish {
            check,
            unique,
            speckles: self.speckle,
            fill: self.fill && (check || unique || self.speckle.is_some()),
            median: self.median.or(is_best.then_some(3)),
            subpixel: self.subpixel.unwrap_or(self.quality != Quality::Fast),
        }
    }

    /// Whether the right image is matched too.
    #[must_use]
    pub fn needs_right(&self) -> bool {
        self.checks() || self.confidence
    }

    fn checks(&self) -> bool {
        self.check.unwrap_or(self.quality == Quality::Best)
    }

    /// What is compared of a pair: without colours, unless they count. Only point clouds need more of the images.
    #[must_use]
    pub fn compared(&self, pair: StereoPair) -> StereoPair {
        let profile = self.profile_for(&pair);
        pair.compared_by(profile)
    }

    /// The profile for a pair: colours count only if the left image has some.
    pub(crate) fn profile_for(&self, pair: &StereoPair) -> Profile {
        let in_colour = || self.quality == Quality::Best && !pair.left().is_grey();
        self.profile.unwrap_or_else(|| if in_colour() { Profile::Census32 } else { Profile::Census16 })
    }
}
