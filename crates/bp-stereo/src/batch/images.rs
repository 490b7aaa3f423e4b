//! Reads the images of the pairs of a batch.

use std::path::Path;

use bp_io::{Contents, parse_image, parse_samples};

use super::record::FileState;
use crate::{Error, ReadPair, Rectifying, pairs::Pair, reading::Room};

/// The images of a pair, and the states of the files that they were decoded from: none if a file cannot be read.
pub(super) struct Images {
    pub(super) pair: Result<ReadPair, Error>,
    pub(super) states: Vec<FileState>,
}

/// Files of images that failed are compared with those of an earlier run up to this length.
const MOST_BYTES: u64 = 1 << 30;

impl Images {
    /// Reads the files once: what is hashed is what is decoded, even if somebody replaces a file meanwhile.
    pub(super) fn read(pair: &Pair, room: Room, rectifying: Option<&Rectifying>, stretch: bool) -> Self {
        let paths = [pair.left.as_path(), pair.right.as_path()];
        let mut states = Vec::new();
        let mut contents = |room: Room, path: &Path| {
            let contents = room.explained(Contents::of_pixels(path, room.limits))?;
            states.push(FileState::read(path, &contents)?);
            Ok::<_, Error>(contents.bytes)
        };
        let pair = if stretch {
            room.stretched_pair(paths, None, |room, path| {
                let bytes = contents(room, path)?;
                room.explained(parse_samples(path, &bytes, room.limits))
            })
        } else {
            let read = |room: Room, path: &Path| {
                let bytes = contents(room, path)?;
                room.explained(parse_image(path, &bytes, room.limits))
            };
            room.pair(paths, rectifying, read).map(Into::into)
        };
        if states.len() < paths.len() {
            // The pair failed. Its files are only read again if that ends.
            let is_image =
                |path: &&Path| path.metadata().is_ok_and(|about| about.is_file() && about.len() <= MOST_BYTES);
            let known = paths.iter().all(is_image).then(|| paths.into_iter().map(FileState::of).collect());
            states = known.and_then(Result::ok).unwrap_or_default();
        }
        Self { pair, states }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::{fs, process::Command, thread, time::Duration};

    use bp_io::hex;
    use sha2::{Digest, Sha256};

    use super::*;

    /// A pipe gives other bytes to everybody who opens it.
    #[test]
    fn what_is_hashed_is_what_is_decoded() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let image = |value: u8| [&b"P5 2 1 255\n"[..], &[value; 2]].concat();
        for name in ["left.pgm", "right.pgm"] {
            assert!(Command::new("mkfifo").arg(path(name)).status().unwrap().success());
            let pipe = path(name);
            thread::spawn(move || {
                for value in 1..4 {
                    fs::write(&pipe, image(value)).unwrap();
                    // Otherwise the next image would follow the first one to the same reader.
                    thread::sleep(Duration::from_millis(300));
                }
            });
        }
        let pair = Pair { name: "name".into(), left: path("left.pgm"), right: path("right.pgm") };
        let Images { pair, states } = Images::read(&pair, Room::new(1, None), None, false);
        assert_eq!(pair.unwrap().pair.left().greys(), [1; 2]);
        let expected = hex(&Sha256::digest(image(1)));
        assert!(states.len() == 2 && states.iter().all(|state| state.sha256 == expected));
    }
}
