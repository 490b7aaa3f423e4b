//! A pair of 3x2 pixels, followed by hand.
