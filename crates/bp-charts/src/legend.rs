//! The legend below the plot.

use plotters::style::text_anchor::HPos;

use crate::{
    Level, Style,
    canvas::{Canvas, Drawn, ROW, TEXT_SIZE, text, widest},
    style::{MARKER_UNIT, draw_dashes, draw_line, draw_marker},
};

/// The marker or line that stands for an entry.
pub(crate) enum Look<'a> {
    Of(Style),
    Level(&'a Level),
}

/// Entries in columns of one width.
pub(crate) struct Legend<'a> {
    entries: Vec<(&'a str, Look<'a>)>,
    /// The width of an entry.
    entry: f64,
    pub(crate) rows: usize,
}

impl<'a> Legend<'a> {
    /// Lays out these entries within a width.
    pub(crate) fn new(entries: impl IntoIterator<Item = (&'a str, Look<'a>)>, width: f64) -> Self {
        let entries: Vec<_> = entries.into_iter().collect();
        let entry = widest(entries.iter().map(|(name, _)| name)) + 50.0;
        let rows = entries.len().div_ceil(((width / entry) as usize).max(1)).max(1);
        Self { entries, entry, rows }
    }

    /// Draws it with its upper left corner here.
    pub(crate) fn draw(&self, canvas: &Canvas<'_>, (left, top): (f64, f64)) -> Drawn {
        let columns = self.entries.len().div_ceil(self.rows);
        for (place, (name, key)) in self.entries.iter().enumerate() {
            let x = left + self.entry * (place % columns) as f64;
            let y = top + ROW * ((place / columns) as f64 + 0.5);
            match key {
                Look::Level(level) => draw_dashes(canvas, x, x + 24.0, y, level.line_colour())?,
                Look::Of(style) => {
                    draw_line(canvas, vec![(x, y), (x + 24.0, y)], *style)?;
                    draw_marker(canvas, (x + 12.0, y), *style, MARKER_UNIT)?;
                }
            }
            text(canvas, (x + 30.0, y), name, TEXT_SIZE, HPos::Left)?;
        }
        Ok(())
    }
}
