//! The record of a matched pair. It shows a later run that the pair is complete.

use std::{
    fs::{self, File, Metadata},
    io::{self, Read as _},
    ops::Add,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use bp_core::Size;
use bp_io::{CalibrationFile, Colours, Contents, Files, Geometry, MOST_DESCRIPTION, hex};

use super::{Also, BatchOptions};
use crate::{Error, Making, Options, Rectifying, Tiles, description};

/// The state of a file when its pair was done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FileState {
    pub(super) path: PathBuf,
    bytes: u64,
    /// Time of the last write in nanoseconds since 1970, if the file system knows it.
    modified_ns: Option<u64>,
    /// Time of the last change of any kind (ctime), which `cp --preserve` and `tar` do not restore.
    changed_ns: Option<i128>,
    pub(super) sha256: String,
}

/// The outputs of a pair and how they were made.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Done {
    pub(super) outputs: Vec<FileState>,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) backend: String,
    pub(super) device: description::Device,
    pub(super) settings: description::Settings,
    /// `None` if the pair was matched as a whole.
    pub(super) tiles: Option<Tiles>,
    pub(super) energy: Option<description::Energy>,
    pub(super) warnings: Vec<String>,
    pub(super) times: PairTimes,
}

/// Wall-clock times in milliseconds.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct PairTimes {
    /// Reading both images; overlaps with the matching of another pair.
    pub read_ms: f64,
    /// From the images in memory to the map in memory.
    pub solve_ms: f64,
    /// `solve_ms` and everything else that matching needs: planning, preparing the device for a new size, the energy.
    pub match_ms: f64,
    /// Writing the outputs; overlaps with the matching of another pair.
    pub write_ms: f64,
}

impl Add for PairTimes {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            read_ms: self.read_ms + other.read_ms,
            solve_ms: self.solve_ms + other.solve_ms,
            match_ms: self.match_ms + other.match_ms,
            write_ms: self.write_ms + other.write_ms,
        }
    }
}

/// The record of a pair that is done.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PairRecord {
    pub(super) name: PathBuf,
    pub(super) left: PathBuf,
    pub(super) right: PathBuf,
    /// The [`history`] of the earlier frames that its messages depend on; `None` after a cold start.
    pub(super) follows: Option<String>,
    /// A hash of all settings that outputs depend on; see [`settings_sha256`].
    pub(super) settings_sha256: String,
    /// The images.
    pub(super) inputs: Vec<FileState>,
    /// Milliseconds since the previous pair was done, or since the batch began. Over all pairs they sum to the total
    /// time.
    pub(super) elapsed_ms: f64,
    pub(super) done: Done,
}

/// SHA-256 of the images of a frame and of the history before it, and so of all frames that its messages depend on.
pub(super) fn history(follows: Option<&str>, images: &[FileState]) -> String {
    let mut hash = Sha256::new();
    let frames = follows.into_iter().chain(images.iter().map(|state| state.sha256.as_str()));
    frames.for_each(|part| hash.update(part));
    hex(&hash.finalize())
}

impl PairRecord {
    /// Reads a record. Returns `None` if it is missing or broken, or cannot be read.
    pub(super) fn read(path: &Path) -> Option<Self> {
        Self::known(path).ok()?
    }

    /// Reads a record. Returns `None` if it is missing or broken.
    pub(super) fn known(path: &Path) -> Result<Option<Self>, bp_io::Error> {
        if !path.try_exists().map_err(|error| bp_io::Error::reading(path, &error))? {
            return Ok(None);
        }
        Ok(serde_json::from_slice(&Contents::of_regular(path, MOST_DESCRIPTION)?.bytes).ok())
    }

    /// Writes the record, whole or not at all.
    pub(super) fn write(&self, files: &Files, path: &Path) -> Result<(), Error> {
        Ok(files.json(path, self)?)
    }

    /// Whether its images and outputs are these files, unchanged.
    pub(super) fn is_of(&self, images: &[&Path; 2], outputs: &[PathBuf]) -> bool {
        fn same(then: &[FileState], now: &[impl AsRef<Path>]) -> bool {
            then.len() == now.len() && then.iter().zip(now).all(|(then, now)| then.is_still(now.as_ref()))
        }
        same(&self.inputs, images) && same(&self.done.outputs, outputs)
    }

    /// Whether its images have these contents.
    pub(super) fn is_of_contents(&self, images: &[FileState]) -> bool {
        self.inputs.iter().map(|state| &state.sha256).eq(images.iter().map(|state| &state.sha256))
    }
}

impl FileState {
    /// The current state of a file.
    pub(super) fn of(path: &Path) -> Result<Self, bp_io::Error> {
        let failed = |error: io::Error| bp_io::Error::reading(path, &error);
        let mut file = File::open(path).map_err(failed)?;
        let about = file.metadata().map_err(failed)?;
        let (mut hash, mut part) = (Sha256::new(), vec![0; 1 << 16]);
        loop {
            match file.read(&mut part).map_err(failed)? {
                0 => break,
                bytes => hash.update(&part[..bytes]),
            }
        }
        Self::new(path, &about, hex(&hash.finalize()))
    }

    /// The state of a file when it was read into memory: that of the very bytes which are decoded.
    pub(super) fn read(path: &Path, contents: &Contents) -> Result<Self, bp_io::Error> {
        Self::new(path, &contents.metadata, hex(&Sha256::digest(&contents.bytes)))
    }

    fn new(path: &Path, about: &Metadata, sha256: String) -> Result<Self, bp_io::Error> {
        let path = std::path::absolute(path).map_err(|error| bp_io::Error::reading(path, &error))?;
        let (bytes, modified_ns, changed_ns) = Self::stamp(about);
        Ok(Self { path, bytes, modified_ns, changed_ns, sha256 })
    }

    /// Whether `path` is known to have the same contents.
    pub(super) fn is_still(&self, path: &Path) -> bool {
        self.compare(path).unwrap_or(false)
    }

    /// Whether `path` has the same contents. Reads the file only if its path or times changed.
    pub(super) fn compare(&self, path: &Path) -> Result<bool, bp_io::Error> {
        let metadata = match fs::metadata(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            metadata => metadata.map_err(|error| bp_io::Error::reading(path, &error))?,
        };
        let (bytes, modified_ns, changed_ns) = Self::stamp(&metadata);
        let same_file = std::path::absolute(path).is_ok_and(|path| path == self.path);
        let same_times = (modified_ns, changed_ns) == (self.modified_ns, self.changed_ns);
        let untouched = same_file && modified_ns.is_some() && same_times;
        if !metadata.is_file() || bytes != self.bytes {
            return Ok(false);
        }
        Ok(untouched || Self::of(path)?.sha256 == self.sha256)
    }

    /// Length and times of a file.
    fn stamp(metadata: &Metadata) -> (u64, Option<u64>, Option<i128>) {
        #[cfg(unix)]
        let changed_ns = {
            use std::os::unix::fs::MetadataExt;
            Some(i128::from(metadata.ctime()) * 1_000_000_000 + i128::from(metadata.ctime_nsec()))
        };
        #[cfg(not(unix))]
        let changed_ns = None;
        let since = |time: SystemTime| time.duration_since(SystemTime::UNIX_EPOCH).ok();
        let nanoseconds = |time: Duration| u64::try_from(time.as_nanos()).ok();
        (metadata.len(), metadata.modified().ok().and_then(since).and_then(nanoseconds), changed_ns)
    }
}

/// Everything that outputs depend on.
#[derive(Serialize)]
struct OutputSettings<'a> {
    version: &'static str,
    matching: Options,
    format: &'a str,
    also: &'a [Also],
    warm_start: Option<u32>,
    colours: Colours,
    colour_bar: bool,
    sidecar: bool,
    nan: bool,
    geometry: Option<GeometrySettings>,
    /// SHA-256 of the calibration, if pairs are rectified with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    rectified: Option<&'a str>,
    negate: bool,
}

/// The values of a geometry, since its file may change later.
#[derive(Serialize)]
struct GeometrySettings {
    focal: f64,
    baseline: f64,
    doffs: f64,
    principal_point: Option<[f64; 2]>,
    size: Option<[usize; 2]>,
}

impl From<&Geometry> for GeometrySettings {
    fn from(geometry: &Geometry) -> Self {
        let Geometry { focal, baseline, doffs, principal_point, ref file } = *geometry;
        let size = file.as_ref().and_then(|CalibrationFile { size, .. }| *size);
        let size = size.map(|Size { width, height }| [width, height]);
        Self { focal, baseline, doffs, principal_point, size }
    }
}

/// SHA-256 of the program's version and of everything that outputs depend on. Paths and the device are left out: every
/// device gives the same answer.
pub(super) fn settings_sha256(options: &BatchOptions, making: &Making) -> Result<String, Error> {
    let unnamed = Options { backend: String::new(), device: None, threads: None, ..options.matching.clone() };
    let settings = OutputSettings {
        version: env!("CARGO_PKG_VERSION"),
        matching: unnamed,
        format: &options.format,
        also: &options.also,
        warm_start: options.warm_start,
        colours: making.picture.colours,
        colour_bar: making.picture.bar.is_some(),
        sidecar: !making.no_sidecar,
        nan: making.nan,
        geometry: making.geometry.as_ref().map(Into::into),
        rectified: making.rectifying.as_deref().map(Rectifying::sha256),
        negate: making.negate,
    };
    let text = serde_json::to_vec(&settings).map_err(|error| Error::System(format!("settings: {error}")))?;
    Ok(hex(&Sha256::digest(text)))
}
