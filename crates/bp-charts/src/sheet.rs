//! The sheet: the parts that both kinds of charts share, which are the heading, the vertical axis and the legend.

use plotters::{prelude::*, style::text_anchor::HPos};

use crate::{
    Axis, Error, Level, Style,
    axis::Scale,
    canvas::{Canvas, Drawn, FINE, GRID, INK, MARGIN, ROW, TEXT_SIZE, WIDTH, lawful, text, widest},
    legend::{Legend, Look},
    number::in_full,
    style::{draw_dashes, draw_path},
};

/// The height of a sheet unless its parts need more.
const HEIGHT: f64 = 480.0;
const TITLE_SIZE: f64 = 17.0;

/// The parts of a sheet besides its values.
pub(crate) struct Parts<'a> {
    pub(crate) title: &'a str,
    pub(crate) description: &'a str,
    pub(crate) axis: &'a Axis,
    /// `None` if there are no values.
    pub(crate) scale: Option<Scale>,
    pub(crate) levels: &'a [Level],
    /// The entries of the legend besides the levels.
    pub(crate) entries: Vec<(&'a str, Style)>,
}

/// The room that a kind of chart needs.
pub(crate) struct Room {
    /// The plot's right edge.
    pub(crate) right: f64,
    /// The least height of the plot. A long legend makes the sheet grow instead.
    pub(crate) plot_height: f64,
}

/// A chart with the places of its parts, in pixels.
pub(crate) struct Sheet<'a> {
    parts: Parts<'a>,
    levels: Vec<&'a Level>,
    legend: Legend<'a>,
    /// The plot's edges.
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) top: f64,
    pub(crate) bottom: f64,
    /// Where the legend begins.
    legend_top: f64,
    height: f64,
}

impl<'a> Sheet<'a> {
    /// Lays out a chart. `rows` gives the number of rows of text right below the plot, given the plot's left edge.
    pub(crate) fn new(parts: Parts<'a>, Room { right, plot_height }: Room, rows: impl Fn(f64) -> usize) -> Self {
        let levels: Vec<_> = parts.levels.iter().filter(|level| parts.axis.shows(level.value)).collect();
        let left = MARGIN + widest(parts.scale.iter().flat_map(|scale| &scale.ticks).map(|&tick| in_full(tick))) + 8.0;
        let entries = parts.entries.iter().map(|&(name, style)| (name, Look::Of(style)));
        let entries = entries.chain(levels.iter().map(|&level| (level.name.as_str(), Look::Level(level))));
        let legend = Legend::new(entries, right - left);
        let top = MARGIN + 2.0 * ROW + 8.0;
        let rows = ROW * rows(left) as f64 + MARGIN;
        let below = rows + ROW * legend.rows as f64 + MARGIN;
        let height = HEIGHT.max(top + plot_height + below);
        let bottom = height - below;
        Self { parts, levels, legend, left, right, top, bottom, legend_top: bottom + rows, height }
    }

    /// The chart as SVG. `draw` draws the parts that depend on the kind of chart. `values` draws the values over them.
    pub(crate) fn svg(
        &self,
        draw: impl FnOnce(&Canvas<'_>) -> Drawn,
        values: impl FnOnce(&Canvas<'_>) -> Drawn,
    ) -> Result<String, Error> {
        let (wide, high) = ((WIDTH * FINE) as u32, (self.height * FINE) as u32);
        let pixels = Cartesian2d::new(0.0..WIDTH, 0.0..self.height, (0..wide as i32, 0..high as i32));
        let mut drawn = String::new();
        let canvas = SVGBackend::with_string(&mut drawn, (wide, high)).into_drawing_area().apply_coord_spec(pixels);
        let done = self.draw(&canvas, draw, values);
        drop(canvas);
        done.map_err(|error| Error(format!("the chart cannot be drawn: {error}")))?;
        Ok(self.with_head(&drawn, (wide, high)))
    }

    /// Replaces plotters' head, which has no title and gives the chart's size in drawing units instead of pixels.
    fn with_head(&self, drawn: &str, (wide, high): (u32, u32)) -> String {
        let body = drawn.split_once('>').map_or("", |(_, body)| body);
        let Parts { title, description, .. } = self.parts;
        let id: String = title.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
        let escaped = |text: &str| lawful(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        let (title, description, height) = (escaped(title), escaped(description), self.height);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {wide} {high}\" \
             role=\"img\" aria-labelledby=\"chart-{id}-title chart-{id}-desc\">\n\
             <title id=\"chart-{id}-title\">{title}</title>\n<desc id=\"chart-{id}-desc\">{description}</desc>{body}"
        )
    }

    fn draw(
        &self,
        canvas: &Canvas<'_>,
        draw: impl FnOnce(&Canvas<'_>) -> Drawn,
        values: impl FnOnce(&Canvas<'_>) -> Drawn,
    ) -> Drawn {
        canvas.fill(&WHITE)?;
        self.draw_heading(canvas)?;
        draw(canvas)?;
        self.legend.draw(canvas, (self.left, self.legend_top))?;
        let Some(scale) = &self.parts.scale else {
            let middle = (f64::midpoint(self.left, self.right), f64::midpoint(self.top, self.bottom));
            return text(canvas, middle, "no values", TEXT_SIZE, HPos::Center);
        };
        self.draw_axis(canvas, &scale.ticks)?;
        values(canvas)
    }

    /// Draws the title and the name of the vertical axis. Long ones get a smaller size, so that they fit the width.
    fn draw_heading(&self, canvas: &Canvas<'_>) -> Drawn {
        let name = self.parts.axis.label();
        for (row, (line, size)) in [(self.parts.title, TITLE_SIZE), (&name, TEXT_SIZE)].into_iter().enumerate() {
            let fitting = (WIDTH - 2.0 * MARGIN) / (0.66 * line.chars().count() as f64);
            text(canvas, (MARGIN, MARGIN + ROW * (row as f64 + 0.4)), line, size.min(fitting), HPos::Left)?;
        }
        Ok(())
    }

    /// Draws the ticks of the vertical axis, and the levels.
    fn draw_axis(&self, canvas: &Canvas<'_>, ticks: &[f64]) -> Drawn {
        for &tick in ticks {
            let y = self.y(tick);
            draw_path(canvas, &[(self.left, y), (self.right, y)], if tick == 0.0 { INK } else { GRID })?;
            text(canvas, (self.left - 8.0, y), &in_full(tick), TEXT_SIZE, HPos::Right)?;
        }
        for level in &self.levels {
            draw_dashes(canvas, self.left, self.right, self.y(level.value), level.line_colour())?;
        }
        Ok(())
    }

    /// The distance of a value from the top.
    pub(crate) fn y(&self, value: f64) -> f64 {
        let fraction = self.parts.scale.as_ref().map_or(0.0, |scale| scale.fraction(value));
        self.bottom - (self.bottom - self.top) * fraction
    }
}
