//! Folders that survive a loss of power, and the names in them.

use std::{fs, path::Path};

use crate::Error;

/// Creates a folder and its missing parents, which survive a loss of power.
///
/// # Errors
/// [`Error::Write`].
pub fn create_folder(path: &Path) -> Result<(), Error> {
    if path.exists() && !path.is_dir() {
        return Err(Error::writing(path, &"a file is there, and a folder is needed"));
    }
    // A name that is too long fails for each of its parents, of which there may be very many.
    let is_missing = |folder: &&Path| matches!(folder.try_exists(), Ok(false)) && !folder.as_os_str().is_empty();
    let missing: Vec<&Path> = path.ancestors().take_while(is_missing).collect();
    fs::create_dir_all(path).map_err(|error| Error::writing(path, &error))?;
    missing.into_iter().try_for_each(sync_folder_of)
}

/// Makes the names in the folder of `path` survive a loss of power, as far as the system can.
pub(crate) fn sync_folder_of(path: &Path) -> Result<(), Error> {
    // Not every system opens folders, and not every file system syncs them.
    let Ok(folder) = fs::File::open(folder_of(path)) else { return Ok(()) };
    match folder.sync_all() {
        Err(error) if matches!(error.raw_os_error(), Some(IO_ERROR)) => Err(Error::writing(path, &error)),
        _ => Ok(()),
    }
}

/// The number that Unix gives a broken disk (EIO).
const IO_ERROR: i32 = 5;

/// The folder that holds `path`.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
