//! The canvas of charts, and text on it.

use plotters::{
    coord::types::RangedCoordf64,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

/// The canvas that plotters draws on. Its coordinates are pixels.
pub(crate) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(crate) type At = (f64, f64);
pub(crate) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The number of units in a pixel. Plotters rounds to whole units, and whole pixels would distort the markers.
pub(crate) const FINE: f64 = 10.0;
pub(crate) const WIDTH: f64 = 900.0;
pub(crate) const MARGIN: f64 = 16.0;
/// The height of a row of text.
pub(crate) const ROW: f64 = 22.0;
pub(crate) const TEXT_SIZE: f64 = 14.0;
pub(crate) const INK: RGBColor = RGBColor(34, 34, 34);
pub(crate) const GRID: RGBColor = RGBColor(222, 222, 222);

/// Draws a text; a title is bold. The backend divides the size by 1.24.
pub(crate) fn text(canvas: &Canvas<'_>, at: At, text: &str, size: f64, align: HPos) -> Drawn {
    let weight = if size > TEXT_SIZE { FontStyle::Bold } else { FontStyle::Normal };
    let font = FontDesc::new(FontFamily::SansSerif, 1.24 * FINE * size, weight);
    canvas.draw(&Text::new(lawful(text), at, font.color(&INK).pos(Pos::new(align, VPos::Center))))
}

/// Replaces characters that SVG cannot contain. Names may come from any file.
pub(crate) fn lawful(text: &str) -> String {
    let is_lawful = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|c| if is_lawful(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

/// The approximate width of the widest text, in the widest of the usual sans-serif fonts.
pub(crate) fn widest(texts: impl IntoIterator<Item = impl AsRef<str>>) -> f64 {
    0.62 * TEXT_SIZE * letters(texts) as f64
}

/// The number of letters of the longest text.
pub(crate) fn letters(texts: impl IntoIterator<Item = impl AsRef<str>>) -> usize {
    texts.into_iter().map(|text| text.as_ref().chars().count()).max().unwrap_or(0)
}
