//! Reading and writing files: whole or not at all.

mod calibration;
mod colours;
mod format;
mod images;
mod maps;
mod npy;
mod pfm;
mod picture;
mod ply;
mod sidecar;
mod tiff;

use std::{
    fs,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
    sync::OnceLock,
};

pub(crate) use calibration::Geometry;
pub(crate) use colours::Colours;
pub(crate) use format::{MapFormat, Quantity, Raster, check_ending, check_range};
#[cfg(feature = "fuzzing")]
pub(crate) use images::image_of;
pub(crate) use images::{PixelLimit, hex, pixels_sha256, read_image, read_stored_grey};
#[cfg(feature = "fuzzing")]
pub(crate) use maps::{map_of, mask_of};
pub(crate) use maps::{read_map, read_mask};
pub(crate) use picture::{Picture, encode_picture};
pub(crate) use ply::write_points;
pub(crate) use sidecar::{Origin, remove_sidecar, sidecar_of, write_picture_sidecar, write_sidecar};

use serde::Serialize;

use crate::failure::Failure;

/// What the names of temporary files begin with.
static TEMPORARY: OnceLock<String> = OnceLock::new();

/// Makes the names of this process's temporary files begin so; for finding them when it was killed.
pub(crate) fn name_temporary(prefix: &str) {
    TEMPORARY.get_or_init(|| prefix.to_owned());
}

/// Writes a file beside its final place and renames it, so that nobody ever sees half of it; `write` fills it.
pub(crate) fn write_whole<E: std::fmt::Display>(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), Failure> {
    // What a link points to is replaced, not the link.
    let path = &path.canonicalize().unwrap_or_else(|_| path.to_owned());
    filled_beside(path, write)?.persist(path).map_err(|e| Failure::writing(path, &e.error))?;
    Ok(())
}

/// A file in the folder of `path`, filled by `write` and safe on the disk, which vanishes unless it is kept.
fn filled_beside<E: std::fmt::Display>(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<tempfile::NamedTempFile, Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::writing(path, error);
    let mut file = temporary_beside(path)?;
    let mut buffered = BufWriter::new(file.as_file_mut());
    write(&mut buffered).map_err(|e| failed(&e))?;
    buffered.flush().map_err(|e| failed(&e))?;
    drop(buffered);
    file.as_file().sync_all().map_err(|e| failed(&e))?;
    Ok(file)
}

/// Fails where no file could be written at `path`; for telling so before the work is done.
pub(crate) fn check_writable(path: &Path) -> Result<(), Failure> {
    if path.is_dir() {
        return Err(Failure::writing(path, &"it is a folder"));
    }
    if path.exists() && !path.is_file() {
        return Err(Failure::writing(path, &"it is there and is no file"));
    }
    temporary_beside(path).map(drop)
}

/// An empty file in the folder of `path`, which vanishes unless it is kept.
fn temporary_beside(path: &Path) -> Result<tempfile::NamedTempFile, Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(Failure::writing(path, &format!("there is no folder {}", folder.display())));
    }
    let mut builder = tempfile::Builder::new();
    // Temporary files are made for their owner alone; a result is for whom the user's mask says.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder
        .prefix(TEMPORARY.get().map_or(".bp-", |prefix| prefix))
        .tempfile_in(folder)
        // Its own words name the temporary file.
        .map_err(|error| Failure::writing(path, &error.kind()))
}

/// Fails where writing `output` would overwrite `other`; `what` says so in words.
pub(crate) fn check_distinct(other: &Path, output: &Path, what: &str) -> Result<(), Failure> {
    if resolved(other) != resolved(output) {
        return Ok(());
    }
    Err(Failure::usage(format!("{} {what}; give another output", output.display())))
}

/// The path of a file without links and steps up, as far as there is one; by it, two names of a file are known as such.
pub(crate) fn resolved(path: &Path) -> PathBuf {
    path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or(path.to_owned())
}

/// Writes text as [`write_whole`] does.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    write_whole(path, |file| file.write_all(text.as_bytes()))
}

/// Writes a value as JSON that people can read, as [`write_whole`] does.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Failure> {
    write_text(path, &json_text(path, value)?)
}

/// The text of such a file.
pub(crate) fn json_text(path: &Path, value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Failure::writing(path, &error))?;
    Ok(text + "\n")
}

/// Writes a new file, whole or not at all; one that is there already stays as it is.
pub(crate) fn write_new(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Failure> {
    let file = filled_beside(path, |file| file.write_all(contents.as_ref()))?;
    file.persist_noclobber(path).map_err(|error| Failure::writing(path, &error.error))?;
    Ok(())
}

/// Fails where there is a file at `path`, which [`write_new`] would refuse in the end.
pub(crate) fn check_new(path: &Path) -> Result<(), Failure> {
    match path.symlink_metadata() {
        Ok(_) => Err(Failure::writing(path, &"it is there, and no record is overwritten; name another folder")),
        Err(_) => Ok(()),
    }
}

/// Creates a folder and those above it.
pub(crate) fn create_folder(path: &Path) -> Result<(), Failure> {
    if path.exists() && !path.is_dir() {
        return Err(Failure::writing(path, &"a file is there, where a folder is needed"));
    }
    fs::create_dir_all(path).map_err(|error| Failure::writing(path, &error))
}
