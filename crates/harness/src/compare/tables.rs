//! A comparison as Markdown.

use std::fmt::Write as _;

use super::{Comparison, Means, Row, Source, Time, Value, speed_ups};
use crate::{
    escape::markdown as markdown_escaped,
    report::{
        device_fact,
        format::{number, or},
        lines, machine_fact, program_fact,
    },
    scenes,
};

/// The whole page.
pub fn page(comparison: &Comparison<'_>) -> String {
    let mut text = String::from("# Records compared\n\n");
    for (place, record) in comparison.records.iter().enumerate() {
        let facts = facts(record);
        let _ = writeln!(text, "* Record {}: {}", place + 1, markdown_escaped(&facts));
    }
    let Comparison { data, labels, k, note, .. } = comparison;
    let images = markdown_escaped(scenes::set(data).map_or(data, |set| set.described));
    let _ = writeln!(text, "* Images: {images}; L = {labels} labels, k = {k} loops of BP.\n\n## Times\n\n{note}\n");
    text += &times(comparison);
    text += "\n## Errors and energy\n\nMeans over the scenes. Labels are held against those of the first column, or \
             row, that has the plan: all backends and commits should give the same.\n\n";
    text += &results(comparison);
    text += &speed_ups::section(&comparison.speed_ups);
    text += &alone(comparison);
    text
}

fn facts(record: &Source<'_>) -> String {
    let incomplete = if record.complete { "" } else { " The run is not complete." };
    let devices: String =
        record.devices.iter().map(|used| format!(" {}", device_fact(used.backend, used.device))).collect();
    let (machine, program) = (machine_fact(record.machine), program_fact(record.program));
    format!("{}, begun {}.{incomplete} {machine} {program}{devices}", record.path, record.started)
}

fn times(comparison: &Comparison<'_>) -> String {
    let cells = |place: usize, means: &Means| {
        let Means { total, message_passing, .. } = means;
        let times = [total, message_passing].map(|time| figures(time.ms));
        let ratios = [total, message_passing].map(ratio);
        times.into_iter().chain(ratios.into_iter().filter(|_| place > 0)).collect()
    };
    let headings = |record: usize| {
        let mut headings = vec![format!("{record}: total, ms"), format!("{record}: message passing, ms")];
        if record > 1 {
            headings.extend([format!("{record} / 1: total"), format!("{record} / 1: message passing")]);
        }
        headings
    };
    table(comparison, headings, cells)
}

fn results(comparison: &Comparison<'_>) -> String {
    let headings = |record: usize| {
        ["wrong by > 1 px, non-occluded, %", "RMSE, non-occluded, px", "energy"]
            .map(|what| format!("{record}: {what}"))
            .to_vec()
    };
    let cells = |_, means: &Means| {
        let Means { visible_bad_1px_percent, visible_rmse_px, energy, .. } = means;
        vec![number(*visible_bad_1px_percent, 2), number(*visible_rmse_px, 2), number(*energy, 0)]
    };
    let mut rows = comparison.rows.iter().flat_map(|row| flags(comparison, row)).collect::<Vec<_>>();
    if rows.is_empty() {
        rows.push("* Labels are the same wherever two records or backends have the same plan.".to_owned());
    }
    format!("{}\n{}\n", table(comparison, headings, cells), rows.join("\n"))
}

/// A line for every record whose labels or settings of this plan differ from the first's.
fn flags(comparison: &Comparison<'_>, row: &Row<'_>) -> Vec<String> {
    let line = |(place, value): (usize, &Value<'_>)| {
        let on = |scenes: &[&str]| format!("on {} of {} scenes", scenes.len(), comparison.scenes.len());
        let settings = (!value.other_settings.is_empty())
            .then(|| format!("other settings {}, so that its times are of other work", on(&value.other_settings)));
        let labels = (!value.other_labels.is_empty()).then(|| format!("**labels differ** {}", on(&value.other_labels)));
        let what: Vec<_> = settings.into_iter().chain(labels).collect();
        let which = format!("{} on {}", markdown_escaped(row.plan), markdown_escaped(row.backend));
        (!what.is_empty()).then(|| format!("* {which}, record {}: {}.", place + 1, what.join("; ")))
    };
    row.values.iter().enumerate().filter_map(line).collect()
}

/// A row for every plan and backend, and some columns for every record.
fn table(
    comparison: &Comparison<'_>,
    headings: impl Fn(usize) -> Vec<String>,
    cells: impl Fn(usize, &Means) -> Vec<String>,
) -> String {
    let columns = (1..=comparison.records.len()).flat_map(&headings);
    let columns: Vec<_> = ["plan", "backend"].map(str::to_owned).into_iter().chain(columns).collect();
    let row = |row: &Row<'_>| {
        let mut line = vec![row.plan.to_owned(), row.backend.to_owned()];
        for (place, value) in row.values.iter().enumerate() {
            let missing = || match value.measured_scenes {
                0 => "-".to_owned(),
                count => format!("{count} of {} scenes only", comparison.scenes.len()),
            };
            let filled = value.means.as_ref().map_or_else(|| vec![missing()], |means| cells(place, means));
            let gaps = headings(place + 1).len().saturating_sub(filled.len());
            line.extend(filled);
            line.extend(vec!["-".to_owned(); gaps]);
        }
        line
    };
    lines(&columns, &comparison.rows.iter().map(row).collect::<Vec<_>>())
}

/// The plans and backends that only one record has, one line per record.
fn alone(comparison: &Comparison<'_>) -> String {
    let line = |place: usize| {
        let rows = comparison.rows.iter().filter(|row| row.only_in == Some(place));
        let which: Vec<_> = rows.map(|row| markdown_escaped(&format!("{} on {}", row.plan, row.backend))).collect();
        (!which.is_empty()).then(|| format!("* Record {}: {}.\n", place + 1, which.join(", ")))
    };
    let found: String = (0..comparison.records.len()).filter_map(line).collect();
    if found.is_empty() { found } else { format!("\n## In one record only\n\n{found}") }
}

/// A ratio with its interval.
fn ratio(time: &Time) -> String {
    let Time { ratio, ratio_interval, .. } = time;
    let interval = ratio_interval.map(|[low, high]| format!(" ({} to {})", number(low, 3), number(high, 3)));
    or(ratio.map(|ratio| number(ratio, 3) + &or(interval, "")), "-")
}

/// Milliseconds.
fn figures(ms: f64) -> String {
    number(ms, if ms < 1000.0 { 1 } else { 0 })
}
