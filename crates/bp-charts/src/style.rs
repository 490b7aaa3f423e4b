//! Styles of series: colours, shapes of markers, and lines.

use std::f64::consts::TAU;

use plotters::{element::DashedPathElement, prelude::*};

use crate::canvas::{At, Canvas, Drawn, FINE};

/// The style of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// The number of its colour. After the last colour, the first follows.
    pub colour: usize,
    /// The marker at its points.
    pub marker: Option<Marker>,
    /// The line from one point of a plot to the next.
    pub line: Option<Line>,
}

/// The marker of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Marker {
    /// The number of its shape. After the last shape, the first follows.
    pub shape: usize,
    /// The look of its inside.
    pub fill: Fill,
}

/// The inside of a marker. No fill is opaque, so markers that coincide all show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// The colour of its outline.
    Solid,
    /// A tint of that colour.
    Pale,
    /// Nothing.
    Hollow,
}

impl Fill {
    fn opacity(self) -> f64 {
        match self {
            Self::Solid => 0.75,
            Self::Pale => 0.25,
            Self::Hollow => 0.0,
        }
    }
}

/// The line between points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A straight line.
    Solid,
    /// The same, dashed.
    Dashes,
    /// The same, dotted.
    Dots,
    /// From the plot's top down to the first point, right, down to the next, and from the last to the right edge. For
    /// any place above the stairs, a point exists that is at least as good in both values.
    Stairs,
}

impl Style {
    /// The marker of a number. It repeats only after many numbers: each further 8 numbers have the same colours, but
    /// other shapes.
    #[must_use]
    pub fn numbered(number: usize) -> Self {
        Self::marked(number, number + number / COLOURS.len())
    }

    /// A marker of this colour and shape.
    #[must_use]
    pub fn marked(colour: usize, shape: usize) -> Self {
        Self { colour, marker: Some(Marker { shape, fill: Fill::Solid }), line: None }
    }

    /// A line without markers.
    #[must_use]
    pub fn line(colour: usize, line: Line) -> Self {
        Self { colour, marker: None, line: Some(line) }
    }

    /// The same with another fill of its marker, if it has one.
    #[must_use]
    pub fn filled(self, fill: Fill) -> Self {
        Self { marker: self.marker.map(|marker| Marker { fill, ..marker }), ..self }
    }

    /// The same with a line.
    #[must_use]
    pub fn with_line(self, line: Line) -> Self {
        Self { line: Some(line), ..self }
    }
}

/// The colours of Okabe and Ito, which colour-blind people can tell apart. Grey replaces yellow, too pale on white.
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

/// The number of black, for things that belong to no series.
pub const BLACK: usize = 4;

/// The outline of a marker: its number of equal arms and the corners of the first of them, as degrees (clockwise from
/// the right) and radii.
type Shape = (u32, &'static [At]);

/// Shapes of about equal area: circle, square, triangle, diamond, plus, triangle downwards, cross, star, triangle to
/// the right, pentagon, triangle to the left, needle star, tall bar, wide bar and star of three arms.
const SHAPES: [Shape; 15] = [
    (24, &[(0.0, 1.0)]),
    (4, &[(45.0, 1.25)]),
    (3, &[(-90.0, 1.5)]),
    (4, &[(0.0, 1.4)]),
    (4, &[(-18.0, 1.4), (18.0, 1.4), (45.0, 0.61)]),
    (3, &[(90.0, 1.5)]),
    (4, &[(27.0, 1.4), (63.0, 1.4), (90.0, 0.61)]),
    (5, &[(-90.0, 1.6), (-54.0, 0.7)]),
    (3, &[(0.0, 1.5)]),
    (5, &[(90.0, 1.2)]),
    (3, &[(180.0, 1.5)]),
    (4, &[(0.0, 2.0), (45.0, 0.6)]),
    (2, &[(68.0, 1.7), (112.0, 1.7)]),
    (2, &[(-22.0, 1.7), (22.0, 1.7)]),
    (3, &[(-90.0, 2.0), (-30.0, 0.5)]),
];

/// The pixels per unit of a marker's radius, if there is room.
pub(crate) const MARKER_UNIT: f64 = 4.8;

/// The colour of a number.
pub(crate) fn colour(number: usize) -> RGBColor {
    COLOURS[number % COLOURS.len()]
}

/// Draws a series' marker, if it has one. A radius of 1 is `unit` pixels.
pub(crate) fn draw_marker(canvas: &Canvas<'_>, (x, y): At, style: Style, unit: f64) -> Drawn {
    let Some(Marker { shape, fill }) = style.marker else { return Ok(()) };
    let ((arms, corners), colour) = (SHAPES[shape % SHAPES.len()], colour(style.colour));
    let corner = |arm: u32, (angle, radius): At| {
        let (sin, cos) = (angle.to_radians() + TAU * f64::from(arm) / f64::from(arms)).sin_cos();
        (x + unit * radius * cos, y + unit * radius * sin)
    };
    // Repeating the first arm closes the outline with a join instead of two ends.
    let outline: Vec<At> = (0..=arms).flat_map(|arm| corners.iter().map(move |&c| corner(arm, c))).collect();
    canvas.draw(&Polygon::new(outline.as_slice(), colour.mix(fill.opacity())))?;
    // Small markers have a thinner outline, which would otherwise fill them.
    let width = f64::from(THIN) * (unit / MARKER_UNIT).min(1.0);
    canvas.draw(&PathElement::new(outline, colour.stroke_width(width as u32)))
}

/// Draws a series' line, if it has one, along a path.
pub(crate) fn draw_line(canvas: &Canvas<'_>, path: Vec<At>, style: Style) -> Drawn {
    let stroke = colour(style.colour).stroke_width(20);
    match style.line {
        None => Ok(()),
        Some(Line::Solid | Line::Stairs) => canvas.draw(&PathElement::new(path, stroke)),
        Some(Line::Dashes) => canvas.draw(&DashedPathElement::new(path, DASH, GAP, stroke)),
        Some(Line::Dots) => canvas.draw(&DashedPathElement::new(path, 20, GAP, stroke)),
    }
}

/// Draws a thin line, as used for whiskers and axes.
pub(crate) fn draw_path(canvas: &Canvas<'_>, points: &[At], colour: RGBColor) -> Drawn {
    canvas.draw(&PathElement::new(points, colour.stroke_width(THIN)))
}

/// Draws the whisker between the ends of an interval, which is horizontal or vertical.
pub(crate) fn draw_whisker(canvas: &Canvas<'_>, [from, to]: [At; 2], colour: RGBColor) -> Drawn {
    let (across, down) = if from.0 == to.0 { (3.0, 0.0) } else { (0.0, 3.0) };
    let cap = |(x, y): At| [(x - across, y - down), (x + across, y + down)];
    let ([a, b], [c, d]) = (cap(from), cap(to));
    draw_path(canvas, &[a, b, from, to, c, d], colour)
}

/// Draws a thin dashed line from left to right.
pub(crate) fn draw_dashes(canvas: &Canvas<'_>, left: f64, right: f64, y: f64, colour: RGBColor) -> Drawn {
    canvas.draw(&DashedPathElement::new([(left, y), (right, y)], DASH, GAP, colour.stroke_width(THIN)))
}

/// Width of thin lines.
const THIN: u32 = 15;

/// Lengths of dashes and of the gaps between them.
const DASH: u32 = 6 * FINE as u32;
const GAP: u32 = 4 * FINE as u32;
