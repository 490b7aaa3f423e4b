//! Tables in Markdown.

use super::tables::Table;
use crate::escape;

/// The lines of a table.
pub(super) fn grid(table: &Table) -> String {
    lines(&table.columns, &table.rows)
}

/// The lines of a table of these columns and rows.
pub fn lines(columns: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<_> = cells.iter().map(|cell| escape::markdown(cell)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rule = format!("|{}\n", "---|".repeat(columns.len()));
    line(columns) + &rule + &rows.iter().map(|row| line(row)).collect::<String>()
}
