//! The report as Markdown.

use std::fmt::Write as _;

use super::{Drawing, Report, escape, results::UNAVAILABLE, tables::Table};
use crate::record::{Device, Machine, Program};

/// The heading of the diagrams that are ours.
pub(super) const TRADEOFFS: &str = "Diagrams of ours: what plans cost and give";

/// The whole page.
pub(super) fn page(report: &Report<'_>) -> String {
    let mut text = format!("# {}\n\n", escape::markdown(&title(report)));
    for line in facts(report) {
        let _ = writeln!(text, "* {}", escape::markdown(&line));
    }
    text += "\n## Tables\n\n";
    for table in &report.tables {
        text += &section(report, table);
    }
    text += "## Figures\n\n";
    report.figures.iter().for_each(|figure| text += &drawing(figure));
    text += "## Diagrams\n\n";
    report.diagrams.iter().for_each(|diagram| text += &drawing(diagram));
    let _ = writeln!(text, "## {TRADEOFFS}\n");
    report.tradeoffs.iter().for_each(|diagram| text += &drawing(diagram));
    text
}

/// The heading of both pages.
pub(super) fn title(report: &Report<'_>) -> String {
    let quick = if report.results.record.run.quick { ", a quick run" } else { "" };
    format!("Belief propagation for stereo matching, on {}{quick}", report.results.record.machine.cpu)
}

/// What a reader must know of a run before its numbers.
pub(super) fn facts(report: &Report<'_>) -> Vec<String> {
    let record = report.results.record;
    let (run, program, machine) = (&record.run, &record.program, &record.machine);
    let mut facts = vec![
        format!("Images: {}; L = {} labels, k = {} loops of BP.", report.results.data(), run.labels, run.k),
        machine_fact(machine),
        program_fact(program),
        format!("Begun {}, last written {}.", record.started, record.updated),
        "Printed numbers are the thesis's (GeForce GTX 750 Ti, CUDA); all others were measured in this run. Totals are \
         of the wall clock, message passing of the device's own where it has one. Machines are noisy: compare ratios, \
         and mind the ranges."
            .to_owned(),
    ];
    facts.extend(report.results.devices().into_iter().map(|(backend, device)| device_fact(backend, device)));
    facts.extend(report.results.unavailable());
    if run.quick {
        let k = run.k;
        facts.push(format!(
            "A quick run: small images, and k = {k} instead of k = L. Its numbers are not the thesis's experiment."
        ));
    }
    if !record.complete {
        facts.push("The run is not complete: \"not run\" marks what is missing.".to_owned());
    }
    facts
}

/// The machine in a sentence.
pub(crate) fn machine_fact(machine: &Machine) -> String {
    format!("Machine: {}, {} cores, {}.", machine.cpu, machine.cores, machine.system)
}

/// The program in a sentence.
pub(crate) fn program_fact(program: &Program) -> String {
    let changes = if program.clean_tree { "" } else { " with changes" };
    let Program { version, commit, rustc, flags, .. } = program;
    format!("Program: bp {version}, commit {commit}{changes}, {rustc}, {flags}.")
}

/// A device in a sentence.
pub(crate) fn device_fact(backend: &str, device: &Device) -> String {
    let through =
        [&device.api, &device.driver].into_iter().flatten().map(|name| format!(", {name}")).collect::<String>();
    let software = "; a software rasteriser, a CPU that pretends to be a GPU: its times are not a GPU's";
    let software = if device.software_rasteriser { software } else { "" };
    let workers = match device.workers {
        _ if device.api.is_some() => String::new(),
        1 => ", 1 worker".to_owned(),
        workers => format!(", {workers} workers"),
    };
    format!("Backend {backend}: {}{through}{workers}{software}.", device.name)
}

/// What stands under a table's heading: its data, and what a reader must know.
pub(super) fn notes(report: &Report<'_>, table: &Table) -> String {
    let data = table.data.clone().unwrap_or_else(|| report.results.setting());
    format!("Data: {data}. {}", table.note).trim_end().to_owned()
}

/// A table's heading.
pub(super) fn heading(table: &Table) -> String {
    format!("Table {}: {}", table.number, table.title)
}

/// What stands beneath a table: why numbers are missing in it.
pub(super) fn beneath(report: &Report<'_>, table: &Table) -> Option<String> {
    report.results.unavailable().filter(|_| table.rows.iter().flatten().any(|cell| cell == UNAVAILABLE))
}

fn section(report: &Report<'_>, table: &Table) -> String {
    let [heading, notes] = [heading(table), notes(report, table)].map(|text| escape::markdown(&text));
    let beneath = beneath(report, table).map_or(String::new(), |text| format!("{}\n\n", escape::markdown(&text)));
    format!("### {heading}\n\n{notes}\n\n{}\n{beneath}", grid(table))
}

/// The lines of a table.
pub(super) fn grid(table: &Table) -> String {
    lines(&table.columns, &table.rows)
}

/// The lines of a table of these columns and rows.
pub(crate) fn lines(columns: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<_> = cells.iter().map(|cell| escape::markdown(cell)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rule = format!("|{}\n", "---|".repeat(columns.len()));
    line(columns) + &rule + &rows.iter().map(|row| line(row)).collect::<String>()
}

fn drawing(drawing: &Drawing) -> String {
    let Drawing { name, title, caption, table, .. } = drawing;
    let [title, caption] = [title, caption].map(|text| escape::markdown(text));
    let table = table
        .as_ref()
        .map_or(String::new(), |table| format!("{}\n\n{}\n", escape::markdown(&table.title), grid(table)));
    format!("### {title}\n\n{caption}\n\n![{title}]({name}.svg)\n\n{table}")
}
