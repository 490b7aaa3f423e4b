//! `bp gate --instructions`: compares instruction counts with the recorded ones.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::{
    callgrind::{self, Counts},
    file,
    table::table,
};
use bp_stereo::Watch;

use crate::{failure::Failure, report::format::whole};

/// A count may grow by this fraction. The same program takes the same instructions, but a new build of the same sources
/// may differ by a few.
const TOLERANCE: f64 = 0.01;

/// The counts, judged.
#[derive(Serialize)]
pub struct CountJudgement {
    #[serde(skip)]
    baselines: PathBuf,
    counts: Counts,
    /// Recorded counts of the same tools, if any.
    recorded: Option<Counts>,
    /// Why the counts cannot be compared.
    unlike: Option<String>,
}

/// Counts instructions and compares them with the file, if its counts are comparable.
pub fn instructions(baselines: &Path, watch: &Watch<'_>) -> Result<CountJudgement, Failure> {
    let missing = "--instructions needs valgrind; install it, or leave the option out";
    let valgrind = callgrind::valgrind().ok_or_else(|| Failure::unavailable(missing))?;
    let recorded: Option<Counts> = file::read(&baselines.join(file::INSTRUCTIONS))?;
    let counts = callgrind::count(valgrind, watch)?;
    let unlike = match &recorded {
        None => Some(format!("there is no {}", baselines.join(file::INSTRUCTIONS).display())),
        Some(recorded) if recorded.tools() != counts.tools() => Some(format!("it is of {}", recorded.tools())),
        Some(_) => None,
    };
    let recorded = recorded.filter(|_| unlike.is_none());
    Ok(CountJudgement { baselines: baselines.to_owned(), counts, recorded, unlike })
}

impl CountJudgement {
    /// Each count with its name, its recorded value, and the fraction by which it grew.
    fn rows(&self) -> impl Iterator<Item = (&String, u64, Option<(u64, f64)>)> {
        self.counts.counts.iter().map(|(name, &count)| {
            let before = self.recorded.as_ref().and_then(|recorded| recorded.counts.get(name));
            (name, count, before.map(|&before| (before, count as f64 / before as f64 - 1.0)))
        })
    }

    /// Describes counts that grew beyond the tolerance or disappeared, and backends that moved to another device.
    pub fn failures(&self) -> Vec<String> {
        let grown = self.rows().filter_map(|(name, now, before)| {
            let (before, more) = before.filter(|&(_, more)| more > TOLERANCE)?;
            let percent = 100.0 * more;
            Some(format!("{name}: {} instructions, was {} (+{percent:.1} %)", whole(now), whole(before)))
        });
        let Counts { devices, counts, .. } = &self.counts;
        let recorded = || self.recorded.iter();
        let moved = recorded().flat_map(|recorded| &recorded.devices).filter_map(|(backend, before)| {
            let now = devices.get(backend).filter(|&now| now != before)?;
            Some(format!("{backend} runs on {now}, did on {before}"))
        });
        let gone = recorded().flat_map(|recorded| recorded.counts.keys()).filter(|&name| !counts.contains_key(name));
        grown.chain(moved).chain(gone.map(|name| format!("{name}: not counted any more"))).collect()
    }

    /// The page.
    pub fn page(&self) -> String {
        let mut text = format!("# Instructions\n\n* Counted on {}.\n", self.counts.tools());
        self.counts.devices.iter().for_each(|(backend, device)| _ = writeln!(text, "* {backend}: {device}."));
        if let Some(unlike) = &self.unlike {
            let advice = "`bp gate --instructions --update` writes one";
            let _ = writeln!(text, "* Nothing to compare with: {unlike}; {advice}.");
        }
        let rows = self.rows().map(|(name, now, before)| {
            let before_text = before.map_or_else(|| "-".to_owned(), |(before, _)| whole(before));
            let more = before.map_or_else(|| "-".to_owned(), |(_, more)| format!("{:+.2} %", 100.0 * more));
            vec![name.to_owned(), whole(now), before_text, more]
        });
        let columns = ["solve and kernel", "instructions", "baseline", "difference"];
        let _ = write!(text, "\nMore than {} % more fails.\n\n{}", 100.0 * TOLERANCE, table(&columns, rows.collect()));
        text
    }

    /// Writes the counts as the new baseline; returns the file's name.
    pub fn update(&self) -> Result<String, Failure> {
        let path = self.baselines.join(file::INSTRUCTIONS);
        file::write(&path, &self.counts)?;
        Ok(path.display().to_string())
    }
}
