//! Charts of points and lines, drawn as SVG text in the style of the report of `bp reproduce`.

use std::f64::consts::TAU;

use plotters::{coord::types::RangedCoordf64, element::DashedPathElement, prelude::*, style::text_anchor::*};

use crate::report::number;

/// Why a chart could not be drawn: the backend failed to write.
pub(crate) type ChartError = DrawingAreaErrorKind<std::io::Error>;

/// Values against values.
pub(crate) struct Chart {
    /// The heading.
    pub(crate) title: String,
    /// What the chart shows, for those who cannot see it.
    pub(crate) description: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    /// In the order of the legend.
    pub(crate) series: Vec<Series>,
}

/// An axis.
pub(crate) struct Axis {
    /// What the values are, with their unit.
    pub(crate) name: &'static str,
    /// One that is not starts at 0.
    pub(crate) logarithmic: bool,
    /// The values that are marked; none to choose them.
    pub(crate) ticks: Vec<f64>,
}

/// How a series is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    Points,
    Line,
    Dashes,
    Dots,
    /// Points and a line.
    Both,
}

/// Some points of one name.
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) mark: Mark,
    /// Number of its colour and shape.
    pub(crate) style: usize,
    /// x, y, and the ends of y's interval.
    pub(crate) points: Vec<[f64; 4]>,
}

const WIDTH: f64 = 900.0;
const PLOT_HEIGHT: f64 = 380.0;
const MARGIN: f64 = 16.0;
const RIGHT: f64 = WIDTH - 2.0 * MARGIN;
/// The height of a row of text.
const ROW: f64 = 22.0;
const TEXT_SIZE: f64 = 14.0;
const TITLE_SIZE: f64 = 17.0;
/// The pixels of a marker's radius of 1.
const MARKER_UNIT: f64 = 4.8;
/// The units of a pixel: plotters rounds to whole ones.
const FINE: f64 = 10.0;
const TOP: f64 = MARGIN + 2.0 * ROW + 8.0;
const BOTTOM: f64 = TOP + PLOT_HEIGHT;

/// The colours of Okabe and Ito, with grey for yellow, which is too pale on white.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(153, 153, 153),
];
/// Corners of regular markers: how many, the first one's angle in degrees, and the radius.
const SHAPES: [(u32, f64, f64); 4] = [(24, 0.0, 1.0), (4, 45.0, 1.25), (3, -90.0, 1.5), (4, 0.0, 1.4)];
const INK: RGBColor = RGBColor(34, 34, 34);
const GRID: RGBColor = RGBColor(222, 222, 222);

/// What plotters draws on, its coordinates being pixels.
type Canvas<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type At = (f64, f64);
type Drawn = Result<(), ChartError>;

impl Chart {
    /// The chart as an SVG element.
    pub(crate) fn svg(&self) -> Result<String, ChartError> {
        let sheet = Sheet::new(self);
        let (height, wide, high) = (sheet.height, (WIDTH * FINE) as u32, (sheet.height * FINE) as u32);
        let pixels = Cartesian2d::new(0.0..WIDTH, 0.0..height, (0..wide as i32, 0..high as i32));
        let mut drawn = String::new();
        sheet.draw(&SVGBackend::with_string(&mut drawn, (wide, high)).into_drawing_area().apply_coord_spec(pixels))?;
        let body = drawn.split_once('>').map_or("", |(_, body)| body);
        let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        let (title, description) = (escaped(&self.title), escaped(&self.description));
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
             viewBox=\"0 0 {wide} {high}\" role=\"img\">\n<title>{title}</title>\n<desc>{description}</desc>{body}"
        ))
    }
}

/// A scale from values to pixels.
struct Scale {
    logarithmic: bool,
    /// Ends of the axis, as heights, and where they lie.
    ends: [f64; 2],
    pixels: [f64; 2],
    ticks: Vec<f64>,
}

impl Scale {
    fn new(axis: &Axis, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let height = |value: f64| if axis.logarithmic { value.log10() } else { value };
        let values = values.filter(|value| value.is_finite() && (!axis.logarithmic || *value > 0.0)).map(height);
        let (mut low, mut high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        low = if axis.logarithmic { low } else { low.min(0.0) };
        let margin = (0.05 * (high - low)).max(0.02);
        let ends = [if axis.logarithmic { low - margin } else { low }, high + margin];
        let mut scale = Self { logarithmic: axis.logarithmic, ends, pixels, ticks: vec![] };
        scale.ticks = if axis.ticks.is_empty() { scale.chosen() } else { axis.ticks.clone() };
        scale
    }

    /// Round values: powers of ten, with 2 and 5 times them where those are few.
    fn chosen(&self) -> Vec<f64> {
        let [low, high] = self.ends;
        if !self.logarithmic {
            return RangedCoordf64::from(low..high).key_points(7);
        }
        let digits: &[f64] = if high - low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let powers = low.floor() as i32..=high.ceil() as i32;
        let ticks = powers.flat_map(|power| digits.iter().map(move |digit| digit * 10_f64.powi(power)));
        ticks.filter(|tick| (low..=high).contains(&tick.log10())).collect()
    }

    fn at(&self, value: f64) -> f64 {
        let height = if self.logarithmic { value.max(f64::MIN_POSITIVE).log10() } else { value };
        let fraction = (height.clamp(self.ends[0], self.ends[1]) - self.ends[0]) / (self.ends[1] - self.ends[0]);
        self.pixels[0] + fraction * (self.pixels[1] - self.pixels[0])
    }
}

/// A chart with the places of its parts, in pixels.
struct Sheet<'a> {
    chart: &'a Chart,
    x: Scale,
    y: Scale,
    left: f64,
    columns: usize,
    entry: f64,
    height: f64,
}

impl<'a> Sheet<'a> {
    fn new(chart: &'a Chart) -> Self {
        let points = || chart.series.iter().flat_map(|series| &series.points);
        let y = Scale::new(&chart.y, points().flat_map(|&[_, y, low, high]| [y, low, high]), [BOTTOM, TOP]);
        let left = MARGIN + widest(y.ticks.iter().map(|&tick| number(tick))) + 8.0;
        let x = Scale::new(&chart.x, points().map(|point| point[0]), [left, RIGHT]);
        let entry = widest(chart.series.iter().map(|series| &series.name)) + 50.0;
        let columns = (((RIGHT - left) / entry) as usize).max(1);
        let rows = chart.series.len().div_ceil(columns);
        let height = BOTTOM + (2.0 + rows as f64) * ROW + 2.0 * MARGIN;
        Self { chart, x, y, left, columns, entry, height }
    }

    fn draw(&self, canvas: &Canvas) -> Drawn {
        canvas.fill(&WHITE)?;
        self.draw_axes(canvas)?;
        for series in &self.chart.series {
            self.draw_series(canvas, series)?;
        }
        self.draw_legend(canvas)
    }

    fn draw_axes(&self, canvas: &Canvas) -> Drawn {
        let named = |axis: &Axis| format!("{}{}", axis.name, if axis.logarithmic { ", logarithmic axis" } else { "" });
        text(canvas, (MARGIN, MARGIN + 0.4 * ROW), &self.chart.title, TITLE_SIZE, HPos::Left)?;
        text(canvas, (MARGIN, MARGIN + 1.4 * ROW), &named(&self.chart.y), TEXT_SIZE, HPos::Left)?;
        for &tick in &self.y.ticks {
            let y = self.y.at(tick);
            line(canvas, &[(self.left, y), (RIGHT, y)], GRID)?;
            text(canvas, (self.left - 8.0, y), &number(tick), TEXT_SIZE, HPos::Right)?;
        }
        for &tick in &self.x.ticks {
            let x = self.x.at(tick);
            line(canvas, &[(x, TOP), (x, BOTTOM)], GRID)?;
            text(canvas, (x, BOTTOM + 0.7 * ROW), &number(tick), TEXT_SIZE, HPos::Center)?;
        }
        line(canvas, &[(self.left, TOP), (self.left, BOTTOM), (RIGHT, BOTTOM)], INK)?;
        let middle = f64::midpoint(self.left, RIGHT);
        text(canvas, (middle, BOTTOM + 1.7 * ROW), &named(&self.chart.x), TEXT_SIZE, HPos::Center)
    }

    fn draw_series(&self, canvas: &Canvas, series: &Series) -> Drawn {
        let at = |&[x, y, ..]: &[f64; 4]| (self.x.at(x), self.y.at(y));
        let path: Vec<At> = series.points.iter().map(at).collect();
        stroke(canvas, &path, series)?;
        if !matches!(series.mark, Mark::Points | Mark::Both) {
            return Ok(());
        }
        for (&place, &[.., low, high]) in path.iter().zip(&series.points) {
            let (low, high) = (self.y.at(low), self.y.at(high));
            if low - high > 1.0 {
                let (left, middle, right) = (place.0 - 3.0, place.0, place.0 + 3.0);
                let whisker = [(left, low), (right, low), (middle, low), (middle, high), (left, high), (right, high)];
                line(canvas, &whisker, colour(series.style))?;
            }
            marker(canvas, place, series.style)?;
        }
        Ok(())
    }

    fn draw_legend(&self, canvas: &Canvas) -> Drawn {
        for (index, series) in self.chart.series.iter().enumerate() {
            let x = self.left + self.entry * (index % self.columns) as f64;
            let y = BOTTOM + 2.0 * ROW + MARGIN + ROW * ((index / self.columns) as f64 + 0.5);
            stroke(canvas, &[(x, y), (x + 28.0, y)], series)?;
            if matches!(series.mark, Mark::Points | Mark::Both) {
                marker(canvas, (x + 14.0, y), series.style)?;
            }
            text(canvas, (x + 34.0, y), &series.name, TEXT_SIZE, HPos::Left)?;
        }
        Ok(())
    }
}

fn colour(style: usize) -> RGBColor {
    COLOURS[style % COLOURS.len()]
}

/// A path as a mark has it; nothing for points alone.
fn stroke(canvas: &Canvas, path: &[At], series: &Series) -> Drawn {
    let colour = colour(series.style);
    let dashed = |on, off| DashedPathElement::new(path.to_vec(), on, off, colour.stroke_width(20));
    match series.mark {
        Mark::Points => Ok(()),
        Mark::Line | Mark::Both => canvas.draw(&PathElement::new(path, colour.stroke_width(20))),
        Mark::Dashes => canvas.draw(&dashed(60, 40)),
        Mark::Dots => canvas.draw(&dashed(20, 40)),
    }
}

fn line(canvas: &Canvas, points: &[At], colour: RGBColor) -> Drawn {
    canvas.draw(&PathElement::new(points, colour.stroke_width(15)))
}

fn marker(canvas: &Canvas, (x, y): At, style: usize) -> Drawn {
    let (corners, first, radius) = SHAPES[style % SHAPES.len()];
    let corner = |i: u32| {
        let (sin, cos) = (first.to_radians() + TAU * f64::from(i) / f64::from(corners)).sin_cos();
        (x + MARKER_UNIT * radius * cos, y + MARKER_UNIT * radius * sin)
    };
    canvas.draw(&Polygon::new((0..corners).map(corner).collect::<Vec<_>>(), colour(style)))
}

/// A text, bold where it is a title; the backend divides the size by 1.24.
fn text(canvas: &Canvas, at: At, text: &str, size: f64, align: HPos) -> Drawn {
    let weight = if size > TEXT_SIZE { FontStyle::Bold } else { FontStyle::Normal };
    let font = FontDesc::new(FontFamily::SansSerif, 1.24 * FINE * size, weight);
    canvas.draw(&Text::new(text.to_owned(), at, font.color(&INK).pos(Pos::new(align, VPos::Center))))
}

/// The width of the widest text, about.
fn widest(texts: impl IntoIterator<Item = impl AsRef<str>>) -> f64 {
    let letters = texts.into_iter().map(|text| text.as_ref().chars().count()).max().unwrap_or(0);
    0.62 * TEXT_SIZE * letters as f64
}
