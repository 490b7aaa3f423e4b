//! A colour bar with numbers, the scale of the picture that it is drawn next to.

use plotters::{coord::types::RangedCoordf64, prelude::Ranged};

use crate::{
    Error,
    canvas::letters,
    number::in_full,
    picture::{Colour, Pixels, pixels},
};

/// The least and the largest height of a bar in pixels. Numbers do not fit a lower bar, and a higher one shows no more.
const HEIGHTS: (u32, u32) = (72, 4096);

/// The least and the largest size of text in pixels.
const TEXT: (f64, f64) = (12.0, 56.0);

/// A colour bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourBar<'a> {
    /// The value of its lower end.
    pub low: f64,
    /// The value of its upper end.
    pub high: f64,
    /// The text above it.
    pub unit: &'a str,
    /// The height of the picture that the bar belongs to. The bar gets the same height, within bounds.
    pub height: u32,
}

impl ColourBar<'_> {
    /// Draws the bar and its numbers on white. `colour` gives the colour at a position, from 0 at the lower end to 1 at
    /// the upper end. A bar of a single value has the colour of the middle.
    ///
    /// # Errors
    ///
    /// When the numbers cannot be drawn.
    pub fn draw(&self, colour: impl Fn(f64) -> Colour) -> Result<Pixels, Error> {
        let height = self.height.clamp(HEIGHTS.0, HEIGHTS.1);
        let text = (f64::from(height) / 26.0).clamp(TEXT.0, TEXT.1);
        let (top, bottom) = ((2.0 * text).round(), (f64::from(height) - text).round());
        let ticks = self.ticks(((bottom - top) / (2.4 * text)) as usize);
        let (left, right) = (text.round(), (2.2 * text).round());
        let labels: Vec<String> = ticks.iter().map(|&tick| in_full(tick)).collect();
        let width = (right + 1.2 * text + 0.62 * text * letters(&labels) as f64).max(4.0 * text).ceil();
        let mut words = vec![label(left, 1.2 * text, text, self.unit)];
        for (&tick, name) in ticks.iter().zip(&labels) {
            let y = bottom - (bottom - top) * self.place(tick);
            let x = right + 0.35 * text;
            words.push(format!("<path d=\"M{right} {y}H{x}\" stroke=\"#222\" stroke-width=\"{}\"/>", text / 12.0));
            words.push(label(right + 0.6 * text, y + 0.36 * text, text, name));
        }
        let words = words.concat();
        let head = format!("width=\"{width}\" height=\"{height}\"");
        let svg = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" {head}><rect {head} fill=\"#fff\"/>{words}</svg>");
        let mut pixels = pixels(&svg, 1)?;
        let (top, bottom) = (top as usize, bottom as usize);
        let rows = pixels.colours.chunks_exact_mut(pixels.width as usize).take(bottom).skip(top);
        for (row, line) in rows.enumerate() {
            let place = 1.0 - row as f64 / (bottom - top - 1) as f64;
            line[left as usize..right as usize].fill(colour(if self.is_flat() { 0.5 } else { place }));
        }
        Ok(pixels)
    }

    /// Whether both ends have the same value.
    fn is_flat(&self) -> bool {
        self.high <= self.low
    }

    /// The position of a value, from 0 to 1.
    fn place(&self, value: f64) -> f64 {
        if self.is_flat() { 0.5 } else { (value - self.low) / (self.high - self.low) }
    }

    /// At most this many round values, but at least two.
    fn ticks(&self, most: usize) -> Vec<f64> {
        if self.is_flat() {
            return vec![self.low];
        }
        let round = RangedCoordf64::from(self.low..self.high).key_points(most.clamp(2, 10));
        let inside: Vec<f64> = round.into_iter().filter(|value| (self.low..=self.high).contains(value)).collect();
        if inside.len() < 2 { vec![self.low, self.high] } else { inside }
    }
}

fn label(x: f64, y: f64, size: f64, text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    format!("<text x=\"{x}\" y=\"{y}\" font-family=\"sans-serif\" font-size=\"{size}\" fill=\"#222\">{text}</text>")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(low: f64, high: f64, height: u32) -> ColourBar<'static> {
        ColourBar { low, high, unit: "px", height }
    }

    #[test]
    fn the_ends_have_their_colours_and_numbers_stand_beside() {
        let colour = |place: f64| [255, (255.0 * place) as u8, 0];
        let drawn = bar(3.0, 118.0, 400).draw(colour).unwrap();
        assert_eq!(drawn.height, 400);
        let bar: Vec<Colour> = drawn.colours.iter().copied().filter(|c| c[0] == 255 && c[2] == 0).collect();
        assert_eq!((bar.first(), bar.last()), (Some(&[255, 255, 0]), Some(&[255, 0, 0])));
        let dark = |colours: &[Colour]| colours.iter().filter(|colour| colour.iter().all(|&value| value < 100)).count();
        assert!(dark(&drawn.colours) > 100);
    }

    #[test]
    fn marks_are_round_and_inside_whatever_the_range() {
        assert_eq!(bar(3.0, 118.0, 0).ticks(6), [20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(bar(5.0, 5.0, 0).ticks(6), [5.0]);
        for (low, high) in [(-3.0, 4.0), (0.0, 1e-6), (-1e9, 1e9), (7.3, 7.4), (5.0, 5.0), (0.1, 0.100_000_1)] {
            for height in [0, 1, 72, 100, 5000] {
                let bar = bar(low, high, height);
                assert!(bar.ticks(5).iter().all(|tick| (low..=high).contains(tick)), "{low} {high}");
                let drawn = bar.draw(|_| [0; 3]).unwrap();
                assert_eq!(drawn.colours.len(), (drawn.width * drawn.height) as usize);
                assert_eq!(drawn.height, height.clamp(72, 4096));
            }
        }
    }
}
