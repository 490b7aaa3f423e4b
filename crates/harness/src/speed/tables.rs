//! What `bp speed` found as Markdown, made from the record alone.

use std::fmt::Write as _;

use bp_core::Stage;

use super::record::{Contest, Contestant, Entry, Measurement, Outcome, Sample, Speed};
use crate::report::{
    device_fact,
    format::{Spread, mebibytes, number, or, whole},
    lines, machine_fact, program_fact,
};

/// Beneath the heading: how to read the numbers.
const READING: &str = "Times are medians, with their range from three rounds on. In a round every device solves the \
                       problem once, one after another, after a first solve that does not count. By the wall clock a \
                       solve goes from the images to the labels in main memory; by the device's own clock it is the \
                       sum of the stages, without transfers and waiting. A device that gives other labels than those \
                       before it has failed.";

/// The whole page.
pub(crate) fn page(speed: &Speed) -> String {
    let quick = if speed.quick { ", a quick run" } else { "" };
    let mut text = format!("# Devices beside one another, on {}{quick}\n\n", speed.machine.cpu);
    facts(speed).iter().for_each(|fact| _ = writeln!(text, "* {fact}"));
    text += "\n## Problems\n\n";
    speed.contests.iter().for_each(|contest| _ = writeln!(text, "* {}", described(contest)));
    let _ = writeln!(text, "\n## Times\n\n{READING}\n\n{}", times(speed));
    let beneath = beneath(speed);
    beneath.iter().for_each(|line| _ = writeln!(text, "* {line}"));
    text += if beneath.is_empty() { "" } else { "\n" };
    text += &ratios(speed);
    text += &stages(speed);
    text
}

/// What a reader must know before the numbers.
fn facts(speed: &Speed) -> Vec<String> {
    let mut facts = vec![machine_fact(&speed.machine), program_fact(&speed.program)];
    let images = if speed.quick { "a quick run on images of a third of the width and height" } else { "a full run" };
    facts.push(format!("Begun {}: {images}, rounds: {}.", speed.started, speed.rounds));
    facts.extend(speed.contestants.iter().map(contestant));
    facts
}

fn contestant(contestant: &Contestant) -> String {
    let name = &contestant.name;
    let Some(device) = &contestant.device else {
        return format!("Backend {name}: unavailable: {}.", or(contestant.unavailable.clone(), "no reason is known"));
    };
    // Opening a processor is nothing.
    let opened = contestant.open_ms.filter(|_| device.api.is_some());
    let opened = opened.map(|ms| format!(" Opened and tested in {} ms.", figures(ms)));
    let copies = contestant.copy_gb_per_s;
    let copies = copies.map(|rate| format!(" Copying its memory, it reads and writes {} GB/s.", figures(rate)));
    format!("{}{}{}", device_fact(name, device), or(opened, ""), or(copies, ""))
}

/// A problem in a line.
fn described(contest: &Contest) -> String {
    let Contest { problem, width, height, settings, .. } = contest;
    let steps = if settings.schedule == "checkerboard" { "half-steps" } else { "loops" };
    format!(
        "`{problem}`: {width}x{height} pixels, {} labels, profile {}, grids: {}, {steps} on each: {} ({}), {} message entries.",
        settings.labels,
        settings.profile,
        settings.grids,
        settings.steps_per_grid,
        settings.schedule,
        whole(settings.message_updates)
    )
}

impl Speed {
    /// All problems with all contestants that took part.
    fn rows(&self) -> impl Iterator<Item = (&Contest, &Entry)> {
        self.contests.iter().flat_map(|contest| contest.entries.iter().map(move |entry| (contest, entry)))
    }

    /// A contestant as tables name it.
    fn label(&self, entry: &Entry) -> String {
        let contestant = self.contestants.iter().find(|contestant| contestant.name == entry.contestant);
        contestant.map_or_else(|| entry.contestant.clone(), Contestant::label)
    }
}

/// The table of all problems and contestants.
fn times(speed: &Speed) -> String {
    let columns = [
        "problem",
        "backend",
        "rounds",
        "wall clock, ms",
        "device's clock, ms",
        "ns a message entry",
        "preparing, ms",
        "of that compiling, ms",
        "MiB allocated",
    ];
    let rows = speed.rows().map(|(contest, entry)| {
        let mut cells = vec![contest.problem.clone(), speed.label(entry)];
        match &entry.outcome {
            Outcome::Measured(measurement) => cells.extend(times_of(contest, measurement)),
            Outcome::Error(_) => cells.push("failed".to_owned()),
            Outcome::Unavailable(_) => cells.push("unavailable".to_owned()),
        }
        cells
    });
    let note = "Message entries are timed in the stage update_messages, by the device's clock where it has one. Each \
                problem is prepared once; kernels that opening the device or an earlier problem compiled are not \
                compiled again.";
    format!("{}\n{note}\n", table(&columns, rows))
}

fn times_of(contest: &Contest, measurement: &Measurement) -> [String; 7] {
    let Measurement { samples, prepare_ms, compile_ms, allocated_bytes, .. } = measurement;
    let update = Stage::UpdateMessages as usize;
    let ns = |sample: &Sample| 1e6 * sample.stages_ms()[update] / contest.settings.message_updates as f64;
    let device = Spread::of(samples.iter().filter_map(Sample::device_ms));
    [
        samples.len().to_string(),
        spread(Spread::of(samples.iter().map(|sample| sample.total_ms))),
        device.map_or_else(|| "none".to_owned(), |device| spread(Some(device))),
        spread(Spread::of(samples.iter().map(ns))),
        figures(*prepare_ms),
        or(compile_ms.map(figures), ""),
        number(mebibytes(*allocated_bytes), 1),
    ]
}

/// Why numbers are missing in the table of times, or are fewer than others.
fn beneath(speed: &Speed) -> Vec<String> {
    let line = |(contest, entry): (&Contest, &Entry)| {
        let what = match &entry.outcome {
            Outcome::Measured(measured) if measured.rounds == speed.rounds => return None,
            Outcome::Measured(measured) => {
                let seconds = figures(measured.first_ms / 1000.0);
                format!("{} rounds only, since the first solve took {seconds} s", measured.rounds)
            }
            Outcome::Error(error) => format!("failed: {error}"),
            Outcome::Unavailable(reason) => format!("unavailable: {reason}"),
        };
        Some(format!("{} on {}: {what}.", contest.problem, speed.label(entry)))
    };
    speed.rows().filter_map(line).collect()
}

/// How many times as long as the first contestant that is there the others take.
fn ratios(speed: &Speed) -> String {
    let mut rows = Vec::new();
    for contest in &speed.contests {
        let Some((first, others)) = contest.entries.split_first() else { continue };
        let Some(base) = first.outcome.measured() else { continue };
        for other in others {
            let Some(measured) = other.outcome.measured() else { continue };
            let own = |sample: &Sample| sample.device_ms().unwrap_or(sample.total_ms);
            let ratios = [ratio(measured, base, |sample| sample.total_ms), ratio(measured, base, own)];
            rows.push([&[contest.problem.clone(), speed.label(other)][..], &ratios.map(spread)].concat());
        }
    }
    let Some(first) = speed.contests.iter().find_map(|contest| contest.entries.first()) else { return String::new() };
    if rows.is_empty() {
        return String::new();
    }
    let note = format!(
        "How many times as long as {} the others take: medians of the ratios within a round. Each one's own clock is \
         its device's, or the wall clock where it has none.",
        speed.label(first)
    );
    let columns = ["problem", "backend", "by the wall clock", "by each one's own clock"];
    format!("## Ratios\n\n{note}\n\n{}\n", table(&columns, rows.into_iter()))
}

/// The ratios of samples of the same round.
fn ratio(measured: &Measurement, base: &Measurement, ms: impl Fn(&Sample) -> f64) -> Option<Spread> {
    let same_round = |a: &Sample| {
        let b = base.samples.iter().find(|b| b.round == a.round)?;
        Some(ms(a) / ms(b))
    };
    Spread::of(measured.samples.iter().filter_map(same_round))
}

/// A table of stages for every problem.
fn stages(speed: &Speed) -> String {
    let mut text = "## Stages\n\nGB/s are the bytes that a stage has to read and write at least, each value of a step \
                    counted once, over its time. They stand beside the rate at which the device copies its memory: \
                    more than that says that some stayed in caches.\n\n"
        .to_owned();
    let columns = ["backend", "stage", "clock", "ms", "GB/s", "% of copying"];
    for contest in &speed.contests {
        let rows = contest.entries.iter().flat_map(|entry| stages_of(speed, entry));
        let _ = writeln!(text, "### {}\n\n{}", contest.problem, table(&columns, rows));
    }
    text
}

/// The stages of a contestant that took any time.
fn stages_of(speed: &Speed, entry: &Entry) -> Vec<Vec<String>> {
    let Some(measured) = entry.outcome.measured() else { return Vec::new() };
    let contestant = speed.contestants.iter().find(|contestant| contestant.name == entry.contestant);
    let copying = contestant.and_then(|contestant| contestant.copy_gb_per_s);
    let has_clock = measured.samples.iter().all(|sample| sample.device_ms().is_some());
    let is_timed = contestant.is_some_and(|contestant| contestant.times_stages(&measured.samples));
    let bytes = measured.moved_bytes.as_ref().filter(|_| is_timed);
    let row = |stage: Stage| {
        let index = stage as usize;
        let ms = Spread::of(measured.samples.iter().map(|sample| sample.stages_ms()[index]))?;
        let bytes = bytes.map(|bytes| bytes.in_order()[index]).filter(|&bytes| bytes > 0);
        let rate = bytes.map(|bytes| bytes as f64 / (1e6 * ms.median));
        let part = rate.zip(copying).map(|(rate, copying)| number(100.0 * rate / copying, 0));
        let clock = if has_clock { "device" } else { "wall" };
        let which = [speed.label(entry), stage.name().to_owned(), clock.to_owned()];
        let cells = [spread(Some(ms)), or(rate.map(figures), ""), or(part, "")];
        (ms.high > 0.0).then(|| [which, cells].concat())
    };
    Stage::ALL.into_iter().filter_map(row).collect()
}

fn table(columns: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let columns: Vec<_> = columns.iter().map(|&column| column.to_owned()).collect();
    lines(&columns, &rows.collect::<Vec<_>>())
}

/// A number with three significant digits, or as many as it has before the point.
fn figures(value: f64) -> String {
    number(value, decimals(value))
}

/// A median and, from three numbers on, their range, with three significant digits of the median; nothing of nothing.
fn spread(spread: Option<Spread>) -> String {
    let Some(Spread { median, low, high, count }) = spread else { return String::new() };
    let number = |value| number(value, decimals(median));
    let range = if count >= 3 { format!(" ({} to {})", number(low), number(high)) } else { String::new() };
    format!("{}{range}", number(median))
}

/// Decimals of three significant digits.
fn decimals(value: f64) -> usize {
    if value > 0.0 { (2.0 - value.log10().floor()).clamp(0.0, 6.0) as usize } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_significant_digits() {
        let values = [0.0, 0.012_345, 1.2345, 12.345, 1234.5];
        assert_eq!(values.map(figures), ["0", "0.0123", "1.23", "12.3", "1,234"]);
        assert_eq!(spread(Spread::of([1.0, 2.0, 30.0])), "2.00 (1.00 to 30.00)");
        assert_eq!([spread(Spread::of([1.0, 2.0])), spread(None)], ["1.50", ""]);
    }
}
