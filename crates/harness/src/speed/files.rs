//! The files of a run: speed.json, and the page and charts that are made from it.

use std::path::{Path, PathBuf};

use bp_charts::png;

use super::{
    charts::{self, charts},
    tables::page,
};
use crate::{
    failure::Failure,
    files::{below, check_new, create_folder, json_text, write_new},
    record::{RECORD_FILE, SPEED_FILE, load_speed, speed::Speed},
};

/// The files of a run, in a folder that does not hold any of them yet.
#[derive(Debug)]
pub struct Files {
    folder: PathBuf,
}

impl Files {
    /// Fails if the folder holds one of the files already: no record is overwritten.
    pub fn new(folder: &Path) -> Result<Self, Failure> {
        let files = Self { folder: folder.to_owned() };
        let charts = charts::names().flat_map(|name| ["svg", "png"].map(|ending| format!("{name}.{ending}")));
        let names = ["speed.md", SPEED_FILE].map(str::to_owned).into_iter().chain(charts);
        names.map(|name| files.folder.join(name)).try_for_each(|path| check_new(&path))?;
        Ok(files)
    }

    /// Creates the folder, and fails if it is not writable. Called before the measurement starts.
    pub fn check(&self) -> Result<(), Failure> {
        create_folder(&self.folder)?;
        Ok(below(&self.folder).check_writable(&self.folder.join(SPEED_FILE))?)
    }

    /// Writes everything. Returns a sentence that names the files.
    pub fn write(&self, speed: &Speed) -> Result<String, Failure> {
        let record = self.folder.join(SPEED_FILE);
        write_new(&record, json_text(&record, speed)?)?;
        let page = write_page(&self.folder, speed)?;
        Ok(format!("written: {} and {}", page.display(), record.display()))
    }
}

/// Whether a path is a speed.json, or a folder that holds one but no record of `bp reproduce`.
pub fn is_record(path: &Path) -> bool {
    path.ends_with(SPEED_FILE) || (path.join(SPEED_FILE).exists() && !path.join(RECORD_FILE).exists())
}

/// Writes the page and the charts again from a speed.json, or from the one in a folder. Returns the page's path.
pub fn renew(path: &Path) -> Result<PathBuf, Failure> {
    let folder = if path.ends_with(SPEED_FILE) { path.parent().unwrap_or(path) } else { path };
    write_page(folder, &load_speed(path)?)
}

fn write_page(folder: &Path, speed: &Speed) -> Result<PathBuf, Failure> {
    let files = below(folder);
    for chart in charts(speed) {
        let path = |ending: &str| folder.join(format!("{}.{ending}", chart.name));
        let svg = chart.plot.svg().map_err(|error| Failure::writing(&path("svg"), &error))?;
        let picture = png(&svg).map_err(|error| Failure::writing(&path("png"), &error))?;
        files.whole(&path("png"), |file| file.write_all(&picture))?;
        files.text(&path("svg"), &svg)?;
    }
    let path = folder.join("speed.md");
    files.text(&path, &page(speed))?;
    Ok(path)
}
