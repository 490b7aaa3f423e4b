//! The colour bar beside a coloured picture.

use bp_io::{ColourBar, Pixels};

/// Draws the bar, with numbers.
pub(crate) fn draw(bar: &ColourBar) -> Result<Pixels, String> {
    let ColourBar { low, high, height, colours } = *bar;
    let drawn = bp_charts::ColourBar { low: low.into(), high: high.into(), unit: "px", height };
    let bp_charts::Pixels { width, height, colours } =
        drawn.draw(|place| colours.at(place)).map_err(|error| error.to_string())?;
    Ok(Pixels { width, height, colours })
}
