//! The only code that takes times. Contestants take turns, round after round, so that other load on the machine affects
//! all of them alike. Every comparison uses their samples.
//!
//! * `runner` opens a device on a pool of threads, and reopens it if it was lost.
//! * `solve` prepares a plan on a runner and times it.
//! * `arranged` does so with one worker, or with the parts of a cut image side by side or in turn.
//! * `turns` is the loop. It takes any contestant: a solve, or a closure that returns a sample.
//! * `meter` reports how far the loop has come and stops it.

mod arranged;
mod meter;
mod runner;
mod solve;
mod turns;

pub use arranged::Arranged;
pub use meter::Meter;
pub use runner::{Asked, Runner};
pub use solve::Solve;
pub use turns::{Contestant, Entrant, Rules, SLOW_MS, SLOW_ROUNDS, take_turns};
