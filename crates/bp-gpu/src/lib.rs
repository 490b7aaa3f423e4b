//! What both GPU backends do with a plan.
//!
//! Both GPU backends run the same [`Program`]: buffers, pipelines and commands in terms that any API has. A backend
//! only allocates, compiles, records and submits, which is what [`Queue`] asks for; [`GpuSolver`] does the rest.

mod answer;
pub mod cache;
mod check;
mod compose;
#[cfg(feature = "conformance")]
pub mod conformance;
mod copy_rate;
mod kernel;
mod layout;
mod limits;
pub mod missing;
mod parameters;
mod program;
mod queue;
mod solver;

pub use check::check;
pub use copy_rate::copy_rate;
pub use kernel::{Access, Kernel, Pipeline, WORKGROUP};
pub use limits::Limits;
pub use parameters::Parameters;
pub use program::{BindGroup, Buffer, Command, Memory, Program, Segment};
pub use queue::{PATIENCE, Queue};
pub use solver::GpuSolver;
