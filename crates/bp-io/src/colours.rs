//! Colour maps.

use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

/// The colour map of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Colours {
    /// From dark violet to yellow. The order stays visible to colour-blind readers and in greyscale print.
    #[default]
    Viridis,
    /// A rainbow whose lightness rises and falls evenly (Mikhailov 2019, computed with its author's polynomials).
    Turbo,
    /// The rainbow of older papers, which shows edges that do not exist.
    Jet,
}

impl Colours {
    /// All colour maps, the default first.
    pub const ALL: [Self; 3] = [Self::Viridis, Self::Turbo, Self::Jet];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Turbo => "turbo",
            Self::Jet => "jet",
        }
    }

    /// The colour at `place` in 0..=1.
    #[must_use]
    pub fn at(self, place: f64) -> [u8; 3] {
        let place = place.clamp(0.0, 1.0);
        match self {
            // Not colorous's viridis, which differs slightly: recorded figures must be reproduced to the byte.
            Self::Viridis => {
                let colour = ViridisRGB.get_color(place as f32);
                [colour.0, colour.1, colour.2]
            }
            Self::Turbo => colorous::TURBO.eval_continuous(place).as_array(),
            // Red, green and blue are trapezoids around 3/4, 2/4 and 1/4.
            Self::Jet => {
                [3.0, 2.0, 1.0].map(|top| (255.0 * (1.5 - (4.0 * place - top).abs()).clamp(0.0, 1.0)).round() as u8)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middles_are_the_published_ones() {
        let ends = |colours: Colours| [0.0, 0.5, 1.0].map(|place| colours.at(place));
        assert_eq!(ends(Colours::Viridis)[0], [68, 1, 84]);
        assert_eq!(ends(Colours::Viridis)[2], [254, 232, 37]);
        assert_eq!(ends(Colours::Jet), [[0, 0, 128], [128, 255, 128], [128, 0, 0]]);
        // The values of the polynomials. The table that they approximate begins with [48, 18, 59].
        assert_eq!(ends(Colours::Turbo), [[34, 23, 27], [148, 250, 80], [144, 12, 0]]);
        assert!(Colours::ALL.iter().all(|colours| (0..=100).all(|i| colours.at(f64::from(i) / 100.0) != [0; 3])));
    }
}
