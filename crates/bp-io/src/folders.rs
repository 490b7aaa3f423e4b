//! Folders that survive a loss of power, and the names in them.

use std::{fs, io, path::Path};

use crate::Error;

/// Creates a folder and its missing parents, which survive a loss of power.
///
/// # Errors
/// [`Error::Write`].
pub fn create_folder(path: &Path) -> Result<(), Error> {
    let failed = |error| Error::writing(path, &error);
    if is_folder(path).map_err(failed)? {
        return Ok(());
    }
    if path.exists() {
        return Err(Error::writing(path, &"a file is there, and a folder is needed"));
    }
    // A name that is too long fails for each of its parents, of which there may be very many.
    let is_missing = |folder: &&Path| matches!(folder.try_exists(), Ok(false)) && !folder.as_os_str().is_empty();
    let missing: Vec<&Path> = path.ancestors().take_while(is_missing).collect();
    fs::create_dir_all(path).map_err(failed)?;
    missing.into_iter().try_for_each(sync_folder_of)
}

/// Whether there is a folder. Fails if the system cannot tell; what it does not find, or may not show, is none.
///
/// # Errors
/// The system's.
pub fn is_folder(path: &Path) -> io::Result<bool> {
    match path.metadata() {
        Err(error) if is_trouble(&error) => Err(error),
        about => Ok(about.is_ok_and(|about| about.is_dir())),
    }
}

/// Makes the names in the folder of `path` survive a loss of power, as far as the system can.
pub(crate) fn sync_folder_of(path: &Path) -> Result<(), Error> {
    // Not every system opens folders, not every file system syncs them, and some may be written but not read.
    match fs::File::open(folder_of(path)).and_then(|folder| folder.sync_all()) {
        Err(error) if is_trouble(&error) => Err(Error::writing(path, &error)),
        _ => Ok(()),
    }
}

/// Whether a disk is broken or files cannot be opened any more, by the numbers that Unix has for it.
fn is_trouble(error: &io::Error) -> bool {
    const IO: i32 = 5;
    const FILES_OF_SYSTEM: i32 = 23;
    const FILES_OF_PROGRAM: i32 = 24;
    matches!(error.raw_os_error(), Some(IO | FILES_OF_SYSTEM | FILES_OF_PROGRAM))
}

/// The folder that holds `path`.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
