//! A device that is opened once and prepared anew only where a pair needs another plan than the one before.

use bp_core::{Device, DisparityMap, Energy, Plan, Progress, Side, StereoPair, Tiled, Times};
use sha2::{Digest, Sha256};

use super::{
    memory::{self, Fitted},
    plan,
    report::Tiles,
};
use crate::{
    args::MatchArgs,
    backends::{self, Opened},
    failure::Failure,
    files::hex,
    interrupt, record, threads,
};

/// An open device, and what it is prepared for.
pub(crate) struct Session<'a> {
    args: &'a MatchArgs,
    opened: Opened,
    /// And how many bytes it was predicted to take.
    prepared: Option<(Tiled, u64)>,
}

/// What came out of a pair.
pub(crate) struct Answer {
    /// The disparity map.
    pub(crate) map: DisparityMap,
    /// Times of every match, in order.
    pub(crate) samples: Vec<Times>,
    /// The energy of the labels.
    pub(crate) energy: Energy,
    /// The settings as records tell them.
    pub(crate) settings: record::Settings,
    /// The tiles, where the pair was not matched as a whole.
    pub(crate) tiles: Option<Tiles>,
    /// Bytes allocated for the plan.
    pub(crate) allocated_bytes: u64,
    /// Most bytes that the program was predicted to hold at a time.
    pub(crate) peak_bytes: u64,
    /// SHA-256 of all final messages, where it was asked for.
    pub(crate) messages_sha256: Option<String>,
}

impl<'a> Session<'a> {
    /// Opens the device that the options name.
    pub(crate) fn open(args: &'a MatchArgs) -> Result<Self, Failure> {
        let opened = backends::open(&args.plan.backend, args.plan.device.as_deref())?;
        threads::check(args.plan.threads, &[&opened])?;
        Ok(Self { args, opened, prepared: None })
    }

    /// The device.
    pub(crate) fn opened(&self) -> &Opened {
        &self.opened
    }

    /// Matches a pair as often as the options say.
    pub(crate) fn solve(&mut self, pair: &StereoPair, plan: Plan) -> Result<Answer, Failure> {
        let Self { args, opened, prepared } = self;
        let device = opened.device.as_ref();
        // What was prepared for another plan is freed first.
        let (mut tiled, peak_bytes) = match prepared.take().filter(|(tiled, _)| *tiled.plan() == plan) {
            Some(prepared) => prepared,
            None => {
                let Fitted { tiling, peak_bytes } = memory::fitted(args, &plan, opened)?;
                (Tiled::new(device, tiling)?, peak_bytes)
            }
        };
        let samples = take_samples(&mut tiled, device, pair, args.repeat)?;
        let messages_sha256 = args.messages_hash.then(|| hash_messages(&mut tiled)).transpose()?;
        tiled.free_tiles();
        let answer = Answer {
            energy: Energy::of(pair, tiled.plan().model(), tiled.labels())?,
            map: tiled.disparities(),
            samples,
            settings: plan::recorded_settings(&args.plan, tiled.tiling(), opened)?,
            tiles: Tiles::of(tiled.tiling()),
            allocated_bytes: tiled.allocated_bytes(),
            peak_bytes,
            messages_sha256,
        };
        interrupt::check()?;
        // The memory of tiles is for writing the answer.
        *prepared = tiled.tiling().is_whole().then_some((tiled, peak_bytes));
        Ok(answer)
    }
}

/// Matches the pair so many times.
fn take_samples(tiled: &mut Tiled, device: &dyn Device, pair: &StereoPair, repeat: u32) -> Result<Vec<Times>, Failure> {
    let updates = tiled.tiling().message_updates();
    let bar = interrupt::ProgressBar::new(updates.saturating_mul(repeat.into()));
    let mut samples = Vec::new();
    for index in 0..u64::from(repeat) {
        let before = updates.saturating_mul(index);
        let observer = &mut |progress: Progress| bar.update(before.saturating_add(progress.done));
        samples.push(tiled.solve_observed(device, pair, observer)?);
    }
    bar.finish();
    Ok(samples)
}

fn hash_messages(tiled: &mut Tiled) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    for side in Side::ALL {
        hash.update(tiled.messages(side)?);
    }
    Ok(hex(&hash.finalize()))
}
