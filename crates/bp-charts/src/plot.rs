//! Points and lines between two numeric axes.

use plotters::style::text_anchor::HPos;

use crate::{
    Axis, Error, Key, Level, Line, Series, Value,
    axis::Scale,
    canvas::{At, Canvas, Drawn, GRID, INK, MARGIN, ROW, TEXT_SIZE, WIDTH, text, widest},
    data::entries,
    number::in_full,
    sheet::{Parts, Room, Sheet},
    style::{MARKER_UNIT, colour, draw_line, draw_marker, draw_path, draw_whisker},
};

/// A plot: points and lines between two numeric axes.
#[derive(Clone, Debug)]
pub struct Plot {
    /// The heading. The ids in the SVG derive from it, so all charts of a page need different headings.
    pub title: String,
    /// A description of the chart for screen readers.
    pub description: String,
    /// The horizontal axis. Its name is written below it.
    pub x: Axis,
    /// The vertical axis. Its name is written above it.
    pub y: Axis,
    /// Values to compare with.
    pub levels: Vec<Level>,
    /// The entries of the legend besides the levels. If empty, the legend lists the series.
    pub keys: Vec<Key>,
    /// The series, in the order in which they are drawn.
    pub series: Vec<Series<Point>>,
}

/// A point and its intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: Value,
    /// Along the vertical axis.
    pub y: Value,
}

impl Point {
    /// A point. A plain number has no interval.
    pub fn new(x: impl Into<Value>, y: impl Into<Value>) -> Self {
        Self { x: x.into(), y: y.into() }
    }
}

/// The plot's right edge, which leaves room for half of the last tick's number.
const RIGHT: f64 = WIDTH - 2.0 * MARGIN;

impl Plot {
    /// The chart as an SVG element.
    ///
    /// # Errors
    ///
    /// When the drawing library fails.
    pub fn svg(&self) -> Result<String, Error> {
        let points: Vec<Point> = self.series.iter().flat_map(|series| self.points(series)).collect();
        let ends = |of: fn(&Point) -> Value| {
            let values = points.iter().map(of).flat_map(|Value { value, low, high }| [value, low, high]);
            values.collect::<Vec<f64>>()
        };
        let levels = self.levels.iter().map(|level| level.value).filter(|_| !points.is_empty());
        let x = self.x.scale(ends(|point| point.x));
        let parts = Parts {
            title: &self.title,
            description: &self.description,
            axis: &self.y,
            scale: self.y.scale(ends(|point| point.y).into_iter().chain(levels)),
            levels: &self.levels,
            entries: entries(&self.keys, self.series.iter()),
        };
        // Two rows below the plot: the numbers of the horizontal axis, and its name.
        let sheet = Sheet::new(parts, Room { right: RIGHT, plot_height: 380.0 }, |_| 2);
        let places = Places { sheet: &sheet, x };
        sheet.svg(|canvas| places.draw_axes(canvas, &self.x), |canvas| self.draw_values(canvas, &places))
    }

    /// The points of a series that the axes can show.
    fn points(&self, series: &Series<Point>) -> impl Iterator<Item = Point> {
        let shown = |point: &&Point| self.x.shows(point.x.value) && self.y.shows(point.y.value);
        series.points.iter().filter(shown).copied()
    }

    fn draw_values(&self, canvas: &Canvas<'_>, places: &Places<'_>) -> Drawn {
        for series in &self.series {
            let path: Vec<At> = self.points(series).map(|point| places.at(&point)).collect();
            let path = if series.style.line == Some(Line::Stairs) { places.stairs(&path) } else { path };
            if path.len() > 1 {
                draw_line(canvas, path, series.style)?;
            }
            for point in self.points(series) {
                if series.style.marker.is_some() {
                    places.draw_whiskers(canvas, &point, series.style.colour)?;
                }
                draw_marker(canvas, places.at(&point), series.style, MARKER_UNIT)?;
            }
        }
        Ok(())
    }
}

/// The positions of values, in pixels.
struct Places<'a> {
    sheet: &'a Sheet<'a>,
    /// `None` if there are no values.
    x: Option<Scale>,
}

impl Places<'_> {
    fn x(&self, value: f64) -> f64 {
        let fraction = self.x.as_ref().map_or(0.0, |scale| scale.fraction(value));
        self.sheet.left + (self.sheet.right - self.sheet.left) * fraction
    }

    fn at(&self, point: &Point) -> At {
        (self.x(point.x.value), self.sheet.y(point.y.value))
    }

    /// The path of stairs through some points, from the plot's top to its right edge.
    fn stairs(&self, points: &[At]) -> Vec<At> {
        let mut path = Vec::new();
        let mut y = self.sheet.top;
        for &(x, next) in points {
            path.extend([(x, y), (x, next)]);
            y = next;
        }
        path.extend(points.last().map(|&(_, y)| (self.sheet.right, y)));
        path
    }

    /// Draws the frame, and the horizontal axis with its ticks and its name.
    fn draw_axes(&self, canvas: &Canvas<'_>, axis: &Axis) -> Drawn {
        let Sheet { left, right, top, bottom, .. } = *self.sheet;
        // A tick whose number would touch the one before it has a line only.
        let mut free = 0.0;
        for &tick in self.x.iter().flat_map(|scale| &scale.ticks) {
            let (x, name) = (self.x(tick), in_full(tick));
            let half = widest([&name]) / 2.0;
            draw_path(canvas, &[(x, top), (x, bottom)], GRID)?;
            if x - half >= free {
                text(canvas, (x, bottom + 0.7 * ROW), &name, TEXT_SIZE, HPos::Center)?;
                free = x + half + 8.0;
            }
        }
        draw_path(canvas, &[(left, top), (left, bottom), (right, bottom)], INK)?;
        text(canvas, (f64::midpoint(left, right), bottom + 1.7 * ROW), &axis.label(), TEXT_SIZE, HPos::Center)
    }

    /// Draws those intervals of a point that are longer than a pixel.
    fn draw_whiskers(&self, canvas: &Canvas<'_>, point: &Point, number: usize) -> Drawn {
        let (x, y) = self.at(point);
        let (left, right) = (self.x(point.x.low), self.x(point.x.high));
        let (low, high) = (self.sheet.y(point.y.low), self.sheet.y(point.y.high));
        if right - left > 1.0 {
            draw_whisker(canvas, [(left, y), (right, y)], colour(number))?;
        }
        if low - high > 1.0 {
            draw_whisker(canvas, [(x, low), (x, high)], colour(number))?;
        }
        Ok(())
    }
}
