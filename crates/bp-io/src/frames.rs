//! Frames of a video, one after another, as programs such as ffmpeg pass them through pipes.

mod source;
mod target;

pub use source::{Frames, Layout, PairFrames};
pub use target::FrameFormat;
