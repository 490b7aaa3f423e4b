//! Shades of 8 bits, made of wider integers and of floats.

/// Converts a 16-bit channel value to 8 bits, rounded to nearest: 65535 becomes 255.
#[must_use]
pub fn narrow(value: u16) -> u8 {
    ((u32::from(value) + 128) / 257) as u8
}

/// A value that no image of floats has.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("an image's values go from 0 to 1 or from 0 to 255, with `stretch` anywhere; this has {0}")]
pub struct NotAShade(pub f32);

/// The factor by which [`scaled`] makes 8-bit values of an image's floats: 255 if none is above 1, else 1.
///
/// # Errors
/// The first value below 0, above 255, or not a number.
pub fn factor_to_8_bits(mut values: impl Iterator<Item = f32> + Clone) -> Result<f32, NotAShade> {
    let is_shade = |value: f32| (0.0..=255.0).contains(&value);
    // Flags instead of a return or a maximum: vectors do these.
    let (wrong, above) = values
        .clone()
        .fold((0, 0), |(wrong, above), value| (wrong | u32::from(!is_shade(value)), above | u32::from(value > 1.0)));
    if wrong != 0
        && let Some(value) = values.find(|&value| !is_shade(value))
    {
        return Err(NotAShade(value));
    }
    Ok(if above == 0 { 255.0 } else { 1.0 })
}

/// One factor for images that belong together, from those of [`factor_to_8_bits`]; `None` stands for an image of integers.
#[must_use]
pub fn common_factor<const N: usize>(factors: [Option<f32>; N]) -> f32 {
    factors.into_iter().flatten().reduce(f32::min).unwrap_or(1.0)
}

/// The 8-bit value of a float, see [`factor_to_8_bits`]. Values in the middle of two are rounded up, those outside are
/// moved to the nearest.
#[must_use]
#[expect(clippy::manual_clamp, reason = "what is not a number becomes 0")]
pub fn scaled(value: f32, factor: f32) -> u8 {
    // Floats from 2^23 on are whole. `f32::round` would be a call for every value on processors without SSE4.1.
    const WHOLE: f32 = 8_388_608.0;
    let exact = (value * factor).max(0.0).min(255.0);
    // To the nearest; from the middle, to the even one.
    let even = (exact + WHOLE) - WHOLE;
    let rounded = if exact - even >= 0.5 { even + 1.0 } else { even };
    (rounded + WHOLE).to_bits() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_inverts_widening_by_257() {
        assert!((0..=255u8).all(|v| narrow(u16::from(v) * 257) == v));
        assert_eq!([narrow(128), narrow(129), narrow(u16::MAX)], [0, 1, 255]);
    }

    #[test]
    fn floats_are_rounded_as_by_the_standard_library() {
        let rounded = |value: f32| value.round() as u8;
        let shades = (0..=255 * 64).map(|step| step as f32 / 64.0);
        let near = shades.flat_map(|value| [value.next_down(), value, value.next_up()]);
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, -7.5, 255.5, 1e9, f32::MIN_POSITIVE];
        for value in near.chain(odd) {
            assert_eq!(scaled(value, 1.0), rounded(value), "{value}");
            assert_eq!(scaled(value / 255.0, 255.0), rounded(value / 255.0 * 255.0), "{value}");
        }
    }

    #[test]
    fn floats_have_one_of_two_factors() {
        let factor = |values: &[f32]| factor_to_8_bits(values.iter().copied());
        assert_eq!(
            [&[][..], &[0.0, 1.0], &[0.5, 1.0_f32.next_up()], &[255.0]].map(factor),
            [255.0, 255.0, 1.0, 1.0].map(Ok)
        );
        assert_eq!(factor(&[3.0, -0.5, 300.0]), Err(NotAShade(-0.5)));
        assert!(factor(&[0.5, f32::NAN]).is_err_and(|wrong| wrong.0.is_nan()));
    }
}
