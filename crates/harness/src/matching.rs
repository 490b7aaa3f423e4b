//! What `bp match` does with a pair: options make a plan, a session runs it, outputs are written, a report is told;
//! and how `batch` does so with many.

pub(crate) mod batch;
mod finishing;
pub(crate) mod labels;
mod memory;
mod outputs;
mod pairs;
pub(crate) mod plan;
mod report;
mod session;
pub(crate) mod warnings;

pub(crate) use batch::Shard;
pub(crate) use finishing::Sample;
pub(crate) use outputs::{Content, Making, Outputs};
#[cfg(feature = "fuzzing")]
pub(crate) use pairs::parse as listed_pairs;
pub(crate) use report::{Report, Tiles, text};
pub(crate) use session::{Answer, Session};
