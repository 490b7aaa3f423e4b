//! Keeps compiled pipelines between runs in the user's cache folder.

use std::{fs, io::Write as _, path::PathBuf};

use sha2::{Digest, Sha256};

/// The length of a SHA-256 sum.
const SUM_BYTES: usize = 32;

/// The largest file to read. Ours are never larger, and reading another file would only cost time and memory.
const MOST_BYTES: u64 = 64 << 20;

/// The folder, if the system has a cache folder. Without it, the first start after a reboot is slow on drivers that
/// have no cache of their own.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    Some(dirs::cache_dir()?.join("belief-propagation-stereo"))
}

/// Loads the data stored under this key, if it is intact. Broken data could crash the driver.
#[must_use]
pub fn load(key: &str) -> Option<Vec<u8>> {
    let path = folder()?.join(key);
    let is_ours = |file: &fs::Metadata| file.is_file() && file.len() <= MOST_BYTES;
    fs::metadata(&path).ok().filter(is_ours)?;
    let stored = fs::read(path).ok()?;
    let (sum, data) = stored.split_at_checked(SUM_BYTES)?;
    (Sha256::digest(data).as_slice() == sum).then(|| data.to_vec())
}

/// Stores `data` under this key, completely or not at all. Ignores failures, because nothing depends on the cache.
pub fn store(key: &str, data: &[u8]) {
    let Some(folder) = folder() else { return };
    let write = || -> std::io::Result<()> {
        fs::create_dir_all(&folder)?;
        let mut file = tempfile::NamedTempFile::new_in(&folder)?;
        file.write_all(&Sha256::digest(data))?;
        file.write_all(data)?;
        file.persist(folder.join(key))?;
        Ok(())
    };
    _ = write();
}
