//! Places on a surface.

/// A place in a surface's own coordinates.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// Share of the spine, 0..=1 inside.
    pub(super) t: f64,
    /// Distance from the spine as a share of the greatest half width; with sign.
    pub(super) aside: f64,
    /// The half width here as a share of the greatest.
    pub(super) rim: f64,
    /// Pixels along and across the spine.
    pub(super) along: f64,
    pub(super) across: f64,
}

impl Spot {
    /// Whether the surface covers the place.
    pub(super) fn is_inside(&self) -> bool {
        0.0 <= self.t && self.t <= 1.0 && self.aside.abs() <= self.rim
    }
}
