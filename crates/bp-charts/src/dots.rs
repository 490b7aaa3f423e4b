//! Dot charts: markers side by side in categories.

use plotters::{prelude::*, style::text_anchor::HPos};

use crate::{
    Axis, Error, Key, Level, Series, Style, Value,
    canvas::{Canvas, Drawn, INK, MARGIN, ROW, TEXT_SIZE, WIDTH, text, widest},
    data::entries,
    sheet::{Parts, Room, Sheet},
    style::{MARKER_UNIT, colour, draw_marker, draw_path, draw_whisker},
};

/// A dot chart: categories from left to right, with one marker for each series in each category.
#[derive(Clone, Debug)]
pub struct DotChart {
    /// The heading. The ids in the SVG derive from it, so all charts of a page need different headings.
    pub title: String,
    /// A description of the chart for screen readers.
    pub description: String,
    /// The vertical axis. Its name is written above it.
    pub axis: Axis,
    /// Values to compare with.
    pub levels: Vec<Level>,
    /// The entries of the legend besides the levels. If empty, the legend lists the series.
    pub keys: Vec<Key>,
    /// The names along the horizontal axis.
    pub categories: Vec<String>,
    /// Groups of series, from left to right within each category, with a gap between groups. A series has one point for
    /// each category, or `None` if it has no value there. Lines are not drawn.
    pub groups: Vec<Vec<Series<Option<Value>>>>,
}

const RIGHT: f64 = WIDTH - MARGIN;
const BAND: RGBColor = RGBColor(246, 246, 246);

/// The gap between groups, in places of a marker.
const GAP: f64 = 0.8;

impl DotChart {
    /// The chart as an SVG element.
    ///
    /// # Errors
    ///
    /// When the drawing library fails.
    pub fn svg(&self) -> Result<String, Error> {
        let sheet = self.sheet();
        sheet.svg(|canvas| self.draw_categories(canvas, &sheet), |canvas| self.draw_values(canvas, &sheet))
    }

    /// All series, from left to right.
    pub fn series(&self) -> impl Iterator<Item = &Series<Option<Value>>> {
        self.groups.iter().flatten()
    }

    fn sheet(&self) -> Sheet<'_> {
        let values = self.series().flat_map(|series| self.points(series));
        let ends: Vec<f64> = values.flat_map(|(_, Value { value, low, high })| [value, low, high]).collect();
        let levels = self.levels.iter().map(|level| level.value).filter(|_| !ends.is_empty());
        let parts = Parts {
            title: &self.title,
            description: &self.description,
            axis: &self.axis,
            scale: self.axis.scale(ends.iter().copied().chain(levels)),
            levels: &self.levels,
            entries: entries(&self.keys, self.series()),
        };
        Sheet::new(parts, Room { right: RIGHT, plot_height: 260.0 }, |left| self.name_rows(left))
    }

    /// The points of a series that the axis can show, with the number of their category.
    fn points(&self, series: &Series<Option<Value>>) -> impl Iterator<Item = (usize, Value)> {
        let points = series.points.iter().take(self.categories.len()).enumerate();
        points.filter_map(|(category, point)| Some((category, point.filter(|point| self.axis.shows(point.value))?)))
    }

    /// The width of a category.
    fn slot(&self, left: f64) -> f64 {
        (RIGHT - left) / self.categories.len().max(1) as f64
    }

    /// The number of rows for the names of categories. Several rows take turns if the names are too wide for one.
    fn name_rows(&self, left: f64) -> usize {
        ((widest(&self.categories) + 8.0) / self.slot(left)).ceil() as usize
    }

    /// Draws the bands that separate the categories, and their names below.
    fn draw_categories(&self, canvas: &Canvas<'_>, sheet: &Sheet<'_>) -> Drawn {
        let (slot, rows) = (self.slot(sheet.left), self.name_rows(sheet.left));
        for (place, name) in self.categories.iter().enumerate() {
            let (left, right) = (sheet.left + slot * place as f64, sheet.left + slot * (place + 1) as f64);
            if place % 2 == 0 {
                canvas.draw(&Rectangle::new([(left, sheet.top), (right, sheet.bottom)], BAND.filled()))?;
            }
            let y = sheet.bottom + ROW * ((place % rows.max(1)) as f64 + 0.7);
            text(canvas, (f64::midpoint(left, right), y), name, TEXT_SIZE, HPos::Center)?;
        }
        draw_path(canvas, &[(sheet.left, sheet.bottom), (RIGHT, sheet.bottom)], INK)
    }

    fn draw_values(&self, canvas: &Canvas<'_>, sheet: &Sheet<'_>) -> Drawn {
        // A few markers stay together in the middle of their category; many leave a gap to the next category.
        let gaps = GAP * self.groups.len().saturating_sub(1) as f64;
        let last = self.series().count() as f64 + gaps - 1.0;
        let slot = self.slot(sheet.left);
        let step = slot * (0.9 / (last + 1.0)).min(0.15);
        let mut place = -last / 2.0;
        for group in &self.groups {
            for series in group {
                for (category, value) in self.points(series) {
                    let x = sheet.left + slot * (category as f64 + 0.5) + step * place;
                    draw_value(canvas, sheet, (x, value), series.style, MARKER_UNIT.min(0.5 * step))?;
                }
                place += 1.0;
            }
            place += GAP;
        }
        Ok(())
    }
}

/// Draws a marker at column `x`, and the whisker of its interval.
fn draw_value(canvas: &Canvas<'_>, sheet: &Sheet<'_>, (x, value): (f64, Value), style: Style, unit: f64) -> Drawn {
    let Value { value, low, high } = value;
    if high > low {
        draw_whisker(canvas, [(x, sheet.y(low)), (x, sheet.y(high))], colour(style.colour))?;
    }
    draw_marker(canvas, (x, sheet.y(value)), style, unit)
}
