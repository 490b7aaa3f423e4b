//! The report as one self-contained page.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{
    Drawing, Report,
    markdown::{TRADEOFFS, beneath, facts, heading, notes, title},
    tables::Table,
};

const STYLE: &str = "
:root { color-scheme: light dark; --line: #8886; --soft: #8881; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 90rem; padding: 1rem 1.5rem 4rem; }
h1 { line-height: 1.2; } h2 { margin-top: 3rem; border-bottom: 1px solid var(--line); }
h3 { margin: 2.5rem 0 .5rem; }
p { max-width: 60rem; }
nav ul { columns: 24rem; padding-left: 1.2rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .6rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th { vertical-align: bottom; white-space: normal; min-width: 4rem; }
th:first-child { min-width: 1rem; }
td.text, th.text { text-align: left; }
tbody tr:nth-child(even) { background: var(--soft); }
.beside { display: flex; flex-wrap: wrap; gap: 1.5rem; align-items: flex-start; }
.beside svg { background: #fff; border-radius: 6px; max-width: 100%; height: auto; flex: 0 1 auto; }
.beside div { flex: 1 1 20rem; }
";

/// The whole page.
pub(super) fn page(report: &Report<'_>) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title(report)) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title(report)) }
                ul { @for fact in facts(report) { li { (fact) } } }
                nav { (contents(report)) }
                h2 { "Tables" }
                @for table in &report.tables { (section(report, table)) }
                h2 { "Figures" }
                @for figure in &report.figures { (drawing(figure)) }
                h2 { "Diagrams" }
                @for diagram in &report.diagrams { (drawing(diagram)) }
                h2 { (TRADEOFFS) }
                @for diagram in &report.tradeoffs { (drawing(diagram)) }
            }
        }
    }
    .into_string()
}

fn contents(report: &Report<'_>) -> Markup {
    html! {
        details {
            summary { "Contents" }
            ul {
                @for table in &report.tables {
                    li { a href={ "#table-" (table.number) } { (heading(table)) } }
                }
                @for drawing in report.drawings() {
                    li { a href={ "#" (drawing.name) } { (drawing.title) } }
                }
            }
        }
    }
}

fn section(report: &Report<'_>, table: &Table) -> Markup {
    html! {
        section id={ "table-" (table.number) } {
            h3 { (heading(table)) }
            p { (notes(report, table)) }
            (grid(table))
            @if let Some(beneath) = beneath(report, table) { p { (beneath) } }
        }
    }
}

fn grid(table: &Table) -> Markup {
    html! {
        div.wide {
            table {
                thead { tr { @for (i, column) in table.columns.iter().enumerate() {
                    th scope="col" .text[is_text(table, i)] { (column) }
                } } }
                tbody {
                    @for row in &table.rows {
                        tr { @for (i, cell) in row.iter().enumerate() { td.text[is_text(table, i)] { (cell) } } }
                    }
                }
            }
        }
    }
}

/// Whether a column holds words: they stand on the left, numbers on the right.
fn is_text(table: &Table, column: usize) -> bool {
    let starts_with_letter = |cell: &String| cell.starts_with(|c: char| c.is_alphabetic() || c == '"');
    let cells = || table.rows.iter().filter_map(|row| row.get(column)).filter(|cell| !cell.is_empty());
    cells().filter(|cell| starts_with_letter(cell)).count() * 2 > cells().count()
}

fn drawing(drawing: &Drawing) -> Markup {
    html! {
        section id=(drawing.name) {
            h3 { (drawing.title) }
            p { (drawing.caption) }
            div.beside {
                (PreEscaped(&drawing.svg))
                @if let Some(table) = &drawing.table { div { p { (table.title) } (grid(table)) } }
            }
        }
    }
}
