//! The report as one self-contained page.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{
    Drawing, Report,
    markdown::{TRADEOFFS, beneath, heading, notes},
    opening::{Passage, passages, title},
    tables::Table,
};

const STYLE: &str = "
:root { color-scheme: light dark; --line: #8886; --soft: #8881; }
* { box-sizing: border-box; }
body { font: 1rem/1.55 system-ui, sans-serif; margin: 0 auto; max-width: 112rem; padding: 1rem 1.5rem 4rem; }
h1 { line-height: 1.2; margin: .5rem 0 1rem; }
h2 { margin-top: 3rem; border-bottom: 1px solid var(--line); }
h3 { margin: 2.5rem 0 .5rem; }
p, li { max-width: 46rem; overflow-wrap: anywhere; }
nav { font-size: .85rem; line-height: 1.35; }
nav ul { list-style: none; padding-left: .8rem; }
nav > ul { padding: 0; }
nav li { margin: .3rem 0; }
nav a { text-decoration: none; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .85rem; line-height: 1.35; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .6rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th { vertical-align: bottom; white-space: normal; min-width: 4rem; }
th:first-child { min-width: 1rem; }
td.text, th.text { text-align: left; }
tbody tr:nth-child(even) { background: var(--soft); }
.beside { display: flex; flex-wrap: wrap; gap: 1.5rem; align-items: flex-start; }
.beside svg { background: #fff; border-radius: 6px; max-width: 100%; height: auto; flex: 0 1 auto; }
.beside div { flex: 1 1 20rem; min-width: 0; }
@media (max-width: 69.99rem) { #contents:not([open]) + ul { display: none; } }
@media (min-width: 70rem) {
  body { display: grid; grid-template-columns: 17rem minmax(0, 1fr); gap: 2.5rem; }
  nav { position: sticky; top: 1rem; max-height: calc(100vh - 2rem); overflow-y: auto; align-self: start; }
  #contents { display: none; }
}
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
                (contents(report))
                main {
                    h1 { (title(report)) }
                    h2 #summary { "Summary" }
                    @for part in passages(report) { (passage(&part)) }
                    h2 #tables { "Tables" }
                    @for table in &report.tables { (section(report, table)) }
                    h2 #figures { "Figures" }
                    @for figure in &report.figures { (drawing(figure)) }
                    h2 #diagrams { "Diagrams" }
                    @for diagram in &report.diagrams { (drawing(diagram)) }
                    h2 #more { (TRADEOFFS) }
                    @for diagram in &report.tradeoffs { (drawing(diagram)) }
                }
            }
        }
    }
    .into_string()
}

/// The table of contents. Wide screens show it beside the text without its switch; narrow ones fold it.
fn contents(report: &Report<'_>) -> Markup {
    let drawings = |drawings: &[Drawing]| {
        html! {
            ul { @for drawing in drawings { li { a href={ "#" (drawing.name) } { (drawing.title) } } } }
        }
    };
    html! {
        nav aria-label="Contents" {
            details #contents { summary { "Contents" } }
            ul {
                li { a href="#summary" { "Summary" } }
                li { a href="#tables" { "Tables" } ul { @for table in &report.tables {
                    li { a href={ "#table-" (table.number) } { (heading(table)) } }
                } } }
                li { a href="#figures" { "Figures" } (drawings(&report.figures)) }
                li { a href="#diagrams" { "Diagrams" } (drawings(&report.diagrams)) }
                li { a href="#more" { (TRADEOFFS) } (drawings(&report.tradeoffs)) }
            }
        }
    }
}

fn passage(Passage { title, lines, table }: &Passage) -> Markup {
    html! {
        h3 { (title) }
        ul { @for line in lines { li { (line) } } }
        @if let Some(table) = table { (grid(table)) }
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

/// Whether a column holds words, which are aligned left. Numbers are aligned right.
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
