//! The report as Markdown.

use std::fmt::Write as _;

use super::{
    Drawing, Report,
    grid::grid,
    opening::{self, Passage},
    results::UNAVAILABLE,
    tables::Table,
};
use crate::escape;

/// The heading of the diagrams that are not in the thesis.
pub(super) const TRADEOFFS: &str = "More diagrams: error, memory and energy against time";

/// The whole page.
pub(super) fn page(report: &Report<'_>) -> String {
    let mut text = format!("# {}\n\n", escape::markdown(&opening::title(report)));
    text += "## Summary\n\n";
    opening::passages(report).iter().for_each(|part| text += &passage(part));
    text += "## Tables\n\n";
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

/// The text under a table's heading: its data and its note.
pub(super) fn notes(report: &Report<'_>, table: &Table) -> String {
    let data = table.data.clone().unwrap_or_else(|| report.results.setting());
    format!("Data: {data}. {}", table.note).trim_end().to_owned()
}

/// A table's heading.
pub(super) fn heading(table: &Table) -> String {
    format!("Table {}: {}", table.number, table.title)
}

/// The text beneath a table: why numbers are missing in it.
pub(super) fn beneath(report: &Report<'_>, table: &Table) -> Option<String> {
    report.results.unavailable().filter(|_| table.rows.iter().flatten().any(|cell| cell == UNAVAILABLE))
}

fn passage(Passage { title, lines, table }: &Passage) -> String {
    let lines: String = lines.iter().map(|line| format!("* {}\n", escape::markdown(line))).collect();
    let table = table.as_ref().map_or(String::new(), |table| format!("{}\n", grid(table)));
    format!("### {title}\n\n{lines}\n{table}")
}

fn section(report: &Report<'_>, table: &Table) -> String {
    let [heading, notes] = [heading(table), notes(report, table)].map(|text| escape::markdown(&text));
    let beneath = beneath(report, table).map_or(String::new(), |text| format!("{}\n\n", escape::markdown(&text)));
    format!("### {heading}\n\n{notes}\n\n{}\n{beneath}", grid(table))
}

fn drawing(drawing: &Drawing) -> String {
    let Drawing { name, title, caption, table, .. } = drawing;
    let [title, caption] = [title, caption].map(|text| escape::markdown(text));
    let table = table
        .as_ref()
        .map_or(String::new(), |table| format!("{}\n\n{}\n", escape::markdown(&table.title), grid(table)));
    format!("### {title}\n\n{caption}\n\n![{title}]({name}.svg)\n\n{table}")
}
