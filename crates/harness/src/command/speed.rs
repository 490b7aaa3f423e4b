//! `bp speed`: devices against each other.

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use bp_charts::png;

use crate::{
    args::SpeedArgs,
    backends,
    failure::Failure,
    files::{check_new, check_writable, create_folder, json_text, write_new},
    interrupt, note,
    speed::{self, CHART_NAMES, Outcome, Speed, charts},
    threads,
};

/// Runs the command.
pub(crate) fn speed(args: &SpeedArgs) -> Result<(), Failure> {
    let files = args.output.as_deref().map(Files::new).transpose()?;
    interrupt::listen()?;
    let speed = threads::run_on(args.threads, || {
        let mut asked = backends::open_all(&args.backend)?;
        let opened: Vec<_> = asked.iter().filter_map(|asked| asked.device.as_ref().ok()).collect();
        threads::check(args.threads, &opened)?;
        files.as_ref().map_or(Ok(()), Files::check)?;
        speed::measure(args, &mut asked)
    })?;
    let page = speed::page(&speed);
    if let Some(files) = &files {
        files.write(&speed, &page)?;
    }
    write!(std::io::stdout(), "{page}")?;
    check_speed(&speed)
}

/// Writes the page and the record to a folder that holds neither yet.
pub(crate) fn write_speed(folder: &Path, speed: &Speed) -> Result<(), Failure> {
    Files::new(folder)?.write(speed, &speed::page(speed))
}

/// What is written, all new.
struct Files {
    folder: PathBuf,
    page: PathBuf,
    record: PathBuf,
}

impl Files {
    /// The files of a folder, which holds none of them yet.
    fn new(folder: &Path) -> Result<Self, Failure> {
        let files =
            Self { folder: folder.to_owned(), page: folder.join("speed.md"), record: folder.join("speed.json") };
        let charts = CHART_NAMES.into_iter().flat_map(|name| files.chart(name));
        [files.page.clone(), files.record.clone()].into_iter().chain(charts).try_for_each(|path| check_new(&path))?;
        Ok(files)
    }

    /// A chart as text and as a picture.
    fn chart(&self, name: &str) -> [PathBuf; 2] {
        ["svg", "png"].map(|ending| self.folder.join(format!("{name}.{ending}")))
    }

    /// Makes the folder, and fails where nothing could be written to it; for telling so before the work is done.
    fn check(&self) -> Result<(), Failure> {
        create_folder(&self.folder)?;
        check_writable(&self.record)
    }

    fn write(&self, speed: &Speed, page: &str) -> Result<(), Failure> {
        write_new(&self.record, json_text(&self.record, speed)?)?;
        for chart in charts(speed) {
            let [text, picture] = self.chart(chart.name);
            let svg = chart.plot.svg().map_err(|error| Failure::writing(&text, &error))?;
            write_new(&picture, png(&svg).map_err(|error| Failure::writing(&picture, &error))?)?;
            write_new(&text, svg)?;
        }
        write_new(&self.page, page)?;
        note(&format!("written: {} and {}", self.page.display(), self.record.display()));
        Ok(())
    }
}

/// Fails where a device failed, or where none could run anything.
pub(crate) fn check_speed(speed: &Speed) -> Result<(), Failure> {
    let entries =
        || speed.contests.iter().flat_map(|contest| contest.entries.iter().map(move |entry| (contest, entry)));
    let mut failed = entries().filter_map(|(contest, entry)| match &entry.outcome {
        Outcome::Error(error) => Some(format!("{} on {}: {error}", contest.problem, entry.contestant)),
        Outcome::Measured(_) | Outcome::Unavailable(_) => None,
    });
    if let Some(first) = failed.next() {
        return Err(Failure::other(format!("{} solves failed, such as {first}", 1 + failed.count())));
    }
    if entries().all(|(_, entry)| entry.outcome.measured().is_none()) {
        return Err(Failure::unavailable("no device could run any of the problems"));
    }
    Ok(())
}
