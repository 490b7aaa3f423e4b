//! The scenes of the experiments: six public ones, or six synthetic ones if those are not available.

use std::path::{Path, PathBuf};

use bp_core::{DisparityMap, GroundTruth, Image, StereoPair};
use bp_io::{Contents, Limits, parse_image, parse_map};
use bp_testkit::synthetic;
use serde::Deserialize;

use crate::{
    failure::Failure,
    files::pixels_sha256,
    record::{self, ImageSum},
};

/// The thesis's six scenes as we identify them, in its order.
pub const THESIS_SCENES: [&str; 6] = ["Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books"];

/// Divisor of the small synthetic scenes' width and height.
const SMALL_DIVISOR: usize = 2;

/// Six scenes of one origin and size.
#[derive(Debug)]
pub struct Set {
    /// Its name in records, and its folder's name in a data folder.
    pub name: &'static str,
    /// Labels of every scene: a multiple of 8 above the largest true disparity of all six.
    pub labels: usize,
    /// Its description in one sentence.
    pub described: &'static str,
    /// A short description, for every table and chart.
    pub short: &'static str,
}

const HALF_SIZE: Set = Set {
    name: "middlebury2006",
    labels: 112,
    described: "the thesis's six Middlebury scenes at half size, as in the thesis",
    short: "Middlebury 2005/2006, half size",
};
const THIRD_SIZE: Set = Set {
    name: "middlebury2006-thirdsize",
    labels: 80,
    described: "the thesis's six Middlebury scenes at third size, smaller than the thesis's",
    short: "Middlebury 2005/2006, third size",
};
const SYNTHETIC: Set = Set {
    name: "synthetic",
    labels: 112,
    described: "six synthetic scenes of the thesis's sizes; not the thesis's images",
    short: "synthetic scenes",
};
const SMALL_SYNTHETIC: Set = Set {
    name: "synthetic-small",
    labels: 56,
    described: "six synthetic scenes at half of the thesis's sizes; not the thesis's images",
    short: "synthetic scenes, small",
};

/// The set with this name in records.
pub fn set(name: &str) -> Option<&'static Set> {
    [&HALF_SIZE, &THIRD_SIZE, &SYNTHETIC, &SMALL_SYNTHETIC].into_iter().find(|set| set.name == name)
}

/// A pair with its ground truth.
pub struct Scene {
    /// The images.
    pub pair: StereoPair,
    /// The ground truth of the left image.
    pub truth: GroundTruth,
    /// Its description.
    pub record: record::Scene,
}

/// Where scenes come from.
#[derive(Clone, Debug)]
pub struct Source {
    /// The data folder; `None` for synthetic scenes.
    folder: Option<PathBuf>,
    /// Which six scenes.
    pub set: &'static Set,
}

impl Source {
    /// The scenes of a data folder, at half size or, if `quick`, at third size. Without a folder, the synthetic scenes.
    pub fn new(folder: Option<PathBuf>, quick: bool) -> Result<Self, Failure> {
        let set = match (&folder, quick) {
            (Some(_), false) => &HALF_SIZE,
            (Some(_), true) => &THIRD_SIZE,
            (None, false) => &SYNTHETIC,
            (None, true) => &SMALL_SYNTHETIC,
        };
        if let Some(folder) = &folder {
            let scenes = THESIS_SCENES.map(|scene| format!("{}/{scene}", set.name));
            if let Some(scene) = scenes.into_iter().find(|scene| !folder.join(scene).is_dir()) {
                let (folder, what) = (folder.display(), "see scripts/fetch-middlebury, or use --synthetic");
                return Err(Failure::input(format!("--data {folder}: there is no folder {scene} in it; {what}")));
            }
        }
        Ok(Self { folder, set })
    }

    /// The folder of public data, if used.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// The names of the six scenes, in order.
    pub fn names(&self) -> [&'static str; 6] {
        if self.folder.is_some() { THESIS_SCENES } else { synthetic::NAMES }
    }

    /// Checks the files of the six scenes before a run; fails if one is missing or differs from the manifest.
    pub fn check(&self) -> Result<(), Failure> {
        let Some(folder) = &self.folder else { return Ok(()) };
        THESIS_SCENES.iter().try_for_each(|scene| middlebury(folder, self.set, scene).map(drop))
    }

    /// Loads scene `index` of six.
    pub fn load(&self, index: usize) -> Result<Scene, Failure> {
        match &self.folder {
            Some(folder) => middlebury(folder, self.set, THESIS_SCENES[index]),
            None => made_up(index, if self.set.name == SYNTHETIC.name { 1 } else { SMALL_DIVISOR }),
        }
    }
}

/// A scene's record, computed from the loaded data.
fn described(name: &str, pair: &StereoPair, truth: &GroundTruth, images: Vec<ImageSum>) -> record::Scene {
    let known = |&(_, value): &(usize, &f32)| value.is_finite();
    let seen = |i: usize| truth.visible().is_some_and(|visible| visible[i]);
    let pixels = || truth.disparities().values().iter().enumerate().filter(known);
    record::Scene {
        name: name.to_owned(),
        width: pair.size().width,
        height: pair.size().height,
        largest_disparity: truth.disparities().range().map_or(0.0, |(_, high)| high),
        known: pixels().count() as u64,
        visible: pixels().filter(|&(i, _)| seen(i)).count() as u64,
        images,
    }
}

/// Makes synthetic scene `index` of six, with width and height divided by `divisor`.
pub fn made_up(index: usize, divisor: usize) -> Result<Scene, Failure> {
    let synthetic::Scene { name, pair, truth_left, visible, .. } = synthetic::scene(index, divisor);
    let truth = GroundTruth::with_mask(truth_left, visible)?;
    let sum = |path: &str, image: &Image| ImageSum { path: path.to_owned(), sha256: pixels_sha256(image) };
    let images = vec![sum("left", pair.left()), sum("right", pair.right())];
    Ok(Scene { record: described(name, &pair, &truth, images), pair, truth })
}

/// Loads and checks the four images of a scene of the 2005 and 2006 sets.
fn middlebury(folder: &Path, set: &Set, scene: &str) -> Result<Scene, Failure> {
    let manifest = Manifest::read()?;
    let mut images = Vec::new();
    let mut load = |file: &str| -> Result<(PathBuf, f32), Failure> {
        let entry = manifest.entry(&format!("{}/{scene}/{file}", set.name))?;
        images.push(ImageSum { path: entry.path.clone(), sha256: entry.sha256.clone() });
        Ok((folder.join(&entry.path), entry.scale.unwrap_or(1.0)))
    };
    let [left, right, truth, truth_right] = ["view1.png", "view5.png", "disp1.png", "disp5.png"].map(&mut load);
    let image = |file: Result<(PathBuf, f32), Failure>| Ok::<_, Failure>(manifest.checked(folder, &file?.0)?.0);
    let (left, right) = (image(left)?, image(right)?);
    let map = |file: Result<(PathBuf, f32), Failure>| -> Result<DisparityMap, Failure> {
        let (path, scale) = file?;
        let (_, contents) = manifest.checked(folder, &path)?;
        Ok(parse_map(&path, &contents.bytes, Some(scale), Limits::default())?)
    };
    let truth = GroundTruth::with_right(map(truth)?, &map(truth_right)?)?;
    let pair = StereoPair::new(left, right)?;
    Ok(Scene { record: described(scene, &pair, &truth, images), pair, truth })
}

/// Path of the manifest in messages.
const MANIFEST: &str = "crates/harness/data/middlebury.json";

/// The expected checksums of the public data files: `data/middlebury.json`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    #[expect(dead_code, reason = "for readers of the file")]
    about: String,
    /// The files.
    pub files: Vec<ManifestEntry>,
}

/// A data file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestEntry {
    /// Path below the data folder.
    pub path: String,
    width: usize,
    height: usize,
    /// For a disparity map: stored value divided by disparity in pixels.
    pub scale: Option<f32>,
    /// SHA-256 of the decoded pixels.
    sha256: String,
}

impl Manifest {
    /// Reads the manifest of this build.
    pub fn read() -> Result<Self, Failure> {
        let text = include_str!("../data/middlebury.json");
        serde_json::from_str(text).map_err(|error| Failure::other(format!("{MANIFEST}: {error}")))
    }

    fn entry(&self, path: &str) -> Result<&ManifestEntry, Failure> {
        let entry = self.files.iter().find(|entry| entry.path == path);
        entry.ok_or_else(|| Failure::other(format!("{MANIFEST} does not list {path}")))
    }

    /// Reads a listed image, and returns its file, too. Fails, and names it, if its size or pixels differ from the manifest.
    pub fn checked(&self, folder: &Path, path: &Path) -> Result<(Image, Contents), Failure> {
        let below = path.strip_prefix(folder).unwrap_or(path);
        let entry = self.entry(&below.to_string_lossy().replace('\\', "/"))?;
        // A pipe could be empty for ever.
        let contents = Contents::of_regular(path, Limits::default().file_bytes())?;
        let image = parse_image(path, &contents.bytes, Limits::default())?;
        let (width, height) = (image.size().width, image.size().height);
        if (width, height) != (entry.width, entry.height) {
            let expected = format!("{}x{}", entry.width, entry.height);
            return Err(Failure::reading(path, &format!("{width}x{height} pixels instead of {expected}")));
        }
        if pixels_sha256(&image) != entry.sha256 {
            let what = format!("its pixels are not those that {MANIFEST} lists; delete it and fetch it again");
            return Err(Failure::reading(path, &what));
        }
        Ok((image, contents))
    }
}
