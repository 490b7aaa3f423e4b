//! The pairs that are matched.

use std::path::{Path, PathBuf};

use bp_core::{DisparityMap, Error, GroundTruth, Image, Size, StereoPair};
use bp_testkit::synthetic;

use crate::Failure;

/// A pair, and its truth where that is known.
pub(crate) struct Scene {
    /// What the report calls it.
    pub(crate) name: String,
    /// The images.
    pub(crate) pair: StereoPair,
    /// Visible in it are pixels that the right camera sees too and that lie at least as many columns from the left
    /// edge as there are labels.
    pub(crate) truth: Option<GroundTruth>,
}

impl Scene {
    /// Name and size, in a heading.
    pub(crate) fn described(&self) -> String {
        let size = self.pair.size();
        format!("{}, {}x{}", self.name, size.width, size.height)
    }
}

/// Where real pairs come from, if there are any.
pub(crate) struct Data {
    folder: Option<PathBuf>,
}

impl Data {
    /// The data folder, if one is given: it must be there.
    pub(crate) fn new(folder: Option<PathBuf>) -> Result<Self, Failure> {
        match folder {
            Some(folder) if !folder.is_dir() => {
                Err(format!("{}: there is no such data folder", folder.display()).into())
            }
            folder => Ok(Self { folder }),
        }
    }

    /// The same in a sentence.
    pub(crate) fn described(&self) -> &'static str {
        match self.folder {
            Some(_) => "Real pairs from the data folder.",
            None => {
                "Without a data folder: the pairs are synthetic scenes and noise of the real ones' sizes, and energies \
                 and errors are of those."
            }
        }
    }

    /// Baby1 at half size, 620x555.
    pub(crate) fn baby1(&self) -> Result<Scene, Failure> {
        self.middlebury_2006("Baby1", 0)
    }

    /// Aloe at half size, 641x555.
    pub(crate) fn aloe(&self, labels: usize) -> Result<Scene, Failure> {
        let mut scene = self.middlebury_2006("Aloe", 1)?;
        scene.truth = scene.truth.map(|truth| without_left_edge(&truth, labels)).transpose()?;
        Ok(scene)
    }

    /// A pair of Middlebury's second evaluation: its size, number of labels and the scale of its truth.
    pub(crate) fn middlebury_v2(&self, name: &str, size: Size, labels: usize, scale: f32) -> Result<Scene, Failure> {
        let Some(folder) = &self.folder else {
            return Ok(Scene {
                name: format!("noise as large as {name}"),
                pair: noise(size, labels / 3)?,
                truth: None,
            });
        };
        let file = |file: &str| folder.join("middlebury2001-2003").join(name).join(file);
        let pair = StereoPair::new(image(&file("imL.png"))?, image(&file("imR.png"))?)?;
        let seen = image(&file("nonocc.png"))?.pixels().iter().map(|&[value, ..]| value > 0).collect();
        let truth = GroundTruth::with_mask(map(&file("groundtruth.png"), scale)?, seen)?;
        Ok(Scene { name: name.to_owned(), pair, truth: Some(without_left_edge(&truth, labels)?) })
    }

    /// A pair of the 2006 set at half size, or a synthetic scene.
    fn middlebury_2006(&self, name: &str, synthetic: usize) -> Result<Scene, Failure> {
        let Some(folder) = &self.folder else {
            let scene = synthetic::scene(synthetic, 1);
            let truth = GroundTruth::with_mask(scene.truth_left, scene.visible)?;
            return Ok(Scene { name: format!("synthetic {}", scene.name), pair: scene.pair, truth: Some(truth) });
        };
        let file = |file: &str| folder.join("middlebury2006").join(name).join(file);
        let pair = StereoPair::new(image(&file("view1.png"))?, image(&file("view5.png"))?)?;
        let truth = GroundTruth::with_right(map(&file("disp1.png"), 2.0)?, &map(&file("disp5.png"), 2.0)?)?;
        Ok(Scene { name: name.to_owned(), pair, truth: Some(truth) })
    }
}

/// Drops the first columns from what counts as visible.
fn without_left_edge(truth: &GroundTruth, columns: usize) -> Result<GroundTruth, Error> {
    let width = truth.disparities().size().width;
    let visible = truth.visible().unwrap_or_default().iter().enumerate();
    let visible = visible.map(|(i, &seen)| seen && i % width >= columns).collect();
    GroundTruth::with_mask(truth.disparities().clone(), visible)
}

/// Noise whose right view is shifted by so many pixels.
pub(crate) fn noise(size: Size, shift: usize) -> Result<StereoPair, Error> {
    let value = |x: usize, y: usize| {
        let mixed = (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77);
        ((mixed ^ mixed >> 15).wrapping_mul(0xc2b2_ae3d) >> 24) as u8
    };
    let view = |shift| {
        let pixels: Vec<u8> = (0..size.pixels()).map(|i| value(i % size.width + shift, i / size.width)).collect();
        Image::from_grey(size.width, size.height, &pixels)
    };
    StereoPair::new(view(0)?, view(shift)?)
}

fn image(path: &Path) -> Result<Image, Failure> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let read = image::ImageReader::open(path).map_err(|error| failed(&error))?;
    let read = read.decode().map_err(|error| failed(&error))?.to_rgb8();
    let pixels = read.pixels().map(|pixel| pixel.0).collect();
    Ok(Image::from_rgb(read.width() as usize, read.height() as usize, pixels)?)
}

/// A map of stored values that are `scale` times the disparity, 0 where it is unknown.
fn map(path: &Path, scale: f32) -> Result<DisparityMap, Failure> {
    let stored = image(path)?;
    let disparity = |&[value, ..]: &[u8; 3]| if value == 0 { DisparityMap::UNKNOWN } else { f32::from(value) / scale };
    Ok(DisparityMap::new(stored.size(), stored.pixels().iter().map(disparity).collect())?)
}
