//! The cost of matching two pixels, for vectors of pixels: a function for each profile whose costs fit 8 bits.

use fearless_simd::{Simd, SimdBase, SimdInt, u8x16};

/// A vector of bytes.
pub(crate) trait Vector<S: Simd>: SimdInt<S, Element = u8, Block = u8x16<S>, ByteVector = Self> {}

impl<S: Simd, V: SimdInt<S, Element = u8, Block = u8x16<S>, ByteVector = V>> Vector<S> for V {}

/// Calls a method with the function of a profile as its last argument. A closure is passed, because the compiler may call a
/// function that is passed by name instead of inlining it.
macro_rules! compare_by {
    ($profile:expr, $vector:ty, $row:ident.$method:ident($simd:expr, $($argument:expr),*)) => {{
        macro_rules! with {
            ($function:expr) => {
                $row.$method(
                    $simd,
                    $($argument,)*
                    #[inline(always)]
                    |left, right| $function($simd, left, right),
                )
            };
        }
        use bp_core::Profile;
        use $crate::compare;
        match $profile {
            Profile::Census => with!(compare::hamming_distance::<_, $vector>),
            Profile::Gradient => with!(compare::gradient_difference::<_, $vector>),
            Profile::BirchfieldTomasi => with!(compare::sampling_insensitive_difference::<_, $vector>),
            Profile::Census16 => with!(compare::hamming_distance_of_16::<_, $vector>),
            Profile::Census32 => with!(compare::hamming_distance_of_32::<_, $vector>),
            // `mrf` has costs above 8 bits and never gets here.
            Profile::Thesis | Profile::Mrf => with!(compare::truncated_difference::<_, $vector>),
        }
    }};
}

pub(crate) use compare_by;

/// [`bp_core::Profile::Census`].
#[inline(always)]
pub(crate) fn hamming_distance<S: Simd, V: Vector<S>>(simd: S, [left]: [V; 1], [right]: [V; 1]) -> V {
    (left ^ right).count_ones().min(V::splat(simd, 6))
}

/// [`bp_core::Profile::Census16`].
#[inline(always)]
pub(crate) fn hamming_distance_of_16<S: Simd, V: Vector<S>>(simd: S, left: [V; 2], right: [V; 2]) -> V {
    let [a, b] = [left[0] ^ right[0], left[1] ^ right[1]];
    (a.count_ones() + b.count_ones()).min(V::splat(simd, 15))
}

/// [`bp_core::Profile::Census32`].
#[inline(always)]
pub(crate) fn hamming_distance_of_32<S: Simd, V: Vector<S>>(_: S, left: [V; 4], right: [V; 4]) -> V {
    let [[a, b, c, d], [e, f, g, h]] = [left, right];
    let [a, b, c] = [a ^ e, b ^ f, c ^ g];
    // A full adder per bit gives a sum and a carry that counts twice. That leaves two vectors of bits to count, not three.
    let (sum, carry) = (a ^ b ^ c, a & b | c & (a ^ b));
    let twice = carry.count_ones();
    sum.count_ones() + twice + twice + (d ^ h).count_ones()
}

/// [`bp_core::Profile::Thesis`], with a table.
#[inline(always)]
pub(crate) fn truncated_difference<S: Simd, V: Vector<S>>(simd: S, [left]: [V; 1], [right]: [V; 1]) -> V {
    let table = |difference| (7 * difference + 5) / 10;
    look_up(simd, table, difference::<S, V>(left, right).min(V::splat(simd, 15)))
}

/// [`bp_core::Profile::Gradient`]: `(3 a + 35 b + 5) div 10`, which is `(3 a div 5 + 7 b + 1) div 2`.
#[inline(always)]
pub(crate) fn gradient_difference<S: Simd, V: Vector<S>>(simd: S, left: [V; 2], right: [V; 2]) -> V {
    let (grey, gradient) = (difference::<S, V>(left[0], right[0]), difference::<S, V>(left[1], right[1]));
    let [four, five, fifteen] = [4, 5, 15].map(|most| V::splat(simd, most));
    // A table has 16 entries, but a has 21 possible values. Beyond 15 a second look-up adds the rest: 3 (15 + c) div 5
    // is 9 + 3 c div 5.
    let table = |difference| 3 * difference / 5;
    let upper = grey.saturating_sub(fifteen).min(five);
    let greys = look_up(simd, table, grey.min(fifteen)) + look_up(simd, table, upper);
    let gradients = look_up(simd, |difference| 7 * difference + 1, gradient.min(four));
    (greys + gradients) >> 1
}

/// [`bp_core::Profile::BirchfieldTomasi`]: `(15 d + 5) div 10`, which is `d + (d + 1) div 2`.
#[inline(always)]
pub(crate) fn sampling_insensitive_difference<S: Simd, V: Vector<S>>(simd: S, left: [V; 3], right: [V; 3]) -> V {
    let outside = outside::<S, V>(left, right).min(outside::<S, V>(right, left)).min(V::splat(simd, 20));
    outside + ((outside + V::splat(simd, 1)) >> 1)
}

/// By how much a value lies outside the range around the other pixel.
#[inline(always)]
fn outside<S: Simd, V: Vector<S>>([value, ..]: [V; 3], [_, least, greatest]: [V; 3]) -> V {
    value.saturating_sub(greatest) | least.saturating_sub(value)
}

#[inline(always)]
fn difference<S: Simd, V: Vector<S>>(left: V, right: V) -> V {
    left.saturating_sub(right) | right.saturating_sub(left)
}

/// Looks up indices from 0 to 15 in `table`.
#[inline(always)]
fn look_up<S: Simd, V: Vector<S>>(simd: S, table: impl Fn(u8) -> u8, indices: V) -> V {
    let table = u8x16::from_fn(simd, |index| table(index as u8));
    V::block_splat(table).swizzle_dyn_within_blocks(indices)
}
