//! Axes: their names, ranges and ticks.

use plotters::{coord::types::RangedCoordf64, prelude::Ranged};

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The name of the values, with their unit.
    pub name: String,
    /// Whether it is logarithmic. A linear axis always shows 0.
    pub logarithmic: bool,
    /// The values of its ticks. If empty, the chart chooses them.
    pub ticks: Vec<f64>,
}

impl Axis {
    /// A linear axis. The chart chooses its ticks.
    pub fn linear(name: impl Into<String>) -> Self {
        Self { name: name.into(), logarithmic: false, ticks: Vec::new() }
    }

    /// A logarithmic axis. The chart chooses its ticks.
    pub fn logarithmic(name: impl Into<String>) -> Self {
        Self { logarithmic: true, ..Self::linear(name) }
    }

    /// Its name as charts show it.
    pub(crate) fn label(&self) -> String {
        format!("{}{}", self.name, if self.logarithmic { ", logarithmic axis" } else { "" })
    }

    /// Whether the axis can show a value; the bounds keep its labels short.
    pub(crate) fn shows(&self, value: f64) -> bool {
        value.abs() <= 1e15 && (!self.logarithmic || value >= 1e-6)
    }

    /// The scale for the values that the axis can show; `None` if it can show none of them.
    pub(crate) fn scale(&self, values: impl IntoIterator<Item = f64>) -> Option<Scale> {
        let values: Vec<f64> = values.into_iter().filter(|&value| self.shows(value)).collect();
        let first = *values.first()?;
        let (low, high) = values.iter().fold((first, first), |(low, high), &value| (low.min(value), high.max(value)));
        Some(Scale::new(self, low, high))
    }
}

/// The ends of an axis, as logarithms if it is logarithmic, and the values of its ticks.
pub(crate) struct Scale {
    logarithmic: bool,
    low: f64,
    high: f64,
    pub(crate) ticks: Vec<f64>,
}

impl Scale {
    fn new(axis: &Axis, low: f64, high: f64) -> Self {
        let logarithmic = axis.logarithmic;
        let (low, high) = if logarithmic { (low.log10(), high.log10()) } else { (low.min(0.0), high.max(0.0)) };
        // A single value has no span, so its margin is fixed.
        let margin = if high - low < 1e-9 { 1.0 } else { 0.06 * (high - low) };
        let (low, high) = (if logarithmic || low < 0.0 { low - margin } else { 0.0 }, high + margin);
        let mut scale = Self { logarithmic, low, high, ticks: Vec::new() };
        scale.ticks = match &axis.ticks[..] {
            [] if logarithmic => decade_ticks(low, high),
            [] => RangedCoordf64::from(low..high).key_points(7),
            asked => asked.iter().copied().filter(|&tick| axis.shows(tick) && scale.reaches(tick)).collect(),
        };
        scale
    }

    fn height(&self, value: f64) -> f64 {
        // The logarithm of a negative number is NaN, and so would be its position.
        if self.logarithmic { value.max(0.0).log10() } else { value }
    }

    fn reaches(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&self.height(value))
    }

    /// The position of a value on the axis, from 0 to 1. Values beyond an end are moved to it.
    pub(crate) fn fraction(&self, value: f64) -> f64 {
        (self.height(value).clamp(self.low, self.high) - self.low) / (self.high - self.low)
    }
}

/// Ticks at 1, 2 and 5 times the powers of ten, between two values given as logarithms. If those are not 4 to 12 ticks,
/// it uses more or fewer digits. If the range is too narrow for that, it uses equal steps.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_few_round_and_on_the_axis() {
        let ticks = |axis: &Axis, low, high| axis.scale([low, high]).unwrap().ticks;
        assert_eq!(ticks(&Axis::logarithmic(""), 0.8, 30.0), [1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(ticks(&Axis::logarithmic(""), 1.0, 1e6), [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6]);
        assert_eq!(ticks(&Axis::linear(""), 3.0, 10.0)[..2], [0.0, 2.0]);
        let asked = Axis { ticks: vec![0.0, 1.0, 16.0, 512.0, 4096.0], ..Axis::logarithmic("") };
        assert_eq!(ticks(&asked, 1.0, 512.0), [1.0, 16.0, 512.0]);
    }

    #[test]
    fn ends_lie_beyond_the_values_but_a_linear_axis_begins_at_0() {
        let scale = Axis::linear("").scale([2.0, 10.0]).unwrap();
        assert!(scale.fraction(0.0) == 0.0 && scale.fraction(10.0) < 1.0 && scale.fraction(1e9) == 1.0);
        let scale = Axis::logarithmic("").scale([2.0, 0.0, 50.0]).unwrap();
        assert!(scale.fraction(2.0) > 0.0 && (scale.fraction(10.0) - 0.5).abs() < 1e-12 && scale.fraction(-1.0) == 0.0);
        assert!(Axis::logarithmic("").scale([0.0, f64::NAN]).is_none());
    }
}
