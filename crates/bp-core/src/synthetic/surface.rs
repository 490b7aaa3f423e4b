//! Surfaces: where they lie in the left image, how near they are, what they show.

use super::MAX_DISPARITY;
use super::texture::{Paint, noise};

/// A surface over coordinates (x, y) of the full-size left image.
#[derive(Clone)]
pub(super) struct Surface {
    outline: Option<Strip>,
    relief: Relief,
    paint: Paint,
}

/// The outline of a surface: a strip of varying width about a straight or bent spine.
#[derive(Clone, Copy)]
pub(super) struct Strip {
    /// Ends of the spine, [x, y].
    pub(super) from: [f64; 2],
    pub(super) to: [f64; 2],
    /// Greatest half width in pixels.
    pub(super) half_width: f64,
    pub(super) profile: Profile,
    /// How far the spine's middle lies aside, in pixels.
    pub(super) bend: f64,
    /// How far both ends bulge along the spine in pixels: the rim of a pot seen from above.
    pub(super) sag: f64,
}

/// Half width along a strip as a share of its greatest.
#[derive(Clone, Copy)]
pub(super) enum Profile {
    /// Constant: bars, boards.
    Bar,
    /// An ellipse.
    Round,
    /// Pointed at the end, narrow at the start.
    Leaf,
    /// A smooth curve through values at equal steps: what a lathe turns.
    Turned(&'static [f64]),
}

/// The disparity of a surface as a function of place, in pixels of the full-size image.
#[derive(Clone, Default)]
pub(super) struct Relief {
    /// At the start of the spine, or at (0, 0) without an outline.
    pub(super) level: f64,
    /// Gain from the start to the end of the spine.
    pub(super) rise: f64,
    /// Gain per pixel in [x, y].
    pub(super) slant: [f64; 2],
    /// Gain from the rim to the spine: round.
    pub(super) bulge: f64,
    /// Gain from the rim to the spine: folded.
    pub(super) crease: f64,
    pub(super) folds: Vec<Folds>,
}

/// Smooth irregular waves.
#[derive(Clone, Copy)]
pub(super) struct Folds {
    /// In pixels of disparity.
    pub(super) amplitude: f64,
    /// In pixels along [x, y].
    pub(super) wavelength: [f64; 2],
    /// Pixels in x by which a fold leans per pixel in y.
    pub(super) lean: f64,
    pub(super) seed: u32,
}

/// A place in a surface's own coordinates.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// Share of the spine, 0..=1 inside.
    pub(super) t: f64,
    /// Pixels along and across the spine; x and y without an outline.
    pub(super) along: f64,
    pub(super) across: f64,
    /// Half width here in pixels.
    pub(super) half_width: f64,
}

impl Surface {
    /// A surface behind all others that extends without end.
    pub(super) fn backdrop(relief: Relief, paint: Paint) -> Self {
        Self { outline: None, relief, paint }
    }

    pub(super) fn new(outline: Strip, relief: Relief, paint: Paint) -> Self {
        Self { outline: Some(outline), relief, paint }
    }

    /// The disparity of the surface, or of its continuation beyond the outline.
    pub(super) fn disparity(&self, x: f64, y: f64) -> f64 {
        let relief = &self.relief;
        let mut sum = relief.level;
        let mut origin = [0.0; 2];
        if let Some(strip) = &self.outline {
            let spot = strip.spot(x, y);
            let (rim, place) = (spot.half_width / strip.half_width, spot.across.abs() / strip.half_width);
            sum += relief.rise * spot.t;
            sum += relief.bulge * (rim * rim - place * place).max(0.0) + relief.crease * (rim - place).max(0.0);
            origin = strip.from;
        }
        sum += relief.slant[0] * (x - origin[0]) + relief.slant[1] * (y - origin[1]);
        relief.folds.iter().fold(sum, |sum, folds| sum + folds.height(x, y))
    }

    /// Whether the surface covers (x, y).
    pub(super) fn covers(&self, x: f64, y: f64) -> bool {
        self.outline.is_none_or(|strip| {
            let spot = strip.spot(x, y);
            (0.0..=1.0).contains(&spot.t) && spot.across.abs() <= spot.half_width
        })
    }

    /// A cheap test that never misses: whether the surface may cover any x in `from..=to` of row `y`.
    pub(super) fn may_cover(&self, from: f64, to: f64, y: f64) -> bool {
        self.outline.is_none_or(|strip| {
            let [(left, right), (top, bottom)] = strip.bounds();
            left <= to && from <= right && top <= y && y <= bottom
        })
    }

    /// The x with `x - disparity(x, y) == right_x`, by secants. It is the only one: disparity gains less than a pixel
    /// per pixel, so the left side rises strictly.
    pub(super) fn left_x(&self, right_x: f64, y: f64) -> f64 {
        let miss = |x: f64| x - self.disparity(x, y) - right_x;
        let (mut a, mut b) = (right_x, right_x + 0.5 * MAX_DISPARITY);
        let (mut miss_a, mut miss_b) = (miss(a), miss(b));
        for _ in 0..30 {
            if miss_b.abs() < 1e-9 || miss_a == miss_b {
                break;
            }
            let next = b - miss_b * (b - a) / (miss_b - miss_a);
            (a, miss_a) = (b, miss_b);
            (b, miss_b) = (next, miss(next));
        }
        b
    }

    /// Unshaded colour at (x, y), [RGB] in grey levels.
    pub(super) fn colour(&self, x: f64, y: f64) -> [f64; 3] {
        let flat = Spot { t: 0.0, along: y, across: x, half_width: f64::INFINITY };
        self.paint.colour(self.outline.map_or(flat, |strip| strip.spot(x, y)))
    }
}

impl Strip {
    /// A straight strip.
    pub(super) fn new(from: [f64; 2], to: [f64; 2], half_width: f64, profile: Profile) -> Self {
        Self { from, to, half_width, profile, bend: 0.0, sag: 0.0 }
    }

    /// An upright ellipse.
    pub(super) fn ellipse([x, y]: [f64; 2], [rx, ry]: [f64; 2]) -> Self {
        Self::new([x, y - ry], [x, y + ry], rx, Profile::Round)
    }

    fn spot(&self, x: f64, y: f64) -> Spot {
        let [dx, dy] = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let length = (dx * dx + dy * dy).sqrt();
        let (rx, ry) = (x - self.from[0], y - self.from[1]);
        let straight = (rx * dx + ry * dy) / length;
        let share = straight / length;
        let across = (rx * dy - ry * dx) / length - self.bend * 4.0 * share * (1.0 - share);
        let aside = across / self.half_width;
        let along = straight - self.sag * (1.0 - aside * aside).max(0.0);
        let t = along / length;
        Spot { t, along, across, half_width: self.half_width * self.profile.at(t.clamp(0.0, 1.0)) }
    }

    /// Bounds in x and y.
    fn bounds(&self) -> [(f64, f64); 2] {
        let margin = self.half_width + self.bend.abs() + self.sag.abs();
        [0, 1].map(|i| (self.from[i].min(self.to[i]) - margin, self.from[i].max(self.to[i]) + margin))
    }
}

impl Profile {
    fn at(self, t: f64) -> f64 {
        match self {
            Self::Bar => 1.0,
            Self::Round => 2.0 * (t * (1.0 - t)).sqrt(),
            Self::Leaf => (0.25 + 3.0 * t) * (1.0 - t) / 0.88,
            Self::Turned(values) => curve(values, t),
        }
    }
}

/// The Catmull-Rom curve through values at equal steps over 0..=1.
fn curve(values: &[f64], t: f64) -> f64 {
    let last = values.len() - 1;
    let place = t * last as f64;
    let i = (place as usize).min(last - 1);
    let u = place - i as f64;
    let [a, b, c, d] = [values[i.saturating_sub(1)], values[i], values[i + 1], values[(i + 2).min(last)]];
    b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
}

impl Folds {
    fn height(&self, x: f64, y: f64) -> f64 {
        self.amplitude * noise(self.seed, (x - self.lean * y) / self.wavelength[0], y / self.wavelength[1])
    }
}
