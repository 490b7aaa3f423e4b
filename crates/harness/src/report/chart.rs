//! The one kind of chart in the report: markers side by side in each category, drawn as SVG text.

use std::f64::consts::TAU;

use plotters::{coord::types::RangedCoordf64, element::DashedPathElement, prelude::*, style::text_anchor::*};

use super::format;

/// Why a chart could not be drawn: the backend failed to write.
pub(crate) type ChartError = DrawingAreaErrorKind<std::io::Error>;

/// A dot chart: categories from left to right and, within each, one marker a series.
pub(crate) struct Chart {
    /// The heading; the ids in the SVG derive from it, so no two charts of a page may share it.
    pub(crate) title: String,
    /// What the chart shows, for those who cannot see it.
    pub(crate) description: String,
    /// What the values are, with their unit; stands above the axis.
    pub(crate) y_label: String,
    /// Whether the axis is logarithmic; one that is not starts at 0.
    pub(crate) logarithmic: bool,
    /// A value to compare with, drawn as a dashed line.
    pub(crate) reference: Option<f64>,
    /// The names along the x axis.
    pub(crate) categories: Vec<String>,
    /// The series, in the order of the markers and of the legend.
    pub(crate) series: Vec<Series>,
}

/// The values of one method, a marker each.
pub(crate) struct Series {
    /// The name in the legend.
    pub(crate) name: String,
    /// Whether the thesis printed the values: drawn hollow, ours are filled.
    pub(crate) printed: bool,
    /// Number of its colour and shape; a printed series may share that of ours.
    pub(crate) style: usize,
    /// One a category, `None` where there is no value.
    pub(crate) points: Vec<Option<Point>>,
}

/// A value and its interval, whose ends equal the value where there is none.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    pub(crate) value: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Chart {
    /// The chart as an SVG element, which scales with its page and is readable on a dark one.
    pub(crate) fn svg(&self) -> Result<String, ChartError> {
        let sheet = Sheet::new(self);
        let (height, wide, high) = (sheet.height, (WIDTH * FINE) as u32, (sheet.height * FINE) as u32);
        let pixels = Cartesian2d::new(0.0..WIDTH, 0.0..height, (0..wide as i32, 0..high as i32));
        let mut drawn = String::new();
        sheet.draw(&SVGBackend::with_string(&mut drawn, (wide, high)).into_drawing_area().apply_coord_spec(pixels))?;
        // Plotters' own head names nothing, and shows the chart in the size of the units that it is drawn in.
        let body = drawn.split_once('>').map_or("", |(_, body)| body);
        let id: String = self.title.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
        let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        let (title, description) = (escaped(&self.title), escaped(&self.description));
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {wide} {high}\" \
             role=\"img\" aria-labelledby=\"chart-{id}-title chart-{id}-desc\">\n\
             <title id=\"chart-{id}-title\">{title}</title>\n<desc id=\"chart-{id}-desc\">{description}</desc>{body}"
        ))
    }

    /// The series with their styles; after each 8, the same colours take the shapes that follow.
    fn styled(&self) -> impl Iterator<Item = Styled<'_>> {
        let style = |i: usize| (STYLES[i % STYLES.len()].0, STYLES[(i + i / STYLES.len()) % STYLES.len()].1);
        self.series.iter().map(move |series| (series, style(series.style)))
    }

    fn reference(&self) -> Option<f64> {
        self.reference.filter(|&value| self.shows(value))
    }

    /// The points of a series that the axis can show, with the number of their category.
    fn points(&self, series: &Series) -> impl Iterator<Item = (usize, Point)> {
        let points = series.points.iter().take(self.categories.len()).enumerate();
        points.filter_map(|(category, point)| point.filter(|p| self.shows(p.value)).map(|p| (category, p)))
    }

    /// Whether the axis can show a value; the bounds keep its labels short.
    fn shows(&self, value: f64) -> bool {
        value.abs() <= 1e15 && (!self.logarithmic || value >= 1e-6)
    }

    /// The axis over all values, their intervals and the reference; none where there are no values.
    fn axis(&self) -> Option<Axis> {
        let ends = self.series.iter().flat_map(|s| self.points(s)).flat_map(|(_, p)| [p.value, p.low, p.high]);
        let values: Vec<f64> = ends.filter(|&value| self.shows(value)).collect();
        let all = values.iter().copied().chain(self.reference());
        let (low, high) = all.fold((*values.first()?, *values.first()?), |(low, high), v| (low.min(v), high.max(v)));
        Some(Axis::new(self.logarithmic, low, high))
    }
}

/// The y axis: where it begins and ends, as heights, and the values of its grid lines.
struct Axis {
    logarithmic: bool,
    low: f64,
    high: f64,
    ticks: Vec<f64>,
}

impl Axis {
    fn new(logarithmic: bool, low: f64, high: f64) -> Self {
        let (low, high) = if logarithmic { (low.log10(), high.log10()) } else { (low.min(0.0), high.max(0.0)) };
        // One value alone has no span to take a share of.
        let margin = if high - low < 1e-9 { 1.0 } else { 0.06 * (high - low) };
        let (low, high) = (if logarithmic || low < 0.0 { low - margin } else { 0.0 }, high + margin);
        let ticks = if logarithmic { decade_ticks(low, high) } else { RangedCoordf64::from(low..high).key_points(7) };
        Self { logarithmic, low, high, ticks }
    }

    /// How far up the axis a value lies, from 0 to 1; what is beyond an end is put there.
    fn fraction(&self, value: f64) -> f64 {
        // No logarithm of a number below 0: it is not a number, and so would be the place.
        let height = if self.logarithmic { value.max(0.0).log10() } else { value };
        (height.clamp(self.low, self.high) - self.low) / (self.high - self.low)
    }
}

/// Ticks at 1, 2 and 5 times the powers of ten between two heights; at more or fewer digits where they are not 4 to 12,
/// and at equal steps where the range is too narrow for those.
fn decade_ticks(low: f64, high: f64) -> Vec<f64> {
    const DIGITS: [(&[f64], usize); 4] =
        [(&[1.0, 2.0, 5.0], 1), (&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0], 1), (&[1.0], 1), (&[1.0], 3)];
    let span = 10f64.powf(low)..10f64.powf(high);
    let choices = DIGITS.iter().map(|&(digits, every)| -> Vec<f64> {
        let powers = (-6..=15).step_by(every).map(|power| 10f64.powi(power));
        powers.flat_map(|power| digits.iter().map(move |digit| digit * power)).filter(|t| span.contains(t)).collect()
    });
    let even = || RangedCoordf64::from(span.clone()).key_points(7);
    choices.into_iter().find(|ticks| (4..=12).contains(&ticks.len())).unwrap_or_else(even)
}

/// A number in full, but for rounding errors, its thousands set apart by commas.
fn number(value: f64) -> String {
    let text = format::number(value, 9);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 480.0;
/// What a long legend leaves to the plot: the sheet grows instead.
const PLOT_HEIGHT: f64 = 260.0;
const MARGIN: f64 = 16.0;
const RIGHT: f64 = WIDTH - MARGIN;
/// The height of a row of text.
const ROW: f64 = 22.0;
const TEXT_SIZE: f64 = 14.0;
const TITLE_SIZE: f64 = 17.0;
/// The pixels of a marker's radius of 1 where there is room, as there is for 8 series in 6 categories.
const MARKER_UNIT: f64 = 4.8;

/// A chart with the places of its parts, in pixels.
struct Sheet<'a> {
    chart: &'a Chart,
    axis: Option<Axis>,
    /// What stands below the plot; the entry without a marker is that of the reference.
    legend: Vec<(String, Option<Styled<'a>>)>,
    legend_rows: usize,
    /// The width of a legend entry.
    entry: f64,
    /// Rows that the names of the categories take turns in, where they are too wide for one.
    name_rows: usize,
    /// The width of a category.
    slot: f64,
    left: f64,
    top: f64,
    bottom: f64,
    height: f64,
}

impl<'a> Sheet<'a> {
    fn new(chart: &'a Chart) -> Self {
        let axis = chart.axis();
        let reference = chart.reference().map(|value| (format!("reference: {}", number(value)), None));
        let legend: Vec<_> = chart.styled().map(|s| (s.0.name.clone(), Some(s))).chain(reference).collect();
        let left = MARGIN + widest(axis.iter().flat_map(|axis| &axis.ticks).map(|&tick| number(tick))) + 8.0;
        let slot = (RIGHT - left) / chart.categories.len().max(1) as f64;
        let name_rows = ((widest(&chart.categories) + 8.0) / slot).ceil() as usize;
        let entry = widest(legend.iter().map(|(name, _)| name)) + 50.0;
        let legend_rows = legend.len().div_ceil((((RIGHT - left) / entry) as usize).max(1)).max(1);
        let top = MARGIN + 2.0 * ROW + 8.0;
        let below = ROW * (name_rows + legend_rows) as f64 + 2.0 * MARGIN;
        let height = HEIGHT.max(top + PLOT_HEIGHT + below);
        let bottom = height - below;
        Self { chart, axis, legend, legend_rows, entry, name_rows, slot, left, top, bottom, height }
    }

    fn draw(&self, canvas: &Canvas) -> Drawn {
        canvas.fill(&WHITE)?;
        self.draw_heading(canvas)?;
        self.draw_categories(canvas)?;
        self.draw_legend(canvas)?;
        if let Some(axis) = &self.axis {
            return self.draw_values(canvas, axis);
        }
        let middle = (f64::midpoint(self.left, RIGHT), f64::midpoint(self.top, self.bottom));
        text(canvas, middle, "no values", TEXT_SIZE, HPos::Center)
    }

    /// The title and the name of the y axis; beyond 100 letters they grow smaller than the other texts.
    fn draw_heading(&self, canvas: &Canvas) -> Drawn {
        let scale = if self.chart.logarithmic { ", logarithmic axis" } else { "" };
        let y_label = format!("{}{scale}", self.chart.y_label);
        for (row, (line, size)) in [(&self.chart.title, TITLE_SIZE), (&y_label, TEXT_SIZE)].into_iter().enumerate() {
            let fitting = (RIGHT - MARGIN) / (0.66 * line.chars().count() as f64);
            text(canvas, (MARGIN, MARGIN + ROW * (row as f64 + 0.4)), line, size.min(fitting), HPos::Left)?;
        }
        Ok(())
    }

    /// The bands that tell the categories apart, and their names below.
    fn draw_categories(&self, canvas: &Canvas) -> Drawn {
        for (place, name) in self.chart.categories.iter().enumerate() {
            let (left, right) = (self.left + self.slot * place as f64, self.left + self.slot * (place + 1) as f64);
            if place % 2 == 0 {
                canvas.draw(&Rectangle::new([(left, self.top), (right, self.bottom)], BAND.filled()))?;
            }
            let y = self.bottom + ROW * ((place % self.name_rows.max(1)) as f64 + 0.7);
            text(canvas, (f64::midpoint(left, right), y), name, TEXT_SIZE, HPos::Center)?;
        }
        line(canvas, &[(self.left, self.bottom), (RIGHT, self.bottom)], INK)
    }

    fn draw_legend(&self, canvas: &Canvas) -> Drawn {
        let columns = self.legend.len().div_ceil(self.legend_rows);
        for (place, (name, styled)) in self.legend.iter().enumerate() {
            let x = self.left + self.entry * (place % columns) as f64;
            let y = self.bottom + MARGIN + ROW * ((self.name_rows + place / columns) as f64 + 0.5);
            match styled {
                Some(styled) => marker(canvas, (x + 12.0, y), *styled, MARKER_UNIT)?,
                None => dashes(canvas, x, x + 24.0, y)?,
            }
            text(canvas, (x + 30.0, y), name, TEXT_SIZE, HPos::Left)?;
        }
        Ok(())
    }

    fn draw_values(&self, canvas: &Canvas, axis: &Axis) -> Drawn {
        let y = |value| self.bottom - (self.bottom - self.top) * axis.fraction(value);
        for &tick in &axis.ticks {
            line(canvas, &[(self.left, y(tick)), (RIGHT, y(tick))], if tick == 0.0 { INK } else { GRID })?;
            text(canvas, (self.left - 8.0, y(tick)), &number(tick), TEXT_SIZE, HPos::Right)?;
        }
        if let Some(reference) = self.chart.reference() {
            dashes(canvas, self.left, RIGHT, y(reference))?;
        }
        // Few markers stay together in the middle of their category, many leave a gap to the next one.
        let count = self.chart.series.len() as f64;
        let step = self.slot * (0.84 / count).min(0.15);
        for (place, (series, style)) in self.chart.styled().enumerate() {
            for (category, point) in self.chart.points(series) {
                let x = self.left + self.slot * (category as f64 + 0.5) + step * (place as f64 - (count - 1.0) / 2.0);
                if point.high > point.low {
                    let (left, right, low, high) = (x - 3.0, x + 3.0, y(point.low), y(point.high));
                    let whisker = [(left, low), (right, low), (x, low), (x, high), (left, high), (right, high)];
                    line(canvas, &whisker, style.0)?;
                }
                marker(canvas, (x, y(point.value)), (series, style), MARKER_UNIT.min(0.38 * step))?;
            }
        }
        Ok(())
    }
}

/// A colour and the outline of a marker: its number of equal arms and the corners of the first of them, as degrees
/// (clockwise from the right) and radii.
type Style = (RGBColor, (u32, &'static [At]));
type Styled<'a> = (&'a Series, Style);

/// The colours of Okabe and Ito, which the colour-blind tell apart, with grey for yellow, too pale on white; and
/// shapes of about one area: circle, square, triangle, diamond, plus, triangle downwards, cross and star.
const STYLES: [Style; 8] = [
    (RGBColor(0, 114, 178), (24, &[(0.0, 1.0)])),
    (RGBColor(213, 94, 0), (4, &[(45.0, 1.25)])),
    (RGBColor(0, 158, 115), (3, &[(-90.0, 1.5)])),
    (RGBColor(204, 121, 167), (4, &[(0.0, 1.4)])),
    (RGBColor(0, 0, 0), (4, &[(-18.0, 1.4), (18.0, 1.4), (45.0, 0.61)])),
    (RGBColor(230, 159, 0), (3, &[(90.0, 1.5)])),
    (RGBColor(86, 180, 233), (4, &[(27.0, 1.4), (63.0, 1.4), (90.0, 0.61)])),
    (RGBColor(153, 153, 153), (5, &[(-90.0, 1.6), (-54.0, 0.7)])),
];
const INK: RGBColor = RGBColor(34, 34, 34);
const GRID: RGBColor = RGBColor(222, 222, 222);
const BAND: RGBColor = RGBColor(246, 246, 246);

/// What plotters draws on, its coordinates being pixels.
type Canvas<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type At = (f64, f64);
type Drawn = Result<(), ChartError>;

/// The units of a pixel: plotters rounds to whole ones, and whole pixels would misshape the markers.
const FINE: f64 = 10.0;

fn line(canvas: &Canvas, points: &[At], colour: RGBColor) -> Drawn {
    canvas.draw(&PathElement::new(points, colour.stroke_width(15)))
}

/// The dashed line of the reference.
fn dashes(canvas: &Canvas, left: f64, right: f64, y: f64) -> Drawn {
    canvas.draw(&DashedPathElement::new([(left, y), (right, y)], 60, 40, INK.stroke_width(15)))
}

/// A marker, hollow where the thesis printed the values.
fn marker(canvas: &Canvas, (x, y): At, (series, (colour, (arms, corners))): Styled, unit: f64) -> Drawn {
    let corner = |arm: u32, (angle, radius): At| {
        let (sin, cos) = (angle.to_radians() + TAU * f64::from(arm) / f64::from(arms)).sin_cos();
        (x + unit * radius * cos, y + unit * radius * sin)
    };
    // One arm more than there are closes the line, with a join instead of two ends.
    let outline: Vec<At> = (0..=arms).flat_map(|arm| corners.iter().map(move |&c| corner(arm, c))).collect();
    canvas.draw(&Polygon::new(outline.as_slice(), if series.printed { WHITE } else { colour }))?;
    line(canvas, &outline, colour)
}

/// A text, bold where it is a title; the backend divides the size by 1.24.
fn text(canvas: &Canvas, at: At, text: &str, size: f64, align: HPos) -> Drawn {
    let weight = if size > TEXT_SIZE { FontStyle::Bold } else { FontStyle::Normal };
    let font = FontDesc::new(FontFamily::SansSerif, 1.24 * FINE * size, weight);
    canvas.draw(&Text::new(text, at, font.color(&INK).pos(Pos::new(align, VPos::Center))))
}

/// The width of the widest text, about, in the widest fonts that a page may take for sans-serif.
fn widest(texts: impl IntoIterator<Item = impl AsRef<str>>) -> f64 {
    let letters = texts.into_iter().map(|text| text.as_ref().chars().count()).max().unwrap_or(0);
    0.62 * TEXT_SIZE * letters as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(logarithmic: bool, values: &[f64]) -> Chart {
        let points =
            values.iter().map(|&value| Some(Point { value, low: 0.9 * value, high: 1.1 * value })).chain([None]);
        let series =
            |name: &str, printed| Series { name: name.into(), printed, style: 0, points: points.clone().collect() };
        Chart {
            title: "Speed & <memory>".into(),
            description: "\"All\" > none".into(),
            y_label: "seconds < minutes".into(),
            logarithmic,
            reference: Some(1.0),
            categories: ["Baby1", "Aloe", "Cloth1", "Flowerpots", "Bowling2", "Books"].map(String::from).into(),
            series: vec![series("a&b", false), series("printed", true)],
        }
    }

    /// The SVG, every tag of which must be closed, and every number a number.
    fn well_formed(chart: &Chart) -> String {
        let (svg, mut open) = (chart.svg().unwrap(), Vec::new());
        for tag in svg.split('<').skip(1).map(|part| part.split_once('>').unwrap().0) {
            match tag.strip_prefix('/') {
                Some(name) => assert_eq!(open.pop(), Some(name)),
                None => open.extend(tag.split_whitespace().next().filter(|_| !tag.ends_with('/'))),
            }
        }
        assert!(open.is_empty() && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        svg
    }

    #[test]
    fn every_series_and_category_is_named() {
        let chart = chart(true, &[0.5, 2.0, 1500.0]);
        let svg = well_formed(&chart);
        for name in chart.categories.iter().map(String::as_str).chain(["a&amp;b", "printed", "reference: 1", "1,000"]) {
            assert!(svg.contains(&format!(">\n{name}\n<")), "{name} is missing from {svg}");
        }
    }

    #[test]
    fn odd_values_are_drawn_or_skipped() {
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE];
        let cases: [&[f64]; 7] = [&[], &[3.0; 9], &[0.0; 6], &[0.0, 1e-6, 1e15], &odd, &[-2.0], &[1.0, 1.0 + 1e-15]];
        for (values, logarithmic) in cases.iter().flat_map(|values| [(values, false), (values, true)]) {
            let chart = Chart { reference: values.first().copied(), ..chart(logarithmic, values) };
            let drawn = values.iter().any(|&value| chart.shows(value));
            assert_eq!(well_formed(&chart).contains("no values"), !drawn, "{values:?}");
        }
        well_formed(&Chart { categories: vec![], ..chart(true, &[1.0]) });
        well_formed(&Chart { series: vec![], title: String::new(), ..chart(false, &[1.0]) });
    }

    #[test]
    fn the_head_is_escaped_and_labelled() {
        let svg = well_formed(&chart(false, &[1.0]));
        assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"900\" height=\"480\" viewBox=\""));
        assert!(svg.contains("aria-labelledby=\"chart-Speed----memory--title chart-Speed----memory--desc\">\n<title"));
        assert!(svg.contains(">Speed &amp; &lt;memory&gt;</title>") && svg.contains("\"All\" &gt; none</desc>"));
    }
}
