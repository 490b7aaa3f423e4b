//! The data of charts.

use plotters::style::RGBColor;

use crate::{Style, canvas::INK, style::colour};

/// A number with its interval. Without an interval, both ends equal the number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// The number.
    pub value: f64,
    /// Where its interval begins.
    pub low: f64,
    /// Where its interval ends.
    pub high: f64,
}

impl From<f64> for Value {
    /// The number without an interval.
    fn from(value: f64) -> Self {
        Self { value, low: value, high: value }
    }
}

/// A series: points with one name and one style.
#[derive(Clone, Debug)]
pub struct Series<P> {
    /// Its name.
    pub name: String,
    /// Its style.
    pub style: Style,
    /// Its points.
    pub points: Vec<P>,
}

/// An entry of a legend.
#[derive(Clone, Debug)]
pub struct Key {
    /// The name.
    pub name: String,
    /// The style.
    pub style: Style,
}

/// The entries of a legend: the keys, or the series if there are no keys.
pub(crate) fn entries<'a, P: 'a>(
    keys: &'a [Key],
    series: impl Iterator<Item = &'a Series<P>>,
) -> Vec<(&'a str, Style)> {
    match keys {
        [] => series.map(|series| (series.name.as_str(), series.style)).collect(),
        keys => keys.iter().map(|key| (key.name.as_str(), key.style)).collect(),
    }
}

/// A value to compare with, drawn as a dashed line from left to right.
#[derive(Clone, Debug)]
pub struct Level {
    /// Its name in the legend.
    pub name: String,
    /// Where it lies on the vertical axis.
    pub value: f64,
    /// The number of its colour; `None` for the colour of texts.
    pub colour: Option<usize>,
}

impl Level {
    /// The colour of its line.
    pub(crate) fn line_colour(&self) -> RGBColor {
        self.colour.map_or(INK, colour)
    }
}
