//! Rectifies pairs as they are read.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
};

use bp_core::{Calibration, Rectifier, Size, StereoPair};
use bp_io::{Cameras, Contents, MOST_DESCRIPTION, hex};
use sha2::{Digest, Sha256};

use crate::Error;

/// Bytes per pixel of the rectifier.
pub(crate) const POSITIONS: u64 = 16;

/// Cameras whose pairs are rectified with one rectifier. It is prepared for the first pair, and again for images of another
/// size.
#[derive(Debug)]
pub struct Rectifying {
    cameras: Cameras,
    files: Vec<PathBuf>,
    /// Of the files' contents.
    sha256: String,
    prepared: Mutex<Option<(Size, Arc<Rectifier>)>>,
}

impl Rectifying {
    /// Reads a calibration of one file or two, see [`Cameras`].
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn read(files: &[PathBuf]) -> Result<Self, Error> {
        let mut hash = Sha256::new();
        let mut contents = Vec::new();
        for path in files {
            let bytes = Contents::of(path, MOST_DESCRIPTION)?.bytes;
            hash.update(&bytes);
            contents.push((path.clone(), bytes));
        }
        let (cameras, sha256) = (Cameras::parse(&contents)?, hex(&hash.finalize()));
        Ok(Self { cameras, files: files.to_vec(), sha256, prepared: Mutex::default() })
    }

    /// The calibration's files.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// SHA-256 of the calibration's files.
    pub(crate) fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The rectifier of raw images of this size.
    ///
    /// # Errors
    /// [`Error::File`] if the calibration does not describe cameras of such images before rectification.
    pub fn rectifier(&self, raw: Size) -> Result<Arc<Rectifier>, Error> {
        let mut prepared = self.prepared.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, rectifier)) = prepared.as_ref().filter(|(size, _)| *size == raw) {
            return Ok(Arc::clone(rectifier));
        }
        // The old one goes first, so that both are never in memory.
        *prepared = None;
        let rectifier = Arc::new(self.cameras.rectifier(raw)?);
        *prepared = Some((raw, Arc::clone(&rectifier)));
        Ok(rectifier)
    }

    /// The rectified pair.
    ///
    /// # Errors
    /// Those of [`Self::rectifier`], and [`Error::OutOfMemory`].
    pub fn rectified(&self, pair: &StereoPair) -> Result<StereoPair, Error> {
        Ok(self.rectifier(pair.size())?.rectified(pair.left(), pair.right())?)
    }

    /// The geometry of the rectified pairs, if they have this size. Known once a pair was rectified.
    pub(crate) fn calibration(&self, rectified: Size) -> Option<Calibration> {
        let prepared = self.prepared.lock().unwrap_or_else(PoisonError::into_inner);
        let (_, rectifier) = prepared.as_ref()?;
        (rectifier.rectification().size == rectified).then(|| *rectifier.calibration())
    }
}
