//! Finds the frames of a video from two patterns with one placeholder each.

use std::{
    collections::BTreeMap,
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use super::{Found, Pair, natural};
use crate::Error;

/// Pairs of frames with the same text at the placeholder of both patterns, in natural order. The text names the pair.
/// Frames without a partner and gaps in the numbers become notes.
pub(super) fn frames(left: &str, right: &str) -> Result<Found, Error> {
    let (lefts, mut rights) = (Pattern::parse(left)?.files()?, Pattern::parse(right)?.files()?);
    let mut found = Found::default();
    for (frame, left) in lefts {
        match rights.remove(&frame) {
            Some(right) => found.pairs.push(Pair { name: frame.into(), left, right }),
            None => found.notes.push(format!("passed over: {} has no right frame {frame}", left.display())),
        }
    }
    let lonely =
        |(frame, path): (&String, &PathBuf)| format!("passed over: {} has no left frame {frame}", path.display());
    found.notes.extend(rights.iter().map(lonely));
    found.pairs.sort_by(|a, b| natural::compare(&a.name.to_string_lossy(), &b.name.to_string_lossy()));
    found.notes.extend(gaps(&found.pairs));
    Ok(found)
}

/// Notes on gaps in the frame numbers.
fn gaps(frames: &[Pair]) -> Vec<String> {
    let number = |pair: &Pair| pair.name.to_string_lossy().parse::<u64>().ok();
    let numbers: Option<Vec<u64>> = frames.iter().map(number).collect();
    let gap = |pair: &[u64]| match pair[1].saturating_sub(pair[0]) {
        0 | 1 => None,
        2 => Some(format!("frame {} is missing", pair[0] + 1)),
        _ => Some(format!("frames {} to {} are missing", pair[0] + 1, pair[1] - 1)),
    };
    numbers.unwrap_or_default().windows(2).filter_map(gap).collect()
}

/// A path with one placeholder.
struct Pattern<'a> {
    text: &'a str,
    /// The folder of the name with the placeholder.
    folder: &'a Path,
    /// The parts of that name before and after the placeholder.
    before: &'a str,
    after: &'a str,
    /// The path below that name; empty if the name is that of the image.
    below: &'a str,
    /// Whether the placeholder matches digits only.
    is_number: bool,
}

impl<'a> Pattern<'a> {
    fn parse(text: &'a str) -> Result<Self, Error> {
        let wrong = || Error::Options(format!("`video` {text}: one %d, %04d or * must stand where frames differ"));
        let places: Vec<_> = text.match_indices(['%', '*']).collect();
        let [(start, mark)] = places[..] else { return Err(wrong()) };
        let is_number = mark == "%";
        let width = text[start + 1..].find(|c: char| !c.is_ascii_digit()).unwrap_or(0);
        let end = if is_number { start + 1 + width } else { start };
        if is_number && !text[end..].starts_with('d') {
            return Err(wrong());
        }
        let (before, after) = (&text[..start], &text[end + 1..]);
        let (folder, before) = before.rfind('/').map_or(("", before), |slash| before.split_at(slash + 1));
        let (after, below) = after.split_once('/').unwrap_or((after, ""));
        let folder = Path::new(if folder.is_empty() { "." } else { folder });
        Ok(Self { text, folder, before, after, below, is_number })
    }

    /// The files that match, by their text at the placeholder.
    fn files(&self) -> Result<BTreeMap<String, PathBuf>, Error> {
        let failed = |error| Error::Input(format!("`video` {}: {}: {error}", self.text, self.folder.display()));
        let mut files = BTreeMap::new();
        for entry in fs::read_dir(self.folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let name = entry.file_name();
            let Some(frame) = name.to_str().and_then(|name| self.frame(name)) else { continue };
            let path = if self.below.is_empty() { entry.path() } else { entry.path().join(self.below) };
            let is_file = match path.metadata() {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(failed(error)),
                about => about.is_ok_and(|about| about.is_file()),
            };
            if is_file {
                files.insert(frame.to_owned(), path.strip_prefix("./").unwrap_or(&path).to_owned());
            }
        }
        Ok(files)
    }

    /// The text of a name at the placeholder, if the name matches.
    fn frame<'b>(&self, name: &'b str) -> Option<&'b str> {
        let frame = name.strip_prefix(self.before)?.strip_suffix(self.after)?;
        let hidden = self.before.is_empty() && frame.starts_with('.');
        let fits = !self.is_number || frame.bytes().all(|byte| byte.is_ascii_digit());
        (fits && !frame.trim_matches('.').is_empty() && !hidden).then_some(frame)
    }
}
