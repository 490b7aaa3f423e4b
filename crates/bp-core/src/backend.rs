//! The traits of a backend: it lists devices, opens one, prepares a plan on it and solves pairs.
//!
//! A backend owns the buffers and the five kernels. [`crate::Driver`] calls the kernels in order, measures their times
//! and can stop a solve. It checks everything that needs no device, so a [`Solver`] may rely on a valid plan and on
//! pairs of its size.

use std::{
    ops::{ControlFlow, Range},
    time::Duration,
};

use crate::{Error, IsStopped, Plan, Seed, Side, Stage, StereoPair};

/// A way to run plans: the CPU, or an API with several devices.
pub trait Backend: Sync {
    /// The name used in options and records.
    fn name(&self) -> &'static str;

    /// Lists the devices, starting with the probably fastest one (see [`DeviceKind`]). Never fails: if there are no
    /// devices, the list is empty, and [`Backend::open`] reports the reason.
    fn devices(&self) -> Vec<DeviceInfo>;

    /// Opens a device by its index in [`Backend::devices`].
    ///
    /// # Errors
    /// [`Error::Unavailable`] with the reason.
    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error>;
}

/// What is known about a device before it is opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// The name of the device.
    pub name: String,
    /// The kind of device.
    pub kind: DeviceKind,
    /// The API used to access it, with the version, if any.
    pub api: Option<String>,
    /// Its driver, with the version, if any.
    pub driver: Option<String>,
    /// The size of its own memory in bytes, if it has any. A CPU shares the machine's memory.
    pub memory_bytes: Option<u64>,
    /// The UUID that its driver reports, in lower-case hexadecimal with hyphens.
    pub uuid: Option<String>,
    /// How many threads run at the same time; 1 for a GPU.
    pub workers: usize,
}

/// Kinds of devices, in the order in which a backend lists its devices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DeviceKind {
    /// The machine's CPU, without an API in between.
    Processor,
    /// A GPU with its own memory.
    DiscreteGpu,
    /// A GPU that shares the machine's memory.
    IntegratedGpu,
    /// A GPU provided by a virtual machine.
    VirtualGpu,
    /// Any other compute device.
    Other,
    /// A GPU driver that runs on the CPU. Its times say nothing about GPUs.
    SoftwareRasteriser,
}

impl DeviceKind {
    /// All kinds, in order.
    pub const ALL: [Self; 6] = [
        Self::Processor,
        Self::DiscreteGpu,
        Self::IntegratedGpu,
        Self::VirtualGpu,
        Self::Other,
        Self::SoftwareRasteriser,
    ];

    /// The name used in lists and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Processor => "processor",
            Self::DiscreteGpu => "discrete GPU",
            Self::IntegratedGpu => "integrated GPU",
            Self::VirtualGpu => "virtual GPU",
            Self::Other => "other device",
            Self::SoftwareRasteriser => "software rasteriser",
        }
    }
}

/// An open device.
pub trait Device: Send + Sync {
    /// Allocates everything that solving `plan` needs, unless it is stopped. A device that cannot be stopped here ignores
    /// `is_stopped`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] and [`Error::Unsupported`], if possible before any allocation, [`Error::Stopped`], and errors of
    /// the device.
    fn prepare(&self, plan: &Plan, is_stopped: IsStopped<'_>) -> Result<Box<dyn Solver>, Error>;

    /// Checks that the device can run a plan, without allocating anything. The default accepts every plan.
    ///
    /// # Errors
    /// [`Error::Unsupported`] and [`Error::OutOfMemory`], as [`Device::prepare`] would report.
    fn check(&self, plan: &Plan) -> Result<(), Error> {
        let _ = plan;
        Ok(())
    }

    /// Checks that a solve of the plan can start from the messages of the solve before. The default accepts every plan.
    ///
    /// # Errors
    /// [`Error::Unsupported`], as [`Solver::keep_messages`] would report.
    fn check_warm(&self, plan: &Plan) -> Result<(), Error> {
        let _ = plan;
        Ok(())
    }

    /// The bytes that [`Device::prepare`] will allocate, by default [`Plan::bytes`]. Devices may pad or omit buffers.
    fn planned_bytes(&self, plan: &Plan) -> u64 {
        plan.bytes()
    }

    /// The bytes that a solver will probably hold in the end: with label sets, possibly fewer than planned. By default
    /// [`Device::planned_bytes`].
    fn likely_bytes(&self, plan: &Plan) -> u64 {
        self.planned_bytes(plan)
    }

    /// Measures the total bytes per second that the device reads and writes while it copies its own memory. This is an
    /// upper bound for its kernels. `None` if the rate is not meaningful.
    ///
    /// # Errors
    /// Errors of the device.
    fn copy_rate(&self) -> Result<Option<f64>, Error> {
        Ok(None)
    }
}

/// The five kernels, and the buffers of one plan. It allocates nothing after [`Device::prepare`], except that
/// with label sets it may allocate what they need when they are known.
///
/// A kernel may only enqueue its work, in the order of the calls; [`Solver::select_labels`] then waits for all of it.
/// Such a device reports the actual time of each stage through [`Solver::device_times`].
pub trait Solver: Send {
    /// Computes the data costs of grid 0 from a pair of the size [`Plan::pair_size`]. Its nodes begin at the column
    /// [`Plan::margin`]. A `seed` sets the costs around the cut.
    ///
    /// # Errors
    /// Errors of the device.
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error>;

    /// Computes the data costs of `grid`, at least 1, from those of the next finer grid.
    ///
    /// # Errors
    /// Errors of the device.
    fn coarsen(&mut self, grid: usize) -> Result<(), Error>;

    /// Sets the first messages of `grid`: zeros on the coarsest grid, otherwise those made from the next coarser grid's. Under
    /// [`crate::Schedule::Sweep`] it also prepares the seams. A backend may do all this in [`Solver::update_messages`].
    ///
    /// # Errors
    /// Errors of the device.
    fn refine(&mut self, grid: usize) -> Result<(), Error>;

    /// Starts grid 0 with the messages that it already holds. Called instead of [`Solver::refine`], only after a solve
    /// that was not stopped, before any coarser grid is refined again, and never under [`crate::Schedule::Sweep`]. See
    /// [`crate::Driver::solve_warm_observed`].
    ///
    /// # Errors
    /// [`Error::Unsupported`] if the device does not keep this plan's messages, and errors of the device.
    fn keep_messages(&mut self) -> Result<(), Error>;

    /// Runs these steps of the schedule on `grid`.
    ///
    /// # Errors
    /// Errors of the device.
    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error>;

    /// Passes all messages on these grids, from the coarsest to the finest, if the solver works on several grids at the same time.
    /// Then this replaces [`Solver::refine`] and [`Solver::update_messages`]. Calls `passed` with the message entries so far,
    /// counted as [`Plan::grid_updates`] does. Returns `false`, as the default does, if grids are to be passed one after another.
    ///
    /// # Errors
    /// [`Error::Stopped`] if `passed` breaks, and errors of the device.
    fn pass_messages(
        &mut self,
        grids: Range<usize>,
        passed: &mut (dyn FnMut(u64) -> ControlFlow<()> + Send),
    ) -> Result<bool, Error> {
        let _ = (grids, passed);
        Ok(false)
    }

    /// Writes the label with the lowest belief of every node of `grid`, `[height][width]`; the smallest label wins a tie. Under
    /// [`crate::Schedule::Sweep`] labels are decided one after another, as described there. `grid` is the one whose messages
    /// were updated last: 0, or [`Plan::halved`].
    ///
    /// # Errors
    /// Errors of the device.
    fn select_labels(&mut self, grid: usize, labels: &mut [u16]) -> Result<(), Error>;

    /// Copies the last message that every node of grid 0 received from `side`, `[height][width][labels]`. Writes zeros
    /// where no message comes from that side, or where the edge holds the opposite message under
    /// [`crate::Schedule::Sweep`]. This is not a kernel: it is used to compare backends.
    ///
    /// # Errors
    /// Errors of the device.
    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error>;

    /// Preferred number of steps per call, at least 1. A backend that fuses steps returns how many, or `u32::MAX` if it
    /// runs all steps on a grid together. A solve reports progress and can stop between calls, and where [`Solver::pass_messages`]
    /// does.
    fn fused_steps(&self) -> u32 {
        1
    }

    /// The time of each stage since the last [`Solver::match_cost`] by the device's own clock, in the order of
    /// [`Stage::ALL`]. `None` if the device has no clock.
    fn device_times(&mut self) -> Option<[Duration; Stage::ALL.len()]> {
        None
    }

    /// The minimum number of bytes that each stage has read and written since the last [`Solver::match_cost`], in the
    /// order of [`Stage::ALL`]. Each value counts once per step. `None` if the device does not count.
    fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        None
    }

    /// The message entries that the last solve computed, if label sets made them fewer than [`Plan::message_updates`].
    fn message_updates(&self) -> Option<u64> {
        None
    }

    /// The time that [`Device::prepare`] spent on compiling kernels, if the device compiles any.
    fn compile_time(&self) -> Option<Duration> {
        None
    }

    /// The bytes that this solver has actually allocated.
    fn allocated_bytes(&self) -> u64;

    /// Sets the most bytes that it may allocate. A solver that allocates nothing after [`Device::prepare`] ignores this.
    /// Others return [`Error::OutOfMemory`] from [`Solver::update_messages`] before they would exceed it.
    fn limit_bytes(&mut self, bytes: u64) {
        let _ = bytes;
    }
}
