//! What a backend is: list devices, open one, prepare a plan on it, solve pairs. A backend owns buffers and the five
//! kernels; order, timing and stopping are [`crate::Matcher`]'s.
//!
//! Whatever can be checked without a device is checked before a backend is called: a [`Solver`] may rely on a valid
//! plan and on pairs of its size.

use std::ops::Range;

use crate::{Error, Plan, Seed, StereoPair};

/// A way to run plans: a processor, or an API that reaches several devices.
pub trait Backend: Sync {
    /// The name used in options and records.
    fn name(&self) -> &'static str;

    /// The devices there are; never fails, and is empty where there is none.
    fn devices(&self) -> Vec<DeviceInfo>;

    /// Opens a device by its index in [`Backend::devices`].
    ///
    /// # Errors
    /// [`Error::Unavailable`] with the reason.
    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error>;
}

/// What is known of a device before it is opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Name of the device.
    pub name: String,
    /// Whether a CPU pretends to be a GPU there; its times are never a GPU's.
    pub software_rasteriser: bool,
}

/// An open device.
pub trait Device {
    /// Allocates everything that solving `plan` needs.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    fn prepare(&self, plan: &Plan) -> Result<Box<dyn Solver>, Error>;
}

/// The five kernels over the buffers of one plan. Nothing is allocated after [`Device::prepare`].
pub trait Solver: Send {
    /// Computes the data costs of grid 0 from a pair; `seed` fixes those around the cut.
    ///
    /// # Errors
    /// Those of the device.
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error>;

    /// Computes the data costs of `grid`, at least 1, from the next finer grid's.
    ///
    /// # Errors
    /// Those of the device.
    fn coarsen(&mut self, grid: usize) -> Result<(), Error>;

    /// Sets the first messages of `grid`: zeros on the coarsest grid, else copies from the next coarser one.
    ///
    /// # Errors
    /// Those of the device.
    fn refine(&mut self, grid: usize) -> Result<(), Error>;

    /// Runs these steps of the schedule on `grid`.
    ///
    /// # Errors
    /// Those of the device.
    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error>;

    /// Writes the label of least belief of every pixel, the smallest on ties, [height][width].
    ///
    /// # Errors
    /// Those of the device.
    fn select_labels(&mut self, labels: &mut [u16]) -> Result<(), Error>;

    /// Copies out what every node of grid 0 last received from the neighbour on `side`, [height][width][labels]; zeros
    /// where no message comes from there. Not a kernel: for comparing backends.
    ///
    /// # Errors
    /// Those of the device.
    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error>;

    /// How many steps it likes to be asked for at once, at least 1: a backend that fuses steps says how many. Progress
    /// is told and stopping is possible between calls only.
    fn fused_steps(&self) -> u32 {
        1
    }

    /// Bytes that this solver allocated, counted.
    fn allocated_bytes(&self) -> u64;
}

/// Where a neighbour lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// (x - 1, y).
    Left,
    /// (x + 1, y).
    Right,
    /// (x, y - 1).
    Up,
    /// (x, y + 1).
    Down,
}

impl Side {
    /// All sides, in the order in which messages are stored and hashed.
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::Up, Self::Down];

    /// The side seen from the neighbour.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            Self::Up => Self::Down,
            Self::Down => Self::Up,
        }
    }
}

impl Plan {
    /// The node of `grid` that (x, y) exchanges messages with on `side`; `None` at the border and across a cut.
    ///
    /// # Panics
    /// Where there is no such grid.
    #[must_use]
    pub fn neighbour(&self, grid: usize, (x, y): (usize, usize), side: Side) -> Option<(usize, usize)> {
        let size = self.size(grid);
        let (cut_x, cut_y) = self.settings().cut.map_or((0, 0), |cut| (cut.x, cut.y));
        match side {
            Side::Left => (x > 0 && x != cut_x).then(|| (x - 1, y)),
            Side::Right => (x + 1 < size.width && x + 1 != cut_x).then_some((x + 1, y)),
            Side::Up => (y > 0 && y != cut_y).then(|| (x, y - 1)),
            Side::Down => (y + 1 < size.height && y + 1 != cut_y).then_some((x, y + 1)),
        }
    }
}
