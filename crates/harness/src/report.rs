//! Tables, charts and pages. They are made from a record and the maps in its folder.

mod diagrams;
mod figures;
pub mod format;
mod grid;
mod html;
mod legend;
mod markdown;
mod opening;
mod readme;
mod results;
mod tables;
mod thesis;
mod tradeoffs;

use std::path::{Path, PathBuf};

use bp_charts::png;
use bp_io::read_text;

pub use grid::lines;
pub use opening::headline;
pub use opening::{device_fact, machine_fact, program_fact};

use crate::{
    failure::Failure,
    files::{below, write_text},
    record::{RECORD_FILE, Record, load},
};
use results::Results;

/// Name of the self-contained page, written last.
pub const PAGE_FILE: &str = "report.html";

/// A drawing with its heading, its caption and its numbers.
struct Drawing {
    /// File name without extension, such as "diagram-4.1".
    name: String,
    /// Its heading.
    title: String,
    /// Its description, and the source of its data.
    caption: String,
    /// The picture.
    svg: String,
    /// Its numbers.
    table: Option<tables::Table>,
}

/// Everything a report shows.
struct Report<'a> {
    results: Results<'a>,
    tables: Vec<tables::Table>,
    figures: Vec<Drawing>,
    /// The diagrams of the thesis.
    diagrams: Vec<Drawing>,
    /// Our own diagrams.
    tradeoffs: Vec<Drawing>,
}

impl<'a> Report<'a> {
    fn new(folder: &Path, record: &'a Record) -> Result<Self, Failure> {
        let results = Results::new(record)?;
        let figures = figures::all(folder, &results)?;
        Self::of(results, figures)
    }

    fn of(results: Results<'a>, figures: Vec<Drawing>) -> Result<Self, Failure> {
        Ok(Self {
            tables: tables::all(&results),
            figures,
            diagrams: diagrams::all(&results)?,
            tradeoffs: tradeoffs::all(&results)?,
            results,
        })
    }

    fn charts(&self) -> impl Iterator<Item = &Drawing> {
        self.diagrams.iter().chain(&self.tradeoffs)
    }

    fn drawings(&self) -> impl Iterator<Item = &Drawing> {
        self.figures.iter().chain(self.charts())
    }
}

/// Writes REPORT.md, report.html and the drawings beside a record.
pub fn write(folder: &Path, record: &Record) -> Result<(), Failure> {
    let (report, files) = (Report::new(folder, record)?, below(folder));
    for drawing in report.drawings() {
        files.text(&folder.join(format!("{}.svg", drawing.name)), &drawing.svg)?;
    }
    for chart in report.charts() {
        let picture = png(&chart.svg).map_err(|error| Failure::other(format!("{}: {error}", chart.name)))?;
        files.whole(&folder.join(format!("{}.png", chart.name)), |file| file.write_all(&picture))?;
    }
    files.text(&folder.join("REPORT.md"), &markdown::page(&report))?;
    Ok(files.text(&folder.join(PAGE_FILE), &html::page(&report))?)
}

/// The pages of a record without its maps, and the part for a README.
#[cfg(feature = "fuzzing")]
pub fn pages_without_maps(record: &Record) -> Result<[String; 3], Failure> {
    let report = Report::of(Results::new(record)?, Vec::new())?;
    Ok([markdown::page(&report), html::page(&report), readme::part(Path::new(""), Path::new(""), &report.results)])
}

/// Writes the report of a recorded run of `bp reproduce` again. Returns the path of its page.
///
/// # Errors
/// A message that names the file.
pub fn renew(run: &Path) -> Result<PathBuf, Failure> {
    let (folder, record) = (folder(run), load(run)?);
    write(folder, &record)?;
    Ok(folder.join(PAGE_FILE))
}

/// Writes the part of a page that comes from a recorded run, between its markers.
///
/// # Errors
/// A message that names the file, also if it lacks the markers.
pub fn renew_page(run: &Path, page: &Path) -> Result<(), Failure> {
    let record = load(run)?;
    let text = read_text(page)?;
    let renewed = readme::renewed(&text, page, folder(run), &Results::new(&record)?);
    let begin = readme::PARTS.map(|name| format!("<!-- {name}: begin -->")).join(" or ");
    let missing =
        || Failure::reading(page, &format!("no part of it lies between the marker {begin} and that of its end"));
    write_text(page, &renewed.ok_or_else(missing)?)
}

/// The folder of a run, given that folder or its record.
fn folder(run: &Path) -> &Path {
    if run.ends_with(RECORD_FILE) { run.parent().unwrap_or(run) } else { run }
}

/// The text of a page with a renewed part from a run; `None` if it lacks the markers or the run cannot be read. The
/// paths of page and run start at `root`. A test uses this to check that the committed page matches its record.
#[must_use]
pub fn renewed_page(text: &str, root: &Path, page: &Path, run: &Path) -> Option<String> {
    let record = load(&root.join(run)).ok()?;
    readme::renewed(text, page, run, &Results::new(&record).ok()?)
}
