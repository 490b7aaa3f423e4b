//! The documentation: its links work, and its index reaches every page.
#![expect(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::{
    collections::BTreeSet,
    fs,
    path::{Component, Path, PathBuf},
};

const INDEX: &str = "docs/README.md";
const PAGES_ELSEWHERE: [&str; 3] = ["README.md", "fuzz/README.md", "CITATION.cff"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(page: &Path) -> String {
    fs::read_to_string(root().join(page)).unwrap()
}

/// All pages, by their paths from the root.
fn pages() -> BTreeSet<PathBuf> {
    let pages =
        files(Path::new("docs")).into_iter().filter(|path| path.extension().is_some_and(|ending| ending == "md"));
    pages.chain(PAGES_ELSEWHERE.map(PathBuf::from)).collect()
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap());
    let below = entries.map(|entry| {
        let path = folder.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() { files(&path) } else { vec![path] }
    });
    below.flatten().collect()
}

/// The text without code blocks and `code`, in which brackets are not links and `#` does not begin a heading.
fn prose(text: &str) -> String {
    let mut fenced = false;
    let lines = text.lines().filter(|line| {
        let fence = line.starts_with("```");
        fenced ^= fence;
        !fenced && !fence && !line.starts_with("    ")
    });
    lines.collect::<Vec<_>>().join("\n").split('`').step_by(2).collect()
}

/// A link within the project.
#[derive(Debug)]
struct Link {
    /// The path from the root.
    file: PathBuf,
    anchor: Option<String>,
}

fn links(page: &Path) -> Vec<Link> {
    let text = prose(&read(page));
    let targets = text.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0));
    targets.filter(|target| !target.contains("://")).map(|target| link(page, target)).collect()
}

fn link(page: &Path, target: &str) -> Link {
    let (file, anchor) =
        target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor.to_owned())));
    let file = if file.is_empty() { page.to_owned() } else { folded(&page.with_file_name(file)) };
    Link { file, anchor }
}

/// The path without `..`.
fn folded(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut folded, component| {
        match component {
            Component::ParentDir => assert!(folded.pop(), "{} leads out of the project", path.display()),
            _ => folded.push(component),
        }
        folded
    })
}

/// The anchors of a page's headings, as GitHub forms them.
fn anchors(page: &Path) -> Vec<String> {
    let slug = |heading: &str| -> String {
        let kept = heading.to_lowercase().replace(' ', "-");
        kept.chars().filter(|c| c.is_alphanumeric() || "-_".contains(*c)).collect()
    };
    // Code in a heading is part of its anchor.
    let text = read(page).replace('`', "");
    prose(&text).lines().filter(|line| line.starts_with('#')).map(|line| slug(line.trim_matches(['#', ' ']))).collect()
}

#[test]
fn every_link_leads_to_a_file_and_every_anchor_to_a_heading() {
    for page in pages() {
        for Link { file, anchor } in links(&page) {
            let (page, shown) = (page.display(), file.display());
            assert!(root().join(&file).exists(), "{page} links to {shown}, which is not there");
            let Some(anchor) = anchor else { continue };
            assert!(
                anchors(&file).contains(&anchor),
                "{page} links to {shown}#{anchor}; headings: {:?}",
                anchors(&file)
            );
        }
    }
}

#[test]
fn every_page_can_be_reached_from_the_index() {
    let pages = pages();
    let (mut reached, mut to_visit) = (BTreeSet::new(), vec![PathBuf::from(INDEX)]);
    while let Some(page) = to_visit.pop() {
        if pages.contains(&page) && reached.insert(page.clone()) {
            to_visit.extend(links(&page).into_iter().map(|link| link.file));
        }
    }
    assert_eq!(pages.difference(&reached).collect::<Vec<_>>(), Vec::<&PathBuf>::new());
}

#[test]
fn every_script_that_a_page_names_is_there() {
    for page in pages() {
        for (start, _) in read(&page).match_indices("scripts/") {
            let text = &read(&page)[start..];
            let name = text.split(|c: char| !c.is_alphanumeric() && !"/-_.".contains(c)).next().unwrap();
            let script = name.trim_end_matches('.');
            assert!(root().join(script).exists(), "{} names {script}, which is not there", page.display());
        }
    }
}

#[test]
fn the_first_page_is_short() {
    let lines = read(Path::new("README.md")).lines().count();
    assert!(lines < 150, "README.md has {lines} lines: move something to docs/");
}
