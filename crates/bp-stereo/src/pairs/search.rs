//! Finds the pairs below a folder with a known layout.

use std::{
    collections::{BTreeMap, BTreeSet},
    ffi::OsStr,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use walkdir::{DirEntry, WalkDir};

use super::{Found, Pair, natural};
use crate::{Error, Watch};

/// The names of the two images of a folder, the most reliable first: a folder of nine views has im0 and im1 too, but
/// its pair is im2 and im6.
const IN_ONE_FOLDER: [[&str; 2]; 5] =
    [["view1", "view5"], ["im2", "im6"], ["im0", "im1"], ["left", "right"], ["imL", "imR"]];

/// The names of sibling folders that hold images of equal names.
const IN_TWO_FOLDERS: [[&str; 2]; 3] = [["left", "right"], ["image_2", "image_3"], ["image_0", "image_1"]];

/// Extensions of images, the preferred ones first. A `.pfm` in such folders is a disparity map.
const ENDINGS: [&str; 8] = ["png", "ppm", "pgm", "pnm", "tif", "tiff", "jpg", "jpeg"];

/// Images by folder. Folders are relative to the root of the search.
type Folders = BTreeMap<PathBuf, Images>;

/// File names.
type Images = BTreeSet<String>;

/// The image with this name, or else one whose name differs only in case: cameras write VIEW1.PNG.
fn named<'a>(images: &'a Images, name: &str) -> Option<&'a String> {
    images.get(name).or_else(|| images.iter().find(|image| image.eq_ignore_ascii_case(name)))
}

/// The most files and folders that are looked at. A link may lead to a whole system.
const MOST_ENTRIES: usize = 1_000_000;

/// The pairs below `root`, but not in `output`, in the natural order of their names.
pub(super) fn search(root: &Path, output: &Path, watch: &Watch<'_>) -> Result<Found, Error> {
    let mut found = Found::default();
    let folders = images(root, output, MOST_ENTRIES, &mut found, watch)?;
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

/// All images below a folder. Links are followed, but not to a folder above them.
fn images(root: &Path, output: &Path, most: usize, found: &mut Found, watch: &Watch<'_>) -> Result<Folders, Error> {
    let output = output.canonicalize().ok();
    let is_output = |path: &Path| output.is_some() && path.canonicalize().ok() == output;
    let entries = WalkDir::new(root).min_depth(1).follow_links(true).sort_by_file_name().into_iter();
    let mut entries = entries.filter_entry(|entry| !(entry.file_type().is_dir() && is_output(entry.path())));
    let mut folders = Folders::new();
    for _ in 0..=most {
        watch.check()?;
        match entries.next() {
            None => return Ok(folders),
            Some(Err(error)) if is_unread(&error) => found.unread.push(format!("not searched: {error}")),
            Some(Err(error)) => found.notes.push(format!("passed over: {error}")),
            Some(Ok(entry)) => add_image(root, &entry, &mut folders, &mut found.notes),
        }
    }
    let what = format!("more than {most} files and folders; name a smaller folder, or give a list of pairs");
    Err(Error::Input(format!("{}: {what}", root.display())))
}

/// Adds a file to those of its folder, if it is an image.
fn add_image(root: &Path, entry: &DirEntry, folders: &mut Folders, notes: &mut Vec<String>) {
    let below = entry.path().strip_prefix(root).unwrap_or(entry.path());
    if !entry.file_type().is_file() || !below.extension().is_some_and(is_ending) {
        return;
    }
    match (below.parent(), below.file_name().and_then(OsStr::to_str), below.to_str()) {
        (Some(folder), Some(name), Some(_)) => {
            folders.entry(folder.to_owned()).or_default().insert(name.to_owned());
        }
        _ => notes.push(format!("passed over: {} is no name in UTF-8, as records hold it", entry.path().display())),
    }
}

/// Whether something may hold pairs but cannot be read. A link to nothing holds none, and one to a folder above it the same.
fn is_unread(error: &walkdir::Error) -> bool {
    error.io_error().is_some_and(|error| error.kind() != ErrorKind::NotFound)
}

fn is_ending(ending: &OsStr) -> bool {
    ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Finds the pair of a folder whose images are named as in a known data set.
fn in_one_folder(folder: &Path, images: &Images, found: &mut Found) {
    let mut taken: Option<[&String; 2]> = None;
    let mut lonely = Vec::new();
    for (layout, ending) in IN_ONE_FOLDER.iter().flat_map(|layout| ENDINGS.map(|ending| (layout, ending))) {
        let names = layout.map(|name| format!("{name}.{ending}"));
        match (names.each_ref().map(|name| named(images, name)), taken) {
            ([Some(left), Some(right)], None) => taken = Some([left, right]),
            ([Some(left), Some(right)], Some([first, second])) => found.notes.push(format!(
                "{}: {first} and {second} are taken as its pair, not {left} and {right}",
                folder.join("").display()
            )),
            ([Some(here), None], _) => lonely.push((here, names[1].clone())),
            ([None, Some(here)], _) => lonely.push((here, names[0].clone())),
            ([None, None], _) => {}
        }
    }
    match taken.map(|names| names.map(|name| folder.join(name))) {
        Some([left, right]) => found.pairs.push(Pair { name: left.with_extension(""), left, right }),
        None => {
            found.notes.extend(lonely.into_iter().map(|(here, missing)| {
                format!("passed over: {} has no {missing} beside it", folder.join(here).display())
            }))
        }
    }
}

/// Finds the pairs of a folder and its sibling, if they are named as in a known data set.
fn in_two_folders(folder: &Path, folders: &Folders, found: &mut Found) {
    for layout in IN_TWO_FOLDERS {
        let Some(side) = layout.iter().position(|&name| folder.file_name().is_some_and(|own| own == name)) else {
            continue;
        };
        let (images, other) = (&folders[folder], layout[1 - side]);
        let Some(partners) = folders.get(&folder.with_file_name(other)) else {
            found.notes.push(format!("passed over: {} has no folder {other} with images beside it", folder.display()));
            continue;
        };
        let lonely = images.iter().filter(|image| partner(image, images, partners).is_none());
        found.notes.extend(
            lonely.map(|image| {
                format!("passed over: {} has no image of its name in {other}", folder.join(image).display())
            }),
        );
        if side == 0 {
            pairs_of_equal_names((folder, images), (&folder.with_file_name(other), partners), found);
        }
    }
}

/// The partner of an image in the sibling folder. A name that differs in case matches only if `images` does not contain
/// that name itself.
fn partner<'a>(image: &str, images: &Images, partners: &'a Images) -> Option<&'a String> {
    named(partners, image).filter(|partner| *partner == image || !images.contains(*partner))
}

fn pairs_of_equal_names((folder, images): (&Path, &Images), (other, partners): (&Path, &Images), found: &mut Found) {
    let mut taken = BTreeMap::new();
    for image in images {
        let Some(partner) = partner(image, images, partners) else { continue };
        let name = folder.join(image).with_extension("");
        if let Some(first) = taken.insert(name.clone(), image) {
            let (first, image) = (folder.join(first), folder.join(image));
            found.notes.push(format!("passed over: {} beside {}", image.display(), first.display()));
            continue;
        }
        found.pairs.push(Pair { name, left: folder.join(image), right: other.join(partner) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_names_come_before_names_that_differ_by_case() {
        let images = |names: &[&str]| -> Images { names.iter().map(|&name| name.to_owned()).collect() };
        let (left, right) = (images(&["A.png", "a.png", "b.PNG"]), images(&["A.png", "B.png"]));
        let found = ["A.png", "a.png", "b.PNG"].map(|name| partner(name, &left, &right).map(String::as_str));
        assert_eq!(found, [Some("A.png"), None, Some("B.png")]);
    }

    /// A link to the root of a system leads to millions.
    #[test]
    fn a_folder_with_more_files_than_are_looked_at_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        ["view1.png", "view5.png", "text"]
            .iter()
            .for_each(|name| std::fs::write(folder.path().join(name), "").unwrap());
        let images = |most| {
            images(folder.path(), Path::new("output"), most, &mut Found::default(), &Watch::default())
                .map(|folders| folders.into_values().next().unwrap_or_default().len())
        };
        assert_eq!(images(3), Ok(2));
        let Err(Error::Input(what)) = images(2) else { panic!("it is searched") };
        assert!(what.contains("more than 2 files and folders"), "{what}");
    }
}
