//! The plan: what runs, and how much work and memory it needs. All of this is known in advance.

mod traffic;
mod updates;

use crate::{Error, MessageStart, Model, Node, Schedule, Seam, Settings, Side, Size};

/// The most grids of a plan. This many reduce the longest side, [`crate::MAX_SIDE`], to 1.
pub const MAX_GRIDS: u32 = 25;

/// Settings that were checked against an image size and a model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    model: Model,
    settings: Settings,
    sizes: Vec<Size>,
    margin: usize,
}

impl Plan {
    /// Makes a plan for pairs of `size`.
    ///
    /// # Errors
    /// [`Error::Plan`] if a count is 0, there are more than [`MAX_GRIDS`] grids, a cut lies outside the image or comes with
    /// more than one grid, or [`MessageStart::Sender`] comes with [`Schedule::Sweep`], or label sets with another schedule, or
    /// [`Schedule::Outward`] starts outside the image or comes with more than one grid. Also the errors of [`Size::new`].
    pub fn new(size: Size, model: Model, settings: Settings) -> Result<Self, Error> {
        let size = Size::new(size.width, size.height)?;
        if settings.grids == 0 || settings.steps == 0 {
            return Err(Error::Plan("a plan needs at least one grid and one step on it"));
        }
        if settings.grids > MAX_GRIDS {
            return Err(Error::Plan("a plan has at most 25 grids"));
        }
        if settings.cut.is_some_and(|cut| cut.x >= size.width || cut.y >= size.height) {
            return Err(Error::Plan("the cut lies outside the image"));
        }
        if settings.cut.is_some() && settings.grids > 1 {
            return Err(Error::Plan("an image that is cut into parts has one grid"));
        }
        if let Schedule::Outward { start } = settings.schedule {
            if settings.grids > 1 {
                return Err(Error::Plan("the schedule outward has one grid"));
            }
            if start.x >= size.width || start.y >= size.height {
                return Err(Error::Plan("the start node lies outside the image"));
            }
        }
        if settings.schedule == Schedule::Sweep && settings.message_start == MessageStart::Sender {
            return Err(Error::Plan("message start sender has no meaning under the schedule sweep"));
        }
        if settings.label_sets && settings.schedule != Schedule::Sweep {
            return Err(Error::Plan("label sets need the schedule sweep"));
        }
        let sizes =
            std::iter::successors(Some(size), |size| Some(size.coarser())).take(settings.grids as usize).collect();
        Ok(Self { model, settings, sizes, margin: 0 })
    }

    /// The same plan for pairs that have `margin` more columns on the left, which its nodes do not cover but match.
    ///
    /// # Errors
    /// Those of [`Size::new`] for such a pair.
    pub fn with_margin(self, margin: usize) -> Result<Self, Error> {
        let Size { width, height } = self.image_size();
        Size::new(width.saturating_add(margin), height)?;
        Ok(Self { margin, ..self })
    }

    /// The labels, the data cost and the smoothness.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The number of grids. Their indices are `0..grids()`.
    #[must_use]
    pub fn grids(&self) -> usize {
        self.sizes.len()
    }

    /// The size of the image, which is grid 0.
    #[must_use]
    pub fn image_size(&self) -> Size {
        self.sizes[0]
    }

    /// The number of columns to the left of the nodes of grid 0 that a pair has; not 0 only for a [`crate::Part`] or a
    /// [`crate::Tile`]. The nodes match these columns of the right image.
    #[must_use]
    pub fn margin(&self) -> usize {
        self.margin
    }

    /// The size of a pair: that of the image with the margin.
    #[must_use]
    pub fn pair_size(&self) -> Size {
        Size { width: self.sizes[0].width + self.margin, ..self.sizes[0] }
    }

    /// The size of a grid.
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn size(&self, grid: usize) -> Size {
        self.sizes[grid]
    }

    /// The number of data costs of a grid: nodes times labels.
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn volume(&self, grid: usize) -> usize {
        self.sizes[grid].pixels().saturating_mul(self.model.labels())
    }

    /// The neighbour on `side` that a node of `grid` exchanges messages with; `None` at the border and across a cut.
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn neighbour(&self, grid: usize, node: Node, side: Side) -> Option<Node> {
        let size = self.size(grid);
        let Node { x, y } = node;
        let (cut_x, cut_y) = self.settings().cut.map_or((0, 0), |cut| (cut.x, cut.y));
        match side {
            Side::Left => (x > 0 && x != cut_x).then(|| Node { x: x - 1, y }),
            Side::Right => (x + 1 < size.width && x + 1 != cut_x).then_some(Node { x: x + 1, y }),
            Side::Up => (y > 0 && y != cut_y).then(|| Node { x, y: y - 1 }),
            Side::Down => (y + 1 < size.height && y + 1 != cut_y).then_some(Node { x, y: y + 1 }),
        }
    }

    /// The number of pairs of neighbours on a grid that exchange messages.
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn edges(&self, grid: usize) -> u64 {
        let Size { width, height } = self.sizes[grid];
        let (width, height) = (width as u64, height as u64);
        let all = (width - 1) * height + width * (height - 1);
        let cut = self.settings.cut.map_or(0, |cut| {
            let vertical = if cut.x > 0 { height } else { 0 };
            vertical + if cut.y > 0 { width } else { 0 }
        });
        all - cut
    }

    /// The value at which stored data costs of a grid are clipped: [`Model::clip`], which never changes a result, or the
    /// lower `K + K div 2` of [`Settings::coarse_clip`], which does.
    #[must_use]
    pub fn clip(&self, grid: usize) -> u8 {
        let truncation = self.model.truncation();
        if grid > 0 && self.settings.coarse_clip { truncation + truncation / 2 } else { self.model.clip() }
    }

    /// The number of grids that have label sets with so many labels, from the finest one on, if there are coarser ones: two, and
    /// from 224 on three, because the third one's labels would be most of the work.
    #[must_use]
    pub const fn most_grids_with_label_sets(labels: usize) -> usize {
        if labels < 224 { 2 } else { 3 }
    }

    /// Whether the nodes of a grid have label sets, under [`Settings::label_sets`]: those finer than
    /// [`Plan::finest_with_all_labels`].
    #[must_use]
    pub fn has_label_sets(&self, grid: usize) -> bool {
        grid < self.finest_with_all_labels()
    }

    /// The finest grid without label sets: 0, if no grid has any.
    #[must_use]
    pub fn finest_with_all_labels(&self) -> usize {
        if !self.settings.label_sets || self.grids() < 3 {
            return 0;
        }
        Self::most_grids_with_label_sets(self.model.labels()).min(self.grids() - 1)
    }

    /// Whether the labels of a grid are decided: those of grid 0, and those that determine label sets.
    #[must_use]
    pub fn decides_labels(&self, grid: usize) -> bool {
        grid.checked_sub(1).is_none_or(|finer| self.has_label_sets(finer))
    }

    /// The grid that answers a solve at half the resolution: 1 if its labels are decided in any case, otherwise 0. See
    /// [`crate::Driver::solve_halved_observed`].
    #[must_use]
    pub fn halved(&self) -> usize {
        usize::from(self.has_label_sets(0))
    }

    /// The most labels that determine the label sets of a grid: those of grid 1. The labels of coarser grids lie in the same
    /// place before.
    #[must_use]
    pub fn coarser_labels(&self) -> usize {
        if self.has_label_sets(0) { self.size(1).pixels() } else { 0 }
    }

    /// Whether a grid keeps its unclipped costs too. The next coarser grid needs them for its sums if the stored costs may
    /// have been clipped, and label sets need them for the costs of their labels.
    #[must_use]
    pub fn keeps_sums(&self, grid: usize) -> bool {
        let clipped = self.model.max_cost(grid) > u64::from(self.clip(grid));
        grid + 1 < self.grids() && clipped || self.has_label_sets(grid)
    }

    /// The bytes of one such sum: the fewest of 1, 2, 4 and 8 that hold the largest sum.
    #[must_use]
    pub fn sum_bytes(&self, grid: usize) -> usize {
        match self.model.max_cost(grid) {
            0..=0xff => 1,
            0x100..=0xffff => 2,
            0x1_0000..=0xffff_ffff => 4,
            _ => 8,
        }
    }

    /// The buffers of a straightforward implementation. A backend may pad them or omit some; see
    /// [`crate::Device::planned_bytes`].
    ///
    /// It keeps the messages of two grids at a time: two messages per edge, and two edges per node. Messages are double
    /// buffered under [`Schedule::Sync`]. Under [`Schedule::Sweep`] it keeps one message per edge, and two per edge of a seam
    /// with the labels of the rows above it.
    #[must_use]
    pub fn buffers(&self) -> Vec<Buffer> {
        let pixels = self.image_size().pixels() as u64;
        let channels = self.model.profile().channels() as u64;
        let mut buffers = vec![
            Buffer { name: "images", grid: 0, bytes: 2 * channels * self.pair_size().pixels() as u64 },
            Buffer { name: "labels", grid: 0, bytes: 2 * pixels },
        ];
        for grid in 0..self.grids() {
            let volume = self.volume(grid) as u64;
            buffers.push(Buffer { name: "data cost", grid, bytes: volume });
            if self.grey_bytes(grid) > 0 {
                buffers.push(Buffer { name: "grey values", grid, bytes: self.grey_bytes(grid) });
            }
            if self.keeps_sums(grid) {
                let bytes = volume.saturating_mul(self.sum_bytes(grid) as u64);
                buffers.push(Buffer { name: "data cost sums", grid, bytes });
            }
            if grid < 2 {
                let messages_per_node = match self.settings.schedule {
                    Schedule::Sync => 2 * 4,
                    Schedule::Checkerboard | Schedule::Outward { .. } => 4,
                    Schedule::Sweep => 2,
                };
                buffers.push(Buffer { name: "messages", grid, bytes: volume.saturating_mul(messages_per_node) });
            }
        }
        let seams =
            if self.settings.schedule == Schedule::Sweep { Seam::all(self.image_size().height).len() } else { 0 };
        if seams > 0 {
            let node_bytes = 2 * (self.model.labels() + Seam::LABEL_ROWS);
            let bytes = (seams * self.image_size().width) as u64 * node_bytes as u64;
            buffers.push(Buffer { name: "seams", grid: 0, bytes });
        }
        if self.has_label_sets(0) {
            buffers.push(Buffer { name: "coarser labels", grid: 1, bytes: 2 * self.coarser_labels() as u64 });
        }
        buffers
    }

    /// The bytes of the grey values that determine the levels of a grid's edges: one per node, or 0 if all edges have the same
    /// cost.
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn grey_bytes(&self, grid: usize) -> u64 {
        if self.model.edges().is_uniform() { 0 } else { self.sizes[grid].pixels() as u64 }
    }

    /// The bytes of all [`Plan::buffers`].
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.buffers().iter().fold(0, |sum, buffer| sum.saturating_add(buffer.bytes))
    }
}

/// A buffer that a plan needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Buffer {
    /// The kind of its contents.
    pub name: &'static str,
    /// The grid that it belongs to.
    pub grid: usize,
    /// Its size in bytes.
    pub bytes: u64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Algorithm, Cut, Profile};

    const BABY: Size = Size { width: 620, height: 555 };

    fn plan(algorithm: Algorithm, schedule: Schedule) -> Plan {
        let model = Model::new(Profile::Thesis, 112).unwrap();
        Plan::new(BABY, model, algorithm.settings(BABY, 112, 2, schedule)).unwrap()
    }

    #[test]
    fn updates_follow_the_formulas() {
        let all = 2 * (619 * 555 + 620 * 554) * 112;
        assert_eq!(plan(Algorithm::Bp, Schedule::Sync).message_updates(), 112 * all);
        assert_eq!(plan(Algorithm::Bp, Schedule::Checkerboard).message_updates(), 112 * all);
        let cut = 2 * (620 + 555) * 112;
        assert_eq!(plan(Algorithm::Ctbp, Schedule::Sync).message_updates(), 112 * (all - cut));
        let ratio = |algorithm| {
            let updates = plan(algorithm, Schedule::Sync).message_updates();
            plan(Algorithm::Bp, Schedule::Sync).message_updates() as f64 / updates as f64
        };
        assert!((ratio(Algorithm::Cfbp) - 7.6).abs() < 0.1, "{}", ratio(Algorithm::Cfbp));
        assert!((ratio(Algorithm::Cfcsbp) - 16.8).abs() < 0.1, "{}", ratio(Algorithm::Cfcsbp));
    }

    /// Counted by hand: 555 rows are 18 bands with 17 seams, each crossed by 620 columns.
    #[test]
    fn loops_send_nothing_across_seams_and_preparing_them_is_counted() {
        let one_grid = |cut| {
            let settings = Settings { grids: 1, cut, ..plan(Algorithm::Sweep, Schedule::Sweep).settings };
            Plan::new(BABY, Model::new(Profile::Thesis, 1).unwrap(), settings).unwrap()
        };
        let cut_at = |y| Some(Cut { x: 0, y, seed_start: false });
        let all = 2 * (619 * 555 + 620 * 554);
        let seam = 16 * 619 + 15 * 620 + 10 * (619 + 620);
        assert_eq!(one_grid(None).message_updates(), all - 17 * 2 * 620 + 17 * seam);
        assert_eq!(one_grid(cut_at(100)).message_updates(), all - 18 * 2 * 620 + 17 * seam);
        assert_eq!(one_grid(cut_at(31)).message_updates(), all - 18 * 2 * 620 + 17 * seam - 2 * 620);
        assert_eq!(one_grid(cut_at(32)).message_updates(), all - 17 * 2 * 620 + 17 * seam - 2 * 620);
        let coarse = plan(Algorithm::Sweep, Schedule::Sweep);
        assert_eq!(coarse.size(3), Size { width: 78, height: 70 });
        assert_eq!(coarse.seam_updates(3), 2 * 112 * (16 * 77 + 15 * 78 + 4 * (77 + 78)));
        let messages =
            |plan: &Plan| plan.buffers().iter().filter(|b| b.name == "messages").map(|b| b.bytes).sum::<u64>();
        assert_eq!(messages(&one_grid(None)), 2 * 620 * 555);
    }

    #[test]
    fn coarse_grids_are_clipped_lower_where_asked() {
        let clipped = plan(Algorithm::Sweep, Schedule::Sweep);
        assert_eq!([0, 1, 4].map(|grid| clipped.clip(grid)), [69, 25, 25]);
        assert_eq!([0, 1, 2, 3, 4].map(|grid| clipped.keeps_sums(grid)), [false, true, true, true, false]);
        assert_eq!(plan(Algorithm::Cfbp, Schedule::Sweep).clip(1), 69);
    }

    #[test]
    fn sums_are_kept_where_costs_may_be_clipped() {
        let plan = plan(Algorithm::Cfbp, Schedule::Sync);
        let kept: Vec<_> = (0..9).map(|grid| (plan.keeps_sums(grid), plan.sum_bytes(grid))).collect();
        let expected = [0, 0, 1, 2, 2, 2, 2, 4, 0].map(|bytes| bytes > 0);
        assert_eq!(kept.iter().map(|k| k.0).collect::<Vec<_>>(), expected);
        assert_eq!(kept.iter().map(|k| k.1).collect::<Vec<_>>(), [1, 1, 1, 2, 2, 2, 2, 4, 4]);
    }

    #[test]
    fn impossible_settings_are_refused() {
        let model = Model::new(Profile::Thesis, 4).unwrap();
        let settings = Algorithm::Ctbp.settings(BABY, 4, 2, Schedule::Sync);
        let with = |change: fn(&mut Settings)| {
            let mut settings = settings;
            change(&mut settings);
            Plan::new(BABY, model, settings)
        };
        assert!(with(|_| ()).is_ok());
        assert!(with(|s| s.grids = 0).is_err());
        assert!(with(|s| s.steps = 0).is_err());
        assert!(with(|s| s.grids = 2).is_err());
        assert!(with(|s| s.cut = Some(Cut { x: 620, y: 0, seed_start: true })).is_err());
        assert!(with(|s| (s.cut, s.grids) = (None, MAX_GRIDS + 1)).is_err());
        assert!(with(|s| (s.schedule, s.message_start) = (Schedule::Sweep, MessageStart::Sender)).is_err());
        assert!(with(|s| s.schedule = Schedule::Outward { start: Node { x: 619, y: 554 } }).is_ok());
        assert!(with(|s| s.schedule = Schedule::Outward { start: Node { x: 619, y: 555 } }).is_err());
        assert!(
            with(|s| (s.schedule, s.cut, s.grids) = (Schedule::Outward { start: Node { x: 0, y: 0 } }, None, 2))
                .is_err()
        );
    }
}
