//! What tiles match around what they keep.

use super::tile::SHARED;
use crate::{BAND_ROWS, Patch, Plan, Schedule, Size};

/// Tiles begin at multiples of this many columns and rows, so that on up to five grids their nodes have the same children
/// and the same colour as in the whole image.
pub(super) const ALIGN: usize = 32;

/// The columns that a tile matches on each side of those that it keeps, and its rows above and below.
pub const HALO: usize = 96;

/// The same for rows under [`Schedule::Sweep`], where less reaches a row from far above or below.
const SWEPT_ROWS_HALO: usize = 64;

/// The surroundings of tiles: with them, all pixels that a tile keeps have the whole image's costs, and messages from nearly as
/// far as matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Around {
    /// Columns to the left of those that are kept, with those that their labels match.
    pub left: usize,
    /// Columns to the right.
    pub right: usize,
    /// Rows above, and rows below.
    pub rows: usize,
    /// Tiles begin at multiples of so many columns and rows.
    pub align: Size,
}

impl Around {
    /// Columns and rows on either side of a border that two tiles may share out, see [`super::border`].
    pub const SHARED: usize = SHARED;

    /// The surroundings of a plan's tiles; `None` if an image cannot be cut into tiles: under [`Schedule::Outward`], messages
    /// reach every node from the start node, however far away.
    #[must_use]
    pub fn of(plan: &Plan) -> Option<Self> {
        Self::with(plan, HALO, reach(plan))
    }

    /// With at least so many columns and rows, and the columns on both sides that labels reach.
    pub(super) fn with(plan: &Plan, halo: usize, [left, right]: [usize; 2]) -> Option<Self> {
        let (schedule, align) = (plan.settings().schedule, align(plan));
        if let Schedule::Outward { .. } = schedule {
            return None;
        }
        let rows = if schedule == Schedule::Sweep { halo.min(SWEPT_ROWS_HALO) } else { halo };
        let columns = |reach: usize| (halo + reach).next_multiple_of(align.width);
        Some(Self { left: columns(left), right: columns(right), rows: rows.next_multiple_of(align.height), align })
    }
}

/// How many columns to the left, and to the right, labels match.
pub(super) fn reach(plan: &Plan) -> [usize; 2] {
    let model = plan.model();
    [model.disparity(model.labels() as u16 - 1), -model.min_disparity()].map(|reach| reach.max(0) as usize)
}

/// Tiles begin at multiples of this many columns and rows. With label sets, they begin where patches and bands of grid 1 do, so
/// that these are those of the whole image.
pub(super) fn align(plan: &Plan) -> Size {
    let (width, height) = if plan.has_label_sets(1) { (2 * Patch::COLUMNS, 2 * BAND_ROWS) } else { (ALIGN, ALIGN) };
    Size { width, height }
}
