//! What charts are drawn on, and the texts on it.

use plotters::{
    coord::types::RangedCoordf64,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

/// What plotters draws on, its coordinates being pixels.
pub(crate) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(crate) type At = (f64, f64);
pub(crate) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The units of a pixel: plotters rounds to whole ones, and whole pixels would misshape the markers.
pub(crate) const FINE: f64 = 10.0;
pub(crate) const WIDTH: f64 = 900.0;
pub(crate) const MARGIN: f64 = 16.0;
/// The height of a row of text.
pub(crate) const ROW: f64 = 22.0;
pub(crate) const TEXT_SIZE: f64 = 14.0;
pub(crate) const INK: RGBColor = RGBColor(34, 34, 34);
pub(crate) const GRID: RGBColor = RGBColor(222, 222, 222);

/// A text, bold where it is a title; the backend divides the size by 1.24.
pub(crate) fn text(canvas: &Canvas<'_>, at: At, text: &str, size: f64, align: HPos) -> Drawn {
    let weight = if size > TEXT_SIZE { FontStyle::Bold } else { FontStyle::Normal };
    let font = FontDesc::new(FontFamily::SansSerif, 1.24 * FINE * size, weight);
    canvas.draw(&Text::new(lawful(text), at, font.color(&INK).pos(Pos::new(align, VPos::Center))))
}

/// A text without the characters that SVG cannot hold: names may be a stranger's.
pub(crate) fn lawful(text: &str) -> String {
    let is_lawful = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|c| if is_lawful(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

/// The width of the widest text, about, in the widest fonts that a page may take for sans-serif.
pub(crate) fn widest(texts: impl IntoIterator<Item = impl AsRef<str>>) -> f64 {
    0.62 * TEXT_SIZE * letters(texts) as f64
}

/// The number of letters of the longest text.
pub(crate) fn letters(texts: impl IntoIterator<Item = impl AsRef<str>>) -> usize {
    texts.into_iter().map(|text| text.as_ref().chars().count()).max().unwrap_or(0)
}
