//! Which part of the pairs a process matches.

use std::{
    fmt,
    fs::{File, TryLockError},
    path::{Path, PathBuf},
    str::FromStr,
};

use crate::Error;
use bp_io::create_folder;

/// One of several processes that share the pairs; by default the only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which one, from 0.
    index: usize,
    /// Of how many.
    count: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

impl Shard {
    /// Whether it has the pair of this index. Every pair is one shard's.
    pub(super) fn has(self, pair: usize) -> bool {
        pair % self.count == self.index
    }

    /// How files of its own are told apart.
    pub(super) fn file_part(self) -> String {
        format!("{}-of-{}", self.index + 1, self.count)
    }

    /// Fails where another process matches this shard: each would take the other's temporary files for leftovers. The
    /// system ends the lock with the process, however that ends.
    pub(super) fn lock(self, folder: &Path) -> Result<File, Error> {
        create_folder(folder)?;
        let path = folder.join(format!("{}.lock", self.file_part()));
        let file = File::options().create(true).truncate(false).write(true).open(&path);
        // Somebody else's lock file, in a folder that is shared, can be locked without writing to it.
        let file = file.or_else(|error| File::open(&path).map_err(|_| bp_io::Error::writing(&path, &error)))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let advice = "wait for it, choose another `output`, or share the pairs by `shard`";
                Err(Error::System(format!("{}: another process matches these pairs; {advice}", path.display())))
            }
            // Some file systems have no locks.
            Err(TryLockError::Error(_)) | Ok(()) => Ok(file),
        }
    }

    /// Where the summary of its pairs is written.
    #[must_use]
    pub fn summary_path(self, output: &Path) -> PathBuf {
        output.join(if self.is_all() {
            "summary.json".to_owned()
        } else {
            format!("summary-{}.json", self.file_part())
        })
    }

    /// Whether there is no other.
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
