//! What a backend is: list devices, open one, prepare a plan on it, solve pairs. A backend owns buffers and the five
//! kernels; order, timing and stopping are [`crate::Driver`]'s.
//!
//! Whatever can be checked without a device is checked before a backend is called: a [`Solver`] may rely on a valid
//! plan and on pairs of its size.

use std::{ops::Range, time::Duration};

use crate::{Error, Plan, Seed, Side, Stage, StereoPair};

/// A way to run plans: a processor, or an API that reaches several devices.
pub trait Backend: Sync {
    /// The name used in options and records.
    fn name(&self) -> &'static str;

    /// The devices there are, those expected to be fastest first (see [`DeviceKind`]); never fails, and is empty where
    /// there is none: [`Backend::open`] then says why.
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
    /// What it is.
    pub kind: DeviceKind,
    /// The interface that reaches it and its version, where there is one.
    pub api: Option<String>,
    /// Its driver and the driver's version, where there is one.
    pub driver: Option<String>,
    /// Memory of its own in bytes, where it has some; a processor shares the machine's.
    pub memory_bytes: Option<u64>,
    /// The universally unique identifier that its driver gives it, in lower-case hexadecimal with hyphens.
    pub uuid: Option<String>,
    /// How many threads work at once; 1 for a device that is asked as one.
    pub workers: usize,
}

/// What a device is, in the order in which devices of a backend are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DeviceKind {
    /// The machine's own processor, asked without detours.
    Processor,
    /// A GPU with memory of its own.
    DiscreteGpu,
    /// A GPU that shares the machine's memory.
    IntegratedGpu,
    /// A GPU lent by a virtual machine.
    VirtualGpu,
    /// Something else that computes.
    Other,
    /// A processor that pretends to be a GPU; its times are never a GPU's.
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
    /// Allocates everything that solving `plan` needs.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] and [`Error::Unsupported`], both before anything is allocated where that can be told, and
    /// those of the device.
    fn prepare(&self, plan: &Plan) -> Result<Box<dyn Solver>, Error>;

    /// Whether the device can run a plan at all, told without allocating anything: it can by default.
    ///
    /// # Errors
    /// [`Error::Unsupported`] and [`Error::OutOfMemory`] where [`Device::prepare`] would say so.
    fn check(&self, plan: &Plan) -> Result<(), Error> {
        let _ = plan;
        Ok(())
    }

    /// Bytes that [`Device::prepare`] will allocate: by default [`Plan::bytes`]. A device may pad
    /// buffers, or do without some of them.
    fn planned_bytes(&self, plan: &Plan) -> u64 {
        plan.bytes()
    }

    /// Bytes a second that the device reads and writes, together, while it copies its own memory: what its kernels are
    /// measured by. `None` where that says nothing.
    ///
    /// # Errors
    /// Those of the device.
    fn copy_rate(&self) -> Result<Option<f64>, Error> {
        Ok(None)
    }
}

/// The five kernels over the buffers of one plan. Nothing is allocated after [`Device::prepare`].
///
/// A kernel may merely enqueue its work, in the order of the calls; [`Solver::select_labels`] waits for all of it. A
/// device that does so tells by [`Solver::device_times`] how long each stage really took.
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

    /// In place of [`Solver::refine`] of grid 0, after a solve that was not stopped and before any coarser grid is
    /// refined again: makes the messages that grid 0 holds its first messages. Not under
    /// [`crate::Schedule::Sweep`]; see [`crate::Driver::solve_warm_observed`].
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the plan's messages are not kept, and those of the device.
    fn keep_messages(&mut self) -> Result<(), Error>;

    /// Runs these steps of the schedule on `grid`.
    ///
    /// # Errors
    /// Those of the device.
    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error>;

    /// Writes the label of least belief of every pixel, the smallest on ties, `[height][width]`; under
    /// [`crate::Schedule::Sweep`] labels are decided one after another as told there.
    ///
    /// # Errors
    /// Those of the device.
    fn select_labels(&mut self, labels: &mut [u16]) -> Result<(), Error>;

    /// Copies out what every node of grid 0 last received from the neighbour on `side`, `[height][width][labels]`;
    /// zeros where no message comes from there, or where under [`crate::Schedule::Sweep`] the edge holds the one that
    /// went the other way. Not a kernel: for comparing backends.
    ///
    /// # Errors
    /// Those of the device.
    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error>;

    /// How many steps it likes to be asked for at once, at least 1: a backend that fuses steps says how many, `u32::MAX`
    /// where all steps on a grid are one piece of work. Progress is told and stopping is possible between calls only.
    fn fused_steps(&self) -> u32 {
        1
    }

    /// Time of each stage since the last [`Solver::match_cost`] by the device's own clock, in the order of
    /// [`Stage::ALL`]; `None` where the device has none.
    fn device_times(&mut self) -> Option<[Duration; Stage::ALL.len()]> {
        None
    }

    /// Bytes that each stage has to read and write at least since the last [`Solver::match_cost`], each value of a step
    /// counted once, in the order of [`Stage::ALL`]; `None` where the device does not count.
    fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        None
    }

    /// Time that compiling kernels took within [`Device::prepare`], where the device compiles any.
    fn compile_time(&self) -> Option<Duration> {
        None
    }

    /// Bytes that this solver allocated, counted.
    fn allocated_bytes(&self) -> u64;
}
