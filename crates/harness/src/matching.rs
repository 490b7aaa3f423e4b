//! What `bp match` does with a pair: options make a plan, a session runs it, outputs are written, a report is told.

mod finishing;
pub(crate) mod labels;
mod memory;
mod outputs;
pub(crate) mod plan;
mod report;
mod session;
pub(crate) mod warnings;

pub(crate) use finishing::Sample;
pub(crate) use outputs::{Content, Making, Outputs};
pub(crate) use report::{Report, text};
pub(crate) use session::{Answer, Session};
