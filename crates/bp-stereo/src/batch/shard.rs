//! The part of the pairs that one process matches.

use std::{
    fmt,
    fs::{File, TryLockError},
    path::{Path, PathBuf},
    str::FromStr,
};

use crate::Error;
use bp_io::{Files, create_folder};

/// One of several processes that share the pairs. By default it is the only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// The index of the process, from 0.
    index: usize,
    /// The number of processes.
    count: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

impl Shard {
    /// Whether this shard has the chain of pairs with this index. Every chain belongs to exactly one shard.
    pub(super) fn has(self, pair: usize) -> bool {
        pair % self.count == self.index
    }

    /// The part of a file name that identifies the shard.
    pub(super) fn file_part(self) -> String {
        format!("{}-of-{}", self.index + 1, self.count)
    }

    /// Locks the shard. Fails if another process matches it, because each would remove the other's temporary files as
    /// leftovers. The system releases the lock when the process ends, however it ends.
    pub(super) fn lock(self, folder: &Path, files: &Files) -> Result<File, Error> {
        let path = folder.join(format!("{}.lock", self.file_part()));
        files.check_own(&path)?;
        create_folder(folder)?;
        if path.is_dir() {
            // It could be opened, but not everywhere locked.
            return Err(bp_io::Error::writing(&path, &"it is a folder, and a lock is a file; remove it").into());
        }
        let file = File::options().create(true).truncate(false).write(true).open(&path);
        // The lock file of another user, in a shared folder, can be locked without write permission.
        let file = file.or_else(|error| File::open(&path).map_err(|_| bp_io::Error::writing(&path, &error)))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let advice = "wait for it, choose another `output`, or share the pairs by `shard`";
                Err(Error::System(format!("{}: another process matches these pairs; {advice}", path.display())))
            }
            // Some file systems do not support locks.
            Err(TryLockError::Error(_)) | Ok(()) => Ok(file),
        }
    }

    /// The path of the summary of its pairs.
    #[must_use]
    pub fn summary_path(self, output: &Path) -> PathBuf {
        output.join(if self.is_all() {
            "summary.json".to_owned()
        } else {
            format!("summary-{}.json", self.file_part())
        })
    }

    /// Whether it is the only shard.
    pub(super) fn is_all(self) -> bool {
        self.count == 1
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}/{}", self.index + 1, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').map(|(index, count)| (index.parse(), count.parse()));
        match numbers {
            Some((Ok(index @ 1..), Ok(count))) if index <= count => Ok(Self { index: index - 1, count }),
            _ => Err("must be I/N, I from 1 to N, such as 1/4".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_have_every_pair_once() {
        for count in 1..5 {
            let shards: Vec<Shard> = (1..=count).map(|index| format!("{index}/{count}").parse().unwrap()).collect();
            for pair in 0..11 {
                assert_eq!(shards.iter().filter(|shard| shard.has(pair)).count(), 1);
            }
        }
        for wrong in ["", "1", "0/3", "4/3", "a/3", "1/", "-1/3", "1/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
