//! The results of `bp speed` as Markdown, written from its record alone.

use std::fmt::Write as _;

use bp_core::Stage;

use super::charts::{Chart, growth, roofline};
use crate::{
    escape::{markdown as markdown_escaped, printable},
    record::{
        Outcome, Sample,
        speed::{Contest, Contestant, Entry, Family, Measurement, Speed, StageTime},
    },
    report::{
        device_fact,
        format::{Spread, mebibytes, number, or, whole},
        lines, machine_fact, program_fact,
    },
};

/// How to read the numbers, shown before the first table.
const READING: &str = "Times are medians, with their range from three rounds on. In a round every device solves the \
                       problem once, one after another, after a first solve that does not count. By the wall clock a \
                       solve goes from the images to the labels in main memory; by the device's own clock it is the \
                       sum of the stages, without transfers and waiting. A device that gives other labels than those \
                       before it has failed.";

/// The whole page.
pub fn page(speed: &Speed) -> String {
    let quick = if speed.quick { ", a quick run" } else { "" };
    let mut text = format!("# Devices compared, on {}{quick}\n\n", markdown_escaped(&speed.machine.cpu));
    facts(speed).iter().for_each(|fact| _ = writeln!(text, "* {}", markdown_escaped(fact)));
    let _ = writeln!(text, "\n{READING}\n");
    if speed.contests_of(None).next().is_some() {
        text += "## Problems\n\n";
        speed.contests_of(None).for_each(|contest| _ = writeln!(text, "* {}", described(contest)));
        let _ = writeln!(text, "\n## Times\n\n{}", times(speed));
        text += &(ratios(speed) + &stages(speed));
    }
    Family::ALL.into_iter().for_each(|family| text += &family_section(speed, family));
    text += &roofline(speed).as_ref().map_or(String::new(), shown);
    let beneath = beneath(speed);
    if !beneath.is_empty() {
        text += "## Less than asked for\n\n";
        beneath.iter().for_each(|line| _ = writeln!(text, "* {}", markdown_escaped(line)));
    }
    text
}

/// A chart under its heading.
fn shown(Chart { name, plot, caption }: &Chart) -> String {
    format!("## {0}\n\n{caption}\n\n![{0}]({name}.svg)\n\n", plot.title)
}

/// The machine, the program, the run and the contestants, one line each.
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
    // Opening a CPU takes no time worth showing.
    let opened = contestant.open_ms.filter(|_| device.api.is_some());
    let opened = opened.map(|ms| format!(" Opened and tested in {} ms.", figures(ms)));
    let copies = contestant.copy_gb_per_s;
    let copies = copies.map(|rate| format!(" Copying its memory, it reads and writes {} GB/s.", figures(rate)));
    format!("{}{}{}", device_fact(name, device), or(opened, ""), or(copies, ""))
}

/// A one-line description of a problem.
fn described(contest: &Contest) -> String {
    let Contest { width, height, settings, .. } = contest;
    let problem = printable(&contest.problem).replace('`', "'");
    let [profile, schedule] = [&settings.profile, &settings.schedule].map(|text| markdown_escaped(text));
    let steps = if settings.schedule == "checkerboard" { "half-steps" } else { "loops" };
    format!(
        "`{problem}`: {width}x{height} pixels, {} labels, profile {profile}, grids: {}, {steps} on each: {} ({schedule}), {} message entries.",
        settings.labels,
        settings.grids,
        settings.steps_per_grid,
        whole(settings.message_updates)
    )
}

/// Time against the number that varies within a family, as a chart and as a table.
fn family_section(speed: &Speed, family: Family) -> String {
    let contests: Vec<_> = speed.contests_of(Some(family)).collect();
    let (Some(chart), Some(first)) = (growth(speed, family), contests.first()) else { return String::new() };
    let labels = first.entries.iter().map(|entry| format!("{}, ms", speed.label(entry)));
    let columns: Vec<_> = ["problem", family.grows()].map(str::to_owned).into_iter().chain(labels).collect();
    let cell = |entry: &Entry| match &entry.outcome {
        Outcome::Measured(measured) => spread(Sample::spread(&measured.samples, |sample| sample.total_ms)),
        other => missing(other).to_owned(),
    };
    let rows = contests.iter().map(|contest| {
        let which = [contest.problem.clone(), whole(family.number_of(contest))];
        which.into_iter().chain(contest.entries.iter().map(cell)).collect()
    });
    let rows: Vec<_> = rows.collect();
    format!("{}The first: {}\n\n{}\n", shown(&chart), described(first), lines(&columns, &rows))
}

/// Every problem without a family, with each of its contestants.
fn rows(speed: &Speed) -> impl Iterator<Item = (&Contest, &Entry)> {
    speed.contests_of(None).flat_map(entries)
}

fn entries(contest: &Contest) -> impl Iterator<Item = (&Contest, &Entry)> {
    contest.entries.iter().map(move |entry| (contest, entry))
}

/// The word shown instead of missing numbers.
fn missing(outcome: &Outcome<Measurement>) -> &'static str {
    match outcome {
        Outcome::Pending | Outcome::Measured(_) => "",
        Outcome::Error(_) => "failed",
        Outcome::Unavailable(_) => "unavailable",
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
    let rows = rows(speed).map(|(contest, entry)| {
        let mut cells = vec![contest.problem.clone(), speed.label(entry)];
        match &entry.outcome {
            Outcome::Measured(measurement) => cells.extend(times_of(contest, measurement)),
            other => cells.push(missing(other).to_owned()),
        }
        cells
    });
    let note = "Message entries are timed in the stage update_messages (under sweep, also in refine, where some backends \
                prepare seams), by the device's clock where it has one. Each problem is prepared once; kernels that \
                opening the device or an earlier problem compiled are not compiled again.";
    format!("{}\n{note}\n", table(&columns, rows))
}

fn times_of(contest: &Contest, measurement: &Measurement) -> [String; 7] {
    let Measurement { samples, prepare_ms, compile_ms, allocated_bytes, .. } = measurement;
    let (settings, update) = (&contest.settings, Stage::UpdateMessages);
    let ns = |sample: &Sample| 1e6 * sample.kernel_ms(update, &settings.schedule) / settings.message_updates as f64;
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

/// Why results are missing, or have fewer rounds than requested.
fn beneath(speed: &Speed) -> Vec<String> {
    let line = |(contest, entry): (&Contest, &Entry)| {
        let what = match &entry.outcome {
            Outcome::Pending => "not run".to_owned(),
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
    speed.contests.iter().flat_map(entries).filter_map(line).collect()
}

/// The time of each contestant over that of the first one that could be opened.
fn ratios(speed: &Speed) -> String {
    let mut rows = Vec::new();
    for contest in speed.contests_of(None) {
        let Some((first, others)) = contest.entries.split_first() else { continue };
        let Some(base) = first.outcome.measured() else { continue };
        for other in others {
            let Some(measured) = other.outcome.measured() else { continue };
            let own = |sample: &Sample| sample.device_ms().unwrap_or(sample.total_ms);
            let (samples, base) = (&measured.samples, &base.samples);
            let ratios = [Sample::ratios(samples, base, |sample| sample.total_ms), Sample::ratios(samples, base, own)];
            let ratios = ratios.map(|ratios| spread(Spread::of(ratios)));
            rows.push([&[contest.problem.clone(), speed.label(other)][..], &ratios].concat());
        }
    }
    let Some(first) = speed.contests.iter().find_map(|contest| contest.entries.first()) else { return String::new() };
    if rows.is_empty() {
        return String::new();
    }
    let note = format!(
        "How many times as long as {} the others take: medians of the ratios within a round. Each one's own clock is \
         its device's, or the wall clock where it has none.",
        markdown_escaped(&speed.label(first))
    );
    let columns = ["problem", "backend", "by the wall clock", "by each one's own clock"];
    format!("## Ratios\n\n{note}\n\n{}\n", table(&columns, rows.into_iter()))
}

/// A table of stages for every problem.
fn stages(speed: &Speed) -> String {
    let mut text = "## Stages\n\nGB/s are the bytes that a stage has to read and write at least, each value of a step \
                    counted once, over its time. They stand beside the rate at which the device copies its memory: \
                    more than that says that some stayed in caches.\n\n"
        .to_owned();
    let columns = ["backend", "stage", "clock", "ms", "GB/s", "% of copying"];
    for contest in speed.contests_of(None) {
        let rows = contest.entries.iter().flat_map(|entry| stages_of(speed, entry));
        let _ = writeln!(text, "### {}\n\n{}", markdown_escaped(&contest.problem), table(&columns, rows));
    }
    text
}

/// The stages of a contestant that took any time.
fn stages_of(speed: &Speed, entry: &Entry) -> Vec<Vec<String>> {
    let Some(measured) = entry.outcome.measured() else { return Vec::new() };
    let contestant = speed.contestant(entry);
    let copying = contestant.and_then(|contestant| contestant.copy_gb_per_s);
    let clock = if measured.has_clock() { "device" } else { "wall" };
    let row = |time: StageTime| {
        let rate = time.gb_per_s().map(|rate| rate.median);
        let part = rate.zip(copying).map(|(rate, copying)| number(100.0 * rate / copying, 0));
        let which = [speed.label(entry), time.stage.name().to_owned(), clock.to_owned()];
        let cells = [spread(Some(time.ms)), or(rate.map(figures), ""), or(part, "")];
        [which, cells].concat()
    };
    contestant.into_iter().flat_map(|contestant| contestant.stages(measured)).map(row).collect()
}

fn table(columns: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let columns: Vec<_> = columns.iter().map(|&column| column.to_owned()).collect();
    lines(&columns, &rows.collect::<Vec<_>>())
}

/// A number with three significant digits, or with all its integer digits if those are more.
fn figures(value: f64) -> String {
    number(value, decimals(value))
}

/// The median with three significant digits, and the range if there are three samples or more; empty for `None`.
fn spread(spread: Option<Spread>) -> String {
    let Some(Spread { median, low, high, count }) = spread else { return String::new() };
    let number = |value| number(value, decimals(median));
    let range = if count >= 3 { format!(" ({} to {})", number(low), number(high)) } else { String::new() };
    format!("{}{range}", number(median))
}

/// The number of decimals that gives three significant digits.
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
