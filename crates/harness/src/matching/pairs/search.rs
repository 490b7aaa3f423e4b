//! Pairs that lie below a folder in a known layout.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use walkdir::WalkDir;

use super::{Found, Pair, natural};
use crate::failure::Failure;

/// What the two images of a folder are called, the surest sign of a pair first: a folder of nine views has im0 and im1
/// too, but its pair is im2 and im6.
const IN_ONE_FOLDER: [[&str; 2]; 5] =
    [["view1", "view5"], ["im2", "im6"], ["im0", "im1"], ["left", "right"], ["imL", "imR"]];

/// Folders beside one another that hold images of equal names.
const IN_TWO_FOLDERS: [[&str; 2]; 3] = [["left", "right"], ["image_2", "image_3"], ["image_0", "image_1"]];

/// Endings of images, in the order in which one of several is taken.
const ENDINGS: [&str; 8] = ["png", "ppm", "pgm", "pnm", "tif", "tiff", "jpg", "jpeg"];

/// Images by their folders, both relative to where the search began.
type Folders = BTreeMap<PathBuf, BTreeSet<String>>;

/// The pairs below `root`, but not in `output`, in the natural order of their names.
pub(super) fn search(root: &Path, output: &Path) -> Result<Found, Failure> {
    let mut found = Found::default();
    let folders = images(root, output, &mut found.notes);
    for (folder, images) in &folders {
        in_one_folder(folder, images, &mut found);
        in_two_folders(folder, &folders, &mut found);
    }
    let text = |pair: &Pair| pair.name.to_string_lossy().into_owned();
    found.pairs.sort_by(|a, b| natural::compare(&text(a), &text(b)));
    let below = |pair: &mut Pair| (pair.left, pair.right) = (root.join(&pair.left), root.join(&pair.right));
    found.pairs.iter_mut().for_each(below);
    Ok(found)
}

/// All images below a folder; what cannot be read is told.
fn images(root: &Path, output: &Path, notes: &mut Vec<String>) -> Folders {
    let output = output.canonicalize().ok();
    let is_output = |path: &Path| output.is_some() && path.canonicalize().ok() == output;
    let mut folders = Folders::new();
    let entries = WalkDir::new(root).min_depth(1).follow_links(true).sort_by_file_name().into_iter();
    for entry in entries.filter_entry(|entry| !(entry.file_type().is_dir() && is_output(entry.path()))) {
        let entry = match entry {
            Ok(entry) => entry,
            Err(error) => {
                notes.push(format!("passed over: {error}"));
                continue;
            }
        };
        let below = entry.path().strip_prefix(root).unwrap_or(entry.path());
        if let (true, Some(folder), Some(name)) = (entry.file_type().is_file(), below.parent(), below.file_name()) {
            let name = name.to_string_lossy().into_owned();
            if ending(&name).is_some() {
                folders.entry(folder.to_owned()).or_default().insert(name);
            }
        }
    }
    folders
}

fn ending(name: &str) -> Option<&str> {
    let (_, ending) = name.rsplit_once('.')?;
    ENDINGS.contains(&ending).then_some(ending)
}

/// The one pair of a folder whose images are called as in a known data set.
fn in_one_folder(folder: &Path, images: &BTreeSet<String>, found: &mut Found) {
    let all =
        IN_ONE_FOLDER.iter().flat_map(|layout| ENDINGS.map(|ending| layout.map(|name| format!("{name}.{ending}"))));
    let (present, absent): (Vec<_>, Vec<_>) =
        all.partition(|[left, right]| images.contains(left) && images.contains(right));
    let path = |name: &str| folder.join(name);
    let Some((taken @ [left, right], others)) = present.split_first() else {
        for [left, right] in absent {
            for (here, missing) in [(&left, &right), (&right, &left)] {
                if images.contains(here) {
                    found.notes.push(format!("passed over: {} has no {missing} beside it", path(here).display()));
                }
            }
        }
        return;
    };
    for other in others {
        let [taken, other] = [taken, other].map(|names| names.join(" and "));
        found.notes.push(format!("{}: {taken} are taken as its pair, not {other}", path("").display()));
    }
    found.pairs.push(Pair { name: path(left).with_extension(""), left: path(left), right: path(right) });
}

/// The pairs of a folder and the one beside it, where they are called as in a known data set.
fn in_two_folders(folder: &Path, folders: &Folders, found: &mut Found) {
    for layout in IN_TWO_FOLDERS {
        let Some(side) = layout.iter().position(|&name| folder.file_name().is_some_and(|own| own == name)) else {
            continue;
        };
        let other = layout[1 - side];
        let Some(partners) = folders.get(&folder.with_file_name(other)) else {
            found.notes.push(format!("passed over: {} has no folder {other} with images beside it", folder.display()));
            continue;
        };
        let lonely = folders[folder].difference(partners).map(|image| folder.join(image));
        found.notes.extend(
            lonely.map(|image| format!("passed over: {} has no image of its name in {other}", image.display())),
        );
        if side == 0 {
            pairs_of_equal_names(folder, &folder.with_file_name(other), folders[folder].intersection(partners), found);
        }
    }
}

fn pairs_of_equal_names<'a>(folder: &Path, other: &Path, names: impl Iterator<Item = &'a String>, found: &mut Found) {
    let mut taken = BTreeMap::new();
    for image in names {
        let name = folder.join(image).with_extension("");
        if let Some(first) = taken.insert(name.clone(), image) {
            let (first, image) = (folder.join(first), folder.join(image));
            found.notes.push(format!("passed over: {} beside {}", image.display(), first.display()));
            continue;
        }
        found.pairs.push(Pair { name, left: folder.join(image), right: other.join(image) });
    }
}
