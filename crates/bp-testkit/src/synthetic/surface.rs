//! Surfaces: their place in the left image, their disparity and their paint.

use super::spot::Spot;
use super::texture::{NOISE_BOUND, Paint, noise};

/// One of the two cameras.
#[derive(Clone, Copy)]
pub(super) enum View {
    Left,
    Right,
}

/// A surface over coordinates (x, y) of the full-size left image.
pub(super) struct Surface {
    strip: Strip,
    bounds: Bounds,
    relief: Relief,
    paint: Paint,
}

/// The place where a line of sight meets a surface, at column `x` of the left image.
#[derive(Clone, Copy)]
pub(super) struct Hit<'a> {
    pub(super) surface: &'a Surface,
    pub(super) x: f64,
    pub(super) disparity: f64,
}

/// Cheap bounds of the places that a strip covers.
struct Bounds {
    rows: (f64, f64),
    /// Columns of each view, relative to the spine's in the left image.
    columns: [(f64, f64); 2],
    /// Pixels in x that the spine gains per row.
    lean: f64,
}

/// The outline of a surface: a strip of varying width about a straight or bent spine.
#[derive(Clone, Copy)]
pub(super) struct Strip {
    /// Start of the spine and the way to its end, [x, y].
    pub(super) from: [f64; 2],
    way: [f64; 2],
    length: f64,
    /// Greatest half width in pixels.
    half_width: f64,
    profile: Profile,
    /// The sideways offset of the spine's middle, in half widths.
    bend: f64,
    /// How far both ends bulge along the spine, in lengths: the rim of a pot seen from above.
    sag: f64,
    /// The gain per pixel in [x, y], along the spine in lengths and across it in half widths.
    axis: [f64; 2],
    normal: [f64; 2],
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
    /// A smooth curve through values at equal steps: shapes turned on a lathe.
    Turned(&'static [f64]),
}

/// The disparity of a surface as a function of place, in pixels of the full-size image.
#[derive(Default)]
pub(super) struct Relief {
    /// At the start of the spine's rim.
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

impl Surface {
    pub(super) fn new(strip: Strip, relief: Relief, paint: Paint) -> Self {
        Self { bounds: Bounds::new(&strip, &relief), strip, relief, paint }
    }

    /// The place of the surface that a view shows at (x, y), if the surface covers that place.
    pub(super) fn seen_at(&self, view: View, x: f64, y: f64) -> Option<Hit<'_>> {
        let [left, top] = self.strip.from;
        if !self.bounds.hold(view, x - left, y - top) {
            return None;
        }
        let x = self.left_x(view, x, y);
        let spot = self.strip.spot(x, y);
        spot.is_inside().then(|| Hit { surface: self, x, disparity: self.height(spot, x, y) })
    }

    /// The place that a view would show at (x, y) if the surface were endless.
    pub(super) fn met_at(&self, view: View, x: f64, y: f64) -> Hit<'_> {
        let x = self.left_x(view, x, y);
        Hit { surface: self, x, disparity: self.disparity(x, y) }
    }

    /// The disparity of the surface, or of its continuation beyond the outline.
    pub(super) fn disparity(&self, x: f64, y: f64) -> f64 {
        self.height(self.strip.spot(x, y), x, y)
    }

    /// The disparity at (x, y), which is `spot` in the surface's own coordinates.
    fn height(&self, spot: Spot, x: f64, y: f64) -> f64 {
        let (relief, strip) = (&self.relief, &self.strip);
        let (rim, aside) = (spot.rim, spot.aside.abs());
        let round = relief.bulge * (rim * rim - aside * aside).max(0.0) + relief.crease * (rim - aside).max(0.0);
        let plane = relief.slant[0] * (x - strip.from[0]) + relief.slant[1] * (y - strip.from[1]);
        let smooth = relief.level + relief.rise * spot.t + round + plane;
        relief.folds.iter().fold(smooth, |sum, folds| sum + folds.height(x, y))
    }

    /// The left image's column of the place that a view shows at (x, y). For the right view it is the only root of
    /// `left - disparity(left) - x`, found by secants: disparity gains less than a pixel per pixel.
    fn left_x(&self, view: View, x: f64, y: f64) -> f64 {
        if matches!(view, View::Left) {
            return x;
        }
        let miss = |left: f64| left - self.disparity(left, y) - x;
        let mut a = x + self.relief.level;
        let mut miss_a = miss(a);
        let mut b = a - miss_a;
        for _ in 0..30 {
            let miss_b = miss(b);
            if miss_b.abs() < 1e-6 || miss_a == miss_b {
                break;
            }
            (a, b, miss_a) = (b, b - miss_b * (b - a) / (miss_b - miss_a), miss_b);
        }
        b
    }

    /// Unshaded colour at (x, y), [RGB] in grey levels.
    pub(super) fn colour(&self, x: f64, y: f64) -> [f64; 3] {
        self.paint.colour(self.strip.spot(x, y))
    }
}

impl Bounds {
    fn new(strip: &Strip, relief: &Relief) -> Self {
        let (far, near) = relief.range(strip);
        let (lean, reach) = strip.lean();
        let [_, (top, bottom)] = strip.extent();
        Self { rows: (top, bottom), columns: [(-reach, reach), (-reach - near, reach - far)], lean }
    }

    /// Whether the strip may cover (x, y) of a view, counted from its start. Never false if it does.
    fn hold(&self, view: View, x: f64, y: f64) -> bool {
        let within = |(low, high): (f64, f64), value: f64| low <= value && value <= high;
        within(self.rows, y) && within(self.columns[view as usize], x - self.lean * y)
    }
}

impl Strip {
    /// A straight strip between two points [x, y].
    pub(super) fn new(from: [f64; 2], to: [f64; 2], half_width: f64, profile: Profile) -> Self {
        let way @ [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let length = (dx * dx + dy * dy).sqrt();
        let axis = way.map(|d| d / (length * length));
        let normal = [dy, -dx].map(|d| d / (length * half_width));
        Self { from, way, length, half_width, profile, bend: 0.0, sag: 0.0, axis, normal }
    }

    /// The strip with the middle of its spine bent aside by some pixels.
    pub(super) fn bent(self, pixels: f64) -> Self {
        Self { bend: pixels / self.half_width, ..self }
    }

    /// The strip with both ends bulging along the spine by some pixels.
    pub(super) fn sagging(self, pixels: f64) -> Self {
        Self { sag: pixels / self.length, ..self }
    }

    /// An upright ellipse.
    pub(super) fn ellipse([x, y]: [f64; 2], [rx, ry]: [f64; 2]) -> Self {
        Self::new([x, y - ry], [x, y + ry], rx, Profile::Round)
    }

    /// A parallel bar whose spine is `aside` pixels across from this one's.
    pub(super) fn beside(&self, aside: f64, half_width: f64) -> Self {
        let ([x, y], [dx, dy]) = (self.from, self.way);
        let from = [x + aside * dy / self.length, y - aside * dx / self.length];
        Self::new(from, [from[0] + dx, from[1] + dy], half_width, Profile::Bar)
    }

    fn spot(&self, x: f64, y: f64) -> Spot {
        let (rx, ry) = (x - self.from[0], y - self.from[1]);
        let straight = rx * self.axis[0] + ry * self.axis[1];
        let aside = rx * self.normal[0] + ry * self.normal[1] - self.bend * 4.0 * straight * (1.0 - straight);
        let t = straight - self.sag * (1.0 - aside * aside).max(0.0);
        let rim = self.profile.at(t.clamp(0.0, 1.0));
        Spot { t, aside, rim, along: t * self.length, across: aside * self.half_width }
    }

    /// Pixels in x that the spine gains per row, and how far in x from that line the strip may reach. A spine that is
    /// nearly horizontal counts as upright and wide.
    fn lean(&self) -> (f64, f64) {
        let (aside, [dx, dy]) = (self.half_width * (1.0 + self.bend.abs()), self.way);
        if dy.abs() < 0.2 * self.length {
            return (0.0, self.length * (1.0 + self.sag.abs()) + aside);
        }
        (dx / dy, aside * self.length / dy.abs())
    }

    /// Bounds in [x, y], counted from the start of the spine.
    fn extent(&self) -> [(f64, f64); 2] {
        let margin = self.half_width * (1.0 + self.bend.abs()) + self.length * self.sag.abs();
        self.way.map(|d| (d.min(0.0) - margin, d.max(0.0) + margin))
    }
}

impl Relief {
    /// Bounds of the disparity over a strip.
    fn range(&self, strip: &Strip) -> (f64, f64) {
        let (mut low, mut high) = (self.level, self.level);
        let mut add = |a: f64, b: f64| {
            low += a.min(b);
            high += a.max(b);
        };
        [self.rise, self.bulge, self.crease].into_iter().for_each(|gain| add(0.0, gain));
        let [(left, right), (top, bottom)] = strip.extent();
        add(self.slant[0] * left, self.slant[0] * right);
        add(self.slant[1] * top, self.slant[1] * bottom);
        self.folds.iter().for_each(|folds| add(-NOISE_BOUND * folds.amplitude, NOISE_BOUND * folds.amplitude));
        (low, high)
    }
}

impl Profile {
    fn at(self, t: f64) -> f64 {
        match self {
            Self::Bar => 1.0,
            Self::Round => 2.0 * (t * (1.0 - t)).sqrt(),
            Self::Leaf => (0.28 + 3.4 * t) * (1.0 - t),
            Self::Turned(values) => curve(values, t).clamp(0.0, 1.0),
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
