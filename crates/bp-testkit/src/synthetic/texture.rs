//! Band-limited procedural textures from integer hashes: the same bits on every machine.

use super::spot::Spot;

/// The paint of a surface: a pattern in 0..=1 looked up on a ramp of colours.
#[derive(Clone, Copy)]
pub(super) struct Paint {
    /// Colours of the pattern's values 0, 1/2 and 1, [3][RGB].
    pub(super) ramp: [[u8; 3]; 3],
    pub(super) pattern: Pattern,
    /// Amplitude of the fine texture that every surface has, in grey levels. Near 1 it drowns in the sensor's noise.
    pub(super) grain: f64,
    pub(super) seed: u32,
}

/// The pattern of a surface. Lengths are in pixels of the full-size left image.
#[derive(Clone, Copy)]
pub(super) enum Pattern {
    /// One colour.
    Plain,
    /// Irregular spots, `across` by `along` the surface.
    Mottle { across: f64, along: f64 },
    /// Winding bands such as those of a map or of marble.
    Contours { wavelength: f64 },
    /// Soft stripes across the surface, not quite even.
    Stripes { period: f64 },
    /// Woven threads under a printed pattern.
    Weave { pitch: f64, print: f64 },
    /// Planks along the surface.
    Planks { width: f64 },
    /// A midrib and oblique veins.
    Veins { period: f64 },
    /// A book's cover: title, picture, author.
    Cover,
}

impl Paint {
    /// The colour at a place of the surface before shading, [RGB] in grey levels.
    pub(super) fn colour(&self, spot: Spot) -> [f64; 3] {
        let value = self.pattern.value(self.seed, spot).clamp(0.0, 1.0) * 2.0;
        let (low, share) = if value < 1.0 { (0, value) } else { (1, value - 1.0) };
        let (p, q) = (spot.across, spot.along);
        let fine = noise(self.seed ^ 0x51, p / 4.0, q / 4.0) + noise(self.seed ^ 0x52, p / 9.0, q / 9.0);
        std::array::from_fn(|c| {
            let (a, b) = (f64::from(self.ramp[low][c]), f64::from(self.ramp[low + 1][c]));
            a + (b - a) * share + self.grain * fine
        })
    }
}

impl Pattern {
    fn value(self, seed: u32, spot: Spot) -> f64 {
        let (p, q) = (spot.across, spot.along);
        match self {
            Self::Plain => 0.5,
            Self::Mottle { across, along } => 0.5 + 0.8 * fractal(seed, p / across, q / along),
            Self::Contours { wavelength } => {
                0.5 + 0.4 * ripple(2.5 * fractal(seed, p / wavelength, q / wavelength))
                    + 0.3 * fractal(seed + 1, p / 14.0, q / 14.0)
            }
            Self::Stripes { period } => {
                0.5 + 0.45 * ripple(q / period + 0.25 * noise(seed, p / 60.0, q / 60.0))
                    + 0.15 * noise(seed, p / 6.0, q / 6.0)
            }
            Self::Weave { pitch, print } => weave(seed, p, q, pitch) + 0.7 * fractal(seed, p / print, q / print),
            Self::Planks { width } => planks(seed, p / width, q / width),
            Self::Veins { period } => {
                let rib = soft_step(2.0 - p.abs());
                let vein = ripple((q - 1.3 * p.abs()) / period + 0.5 * noise(seed, p / 30.0, q / 30.0));
                let age = 0.4 * uniform(seed, 0, 0);
                0.2 + age + 0.4 * rib + 0.07 * vein + 0.5 * fractal(seed, p / 16.0, q / 32.0)
            }
            Self::Cover => cover(seed, spot),
        }
    }
}

/// Threads of varying thickness in both directions, around 1/2.
fn weave(seed: u32, p: f64, q: f64, pitch: f64) -> f64 {
    let (warp, weft) = (noise(seed + 1, p / pitch, q / (9.0 * pitch)), noise(seed + 2, p / (9.0 * pitch), q / pitch));
    0.5 + 0.35 * (warp + weft)
}

/// Planks one unit wide, each of its own shade, with long grain.
fn planks(seed: u32, p: f64, q: f64) -> f64 {
    let (plank, place) = split(p);
    let gap = soft_step(40.0 * (0.03 - place.min(1.0 - place)));
    let shade = 0.3 * (uniform(seed, plank, 0) - 0.5);
    0.5 + shade - 0.6 * gap + 0.5 * fractal(seed, 6.0 * p, 0.5 * q + 7.0 * shade)
}

/// Two lines of lettering, a framed picture between them and a plain margin.
fn cover(seed: u32, spot: Spot) -> f64 {
    let (p, q, u) = (spot.across, spot.along, spot.aside.abs() / spot.rim);
    let line = |from: f64, to: f64, wide: f64| {
        let inside = soft_step(60.0 * (spot.t - from).min(to - spot.t)) * soft_step(60.0 * (wide - u));
        if inside > 0.0 { inside * soft_step(6.0 * noise(seed, p / 9.0, q / 22.0) + 0.3) } else { 0.0 }
    };
    let picture = soft_step(60.0 * (spot.t - 0.34).min(0.80 - spot.t)) * soft_step(60.0 * (0.72 - u));
    let lettering = line(0.08, 0.16, 0.8) + line(0.19, 0.26, 0.55) + line(0.87, 0.92, 0.4);
    let margin = 0.12 * (1.0 - picture) * (1.0 + noise(seed + 3, p / 40.0, q / 40.0));
    margin + 0.85 * lettering + picture * (0.5 + 0.9 * fractal(seed + 4, p / 45.0, q / 45.0))
}

/// Four octaves of [`noise`] from wavelength 1 down. Each has 1/2 the wavelength and 2/3 the amplitude of the last.
fn fractal(seed: u32, x: f64, y: f64) -> f64 {
    let (mut sum, mut weight, mut zoom) = (0.0, 0.5, 1.0);
    for octave in 0..4 {
        sum += weight * noise(seed.wrapping_add(octave * 101), x * zoom, y * zoom);
        weight *= 2.0 / 3.0;
        zoom *= 2.0;
    }
    sum
}

/// The largest magnitude of [`noise`], which seldom exceeds 1.
pub(super) const NOISE_BOUND: f64 = 1.8;

/// Smooth noise around 0 with the wavelength 1: gradient noise on the integer lattice.
pub(super) fn noise(seed: u32, x: f64, y: f64) -> f64 {
    let ((left, u), (top, v)) = (split(x), split(y));
    let corner = |i: i32, j: i32| {
        let h = hash(seed, left + i, top + j);
        let (gx, gy) = (f64::from(h & 0xffff) / 32767.5 - 1.0, f64::from(h >> 16) / 32767.5 - 1.0);
        gx * (u - f64::from(i)) + gy * (v - f64::from(j))
    };
    let (s, t) = (fade(u), fade(v));
    let upper = corner(0, 0) * (1.0 - s) + corner(1, 0) * s;
    let lower = corner(0, 1) * (1.0 - s) + corner(1, 1) * s;
    NOISE_BOUND * (upper * (1.0 - t) + lower * t)
}

/// The integer below a number, and the rest. Avoids `floor`, which is a slow call in programs built for any CPU.
fn split(x: f64) -> (i32, f64) {
    let towards_zero = x as i32;
    let below = towards_zero - i32::from(x < f64::from(towards_zero));
    (below, x - f64::from(below))
}

/// Rises from 0 to 1 with zero slope and zero curvature at both ends.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// A sine-like wave of period 1 and amplitude 1, made of parabolas.
fn ripple(x: f64) -> f64 {
    let h = 2.0 * split(x).1 - 1.0;
    4.0 * h * (1.0 - h.abs())
}

/// 0 below -1, 1 above 1, and linear in between: an edge that does not alias.
fn soft_step(x: f64) -> f64 {
    (0.5 + 0.5 * x).clamp(0.0, 1.0)
}

/// A number in 0..1 that depends only on the arguments.
pub(super) fn uniform(seed: u32, i: i32, j: i32) -> f64 {
    f64::from(hash(seed, i, j)) / 4_294_967_296.0
}

/// Mixes a lattice point's coordinates into 32 well-spread bits.
fn hash(seed: u32, x: i32, y: i32) -> u32 {
    let point = (x as u32).wrapping_mul(0x85eb_ca6b) ^ (y as u32).wrapping_mul(0xc2b2_ae35);
    let mut h = seed.wrapping_mul(0x9e37_79b9) ^ point;
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}
