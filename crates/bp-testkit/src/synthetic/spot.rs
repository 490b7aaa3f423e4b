//! Places on a surface.

/// A place in a surface's own coordinates.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// The position along the spine, from 0 to 1 inside the surface.
    pub(super) t: f64,
    /// The signed distance from the spine, as a share of the greatest half width.
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
