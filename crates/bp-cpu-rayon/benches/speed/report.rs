//! What was measured, as JSON and as text.

use std::{collections::BTreeMap, fmt::Write, fs, path::Path};

use bp_charts::{Plot, png};
use bp_core::Stage;
use serde::Serialize;

use crate::{Failure, machine::Machine};

/// Of the JSON; a change of what a field means changes it.
pub(crate) const VERSION: u32 = 1;

/// Everything that was measured.
#[derive(Serialize)]
pub(crate) struct Report {
    /// [`VERSION`].
    pub(crate) version: u32,
    /// Whether this was only a quick look.
    pub(crate) quick: bool,
    /// The pairs, in a sentence.
    pub(crate) data: &'static str,
    /// Where and with what.
    pub(crate) machine: Machine,
    /// In the order of measuring.
    pub(crate) groups: Vec<Group>,
}

/// What was measured in turns.
#[derive(Default, Serialize)]
pub(crate) struct Group {
    /// As the options name it.
    pub(crate) name: &'static str,
    /// What is measured, in a sentence.
    pub(crate) title: String,
    /// What a reader should know besides.
    pub(crate) notes: Vec<String>,
    /// The contestants.
    pub(crate) measured: Vec<Measured>,
    /// Contestants compared.
    pub(crate) ratios: Vec<Ratio>,
    /// Stages beside what the machine would allow.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) limits: Vec<Limit>,
    /// File names, without ending, and charts.
    #[serde(skip)]
    pub(crate) charts: Vec<(String, Plot)>,
}

/// A contestant's samples and what they come to.
#[derive(Serialize)]
pub(crate) struct Measured {
    /// Unique in its group.
    pub(crate) name: String,
    /// Of all values.
    pub(crate) unit: &'static str,
    pub(crate) median: f64,
    pub(crate) min: f64,
    pub(crate) max: f64,
    /// The most that was asked for.
    pub(crate) asked: Option<f64>,
    /// What would be better still.
    pub(crate) goal: Option<f64>,
    /// What else is known.
    pub(crate) facts: BTreeMap<&'static str, f64>,
    /// All values, by round.
    pub(crate) samples: Vec<f64>,
    /// Of solves: their stages in the order of [`Stage::ALL`], by round.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) stages_ms: Vec<[f64; Stage::ALL.len()]>,
}

/// Two contestants compared within each round.
#[derive(Serialize)]
pub(crate) struct Ratio {
    /// Whose value is divided.
    pub(crate) first: String,
    /// By whose.
    pub(crate) second: String,
    pub(crate) median: f64,
    /// The 95 % interval of the median begins here,
    pub(crate) low: f64,
    /// and ends here.
    pub(crate) high: f64,
    /// What was asked for.
    pub(crate) asked: Option<&'static str>,
    /// By round.
    pub(crate) samples: Vec<f64>,
}

/// A stage beside what the machine would allow.
#[derive(Serialize)]
pub(crate) struct Limit {
    /// What was solved.
    pub(crate) case: String,
    /// By so many threads.
    pub(crate) threads: usize,
    pub(crate) stage: &'static str,
    /// Measured.
    pub(crate) ms: f64,
    /// Least bytes to and from main memory.
    pub(crate) bytes: f64,
    /// Operations on one byte each.
    pub(crate) operations: f64,
    /// Time in which memory alone would have moved them.
    pub(crate) memory_ms: f64,
    /// Time in which arithmetic alone would be done.
    pub(crate) arithmetic_ms: f64,
    /// Of message updates: time in which the third cache alone would hand over all that every half-step reads and
    /// writes. Not a limit of the work, but of doing it row by row.
    pub(crate) third_cache_ms: Option<f64>,
}

impl Limit {
    /// The part of the measured time that the nearer limit takes.
    pub(crate) fn fraction(&self) -> f64 {
        self.memory_ms.max(self.arithmetic_ms) / self.ms
    }
}

impl Report {
    /// Writes the text, the samples and the charts.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), Failure> {
        fs::write(folder.join("speed.md"), self.markdown())?;
        fs::write(folder.join("speed.json"), serde_json::to_string_pretty(self)? + "\n")?;
        for (name, chart) in self.groups.iter().flat_map(|group| &group.charts) {
            let svg = chart.svg()?;
            fs::write(folder.join(format!("{name}.png")), png(&svg)?)?;
            fs::write(folder.join(format!("{name}.svg")), svg)?;
        }
        Ok(())
    }

    /// The report as text.
    pub(crate) fn markdown(&self) -> String {
        let Machine {
            cpu,
            cores,
            memory_bytes,
            system,
            instruction_sets,
            rustc,
            commit,
            clean_tree,
            date,
            two_threads,
        } = &self.machine;
        let gib = *memory_bytes as f64 / f64::from(1 << 30);
        let two_threads: Vec<_> = two_threads.iter().map(|&ratio| number(ratio)).collect();
        let changes = if *clean_tree { "" } else { " with changes" };
        let mut text = format!(
            "# Speed of bp-cpu-rayon\n\nMeasured {date} on {cpu}, {cores} cores, {gib:.0} GiB, {system}; instruction \
             sets {}; {rustc}; commit {commit}{changes}. {}{}\n\nContestants of a group take turns. Intervals are of \
             95 % (bootstrap of the median over rounds). Before the groups and after them, two threads did {} times \
             the arithmetic of one: 2 if nothing else runs.\n\n",
            instruction_sets.join(", "),
            self.data,
            if self.quick { " **Only a quick look: 3 rounds.**" } else { "" },
            two_threads.join(" and "),
        );
        self.groups.iter().for_each(|group| group.markdown(&mut text));
        text
    }
}

impl Group {
    fn markdown(&self, text: &mut String) {
        let _ = writeln!(text, "## {}\n\n{}\n", self.name, self.title);
        self.notes.iter().for_each(|note| _ = writeln!(text, "- {note}"));
        if !self.notes.is_empty() {
            text.push('\n');
        }
        self.measured_table(text);
        if !self.ratios.is_empty() {
            table(
                text,
                &["ratio", "median", "interval", "asked"].map(String::from),
                self.ratios.iter().map(Ratio::row),
            );
        }
        if !self.limits.is_empty() {
            let head = "stage|threads|ms|MB moved|10^9 operations|memory limit (ms)|arithmetic limit (ms)|reached (%)|\
                        third cache (ms)";
            let head: Vec<String> = head.split('|').map(str::to_owned).collect();
            table(text, &head, self.limits.iter().map(Limit::row));
        }
        self.charts.iter().for_each(|(name, chart)| _ = writeln!(text, "![{}]({name}.svg)\n", chart.title));
    }

    fn measured_table(&self, text: &mut String) {
        let asked = self.measured.iter().any(|m| m.asked.is_some());
        let goal = self.measured.iter().any(|m| m.goal.is_some());
        let mut facts: Vec<&str> = self.measured.iter().flat_map(|m| m.facts.keys().copied()).collect();
        facts.sort_unstable();
        facts.dedup();
        let head = ["contestant", "unit", "median", "min", "max", "rounds"].into_iter();
        let head = head.chain(asked.then_some("asked at most")).chain(goal.then_some("goal")).chain(facts.clone());
        let optional = |value: Option<f64>| value.map_or_else(String::new, number);
        let rows = self.measured.iter().map(|m| {
            let values = [m.median, m.min, m.max, m.samples.len() as f64].map(number);
            let mut row = vec![m.name.clone(), m.unit.to_owned()];
            row.extend(values);
            row.extend(asked.then(|| optional(m.asked)));
            row.extend(goal.then(|| optional(m.goal)));
            row.extend(facts.iter().map(|fact| optional(m.facts.get(fact).copied())));
            row
        });
        table(text, &head.map(str::to_owned).collect::<Vec<_>>(), rows);
    }
}

impl Ratio {
    fn row(&self) -> Vec<String> {
        let interval = format!("{} to {}", number(self.low), number(self.high));
        let asked = self.asked.unwrap_or_default().to_owned();
        vec![format!("{} / {}", self.first, self.second), number(self.median), interval, asked]
    }
}

impl Limit {
    fn row(&self) -> Vec<String> {
        let values = [
            self.threads as f64,
            self.ms,
            self.bytes / 1e6,
            self.operations / 1e9,
            self.memory_ms,
            self.arithmetic_ms,
            (100.0 * self.fraction()).round(),
        ];
        let name = format!("{}: {}", self.case, self.stage);
        let third_cache = self.third_cache_ms.map_or_else(String::new, number);
        std::iter::once(name).chain(values.map(number)).chain([third_cache]).collect()
    }
}

/// A table whose first column is text.
fn table(text: &mut String, head: &[String], rows: impl Iterator<Item = Vec<String>>) {
    let rule = head.iter().enumerate().map(|(i, _)| if i == 0 { "---" } else { "---:" });
    let _ = writeln!(text, "| {} |\n|{}|", head.join(" | "), rule.collect::<Vec<_>>().join("|"));
    rows.for_each(|row| _ = writeln!(text, "| {} |", row.join(" | ")));
    text.push('\n');
}

/// A number with three significant digits, or as many as it has before the point.
pub(crate) fn number(value: f64) -> String {
    let digits = if value == 0.0 || !value.is_finite() { 0.0 } else { 2.0 - value.abs().log10().floor() };
    let text = format!("{value:.*}", digits.clamp(0.0, 9.0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
