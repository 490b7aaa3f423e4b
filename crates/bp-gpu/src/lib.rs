//! Code shared by the GPU backends. It turns a plan into a [`Program`] of buffers, pipelines and commands.
//!
//! A program uses only concepts that every GPU API has. A backend implements [`Queue`]: it allocates, compiles, records
//! and submits. [`GpuSolver`] does the rest. The WGSL text of the kernels is in `bp-shaders`.

mod answer;
pub mod cache;
mod check;
mod compose;
#[cfg(feature = "conformance")]
pub mod conformance;
mod copy_rate;
mod group;
mod kernel;
mod layout;
mod limits;
pub mod missing;
mod parameters;
mod program;
mod queue;
mod segment;
mod shape;
mod solver;

pub use check::check;
pub use copy_rate::copy_rate;
pub use kernel::{Access, Kernel, Pipeline, WORKGROUP};
pub use limits::Limits;
pub use parameters::Parameters;
pub use program::{BindGroup, Buffer, Command, Memory, Program, Segment};
pub use queue::{PATIENCE, Queue};
pub use shape::Shape;
pub use solver::{GpuSolver, check_warm};
