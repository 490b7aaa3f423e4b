//! The buffers of a program.

use bp_core::{BAND_ROWS, Patch, Plan, Schedule, Seam, Size};

use crate::{
    Buffer, Limits, Memory, Shape,
    answer::{SEED_BYTES, image_bytes, label_bytes},
    layout::Grid,
    segment,
};

/// Sizes are rounded up to a multiple of this, the largest alignment of any device, so that buffers leave no gaps.
const BUFFER_ALIGNMENT: u64 = 256;

/// The indices of a strip's buffers, for colours 0 and 1.
pub(crate) struct StripBuffers {
    /// The stored data costs.
    pub(crate) cost: [usize; 2],
    /// The unclipped data costs.
    pub(crate) sums: Option<[usize; 2]>,
    /// The messages sent, `[set][side][colour]`: two sets under [`Schedule::Sync`], otherwise one.
    pub(crate) sent: Vec<[[usize; 2]; 4]>,
}

/// All buffers and their indices.
pub(crate) struct Buffers {
    pub(crate) list: Vec<Buffer>,
    /// Bytes of the left and the right image.
    pub(crate) images: [usize; 2],
    /// The features of both images.
    pub(crate) features: [usize; 2],
    pub(crate) seed: usize,
    /// The labels of all grids where they are decided, from the finest one on.
    pub(crate) labels: Vec<usize>,
    /// The label sets of a grid, if any has some.
    pub(crate) label_sets: Option<usize>,
    /// What the workgroups of `pass_rows` sent, and the labels decided for seams, if the plan sweeps in the shape of slices.
    pub(crate) own: Option<usize>,
    pub(crate) seam_labels: Option<usize>,
    /// Bound in place of sums that are not kept: one buffer to read, one to write.
    pub(crate) unused: usize,
    pub(crate) unused_written: usize,
    /// Grey values of the whole grid, `[grid]`, if the model has edges of several levels.
    pub(crate) greys: Option<Vec<usize>>,
    /// Costs of the edges of the whole grid, `[grid]`, likewise in the shape of slices.
    pub(crate) edges: Option<Vec<usize>>,
    /// `[grid][strip]`.
    pub(crate) strips: Vec<Vec<StripBuffers>>,
}

impl Buffers {
    pub(crate) fn new(plan: &Plan, grids: &[Grid], limits: &Limits) -> Self {
        let (size, pair_size) = (plan.image_size(), plan.pair_size());
        let mut list = Vec::new();
        let mut add = |name, bytes: u64, memory| {
            list.push(Buffer { name, bytes: bytes.next_multiple_of(BUFFER_ALIGNMENT), memory });
            list.len() - 1
        };
        // In the order of Program::PARAMETERS, UPLOAD and DOWNLOAD. The size of the first is not known yet.
        add("parameters", 0, Memory::Device);
        add("upload", 2 * image_bytes(pair_size) + SEED_BYTES, Memory::Upload);
        add("download", label_bytes(size), Memory::Download);
        let mut device = |name, bytes| add(name, bytes, Memory::Device);
        let features = 4 * pair_size.pixels() as u64;
        let in_segments = plan.settings().schedule == Schedule::Sweep && limits.shape == Shape::Slices;
        Self {
            images: [(); 2].map(|()| device("images", image_bytes(pair_size))),
            features: [(); 2].map(|()| device("features", features)),
            seed: device("seed", SEED_BYTES),
            labels: (0..plan.grids())
                .filter(|&grid| plan.decides_labels(grid))
                .map(|grid| device("labels", label_bytes(plan.size(grid))))
                .collect(),
            label_sets: plan.has_label_sets(0).then(|| device("label sets", label_set_bytes(plan))),
            own: in_segments.then(|| {
                let most = limits.binding_bytes.min(limits.buffer_bytes);
                let bytes = grids.iter().map(|grid| segment::all_own_bytes(grid, most)).max().unwrap_or(0);
                device("messages of segments", bytes)
            }),
            seam_labels: in_segments.then(|| device("labels of seams", seam_label_bytes(&grids[0]))),
            unused: device("unused", 16),
            unused_written: device("unused", 16),
            greys: (!plan.model().edges().is_uniform())
                .then(|| grids.iter().map(|grid| device("grey values", grid.grey_bytes())).collect()),
            edges: (!plan.model().edges().is_uniform() && limits.shape == Shape::Slices)
                .then(|| grids.iter().map(|grid| device("costs of edges", grid.edge_bytes())).collect()),
            strips: grids.iter().map(|grid| strips(plan, grid, &mut device)).collect(),
            list,
        }
    }
}

/// The bytes of the labels of a row above every seam.
fn seam_label_bytes(grid: &Grid) -> u64 {
    let seams = Seam::all(grid.size.height).len().max(1);
    label_bytes(Size { height: seams, ..grid.size })
}

/// The 32-bit words of a label set.
fn label_set_words(plan: &Plan) -> usize {
    plan.model().labels().div_ceil(32)
}

/// The bytes of the label sets of all bands of grid 0.
fn label_set_bytes(plan: &Plan) -> u64 {
    let Size { width, height } = plan.image_size();
    let patches = width.div_ceil(Patch::COLUMNS) * height.div_ceil(BAND_ROWS);
    (patches * label_set_words(plan) * size_of::<u32>()) as u64
}

fn strips(plan: &Plan, grid: &Grid, device: &mut impl FnMut(&'static str, u64) -> usize) -> Vec<StripBuffers> {
    let sets = if plan.settings().schedule == Schedule::Sync { 2 } else { 1 };
    let strip = |&strip| {
        let plane = grid.plane_bytes(strip);
        let mut colours = |name, bytes| [(); 2].map(|()| device(name, bytes));
        StripBuffers {
            cost: colours("data cost", plane),
            sums: (grid.sum_bytes > 0).then(|| colours("data cost sums", grid.sums_bytes(strip))),
            sent: (0..sets).map(|_| [(); 4].map(|()| colours("messages", plane))).collect(),
        }
    };
    grid.strips.iter().map(strip).collect()
}
